# SPDX-License-Identifier: Apache-2.0
# brainforest grow under mpirun: the same bytes with 1, 2 and 4 programs, gone on with by another number of them; one that
# fails ends all with its sentence, status 1 and nothing under the final name.
trap 'echo "failed in line $LINENO: $BASH_COMMAND"' ERR

source "$FOREST_SOURCE_DIR/tests/words.sh"
if ! command -v mpirun >/dev/null || [ ! -e "$(dirname "$BRAINFOREST")/brainforest-mpi.so" ]; then
  echo "mpirun.sh: openmpi-bin or libopenmpi-dev is not installed; ./dev setup installs them"
  [ "${BRAINFOREST_REQUIRE_DATA:-0}" = 1 ] && exit 1
  exit 77
fi
export OMPI_MCA_btl_base_warn_component_unused=0 TMPDIR=/tmp  # paths of sockets may not be long
ranks() { local n=$1; shift; timeout 120 mpirun --oversubscribe --allow-run-as-root -n "$n" "$BRAINFOREST" "$@"; }
grow() { ranks "$1" grow --grammar "${@:2}"; }

"$BRAINFOREST" grow --grammar motoneuron --count 700 --seed 3 --out alone.cells --json >alone.json
for n in 1 2 4; do
  grow $n motoneuron --count 700 --seed 3 --out $n.cells --json >$n.json
  cmp alone.cells $n.cells
  told $n.json 'd["neurons"] == 700'  # said once
  cmp <(sed 's/alone/N/' alone.json) <(sed "s/\"$n.cells/\"N.cells/" $n.json)
done
# More programs than blocks.
"$BRAINFOREST" grow --grammar bes --count 70 --out few.cells >/dev/null
grow 4 bes --count 70 --out few4.cells >/dev/null
cmp few.cells few4.cells

# Killed with four and with two, gone on with by one.
many="--grammar motoneuron --count 6000 --seed 3"
"$BRAINFOREST" grow $many --out many.cells >/dev/null
for n in 4 2; do
  size=$(stat -c %s killed.cells.part 2>/dev/null || echo 0)
  setsid mpirun --oversubscribe --allow-run-as-root -n $n "$BRAINFOREST" grow $many --out killed.cells >/dev/null 2>&1 &
  for wait in $(seq 500); do
    [ "$(stat -c %s killed.cells.part 2>/dev/null || echo 0)" -gt $((size + 500000)) ] && break
    sleep 0.02
  done
  kill -9 -$! 2>/dev/null || true
  wait $! 2>/dev/null || true
  for wait in $(seq 100); do flock -n killed.cells.part true && break; sleep 0.1; done  # programs that lost their mpirun end
  [ -e killed.cells.part ] && [ ! -e killed.cells ]
done
"$BRAINFOREST" grow $many --out killed.cells --json >killed.json
cmp many.cells killed.cells
told killed.json 'd["there_before"] > 0'

# All is there already: nothing changes.
grow 2 motoneuron --count 700 --seed 3 --out alone.cells --json >again.json
told again.json 'd["there_before"] == 700'

# A grammar that fails in a later neuron, which is another rank's: one sentence, and nothing is left.
cat >sometimes.lsys <<'LSYS'
limit: 2000
steps: 40
distribution luck = uniform(0, 1)
axiom: Soma(10) B
begin: B { c = luck() } -> A(c)
rabbits: A(c) : c > 0.99 -> F [+ A(c)] A(c)
walk: A(c) -> F A(c)
LSYS
fails_with 1 'production rabbits' "$BRAINFOREST" grow --grammar sometimes.lsys --count 2000 --seed 1 --out sometimes.cells
cp err.txt alone.txt
fails_with 1 'production rabbits' grow 4 sometimes.lsys --count 2000 --seed 1 --out sometimes.cells
[ "$(grep -c 'production rabbits' err.txt)" = 1 ]
grep -qFf alone.txt err.txt
[ ! -e sometimes.cells ] && [ ! -e sometimes.cells.part ]

# What the first one finds wrong is said once.
fails_with 1 'nobody' grow 2 nobody --count 3 --out x.cells
[ "$(grep -c nobody err.txt)" = 1 ]
fails_with 1 'holds something else' grow 2 bes --count 700 --seed 3 --out alone.cells
cmp alone.cells 2.cells
fails_with 1 'nowhere/x.cells.part: cannot be created' grow 2 bes --count 3 --out nowhere/x.cells

# A folder and a repository have one writer.
fails_with 1 'NAME.cells' grow 2 bes --count 3 --out folder
fails_with 1 'NAME.cells' grow 2 bes --count 3 --repo x.db
[ ! -e folder ] && [ ! -e x.db ]

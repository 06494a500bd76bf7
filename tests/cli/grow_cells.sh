# SPDX-License-Identifier: Apache-2.0
# brainforest grow --out NAME.cells: the neurons of a folder in one file, the same bytes at any number of threads and after any
# number of kills, and what is refused.
trap 'echo "failed in line $LINENO: $BASH_COMMAND"' ERR

source "$FOREST_SOURCE_DIR/tests/words.sh"
grow() { "$BRAINFOREST" grow "$@"; }

# The same neurons as in a folder, at any number of threads.
grow --grammar motoneuron --count 130 --seed 7 --out one.cells --threads 1 --json >one.json
grow --grammar motoneuron --count 130 --seed 7 --out two.cells --threads 2 >/dev/null
cmp one.cells two.cells
[ "$(ls)" = "$(printf 'one.cells\none.json\ntwo.cells')" ]
grow --grammar motoneuron --count 130 --seed 7 --out folder --json >folder.json
told one.json 'd["neurons"] == 130 and d["there_before"] == 0'
told one.json '(lambda f: d["segments"] == f["segments"] and abs(d["length"] / f["length"] - 1) < 1e-9)(json.load(open("folder.json")))'
[ "$(stat -c %s one.cells)" -lt "$(cat folder/*.swc | wc -c)" ]
"$BRAINFOREST" convert one.cells --format swc --out back >out.txt 2>err.txt
[ "$(ls back | wc -l)" = 130 ]
for swc in folder/*.swc; do cmp "$swc" "back/one-$(basename "$swc")"; done
"$BRAINFOREST" import one.cells --repo cells.db --population motoneurons >out.txt
"$BRAINFOREST" measure --repo cells.db --population motoneurons --metric total_length --csv repo.csv >out.txt
"$BRAINFOREST" measure one.cells --metric total_length --csv cells.csv >out.txt
python3 - <<'PY'
import csv
repo, cells = ({r[0].split("-", 1)[-1] if name == "repo.csv" else r[0].split("/")[-1]: float(r[1]) for r in list(csv.reader(open(name)))[1:]} for name in ("repo.csv", "cells.csv"))
assert len(cells) == len(repo) == 130, (len(cells), len(repo))
assert all(abs(repo[n] / cells[n] - 1) < 1e-6 for n in cells), (list(repo)[:2], list(cells)[:2])
PY
"$BRAINFOREST" check one.cells >out.txt

# Started again when all is there, nothing changes; another file is not replaced.
before=$(stat -c %Y.%i one.cells)
grow --grammar motoneuron --count 130 --seed 7 --out one.cells --json >again.json
told again.json 'd["there_before"] == 130 and d["segments"] > 0'
[ "$(stat -c %Y.%i one.cells)" = "$before" ]
refuses 'holds something else' grow --grammar motoneuron --count 130 --seed 8 --out one.cells
refuses 'holds something else' grow --grammar motoneuron --count 131 --seed 7 --out one.cells
refuses 'holds something else' grow --grammar purkinje --count 130 --seed 7 --out one.cells
cmp one.cells two.cells
grow --grammar purkinje --count 3 --seed 7 --out one.cells --force >/dev/null
! cmp -s one.cells two.cells

# Killed at different moments, again and again, it goes on to the same bytes.
many="--grammar bes --count 3000 --seed 5"
grow $many --out whole.cells --json >whole.json
whole=$(stat -c %s whole.cells)
for percent in 2 20 21 45 70 90; do
  "$BRAINFOREST" grow $many --out killed.cells >/dev/null 2>&1 &
  while kill -0 $! 2>/dev/null && [ "$(stat -c %s killed.cells.part 2>/dev/null || echo 0)" -lt $((whole * percent / 100)) ]; do
    sleep 0.005
  done
  kill -9 $! 2>/dev/null || true
  wait $! 2>/dev/null || true
  [ $percent != 2 ] || [ ! -e killed.cells ]
done
grow $many --out killed.cells --json >killed.json
cmp whole.cells killed.cells
[ ! -e killed.cells.part ]
told killed.json 'd["there_before"] > 500'
python3 - <<'PY'
import json
whole, killed = (json.load(open(name)) for name in ("whole.json", "killed.json"))
assert all(whole[key] == killed[key] for key in ("segments", "length", "neurons", "bytes")), (whole, killed)
PY

# A part that was cut off anywhere, or is damaged: what is whole is kept, the rest grown anew.
size=$(stat -c %s two.cells)
for cut in 0 1 39 40 100 $((size / 3)) $((size / 2)) $((size - 49)) $((size - 1)) $size; do
  head -c "$cut" two.cells >cut.cells.part
  grow --grammar motoneuron --count 130 --seed 7 --out cut.cells >/dev/null
  cmp two.cells cut.cells
  rm cut.cells
done
cp two.cells cut.cells.part
printf 'x' | dd of=cut.cells.part bs=1 seek=$((size / 2)) conv=notrunc 2>/dev/null
grow --grammar motoneuron --count 130 --seed 7 --out cut.cells --json >cut.json
told cut.json '0 < d["there_before"] < 130'
cmp two.cells cut.cells

# What is left of another file is told from ours, and nothing of it is touched.
head -c $((size / 2)) two.cells >other.cells.part
cp other.cells.part before
refuses 'its seed is 7, not 8' grow --grammar motoneuron --count 130 --seed 8 --out other.cells
refuses '130 cells, not 200' grow --grammar motoneuron --count 200 --seed 7 --out other.cells
refuses 'its grammar is motoneuron, not bes' grow --grammar bes --count 130 --seed 7 --out other.cells
cmp before other.cells.part
grow --grammar bes --count 3 --seed 7 --out other.cells --force >/dev/null
[ -e other.cells ] && [ ! -e other.cells.part ]
{ cat "$FOREST_SOURCE_DIR/data/grammars/motoneuron.lsys"; echo '# another'; } >motoneuron.lsys
head -c $((size / 2)) two.cells >text.cells.part
refuses 'its grammar hash is' grow --grammar ./motoneuron.lsys --count 130 --seed 7 --out text.cells
printf 'a letter' >letter.cells.part
refuses 'holds something else' grow --grammar bes --count 3 --out letter.cells
[ "$(cat letter.cells.part)" = 'a letter' ]
mkdir folder.cells.part
refuses 'Is a directory' grow --grammar bes --count 3 --out folder.cells

# A part that is not ours though it says so: its last block is grown again and compared.
python3 - <<'PY'
import struct
data = bytearray(open("two.cells", "rb").read())
about, = struct.unpack_from("<Q", data, 24)
first = 40 + about
size, = struct.unpack_from("<Q", data, first + 16)
second = first + 48 + size
# The first block stands for the second: its head says so, and the sums are not ours to make, so it is found damaged.
open("swapped.cells.part", "wb").write(data[:second] + data[first:second])
PY
grow --grammar motoneuron --count 130 --seed 7 --out swapped.cells --json >swapped.json
told swapped.json 'd["there_before"] == 64'
cmp two.cells swapped.cells

# A damaged file is refused by name, wherever it is read.
for at in 3 12 50 $((size / 2)) $((size - 60)) $((size - 5)); do
  cp two.cells spoiled.cells
  printf '\377' | dd of=spoiled.cells bs=1 seek="$at" conv=notrunc 2>/dev/null
  cmp -s two.cells spoiled.cells || fails_with 1 'spoiled.cells' "$BRAINFOREST" convert spoiled.cells --format swc --out spoiled
done
head -c $((size / 2)) two.cells >half.cells
fails_with 1 'goes on where it stopped' "$BRAINFOREST" convert half.cells --format swc --out half
: >empty.cells
fails_with 1 'empty.cells' "$BRAINFOREST" measure empty.cells

# A full disk says so; with room again it goes on.
status=0
(ulimit -f 100; grow --grammar motoneuron --count 130 --seed 7 --out full.cells >/dev/null 2>err.txt) || status=$?
[ $status = 1 ] && grep -q 'full.cells.part: cannot be written' err.txt && [ ! -e full.cells ]
[ "$(wc -l <err.txt)" = 1 ]
grow --grammar motoneuron --count 130 --seed 7 --out full.cells >/dev/null
cmp two.cells full.cells
refuses 'nowhere/x.cells.part' grow --grammar bes --out nowhere/x.cells

# A runaway ends all, is named, and leaves nothing.
printf 'limit: 1000\nsteps: 50\naxiom: A\nrabbits: A -> F [+ A] A\n' >runaway.lsys
refuses 'production rabbits' grow --grammar runaway.lsys --count 200 --out runaway.cells
[ ! -e runaway.cells ] && [ ! -e runaway.cells.part ]

# One program at a time.
(flock -x 9; fails_with 1 'another program' "$BRAINFOREST" grow --grammar bes --count 3 --out locked.cells) 9>locked.cells.part

# A model of a repository, which is then only read.
"$BRAINFOREST" model import "$FOREST_SOURCE_DIR/data/grammars/bes.lsys" --repo models.db >out.txt
cp models.db before.db
grow --model bes --repo models.db --count 3 --seed 1 --out model.cells >/dev/null
cmp models.db before.db

fails_with 2 'time-lapse' grow --grammar bes --out x.cells --time-lapse 10
fails_with 2 'environment' grow --grammar bes --out x.cells --environment column-1000
fails_with 2 'import it' grow --grammar bes --out x.cells --repo x.db
mkdir dir.cells  # a folder of that name is a folder
grow --grammar bes --count 1 --out dir.cells >/dev/null
[ -e dir.cells/bes-0-00000.swc ]

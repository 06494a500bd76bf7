# SPDX-License-Identifier: Apache-2.0
# What is there is not lost: files that hold something else are replaced with --force only, links, pipes and devices stay
# what they are, and a refused command writes nothing.
trap 'echo "failed in line $LINENO: $BASH_COMMAND"' ERR

refuses() {  # command that must end with status 1, name a file that is there, and change nothing
  local got=0
  find . -type f ! -name '*.txt' ! -name '*.db*' -exec md5sum {} + | sort >before.txt
  "$@" >out.txt 2>err.txt || got=$?
  [ "$got" = 1 ] || { echo "status $got, not 1: $*"; cat err.txt; exit 1; }
  grep -q 'is there and holds something else.*nothing was written.*--force' err.txt || { echo "said: $(cat err.txt)"; exit 1; }
  find . -type f ! -name '*.txt' ! -name '*.db*' -exec md5sum {} + | sort | cmp - before.txt
}
grow() { $BRAINFOREST grow --grammar motoneuron "$@" >/dev/null; }

# grow: the same seed again is fine, another neuron under the name is not; more of them are made beside.
grow --count 2 --seed 3 --out grown
cp -r grown kept
grow --count 3 --seed 3 --out grown
[ "$(ls grown | wc -l)" = 3 ]
echo '# mine' >>grown/motoneuron-3-00001.swc
rm grown/motoneuron-3-00000.swc
refuses $BRAINFOREST grow --grammar motoneuron --count 4 --seed 3 --out grown --repo never.db
[ ! -e never.db ]
grow --count 2 --seed 3 --out grown --force
cmp kept/motoneuron-3-00001.swc grown/motoneuron-3-00001.swc

# export onto the folder with the traced originals, which are written otherwise.
mkdir traced
for c in a b c; do sed '1d; s/$/ /' kept/motoneuron-3-00000.swc >traced/$c.swc; echo "# $c" >>traced/$c.swc; done
$BRAINFOREST import traced --repo cells.db >/dev/null
rm traced/a.swc
refuses $BRAINFOREST export --repo cells.db --out traced
grep -q '1 more file' err.txt
[ ! -e traced/a.swc ]
$BRAINFOREST export --repo cells.db --out new >/dev/null
$BRAINFOREST export --repo cells.db --out new >/dev/null
$BRAINFOREST export --repo cells.db --out traced --force >/dev/null
diff -r new traced

# convert, one file and a folder; also a file onto itself.
sed 's/$/ /' kept/motoneuron-3-00000.swc >odd.swc
$BRAINFOREST convert odd.swc even.swc >/dev/null
$BRAINFOREST convert odd.swc even.swc >/dev/null
refuses $BRAINFOREST convert kept/motoneuron-3-00001.swc even.swc
$BRAINFOREST convert kept/motoneuron-3-00001.swc even.swc --force >/dev/null
cmp even.swc kept/motoneuron-3-00001.swc
mkdir odds && sed '1d; s/$/ /' kept/motoneuron-3-00000.swc >odds/x.swc && cp odds/x.swc odds/y.swc
refuses $BRAINFOREST convert odds --format swc --out odds
refuses $BRAINFOREST convert odds/x.swc odds/x.swc
$BRAINFOREST convert odds --format swc --out converted >/dev/null
$BRAINFOREST convert odds --format swc --out converted >/dev/null

# check --repair, onto the files themselves and again.
printf '1 1 0 0 0 5 -1 9\n2 3 0 5 0 1 1\n3 3 0 9 0 1 2\n' >wide.swc
refuses $BRAINFOREST check wide.swc --repair .
[ ! -e wide.swc.log.json ]
$BRAINFOREST check wide.swc --repair mended >/dev/null
$BRAINFOREST check wide.swc --repair mended >/dev/null

# query and measure: the same table again is fine, another one under the name is not.
ask() { $BRAINFOREST query "$1" --repo cells.db --csv answer.csv "${@:2}" >/dev/null; }
ask 'select 1 as one'
ask 'select 1 as one'
refuses $BRAINFOREST query 'select 2 as two' --repo cells.db --csv answer.csv
ask 'select 2 as two' --force
grep -q '^two' answer.csv
$BRAINFOREST measure wide.swc --csv wide.csv >/dev/null
$BRAINFOREST measure wide.swc --csv wide.csv >/dev/null
refuses $BRAINFOREST measure kept --csv wide.csv
$BRAINFOREST measure kept --csv wide.csv --force >/dev/null
[ "$(wc -l <wide.csv)" = 3 ]

# Links stay and lead; what is no regular file takes the bytes and stays.
mkdir linked && touch linked/target && ln -s linked/target link.swc
$BRAINFOREST convert wide.swc link.swc --force >/dev/null
[ -L link.swc ]
cmp linked/target mended/wide.swc
mkfifo pipe.swc
cat pipe.swc >through &
$BRAINFOREST convert wide.swc pipe.swc >/dev/null
wait $!
[ -p pipe.swc ]
cmp through mended/wide.swc
$BRAINFOREST query 'select 1 as one' --repo cells.db --csv /dev/null >/dev/null
$BRAINFOREST query 'select 1 as one' --repo cells.db --csv /dev/stdout | grep '^one' >/dev/null
$BRAINFOREST query 'select 1 as one' --repo cells.db --csv /dev/stdout >all.txt 2>told.txt
[ "$(cat all.txt)" = $'one\r\n1\r' ] && grep -q '1 row' told.txt  # what it says goes elsewhere
got=0
$BRAINFOREST query 'select 1 as one' --repo cells.db --csv /dev/full >/dev/null 2>err.txt || got=$?
[ "$got" = 1 ] && grep -q '/dev/full: cannot be written' err.txt
[ -c /dev/full ] && [ -c /dev/null ]

# Nor is a neuron that is measured or fitted, whatever is forced.
md5sum traced/*.swc >neurons.txt
for words in "measure traced --csv" "classify traced --report" "typical traced/a.swc --population traced --report" "fit traced -o" \
  "compare traced kept --report" "distributions traced --report"; do
  got=0
  $BRAINFOREST $words traced/b.swc --force >out.txt 2>err.txt || got=$?
  [ "$got" = 1 ] && grep -q 'traced/b.swc is a neuron that is read here, so it is not replaced' err.txt
done
md5sum -c neurons.txt >/dev/null

# A pipe as input is refused at once.
got=0
timeout 20 $BRAINFOREST import pipe.swc --repo pipe.db >/dev/null 2>err.txt || got=$?
[ "$got" = 1 ] && grep -q 'pipe.swc: is a pipe' err.txt

# SPDX-License-Identifier: Apache-2.0
# brainforest grow: into a repository and into a folder, the same every time, and what it refuses.
trap 'echo "failed in line $LINENO: $BASH_COMMAND"' ERR

source "$FOREST_SOURCE_DIR/tests/words.sh"

for grammar in motoneuron purkinje pyramidal; do
  $BRAINFOREST grow --help | grep -q $grammar
  $BRAINFOREST grow --grammar $grammar --count 3 --seed 7 --out one --threads 1 >/dev/null
  $BRAINFOREST grow --grammar $grammar --count 3 --seed 7 --out four --threads 4 >/dev/null
done
[ "$(ls one | wc -l)" = 9 ]
diff -r one four
! cmp -s one/pyramidal-7-00000.swc one/pyramidal-7-00001.swc

# Neurons of a repository are those of the folder, with where they come from.
$BRAINFOREST grow --grammar pyramidal --count 3 --seed 7 --repo cells.db --population L5 --json >grown.json
python3 - <<'PY'
import json, sqlite3
grown = json.load(open("grown.json"))
assert (grown["grammar"], grown["seed"], grown["neurons"]) == ("pyramidal", 7, 3), grown
assert grown["segments"] > 900
PY
$BRAINFOREST measure --repo cells.db --population L5 --metric total_length,number_of_segments --csv repo.csv >/dev/null
$BRAINFOREST measure one/pyramidal-*.swc --metric total_length,number_of_segments --csv files.csv >/dev/null
python3 - <<'PY'
import csv
repo, files = (list(csv.reader(open(name, encoding="utf-8")))[1:] for name in ("repo.csv", "files.csv"))
assert len(repo) == 3
for a, b in zip(repo, files):
    assert a[2] == b[2] and abs(float(a[1]) / float(b[1]) - 1) < 1e-4, (a, b)
PY
cp cells.db before.db
$BRAINFOREST grow --grammar pyramidal --count 3 --seed 7 --repo cells.db --population L5 >/dev/null  # again: nothing changes
cmp cells.db before.db

# A grammar of one's own; its mistakes are named by line and column.
printf 'title: a stick\nsteps: 3\naxiom: Soma(10) f(5) A\ngrow: A -> F(10, 1) A\n' >stick.lsys
$BRAINFOREST grow --grammar stick.lsys --out stick >/dev/null
grep -q 'stick' stick/stick-0-00000.swc
sed 's/F(10/F(ten/' stick.lsys >bad.lsys
fails_with 1 "bad.lsys:4: column 14: 'ten' is not known" $BRAINFOREST grow --grammar bad.lsys --out bad
[ ! -e bad ]

# A runaway is stopped, named, and leaves nothing behind.
printf 'limit: 1000\nsteps: 50\naxiom: A\nrabbits: A -> F [+ A] A\n' >runaway.lsys
fails_with 1 'production rabbits' $BRAINFOREST grow --grammar runaway.lsys --out runaway --repo runaway.db
[ -z "$(ls -A runaway)" ]
$BRAINFOREST grow --grammar bes --count 1 --repo there.db >/dev/null
fails_with 1 'production rabbits' $BRAINFOREST grow --grammar runaway.lsys --repo there.db
$BRAINFOREST model list --repo there.db >models.txt  # no model without neurons
grep -q bes models.txt
[ -z "$(grep runaway models.txt || true)" ]

# A time lapse: the same neuron younger, after every so many steps, up to the last.
$BRAINFOREST grow --grammar bes --count 2 --seed 3 --out lapse --time-lapse 100 --json >lapse.json
python3 - <<'PY'
import json, re, pathlib
assert json.load(open("lapse.json"))["steps"] == [100, 200, 300, 400, 432]
def tree(name):
    rows = [line.split() for line in open(name) if line.strip() and line[0] != "#"]
    return [tuple(map(float, r[2:5])) for r in rows], [int(r[6]) for r in rows]
for i in range(2):
    before = 0
    for step in (100, 200, 300, 400, 432):
        text = pathlib.Path(f"lapse/bes-3-0000{i}-step{step:06}.swc")
        places, parents = tree(text)
        length = sum(sum((a - b) ** 2 for a, b in zip(places[k], places[p - 1])) ** .5 for k, p in enumerate(parents) if p > 1)
        assert length > before, (i, step, length, before)
        before = length
    assert tree(f"lapse/bes-3-0000{i}.swc") == tree(text)  # at the end it is the grown one
PY
[ "$(ls lapse | wc -l)" = 12 ]
# What is full-grown is not written over and over.
printf 'steps: 1000\naxiom: !(1) A(0)\ngo: A(n) : n < 7 -> F(10) A(n + 1)\nend: A(n) ->\n' >seven.lsys
$BRAINFOREST grow --grammar seven.lsys --out seven --time-lapse 2 --json >seven.json
grep -q '"steps": *\[2, *4, *6, *8\]' <(tr -d '\n ' <seven.json | sed 's/,/, /g; s/:/: /g') && [ "$(ls seven | wc -l)" = 5 ]
grep -q 'step.*200' lapse/bes-3-00001-step000200.swc
$BRAINFOREST grow --grammar bes --count 2 --seed 3 --out lapse --time-lapse 100 >/dev/null  # again: nothing changes
echo '# changed' >>lapse/bes-3-00000-step000300.swc
fails_with 1 'step000300.swc is there and holds something else' $BRAINFOREST grow --grammar bes --count 2 --seed 3 --out lapse --time-lapse 100
fails_with 2 'out' $BRAINFOREST grow --grammar bes --repo lapse.db --time-lapse 10
fails_with 2 '' $BRAINFOREST grow --grammar bes --out lapse --time-lapse 0

refuses 'name a folder' $BRAINFOREST grow --grammar pyramidal --out cell.swc
refuses 'name a folder' $BRAINFOREST grow --grammar pyramidal --out cells.ASC --count 3
[ ! -e cell.swc ] && [ ! -e cells.ASC ]
mkdir named.swc && $BRAINFOREST grow --grammar pyramidal --out named.swc >/dev/null && [ -e named.swc/pyramidal-0-00000.swc ]
fails_with 1 'motoneuron, purkinje, pyramidal' $BRAINFOREST grow --grammar nobody --out x
fails_with 2 '' $BRAINFOREST grow --grammar pyramidal
fails_with 2 '' $BRAINFOREST grow --grammar pyramidal --out x --population L5
fails_with 2 '' $BRAINFOREST grow --grammar pyramidal --out x --count 0

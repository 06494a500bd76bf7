# SPDX-License-Identifier: Apache-2.0
# brainforest plant: a circuit from a repository, read by h5py; the same bytes again; what it refuses.
trap 'echo "failed in line $LINENO: $BASH_COMMAND"' ERR

source "$FOREST_SOURCE_DIR/tests/words.sh"

# Two cells of each of the three populations that the shipped recipes plant.
for population in pyramidal purkinje motoneuron; do two_cells $population 4; done

$BRAINFOREST plant --recipe column-1000 --repo cells.db --seed 7 --out column/ >planted.txt
grep -q '^L4 .*Purkinje cell' planted.txt
grep -q '^1000 neurons of 6 shapes' planted.txt
/usr/bin/python3 "$FOREST_SOURCE_DIR/tests/sonata_layout.py" column 1000

# The same seed gives the same bytes at any number of threads, over the old circuit too; another seed another circuit.
$BRAINFOREST plant --recipe column-1000 --repo cells.db --seed 7 --out again --threads 1 >/dev/null
diff -r column again
$BRAINFOREST plant --recipe column-1000 --repo cells.db --seed 8 --out again --json >again.json
! diff -rq column again >/dev/null
python3 - <<'PY'
import json
planted = json.load(open("again.json"))
assert planted["neurons"] == 1000 == sum(row["count"] for row in planted["planted"]), planted
assert planted["morphologies"] == 6
PY
[ -z "$(find . -maxdepth 1 -name '.*.??????')" ]  # nothing half written is left

# Names that files cannot have, or that two populations share, do not clash.
cp pyramidal-1.swc same.swc
$BRAINFOREST import same.swc --repo names.db --population pyramidal >/dev/null
$BRAINFOREST import same.swc --repo names.db --population purkinje >/dev/null
$BRAINFOREST import same.swc --repo names.db --population motoneuron >/dev/null
$BRAINFOREST plant --recipe column-1000 --repo names.db --out names >/dev/null
[ "$(ls names/morphologies | wc -l)" = 3 ]
/usr/bin/python3 "$FOREST_SOURCE_DIR/tests/sonata_layout.py" names 1000

# Neurons that are taller than all tissue above them are told of.
printf 'name = "thin"\nneurons = 20\n[column]\nradius = 200\n[[type]]\nname = "tall"\npopulation = "pyramidal"\n[[layer]]\nname = "L"\nthickness = 90\ndensity = 2000\nmix = { tall = 1 }\n' >thin.toml
$BRAINFOREST plant --recipe thin.toml --repo names.db --out thin 2>thin.txt >/dev/null
grep -q '^1 of the 1 neurons of type tall are taller than the tissue in which it is planted; the lowest stands for all' thin.txt

# What is wrong is said in a sentence with what to do, and nothing is left behind.
$BRAINFOREST import pyramidal-1.swc --repo few.db --population pyramidal >/dev/null
fails_with 1 'populations purkinje, motoneuron, which are empty; grow' $BRAINFOREST plant --recipe column-1000 --repo few.db --out few
fails_with 1 'column-1000, column-10000' $BRAINFOREST plant --recipe nosuch --repo cells.db --out few
sed 's/^radius = .*/radius = 20/' "$FOREST_SOURCE_DIR/data/recipes/column-1000.toml" >narrow.toml
fails_with 1 'do not fit without overlap' $BRAINFOREST plant --recipe narrow.toml --repo cells.db --out few
sed 's/^radius/diameter/' narrow.toml >wrong.toml
fails_with 1 'no key "diameter"' $BRAINFOREST plant --recipe wrong.toml --repo cells.db --out few
grep -q 'wrong.toml:[0-9]*: .*no key "diameter"' err.txt
fails_with 1 'few.db' $BRAINFOREST plant --recipe column-1000 --repo no/few.db --out few
[ ! -e few ]
mkdir mine && echo notes >mine/notes.txt
fails_with 1 'not replaced' $BRAINFOREST plant --recipe column-1000 --repo cells.db --out mine
[ "$(ls mine)" = notes.txt ]
fails_with 2 '--recipe' $BRAINFOREST plant --repo cells.db --out few
fails_with 2 '' $BRAINFOREST plant --recipe column-1000 --repo cells.db --out few --seed x

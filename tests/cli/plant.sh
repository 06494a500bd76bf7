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

# Neurons from slices are stretched along z: by so many times, or until they go as far along z as along x.
printf 'name = "slice"\nneurons = 20\nrotate = false\n[column]\nradius = 200\n[[type]]\nname = "flat"\n[[layer]]\nname = "L"\nthickness = 900\ndensity = 2000\nmix = { flat = 1 }\n' >slice.toml
printf '1 1 0 0 0 5 -1\n2 3 0 9 0 1 1\n3 3 30 30 15 1 2\n4 3 -40 30 20 1 2\n' >flat.swc
$BRAINFOREST import flat.swc --repo flat.db --population flat >/dev/null
$BRAINFOREST plant --recipe slice.toml --repo flat.db --out flat --slice-correction measured >said.txt
grep -q '^neurons of flat are stretched 2.00 times along z, as their dendrites say$' said.txt
grep -q '30 30 30 ' flat/morphologies/flat.swc
$BRAINFOREST plant --recipe slice.toml --repo flat.db --out flat --slice-correction 1.2 --json | grep -A4 slice_correction | grep -q '"factor": 1.2'
grep -q ' 30 30 18 ' flat/morphologies/flat.swc
sed 's/^name = "flat"/&\nslice-correction = 1.4/' slice.toml >corrected.toml
$BRAINFOREST plant --recipe corrected.toml --repo flat.db --out flat --slice-correction measured >/dev/null
grep -q ' 30 30 21 ' flat/morphologies/flat.swc
fails_with 1 "'twice' corrects no slice" $BRAINFOREST plant --recipe slice.toml --repo flat.db --out few --slice-correction twice
sed 's/1.4/"much"/' corrected.toml >wrong.toml
fails_with 1 "wrong.toml:8: 'much' corrects no slice" $BRAINFOREST plant --recipe wrong.toml --repo flat.db --out few
sed 's/ 15 1 2/ 1 1 2/; s/ 20 1 2/ 1 1 2/' flat.swc >plane.swc
$BRAINFOREST import plane.swc --repo plane.db --population flat >/dev/null
fails_with 1 'neurons of flat go 1/35 as far along z as along x' $BRAINFOREST plant --recipe slice.toml --repo plane.db --out few --slice-correction measured

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

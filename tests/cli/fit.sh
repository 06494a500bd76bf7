# SPDX-License-Identifier: Apache-2.0
# brainforest fit: a model of neurons from files and from a repository, and what it refuses.
trap 'echo "failed in line $LINENO: $BASH_COMMAND"' ERR

source "$FOREST_SOURCE_DIR/tests/words.sh"

$BRAINFOREST grow --grammar motoneuron --count 12 --seed 1 --out traced --repo cells.db --population traced >/dev/null

$BRAINFOREST fit traced -o like_them.lsys --json >fit.json
python3 - <<'PY'
import json
fit = json.load(open("fit.json"))
assert fit["neurons"] == 12 and fit["samples"]["cells"] == 12, fit
assert fit["samples"]["forks"] > 100, fit
assert fit["calibration"]["tastes"] == 0, fit
PY
$BRAINFOREST grow --grammar like_them.lsys --count 8 --seed 1 --out one --threads 1 >/dev/null
$BRAINFOREST grow --grammar like_them.lsys --count 8 --seed 1 --out two --threads 2 >/dev/null
diff -r one two

# A taste says behind the same grammar which of some candidates are liked; it grows the same on any number of threads.
$BRAINFOREST fit traced -o tasting.lsys --calibrate --candidates 3 --json >tasting.json
python3 - <<'PY'
import json
calibration = json.load(open("tasting.json"))["calibration"]
assert calibration["gap_after"] <= calibration["gap_before"], calibration
assert calibration["rounds"] > 0 and calibration["tastes"] > 20 and calibration["candidates"] == 3, calibration
PY
grep -q '^# Fitted by brainforest .* to 12 neurons of traced: fit --kind dendrite .* --calibrate --candidates 3 --seed 1$' tasting.lsys
grep -q '^# They are .*motoneuron-1-00000' tasting.lsys
for model in tasting like_them; do sed 1d $model.lsys >$model.rest; done
head -c "$(stat -c %s like_them.rest)" tasting.rest | cmp - like_them.rest
$BRAINFOREST grow --grammar tasting.lsys --count 8 --seed 1 --out tasted_one --threads 1 >/dev/null
$BRAINFOREST grow --grammar tasting.lsys --count 8 --seed 1 --out tasted_two --threads 2 >/dev/null
diff -r tasted_one tasted_two
$BRAINFOREST grow --grammar tasting.lsys --count 300 --seed 1 --out whole.cells >/dev/null
$BRAINFOREST grow --grammar tasting.lsys --count 300 --seed 1 --out parted.cells --threads 1 >/dev/null
cmp whole.cells parted.cells
fails_with 2 '--calibrate' $BRAINFOREST fit traced -o no.lsys --candidates 3

# From a repository, under a name.
$BRAINFOREST fit --repo cells.db --population traced --model like_traced >/dev/null
$BRAINFOREST model list --repo cells.db >models.txt
grep -q 'like_traced.*fitted to 12 neurons of traced' models.txt
$BRAINFOREST grow --repo cells.db --model like_traced --count 4 --seed 1 --population grown >/dev/null
$BRAINFOREST query "select count(*) from neuron where population = 'grown'" --repo cells.db >count.txt
grep -qw 4 count.txt

mkdir few && cp "$(find traced -name '*.swc' | sort | head -1)" few
refuses 'needs two such neurons' $BRAINFOREST fit few -o few.lsys
[ ! -e few.lsys ]
refuses 'none of the 12 neurons of traced has a section of kind axon' $BRAINFOREST fit traced --kind axon -o axon.lsys
refuses "finds nothing in any name" $BRAINFOREST fit traced --calibrate --slices nosuch -o axon.lsys
fails_with 2 '--calibrate' $BRAINFOREST fit traced --slices nosuch -o axon.lsys
fails_with 2 'nosuch' $BRAINFOREST fit traced --kind dendrite nosuch -o axon.lsys
fails_with 2 'is no name' $BRAINFOREST fit traced --model "$(printf 'a\tb')" --repo cells.db
printf 'no repository\n' >no.db
refuses 'no.db' $BRAINFOREST fit "$(pwd)/nobody" --model like_traced --repo no.db  # asked before anything is read
fails_with 2 'is no number from 0.01 to 100' $BRAINFOREST fit traced --style -1 -o axon.lsys
refuses 'its folder is not there' $BRAINFOREST fit traced -o nowhere/axon.lsys
printf 'mine\n' >kept.lsys
refuses '--force' $BRAINFOREST fit traced -o kept.lsys
grep -q mine kept.lsys

# What is far from all else would be grown again: it is told, and refused where no neuron reaches.
cp -r traced slips
awk '!/^#/ && $2 == 3 && ++n == 40 { $4 = 90000 } { print }' "$(find traced -name '*.swc' | sort | head -1)" >slips/far.swc
$BRAINFOREST fit slips -o slips.lsys >/dev/null 2>told.txt
grep -q '1 of 13 neurons has what may be a slip, which will be grown again, first far: a segment of ' told.txt
awk '!/^#/ && $2 == 3 && ++n == 40 { $4 = 1e30 } { print }' "$(find traced -name '*.swc' | sort | head -1)" >slips/far.swc
refuses 'farther away than any neuron reaches; mend it' $BRAINFOREST fit slips -o no.lsys
[ ! -e no.lsys ]

# Mistakes of a grammar that only growing shows have their line; a repository is not left without a neuron.
printf 'steps: 2\naxiom: A(1)\n\ng: A(x) ->\n  F(0/0)\n' >nothing.lsys
refuses 'nothing.lsys:4: production g gives F a parameter that is not a finite number' $BRAINFOREST grow --grammar nothing.lsys --repo nothing.db
[ ! -e nothing.db ]
printf 'steps: 2\naxiom: Soma(9) basal A\ng: A -> F(1)\n' >misspelt.lsys
$BRAINFOREST grow --grammar misspelt.lsys --out misspelt >/dev/null 2>told.txt
grep -q "misspelt.lsys:2: 'basal' is read as 5 modules of one letter" told.txt
refuses "model 'like_traced' has no distribution 'nothing'; it has " $BRAINFOREST model show like_traced.nothing --repo cells.db

# Published forms are models of the same kind: fitted, stored, grown.
for form in burke hillman; do
  $BRAINFOREST fit traced --form $form -o $form.lsys >/dev/null 2>&1
  grep -q "^# Fitted by brainforest .* --kind dendrite --form $form --seed 1$" $form.lsys
  $BRAINFOREST fit traced --form $form --seed 1 -o $form-1.lsys >/dev/null 2>&1
  $BRAINFOREST fit traced --form $form --seed 2 -o $form-2.lsys >/dev/null 2>&1
  cmp $form.lsys $form-1.lsys
  ! cmp -s <(sed 1d $form.lsys) <(sed 1d $form-2.lsys)
  $BRAINFOREST fit --repo cells.db --population traced --form $form --model $form >/dev/null 2>&1
  $BRAINFOREST model list --repo cells.db | grep -q "^$form "
  $BRAINFOREST grow --repo cells.db --model $form --count 3 --seed 1 --out by_$form >/dev/null
  [ "$(ls by_$form | wc -l)" = 3 ]
done
fails_with 2 'excludes' $BRAINFOREST fit traced --form burke --calibrate -o both.lsys
fails_with 2 'nothing is drawn' $BRAINFOREST fit traced --seed 2 -o both.lsys

# Fitted to files, a model is said to describe the population that is named.
$BRAINFOREST fit traced --model of_files --repo cells.db --population rats >/dev/null
$BRAINFOREST model list --repo cells.db --population rats | grep -q '^of_files .* rats .*fitted to 12 neurons of traced'
fails_with 2 '--model' $BRAINFOREST fit traced -o both.lsys --repo cells.db --population rats

# Axons that never fork keep to one tip.
cp -r traced stubs
for file in stubs/*-0000[02].swc; do
  printf '%s 2 0 %s 0 .5 %s\n' 900001 -20 1 900002 -30 900001 900003 -40 900002 >>$file
done
$BRAINFOREST fit stubs --kind all -o stubs.lsys >/dev/null 2>&1
grep -q '^table most_tips = 2: 1, 3: ' stubs.lsys
$BRAINFOREST grow --grammar stubs.lsys --count 40 --seed 1 --out stubs_grown >/dev/null

# A population may have any name.
$BRAINFOREST import traced/*-0000[0-3].swc --repo cells.db --population 'mine/*' >/dev/null
$BRAINFOREST fit --repo cells.db --population 'mine/*' --form burke -o odd.lsys >/dev/null 2>&1
grep -qF 'title: neurons like those of mine/ ' odd.lsys

# The judge grows from the model and fits the control that it must reject.
$BRAINFOREST grow --grammar motoneuron --count 12 --seed 2 --out others >/dev/null
$BRAINFOREST judge --model like_them.lsys --train traced --held-out others --count 10 --populations 3 --repeats 2 --features judged.csv --json >judged.json
python3 - <<'PY'
import json
judged = json.load(open("judged.json"))
assert judged["cells"]["grown"] == 10 and judged["seeds"] == [0, 1, 2], (judged["cells"], judged["seeds"])
groups = [line.split(",")[1] for line in open("judged.csv", encoding="utf-8-sig")][1:]
assert [groups.count(g) for g in ("grown", "grown 2", "grown 3")] == [10, 10, 10], groups
assert 1 <= judged["copying"]["longest_run"] <= 3, judged["copying"]
assert judged["controls"]["burke"]["rejected"] in (True, False)
PY
refuses 'judged.csv is there already' $BRAINFOREST judge --model like_them.lsys --train traced --held-out others --features judged.csv

# SPDX-License-Identifier: Apache-2.0
# brainforest measure: what it prints and writes, what it refuses, and that threads change nothing.
trap 'echo "failed in line $LINENO: $BASH_COMMAND"' ERR

source "$FOREST_SOURCE_DIR/tests/words.sh"

# A stem of 10 µm that forks at a right angle into two terminals of 10 µm.
cat >fork.swc <<'SWC'
1 1 0 0 0 5 -1
2 3 0 5 0 1 1
3 3 0 15 0 1 2
4 3 10 15 0 1 3
5 3 0 25 0 1 3
SWC
sed 's/ 3 / 4 /' fork.swc >"apical, one.swc"

$BRAINFOREST measure fork.swc >one.txt
grep -Eq '^total_length +µm +30( |$)' one.txt
grep -Eq '^remote_bifurcation_angles +° +90 ' one.txt

$BRAINFOREST measure fork.swc "apical, one.swc" --csv cells.csv >two.txt
grep -q 'total_length (µm)' two.txt
python3 - <<'PY'
import csv
rows = list(csv.DictReader(open("cells.csv", encoding="utf-8")))
assert [r["neuron"] for r in rows] == ["fork.swc", "apical, one.swc"], rows
for row in rows:
    assert float(row["total_length (µm)"]) == 30
    assert float(row["number_of_leaves"]) == 2
    assert float(row["section_lengths mean (µm)"]) == 10
    assert row["rall_power mean"] == ""  # not defined where a daughter is as thick as its parent
PY

# Only what is asked for, by L-Measure's names too; nothing of a kind is 0 long and has no furthest terminal.
[ "$($BRAINFOREST measure fork.swc "apical, one.swc" --kind basal --metric N_tips,total_length max_path_distance --json |
  python3 -c 'import json,sys; print(json.load(sys.stdin)["rows"])')" = \
  "[{'neuron': 'fork.swc', 'number_of_leaves': 2.0, 'total_length': 30.0, 'max_path_distance': 20.0}, {'neuron': 'apical, one.swc', 'number_of_leaves': 0.0, 'total_length': 0.0, 'max_path_distance': None}]" ]

# All cells of a container, a file named twice once, and folders by as much of their paths as tells them apart.
mkdir -p a/cells b/cells
cp fork.swc a/cells && cp fork.swc b/cells/other.swc
$BRAINFOREST convert a/cells b/cells --out both.h5 >/dev/null
[ "$($BRAINFOREST measure both.h5 --metric total_length --json | python3 -c 'import json,sys; print(len(json.load(sys.stdin)["rows"]))')" = 2 ]
$BRAINFOREST measure a/cells b/cells --by folder --metric total_length >by.txt
grep -Eq 'a/cells +b/cells' by.txt
$BRAINFOREST measure fork.swc ./fork.swc --metric total_length --json >once.json 2>told.txt
[ "$(python3 -c 'import json; print(len(json.load(open("once.json"))["rows"]))')" = 1 ] && grep -q 'named more than once' told.txt

# One row a section, a bifurcation, a shell.
for level in arbor section bifurcation point shell bar; do
  $BRAINFOREST measure fork.swc --level $level --csv $level.csv >/dev/null
done
[ "$(wc -l <section.csv)" = 4 ] && [ "$(wc -l <bifurcation.csv)" = 2 ] && [ "$(wc -l <arbor.csv)" = 2 ]
[ "$(wc -l <point.csv)" = 4 ] && [ "$(wc -l <bar.csv)" = 3 ]
$BRAINFOREST measure fork.swc --level bar --metrics tmd_path_births,tmd_path_deaths --csv bars.csv >/dev/null
[ "$(tail -n +2 bars.csv | tr -d '\r' | sort)" = $'fork.swc,0,0,20,0\nfork.swc,0,1,20,10' ]
[ "$(tail -n 2 shell.csv | tr -d '\r')" = $'fork.swc,10,1\nfork.swc,20,1' ]

$BRAINFOREST measure --list --json | python3 -c 'import json,sys; assert len(json.load(sys.stdin)) >= 100'

# The same bytes at any number of threads.
for i in $(seq 40); do sed "s/ 15 0 / $((14 + i)) 0 /" fork.swc >many_$i.swc; done
$BRAINFOREST measure many_*.swc --threads 1 --csv one.csv >one_thread.txt
$BRAINFOREST measure many_*.swc --threads 4 --csv one.csv.4 >four_threads.txt
cmp one.csv one.csv.4

# A folder is its files, and a repository gives the same values as the files in it.
mkdir cells && mv many_*.swc cells
$BRAINFOREST measure cells --csv files.csv >/dev/null
$BRAINFOREST import cells --repo cells.db --population many >/dev/null
$BRAINFOREST measure --repo cells.db --population many --csv repository.csv >/dev/null
sed -E 's|^cells/(.*)\.swc,|\1,|' files.csv | cmp - repository.csv
$BRAINFOREST measure --repo cells.db --metric total_length >repository.txt
grep -q '^many/many_1 ' repository.txt
fails_with 1 'few' $BRAINFOREST measure --repo cells.db --population few
fails_with 2 'excludes' $BRAINFOREST measure fork.swc --repo cells.db

# By groups: mean and standard deviation over the neurons of each.
$BRAINFOREST import fork.swc --repo types.db --population all --type bush >/dev/null
sed 's/ 25 0 / 35 0 /' fork.swc >longer.swc
$BRAINFOREST import longer.swc --repo types.db --population all --type bush >/dev/null
sed 's/ 25 0 / 45 0 /' fork.swc >longest.swc
$BRAINFOREST import longest.swc --repo types.db --population all >/dev/null
$BRAINFOREST measure --repo types.db --by type --metric total_length,section_lengths --csv types.csv --xlsx types.xlsx >types.txt
grep -Eq '^type +bush +not said$' types.txt
grep -Eq '^neurons +2 +1$' types.txt
grep -Eq '^total_length \(µm\) +35 ± 7.071 +50 ± -$' types.txt
$BRAINFOREST measure --repo types.db --by type --metric total_length,section_lengths --json >types.json
python3 - <<'PY'
import csv, json, zipfile
bush, unsaid = csv.DictReader(open("types.csv", encoding="utf-8"))
assert bush["type"] == "bush" and bush["neurons"] == "2", bush
assert float(bush["total_length mean (µm)"]) == 35 and abs(float(bush["total_length sd (µm)"]) - 50**.5) < 1e-9, bush
assert abs(float(bush["section_lengths mean (µm)"]) - 35 / 3) < 1e-9, bush
assert unsaid["total_length sd (µm)"] == "", unsaid  # of one neuron
out = json.load(open("types.json"))
assert out["by"] == "type" and out["rows"][0]["total_length mean"] == 35, out
names = zipfile.ZipFile("types.xlsx").read("xl/workbook.xml").decode()
assert names.index('"groups"') < names.index('"metrics"'), names
PY
mkdir -p folders/a folders/b && cp fork.swc folders/a && cp longer.swc folders/b
$BRAINFOREST measure folders --by folder --metric total_length | grep -Eq '^total_length \(µm\) +30 ± - +40 ± -$'
fails_with 1 'types.xlsx' $BRAINFOREST measure fork.swc --xlsx types.xlsx
$BRAINFOREST measure fork.swc --xlsx types.xlsx --force >/dev/null
fails_with 2 'ends in .xlsx' $BRAINFOREST measure fork.swc --xlsx types.ods
fails_with 2 'by folder' $BRAINFOREST measure fork.swc --by type
fails_with 2 'by folder' $BRAINFOREST measure --repo types.db --by folder
fails_with 2 'groups are of neurons' $BRAINFOREST measure --repo types.db --by type --level section

# What a repository keeps is found by it; what it does not keep is measured.
[ "$($BRAINFOREST list --repo types.db --where 'max_strahler_order = 2 and total_length > 45' | grep -c longest)" = 1 ]
for condition in '1) or (1' '1 /* ( */) or (1 /* ) */' '(1'; do
  fails_with 1 'is not one expression' $BRAINFOREST list --repo types.db --where "$condition"
done
$BRAINFOREST list --repo types.db --where "(name <> ')(') and length > 0" >/dev/null
fails_with 1 'tmd_path_births' $BRAINFOREST list --repo types.db --where 'tmd_path_births > 1'
$BRAINFOREST measure --repo types.db --metric tmd_path_births,total_length --store >/dev/null
[ "$($BRAINFOREST list --repo types.db --where 'tmd_path_births > 25' | grep -c longest)" = 1 ]
[ "$($BRAINFOREST query "select count(*) from metric where metric = 'tmd_path_births' and unit = 'µm'" --repo types.db --json |
  python3 -c 'import json,sys; print(json.load(sys.stdin)["rows"][0][0])')" = 3 ]
$BRAINFOREST check --repo types.db >/dev/null
$BRAINFOREST export --repo types.db --out tables --format csv >/dev/null && grep -q 'tmd_path_births' tables/metrics.csv
fails_with 1 'type' $BRAINFOREST measure --repo types.db --metric type --store
fails_with 1 '--metric circularity --store' $BRAINFOREST list --repo types.db --where 'circularity >= 0'
$BRAINFOREST measure --repo types.db --store >out.txt  # all but type, which a neuron has anyway
all=$($BRAINFOREST measure --list --json | /usr/bin/python3 -c 'import json, sys; print(len(json.load(sys.stdin)))')
grep -q "^$((all - 1)) metrics of" out.txt
$BRAINFOREST list --repo types.db --where 'circularity >= 0 or circularity is null' >/dev/null
fails_with 2 'whole neurons' $BRAINFOREST measure --repo types.db --kind axon --store
fails_with 2 'repo' $BRAINFOREST measure fork.swc --store

# A bad file is named, the others are measured, and the status says so.
echo nonsense >bad.swc
fails_with 1 'bad.swc' $BRAINFOREST measure bad.swc fork.swc --csv rest.csv
[ "$(wc -l <rest.csv)" = 2 ]
fails_with 1 'nothing was measured' $BRAINFOREST measure bad.swc --csv none.csv
[ ! -e none.csv ]
fails_with 1 'folder' $BRAINFOREST measure fork.swc --csv missing/folder/cells.csv

fails_with 2 'files' $BRAINFOREST measure
fails_with 2 "no metric called 'trunk_vectors', but trunk_vectors_x, trunk_vectors_y, trunk_vectors_z" $BRAINFOREST measure fork.swc --metric trunk_vectors
fails_with 2 "no metric called 'total_lenght', but total_length, total_height;" $BRAINFOREST measure fork.swc --metric total_lenght
fails_with 2 "but Soma_Surface;" $BRAINFOREST measure fork.swc --metric soma_surface
fails_with 2 'no metric called' $BRAINFOREST measure fork.swc --metric lengthiness
fails_with 2 'no kind of section' $BRAINFOREST measure fork.swc --kind dragon
fails_with 2 'no value for each section' $BRAINFOREST measure fork.swc --level section --metric total_length

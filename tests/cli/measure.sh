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

# One row a section, a bifurcation, a shell.
for level in section bifurcation shell; do $BRAINFOREST measure fork.swc --level $level --csv $level.csv >/dev/null; done
[ "$(wc -l <section.csv)" = 4 ] && [ "$(wc -l <bifurcation.csv)" = 2 ]
[ "$(tail -n 2 shell.csv | tr -d '\r')" = $'fork.swc,10,1\nfork.swc,20,1' ]

$BRAINFOREST measure --list --json | python3 -c 'import json,sys; assert len(json.load(sys.stdin)) >= 20'

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

# A bad file is named, the others are measured, and the status says so.
echo nonsense >bad.swc
fails_with 1 'bad.swc' $BRAINFOREST measure bad.swc fork.swc --csv rest.csv
[ "$(wc -l <rest.csv)" = 2 ]
fails_with 1 'nothing was measured' $BRAINFOREST measure bad.swc --csv none.csv
[ ! -e none.csv ]
fails_with 1 'folder' $BRAINFOREST measure fork.swc --csv missing/folder/cells.csv

fails_with 2 'files' $BRAINFOREST measure
fails_with 2 'no metric called' $BRAINFOREST measure fork.swc --metric lengthiness
fails_with 2 'no kind of section' $BRAINFOREST measure fork.swc --kind dragon
fails_with 2 'no value for each section' $BRAINFOREST measure fork.swc --level section --metric total_length

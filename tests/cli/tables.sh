# SPDX-License-Identifier: Apache-2.0
# A population as a workbook and as CSV files: an independent reader finds the neurons, their units and the charts.
trap 'echo "failed in line $LINENO: $BASH_COMMAND"' ERR
for grammar in motoneuron pyramidal; do $BRAINFOREST grow --grammar $grammar --count 4 --seed 2 --repo r.db >out.txt; done
$BRAINFOREST export --repo r.db --population motoneuron --format xlsx --out cells.xlsx >out.txt
$BRAINFOREST export --repo r.db --population motoneuron --format csv --out tables/ --json >files.json
$BRAINFOREST export --repo r.db --population motoneuron --format xlsx --out again.xlsx >out.txt
cmp cells.xlsx again.xlsx
/usr/bin/python3 - <<'PY'
import csv, json, sqlite3, zipfile
import openpyxl
book = openpyxl.load_workbook("cells.xlsx")
assert book.sheetnames == ["summary", "neurons", "sections", "junctions", "metrics", "annotations", "points"], book.sheetnames
db = sqlite3.connect("r.db")
count = lambda view: db.execute(f"select count(*) from {view} where population = 'motoneuron'").fetchone()[0]
assert book["neurons"].max_row == 1 + 4 and book["sections"].max_row == 1 + count("section")
assert book["junctions"].max_row == 1 + count("junction")
header = [cell.value for cell in book["sections"][1]]
assert "length (µm)" in header and "area (µm²)" in header and "kind" in header, header
length = header.index("length (µm)")
total = sum(row[length].value for row in book["sections"].iter_rows(min_row=2))
assert abs(total - db.execute("select sum(length) from neuron where population = 'motoneuron'").fetchone()[0]) < 1e-6 * total
metrics = {c.value: c.column for c in book["metrics"][1]}
column = metrics["total_length (µm)"]
values = [book["metrics"].cell(row, column).value for row in range(2, 6)]
assert abs(sum(values) - total) < 1e-6 * total
summary = {row[0].value: row for row in book["summary"].iter_rows(min_row=2)}
assert abs(summary["total_length"][3].value - total / 4) < 1e-6 * total and summary["total_length"][2].value == 4
assert len([n for n in zipfile.ZipFile("cells.xlsx").namelist() if n.startswith("xl/charts/chart")]) == 4
files = json.load(open("files.json"))["files"]
assert len(files) == 7, files
rows = list(csv.reader(open("tables/sections.csv", newline="", encoding="utf-8")))
assert rows[0] == header and len(rows) == book["sections"].max_row
PY
# A full disk, also where the sheets lie before they are packed: a sentence, and no part of a workbook.
for room in 4 20 100 400 800; do  # KiB
  for command in "export --format xlsx --out" "measure --xlsx"; do
    rm -f full.xlsx
    if (ulimit -f $room && exec $BRAINFOREST $command full.xlsx --repo r.db) >out.txt 2>err.txt; then
      /usr/bin/python3 -c 'import openpyxl; book = openpyxl.load_workbook("full.xlsx"); assert book.worksheets[-1].max_row > 1'
    else
      grep -q 'room' err.txt && [ ! -e full.xlsx ] || { echo "$command with $room KiB: $(cat err.txt)"; exit 1; }
    fi
  done
done
! (ulimit -f 400 && exec $BRAINFOREST export --repo r.db --format xlsx --out full.xlsx) >out.txt 2>err.txt
! $BRAINFOREST export --repo r.db --format xlsx --out /nowhere/cells.xlsx 2>err.txt
[ ! -e /nowhere ]
if $BRAINFOREST export --repo r.db --format xlsx --out cells.xlsx 2>err.txt; then exit 1; fi  # an edited workbook is not lost
grep -q -- --force err.txt

# Any of the CSV files that is there is not lost either, and what has the name of something else is no target.
refuses() {  # words, arguments
  local words=$1 got=0
  shift
  $BRAINFOREST export --repo r.db "$@" >/dev/null 2>err.txt || got=$?
  [ "$got" = 1 ] && grep -q -- "$words" err.txt || { echo "status $got, said: $(cat err.txt)"; exit 1; }
}
for sheet in summary neurons sections junctions metrics annotations points; do
  rm -rf edited && mkdir edited && echo mine >edited/$sheet.csv
  refuses "edited/$sheet.csv is there already.*--force" --format csv --out edited
  [ "$(cat edited/*)" = mine ]
done
$BRAINFOREST export --repo r.db --format csv --out edited --force >/dev/null
[ "$(ls edited | wc -l)" = 7 ]
refuses 'a.xls: a workbook.s name ends in .xlsx' --format xlsx --out a.xls
refuses 'a.csv: csv is one file a sheet' --format csv --out a.csv
refuses 'a.XLSX: csv is one file a sheet' --format csv --out a.XLSX
[ ! -e a.xls ] && [ ! -e a.csv ] && [ ! -e a.XLSX ]

# SPDX-License-Identifier: Apache-2.0
# A workbook is exported, edited by a program that is not ours, and imported: what a person may change comes back exactly,
# what does not fit is refused by its cell, and then nothing is stored.
trap 'echo "failed in line $LINENO: $BASH_COMMAND"' ERR

cat >a.swc <<'SWC'
# RAW a note
1 1 0 0 0 8 -1
2 3 0 8.1 0 1.05 1
3 3 0 18.25 0.1 1 2
4 3 6.7 28 0 .7 3
5 3 7 38 0 .5 4
6 3 -6 28.123 0 .8 3
SWC
sed 's/^5 3 7 /5 3 9 /' a.swc >b.swc
$BRAINFOREST import a.swc b.swc --repo cells.db --population P --species rat >out.txt
printf 'steps: 4\naxiom: Soma(10) Basal f(5) A\ngrow: A -> F(uniform(9, 11), 1) [ +(30) A ] -(30) A\n' >bush.lsys
$BRAINFOREST grow --grammar bush.lsys --count 2 --seed 2 --repo cells.db >out.txt
$BRAINFOREST export --repo cells.db --format xlsx --out book.xlsx >out.txt
$BRAINFOREST export --repo cells.db --format csv --out tables >out.txt
cp cells.db first.db
cat >edit.py <<'PY'
"""Each edit is a function of the open workbook; the test says what becomes of it."""
import json, os, shutil, sqlite3, subprocess, sys
import openpyxl

program = os.environ["BRAINFOREST"]

def place(sheet, keys, column):
    """The cell of the row whose columns are these."""
    titles = {cell.value: cell.column for cell in sheet[1]}
    title = next(t for t in titles if t == column or t.startswith(column + " ("))
    for row in sheet.iter_rows(min_row=2):
        if all(row[titles[k] - 1].value == v for k, v in keys.items()):
            return row[titles[title] - 1]
    raise KeyError(keys)

def run(book, *options, status=0, repo="cells.db"):
    done = subprocess.run([program, "import", book, "--repo", repo, "--json", *options], capture_output=True, text=True)
    assert done.returncode == status, (done.returncode, done.stdout, done.stderr)
    return json.loads(done.stdout) if done.stdout else None, done.stderr

def edited(edit, *options, status=0, source="book.xlsx"):
    shutil.copy("first.db", "cells.db")
    book = openpyxl.load_workbook(source)
    edit(book)
    book.save("edited.xlsx")
    before = open("cells.db", "rb").read()
    result, errors = run("edited.xlsx", *options, status=status)
    if status or options:
        assert open("cells.db", "rb").read() == before, "something was stored"
    return result, errors

def refused(edit, cell, words, count=1):
    result, errors = edited(edit, status=1)
    found = result["refused"]
    assert len(found) == count, found
    match = [f for f in found if f["cell"] == cell]
    assert match and words in match[0]["why"], (cell, words, found)
    assert cell in errors and "so nothing is stored" in errors, errors
    return match[0]

def ask(question, repo="cells.db"):
    return sqlite3.connect(repo).execute(question).fetchall()

def xyz(neuron, section, point):
    out = subprocess.run([program, "export", "--repo", "cells.db", "--format", "csv", "--out", "now", "--force"], capture_output=True, text=True)
    assert out.returncode == 0, out.stderr
    import csv
    for row in csv.reader(open("now/points.csv", encoding="utf-8", newline="")):
        if row[:3] == [str(neuron), str(section), str(point)]: return tuple(map(float, row[3:]))
PY

# Unchanged, also when it was saved again: nothing is written. The first saves cost digits, the second drop cached values.
/usr/bin/python3 - <<'PY'
from edit import *
for source, edit in [("book.xlsx", lambda book: None)] * 2:
    before = os.stat("cells.db").st_mtime_ns
    result, _ = run("book.xlsx")
    assert result["changed"] == [] and result["refused"] == [] and not result["stored"] and result["neurons"] == 4, result
    assert os.stat("cells.db").st_mtime_ns == before
result, errors = edited(lambda book: None)
assert result["changed"] == [] and errors == "", (result, errors)
result, errors = run("tables")
assert result["changed"] == [] and errors == "", (result, errors)
assert open("cells.db", "rb").read() == open("first.db", "rb").read()

def reordered(book):  # rows upside down, columns turned round, a sheet and columns of one's own, no summary
    for name in book.sheetnames:
        rows = [list(r) for r in book[name].iter_rows(values_only=True)]
        if name in ("summary", "metrics"):
            del book[name]
            continue
        head, body = rows[0], rows[1:]
        book[name].delete_rows(1, len(rows))
        for r in [head] + body[::-1]: book[name].append(r[::-1] + [None, "mine"])
    book.create_sheet("notes")["A1"] = "=1/0"
result, errors = edited(reordered)
assert result["changed"] == [] and "notes is not Brain Forest's" in errors and "no sheet metrics" in errors and "'mine'" in errors, errors
PY

# What may be changed comes back: words, names in a circle, coordinates, and branches that follow.
/usr/bin/python3 - <<'PY'
from edit import *
def edit(book):
    n, p, a = book["neurons"], book["points"], book["annotations"]
    place(n, {"id": 1}, "layer").value = "2/3"
    place(n, {"id": 1}, "species").value = "Rattus \"norvegicus\" β\\"
    place(n, {"id": 2}, "species").value = None
    place(n, {"id": 1}, "name").value = "b"
    place(n, {"id": 2}, "name").value = "a"
    place(p, {"neuron": 1, "section": 0, "point": 1}, "x").value = 0.125
    place(p, {"neuron": 1, "section": 0, "point": 1}, "z").value = 1 / 3
    place(p, {"neuron": 1, "section": "soma", "point": 0}, "diameter").value = 20
    place(p, {"neuron": 3, "section": 1, "point": 1}, "diameter").value = 0
    a.append([1, None, "reviewed", "by hand"])
result, errors = edited(edit, "--dry-run")
assert not result["stored"] and len(result["changed"]) == 11, result
result, errors = edited(edit)
assert result["stored"] and result["refused"] == [] and len(result["changed"]) == 11, result
assert ask("select name, layer, species from neuron where id < 3 order by id") == [("b", "2/3", "Rattus \"norvegicus\" β\\\\"), ("a", "", "")]
assert xyz(1, 0, 1)[:3] == (0.125, 18.25, 0.33333334), xyz(1, 0, 1)
assert xyz(1, 1, 0)[:3] == xyz(1, 2, 0)[:3] == xyz(1, 0, 1)[:3]  # both daughters
assert xyz(1, "soma", 0)[3] == 20 and xyz(3, 1, 1)[3] == 0
assert ask("select soma_radius, origin, source_file from neuron where id = 1") == [(10.0, "traced", "a.swc")]
assert ask("select origin, grammar, seed, number from neuron where id = 3") == ask("select origin, grammar, seed, number from neuron where id = 3", "first.db")
notes = ask("select value from annotations where neuron = 1 and name in ('corrected', 'reviewed') order by name")
assert notes == [("points, in the workbook edited.xlsx",), ("by hand",)], notes
assert ask("select count(*) from annotations where name = 'corrected'") == [(2,)]
old, new = (ask("select value from metric where neuron = 1 and metric = 'total_length'", r)[0][0] for r in ("first.db", "cells.db"))
assert abs(old - new) > 1e-3 and abs(new - ask("select sum(length) from section where neuron = 1")[0][0]) < 1e-4  # a picometre each
assert abs(ask("select length from neuron where id = 1")[0][0] - new) < 1e-9
assert ask("pragma integrity_check") == [("ok",)] and ask("pragma foreign_key_check") == []
# The same workbook again finds all that it asks for. Another edit of the old one is stale.
result, _ = run("edited.xlsx")
assert result["changed"] == [] and not result["stored"], result
book = openpyxl.load_workbook("edited.xlsx")
cell = place(book["points"], {"neuron": 1, "section": 0, "point": 0}, "x")
cell.value = 5
layer = place(book["neurons"], {"id": 2}, "layer"); layer.value = "6"
book.save("edited.xlsx")
result, errors = run("edited.xlsx", status=1)
assert {f["cell"] for f in result["refused"]} == {f"points!{cell.coordinate}", f"neurons!{layer.coordinate}"}, result["refused"]
assert "changed since the workbook was written" in errors
# The file it was traced from is still known.
import subprocess
assert "already there" in subprocess.run([program, "import", "a.swc", "--repo", "cells.db", "--population", "P"], capture_output=True, text=True).stdout
PY
$BRAINFOREST check --repo cells.db | grep -q 'all is well'

# What does not fit is refused by its cell, and nothing is stored.
/usr/bin/python3 - <<'PY'
from edit import *
book = openpyxl.load_workbook("book.xlsx")
def at(sheet, keys, column):
    return f"{sheet}!{place(book[sheet], keys, column).coordinate}"
def setting(sheet, keys, column, value):
    def edit(b): place(b[sheet], keys, column).value = value
    return edit
def case(sheet, keys, column, value, words):
    return refused(setting(sheet, keys, column, value), at(sheet, keys, column), words)

tip = {"neuron": 1, "section": 1, "point": 1}
for value, words in [("abc", "is no number"), ("12.5", "is no number"), (None, "is empty"), (True, "is no number"),
                     ("=A1+1", "formula without a value"), (1e300, "too large"), ("#DIV/0!", "is no number")]:
    case("points", tip, "x", value, words)
for value in (-0.5, -1e-30):
    case("points", tip, "diameter", value, "not negative")
f = case("points", tip, "y", "x", "is no number")
assert f["before"] == "28" and f["after"] == "x" and f["neuron"] == "a", f
case("neurons", {"id": 1}, "layer", 45353, "is no text")  # what Excel makes of 2/3 in a cell that is no text
case("neurons", {"id": 1}, "type", False, "is no text")
case("neurons", {"id": 1}, "name", None, "is no name")
case("neurons", {"id": 1}, "name", "b", "has that name")
case("neurons", {"id": 1}, "name", "line\nbreak", "is no name")
case("neurons", {"id": 1}, "population", "Q", "stays in its population")
case("neurons", {"id": 1}, "length", 5, "sheet points")
case("neurons", {"id": 3}, "seed", 3, "bring the old value back")
case("sections", {"neuron": 1, "section": 0}, "length", 1, "sheet points")
case("sections", {"neuron": 1, "section": 0}, "length", None, "sheet points")
case("sections", {"neuron": 1, "section": 0}, "kind", "axon", "neuron's file")
case("sections", {"neuron": 1, "section": 0}, "name", "z", "sheet neurons")
end = at("points", {"neuron": 1, "section": 0, "point": 1}, "x")
case("junctions", {"neuron": 1, "section": 0}, "x", 4, f"correct {end}")
case("sections", {"neuron": 1, "section": 0}, "start_diameter", 4, "correct " + at("points", {"neuron": 1, "section": 0, "point": 0}, "diameter"))
case("points", {"neuron": 1, "section": 1, "point": 0}, "x", 4, f"correct {end}")
case("metrics", {"neuron": 1}, "total_length", 4, "sheet points")

def both(b):  # moving a branch point and a daughter's beginning to two places
    setting("points", {"neuron": 1, "section": 0, "point": 1}, "x", 3)(b)
    setting("points", {"neuron": 1, "section": 2, "point": 0}, "x", 4)(b)
refused(both, at("points", {"neuron": 1, "section": 2, "point": 0}, "x"), "section 2 begins where section 0 ends")
def together(b):
    for s, p in ((0, 1), (1, 0), (2, 0)): setting("points", {"neuron": 1, "section": s, "point": p}, "x", 3)(b)
assert edited(together)[0]["stored"]

def row_of(b, sheet, **keys): return place(b[sheet], keys, next(iter(keys))).row
def delete(sheet, **keys):
    return lambda b: b[sheet].delete_rows(row_of(b, sheet, **keys))
refused(delete("points", neuron=1, section=1, point=1), "points", "the row is missing")
refused(delete("annotations", neuron=1, number=0), "annotations", "the row is missing")
def all_points(b):
    for _ in range(7): delete("points", neuron=1)(b)
refused(all_points, "points", "7 rows")
def twice(b):
    row = [c.value for c in b["points"][row_of(b, "points", **tip)]]
    b["points"].append(row)
last = book["points"].max_row + 1
refused(twice, f"points!A{last}", "the same row stands at")
def append(sheet, row): return lambda b: b[sheet].append(row)
refused(append("points", [1, 1, 9, 0, 0, 0, 1]), f"points!A{last}", "nothing is added")
refused(append("points", [77, 0, 0, 0, 0, 0, 1]), f"points!A{last}", "no row on the sheet neurons")
refused(append("neurons", [77, "x"]), "neurons!A6", "no such neuron in the repository")
refused(append("neurons", ["one", "x"]), "neurons!A6", "no neuron's id")
refused(append("neurons", [1, "x"]), "neurons!A6", "stands at neurons!A2 too")
def one_neuron_less(b):  # from all sheets: its edits are not there, nor is it touched
    for sheet in b.sheetnames[1:]:
        key = "id" if sheet == "neurons" else "neuron"
        for row in range(b[sheet].max_row, 1, -1):
            if b[sheet].cell(row, 1).value == 4: b[sheet].delete_rows(row)
result, errors = edited(one_neuron_less)
assert result["neurons"] == 3 and result["changed"] == [] and errors == "", (result, errors)
def header(sheet, old, new):
    def edit(b): next(c for c in b[sheet][1] if c.value == old).value = new
    return edit
refused(header("points", "x (µm)", "x (mm)"), "points!D1", "another unit")
refused(header("points", "y (µm)", "x (µm)"), "points!E1", "twice")
refused(header("points", "point", "pt"), "points", "the column is missing")
assert "no column x (µm)" in edited(header("points", "x (µm)", "where"))[1]
def stale(b): place(b["neurons"], {"id": 1}, "version").value = "v0"; setting("points", tip, "x", 1)(b)
refused(stale, at("points", tip, "x"), "changed since")
def no_version(b): b["neurons"].delete_cols(next(c.column for c in b["neurons"][1] if c.value == "version"))
assert "no column version" in edited(no_version, status=1)[1]
def no_neurons(b): del b["neurons"]
assert "has no sheet neurons" in edited(no_neurons, status=1)[1]

# Good and bad edits together: nothing is stored, and both are told.
def mixed(b): setting("neurons", {"id": 1}, "layer", "5")(b); setting("points", tip, "x", "?")(b)
result, _ = edited(mixed, status=1)
assert len(result["changed"]) == len(result["refused"]) == 1 and not result["stored"]

# A slip of the decimal point is taken, and told.
result, errors = edited(setting("points", {"neuron": 1, "section": 1, "point": 2}, "y", 38000))
assert result["stored"] and "has become odd" in errors, errors

# A removed neuron, and another repository.
edited(lambda b: None)
subprocess.run([program, "remove", "#2", "--repo", "cells.db"], check=True, capture_output=True)
result, errors = run("book.xlsx", status=1)
assert [f["cell"] for f in result["refused"]] == ["neurons!A3"], result["refused"]
assert "there is no such repository" in run("book.xlsx", repo="none.db", status=1)[1] and not os.path.exists("none.db")
PY

# CSV files, too: a decimal comma is no number, a quotation must end.
cp first.db cells.db
/usr/bin/python3 - <<'PY'
import csv
rows = list(csv.reader(open("tables/neurons.csv", encoding="utf-8", newline="")))
rows[1][rows[0].index("layer")] = "5"
csv.writer(open("tables/neurons.csv", "w", encoding="utf-8", newline=""), delimiter=";").writerows(rows)
PY
$BRAINFOREST import tables --repo cells.db >out.txt
grep -q '^1 cell of 1 neuron changed in cells.db' out.txt
[ "$(sqlite3 cells.db 'select layer from neurons where id = 1')" = 5 ]
cp first.db cells.db
sed -i 's/^1,1,1,6.7,/1,1,1,"6,7",/' tables/points.csv
if $BRAINFOREST import tables --repo cells.db 2>err.txt >out.txt; then exit 1; fi
grep -q "points!D[0-9]*: x (µm) of neuron 'a' is '6,7' instead of '6.7'; it is no number" err.txt
cmp first.db cells.db

# What cannot be: other files beside it, words for all, damage.
fails_with() {  # words of the sentence, command…
  local words=$1
  shift
  if "$@" >out.txt 2>err.txt; then exit 1; fi
  grep -qF -- "$words" err.txt || { echo "no '$words' from: $*"; cat err.txt; exit 1; }
}
fails_with 'import it alone' $BRAINFOREST import a.swc book.xlsx --repo cells.db
fails_with 'leave out --population' $BRAINFOREST import book.xlsx --repo cells.db --species rat
fails_with '--dry-run' $BRAINFOREST import a.swc --repo cells.db --dry-run
head -c 3000 book.xlsx >cut.xlsx
fails_with 'cut off or damaged' $BRAINFOREST import cut.xlsx --repo cells.db
cp a.swc fake.xlsx
fails_with 'is no workbook' $BRAINFOREST import fake.xlsx --repo cells.db
cmp first.db cells.db

# LibreOffice, where there is one: saved again it is unchanged, and a computed formula counts.
soffice=$(command -v soffice || true)
if [ -n "$soffice" ]; then
  office() { HOME=$PWD timeout 120 "$soffice" -env:UserInstallation="file://$PWD/office" --headless --convert-to "$1" --outdir "$2" "$3" >office.txt 2>&1; }
  office xlsx saved book.xlsx
  $BRAINFOREST import saved/book.xlsx --repo cells.db | grep -qx 'nothing changed'
  cmp first.db cells.db
  /usr/bin/python3 - <<'PY'
from edit import *
book = openpyxl.load_workbook("book.xlsx")
cell = place(book["points"], {"neuron": 1, "section": 1, "point": 1}, "x")
cell.value = "=1+2*3.125"
book.save("formula.xlsx")
PY
  office xlsx saved formula.xlsx
  $BRAINFOREST import saved/formula.xlsx --repo cells.db | grep -q '^1 cell of 1 neuron changed'
  /usr/bin/python3 -c 'from edit import *; assert xyz(1, 1, 1)[0] == 7.25, xyz(1, 1, 1)'
fi

# SPDX-License-Identifier: Apache-2.0
# brainforest import, list, show and export: nothing is lost, nothing is stored in part, and the same command gives the
# same bytes.
trap 'echo "failed in line $LINENO: $BASH_COMMAND"' ERR

source "$FOREST_SOURCE_DIR/tests/words.sh"
json() { python3 -c "import json,sys; d=json.load(sys.stdin); print($1)"; }

# Forty cells of 20 to 300 sections, two folders deep, and one with oddities.
python3 - <<'PY'
import os, random
for c in range(40):
    rng = random.Random(c)
    folder = f"cells/{'deep' if c % 2 else 'upper'}"
    os.makedirs(folder, exist_ok=True)
    rows, ends, n = ["1 1 0 0 0 8 -1"], [(1, 0, 0, 0)], 1
    for s in range(20 + 7 * c):
        parent, x, y, z = rng.choice(ends)
        for _ in range(5):
            x, y, z = x + rng.uniform(-5, 5), y + rng.uniform(0, 5), z + rng.uniform(-5, 5)
            n += 1
            rows.append(f"{n} {3 + c % 2} {x:.3f} {y:.3f} {z:.3f} {rng.uniform(.2, 2):.3f} {parent}")
            parent = n
        ends.append((n, x, y, z))
    open(f"{folder}/cell{c:02}.swc", "w").write("\n".join(rows) + "\n")
open("odd.swc", "w").write("1 1 0 0 0 5 -1\n2 3 0 5 0 -1 1\n3 0 0 15 0 1 2\n")
PY

# Folders are walked in order; each file is a neuron. The bytes are the same at any number of threads, and again.
$BRAINFOREST import cells --repo one.db --population P --threads 1 >one.txt
$BRAINFOREST import cells --repo two.db --population P --threads 2 >two.txt
cmp one.txt two.txt
cmp one.db two.db
$BRAINFOREST import cells --repo two.db --population P >again.txt
grep -q '^0 stored, 40 already there' again.txt
cmp one.db two.db
[ "$(ls one.db*)" = one.db ]

# An independent reader finds what the schema's page says.
[ "$(sqlite3 one.db 'pragma integrity_check; pragma foreign_key_check; pragma user_version')" = $'ok\n8' ]
[ "$(sqlite3 one.db 'select count(*), sum(sections), min(name), max(name) from neurons')" = '40|'"$(sqlite3 one.db 'select count(*) from sections')"'|cell00|cell39' ]
[ "$(sqlite3 one.db "select count(*) from neurons join provenance on neuron = id where origin = 'traced' and length(source_hash) = 32 and source_file like 'cells/%.swc'")" = 40 ]
python3 - <<'PY'
import math, sqlite3, struct
db = sqlite3.connect("one.db")
def unpacked(blob, sections):  # docs/repository/schema.md
    numbers, before, at, points = [], [0] * 4, 1, []
    while at < len(blob):
        value = shift = 0
        while True:
            byte = blob[at]; at += 1
            value |= (byte & 127) << shift; shift += 7
            if byte < 128: break
        numbers.append(None if value == 1 << 63 else (value >> 1) ^ -(value & 1))
    i, ends = 0, []
    for parent, count, _ in sections:
        if parent is not None: before = ends[parent]
        for i in range(i, i + 4 * count, 4):
            before = [0 if b is None else a + b for a, b in zip(before, numbers[i:i + 4])]
            points.append([b / 10 ** blob[0] for b in before])
        i += 4
        ends.append(before)
    assert i == len(numbers)
    return points

for neuron, packing, blob in db.execute("select neuron, packing, data from points"):
    assert packing == 2 and len(blob) < 10 * db.execute("select points from neurons where id = ?", (neuron,)).fetchone()[0]
    sections = db.execute(
        "select parent, points, length from section where neuron = ? order by section", (neuron,)).fetchall()
    points, ends = unpacked(blob, sections), []
    first = 0
    for parent, count, length in sections:
        run = points[first:first + count]
        assert parent is None or run[0] == ends[parent]
        first += count
        ends.append(run[-1])
        assert abs(sum(math.dist(a[:3], b[:3]) for a, b in zip(run, run[1:])) - length) < 1e-3 * length
    assert db.execute("select sum(length) from arbors where neuron = ?", (neuron,)).fetchone()[0] > 0
PY

# list and show.
$BRAINFOREST list --repo one.db --population P >list.txt
grep -q 'cells/upper/cell38.swc' list.txt
[ "$($BRAINFOREST list --repo one.db --json | json '[(p["name"], p["neurons"]) for p in d["populations"]], len(d["neurons"])')" = "[('P', 40)] 40" ]
$BRAINFOREST show cell07 --repo one.db --sections >show.txt
grep -q '^traced  *cells/deep/cell07.swc$' show.txt
grep -q '^soma radius (µm)  *8.00$' show.txt
id=$(sqlite3 one.db "select id from neurons where name = 'cell07'")
$BRAINFOREST show "$id" --repo one.db --sections | cmp - show.txt
[ "$($BRAINFOREST show cell07 --repo one.db --sections --json | json 'len(d[0]["section_list"]) == d[0]["sections"] == sum(a["sections"] for a in d[0]["arbors"]) == sum(k["sections"] for k in d[0]["kinds"])')" = True ]

# export, and back.
$BRAINFOREST export --repo one.db --population P --format swc --out exported >/dev/null
[ "$(ls exported | wc -l)" = 40 ]
$BRAINFOREST export --repo two.db --out exported2 --threads 1 >/dev/null
diff -r exported exported2
$BRAINFOREST import exported --repo back.db --population P >/dev/null
facts="select n.name, stems, n.sections, n.points, group_concat(s.section || '<' || coalesce(s.parent, '') || ':' || s.kind) from neurons n join section s on s.neuron = n.id group by n.id order by n.name"
[ "$(sqlite3 one.db "$facts")" = "$(sqlite3 back.db "$facts")" ]
$BRAINFOREST export cell07 "$id" cell00 --repo one.db --out some >/dev/null
[ "$(ls some | tr '\n' ' ')" = 'cell00.swc cell07.swc ' ]
cmp some/cell07.swc exported/cell07.swc

# Oddities are counted, and shown with their line when asked.
$BRAINFOREST import odd.swc --repo odd.db >odd.txt 2>odd.err
grep -q 'odd.swc  odd  .* stored' odd.txt && grep -q 'shown by --verbose' odd.txt && [ ! -s odd.err ]
$BRAINFOREST import odd.swc --repo odd2.db --verbose >/dev/null 2>odd.err
grep -q '^odd.swc:2: negative-radius: ' odd.err

# A bad file among many is named, the rest is stored, and the status says so.
mkdir mixed && cp cells/upper/cell0*.swc mixed/ && echo nonsense >mixed/bad.swc && : >mixed/empty.swc
fails_with 1 'mixed/bad.swc:1: ' $BRAINFOREST import mixed --repo mixed.db
[ "$(sqlite3 mixed.db 'select count(*) from neurons')" = "$(ls mixed/cell*.swc | wc -l)" ]
fails_with 1 '2 of 2 files could not be read' $BRAINFOREST import mixed/bad.swc mixed/empty.swc --repo never.db
[ ! -e never.db ]

# Another file of a taken name gets a number; the same file under another name is the same neuron.
mkdir twins && sed 's/ 8 -1/ 9 -1/' cells/upper/cell00.swc >twins/cell00.swc && cp cells/upper/cell02.swc twins/copy.swc
$BRAINFOREST import twins --repo one.db --population P >twins.txt 2>twins.err
grep -q "stored as 'cell00-2'" twins.err && grep -q "same file as that of neuron 'cell02'" twins.err
$BRAINFOREST import twins --repo one.db --population Q >/dev/null
fails_with 1 'say --population with one of: P, Q' $BRAINFOREST show cell00 --repo one.db
$BRAINFOREST export --repo one.db --out both >/dev/null
[ "$(ls both/P | wc -l) $(ls both/Q | wc -l)" = '41 2' ]

# Strange names of files and populations are only names.
mkdir strange
for name in "a'b" '"); drop table neurons; --' $'\xff\xfe' 'β cell' '%2E' '-rf'; do cp cells/upper/cell04.swc "strange/$name.swc"; echo "# $name" >>"strange/$name.swc"; done
$BRAINFOREST import strange --repo strange.db --population "'); drop table neurons; --" >/dev/null
$BRAINFOREST list --repo strange.db --population "'); drop table neurons; --" --json | json 'sorted(n["name"] for n in d["neurons"])' |
  grep -qF '"); drop table neurons; --'
$BRAINFOREST export --repo strange.db --out strange_out >/dev/null
[ "$(ls strange_out | wc -l)" = 6 ]
$BRAINFOREST import strange_out --repo strange.db --population back >/dev/null

# What is no repository is refused with a sentence and not touched.
cp cells/upper/cell00.swc not.db
fails_with 1 'not.db: is no repository' $BRAINFOREST import cells --repo not.db
cmp not.db cells/upper/cell00.swc
fails_with 1 'there is no such repository' $BRAINFOREST list --repo missing.db
[ ! -e missing.db ]
head -c 50000 one.db >cut.db
fails_with 1 'damaged or cut off' $BRAINFOREST list --repo cut.db
fails_with 1 'there is no neuron' $BRAINFOREST show nobody --repo one.db
fails_with 1 "those that are there: P, Q" $BRAINFOREST list --repo one.db --population R
fails_with 1 'cannot be' $BRAINFOREST export --repo one.db --out not.db/folder
fails_with 2 'files' $BRAINFOREST import --repo x.db
fails_with 2 '--repo' $BRAINFOREST list
fails_with 2 'is no name' $BRAINFOREST import cells --repo x.db --population $'a\nb'
fails_with 2 '--format' $BRAINFOREST export --repo one.db --format jpeg --out x

# A damaged neuron is named, and can be removed and imported again; the others are as they were.
cp one.db hurt.db
sqlite3 hurt.db "update neurons set checksum = checksum + 1 where name = 'cell07'"
fails_with 1 "neuron 'cell07' (id $id) is damaged" $BRAINFOREST check --repo hurt.db
grep -q "hurt.db: 1 finding; the sentence above" err.txt
sqlite3 hurt.db "update points set data = x'00' where neuron = $id"
fails_with 1 "neuron 'cell07' (id $id) is damaged" $BRAINFOREST check --repo hurt.db
fails_with 1 "brainforest remove" $BRAINFOREST show cell07 --repo hurt.db
fails_with 1 "is removed as '#$id'" $BRAINFOREST remove cell07 "$id" --repo hurt.db
[ "$($BRAINFOREST remove cell07 "#$id" --repo hurt.db --json | json '[(r["id"], r["name"], r["population"]) for r in d["removed"]]')" = "[($id, 'cell07', 'P')]" ]
[ "$($BRAINFOREST check --repo hurt.db)" = 'hurt.db: all is well' ]
fails_with 1 "there is no neuron 'cell07'" $BRAINFOREST remove cell00 cell07 --repo hurt.db --population P
[ "$(sqlite3 hurt.db "select count(*) from neurons where name = 'cell00'")" = 2 ]  # all or none
$BRAINFOREST import cells/deep/cell07.swc --repo hurt.db --population P >/dev/null
$BRAINFOREST export cell07 --repo hurt.db --out mended >/dev/null
cmp mended/cell07.swc exported/cell07.swc
fails_with 1 'say --population with one of: P, Q' $BRAINFOREST remove cell00 --repo hurt.db
$BRAINFOREST remove cell00 --repo hurt.db --population Q | grep -qx '1 neuron removed from hurt.db'
fails_with 1 'there is no such repository' $BRAINFOREST remove cell00 --repo missing.db
[ ! -e missing.db ]
fails_with 2 'neurons' $BRAINFOREST remove --repo hurt.db

# A full disk: a sentence, and whole neurons.
got=0
(ulimit -f 300 && exec $BRAINFOREST import cells --repo full.db) >/dev/null 2>full.err || got=$?
[ "$got" = 1 ] && grep -q 'the disk is full' full.err
[ "$(sqlite3 full.db 'pragma integrity_check')" = ok ]
$BRAINFOREST import cells --repo full.db --population default >/dev/null
[ "$(sqlite3 full.db 'select count(*) from neurons')" = 40 ]

# Killed at any moment, the repository opens and holds whole neurons only; importing again completes it. Two at once, too.
python3 - <<'PY'
import filecmp, os, random, shutil, signal, sqlite3, subprocess, time
program = os.environ["BRAINFOREST"]
quiet = dict(stdout=subprocess.DEVNULL, check=True)
os.mkdir("many")  # 64 are one transaction
for copy in range(3):
    for folder, _, names in os.walk("cells"):
        for name in names:
            text = open(os.path.join(folder, name)).read()
            open(f"many/{copy}{name}", "w").write(f"{text}# {copy}\n")
begin = time.monotonic()
subprocess.run([program, "import", "many", "--repo", "whole.db"], **quiet)
took = time.monotonic() - begin
subprocess.run([program, "export", "--repo", "whole.db", "--out", "whole"], **quiet)
assert len(os.listdir("whole")) == 120
rng = random.Random(1)
seen, left = set(), 0  # how many neurons there were after a kill; at least once some and not all
for round in range(200):
    if round >= 12 and seen - {0, 120}: break
    if (round % 4 == 0 or left == 120) and os.path.exists("killed.db"): os.remove("killed.db")
    child = subprocess.Popen([program, "import", "many", "--repo", "killed.db"], stdout=subprocess.DEVNULL)
    time.sleep(rng.uniform(0, took))
    took *= 1.05 if child.poll() is None else .8  # the machine is quicker or slower than it was
    child.send_signal(signal.SIGKILL)
    child.wait()
    if not os.path.exists("killed.db"): continue
    subprocess.run([program, "list", "--repo", "killed.db"], **quiet)
    db = sqlite3.connect("killed.db")
    assert db.execute("pragma integrity_check").fetchall() == [("ok",)]
    assert db.execute("pragma foreign_key_check").fetchall() == []
    names = [name for name, in db.execute("select name from neurons")]
    db.close()
    left = len(names)
    seen.add(left)
    if not names: continue
    shutil.rmtree("killed", ignore_errors=True)
    subprocess.run([program, "export", "--repo", "killed.db", "--out", "killed"], **quiet)
    assert sorted(os.listdir("killed")) == sorted(name + ".swc" for name in names)
    for name in names: assert filecmp.cmp(f"killed/{name}.swc", f"whole/{name}.swc", shallow=False), name
assert seen - {0, 120}, seen
subprocess.run([program, "import", "many", "--repo", "killed.db"], **quiet)
assert sqlite3.connect("killed.db").execute("select count(*) from neurons").fetchone() == (120,)

both = [subprocess.Popen([program, "import", f"cells/{half}", "cells", "--repo", "both.db"], stdout=subprocess.DEVNULL)
        for half in ("upper", "deep")]
assert [child.wait() for child in both] == [0, 0]
assert sqlite3.connect("both.db").execute("select count(*) from neurons").fetchone() == (40,)
PY

# Questions in SQL and searches by anything.
[ "$($BRAINFOREST query 'select count(*) from section' --repo one.db --json | json 'd["rows"][0][0]')" = "$(sqlite3 one.db 'select count(*) from sections')" ]
[ "$($BRAINFOREST list --repo one.db --where "total_length > 3000 and name like 'cell%'" --json | json 'len(d["neurons"])')" = "$(sqlite3 one.db 'select count(*) from neurons where length > 3000')" ]
$BRAINFOREST query "select name, 'a \"b\", c' as odd from neuron where id = 1" --repo one.db --csv answer.csv >out.txt
[ "$(cat answer.csv)" = $'name,odd\r\ncell01,"a ""b"", c"\r' ]
# Texts are what they are, lines and backslashes too; a table shows them on one line.
question="select 'a' || char(13) || char(10) || 'b\\c, \"' || char(10) as text, x'00ff' as bytes"
$BRAINFOREST query "$question" --repo one.db --csv lines.csv --json >lines.json
/usr/bin/python3 - <<'PY'
import csv, json
text = 'a\r\nb\\c, "\n'
assert json.load(open("lines.json"))["rows"] == [[text, "\\x00ff"]]
assert list(csv.reader(open("lines.csv", newline=""))) == [["text", "bytes"], [text, "\\x00ff"]]
PY
$BRAINFOREST query "$question" --repo one.db >lines.txt
grep -qF 'a␤b\c, "␤  \x00ff' lines.txt
cp one.db kept.db
fails_with 1 "read and not write" $BRAINFOREST query "delete from neurons" --repo one.db
fails_with 1 "not understood" $BRAINFOREST query "select colour from neuron" --repo one.db
fails_with 1 "not understood" $BRAINFOREST list --repo one.db --where "colour = 3"
cmp one.db kept.db
for question in vacuum begin; do fails_with 1 "read and not write" $BRAINFOREST query "$question" --repo one.db; done
cmp one.db kept.db
: >nothing.db
fails_with 1 "an empty file" $BRAINFOREST list --repo nothing.db

# An address with a password, however it is misspelt, is neither printed nor made a file.
for place in postgresql://me:secret@localhost/cells POSTGRESQL://me:secret@localhost/cells ' postgresql://me:secret@localhost/cells' \
  postgresql:/me:secret@localhost/cells postgresql:me:secret@localhost postgresql+psycopg2://me:secret@localhost/cells \
  postgresql://me%3Asecret@localhost/cells 'postgresql://localhost/cells?sslpassword=secret' 'host=127.0.0.1 password=secret'; do
  for command in list "import cells" "query vacuum" "show cell07" "export --out none" measure "grow --grammar motoneuron --count 1"; do
    fails_with 1 "PGPASSWORD" $BRAINFOREST $command --repo "$place"
    ! grep -q secret out.txt err.txt || { echo "printed by $command: $place"; exit 1; }
  done
done
[ -z "$(find . -name '*secret*')" ]

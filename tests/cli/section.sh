#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# brainforest section: pictures, contours, areas and films of a plane; what it refuses. And brainforest bench pick, small.
set -euo pipefail
source "$FOREST_SOURCE_DIR/tests/words.sh"

small_forest 2

"$program" section a.forest -o areas.csv --json >all.json
"$program" section a.forest -o again.csv --threads 1 >/dev/null
cmp areas.csv again.csv || fail "areas depend on the number of threads"
"$program" section a.forest --plane 0,1200,0,1,2,3 --height 80 --size 320x240 -o a.png --json >a.json
"$program" section a.forest --plane 0,1200,0,1,2,3 --height 80 --size 320x240 -o b.png --threads 1 >/dev/null
cmp a.png b.png || fail "the picture depends on the number of threads"
"$program" section a.forest --plane 0,1200,0,1,2,3 --height 80 --size 320x240 -o a.svg >/dev/null
"$program" section a.forest --plane 0,1200,0,0,1,0 --through 5 --seconds .2 --height 80 --size 160x120 -o a.mp4 >/dev/null
"$program" section a.forest --plane 0,1200,0,1,2,3 --height 80 --centre 90000,0 --size 320x240 -o aside.svg --json >aside.json 2>aside.txt
told aside.json "d['profiles'] == 0 and d['area'] == 0"
grep -q 'cuts no neuron where one looks' aside.txt || fail "an empty picture is not told"
[[ $(head -c 8 a.mp4 | tail -c 4) == ftyp ]] || fail "a.mp4 is no MP4 file"
/usr/bin/python3 - <<'PY'
import csv, json, xml.etree.ElementTree as tree
rows = list(csv.DictReader(open("areas.csv")))
told = json.load(open("all.json"))
assert len({row["neuron"] for row in rows}) == told["neurons"] > 20, told
assert sum(int(row["profiles"]) for row in rows) == told["profiles"], told
assert abs(sum(float(row["area"]) for row in rows) / told["area"] - 1) < 1e-4, told
somata = [float(row["area"]) for row in rows if row["kind"] == "soma"]
assert somata and 20 < max(somata) < 3000, somata
assert json.load(open("a.json"))["profiles"] > 5
svg = tree.parse("a.svg").getroot()
assert svg.tag.endswith("svg") and any(g.get("id", "").startswith("neuron-") for g in svg), "no contours"
PY

# All that is cut is in the default picture; where it would lie is asked before the work.
"$program" section a.forest -o all.svg --json >drawn.json
/usr/bin/python3 -c 'import json; a, b = (json.load(open(f)) for f in ("all.json", "drawn.json")); assert a["profiles"] == b["profiles"], (a, b)'
fails_with 1 "its folder is not there" "$program" section a.forest -o nowhere/x.csv
"$program" section a.forest --plane 0,99999,0,0,1,0 -o nothing.png >told 2>&1
grep -q "cuts no neuron" told || fail "an empty section is silent"
fails_with 1 "no direction" "$program" section a.forest --plane 0,0,0,0,0,0 -o x.png
fails_with 1 "nan" "$program" section a.forest --plane 0,0,0,nan,0,1 -o x.png
fails_with 1 "x,y,z,nx,ny,nz" "$program" section a.forest --plane 1,2,3 -o x.png
fails_with 1 ".mp4" "$program" section a.forest --through 5 -o x.png
fails_with 2 ".png" "$program" section a.forest -o x.bmp
fails_with 2 "height" "$program" section a.forest --height 0 -o x.png

"$program" bench pick --neurons 30 --pixels 2000 --size 320x200 --json >pick.json
/usr/bin/python3 -c 'import json; d = json.load(open("pick.json")); assert d["right"] == 1 and d["pixels"] == 2000 and d["something"] > .02, d'

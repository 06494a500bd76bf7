#!/usr/bin/env bash
# Files of one format become files of another, odd files are told and mended, and no byte of them is lost.
set -euo pipefail
source "$FOREST_SOURCE_DIR/tests/words.sh"

"$program" grow --grammar motoneuron --count 2 --seed 3 --out cells >/dev/null
first=$(ls cells | head -1)
"$program" convert "cells/$first" copy.swc >/dev/null
cmp "cells/$first" copy.swc || fail "a file converted to its own format has changed"
"$program" convert cells --format swc --out deep/er --json >report.json
/usr/bin/python3 -c 'import json; d = json.load(open("report.json")); assert d["written"] == 2 and d["failed"] == 0, d'
cmp "cells/$first" "deep/er/$first" || fail "a converted folder has changed"
fails_with 2 "say where" "$program" convert cells
refuses "no known format" "$program" convert "cells/$first" cell.doc
fails_with 2 "say which format" "$program" convert cells --out x

# An odd file: extra columns, CR LF, a type change and an unknown radius. And a broken one.
printf '# CREATURE rat\r\n1 1 0 0 0 5 -1 9\r\n\r\n3 3 0 5 0 1 1\r\n4 3 0 9 0 NaN 3\r\n7 2 0 19 0 1 4\xff\r\n' | sed 's/\xff//' >odd.swc
printf '1 1 0 0\n' >broken.swc
cp odd.swc kept.swc
fails_with 1 "1 of 3" "$program" check odd.swc broken.swc "cells/$first" --repair mended --json
"$program" check odd.swc "cells/$first" --repair mended --json >check.json
/usr/bin/python3 - <<'PY'
import json
report = json.load(open("check.json"))
codes = {f["code"]: f for f in report["files"][0]["findings"]}
for code, line in {"line-ends": 1, "extra-columns": 2, "blank-line": 3, "unknown-radius": 5, "type-change": 6}.items():
    assert codes[code]["line"] == line and codes[code]["mend"], (code, codes.get(code))
assert report["mended"] == 1 and report["files"][1]["findings"] == [], report
# The log gives the original back, byte for byte.
log = json.load(open("mended/odd.swc.log.json"))
lines = open("mended/odd.swc", newline="\n").read().splitlines(keepends=True)
text = ""
for passage in log["passages"]:
    text += passage.encode().decode("unicode_escape") if isinstance(passage, str) else "".join(lines[passage[0] - 1:passage[0] - 1 + passage[1]])
assert text.encode("latin-1") == open("odd.swc", "rb").read(), text
PY
cmp odd.swc kept.swc || fail "checking changed the file"
"$program" check mended/odd.swc --json >again.json
/usr/bin/python3 -c 'import json; f = json.load(open("again.json"))["files"][0]["findings"]; assert not [x for x in f if "--repair" in x["mend"]], f'
"$program" grow --grammar motoneuron --count 1 --seed 3 --repo r.db >/dev/null
[[ $("$program" check --repo r.db) == *"all is well"* ]] || fail "a sound repository is not said to be one"

# What a format cannot hold is told by export as well.
"$program" export --repo r.db --format nts --out nts >/dev/null 2>lost.txt
grep -q '^nts/.*\.nts: rounded: ' lost.txt || fail "export says nothing of what is lost"
refuses "is a folder; convert into it with --format" "$program" convert "cells/$first" cells
refuses "say different formats" "$program" convert "cells/$first" other.swc --format asc
[ ! -e other.swc ] || fail "a refused conversion wrote a file"
if "$program" convert "cells/$first" "" 2>empty.txt; then fail "a file without a name is taken"; fi
grep -q "is empty" empty.txt || fail "an empty name is not said to be empty"

# Two files of one stem are mended side by side, and a log that quotes a file is none.
mkdir twins
printf '1 1 0 0 0 5 -1\r\n2 3 0 5 0 1 1\r\n3 3 0 9 0 1 2\r\n' >twins/cell.swc
printf '<mbf version="3.0"><tree type="Axon"><point x="0" y="5" z="0" d="2"/><point x="0" y="9" z="0" d="2"/></tree></mbf>' >twins/cell.xml
"$program" check twins --repair both >/dev/null
for made in cell.swc cell.swc.log.json cell.xml.swc cell.xml.swc.log.json; do
  [[ -s both/$made ]] || fail "there is no both/$made"
done
"$program" check both --json 2>/dev/null >both.json
/usr/bin/python3 -c 'import json; d = json.load(open("both.json")); assert len(d["files"]) == 2 and d["failed"] == 0, d'

# Models are among what a file can be called.
refuses ".glb, .obj" "$program" convert "cells/$first" cell.foo

# A file of several cells is read and not mended, and says so for itself; its cells are converted one by one.
printf '\xef\xbb\xbf*start_cell /a\nsoma none 0 0 0 9\nd soma 0 9 0 nan\n*start_cell /b\nsoma none 0 0 0 5\nd soma 0 7 0 1\n' >pair.p
fails_with 1 "1 of 2 files, of several cells, was not mended; convert" "$program" check pair.p odd.swc --repair several
[[ -s several/odd.swc && ! -e several/pair.p ]] || fail "the other file is not mended"
"$program" check pair.p --repair several --json >several.json 2>/dev/null || true
/usr/bin/python3 - <<'PY2'
import json
report = json.load(open("several.json"))
assert (report["failed"], report["odd"], report["not_mended"], report["mended"]) == (0, 1, 1, 0), report
assert report["files"][0]["not_mended"].startswith("holds 2 cells"), report
PY2
"$program" check pair.p >/dev/null || fail "a file of several cells is called a failure without --repair"

# Keys that a format has no place for are told, once.
printf '<neuroml><cell id="c"><notes>of Doe</notes><property tag="age" value="7"/><morphology id="m"><segment id="0"><proximal x="0" y="0" z="0" diameter="2"/><distal x="0" y="9" z="0" diameter="2"/></segment></morphology></cell></neuroml>' >notes.nml
for extension in swc asc nts; do
  "$program" convert notes.nml notes.$extension >/dev/null 2>lost.txt
  [[ $(grep -c "^notes.$extension: keys-lost: 2 annotations become comments" lost.txt) == 1 ]] || fail "$extension: $(cat lost.txt)"
  "$program" convert notes.$extension again.nml --force >/dev/null
  grep -q 'tag="comment" value="age 7"' again.nml || fail "$extension: the annotation is gone"
done
"$program" convert notes.nml notes.h5 2>lost.txt >/dev/null
[[ ! -s lost.txt ]] || fail "HDF5 keeps all keys, but said: $(cat lost.txt)"

# A cell as tracers leave it, whose neurites are on no soma: in every format they hang on the one they begin at.
printf '("CellBody" (CellBody) (5 0 0 0) (0 5 0 0) (-5 0 0 0) (0 -5 0 0))\n((Dendrite) (0 6 0 2) (0 20 0 1) Normal)\n' >traced.asc
"$program" convert traced.asc traced.nml >/dev/null 2>&1
[[ $(grep -c '<parent segment="0"/>' traced.nml) == 1 ]] || fail "the dendrite hangs on no soma in NeuroML"
# Files of one stem become files side by side, none of them lost.
mkdir stems && cp "cells/$first" stems/simple.swc && cp "cells/$first" stems/simple-2.swc && "$program" convert "cells/$first" stems/simple.asc >/dev/null
"$program" convert stems --format neuroml --out numbered >/dev/null 2>said.txt || fail "two files of one stem are not converted: $(cat said.txt)"
[[ $(ls numbered | wc -l) == 3 ]] || fail "of three files became $(ls numbered)"
grep -q '^stems/simple.swc: becomes numbered/simple-3.nml, for stems/simple.asc becomes numbered/simple.nml$' said.txt || fail "said: $(cat said.txt)"

# What of a file is not kept is told as a loss, and eSWC has Vaa3D's columns.
printf '1 1 0 0 0 5 -1 7 7 7\n2 3 0 5 0 1 1 7 7 7\n3 3 0 9 0 1 2 7 7 7\n' >vaa3d.eswc
"$program" convert vaa3d.eswc again.eswc >out.txt 2>lost.txt
grep -q '^vaa3d.eswc:1: extra-columns: ' lost.txt || fail "that columns are lost is not told: $(cat lost.txt)"
grep -q ' 1 loss told' out.txt || fail "$(cat out.txt)"
grep -q '^3 3 0 9 0 1 2 1 1 0 0 0$' again.eswc || fail "eSWC has not its columns: $(cat again.eswc)"
"$program" check again.eswc --json | /usr/bin/python3 -c 'import json, sys; d = json.load(sys.stdin); assert d["sound"] == 1, d'

# Notes are shown by check, counted for themselves, and are nothing to mend.
printf '1 3 0 0 0 1 -1\n2 3 0 5 0 1 1\n3 3 0 5 0 1 2\n' >no_soma.swc
"$program" check no_soma.swc --repair notes >out.txt
grep -q 'no-soma (note)' out.txt && grep -q 'zero-length (note)' out.txt && grep -q '0 files without a finding, 0 with some, 1 with notes only' out.txt || fail "$(cat out.txt)"
[[ ! -e notes ]] || fail "a file with notes only was mended"
echo "convert.sh: all is well"

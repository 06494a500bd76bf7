# SPDX-License-Identifier: Apache-2.0
# brainforest bench activity: what it prints and leaves. How fast it is, no test asks.
trap 'echo "failed in line $LINENO: $BASH_COMMAND"' ERR
mkdir made
"$BRAINFOREST" bench activity --neurons 30 --compartments 700 --steps 70 --seeks 3 --folder made --json >out.json
[ -z "$(ls made)" ]
"$BRAINFOREST" bench activity --neurons 5 --compartments 1 --steps 64 --seeks 1 --keep made/kept.activity >out.txt
grep -q '^Made up: 5 neurons' out.txt
"$BRAINFOREST" clamp made/kept.activity --neuron 4 --json >clamped.txt
grep -q '"steps": 64' clamped.txt

# The made-up report as a file of SONATA: packed from there it gives the same bytes.
"$BRAINFOREST" bench activity --neurons 5 --compartments 1 --steps 64 --seeks 1 --keep made/read.activity --report made/report.h5 --json >read.json
cmp <(tail -c +17 made/kept.activity | head -c 20000) <(tail -c +17 made/read.activity | head -c 20000)
[ -s made/report.h5 ] && grep -q '"from": "a SONATA report"' read.json
python3 - <<'PY'
import json
out = json.load(open("out.json"))
assert out["made_up"] is True and out["neurons"] == 30 and out["steps"] == 70 and out["values_per_step"] >= 30 * 700, out
assert 0 < out["error"] <= out["stated_error"] + 1e-4 <= .3, out
assert out["steps_per_second"] > 0 and out["seek_ms"]["worst"] >= out["seek_ms"]["median"] > 0, out
PY
status=0
"$BRAINFOREST" bench activity --neurons 5 --folder no/folder 2>err.txt || status=$?
[ $status = 1 ] && grep -q 'name another --folder' err.txt

# What is there and of another kind stays.
echo 'my notes' >made/notes
for option in --keep --report; do
  status=0
  "$BRAINFOREST" bench activity --neurons 5 --compartments 1 --steps 64 --seeks 1 $option made/notes 2>err.txt || status=$?
  [ $status = 1 ] && grep -q 'is there and is no' err.txt
done
[ "$(cat made/notes)" = 'my notes' ]

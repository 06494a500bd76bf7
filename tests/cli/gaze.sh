#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# A gaze: render --gaze, movie --scanpath and --path, orthographic views, bench gaze small; what they refuse.
set -euo pipefail
source "$FOREST_SOURCE_DIR/tests/words.sh"

small_forest 2

cpu=(--renderer cpu --size 320x180)
"$program" render a.forest "${cpu[@]}" --gaze .4 .5 -o a.png --json >a.json
"$program" render a.forest "${cpu[@]}" --gaze .4 .5 -o b.png --threads 1 >/dev/null
cmp a.png b.png || fail "the picture depends on the number of threads"
"$program" render a.forest "${cpu[@]}" -o without.png --json >without.json
/usr/bin/python3 - <<'PY'
import json
covered = [json.load(open(name))["covered"] for name in ("a.json", "without.json")]
assert .02 < covered[1] and .7 < covered[0] / covered[1] < 1.5, covered
PY
/usr/bin/python3 -c 'import json; v = json.load(open("a.json"))["view"]; assert abs(v["gaze"][0] - .4) < 1e-6 and v["fovea"] == 2.5 and v["projection"] == "perspective", v'
view='{"eye":[700,1500,900],"target":[0,1300,0],"samples":2,"projection":"orthographic"}'
"$program" render a.forest "${cpu[@]}" --view "$view" -o o.png --json >o.json
/usr/bin/python3 -c 'import json; d = json.load(open("o.json")); assert d["view"]["projection"] == "orthographic" and .02 < d["covered"] < 1, d'
"$program" render a.forest "${cpu[@]}" --view "${view/orthographic/perspective}" -o p.png >/dev/null
! cmp -s o.png p.png || fail "an orthographic picture is a perspective one"

printf '# size 200x100\ntime,x_px,y_px\n0,50,50\n40,,\n80,150,20\n' >looked.csv
printf '%s\n\n%s\n' "$view" "${view/900/500}" >views.jsonl
"$program" movie a.forest --renderer cpu --size 160x90 --seconds .2 --samples 1 --path views.jsonl --scanpath looked.csv --pictures frames -o a.mp4 >/dev/null
[[ $(head -c 8 a.mp4 | tail -c 4) == ftyp && $(ls frames | wc -l) == 5 ]] || fail "no film along the path"

"$program" bench gaze --neurons 60 --frames 4 --compared 2 --size 640x360 --renderer cpu --json >bench.json
/usr/bin/python3 - <<'PY'
import json
out = json.load(open("bench.json"))
assert out["fovea_differ"] == 0, "inside the fovea the picture differs"
assert len(out["parts"]) == 3 and all(p["fovea_pixels"] > 100 and p["ratio"] > 0 for p in out["parts"]), out
PY

printf '0,.5,.5\nsoon,.5,.5\n' >bad.csv
fails_with 1 "bad.csv:2: 'soon' is no time" "$program" movie a.forest --scanpath bad.csv -o x.mp4
printf '%s\n{"eye":[1,2,3]}\n' "$view" >bad.jsonl
fails_with 1 "bad.jsonl:2: the view lacks 'target'" "$program" movie a.forest --path bad.jsonl -o x.mp4
fails_with 2 "gaze" "$program" render a.forest --gaze 2 .5 -o x.png
fails_with 1 "projection" "$program" render a.forest --view '{"eye":[1,2,3],"target":[0,0,0],"projection":"fish"}' -o x.png

# SPDX-License-Identifier: Apache-2.0
# brainforest bench io: what it prints and refuses. How fast it is, no test asks.
trap 'echo "failed in line $LINENO: $BASH_COMMAND"' ERR

mkdir cells
printf '1 1 0 0 0 5 -1\n2 3 0 5 0 1 1\n3 3 0 15 0 1 2\n' >cells/stem.swc
echo 'no neuron' >cells/notes.txt

"$BRAINFOREST" bench io --json cells >out.json
python3 - <<'PY'
import json
out = json.load(open("out.json"))
assert out["megabytes_per_second"]["swc"] > 0, out
assert out["reading"]["swc"]["files"] == 1 and out["reading"]["swc"]["points"] == 2, out
PY
"$BRAINFOREST" bench io cells/stem.swc | grep -q '^swc '

source "$FOREST_SOURCE_DIR/tests/words.sh"
fails_with 1 'known are .swc' "$BRAINFOREST" bench io cells/notes.txt
fails_with 2 nowhere "$BRAINFOREST" bench io nowhere
fails_with 2 "say which benchmark" "$BRAINFOREST" bench

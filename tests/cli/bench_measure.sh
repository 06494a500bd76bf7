# SPDX-License-Identifier: Apache-2.0
# brainforest bench measure: that it checks its work and says what it found. How fast it is, no test asks.
trap 'echo "failed in line $LINENO: $BASH_COMMAND"' ERR

mkdir cells
printf '1 1 0 0 0 5 -1\n2 3 0 5 0 1 1\n3 3 0 15 0 1 2\n4 3 9 25 0 1 3\n5 3 -9 35 0 1 3\n' >cells/fork.swc
"$BRAINFOREST" bench measure cells --each --json >out.json
python3 - <<'PY'
import json
out = json.load(open("out.json"))
assert out["metrics"] >= 100 and out["neurons"] == 1 and out["points_per_neuron"] == 6, out
for rate in "neurons_per_second", "neurons_summarized_per_second", "sholl_microseconds", "barcodes_per_second":
    assert out[rate] > 0, (rate, out)
assert 99 <= out["bars_per_barcode"] <= 101 and len(out["microseconds"]) == out["metrics"], out
PY
source "$FOREST_SOURCE_DIR/tests/words.sh"
fails_with 1 nowhere "$BRAINFOREST" bench measure nowhere

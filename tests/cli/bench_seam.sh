# SPDX-License-Identifier: Apache-2.0
# brainforest bench seam: what it prints, keeps and refuses. How large the figures are, no test asks.
trap 'echo "failed in line $LINENO: $BASH_COMMAND"' ERR

small=(--neurons 20 --size 96x64 --seconds 1 --rate 8)
"$BRAINFOREST" bench seam "${small[@]}" --frames 4 --error 1 --causes --out worst --json >out.json
/usr/bin/python3 - <<'PY'
import json
out = json.load(open("out.json"))
assert list(out)[:3] == ["change_ratio", "similarity_min", "disconnected"], out
assert out["pictures"] == 8 and out["compared"] == 4 and out["neurons"] == 20, out
assert 0 < out["similarity_min"] <= out["similarity_mean"] <= 1 and out["change_ratio"] > 0, out
assert len(out["every"]) == 4 and out["every"][1]["picture"] == out["every"][0]["picture"] + 1, out
assert {row["picture"] for row in out["every"]} >= {out["least_alike"], out["largest_change"]["picture"]}, out
alike = out["causes"]["every_segment"]["similarity_mean"]
assert alike > .9 and alike > out["similarity_mean"], "drawn alike, the pictures differ"
PY
for picture in least_alike largest_change largest_step_ratio; do
  [ "$(head -c 4 worst/$picture.png | tail -c 3)" = PNG ]
done

# Without the budget, which depends on the machine, the same run gives the same figures at any number of threads.
for threads in 1 2; do
  "$BRAINFOREST" bench seam "${small[@]}" --frames 2 --error 2 --json --threads $threads >$threads.json
  sed -i 's/"reference_seconds":[^,]*,//' $threads.json
done
cmp 1.json 2.json
"$BRAINFOREST" bench seam "${small[@]}" --frames 2 | grep -q 'disconnected branches: '

source "$FOREST_SOURCE_DIR/tests/words.sh"
fails_with 2 neurons "$BRAINFOREST" bench seam --neurons 1
fails_with 2 size "$BRAINFOREST" bench seam --size 0x5
fails_with 2 error "$BRAINFOREST" bench seam --error nan
touch file
fails_with 1 file "$BRAINFOREST" bench seam "${small[@]}" --out file/folder

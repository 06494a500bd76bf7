# SPDX-License-Identifier: Apache-2.0
# brainforest bench grow: what it prints and refuses. How fast it is, no test asks.
trap 'echo "failed in line $LINENO: $BASH_COMMAND"' ERR

"$BRAINFOREST" bench grow --seconds 0.01 --json >out.json
python3 - <<'PY'
import json
out = json.load(open("out.json"))
assert out["neurons_per_second"] > 0 and out["segments_per_second"] > out["neurons_per_second"], out
assert set(out["growing"]) == {"astrocyte", "basket", "bes", "martinotti", "microglia", "motoneuron", "purkinje", "pyramidal", "retraction", "stellate", "tufted"}, out
for result in out["growing"].values():
    assert result["neurons"] >= 200 and result["segments_each"] > 300, out
    assert result["neurons_per_second_into_a_file"] > 0 and result["bytes_each_in_the_file"] > 1000, out
PY
mkdir place
"$BRAINFOREST" bench grow --grammar bes --seconds 0.01 --folder place >out.txt
[ -z "$(ls place)" ]  # the file is removed again

# A grammar that grows nothing, or the same twice, is not timed.
printf 'axiom: Soma(10) A\ngrow: A -> B\n' >nothing.lsys
printf 'steps: 2\naxiom: Soma(10) A\ngrow: A -> F(10) A\n' >same.lsys
for grammar in nothing same; do
  status=0
  "$BRAINFOREST" bench grow --grammar $grammar.lsys >out.txt 2>err.txt || status=$?
  [ $status = 1 ] && grep -q 'not really grown' err.txt
done

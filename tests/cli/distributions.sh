# SPDX-License-Identifier: Apache-2.0
# brainforest distributions: what it prints, keeps and refuses; what is kept can grow.
trap 'echo "failed in line $LINENO: $BASH_COMMAND"' ERR

source "$FOREST_SOURCE_DIR/tests/words.sh"

$BRAINFOREST grow --grammar pyramidal --count 40 --seed 7 --out cells --repo cells.db --population grown >/dev/null

$BRAINFOREST distributions cells --kind basal --replicates 19 >one.txt
grep -q '^40 cells, [0-9]* segments$' one.txt
for word in 'segment nontermination' 'order up to' 'segment trajectory and length' 'length_of_terminal_segments' \
  'rotations at bifurcations' 'torque' 'calibre' 'stem_diameter'; do grep -q "$word" one.txt; done

# The same numbers from a repository, on any number of threads.
$BRAINFOREST distributions cells --kind basal --replicates 19 --threads 1 --json >files.json
$BRAINFOREST distributions --repo cells.db --population grown --kind basal --replicates 19 --threads 4 --json >repo.json
python3 - <<'PY'
import json, math
files, repo = json.load(open("files.json")), json.load(open("repo.json"))
a, b = ({q["name"]: q for q in d["quantities"]} for d in (files, repo))
assert files["segments"] == repo["segments"] and a.keys() == b.keys()
for name in a:
    assert a[name]["family"] == b[name]["family"] and a[name]["count"] == b[name]["count"], name
    assert a[name]["count"] == 0 or math.isclose(a[name]["kolmogorov"] or 0, b[name]["kolmogorov"] or 0, abs_tol=.01), name
# What the grammar says: basal_fork = 0: 0.95, 1: 0.9, 2: 0.65, 3: 0.4, …
for bin, chance in zip(files["nontermination_by"]["order"], (0.95, 0.9, 0.65, 0.4)):
    assert bin["lower"] - .03 <= chance <= bin["upper"] + .03, (bin, chance)
# … terminal branches of normal(105, 25) µm, at least 30; forks of 60 ± 18 degrees.
length = a["length_of_terminal_segments"]
assert abs(length["estimates"][0]["value"] - 105) < 5 and length["family"] in ("normal", "truncnormal", "weibull"), length
assert all(e["lower"] is None or e["lower"] <= e["value"] <= e["upper"] for q in a.values() for e in q["estimates"])
PY

# A report that loads nothing: every quantity with its values, curve, parameters and candidates. It replaces nothing else.
$BRAINFOREST distributions cells --kind basal --replicates 19 --report report.html >told.txt
grep -q 'The report is report.html' told.txt
/usr/bin/python3 - <<'PY'
import re, json
from xml.etree import ElementTree
text = open("report.html", encoding="utf-8").read()
assert not re.search(r'(src|href)=|url\(|@import|<script', text)
plots = re.findall(r"<svg.*?</svg>", text, re.S)
assert len(plots) >= 5
for svg in plots:
    ElementTree.fromstring(svg)  # well-formed
    assert "nan" not in svg and "inf\"" not in svg
for q in json.load(open("files.json"))["quantities"]:
    assert (q["name"] in text) == (q["count"] > 0), q["name"]
    if q["count"]:
        assert all(c["family"] in text for c in q["candidates"])
PY
$BRAINFOREST distributions cells --kind basal --replicates 19 --report report.html >/dev/null  # again: nothing changes
echo changed >>report.html
fails_with 1 'report.html' $BRAINFOREST distributions cells --kind basal --replicates 19 --report report.html

# By what they depend on; each bin holds enough values.
$BRAINFOREST distributions cells --kind basal --by order --least 60 --replicates 0 --json >by.json
python3 - <<'PY'
import json
for q in json.load(open("by.json"))["quantities"]:
    uppers = [b["up_to"] for b in q["bins"]]
    assert uppers == sorted(set(uppers))
    assert all(b["count"] >= 60 for b in q["bins"]) or len(q["bins"]) == 1
    assert sum(b["count"] for b in q["bins"]) == q["count"]
PY
$BRAINFOREST distributions cells --kind basal --by path --replicates 0 >path.txt
grep -q 'path up to' path.txt

# Kept in the repository, in versions, as texts that a grammar can use.
$BRAINFOREST distributions --repo cells.db --population grown --kind basal --replicates 0 --keep >kept.txt
grep -q 'are kept in cells.db' kept.txt
$BRAINFOREST distributions --repo cells.db --population grown --kind basal --by radius --replicates 0 --keep --json >again.json
[ "$(python3 -c 'import json; print({(k["name"], k["version"]) for k in json.load(open("again.json"))["kept"]} >= {("basal.torque", 2), ("basal.nontermination_by_order", 1)})')" = True ]
for name in length_of_terminal_segments torque nontermination_by_order; do
  $BRAINFOREST model show basal.$name --repo cells.db >>use.lsys
done
$BRAINFOREST model show basal.amplitude@1 --repo cells.db >>use.lsys
cat >>use.lsys <<'TEXT'
steps: 4
axiom: Soma(10) f(5) A(0)
grow: A(order) : nontermination_by_order(order) { t = torque(0.5), a = amplitude() }
  -> F(length_of_terminal_segments(0.5), 1) /(t) [ +(a / 2) A(order + 1) ] -(a / 2) A(order + 1)
end: A(order) -> F(length_of_terminal_segments(0.5), 1)
TEXT
$BRAINFOREST grow --grammar use.lsys --count 5 --out used >/dev/null
[ "$(ls used | wc -l)" = 5 ]

# A parametric grammar of the population, in both forms; it grows cells of about as many tips.
for form in burke hillman; do
  $BRAINFOREST distributions cells --kind dendrite --replicates 0 --grammar $form.lsys --form $form >/dev/null
  $BRAINFOREST grow --grammar $form.lsys --count 60 --out $form >/dev/null
  $BRAINFOREST measure $form --kind dendrite --metric number_of_leaves,total_length --json >$form.json
done
$BRAINFOREST measure cells --kind dendrite --metric number_of_leaves,total_length --json >cells.json
python3 - <<'PY'
import json
def mean(name, metric):
    values = [row[metric] for row in json.load(open(name))["rows"]]
    return sum(values) / len(values)
for form in ("burke", "hillman"):
    for metric in ("number_of_leaves", "total_length"):
        ratio = mean(form + ".json", metric) / mean("cells.json", metric)
        assert .6 < ratio < 1.6, (form, metric, ratio)
PY
fails_with 1 'burke.lsys is there and holds something else' $BRAINFOREST distributions cells --kind basal --replicates 0 --grammar burke.lsys

# Refusals.
cp cells/pyramidal-7-00000.swc one.swc
fails_with 1 'none of the 40 neurons has a section of kind glia' $BRAINFOREST distributions cells --kind glia
fails_with 1 'few' $BRAINFOREST distributions --repo cells.db --population few
echo nonsense >bad.swc
fails_with 1 '1 of 2 neurons could not be read' $BRAINFOREST distributions bad.swc one.swc
fails_with 2 'files' $BRAINFOREST distributions
fails_with 2 'population' $BRAINFOREST distributions --repo cells.db --keep
fails_with 2 'by' $BRAINFOREST distributions cells --by mood
fails_with 2 'no kind of section' $BRAINFOREST distributions cells --kind dragon
fails_with 2 'least' $BRAINFOREST distributions cells --least 0

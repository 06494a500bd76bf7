# SPDX-License-Identifier: Apache-2.0
# brainforest compare, typical, classify and judge: what they say of grown neurons, what they refuse, that a seed and not
# the number of threads decides.
trap 'echo "failed in line $LINENO: $BASH_COMMAND"' ERR

source "$FOREST_SOURCE_DIR/tests/words.sh"

$BRAINFOREST grow --grammar pyramidal --count 36 --seed 1 --out all >/dev/null
mkdir one two three mixed
n=0
for file in all/*.swc; do
  n=$((n + 1))
  if [ $n -le 12 ]; then cp "$file" one/; elif [ $n -le 24 ]; then cp "$file" two/; else cp "$file" three/; fi
done
$BRAINFOREST grow --grammar purkinje --count 12 --seed 1 --out purkinje >/dev/null

# Two kinds are told apart, two halves of one kind are not.
quick="--repeats 5 --permutations 99"
$BRAINFOREST compare one purkinje $quick --csv features.csv --report apart.html --json >apart.json
told apart.json 'd["told_apart"] and d["random_forest"]["value"] > .95 and d["random_forest"]["p"] <= .02'
told apart.json 'd["a"] == {"name": "one", "cells": 12} and d["b"]["name"] == "purkinje"'
told apart.json 'd["metrics"][0]["p_holm"] < .01 and abs(d["metrics"][0]["cliffs_delta"]["value"]) == 1'
told apart.json 'abs(sum(m["importance"] for m in d["metrics"]) - 1) < 1e-9'
$BRAINFOREST compare one two $quick --json >same.json
told same.json 'not d["told_apart"] and d["power"]["auc"] > .6 and d["energy"]["p"] > .05'
$BRAINFOREST compare one two $quick >same.txt
grep -q 'cannot be told apart by these cells' same.txt

# The table that others judge by: a row a cell, groups, what depends on diameters marked.
/usr/bin/python3 - <<'PY'
import csv
rows = list(csv.DictReader(open("features.csv", encoding="utf-8-sig")))
assert len(rows) == 24 and {r["group"] for r in rows} == {"one", "purkinje"}, rows[0]
assert "all total_length (µm)" in rows[0] and "all total_volume [diameters] (µm³)" in rows[0], list(rows[0])
PY

# A report is one file that loads nothing; every plot in it is well-formed, no words lie over others or beyond the picture,
# and axes of single values have two numbers or more, without which they are no scale.
report_holds() {  # file, least number of plots
  /usr/bin/python3 - "$1" "$2" <<'PY'
import re, sys
import xml.etree.ElementTree as xml
from collections import Counter
text = open(sys.argv[1], encoding="utf-8").read()
def place(plot):
    picture = xml.fromstring(plot)
    width, height = map(float, picture.get("viewBox").split()[2:])
    boxes, numbers = [], Counter()
    for t in picture.iter("{http://www.w3.org/2000/svg}text"):
        if t.get("x") is None: continue  # upright
        x, y, size, anchor = float(t.get("x")), float(t.get("y")), float(t.get("font-size")), t.get("text-anchor", "start")
        long = .52 * size * len(t.text)  # of most typefaces
        left = x - {"start": 0, "middle": .5, "end": 1}[anchor] * long
        assert left > -2 and left + long < width + 2 and size < y + 4 and y < height, (sys.argv[1], "beyond the picture", t.text)
        for other, x0, x1, y0 in boxes:
            assert abs(y - y0) > .7 * size or left > x1 or left + long < x0, (sys.argv[1], "over one another", t.text, other)
        boxes.append((t.text, left, left + long, y))
        if anchor == "middle": numbers[y, (x + 10) // 300] += 1
    if picture.get("aria-label") == "Values of single cells":
        assert numbers and min(numbers.values()) >= 2, (sys.argv[1], numbers)
plots = re.findall(r"<svg.*?</svg>", text, re.S)
assert len(plots) >= int(sys.argv[2]), len(plots)
for plot in plots:
    xml.fromstring(plot)
    assert "nan" not in re.sub(r">[^<]*<", "", plot).lower() and "inf" not in re.sub(r">[^<]*<", "", plot).lower(), plot[:300]
    place(plot)
assert not re.search(r'(src|href)\s*=|@import|url\(', text), "it loads something"
PY
}
report_holds apart.html 5
long=population_of_neurons_with_a_name_that_needs_the_whole_width_of_a_plot_and_more
cp -r one "one_$long" && cp -r purkinje "two_$long"
$BRAINFOREST compare "one_$long" "two_$long" $quick --report long.html >/dev/null
report_holds long.html 5
grep -q '>◂ larger in one_[a-z_]*…[a-z_]*<' long.html
refuses 'is there' $BRAINFOREST compare one two $quick --report apart.html
$BRAINFOREST compare one two $quick --report apart.html --force >/dev/null

# A seed decides, threads do not.
$BRAINFOREST compare one two $quick --seed 3 --threads 1 --json >first.json
$BRAINFOREST compare one two $quick --seed 3 --threads 4 --json >second.json
cmp first.json second.json

# A repository gives the same as the files in it.
$BRAINFOREST import one --repo cells.db --population one >/dev/null
$BRAINFOREST import two --repo cells.db --population two >/dev/null
$BRAINFOREST compare --repo cells.db --population one --with two $quick --seed 3 --json >stored.json
cmp first.json stored.json
fails_with 1 'few' $BRAINFOREST compare --repo cells.db --population one --with few
fails_with 2 '--with' $BRAINFOREST compare --repo cells.db --population one
fails_with 2 'two folders' $BRAINFOREST compare
# Sisters are kept together; an expression that is none is bad usage.
$BRAINFOREST compare one two $quick --slices '^[a-z]+-1-0000.' --json >sisters.json
told sisters.json 'd["random_forest"]["value"] < .9 and d["a"]["cells"] == 12'
refuses 'what is of one slice cannot be dealt' $BRAINFOREST compare one two --slices '^[a-z]+'
$BRAINFOREST grow --grammar pyramidal --count 4 --seed 1 --repo self.db >/dev/null
$BRAINFOREST compare --repo self.db --population pyramidal --with pyramidal $quick --json >self.json 2>/dev/null
told self.json 'not d["told_apart"] and d["a"]["name"] != d["b"]["name"]'
refuses 'has a section of kind glia' $BRAINFOREST judge --model pyramidal --train one --held-out two --kind glia
fails_with 2 'no regular expression' $BRAINFOREST compare one two --slices '(['
fails_with 2 'at most 1000 characters' $BRAINFOREST compare one two --slices "$(printf 'a%.0s' {1..1001})"
$BRAINFOREST compare one two $quick --slices '(a+)+[!]|-1-0000.' >/dev/null 2>part.txt  # no pattern takes for ever
grep -q 'finds nothing in 14 of 24 names' part.txt

refuses '-00000.swc has 1 cell, and a population of fewer than four' $BRAINFOREST compare one all/*-00000.swc
$BRAINFOREST compare one one $quick >/dev/null 2>own.txt  # the same cells on both sides
grep -q 'in one, too' own.txt

# How typical: a cell of another kind is not, and it is said by what.
$BRAINFOREST typical purkinje/*-00000.swc --population all --report typical.html --json >typical.json
told typical.json 'd["p"] <= .09 and d["metrics"][0]["abnormal"] and d["cells"] == 36'
report_holds typical.html 1
/usr/bin/python3 - <<'PY'
import json
d = json.load(open("typical.json"))
metrics = [m for m in d["metrics"] if not m["name"].endswith(" is defined")]
assert d["outside_of"] == len(metrics) and d["outside"] == sum(m["outside"] for m in metrics), (d["outside_of"], len(metrics))
assert d["outside"] > d["outside_most"] >= d["outside_usual"] > 0 and d["outside_as_many"] == 0
assert f"outside the range of all 36 cells in {d['outside']}, more than any of these cells" in d["sentence"], d["sentence"]
PY
$BRAINFOREST typical all/*-00003.swc --population all --json >member.json
told member.json '"35 cells of all are too few to say whether it is typical" in d["sentence"] and d["outside"] <= d["outside_most"] and d["outside_as_many"] > 0'
told member.json 'd["cells"] == 35 and 0 < d["p"] <= 1'  # the cell itself is no part of what it stands beside
first=$(basename "$(ls one/*.swc | head -n 1)" .swc)
$BRAINFOREST typical "$first" --repo cells.db --population one --json >stored.json
told stored.json 'd["cells"] == 11'
refuses 'fewer than five' $BRAINFOREST typical purkinje/*-00000.swc --population all/*-00001.swc
fails_with 2 'population' $BRAINFOREST typical purkinje/*-00000.swc

# Types: two kinds of neurons are found again.
$BRAINFOREST classify all purkinje --csv types.csv --report types.html --json >types.json
told types.json 'd["adjusted_rand"] > .9 and len(d["types"]) >= 2 and d["types"][0]["metrics"]'
[ "$(wc -l <types.csv)" = 49 ]
report_holds types.html 3
$BRAINFOREST classify all purkinje --types 2 --threads 1 --json >first.json
$BRAINFOREST classify all purkinje --types 2 --threads 4 --json >second.json
cmp first.json second.json
refuses 'into 20 types' $BRAINFOREST classify one --types 20
fails_with 2 'files or --repo' $BRAINFOREST classify

# What has no such sections is not compared; so few cells cannot show what is strange; results are written all or none.
for verb in "compare one two" "classify one" "typical purkinje/*-00000.swc --population one"; do
  refuses 'has a section of kind glia' $BRAINFOREST $verb --kind glia
done
$BRAINFOREST typical purkinje/*-00000.swc --population one >few.txt
grep -q 'as so few cells can show' few.txt
refuses 'its folder is not there' $BRAINFOREST compare one two $quick --csv no.csv --report nowhere/no.html
refuses 'its folder is not there' $BRAINFOREST classify all --csv no.csv --report nowhere/no.html
refuses 'is named twice' $BRAINFOREST judge --train one --held-out two --grown three --features no.csv --report no.csv
fails_with 2 'permutations' $BRAINFOREST compare one two --permutations 0
mkdir copies && for i in 1 2 3 4 5 6 7; do cp "one/$first.swc" copies/$i.swc; done
refuses 'the same in every metric' $BRAINFOREST classify copies
sed '/^#/!s/^\(30 [0-9]*\) [^ ]*/\1 nan/' "one/$first.swc" >odd.swc
$BRAINFOREST measure odd.swc --metric total_length >/dev/null 2>odd.txt
grep -q '1 of 1 neuron holds something odd that only the tracing can mend, first odd.swc' odd.txt
[ ! -e no.csv ]

# The judge: cells of another kind are no passable growth; the controls say whether it could have seen.
$BRAINFOREST judge --train one --held-out two --grown purkinje --repeats 3 --features judged.csv --report judged.html --json >judged.json
told judged.json 'd["pass"] is False and d["auc"]["structure"]["value"] > .9 and d["ks_rejections"] > 0 and d["energy_p"] < .05'
told judged.json 'list(d)[:10] == ["pass", "auc", "energy_p", "mmd_p", "ks_rejections", "mvs_max", "sholl_inside", "copying", "controls", "seeds"]'
told judged.json 'set(d["controls"]) == {"burke", "stretched", "jittered"} and all(c["rejected"] and c["by"] for c in d["controls"].values())'
told judged.json '{"value", "lower", "upper"} <= set(d["auc"]["real_control"]) and d["copying"]["longest_run"] is None'
report_holds judged.html 4
# What is drawn is what was found, where the usual axis has no room for it, too.
/usr/bin/python3 - <<'PY'
import json, re
auc = json.load(open("judged.json"))["auc"]
plot = next(p for p in re.findall(r"<svg.*?</svg>", open("judged.html").read(), re.S) if "grown, structure" in p)
text = {words: (float(x), float(y)) for x, y, words in re.findall(r'<text x="(.*?)" y="(.*?)".*?>(.*?)</text>', plot)}
dots = {float(y): float(x) for x, y in re.findall(r'<circle cx="(.*?)" cy="(.*?)"', plot)}
marks = sorted((float(words), x) for words, (x, y) in text.items() if re.fullmatch(r"[0-9.]+", words))
(v0, x0), (v1, x1) = marks[0], marks[-1]
assert min(auc[name]["lower"] for name in ("depth", "level")) < .4, auc
for label, name in (("grown, structure", "structure"), ("grown, depth alone", "depth"), ("grown, level alone", "level"),
                    ("real training cells, structure", "real_control")):
    drawn = v0 + (dots[round(text[label][1] - 4, 1)] - x0) / (x1 - x0) * (v1 - v0)
    assert abs(drawn - auc[name]["value"]) < .01, (label, drawn, auc[name])
PY
/usr/bin/python3 - <<'PY'
import re
page = open("judged.html").read()
traced, grown = re.search(r"Traced are ([A-L, ]+); grown are ([A-L, ]+)\.", page).groups()
assert sorted(traced.split(", ") + grown.split(", ")) == list("ABCDEFGHIJKL") and len(traced) == len(grown), (traced, grown)
assert all(re.search(rf"<text [^>]*>{letter}</text>", page) for letter in "ABCDEFGHIJKL")
PY
/usr/bin/python3 - <<'PY'
import csv
groups = [r["group"] for r in csv.DictReader(open("judged.csv", encoding="utf-8-sig"))]
assert [groups.count(g) for g in ("train", "held_out", "grown")] == [12, 12, 12], groups
PY
$BRAINFOREST judge --train one --held-out two --grown three --burke purkinje --repeats 3 --json >alike.json
told alike.json 'd["auc"]["structure"]["value"] < .85 and d["controls"]["burke"]["rejected"] and d["mmd_p"] > .01'
$BRAINFOREST judge --train one --held-out two --grown one --repeats 3 >copied.txt 2>warned.txt
grep -q 'FAIL *copying.neighbour_ratio' copied.txt
grep -q '12 cells of one are in one, too' warned.txt
told judged.json 'all(c["pass"] == {"at most": c["value"] <= c["limit"], "at least": c["value"] >= c["limit"], "more than": c["value"] > c["limit"]}[c["asked"]] for c in d["criteria"])'
fails_with 2 'grown' $BRAINFOREST judge --train one --held-out two
fails_with 2 'populations' $BRAINFOREST judge --train one --held-out two --grown three --populations 3

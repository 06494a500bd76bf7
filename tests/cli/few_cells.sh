#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Few cells on trial: each left out in turn, of dendrites, of an axon, of cells that begin at a fibre instead of a soma.
set -euo pipefail
source "$FOREST_SOURCE_DIR/tests/words.sh"

"$program" grow --grammar purkinje --count 5 --seed 4 --out few >/dev/null
"$program" judge --leave-one-out --train few --count 19 --repeats 3 --report few.html --features few.csv --json >few.json
told few.json "d['pass'] is None and d['leave_one_out'] and d['refitted'] and d['cells'] == {'traced': 5, 'grown_for_each': 19}"
told few.json "d['detectable_auc'] > .75 and 'cannot show' in d['sentence'] and len(d['left_out']) == 5"
told few.json "all(0 < c['p'] <= 1 and 0 <= c['auc']['structure'] <= 1 for c in d['left_out']) and 1 <= d['copying']['longest_run'] <= 3"
grep -q 'cannot show' few.html
/usr/bin/python3 - <<'PY'
import csv
from collections import Counter
groups = Counter(row["group"] for row in csv.DictReader(open("few.csv")))
assert groups["traced"] == 5 and sum(groups.values()) == 5 + 5 * 19 and len(groups) == 6, groups
PY
# The same without the word, and the same again at another number of threads.
"$program" judge --train few --count 19 --repeats 3 --threads 1 --json >again.json
cmp few.json again.json
# A model that saw none of them is not fitted; a wrong one is told apart.
"$program" judge --train few --model motoneuron --count 19 --repeats 3 --json >wrong.json
told wrong.json "not d['refitted'] and d['told_apart'] and d['rejections'] > 20 and d['auc']['structure']['value'] > .9"

# Insects: no soma, arbors that leave one point of a fibre, all of kind 2.
/usr/bin/python3 - <<'PY'
import math, os, random
os.makedirs("insects")
for cell in range(4):
    random.seed(cell)
    rows = ["1 2 5 5 5 3 -1"]
    def branch(parent, at, heading, radius, left):
        for _ in range(random.randint(3, 6)):
            heading = [h + random.gauss(0, .2) for h in heading]
            size = math.sqrt(sum(h * h for h in heading))
            at = [a + 4 * h / size for a, h in zip(at, heading)]
            rows.append(f"{len(rows) + 1} 2 {at[0]:.3f} {at[1]:.3f} {at[2]:.3f} {radius:.2f} {parent}")
            parent = len(rows)
        if left:
            for side in (-1, 1):
                branch(parent, at, [heading[0] + side * .6, heading[1] + .2, heading[2] - side * .3], radius * .8, left - random.randint(1, left))
    for stem in range(3):
        branch(1, [5, 5, 5], [math.cos(2 * stem), math.sin(2 * stem), .2], 1.5, 5)
    open(f"insects/fly{cell}.swc", "w").write("\n".join(rows) + "\n")
PY
"$program" fit insects --kind axon -o insects.lsys >/dev/null
"$program" grow --grammar insects.lsys --count 3 --seed 1 --out grown >/dev/null
"$program" measure grown insects --metrics number_of_neurites soma_radius --json >measured.json
grep -c ' -1$' grown/*00000.swc | grep -qx 1 || fail "an insect's arbors do not leave one point"
[ "$(grep -v '^#' grown/*00000.swc | awk '$7 == 1' | wc -l)" = 3 ] || fail "an insect has other than three stems"
grep -v '^#' grown/*00000.swc | awk '$2 != 2 { exit 1 }' || fail "kinds are lost"
"$program" judge --train insects --kind axon --count 19 --repeats 2 --json >insects.json
told insects.json "d['cells']['traced'] == 4"

"$program" judge --train insects --kind axon --model insects.lsys --count 19 --repeats 2 >out.txt 2>err.txt
grep -qF 'was fitted to 4 of the 4 cells that it is judged by, fly0 first' err.txt || fail "a model is judged by its own cells without a word"

# Names with what stands between names are told from one another, and from a list.
mkdir odd && cp insects/fly0.swc 'odd/L5, tuft.swc' && cp insects/fly1.swc 'odd/ L5,.swc' && cp insects/fly2.swc odd/tuft,2.swc
cp insects/fly3.swc 'odd/L5\x2C tuft.swc'
"$program" fit odd --kind axon -o odd.lsys >/dev/null
"$program" judge --train odd --kind axon --model odd.lsys --count 19 --repeats 2 --json >odd.json 2>/dev/null
told odd.json "d['fitted_to'] == 4"
mkdir others && for i in 0 1 2 3; do cp insects/fly$i.swc "others/$(echo 'L5|tuft|2|L5,' | cut -d'|' -f$((i + 1))).swc"; done
"$program" judge --train others --kind axon --model odd.lsys --count 19 --repeats 2 --json >others.json 2>/dev/null
told others.json "d['fitted_to'] == 0"
mkdir twice && cp insects/fly0.swc twice/a.swc && cp insects/fly0.swc twice/b.swc && cp insects/fly1.swc twice
"$program" fit twice --kind axon -o twice.lsys >/dev/null 2>err.txt
grep -qF '1 cell of twice is there twice, first b is a' err.txt || fail "copies are fitted to without a word"

refuses 'give at least 3' "$program" judge --train insects/fly0.swc insects/fly1.swc --kind axon --model insects.lsys --count 19
refuses 'at least 19' "$program" judge --train insects --kind axon --count 5
refuses 'has a section of kind dendrite' "$program" judge --train insects --kind dendrite --count 19
fails_with 2 '--model or --grown' "$program" judge --train insects --held-out few
fails_with 2 '--count' "$program" judge --train insects --grown grown --count 20
fails_with 2 '--burke' "$program" judge --train insects --leave-one-out --burke grown
fails_with 2 '--held-out' "$program" judge --train insects --held-out few --leave-one-out

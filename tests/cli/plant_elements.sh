# SPDX-License-Identifier: Apache-2.0
# brainforest plant --elements: neurons in the elements of a small ball of cortex, rigid and bent; the same whichever elements are
# asked for; what it refuses.
trap 'echo "failed in line $LINENO: $BASH_COMMAND"' ERR

source "$FOREST_SOURCE_DIR/tests/words.sh"

python3 - <<'PY'
import math, struct
def ball(radius, halvings=4):
    t = (1 + 5 ** .5) / 2
    p = [(-1, t, 0), (1, t, 0), (-1, -t, 0), (1, -t, 0), (0, -1, t), (0, 1, t), (0, -1, -t), (0, 1, -t),
         (t, 0, -1), (t, 0, 1), (-t, 0, -1), (-t, 0, 1)]
    f = [(0, 11, 5), (0, 5, 1), (0, 1, 7), (0, 7, 10), (0, 10, 11), (1, 5, 9), (5, 11, 4), (11, 10, 2), (10, 7, 6), (7, 1, 8),
         (3, 9, 4), (3, 4, 2), (3, 2, 6), (3, 6, 8), (3, 8, 9), (4, 9, 5), (2, 4, 11), (6, 2, 10), (8, 6, 7), (9, 8, 1)]
    for _ in range(halvings):
        middle, g = {}, []
        def half(a, b):
            key = (min(a, b), max(a, b))
            if key not in middle:
                middle[key] = len(p)
                p.append(tuple((x + y) / 2 for x, y in zip(p[a], p[b])))
            return middle[key]
        for a, b, c in f:
            x, y, z = half(a, b), half(b, c), half(c, a)
            g += [(a, x, z), (b, y, x), (c, z, y), (x, y, z)]
        f = g
    scale = [radius / math.sqrt(sum(x * x for x in q)) for q in p]
    return [tuple(x * s for x in q) for q, s in zip(p, scale)], f
def write(name, mesh):
    p, f = mesh
    with open(name, "wb") as o:
        o.write(b"\xff\xff\xfe" + b"made for a test\n\n" + struct.pack(">ii", len(p), len(f)))
        for q in p: o.write(struct.pack(">fff", *q))
        for q in f: o.write(struct.pack(">iii", *q))
write("outer", ball(8))
write("inner", ball(6))
PY
$BRAINFOREST cortex build outer inner -o e.h5 >/dev/null

for population in pyramidal interneuron; do
  for i in 1 2; do
    cat >$population-$i.swc <<SWC
1 1 10 20 30 $((3 + i)) -1
2 3 10 3$i 30 1 1
3 3 10 9$i 30 1 2
4 3 60 15$i 30 .5 3
5 3 -40 14$i 50 .5 3
SWC
  done
  $BRAINFOREST import $population-*.swc --repo cells.db --population $population >import.txt
done

plant() { $BRAINFOREST plant --elements e.h5 --recipe human-frontal --repo cells.db "$@"; }
plant --element 3,7 --seed 2 --scale .1 --out two --json >two.json
plant --element 7 --seed 2 --scale .1 --out one --json --threads 1 >one.json
python3 - <<'PY'
import json
one, two = json.load(open("one.json")), json.load(open("two.json"))
assert [e["element"] for e in two["tissue"]["elements"]] == [3, 7], two
assert two["tissue"]["elements"][1]["neurons"] == one["neurons"] > 1000, (one, two)
assert two["neurons"] == sum(row["count"] for row in two["planted"])
assert abs(one["neurons"] / one["tissue"]["volume"] - 3173) < 350, one   # a tenth of area FD's
PY
/usr/bin/python3 - <<'PY'
import h5py, numpy as np
def rows(folder):
    group = h5py.File(folder + "/nodes.h5")["nodes"]
    group = group[list(group)[0]]["0"]
    return np.stack([group[k][:] for k in ("x", "y", "z")], 1)
one, two = rows("one"), rows("two")
assert np.array_equal(one, two[-len(one):])            # an element is the same whichever others are planted
assert np.all((np.linalg.norm(one, axis=1) > 5900) & (np.linalg.norm(one, axis=1) < 8100))
PY

plant --near 0 0 8000 --row 3 --scale .002 --bend grid --out bent --json >bent.json
python3 - <<'PY'
import json
bent = json.load(open("bent.json"))
assert len(bent["tissue"]["elements"]) == 3 and bent["morphologies"] == bent["neurons"] > 100, bent
bending = bent["tissue"]["bending"]
assert bending["beyond_pia"] <= 1e-3 and .8 < bending["length_ratio"] < 1.2, bending
PY
$BRAINFOREST pack bent -o bent.forest >/dev/null
$BRAINFOREST cortex faces e.h5 --edges 3,7 -o cage.gii >/dev/null
$BRAINFOREST render bent.forest --surface cage.gii --size 64x48 -o bent.png >/dev/null

# What is wrong is said in a sentence with what to do, and nothing is left behind.
fails_with 1 'e.h5 has elements 0 to' plant --element 1000000 --out no
fails_with 1 'is no list of elements' plant --element 1,x --out no
fails_with 1 'no element of e.h5 has its middle in that sphere' plant --sphere 0 0 0 10 --out no
fails_with 1 'say which elements' plant --out no
fails_with 1 'do not fit into layer' plant --element 1 --density 20000000 --out no
fails_with 1 'outer' $BRAINFOREST plant --elements outer --element 1 --recipe human-frontal --repo cells.db --out no
grep -v '^\[\[layer' "$FOREST_SOURCE_DIR/data/recipes/human-frontal.toml" | sed '/^thickness/,$d' >bare.toml
fails_with 1 'bare.toml' $BRAINFOREST plant --elements e.h5 --element 1 --recipe bare.toml --repo cells.db --out no
fails_with 2 'elements' $BRAINFOREST plant --element 1 --recipe human-frontal --repo cells.db --out no
[ ! -e no ]

# SPDX-License-Identifier: Apache-2.0
# brainforest plant --elements: neurons in the elements of a small ball of cortex, rigid and bent; the same whichever elements are
# asked for; what it refuses.
trap 'echo "failed in line $LINENO: $BASH_COMMAND"' ERR

source "$FOREST_SOURCE_DIR/tests/words.sh"

python3 - <<'PY'
import os, sys
sys.dont_write_bytecode = True
sys.path.append(os.environ["FOREST_SOURCE_DIR"] + "/tests")
from balls import ball, write
write("outer", ball(8))
write("inner", ball(6))
PY
$BRAINFOREST cortex build outer inner -o e.h5 >/dev/null

for population in pyramidal interneuron; do two_cells $population 3; done

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

# SPDX-License-Identifier: Apache-2.0
# brainforest plant --elements: neurons in the elements of a small ball of cortex, rigid and bent; the same whichever elements are
# asked for; what it refuses.
trap 'echo "failed in line $LINENO: $BASH_COMMAND"' ERR

source "$FOREST_SOURCE_DIR/tests/words.sh"

python3 - <<'PY'
import os, sys
sys.dont_write_bytecode = True
sys.path.append(os.environ["FOREST_SOURCE_DIR"] + "/tests")
from balls import areas, ball, write
write("outer", ball(8))
write("inner", ball(6))
# Three areas: in front, behind, and a spot on top.
areas("all.annot", [2 if z > 7 else 0 if y > 0 else 1 for x, y, z in ball(8)[0]], ["FA", "OC", "HA"])
areas("some.annot", [2 if z > 7 else 0 if y > 0 else 8 for x, y, z in ball(8)[0]], ["FA", "OC", "HA"])  # none behind
areas("small.annot", [0, 0], ["FA"])
# Six measured layers: the fourth is thick in front and thin behind.
for k, share in enumerate((.1, .1, .3, 0, .15, .15)):
    with open(f"layer{k + 1}.txt", "w") as o:
        for x, y, z in ball(8)[0]:
            front = .2 + .012 * y
            o.write("%g\n" % (2.5 * (front if k == 3 else share * (1 - front) / .8)))
PY
$BRAINFOREST cortex build outer inner -o e.h5 >/dev/null

for population in pyramidal interneuron; do two_cells $population 3; done

plant_in() { $BRAINFOREST plant --elements "$1" --recipe human-frontal --repo cells.db "${@:2}"; }
plant() { plant_in e.h5 "$@"; }
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

# A recipe that speaks of no column does as well, and of none at all here.
sed '/^\[column\]/,/^$/d' "$FOREST_SOURCE_DIR/data/recipes/human-frontal.toml" >tissue.toml
$BRAINFOREST plant --elements e.h5 --recipe tissue.toml --repo cells.db --element 7 --seed 2 --scale .1 --out no_column >/dev/null
cmp one/nodes.h5 no_column/nodes.h5
refuses 'speaks of no column' $BRAINFOREST plant --recipe tissue.toml --repo cells.db --out no
[ ! -e no ]

# What grows where it stands is for columns, and only what is not is offered.
fails_with 1 'recipe cortex-1000 grows its type L2/3 pyramidal cell by grammar tufted where it stands, which is done in columns alone' \
  $BRAINFOREST plant --elements e.h5 --recipe cortex-1000 --element 7 --out no
grep -q 'or give column-1000, column-10000, human-frontal' err.txt
fails_with 1 'those are column-1000, column-10000, human-frontal, human-visual, rat-barrel-column, rodent-types' \
  $BRAINFOREST plant --elements e.h5 --recipe human-frontl --element 7 --out no
fails_with 1 'those are column-1000, column-10000, cortex-1000,' $BRAINFOREST plant --recipe human-frontl --out no
[ ! -e no ]

# The lines that bound the element, and the way up.
python3 - <<'PY'
import json
ours = json.load(open("one/circuit_config.json"))["brainforest"]
lines = json.load(open("one/outline.json"))
assert ours["outline"] == "$BASE_DIR/outline.json" and len(lines) > 12 + 4 * 5, (ours, len(lines))
for line in lines:
    assert all(5900 < sum(c * c for c in p) ** .5 < 8100 for p in line), line
middle = [sum(p[k] for line in lines for p in line) for k in range(3)]
length = sum(c * c for c in middle) ** .5
assert sum(a * b for a, b in zip(middle, ours["up"])) / length > .99, (middle, ours["up"])   # away from the centre of the ball
PY
cp -r one damaged && echo '[[[1,2]]]' >damaged/outline.json
refuses 'a point of the "outline" must be three numbers' $BRAINFOREST pack damaged -o no.forest
[ ! -e no.forest ]

# Every soma is found again in its element, by the file of elements alone: the polynomial through 4×4×4 places.
/usr/bin/python3 - <<'PY'
import h5py, numpy as np
elements = h5py.File("e.h5")
places = elements["curves/places"][:].reshape(-1, 4, 3)
curves = elements["elements/curves"][:].reshape(-1, 16)
nodes = h5py.File("two/nodes.h5")["nodes"]
group = nodes[list(nodes)[0]]["0"]
assert set(group["element"][:]) == {3, 7}
def weights(t):
    at = np.arange(4) / 3
    return np.stack([np.prod([(t - at[j]) / (at[i] - at[j]) for j in range(4) if j != i], 0) for i in range(4)], 1)
lattice = places[curves[group["element"][:]]].reshape(-1, 4, 4, 4, 3)  # v, u, w
u, v, w = (weights(group[k][:].astype(float)) for k in "uvw")
found = np.einsum("ni,nj,nk,njikx->nx", u, v, w, lattice)
assert np.abs(found - np.stack([group[k][:] for k in "xyz"], 1)).max() < .01
PY

# By the areas of a map, and by a table of all elements.
areas="--labels all.annot --labels-on outer"
plant --region HA $areas --scale .001 --out spot --json >spot.json
plant --region HA OC FA $areas --scale .001 --out every --json >every.json
$BRAINFOREST cortex faces e.h5 -o faces.gii --table table.csv >/dev/null
/usr/bin/python3 - <<'PY'
import csv, json
rows = [{k: float(v) for k, v in r.items()} for r in csv.DictReader(open("table.csv"))]
of = lambda name: [e["element"] for e in json.load(open(name))["tissue"]["elements"]]
assert [r["element"] for r in rows] == list(range(len(rows))) == of("every.json"), len(rows)
spot = {r["element"] for r in rows if r["z"] > 7000 / 8000 * 7000}
assert len(spot) > 20 and len(spot ^ set(of("spot.json"))) < .2 * len(spot), (len(spot), of("spot.json"))
assert all(.5 < r["volume"] < 2 and abs(r["thickness"] - 2) < .1 and r["jacobian"] > .2 for r in rows)
PY
plant --region HA HA --labels some.annot --labels-on outer --scale .001 --out same --json >same.json
told same.json "d['tissue']['elements'] == json.load(open('spot.json'))['tissue']['elements']"
refuses "has no area 'FX'; its areas, several of which are parted by blanks, are FA, OC, HA" plant --region FX $areas --out no
refuses 'has areas of 2 vertices and outer has 2562' plant --region FA --labels small.annot --labels-on outer --out no
refuses 'names no areas' plant --region FA --labels layer1.txt --labels-on outer --out no
refuses 'more than .3 mm from the surface of the areas' plant --region FA --labels all.annot --labels-on inner --out no
fails_with 2 'labels' plant --region FA --out no

# A row ends where it would meet itself.
plant --near 0 0 8000 --row 10000 --scale .0001 --out round --json >round.json
python3 -c 'import json; e = [x["element"] for x in json.load(open("round.json"))["tissue"]["elements"]]; assert len(e) == len(set(e)) > 3, e'
refuses 'mm away from all elements; the first has its middle at' plant --near 1e9 0 0 --out no
refuses 'in mm it is among them: --near 0 0 7500' plant --near 0 0 7.5 --out no

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

# Layers where they were measured: IV is a third of the thickness in front, a tenth behind; by volume it is the same everywhere.
measured="--layers layer1.txt layer2.txt layer3.txt layer4.txt layer5.txt layer6.txt --layers-on outer"
for side in front back; do
  [ $side = front ] && y=8000 || y=-8000
  plant --near 0 $y 0 --seed 2 --scale .1 --out $side --json $measured >$side.json
  plant --near 0 $y 0 --seed 2 --scale .1 --out volume_$side --json >volume_$side.json
done
told front.json 'd["tissue"]["layers"] == "measured"'
# The density that is asked for is that of all elements together; what one has does not depend on which others are chosen.
plant --element all --seed 2 --density 300 --out dense --json $measured >dense.json
told dense.json 'abs(d["neurons"] / d["tissue"]["volume"] - 300) < 3'
plant --element 7 --seed 2 --density 3000 --out alone --json $measured >alone.json
plant --element 3,7,20-29 --seed 2 --density 3000 --out among --json $measured >among.json
/usr/bin/python3 - <<'PY'
import json
def of_seven(file):
    return [e["neurons"] for e in json.load(open(file))["tissue"]["elements"] if e["element"] == 7]
assert of_seven("alone.json") == of_seven("among.json") != [], (of_seven("alone.json"), of_seven("among.json"))
PY
told volume_front.json 'd["tissue"]["layers"] == "by volume"'
/usr/bin/python3 - <<'PY'
import h5py, numpy as np
def of_four(folder):
    group = h5py.File(folder + "/nodes.h5")["nodes"]
    group = group[list(group)[0]]["0"]
    names = group["@library/layer"].asstr()[:]
    r = np.linalg.norm(np.stack([group[k][:] for k in "xyz"], 1), axis=1)
    r = r[names[group["layer"][:]] == "IV"]
    return (8000 - r.max()) / 2000, (8000 - r.min()) / 2000  # shares of the way inwards
def near(found, *expected): assert np.abs(np.array(found) - expected).max() < .02, (found, expected)
near(of_four("front"), .44, .736)  # .296 thick, .5 of .88 above it
near(of_four("back"), .56, .664)
assert np.abs(np.array(of_four("volume_front")) - of_four("volume_back")).max() < .02
PY
sed 's/"IV"/"fourth"/' "$FOREST_SOURCE_DIR/data/recipes/human-frontal.toml" >odd.toml
fails_with 1 'layer fourth of the recipe is none of the 6 measured ones' \
  $BRAINFOREST plant --elements e.h5 --recipe odd.toml --repo cells.db --element 1 $measured --out no
fails_with 1 'needs a measured layer 6, and 5 are given' plant --element 1 --layers layer1.txt layer2.txt layer3.txt layer4.txt layer5.txt --layers-on outer --out no
fails_with 1 'lie more than .3 mm from the surface of the maps' plant --element 1 ${measured/-on outer/-on inner} --out no
sed '3s/.*/-2/' layer2.txt >below.txt
fails_with 1 'below.txt: has -2 at vertex 2' plant --element 1 ${measured/layer2/below} --out no
fails_with 1 'two.json' plant --element 1 ${measured/layer2.txt/two.json} --out no
fails_with 2 'layers-on' plant --element 1 --layers layer1.txt --out no

# Elements that fold themselves, and tables of depth that turn back.
/usr/bin/python3 - <<'PY'
import h5py, shutil
for name in ("folded", "turned"): shutil.copy("e.h5", name + ".h5")
with h5py.File("folded.h5", "r+") as f:
    curve = f["elements/curves"][16 * 7 + 5]
    f["curves/places"][12 * curve + 9:12 * curve + 12] *= 1.5
with h5py.File("turned.h5", "r+") as f: f["corners/depths"][3] = .9
PY
refuses '1 element of those chosen of folded.h5 may fold, the first 7;' plant_in folded.h5 --element 3,7 --out no
plant_in folded.h5 --element 3 --scale .01 --out whole >/dev/null
refuses 'turned.h5: /corners/depths has a table in which w falls' plant_in turned.h5 --element 3 --out no

# What is wrong is said in a sentence with what to do, and nothing is left behind.
fails_with 1 'e.h5 has elements 0 to' plant --element 1000000 --out no
fails_with 1 'is no list of elements' plant --element 1,x --out no
fails_with 1 'no element of e.h5 has its middle in that sphere' plant --sphere 0 0 0 10 --out no
fails_with 1 'sphere has a radius of -5 µm' plant --sphere 0 0 0 -5 --out no
fails_with 1 'has its middle in that box' plant --box 10 10 10 0 0 0 --out no
fails_with 1 'its folder is not there' plant --element 1 --out nowhere/no
fails_with 1 'holds something other than a circuit' plant --element 1 --out "$FOREST_SOURCE_DIR/docs"
fails_with 1 'say which elements' plant --out no
fails_with 1 'do not fit into layer' plant --element 1 --density 20000000 --out no
fails_with 1 'outer' $BRAINFOREST plant --elements outer --element 1 --recipe human-frontal --repo cells.db --out no
grep -v '^\[\[layer' "$FOREST_SOURCE_DIR/data/recipes/human-frontal.toml" | sed '/^thickness/,$d' >bare.toml
fails_with 1 'bare.toml' $BRAINFOREST plant --elements e.h5 --element 1 --recipe bare.toml --repo cells.db --out no
fails_with 2 'elements' $BRAINFOREST plant --element 1 --recipe human-frontal --repo cells.db --out no
[ ! -e no ]

# Lists that run backwards, results that cannot be written together, options that say nothing of edges.
fails_with 1 "'7-3' runs backwards; write 3-7" plant --element 7-3 --out no
fails_with 1 "'2-1' runs backwards" $BRAINFOREST cortex faces e.h5 --edges 2-1 -o no.gii
fails_with 1 'its folder is not there' $BRAINFOREST cortex faces e.h5 -o no.gii --values nowhere/no.txt
fails_with 1 'is named twice' $BRAINFOREST cortex faces e.h5 -o no.gii --values no.gii
fails_with 1 'not as .obj' $BRAINFOREST cortex faces e.h5 -o no.obj
fails_with 2 'edges' $BRAINFOREST cortex faces e.h5 --edges 1 --values no.txt -o no.gii
[ ! -e no ] && [ ! -e no.gii ] && [ ! -e no.txt ] && [ ! -e no.obj ]

#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Glia beside neurons: planted by a recipe, known by its shapes or by a word, with colours, a target and no synapses.
set -euo pipefail
source "$FOREST_SOURCE_DIR/tests/words.sh"

# A star of eight processes, of kind 7 as an astrocyte's file has them, and the same as a microglial cell's of kind 3.
/usr/bin/python3 - <<'PY'
import math
for name, kind in (("astrocyte", 7), ("microglia", 3)):
    rows, n = ["1 1 0 0 0 4 -1"], 1
    for k in range(8):
        a, parent = 2 * math.pi * k / 8, 1
        for step in range(1, 6):
            n += 1
            r = 5 + 6 * step
            rows.append(f"{n} {kind} {r * math.cos(a):.3f} {r * math.sin(a):.3f} {3 * step * (-1) ** k} .6 {parent}")
            parent = n
    open(name + ".swc", "w").write("\n".join(rows) + "\n")
PY
"$program" import astrocyte.swc --repo r.db --population astrocyte >/dev/null
"$program" import microglia.swc --repo r.db --population microglia >/dev/null
"$program" grow --grammar pyramidal --count 2 --seed 1 --repo r.db >/dev/null
cat >column.toml <<'TOML'
name = "mixed"
neurons = 60
[column]
radius = 120
[[type]]
name = "pyramidal cell"
population = "pyramidal"
[[type]]
name = "astrocyte"
population = "astrocyte"
[[type]]
name = "microglia"
population = "microglia"
glia = true
[[layer]]
name = "L2"
thickness = 300
density = 1000
mix = { "pyramidal cell" = 0.2, "astrocyte" = 0.5, "microglia" = 0.3 }
TOML
"$program" plant --recipe column.toml --repo r.db --seed 3 --out circuit --synapses 10 --json >planted.json
told planted.json "d['made_up_synapses'] == 120"
grep -q glia circuit/node_types.csv || fail "the table of types does not tell glia"
/usr/bin/python3 - <<'PY'
import h5py
with h5py.File("circuit/edges.h5") as file:
    edges = next(iter(file["edges"].values()))
    (nodes,) = h5py.File("circuit/nodes.h5")["nodes"].values()
    types = nodes["node_type_id"][:]
    for end in ("source_node_id", "target_node_id"):
        assert (types[edges[end][:]] == 0).all(), "glia makes synapses"
PY
"$program" pack circuit -o a.forest >/dev/null
"$program" targets a.forest --json >targets.json
told targets.json "[t['neurons'] for t in d['targets'] if t['name'] == 'glia'] == [48] and [t['neurons'] for t in d['targets'] if t['name'] == 'excitatory'] == [12]"
view='{"eye":[0,150,600],"target":[0,150,0],"fog":0}'
for by in type kind; do
  for who in all glia; do
    "$program" render a.forest --view "${view%\}},\"colour_by\":\"$by\"}" --only $who -o $by.$who.png --size 320x240 --renderer cpu --json >$by.$who.json
    told $by.$who.json "d['covered'] > .01"
  done
  cmp -s $by.all.png $by.glia.png && fail "a target without neurons is a picture of all"
done
"$program" render a.forest --view "$view" --hide glia -o hidden.png --size 320x240 --renderer cpu --json >hidden.json
told hidden.json "d['neurons'] <= 12"
# Its colour by kind is one that no neuron has: the bluish green of kind 7, brighter in green than in red.
/usr/bin/python3 - <<'PY'
from png_pixels import pixels
green = sum(g > 60 and g > 1.15 * r for r, g, b in pixels("kind.glia.png"))
assert green > 300, green
PY
sed 's/^glia = true/glia = true\nexcitatory = true/' column.toml >wrong.toml
refuses "neither excites nor inhibits" "$program" plant --recipe wrong.toml --repo r.db --out x

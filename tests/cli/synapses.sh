#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Synapses from planting to the picture: made-up ones as h5py sees them, those of a foreign file, and what is refused.
set -euo pipefail
source "$FOREST_SOURCE_DIR/tests/words.sh"

for grammar in pyramidal purkinje motoneuron; do "$program" grow --grammar $grammar --count 2 --seed 1 --repo r.db >/dev/null; done
"$program" plant --recipe column-1000 --repo r.db --seed 7 --out circuit --synapses 30 --json >planted.json
told planted.json "d['made_up_synapses'] == 30000"
/usr/bin/python3 - <<'PY'
import h5py, json
config = json.load(open("circuit/circuit_config.json"))
(entry,) = config["networks"]["edges"]
(name,) = entry["populations"]
assert "made_up" in name and entry["populations"][name]["type"] == "chemical", name
file = h5py.File("circuit/edges.h5")
assert file.attrs["magic"] == 0x0A7A
edges = file["edges"][name]
nodes = next(iter(config["networks"]["nodes"][0]["populations"]))
assert edges["source_node_id"].attrs["node_population"] == nodes == edges["target_node_id"].attrs["node_population"]
source, target, group = edges["source_node_id"][:], edges["target_node_id"][:], edges["0"]
assert len(source) == 30000 and (source != target).all() and sorted(set(target)) == list(range(1000))
assert (group["afferent_section_id"][:] > 0).all()
position = group["afferent_section_pos"][:]
assert (position >= 0).all() and (position <= 1).all() and .3 < position.mean() < .7
PY
"$program" plant --recipe column-1000 --repo r.db --seed 7 --out again --synapses 30 --threads 1 >/dev/null
diff -r circuit again || fail "the circuit depends on the number of threads"

"$program" pack circuit -o a.forest --json >packed.json
told packed.json "d['synapses'] == 30000"
"$program" pack circuit -o b.forest --threads 1 >/dev/null
cmp a.synapses b.synapses || fail "the file depends on the number of threads"
"$program" pack circuit -o without.forest --no-synapses >/dev/null
[ ! -e without.synapses ] || fail "left-out synapses were packed"
cp a.synapses without.synapses
"$program" pack circuit -o without.forest --no-synapses >/dev/null
[ ! -e without.synapses ] || fail "synapses of the forest that was there before are left"

view='{"eye":[0,900,260],"target":[0,900,0],"field_of_view":40,"fog":0}'
for who in cpu opengl; do
  "$program" render a.forest --view "$view" -o plain.$who.png --size 320x240 --renderer $who --json >plain.json
  "$program" render a.forest --view "$view" --synapses -o with.$who.png --size 320x240 --renderer $who --json >with.$who.json
  told plain.json "d['synapses'] == 0"
  told with.$who.json "d['synapses'] > 300"
  cmp -s plain.$who.png with.$who.png && fail "synapses make no difference"
done
told with.cpu.json "d['synapses'] == json.load(open('with.opengl.json'))['synapses']"
"$program" render a.forest --view "$view" --synapses -o again.png --size 320x240 --renderer cpu --threads 1 >/dev/null
cmp with.cpu.png again.png || fail "the picture depends on the number of threads"
"$program" render a.forest --view "$view" --synapses --synapse-colour target -o target.png --size 320x240 --renderer cpu >/dev/null
cmp -s target.png with.cpu.png && fail "colours of targets make no difference"
"$program" render a.forest --view "${view%\}},\"synapses\":\"none\"}" --synapses -o none.png --size 320x240 --renderer cpu >/dev/null
cmp none.png plain.cpu.png || fail "a view cannot hide them"
# What is hidden has none, what shows its soma alone has none; the gaze's layers have some.
"$program" render a.forest --view "$view" --synapses --hide all -o x.png --size 320x240 --renderer cpu --json >x.json
told x.json "d['synapses'] == 0 and d['covered'] == 0"
"$program" render a.forest --view "$view" --synapses --gaze .5 .5 -o x.png --size 320x240 --renderer cpu --json >x.json
told x.json "d['synapses'] > 100"
"$program" movie a.forest --synapses --seconds .2 --size 160x120 -o a.mp4 >/dev/null
[[ $(head -c 8 a.mp4 | tail -c 4) == ftyp ]] || fail "a.mp4 is no MP4 file"

# Of another program: a virtual population excites, places stand in the world.
/usr/bin/python3 - <<'PY'
import h5py, json, numpy
config = json.load(open("circuit/circuit_config.json"))
nodes = next(iter(config["networks"]["nodes"][0]["populations"]))
with h5py.File("circuit/nodes.h5") as file:
    group = file["nodes"][nodes]["0"]
    places = numpy.stack([group[axis][:5] for axis in "xyz"], 1)
with h5py.File("circuit/edges.h5", "w") as file:
    edges = file.create_group("edges/thalamus__here")
    edges["source_node_id"] = numpy.arange(5, dtype="u8"); edges["source_node_id"].attrs["node_population"] = "thalamus"
    edges["target_node_id"] = numpy.arange(5, dtype="u8"); edges["target_node_id"].attrs["node_population"] = nodes
    edges["edge_type_id"] = numpy.zeros(5, dtype="i8")
    for k, axis in enumerate("xyz"): edges[f"0/afferent_center_{axis}"] = places[:, k].astype("f4")
    edges["0/syn_type_id"] = numpy.array([113, 8, 100, 0, 200])
config["networks"]["edges"][0].pop("populations")
json.dump(config, open("circuit/circuit_config.json", "w"))
PY
"$program" pack circuit -o foreign.forest --json >packed.json
told packed.json "d['synapses'] == 5"

cp a.forest lonely.forest
refuses "lonely.synapses: is not there" "$program" render lonely.forest --synapses -o x.png

head -c 5000 a.synapses >short.synapses
refuses "cut short" "$program" render a.forest --synapse-file short.synapses -o x.png
refuses "no file of synapses" "$program" render a.forest --synapse-file a.forest -o x.png
refuses "ask for them with --synapses" "$program" render a.forest --synapse-colour sign -o x.png
fails_with 2 "synapse-colour" "$program" render a.forest --synapses --synapse-colour mood -o x.png
fails_with 2 "--synapses" "$program" plant --recipe column-1000 --repo r.db --out x --synapses -3
/usr/bin/python3 -c '
import h5py
with h5py.File("again/edges.h5", "a") as file:
    group = next(iter(file["edges"].values()))["0"]
    group["afferent_section_id"][7] = 30000'
"$program" pack again -o x.forest 2>told >/dev/null || fail "edges that cannot be read hold up the forest"
grep -q "section 30000 of its target.*has no synapses" told || fail "nobody is told of edges that cannot be read"
rm again/edges.h5
"$program" pack again -o y.forest 2>told >/dev/null || fail "edges that are missing hold up the forest"
grep -q "edges.h5.*--no-synapses" told || fail "nobody is told of missing edges"
cmp x.forest y.forest
[ ! -e x.synapses ] && [ ! -e y.synapses ] || fail "there are synapses of damaged edges"

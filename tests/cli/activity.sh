# SPDX-License-Identifier: Apache-2.0
# A report written by h5py becomes an activity file; what clamp and raster show is compared with it; what is refused.
trap 'echo "failed in line $LINENO: $BASH_COMMAND"' ERR
python=/usr/bin/python3
if ! $python -c 'import h5py' 2>/dev/null; then
  echo "activity.sh: python3-h5py is not installed; ./dev setup installs it"
  [ "${BRAINFOREST_REQUIRE_DATA:-0}" = 1 ] && exit 1
  exit 77
fi

source "$FOREST_SOURCE_DIR/tests/words.sh"
program=$BRAINFOREST

# Cells with an axon (2), a basal (3) and a forked apical dendrite (4): sections 1 axon, 2 basal, 3 to 5 apical.
for i in 1 2; do
  cat >cell-$i.swc <<SWC
1 1 0 0 0 5 -1
2 4 0 5 0 1 1
3 4 0 6$i 0 1 2
4 4 30 9$i 0 1 3
5 4 -30 9$i 0 1 3
6 3 0 -5 0 1 1
7 3 0 -4$i 0 1 6
8 2 5 0 0 1 1
9 2 8$i 0 0 1 8
SWC
done
"$program" import cell-1.swc cell-2.swc --repo cells.db --population cells >/dev/null
cat >few.toml <<TOML
name = "few cells"
[column]
radius = 100
[[type]]
name = "cells"
excitatory = true
[[layer]]
name = "L1"
thickness = 300
count = 7
mix = { "cells" = 1 }
TOML
"$program" plant --recipe few.toml --repo cells.db --seed 2 --out column >/dev/null

cat >report.py <<'PY'
"""report.py FILE [STEPS [KEY=VALUE…]]: a report of seven neurons of 11 compartments, in the circuit's order turned round."""
import sys, h5py, numpy
path, steps = sys.argv[1], int(sys.argv[2]) if len(sys.argv) > 2 else 300
change = dict(word.split("=") for word in sys.argv[3:])
elements = [0, 1, 1, 2, 2, 3, 3, 3, 4, 5, 5]
places = [.5, .25, .75, .25, .75, 1 / 6, .5, 5 / 6, .5, .25, .75]
nodes = numpy.arange(7, dtype=numpy.uint64)[::-1]
time = numpy.arange(steps)[:, None]
column = numpy.arange(7 * 11)[None, :]
data = (-65 + 10 * numpy.sin(.05 * time + column) + 90 * ((time + 3 * column) % 97 == 0)).astype(numpy.float32)
if "nan" in change: data[7, 5] = numpy.nan
if "empty" in change: data[:] = numpy.nan
if "high" in change: data[8, 6] = float(change["high"])
with h5py.File(path, "w") as file:
    group = file.create_group("report/" + change.get("population", "few_cells"))
    group["data"] = data
    group["data"].attrs["units"] = change.get("units", "mV")
    mapping = group.create_group("mapping")
    mapping["node_ids"] = nodes + int(change.get("first", 0))
    mapping["index_pointers"] = numpy.arange(8, dtype=numpy.uint64) * 11
    mapping["element_ids"] = numpy.array(elements * 7, numpy.uint32) + numpy.uint32(change.get("element", 0))
    mapping["element_pos"] = numpy.array(places * 7)
    mapping["time"] = [0, steps * .5, .5]
    mapping["time"].attrs["units"] = "ms"
    spikes = file.create_group("spikes/few_cells")
    spikes["timestamps"] = numpy.array([40., 20., 30.])
    spikes["node_ids"] = numpy.array([1, 2, 6 + int(change.get("spiking", 0))], numpy.uint64)
PY
$python report.py run.h5
"$program" activity run.h5 --circuit column --spikes run.h5 --out run.activity --json >packed.json
"$program" clamp run.activity --neuron 0 6 3 --section soma 0 2 --position 0.5 1 0.3 --csv traces.csv --json >clamped.json
"$program" raster run.activity --out raster.png --size 300x70 --from 10 --to 140 --plain --json >raster.json
$python - <<'PY'
import csv, h5py, json, struct
packed, clamped, raster = (json.load(open(name)) for name in ("packed.json", "clamped.json", "raster.json"))
assert packed["neurons"] == 7 and packed["compartments"] == 77 and packed["steps"] == 300 and packed["spikes"] == 3, packed
assert packed["error"] <= .3 and packed["clamped"] == packed["not_numbers"] == 0, packed
data = h5py.File("run.h5")["report/few_cells/data"][:]
rows = list(csv.reader(open("traces.csv")))
assert rows[0][0] == "time (ms)" and rows[0][1:3] == ["node 0 soma (mV)", "node 6 section 0 at 0.8333 (mV)"], rows[0]
assert [t["section"] for t in clamped["traces"]] == ["soma", 0, 2], clamped
assert len(rows) == 301 and float(rows[300][0]) == 149.5
columns = [6 * 11 + 0, 0 * 11 + 7, 3 * 11 + 9]  # the report lists node 6 first
for trace, column in enumerate(columns):
    for step in range(300):
        assert abs(float(rows[step + 1][trace + 1]) - data[step, column]) <= packed["error"] + 2e-3, (trace, step)
    assert abs(clamped["traces"][trace]["highest"] - data[:, column].max()) < .3
assert raster["steps"] == 260 and raster["from"] == 10 and raster["to"] == 140, raster
assert struct.unpack(">II", open("raster.png", "rb").read()[16:24]) == (300, 70)
PY
"$program" activity run.h5 --circuit column --spikes run.h5 --out again.activity --threads 1 >/dev/null
cmp run.activity again.activity
"$program" clamp run.activity --neuron 2 --csv /dev/stdout --json >out.txt
grep -q '^149.5,' out.txt
"$program" clamp run.activity --neuron 2 >out.txt
grep -q '^ *2 *soma' out.txt

refuses 'traces.csv' "$program" clamp run.activity --neuron 2 --csv traces.csv  # another table is not replaced unasked
"$program" clamp run.activity --neuron 2 --csv traces.csv --force >/dev/null

# With axes the colours take less room, and what they mean stands beside them; too small a picture has no room for it.
"$program" raster run.activity --out axes.png --size 600x400 --json >axes.json
"$program" raster run.activity --out plain.png --size 600x400 --plain --json >plain.json
cmp -s axes.png plain.png && { echo "axes make no difference"; exit 1; }
$python -c '
import struct
for name in ("axes", "plain"): assert struct.unpack(">II", open(name + ".png", "rb").read()[16:24]) == (600, 400)'
refuses 'a picture of 120x50 leaves no room for axes; give a larger --size, or --plain' "$program" raster run.activity --out no.png --size 120x50

# What is no number stays so, what is beyond the range is told.
$python report.py odd.h5 40 nan=1 high=70
"$program" activity odd.h5 --circuit column --out odd.activity >out.txt 2>err.txt
grep -q '1 of 3080 values are no numbers' err.txt && grep -q '1 of 3080 values lie beyond -100 to 50 mV' err.txt
"$program" clamp odd.activity --neuron 6 --section 0 --position 0 --csv odd.csv >/dev/null
grep -q '^3.5,$' odd.csv
"$program" activity odd.h5 --circuit column --out odd.activity --range -100 100 >/dev/null 2>err.txt
[ "$(grep -c beyond err.txt)" = 0 ]
"$program" clamp odd.activity --neuron 6 --section 0 --position 0.5 >out.txt
grep -qE ' (69.[6-9]|70.[0-4]) ' out.txt

# A report without a single number is one all the same: it is said, and nothing is taken for spikes or for a colour.
$python report.py empty.h5 40 empty=1
"$program" activity empty.h5 --circuit column --out empty.activity >/dev/null 2>&1
refuses 'holds no value that is a number' "$program" raster empty.activity --out no.png
"$program" clamp empty.activity --neuron 6 --section 0 >out.txt
grep -q none out.txt
"$program" pack column -o empty.forest >/dev/null
"$program" render empty.forest --activity empty.activity --size 160x120 -o empty.png 2>told >/dev/null
grep -q 'no value of it is a number' told

# Mismatches are named, and leave what was there.
cp run.activity kept.activity
$python report.py other.h5 40 population=other
refuses 'other.h5: population other is not in the circuit, which has few_cells' "$program" activity other.h5 --circuit column --out run.activity
$python report.py other.h5 40 first=1
refuses 'node 7 of population few_cells is not in the circuit, where 7 neurons of it have a shape, the last of them node 6' "$program" activity other.h5 --circuit column --out run.activity
$python report.py other.h5 40 element=1
refuses 'has a compartment in section 6, but its morphology cell-' "$program" activity other.h5 --circuit column --out run.activity
$python report.py other.h5 40 spiking=1
"$program" activity --circuit column --spikes run.h5 --out spikes.activity --json >spikes.json 2>told
grep -q "spikes alone" told
told spikes.json "d['spikes'] == 3 and d['neurons'] == 7 and d['compartments'] == 7 and d['not_numbers'] == 7 * d['steps']"
"$program" pack column -o spikes.forest >/dev/null
"$program" render spikes.forest --activity spikes.activity --time 30.5 --size 160x120 -o flash.png --json >flash.json
told flash.json "d['activity']['flashes'] >= 1"
# Large enough for a legend: of flashes, without the colours of values; they are seen, on dark ground and on light.
for ground in dark light; do
  view="{\"eye\":[0,150,700],\"target\":[0,150,0],\"background\":\"$ground\",\"samples\":4}"
  "$program" render spikes.forest --activity spikes.activity --view "$view" --size 640x480 -o $ground.png --json >$ground.json
  "$program" render spikes.forest --activity spikes.activity --view "$view" --time 15.5 --size 640x480 -o $ground-before.png >/dev/null
done
told dark.json "d['activity']['flashes'] >= 1 and 20 <= d['view']['activity']['time'] <= 41 and d['surfaces'] is None"
$python - <<'PY'
from png_pixels import pixels
dark, before, light = pixels("dark.png"), pixels("dark-before.png"), pixels("light.png")
bright = lambda picture: sum(min(p) > 190 for p in picture)
assert bright(dark) > bright(before) + 60, (bright(dark), bright(before))
assert sum(p[0] > 150 and max(p[1:]) < 90 for p in light) > 60
# No bar of the colour map: its purple is nowhere.
assert not sum(p[2] > 1.6 * max(p[1], 20) and p[0] > 60 for p in dark), "there are colours of values"
PY
refuses "nothing to pack" "$program" activity --circuit column --out x.activity
$python - <<'PY'
import h5py, shutil
shutil.copy("run.h5", "calcium.h5")
with h5py.File("calcium.h5", "a") as file:
    data = next(iter(file["report"].values()))["data"]
    data.attrs.pop("units", None)
    data.attrs["variable"] = "cai"
PY
refuses "unknown units of 'cai'; say from where to where they reach, with --range" "$program" activity calcium.h5 --circuit column --out x.activity
refuses 'node 7 of population few_cells spikes and is not in the circuit' "$program" activity other.h5 --circuit column --spikes other.h5 --out run.activity
$python report.py other.h5 40 units=nA
refuses 'holds values in nA; say from where to where they reach, with --range' "$program" activity other.h5 --circuit column --out run.activity
refuses 'there are few_cells' "$program" activity run.h5 --circuit column --population cortex --out run.activity
refuses 'is what is read' "$program" activity run.h5 --circuit column --out run.h5
for size in 0 7 100 2000 20000; do
  head -c $size run.h5 >short.h5
  refuses 'is not an HDF5 file, or was cut off' "$program" activity short.h5 --circuit column --out run.activity
done
refuses 'there is no group /report' "$program" activity column/nodes.h5 --circuit column --out run.activity
cmp run.activity kept.activity

# Activity files that are cut off or damaged are refused, the rest of their values is not shown.
size=$(stat -c %s run.activity)
for part in 0 10 40 $((size / 2)) $((size - 1)); do
  head -c $part run.activity >short.activity
  refuses 'short.activity' "$program" clamp short.activity --neuron 0
  refuses 'short.activity' "$program" raster short.activity --out no.png
done
"$program" raster run.activity --out right.png >/dev/null
refused=0
for part in {0..39}; do
  $python -c "
data = bytearray(open('run.activity', 'rb').read())
data[len(data) * $part // 40 + 8] ^= 4
open('damaged.activity', 'wb').write(data)"
  rm -f shown.png
  if "$program" raster damaged.activity --out shown.png >/dev/null 2>err.txt; then
    cmp right.png shown.png  # what is damaged is not in the picture
  else
    [ ! -e shown.png ] && grep -q 'damaged.activity: .*; pack the report again' err.txt
    refused=$((refused + 1))
  fi
done
[ $refused -gt 3 ]
refuses 'is not an activity file' "$program" clamp run.h5 --neuron 0
[ ! -e no.png ]

refuses 'node 7 was not reported; there are 7 neurons' "$program" clamp run.activity --neuron 7
refuses "'x' is no section" "$program" clamp run.activity --neuron 0 --section x
refuses 'section 9 of node 0 was not reported; 5 of its sections were, the last of them 4' "$program" clamp run.activity --neuron 0 --section 9
refuses '--section has 2 values and 3 traces are asked for' "$program" clamp run.activity --neuron 0 1 2 --section soma 1
refuses 'holds no step' "$program" raster run.activity --out no.png --from 1000
refuses 'give the lower end first' "$program" raster run.activity --out no.png --range 5 5
fails_with 2 '--neuron' "$program" clamp run.activity
fails_with 2 '--circuit' "$program" activity run.h5 --out x.activity
[ -z "$(find . -name '*.activity.??????')" ]  # nothing half written is left

# On the branches: pictures of two moments differ, of one are the same, with any renderer; a threshold takes colour away.
"$program" pack column -o few.forest >/dev/null
view='{"eye":[0,150,420],"target":[0,150,0],"samples":4,"fog":0,"activity":{"range":[-75,-55],"speed":2,"fade":9'
draw() {  # name, words after the view…
  local name=$1 more=$2
  shift 2
  "$program" render few.forest --view "$view$more}}" --activity run.activity --size 240x200 -o "$name.png" --json "$@" >"$name.json"
}
draw at10 "" --time 10
draw again "" --time 10 --threads 1
cmp at10.png again.png
draw in_view ',"time":10'
cmp at10.png in_view.png
draw at30 "" --time 30
draw dim ',"threshold":49' --time 30
draw still ',"threshold":49,"time":30'
draw opengl "" --time 10 --renderer opengl
draw gazed "" --time 10 --gaze .5 .5
cmp dim.png still.png
"$program" render few.forest --view "$view}}" --size 240x200 -o plain.png --json >plain.json
"$program" render few.forest --view "$view}}" --activity odd.activity --time 3.5 --size 240x200 -o odd.png --json >nan.json
mkdir notes && echo mine >notes/00001.png
if "$program" movie few.forest --seconds 1 --fps 4 --samples 1 --size 160x120 --pictures notes -o notes.mp4 2>told; then fail "a film replaced notes"; fi
grep -q 'is no PNG picture' told && [[ $(cat notes/00001.png) == mine && ! -e notes.mp4 ]] || fail "a film replaced notes"
cp few.forest kept.forest
if "$program" targets kept.forest -o kept.forest --force 2>told; then fail "targets replaced a forest"; fi
cmp few.forest kept.forest || fail "targets replaced a forest"
"$program" movie few.forest --view "$view}}" --activity run.activity --rate 20 --from 10 --seconds 1 --fps 4 --samples 1 --size 160x120 --pictures film -o film.mp4 >/dev/null
$python - <<'PY'
import json
from png_pixels import pixels
def saturation(picture):
    return sum(max(p) - min(p) for p in picture)
first, later, dim, plain, opengl, gazed = (pixels(n + ".png") for n in ("at10", "at30", "dim", "plain", "opengl", "gazed"))
changed = sum(a != b for a, b in zip(first, later))
covered = json.load(open("at10.json"))["covered"] * len(first)
assert changed > .3 * covered, (changed, covered)
assert saturation(later) > 1.2 * saturation(dim), (saturation(later), saturation(dim))  # the sky has some, too
assert sum(a != b for a, b in zip(first, plain)) > .3 * covered
mean = sum(abs(a - b) for p, q in zip(first, opengl) for a, b in zip(p, q)) / len(first) / 3
assert mean < 1, mean
# Looked at in the middle, the middle is the same, and all around it plays, too.
fovea = [240 * y + x for y in range(94, 106) for x in range(114, 126)]
assert all(gazed[i] == first[i] for i in fovea)
assert sum(a != b for a, b in zip(gazed, plain)) > .3 * covered
told = json.load(open("at30.json"))
assert 0 < told["activity"]["neurons"] <= 7 and told["activity"]["values"] > 0 and told["activity"]["flashes"] >= 1, told
assert told["view"]["activity"]["time"] == 30 and json.load(open("plain.json"))["activity"] is None
film = [pixels(f"film/{i:05}.png") for i in range(4)]
assert all(a != b for a, b in zip(film, film[1:]))
PY
# A picture that is large enough says what its colours mean, a small one does not; with --no-legend none does.
large() {  # name, words…
  local name=$1
  shift
  "$program" render few.forest --view "$view}}" --activity run.activity --time 10 --size 640x400 -o "$name.png" "$@" >/dev/null
}
large legend
large bare --no-legend
draw bare_small "" --time 10 --no-legend
cmp bare_small.png at10.png
cmp -s legend.png bare.png && { echo "there is no colour bar"; exit 1; }
refuses 'run.activity: holds no time 400 ms; it runs from 0 to 149.5 ms' "$program" render few.forest --activity run.activity --time 400 -o no.png
"$program" plant --recipe few.toml --repo cells.db --seed 3 --out turned >/dev/null
"$program" pack turned -o turned.forest >/dev/null
refuses 'make the activity file and the forest file from the same circuit' "$program" render turned.forest --activity run.activity -o no.png
sed 's/count = 7/count = 5/' few.toml >fewer.toml
"$program" plant --recipe fewer.toml --repo cells.db --seed 2 --out fewer >/dev/null
"$program" pack fewer -o fewer.forest >/dev/null
refuses 'with 7 neurons and the forest has 5' "$program" render fewer.forest --activity run.activity -o no.png
refuses "'map' must be one of: plasma" "$program" render few.forest --view "$view,\"map\":\"jet\"}}" --activity run.activity -o no.png
refuses 'is not an activity file' "$program" render few.forest --activity few.forest -o no.png
refuses 'short.activity' "$program" render few.forest --activity short.activity -o no.png
fails_with 2 '--activity' "$program" render few.forest --time 3 -o no.png
refuses 'give another --view' "$program" movie few.forest --view "$view}}" -o no.mp4
[ ! -e no.png ] && [ ! -e no.mp4 ]

# Killed in the middle: the old file is whole. (Its unfinished neighbour stays, as with every program that is killed.)
$python report.py long.h5 20000
for wait in .02 .05 .1; do
  timeout -s KILL $wait "$program" activity long.h5 --circuit column --out run.activity >/dev/null 2>&1 || true
  "$program" clamp run.activity --neuron 0 >/dev/null
done

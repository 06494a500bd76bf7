#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# brainforest render with surfaces of a cortex: alone, beside a forest, coloured by values; what it refuses.
set -euo pipefail
source "$FOREST_SOURCE_DIR/tests/words.sh"

# A ball with waves of 60 mm around (-40, 0, 0), FreeSurfer's way; a value a vertex, both ways of text and binary.
/usr/bin/python3 - <<'PY'
import math, struct
rows, columns = 60, 120
points, faces = [], []
for i in range(rows + 1):
    for j in range(columns):
        a, b = math.pi * i / rows, 2 * math.pi * j / columns
        r = 60 + 4 * math.sin(8 * b) * math.sin(a) ** 2
        points.append((-40 + r * math.sin(a) * math.cos(b), r * math.sin(a) * math.sin(b), r * math.cos(a)))
for i in range(rows):
    for j in range(columns):
        p, q = i * columns + j, i * columns + (j + 1) % columns
        faces += [(p, p + columns, q), (q, p + columns, q + columns)]
bytes = b"\xff\xff\xfecreated by a test\n\n" + struct.pack(">ii", len(points), len(faces))
bytes += b"".join(struct.pack(">fff", *p) for p in points) + b"".join(struct.pack(">iii", *f) for f in faces)
open("lh.pial", "wb").write(bytes)
open("lh.short", "wb").write(bytes[:-1])
values = [p[2] for p in points]
open("lh.curv", "wb").write(b"\xff\xff\xff" + struct.pack(">iii", len(points), len(faces), 1) + b"".join(struct.pack(">f", v) for v in values))
open("values.txt", "w").write("\n".join("%.9g" % struct.unpack("f", struct.pack("f", v))[0] for v in values))
open("few.txt", "w").write("1\n2\n")
PY

for who in cpu opengl; do
  "$program" render lh.pial -o plain.$who.png --size 320x240 --renderer $who --json >plain.json
  /usr/bin/python3 - <<'PY'
import json
d = json.load(open("plain.json"))
assert .4 < d["covered"] < .8, d["covered"]
assert d["surfaces"]["triangles"] == 14400, d["surfaces"]
assert d["view"]["eye"][0] < -200000 and abs(d["view"]["target"][0] + 40000) < 500, d["view"]  # µm, from the left
PY
done
"$program" render lh.pial -o again.png --size 320x240 --renderer cpu --threads 1 >/dev/null
cmp plain.cpu.png again.png || fail "the picture depends on the number of threads"
"$program" render lh.pial --overlay lh.curv --range -50:50 --colour-map viridis --no-legend -o a.png --size 320x240 --renderer cpu >/dev/null
"$program" render lh.pial --overlay values.txt --range -50:50 --colour-map viridis --no-legend -o b.png --size 320x240 --renderer cpu --json >b.json
cmp a.png b.png || fail "values as text look otherwise"
cmp -s a.png plain.cpu.png && fail "values make no difference"
"$program" render lh.pial --from above --overlay lh.curv -o above.png --size 320x240 --renderer cpu --json >above.json
/usr/bin/python3 -c '
import json
d, b = json.load(open("above.json")), json.load(open("b.json"))
assert d["view"]["eye"][2] > 200000 and d["view"]["eye"][0] == d["view"]["target"][0], d["view"]
assert b["surfaces"]["range"] == [-50, 50] and b["surfaces"]["colour_map"] == "viridis", b["surfaces"]
assert -60 <= d["surfaces"]["range"][0] < -50 and 50 < d["surfaces"]["range"][1] <= 60, d["surfaces"]'

# Around a forest, which lies within: what is opaque hides it, and what is not lets it through.
small_forest 2
view='{"eye":[-300000,0,0],"target":[-40000,0,0],"up":[0,0,1],"field_of_view":40,"fog":0}'
for opacity in 0 .3 1; do
  "$program" render a.forest --surface lh.pial --surface-opacity $opacity --view "$view" -o x$opacity.png --size 320x240 --renderer cpu --json >x$opacity.json
done
/usr/bin/python3 -c '
import json
a, b, c = (json.load(open(f"x{o}.json"))["covered"] for o in ("0", ".3", "1"))
assert a < .02 and .1 < c < .8 and .25 * c < b < .65 * c, (a, b, c)  # two sides, three tenths each: half'
"$program" render a.forest --surface lh.pial --from left --only all --hide all --size 160x120 -o none.png --json >none.json 2>/dev/null
told none.json 'len(d["view"]["targets"]) == 3'
refuses "--only is of neurons, and lh.pial is a surface" "$program" render lh.pial --only all -o no.png
"$program" movie a.forest --surface lh.pial --surface-opacity .3 --seconds .2 --size 160x120 -o a.mp4 >/dev/null
[[ $(head -c 8 a.mp4 | tail -c 4) == ftyp ]] || fail "a.mp4 is no MP4 file"

# What the colours of values mean is in the picture, unless somebody wants it without.
"$program" render lh.pial --overlay lh.curv -o with.png --size 640x480 --renderer cpu >/dev/null
"$program" render lh.pial --overlay lh.curv -o without.png --size 640x480 --renderer cpu --no-legend >/dev/null
cmp -s with.png without.png && fail "there is no colour bar"
for wish in "" --no-legend; do "$program" render lh.pial -o no_values$wish.png --size 640x480 --renderer cpu $wish >/dev/null; done
cmp no_values.png no_values--no-legend.png || fail "a surface without values has a colour bar"
"$program" render lh.pial -o scale.png --size 640x480 --renderer cpu --scale >/dev/null
cmp -s scale.png no_values.png && fail "there is no scale bar"
for wish in "" --scale; do "$program" render lh.pial -o tiny$wish.png --size 64x48 --renderer cpu $wish >/dev/null; done
cmp tiny.png tiny--scale.png || fail "a picture of 64 pixels has a scale bar"

refuses "cut off" "$program" render lh.short -o x.png
refuses "2 values and the surface has" "$program" render lh.pial --overlay few.txt -o x.png
refuses "more overlays (2) than surfaces (1)" "$program" render lh.pial --overlay few.txt --overlay few.txt -o x.png
refuses "no surface that is known" "$program" render a.forest --surface a.forest -o x.png
refuses "no range" "$program" render lh.pial --range 3 -o x.png
refuses "no range" "$program" render lh.pial --range 3:nan -o x.png
refuses "no range" "$program" render lh.pial --range 3:2 -o x.png
refuses "no colour map 'jet'" "$program" render lh.pial --colour-map jet -o x.png
fails_with 2 "surface-opacity" "$program" render lh.pial --surface-opacity 2 -o x.png
fails_with 2 "from" "$program" render lh.pial --from inside -o x.png
printf 'nan\n%.0s' $(seq 7320) >none.txt
refuses "has no value that is a number" "$program" render lh.pial --overlay none.txt -o x.png
"$program" render lh.pial --from above --view '{"background":"light"}' -o above.png --size 320x240 --renderer cpu --json >light.json
told light.json 'd["view"]["background"] == "light"'
# Values of two kinds in one picture: told.
cp lh.curv lh.sulc
"$program" render lh.pial --overlay lh.curv --surface lh.pial --overlay lh.sulc -o x.png --size 64x64 --json >two.json 2>/dev/null
told two.json 'any("share one colour bar" in w for w in d["warnings"])'
rm x.png
refuses "both say where the eye is" "$program" render lh.pial --from above --view '{"eye":[0,0,9],"target":[0,0,0]}' -o x.png
refuses "there are none; give --surface" "$program" render a.forest --from left -o x.png

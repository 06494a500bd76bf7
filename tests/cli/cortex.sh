# SPDX-License-Identifier: Apache-2.0
# brainforest cortex: surfaces → elements → report; sections of surfaces and back; what is refused.
trap 'echo "failed in line $LINENO: $BASH_COMMAND"' ERR

source "$FOREST_SOURCE_DIR/tests/words.sh"

# Two nested, slightly dented balls as FreeSurfer writes surfaces, and some that cannot be.
python3 - <<'PY'
import math, os, struct, sys
sys.dont_write_bytecode = True
sys.path.append(os.environ["FOREST_SOURCE_DIR"] + "/tests")
from balls import ball, write
write("outer", ball(9, dent=1.2))
write("inner", ball(7, dent=1.2))
p, f = ball(9)
write("open", (p, f[:-1]))
write("turned", (p, f[:7] + [(f[7][0], f[7][2], f[7][1])] + f[8:]))
with open("loose.obj", "w") as o:  # each triangle with corners of its own
    for q in f:
        for c in q: o.write("v %.9g %.9g %.9g\n" % p[c])
        o.write("f -3 -2 -1\n")
bump = lambda q, more: tuple(x * (1 + more * math.exp(-((q[0] / 1.5) ** 2 + (q[1] / 1.5) ** 2)) * (q[2] > 0)) for x in q)
write("poking", ([bump(q, 2.3 / 7) for q in ball(7)[0]], f))  # through the outer one, by .3 mm at its top
def border(name, vertices, count):
    open(name, "w").write(f"""<?xml version="1.0"?><BorderFile Version="3" SurfaceNumberOfVertices="{count}"><Class Name="all">
<Border Name="{name.split('.')[0]}"><BorderPart Closed="False"><Vertices>{" ".join(f"{v} {v} {v}" for v in vertices)}</Vertices>
<Weights>{" ".join("2 1 1" for v in vertices)}</Weights></BorderPart></Border></Class></BorderFile>""")
order = sorted(range(len(p)), key=lambda v: abs(p[v][0]))
border("dent.border", order[:30], len(p))   # along the dent
border("pole.border", order[-30:], len(p))  # where there is none
border("other.border", [0], 7)
write("small", ([tuple(x / 1000 for x in q) for q in p], f))
write("large", ([tuple(x * 1000 for x in q) for q in p], f))
write("cut_itself", ([tuple(x * (1 + .05 * math.sin(1e4 * x)) for x in q) for q in p], f))
p, f = ball(7)
write("spike", ([tuple(1.5 * x for x in q) if i == 20 else q for i, q in enumerate(p)], f))
six, of_six = ball(6)
write("six", (six, of_six))
write("thin", ([tuple(x * (.8 + .14 / (1 + math.exp(-4 * q[0]))) for x in q) for q in six], of_six))  # .36 mm on one side
write("beside", ([(q[0] + 5, q[1], q[2]) for q in ball(7)[0]], f))
write("nan", ([(math.nan if i == 7 else q[0], q[1], q[2]) for i, q in enumerate(p)], f))
with open("inner.obj", "w") as o:
    p, f = ball(7, dent=1.2)
    for q in p: o.write("v %.9g %.9g %.9g\n" % q)
    for q in f: o.write("f %d %d %d\n" % tuple(c + 1 for c in q))
with open("inner.ply", "wb") as o:
    o.write(b"ply\nformat binary_little_endian 1.0\nelement vertex %d\nproperty float x\nproperty float y\nproperty float z\n"
            b"element face %d\nproperty list uchar int vertex_indices\nend_header\n" % (len(p), len(f)))
    for q in p: o.write(struct.pack("<fff", *q))
    for q in f: o.write(struct.pack("<Biii", 3, *q))
with open("inner.stl", "wb") as o:
    o.write(bytes(80) + struct.pack("<I", len(f)))
    for q in f: o.write(struct.pack("<12fH", 0, 0, 0, *p[q[0]], *p[q[1]], *p[q[2]], 0))
PY

$BRAINFOREST cortex build outer inner -o e.h5 --json >built.json
$BRAINFOREST cortex report e.h5 --outer outer --inner inner --json >report.json

# Where it is thin there is no cortex, unless that is said; it is told how much.
$BRAINFOREST cortex build six thin -o half.h5 --json >half.json 2>half.err
grep -q 'is too thin for elements and has none' half.err
$BRAINFOREST cortex build six thin -o all.h5 --thinnest .2 --json >all.json 2>all.err
[ ! -s all.err ] || fail "$(cat all.err)"
told half.json '.05 < d["wall"] < .3'
told all.json "d['wall'] == 0 and d['elements'] > 1.05 * json.load(open('half.json'))['elements']"
told all.json 'd["crest_angle"]["median"] is None or d["lines_mm"]["crests"] > 0'

python3 - <<'PY'
import json
built, report = json.load(open("built.json")), json.load(open("report.json"))
for key in ("elements", "uncertified", "volume_error", "volume_mean", "volume_within", "w_angle", "w_reached",
            "equivolume_error", "scaled_jacobian"):
    assert built[key] == report[key], (key, built[key], report[key])
assert built["elements"] > 1000 and built["uncertified"] == 0, built
assert built["volume_error"] < .005 and abs(built["volume_mean"] - 1) < .03 and built["volume_within"] > .95, built
assert built["w_reached"] == 1 and built["w_angle"]["median"] < 3, built
assert report["bok"]["l1"] < .97 and report["bok"]["l1"] < report["bok"]["l6"], report  # the dent is a fundus
for found in built, report:
    assert {"elements", "uncertified", "volume_error", "volume_mean", "volume_within", "w_angle", "w_reached",
            "equivolume_error", "layer_bulge", "scaled_jacobian", "border_within_2mm", "symmetry", "seconds", "peak_bytes"} <= set(found), found
    assert set(found["symmetry"]) == {"elements", "best_planar", "stretches"} and found["border_within_2mm"] is None, found
    assert set(found["scaled_jacobian"]) == {"min", "p1"} and set(found["w_angle"]) == {"median", "p99"}, found
    assert found["bok"] == report["bok"] and found["symmetry"] == report["symmetry"], found
PY

# Layers that follow the fold, and ones that do not.
python3 - <<'PY'
import os, sys
sys.dont_write_bytecode = True
sys.path.append(os.environ["FOREST_SOURCE_DIR"] + "/tests")
from balls import ball
outer = ball(9, dent=1.2)[0]
for k, share in enumerate((.118, .101, .271, .088, .190, .232)):
    open(f"flat{k + 1}.txt", "w").write("".join(f"{2 * share}\n" for _ in outer))
    more = (.1, 0, 0, 0, 0, -.1)[k]  # in the dent, a fundus: L1 thick, L6 thin
    open(f"fold{k + 1}.txt", "w").write("".join("%g\n" % (2 * share + more * (abs(x) < .9)) for x, y, z in outer))
    open(f"none{k + 1}.txt", "w").write("0\n" * len(outer))
PY
report() { $BRAINFOREST cortex report e.h5 --outer outer --inner inner "$@"; }
report --layers flat?.txt --json >flat.json
report --layers fold?.txt --json >fold.json
told flat.json 'abs(d["bok"]["measured"]["l1"] - 1) < 1e-4 and abs(d["bok"]["measured"]["l6"] - 1) < 1e-4'
told fold.json 'd["bok"]["measured"]["l1"] < .9 and d["bok"]["measured"]["l6"] > 1.1 and d["bok"]["of_volume"]["l1"] < 1'
report --layers fold?.txt >told.txt
grep -q '^Bok, measured' told.txt
refuses 'none1.txt: measures no layer' report --layers none?.txt
head -5 flat3.txt >short.txt
refuses 'short.txt: has 5 values and the surface 2562 vertices' report --layers flat1.txt flat2.txt short.txt flat4.txt flat5.txt flat6.txt
refuses 'have other triangles' $BRAINFOREST cortex report e.h5 --outer outer --inner open --layers flat?.txt
fails_with 2 'layers' report --layers flat1.txt flat2.txt
fails_with 2 'inner' $BRAINFOREST cortex report e.h5 --outer outer --layers flat?.txt
$BRAINFOREST cortex build outer inner -o fine.h5 --scale 1 >/dev/null
$BRAINFOREST cortex report fine.h5 --outer outer --inner inner --borders dent.border pole.border --json >borders.json
python3 - <<'PY'
import json
report = json.load(open("borders.json"))
dent, pole = report["borders"]["dent"], report["borders"]["pole"]
assert dent > .8 and pole == 0 and abs(report["border_within_2mm"] - dent / 2) < 1e-9, report
assert .4 <= report["border_half_way"] <= .5, report
assert 0 < report["border_by_chance"] < .5 and 30 < report["lines_mm"]["sulci"] < 150, report  # once around is 49 mm
PY
refuses '7 vertices' $BRAINFOREST cortex report e.h5 --outer outer --inner inner --borders other.border
fails_with 2 'inner' $BRAINFOREST cortex report e.h5 --outer outer --borders dent.border
$BRAINFOREST cortex build outer inner -o again.h5 --threads 1 >/dev/null
cmp e.h5 again.h5
$BRAINFOREST cortex build outer inner.ply -o of_ply.h5 >/dev/null
cmp e.h5 of_ply.h5
$BRAINFOREST cortex build outer inner.stl -o of_stl.h5 >/dev/null
head -c 60000 inner.stl >cut.stl
refuses 'cut.stl: is not as long as' $BRAINFOREST cortex build outer cut.stl -o no.h5

# Nothing is written where something is wrong.
refuses 'swapped' $BRAINFOREST cortex build inner outer -o no.h5
refuses 'outer surface is open at the edge of vertices' $BRAINFOREST cortex build open inner -o no.h5
refuses 'triangles 4 and 7 of the outer surface face opposite ways at the edge of vertices' $BRAINFOREST cortex build turned inner -o no.h5
refuses 'check that it is in mm and not in m' $BRAINFOREST cortex build small small -o no.h5
refuses 'check that it is in mm and not in µm' $BRAINFOREST cortex build large inner -o no.h5
$BRAINFOREST cortex build loose.obj poking --volume 8 -o poked.h5 >/dev/null 2>told.txt
grep -qE '^the surfaces cross: at [0-9]+ of 2562 vertices the inner one lies outside of the outer one, .* deepest by 0.(2|3)' told.txt
refuses 'vertices of the outer surface scatter by' $BRAINFOREST cortex build cut_itself inner -o no.h5
refuses '1 of 2562 vertices of the inner surface lie outside' $BRAINFOREST cortex build outer spike -o no.h5
(ulimit -f 100; refuses 'no.h5: cannot be written' $BRAINFOREST cortex build outer inner --volume 8 -o no.h5)
refuses 'lie outside of the outer one' $BRAINFOREST cortex build outer beside -o no.h5
refuses 'nan: has a vertex that is nowhere, number 7' $BRAINFOREST cortex build nan inner -o no.h5
head -c 5000 outer >cut
refuses 'cut' $BRAINFOREST cortex build cut inner -o no.h5
[ ! -e no.h5 ]
refuses 'already' $BRAINFOREST cortex build outer inner -o e.h5
head -c 9000 e.h5 >cut.h5
refuses 'cut.h5' $BRAINFOREST cortex report cut.h5
refuses 'outer' $BRAINFOREST cortex report outer

# Sections of a surface, what lies between them, and a surface again.
$BRAINFOREST cortex contours outer inner -o s.contours --axis y --spacing 1 >/dev/null
$BRAINFOREST cortex compare s.contours >compared.txt
$BRAINFOREST cortex contours outer inner.obj -o obj.contours --axis y --spacing 1 >/dev/null
$BRAINFOREST cortex compare obj.contours >from_obj.txt
[ "$(wc -l <compared.txt)" = "$(wc -l <from_obj.txt)" ]
$BRAINFOREST cortex surfaces s.contours -o outer.gii inner.gii --json >surfaces.json
$BRAINFOREST cortex surfaces s.contours -o outer_all.gii inner_all.gii --error 0 --json >all.json
told surfaces.json 'd["triangles_before"] > 2 * sum(s["triangles"] for s in d["surfaces"])'
told all.json 'd["triangles_before"] == sum(s["triangles"] for s in d["surfaces"])'
told surfaces.json 'all(s["euler"] == 2 for s in d["surfaces"])'
# How far it is from the one that was cut.
$BRAINFOREST cortex distance outer outer_all.gii --values away.txt --json >distance.json
told distance.json 'len(d) == 4 and d[0]["from"] == "outer" and d[1]["to"] == "outer" and all(r["count"] > 500 for r in d)'
told distance.json 'all(0 < r["median"] < r["mean"] * 2 < .5 and r["p95"] <= r["greatest"] for r in d)'
$BRAINFOREST cortex distance outer outer --json >self.json
told self.json 'all(r["greatest"] < 1e-6 for r in d)'
[ "$(grep -vc '^#' away.txt)" = "$(python3 -c 'import json;print(json.load(open("distance.json"))[2]["count"])')" ]
told distance.json '[r["each"] for r in d] == [.25, .25, None, None]'
refuses 'already' $BRAINFOREST cortex distance outer inner --values away.txt
refuses 'no_such' $BRAINFOREST cortex distance outer no_such
refuses 'check that both are in mm' $BRAINFOREST cortex distance outer small
refuses 'is read here' $BRAINFOREST cortex distance outer inner --values inner --force
refuses 'nan: has a vertex that is nowhere' $BRAINFOREST cortex distance nan inner

# w-curves alone: between balls two millimetres apart, but for the dent, which both have.
$BRAINFOREST cortex curves outer inner -o middle --values thick.txt --json >curves.json
told curves.json 'd["curves"] == d["reached"] > 500 and 1.8 < d["thickness"] < 2.2 and d["w_angle"]["median"] < 3 and d["w_angle"]["p99"] < 15'
head -1 thick.txt | grep -qx '# thickness (mm)'
[ "$(grep -vc '^#' thick.txt)" = "$(python3 -c 'import json;print(json.load(open("curves.json"))["curves"])')" ]
for by in volume length; do
  $BRAINFOREST cortex curves outer inner -o $by.gii --by $by --depth .5 >said.txt
  grep -q 'reach the inner surface' said.txt
  $BRAINFOREST cortex distance inner $by.gii --json >$by.json
done
# Half of the volume of a convex shell lies outside of the middle of its curves.
python3 -c 'import json; v, l = (json.load(open(f"{by}.json"))[0]["mean"] for by in ("volume", "length")); assert .9 < l < 1.1 and l + .02 < v < l + .3, (v, l)'
# A vertex of no triangle has no thickness, and a thin shell one where that is asked for.
python3 - <<'PY'
from balls import ball, write
p, f = ball(9, dent=1.2)
write("stray", (p + [(0., 0., 8.)], f))
write("thick", ball(9, 3))
write("near", ball(8.7, 3))
PY
$BRAINFOREST cortex curves stray inner -o stray.gii --values stray.txt --json >stray.json 2>told.txt
grep -q '^stray: a vertex is of no triangle, which has no curve; it stays where it is, with nan as value' told.txt
[ "$(tail -1 stray.txt)" = nan ] && [ "$(grep -c nan stray.txt)" = 1 ]
head -2563 stray.txt | cmp - thick.txt
told stray.json 'd["curves"] == d["reached"] == 2562'
$BRAINFOREST cortex curves thick near -o near.gii --json >near.json 2>told.txt
grep -q 'no curve is as long as 0.5 mm.* give a lower --thinnest' told.txt
told near.json 'd["thickness"] is None and d["thin"] == d["curves"] == 642'
$BRAINFOREST cortex curves thick near -o near.gii --thinnest .1 --force --json >near.json
told near.json '.28 < d["thickness"] < .32 and d["thin"] == 0'
refuses 'already' $BRAINFOREST cortex curves outer inner -o middle
refuses 'is read here' $BRAINFOREST cortex curves outer inner -o inner --force
refuses 'swapped' $BRAINFOREST cortex curves inner outer -o no.gii
fails_with 2 'values' $BRAINFOREST cortex curves outer inner -o no.gii --measure thickness
[ ! -e no.gii ]
head -c 100000 outer_all.gii >cut.gii
refuses 'cut.gii' $BRAINFOREST cortex build cut.gii inner -o no.h5

# Lines alone, in three forms and at three levels; a sheet shows them.
$BRAINFOREST cortex lines outer inner -o lines.csv --sheet sheet.gii --values lines.txt --json >lines.json
told lines.json 'd["lines"] >= 0 and set(d["lines_mm"]) == {"crests", "valleys", "sulci"} and d["border_within_2mm"] is None'
python3 - <<'PYTHON'
import csv, json, math
rows = list(csv.DictReader(open("lines.csv")))
told = json.load(open("lines.json"))
assert len({r["line"] for r in rows}) == told["lines"]
assert all(math.isfinite(float(r[k])) for r in rows for k in "xyz")
whole = sum({r["line"]: float(r["length"]) for r in rows}.values())
assert abs(whole - sum(told["lines_mm"].values())) < .01 * len(rows) + .01, (whole, told)
PYTHON
$BRAINFOREST render sheet.gii --overlay lines.txt -o lines.png --size 320x240 >/dev/null
$BRAINFOREST cortex lines outer inner -o lines.obj --level inner --show crests,valleys >/dev/null
grep -q '^o ' lines.obj || [ "$(python3 -c 'import json; d = json.load(open("lines.json"))["lines_mm"]; print(d["crests"] + d["valleys"] == 0)')" = True ]
refuses 'in one of these' $BRAINFOREST cortex lines outer inner -o lines.txt
refuses 'already' $BRAINFOREST cortex lines outer inner -o lines.csv
refuses 'leave --level out' $BRAINFOREST cortex lines outer inner -o no.border --level middle
refuses 'swapped' $BRAINFOREST cortex lines inner outer -o no.csv
fails_with 2 'sheet' $BRAINFOREST cortex lines outer inner -o no.csv --values no.txt
[ ! -e no.csv ] && [ ! -e no.border ]

# --force replaces what was made before, not what is read.
for file in e.h5 s.contours; do cp $file kept.$file; done
refuses 'is read here' $BRAINFOREST cortex faces e.h5 -o m.gii --values e.h5 --force
refuses 'is read here' $BRAINFOREST cortex surfaces s.contours -o s.contours i.gii --force
refuses 'is read here' $BRAINFOREST cortex contours s.contours -o s.contours --force
for file in e.h5 s.contours; do cmp $file kept.$file; done
$BRAINFOREST cortex contours s.contours -o sections --straight >/dev/null
cp -r sections kept.sections
mkdir linked && ln -s ../sections/section_0005.svg linked
for file in sections/section_0005.svg ./sections/../sections/section_0005.svg linked/section_0005.svg; do
  refuses 'holds what is read here' $BRAINFOREST cortex contours $file -o sections --force
done
diff -r sections kept.sections
$BRAINFOREST cortex contours linked/section_0005.svg -o linked/sections --straight >/dev/null
cp dent.border kept.border
refuses 'is read here' $BRAINFOREST cortex lines outer inner -o dent.border --borders pole.border dent.border --force
cmp dent.border kept.border

# What could not be written in the end is refused before the work; nothing is left behind.
refuses 'its folder is not there' $BRAINFOREST cortex build outer inner -o nowhere/e.h5
refuses 'its folder is not there' $BRAINFOREST cortex contours outer inner -o nowhere/s.contours
refuses 'its folder is not there' $BRAINFOREST cortex compare s.contours --svg nowhere/drawn
refuses 'is neither FILE.contours nor a folder for drawings' $BRAINFOREST cortex contours outer inner -o no.foo
refuses 'is named twice' $BRAINFOREST cortex surfaces s.contours -o no.gii no.gii
refuses "'outer' is to be both boundaries" $BRAINFOREST cortex surfaces s.contours --inner outer -o no.gii no2.gii
refuses 'not as .obj' $BRAINFOREST cortex surfaces s.contours -o no.gii no2.obj
refuses "two boundaries are to be called 'a'" $BRAINFOREST cortex contours outer inner --name a --name a -o no.contours
refuses 'is given twice' $BRAINFOREST cortex contours outer ./outer -o no.contours
mkdir -p again && cp outer again/outer
refuses "two boundaries are to be called 'outer'" $BRAINFOREST cortex contours outer inner again/outer -o no.contours
refuses 'pixel is of pictures, and none is given' $BRAINFOREST cortex contours outer inner --pixel .1 -o no.contours
refuses 'as HDF5; give a name that ends in .h5' $BRAINFOREST cortex build outer inner -o elements.txt
refuses 'is a surface, not contours of sections' $BRAINFOREST cortex compare outer.gii
refuses 'as no brain does; give it in mm' $BRAINFOREST cortex contours large --spacing 5 -o no.contours
refuses 'in mm, or a larger --spacing' $BRAINFOREST cortex contours outer --spacing .0005 -o no.contours
sed '3s/"at": [-0-9.]*,/"at": NaN,/' s.contours >nan.contours
refuses 'nan.contours:3: is no JSON from column' $BRAINFOREST cortex compare nan.contours
mkdir -p same_number && touch same_number/s1.png same_number/s01.png
refuses 's01.png and s1.png have the same number' $BRAINFOREST cortex contours same_number --pixel 1 --threshold .5 -o no.contours
mkdir -p either && touch either/s1.5.png either/s1.10.png either/s1.2.png
refuses 'either: s1.10.png and s1.2.png may follow one another either way' $BRAINFOREST cortex contours either --pixel 1 --threshold .5 -o no.contours
refuses 's1.png: is neither a PNG nor a TIFF picture' $BRAINFOREST cortex contours same_number/s1.png --pixel 1 --threshold .5 -o no.contours
refuses '3 boundaries are named for 1 file' $BRAINFOREST cortex contours outer --name a --name b --name c -o no.contours
# Options of other input, which would say nothing.
for option in 'axis x' 'spacing 3' 'offset 1' 'name a' 'unit 2' 'tolerance .01'; do
  refuses "${option% *} is of " $BRAINFOREST cortex contours s.contours --$option -o no.contours
done
refuses 'unit is of an .slc file' $BRAINFOREST cortex surfaces s.contours --unit 2 -o no.gii no2.gii
refuses 'coarser than the sections, which are 1 mm apart' $BRAINFOREST cortex surfaces s.contours --voxel 3 -o no.gii no2.gii
sed '3s/"at": [-0-9.]*,/"at": 1e400,/' s.contours >large.contours
refuses 'large.contours:3: holds a number too large' $BRAINFOREST cortex compare large.contours
/usr/bin/python3 - <<'PY'
import json
d = json.load(open("s.contours"))
json.dump({**d, "sections": d["sections"][:1]}, open("one.contours", "w"))
PY
refuses 'has 1 section; two are compared' $BRAINFOREST cortex compare one.contours
: >empty.nii
refuses 'empty.nii: is empty' $BRAINFOREST cortex contours empty.nii --threshold 1 -o no.contours
refuses 'more than 100 steps' $BRAINFOREST cortex grid --dimensions 3 --steps 120
refuses 'no ending that can be written' $BRAINFOREST cortex grid -o no.obj
refuses 'dimensions is of all blocks together' $BRAINFOREST cortex grid swan --dimensions 3
refuses 'up is of drawings' $BRAINFOREST cortex grid swan --up x -o no.svg
refuses 'closed is of drawings' $BRAINFOREST cortex grid crown --steps 3 --closed -o no.obj
[ ! -e no.svg ] && [ ! -e no.obj ]
[ ! -e nowhere ] && [ ! -e no.gii ] && [ ! -e no2.gii ] && [ ! -e no.contours ]

# Successive sections over one another, as drawings; contours that cross are told with a place.
$BRAINFOREST cortex compare s.contours --svg overlays --json >overlays.json
told overlays.json 'len(d["pairs"]) > 20 and all(p["hausdorff"] >= p["p95"] >= p["mean"] >= 0 for p in d["pairs"] if p["mean"] is not None)'
told overlays.json 'd["crossings"] == []'
mkdir kept && touch kept/notes.txt
refuses 'holds more than drawings of sections (notes.txt)' $BRAINFOREST cortex compare s.contours --svg kept --force
[ "$(ls kept)" = notes.txt ]
[ "$(ls overlays | wc -l)" -ge 15 ] && grep -q 'data-behind="outer"' overlays/section_0005.svg
python3 - <<'PY2'
import json
d = json.load(open("s.contours"))
section = d["sections"][5]
for c in section["contours"]:
    if c["object"] == "inner":
        for key in ("curve", "polygon"):
            if key in c: c[key] = [[x + 3000, y] for x, y in c[key]]
json.dump(d, open("shifted.contours", "w"))
PY2
$BRAINFOREST cortex compare shifted.contours --json >shifted.json 2>told.txt
grep -q "contours of 'outer' and 'inner' cross at 2 places in 1 section, first in section 6 (" told.txt
told shifted.json 'd["crossings"][0]["objects"] == ["outer", "inner"] and d["crossings"][0]["places"] == 2 and d["crossings"][0]["sections"] == 1'

# Of one boundary, nothing is told of others, nor drawn.
$BRAINFOREST cortex compare shifted.contours --object inner --svg inner_alone --json >inner_alone.json 2>told.txt
told inner_alone.json 'd["crossings"] == [] and {p["object"] for p in d["pairs"]} == {"inner"}'
[ ! -s told.txt ] && grep -q inner inner_alone/section_0006.svg
! grep -q outer inner_alone/section_0006.svg
refuses "no object 'pia'; name one of outer, inner" $BRAINFOREST cortex compare shifted.contours --object pia
$BRAINFOREST cortex contours shifted.contours --object inner -o inner_alone.contours >/dev/null
grep -q '"objects": \["inner"\]' inner_alone.contours

# What has another unit is refused at once.
sed 's/"unit": "um"/"unit": "mm"/' s.contours >mm.contours
refuses 'look at their unit' $BRAINFOREST cortex contours mm.contours -o no.contours
refuses 'look at their unit' $BRAINFOREST cortex compare mm.contours
refuses 'look at their unit' $BRAINFOREST cortex surfaces mm.contours -o no.gii no2.gii
python3 - <<'PY2'
import json
d = json.load(open("s.contours"))
for s in d["sections"]:
    s["at"] /= 1000
    for c in s["contours"]: c.update({k: [[x / 1000 for x in p] for p in c[k]] for k in ("curve", "polygon") if k in c})
json.dump(d, open("um.contours", "w"))
PY2
refuses 'um.contours: the contours reach over 2' $BRAINFOREST cortex surfaces um.contours -o no.gii no2.gii
$BRAINFOREST cortex contours um.contours -o small.contours --straight >/dev/null 2>told.txt
grep -q '^um.contours: the contours reach over 2[0-9.]* µm, as no brain does' told.txt

# Contours that cross, and objects that were swapped.
python3 - <<'PY2'
import json
d = json.load(open("s.contours"))
for s in d["sections"]:
    s["contours"] = [c if c["object"] == "outer" else
                     {"object": "inner", "polygon": [[0, 0], [1000, 0], [0, 1000], [1000, 1000]]} for c in s["contours"]]
json.dump(d, open("cross.contours", "w"))
PY2
refuses "of 'inner' crosses itself in section" $BRAINFOREST cortex surfaces cross.contours -o no.gii no2.gii
refuses 'swap them' $BRAINFOREST cortex surfaces s.contours --outer inner --inner outer -o no.gii no2.gii
[ ! -e no.gii ] && [ ! -e no2.gii ] && [ ! -e no.h5 ]
$BRAINFOREST cortex build outer.gii inner.gii -o from_sections.h5 --json >from_sections.json
python3 - <<'PY'
import json
built = json.load(open("from_sections.json"))
assert built["uncertified"] == 0 and built["elements"] > 1000, built
PY

# Pictures follow one another by the numbers in their names, and the same grey is the same number in 8 and in 16 bits.
python3 - <<'PY'
import os, struct, zlib
def chunk(kind, data):
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
for bits, most in (8, 255), (16, 65535):
    os.mkdir(f"pictures{bits}")
    for i in range(11):
        grey = [[most * (40 - x) // 40 if 3 < y < 10 + 2 * i else 0 for x in range(40)] for y in range(40)]
        rows = b"".join(b"\0" + b"".join(v.to_bytes(bits // 8, "big") for v in row) for row in grey)
        with open(f"pictures{bits}/s{i}.png", "wb") as f:
            f.write(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", 40, 40, bits, 0, 0, 0, 0)) +
                    chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b""))
# The same of 16 bits as one TIFF of eleven pages.
pages = bytearray(b"II*\0" + struct.pack("<I", 8))
for i in range(11):
    grey = [[65535 * (40 - x) // 40 if 3 < y < 10 + 2 * i else 0 for x in range(40)] for y in range(40)]
    tags = [(256, 40), (257, 40), (258, 16), (259, 1), (262, 1), (273, len(pages) + 2 + 8 * 12 + 4), (277, 1), (279, 3200)]
    behind = len(pages) + 2 + 8 * 12 + 4 + 3200
    pages += struct.pack("<H", 8) + b"".join(struct.pack("<HHII", tag, 4, 1, value) for tag, value in tags)
    pages += struct.pack("<I", behind if i < 10 else 0) + b"".join(struct.pack("<40H", *row) for row in grey)
open("pages.tif", "wb").write(pages)
os.mkdir("mixed_pages")
open("mixed_pages/s1.tif", "wb").write(pages)
open("mixed_pages/s2.png", "wb").write(open("pictures8/s2.png", "rb").read())
PY
for bits in 8 16; do
  $BRAINFOREST cortex contours pictures$bits -o pictures$bits.contours --axis z --pixel 1 --threshold .5 --straight >out.txt 2>edge.txt
  grep -q "11 sections reach the edge of the picture" edge.txt
done
$BRAINFOREST cortex contours pages.tif -o pages.contours --axis z --pixel 1 --threshold .5 --straight >/dev/null 2>&1
cmp pictures16.contours pages.contours
refuses 's1.tif: has 11 pages, and other pictures lie beside it' $BRAINFOREST cortex contours mixed_pages --pixel 1 --threshold .5 -o no.contours
refuses 's1.png: is one section; give the folder' $BRAINFOREST cortex contours pictures8/s1.png --pixel 1 --threshold .5 -o no.contours
head -c 5000 pages.tif >cut.tif
refuses 'cut.tif: is no TIFF picture that can be read' $BRAINFOREST cortex contours cut.tif --pixel 1 --threshold .5 -o no.contours
python3 - <<'PY'
import json
for bits in 8, 16:
    polygons = [c["polygon"] for s in json.load(open(f"pictures{bits}.contours"))["sections"] for c in s["contours"]]
    heights = [round(max(y for _, y in p) - min(y for _, y in p)) for p in polygons]
    assert heights == [6000 + 2000 * i for i in range(11)], heights
    assert abs(max(x for x, _ in polygons[0]) - 19920) < 100, polygons[0]
PY

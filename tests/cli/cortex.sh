# SPDX-License-Identifier: Apache-2.0
# brainforest cortex: surfaces → elements → report; sections of surfaces and back; what is refused.
trap 'echo "failed in line $LINENO: $BASH_COMMAND"' ERR

source "$FOREST_SOURCE_DIR/tests/words.sh"

# Two nested, slightly dented balls as FreeSurfer writes surfaces, and some that cannot be.
python3 - <<'PY'
import math, os, sys
sys.dont_write_bytecode = True
sys.path.append(os.environ["FOREST_SOURCE_DIR"] + "/tests")
from balls import ball, write
write("outer", ball(9, dent=1.2))
write("inner", ball(7, dent=1.2))
p, f = ball(9)
write("open", (p, f[:-1]))
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
write("beside", ([(q[0] + 5, q[1], q[2]) for q in ball(7)[0]], f))
write("nan", ([(math.nan if i == 7 else q[0], q[1], q[2]) for i, q in enumerate(p)], f))
with open("inner.obj", "w") as o:
    p, f = ball(7, dent=1.2)
    for q in p: o.write("v %.9g %.9g %.9g\n" % q)
    for q in f: o.write("f %d %d %d\n" % tuple(c + 1 for c in q))
PY

$BRAINFOREST cortex build outer inner -o e.h5 --json >built.json
$BRAINFOREST cortex report e.h5 --outer outer --inner inner --json >report.json
python3 - <<'PY'
import json
built, report = json.load(open("built.json")), json.load(open("report.json"))
for key in ("elements", "uncertified", "volume_error", "volume_mean", "volume_within", "w_angle", "w_reached",
            "equivolume_error", "scaled_jacobian"):
    assert built[key] == report[key], (key, built[key], report[key])
assert built["elements"] > 1000 and built["uncertified"] == 0, built
assert built["volume_error"] < .005 and abs(built["volume_mean"] - 1) < .03 and built["volume_within"] > .95, built
assert built["w_reached"] == 1 and built["w_angle"]["median"] < 3, built
assert report["bok"]["l1"] < 1 < report["bok"]["l6"], report  # the dent is a fundus
assert set(report["symmetry"]) == {"elements", "best_planar", "stretches"} and "border_within_2mm" not in report, report
PY
$BRAINFOREST cortex build outer inner -o fine.h5 --scale 1 >/dev/null
$BRAINFOREST cortex report fine.h5 --outer outer --inner inner --borders dent.border pole.border --json >borders.json
python3 - <<'PY'
import json
report = json.load(open("borders.json"))
dent, pole = report["borders"]["dent"], report["borders"]["pole"]
assert dent > .8 and pole == 0 and abs(report["border_within_2mm"] - dent / 2) < 1e-9, report
PY
refuses '7 vertices' $BRAINFOREST cortex report e.h5 --outer outer --inner inner --borders other.border
fails_with 2 'inner' $BRAINFOREST cortex report e.h5 --outer outer --borders dent.border
$BRAINFOREST cortex build outer inner -o again.h5 --threads 1 >/dev/null
cmp e.h5 again.h5

# Nothing is written where something is wrong.
refuses 'swapped' $BRAINFOREST cortex build inner outer -o no.h5
refuses 'outer surface is open or not of one orientation at the edge of vertices' $BRAINFOREST cortex build open inner -o no.h5
refuses 'check that it is in mm and not in m' $BRAINFOREST cortex build small small -o no.h5
refuses 'check that it is in mm and not in µm' $BRAINFOREST cortex build large inner -o no.h5
refuses 'triangles of the outer surface cut others of it' $BRAINFOREST cortex build cut_itself inner -o no.h5
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
head -c 100000 outer_all.gii >cut.gii
refuses 'cut.gii' $BRAINFOREST cortex build cut.gii inner -o no.h5

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

#!/usr/bin/env bash
# Neurons become models of every format and geometry; XML and triangles are looked at by Python, not by what wrote them.
set -euo pipefail
program=$BRAINFOREST

"$program" grow --grammar pyramidal --count 1 --seed 3 --out cells >/dev/null
cell=$(find cells -name '*.swc')
for geometry in stick cylinder surface; do
  for extension in glb obj ply stl wrl x3d; do
    [[ $geometry == stick && $extension == stl ]] && continue
    "$program" convert "$cell" $geometry.$extension --geometry $geometry --sides 6 --detail 4 >/dev/null 2>&1
  done
done
# VRML and X3D are read by a parser of their standards, which refuses what is spoilt.
/usr/bin/python3 "$FOREST_SOURCE_DIR/tests/vrml97.py" {stick,cylinder,surface}.{wrl,x3d} >read.txt
[[ $(wc -l <read.txt) == 6 ]]
sed 's/coordIndex/coordindex/' stick.wrl >spoilt.wrl
sed 's/colorIndex="0/colorIndex="-2/; s/colorIndex="[1-9]/colorIndex="99/' stick.x3d >spoilt.x3d
for spoilt in spoilt.wrl spoilt.x3d; do
  if /usr/bin/python3 "$FOREST_SOURCE_DIR/tests/vrml97.py" $spoilt 2>/dev/null; then exit 1; fi
done

"$program" convert "$cell" again.ply --geometry surface --detail 4 --threads 1 >/dev/null 2>&1
cmp surface.ply again.ply

# A surface as a stranger sees it: every edge there and back once.
/usr/bin/python3 - <<'PY'
import collections, struct
data = open("surface.stl", "rb").read()
count, = struct.unpack_from("<I", data, 80)
assert len(data) == 84 + 50 * count and count > 1000, count
edges = collections.Counter()
for i in range(count):
    corners = [data[84 + 50 * i + 12 + 12 * k:84 + 50 * i + 24 + 12 * k] for k in range(3)]
    assert len(set(corners)) == 3
    for k in range(3):
        edges[corners[k], corners[(k + 1) % 3]] += 1
assert all(n == 1 and edges[b, a] == 1 for (a, b), n in list(edges.items()))
PY

# What cannot be is refused by a sentence.
if "$program" convert "$cell" a.stl --geometry stick 2>error.txt; then exit 1; fi
grep -q 'holds triangles only' error.txt
[[ ! -e a.stl ]]
if "$program" convert "$cell" a.ply --geometry surface --detail 0.0001 2>error.txt; then exit 1; fi
grep -q 'million triangles.*choose' error.txt
[[ ! -e a.ply ]]

# Many at once, and the losses told.
"$program" convert cells --format ply --geometry surface --detail 5 --out models 2>lost.txt >/dev/null
[[ $(find models -name '*.ply' | wc -l) == 1 ]]
grep -q 'thickened' lost.txt

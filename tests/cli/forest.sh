#!/usr/bin/env bash
# From grown neurons to pictures: pack, render, movie.
set -euo pipefail
source "$FOREST_SOURCE_DIR/tests/words.sh"

small_forest 3
"$program" pack circuit -o b.forest --threads 2 >/dev/null
cmp a.forest b.forest || fail "the forest file depends on the number of threads"

view='{"eye":[700,1500,900],"target":[0,1300,0],"samples":2}'
"$program" render a.forest --view "$view" --size 320x200 -o a.png --threads 1 --json >a.json
"$program" render b.forest --view "$view" --size 320x200 -o b.png --threads 2 >/dev/null
cmp a.png b.png || fail "the picture depends on the number of threads"
# From where all are in sight, all are counted, whatever lies before them.
far='"eye":[0,1000,5000],"target":[0,1000,0]'
for how in '' ',"targets":[{"name":"all","kind":"somata"}]'; do
  "$program" render a.forest --size 640x400 --view "{$far$how}" -o far.png --json >far.json
  grep -q '"neurons": 1000,' far.json || fail "not all of 1000 neurons are counted: $how"
  rm far.png
done
/usr/bin/python3 -c 'import json, sys; d = json.load(open("a.json")); sys.exit(not (0.05 < d["covered"] < 1 and d["segments"] > 10000))' ||
  fail "the picture shows too little"
echo "$view" >view.json
"$program" render a.forest --view view.json --size 320x200 -o c.png >/dev/null
cmp a.png c.png || fail "a view from a file is not the same view"

# Traced neurons need no forest: one by the kinds of its branches, several side by side.
$BRAINFOREST grow --grammar pyramidal --count 3 --seed 2 --out grown >/dev/null
$BRAINFOREST grow --grammar pyramidal --count 3 --seed 2 --out grown.cells >/dev/null
first=$(ls grown/*.swc | head -1)
"$program" render "$first" --size 320x200 -o one.png --json >one.json
told one.json 'd["neurons"] == 1 and d["covered"] > 0 and d["view"]["colour_by"] == "kind"'
"$program" render grown.cells --size 320x200 --view '{"background":"light"}' -o three.png --json >three.json
told three.json 'd["neurons"] == 3 and d["view"]["background"] == "light" and d["view"]["colour_by"] == "kind"'
# Files and folders of them are hung side by side; what is no neuron is not.
"$program" render grown --legend --scale --size 400x300 --background light --colour-by neuron -o folder.png --json >folder.json
told folder.json 'd["neurons"] == 3 and d["view"]["background"] == "light" and d["view"]["colour_by"] == "neuron"'
"$program" render grown/*.swc "$first" --size 400x300 --view '{"colour_by":"type"}' -o files.png --json >files.json
told files.json 'd["neurons"] == 4 and d["view"]["colour_by"] == "type" and d["view"]["projection"] == "orthographic"'
"$program" render "$first" --size 320x200 --view '{"eye":[0,300,2000],"target":[0,300,0]}' -o eye.png --json >eye.json
told eye.json 'd["view"]["colour_by"] == "kind" and d["view"]["projection"] == "perspective"'
"$program" movie "$first" --seconds 0.2 --size 160x90 --samples 1 -o around.mp4 >/dev/null
# For slides: nothing behind, and over black or white what is drawn there, in all that has an edge too.
"$program" render "$first" --size 320x200 --background transparent -o clear.png --json >clear.json
told clear.json 'd["view"]["background"] == "transparent" and d["covered"] > 0'
"$program" render "$first" --size 320x200 --background transparent --legend --scale -o words.png >/dev/null
/usr/bin/python3 - <<'PY' || fail "a transparent picture is not"
from png_pixels import pixels
clear, words = pixels("clear.png", 4), pixels("words.png", 4)
assert clear[0] == (0, 0, 0, 0) and sum(p[3] == 0 for p in clear) > .5 * len(clear)
assert any(p[3] > 240 for p in clear) and any(0 < p[3] < 128 for p in clear)
assert sum(a != b for a, b in zip(clear, words)) > 500
PY
refuses 'a film has no transparent background' "$program" movie "$first" --background transparent -o no.mp4
refuses 'a film has no transparent background' "$program" section "$first" --background transparent --through 5 -o no.mp4
refuses 'a name that ends in .png' "$program" render "$first" --background transparent -o no.jpg
[ ! -e no.mp4 ] && [ ! -e no.jpg ] || fail "what was refused is there"
fails_with 2 'excludes' "$program" render "$first" --legend --no-legend -o no.png
# What branches measure from place to place.
for what in order radius distance; do
  "$program" render grown --size 320x200 --colour-by $what -o by_$what.png --json >by.json
  told by.json "d['view']['colour_by'] == '$what' and d['covered'] > 0"
  "$program" section "$first" --size 320x200 --height 300 --colour-by $what -o cut_$what.png >/dev/null
done
! cmp -s by_order.png by_radius.png && ! cmp -s by_order.png by_distance.png || fail "all measures look alike"
refuses 'one quantity of branches' "$program" render "$first" --colour-by order \
  --view '{"targets":[{"name":"all","colour":"radius"}]}' -o no.png
# Neurons as they grew: each picture shows no less than the one before, and the last is what they became.
$BRAINFOREST grow --grammar bes --count 2 --seed 1 --time-lapse 48 --out growing >/dev/null
"$program" movie growing --growth --seconds 0.4 --size 320x180 --samples 4 --pictures steps -o growth.mp4 --json >growth.json
told growth.json 'd["pictures"] == 10 and d["covered"] > 0'
[ "$(ls steps | wc -l)" = 10 ] || fail "not as many pictures as asked for"
! cmp -s steps/00000.png steps/00009.png || fail "nothing grows"
refuses 'grown: holds no neuron as it grew' "$program" movie grown --growth -o no.mp4
fails_with 2 'excludes' "$program" movie growing --growth --skin -o no.mp4
[ ! -e no.mp4 ] || fail "a film of what was refused"
"$program" targets "$first" | grep -q all || fail "the targets of a neuron are not told"
refuses 'holds neurons and no circuit' "$program" pack "$first" -o no.forest
mkdir nothing
refuses 'nothing: holds no file of neurons' "$program" render nothing -o no.png
refuses 'a.forest: is no file of neurons' "$program" render "$first" a.forest -o no.png
refuses 'nosuch.swc' "$program" render "$first" nosuch.swc -o no.png
"$program" section "$first" --size 320x200 --height 300 -o cut.png >/dev/null
head -c 40 "$first" >broken.swc
refuses 'broken.swc' "$program" render broken.swc -o no.png
[ ! -e no.png ] || fail "a picture of a broken neuron"

# What is not there is not told: no surfaces, no colour map of theirs.
"$program" render a.forest --view view.json --size 64x64 -o c.png --json >c.json
told c.json 'd["surfaces"] is None and d["activity"] is None'
# The studio takes what render takes; without a display it says so, not that it knows no such word.
for words in '--size 900x700' '--synapses a.synapses' '--size 900x700 --activity a.forest --synapses a.forest'; do
  [[ $words != *a.synapses* ]] || cp a.forest a.synapses
  refuses "no display" env -u DISPLAY -u WAYLAND_DISPLAY "$program" view a.forest $words
done
rm a.synapses
refuses "'big' is no size" env -u DISPLAY -u WAYLAND_DISPLAY "$program" view a.forest --size big
"$program" view --help | grep -q -e '--synapses' || fail "view does not tell of --synapses"

"$program" movie a.forest --seconds 0.2 --size 160x90 --samples 1 -o walk.mp4 >/dev/null
"$program" movie a.forest --outline --seconds 0.04 --size 160x90 --samples 1 --pictures with -o outline.mp4 >/dev/null
"$program" movie a.forest --seconds 0.04 --size 160x90 --samples 1 --pictures without -o bare.mp4 >/dev/null
! cmp -s with/00000.png without/00000.png
[[ $(head -c 8 walk.mp4 | tail -c 4) == ftyp ]] || fail "walk.mp4 is no MP4 file"

refuses "forest file" "$program" render view.json -o x.png
: >empty.obj
refuses "empty.obj: is empty; get the file again" "$program" render empty.obj -o x.png
head -c 100000 a.forest >short.forest
refuses "cut short" "$program" render short.forest -o x.png
refuses "brainforest: --view:1: is no JSON from column 15 on" "$program" render a.forest --view '{"eye":[1,2,3]' -o x.png
printf '{"eye": [1, 2, 3],\n "target" [0, 0, 0]}' >slip.json
refuses "slip.json:2: is no JSON from column 11 on" "$program" render a.forest --view slip.json -o x.png
refuses "same point" "$program" render a.forest --view '{"eye":[1,2,3],"target":[1,2,3]}' -o x.png
refuses "nowhere" "$program" render a.forest --size 64x64 -o /nowhere/x.png
refuses "two views" "$program" movie a.forest --view "$view" -o x.mp4
[[ ! -e x.png && ! -e x.mp4 ]] || fail "a refused command left a file behind"
echo "forest.sh: all is well"

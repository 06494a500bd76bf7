# SPDX-License-Identifier: Apache-2.0
# Pictures, films, forest and activity files are made anew each time: they replace older ones of their own kind, and nothing else.
source "$FOREST_SOURCE_DIR/tests/words.sh"
small_forest 1
"$program" grow --grammar bes --count 1 --seed 1 --out cells >/dev/null
cp cells/bes-1-00000.swc traced.swc
cp traced.swc traced.png
cp traced.swc traced.mp4
cp traced.swc kept.swc
same() { cmp kept.swc traced.swc && cmp kept.swc traced.png && cmp kept.swc traced.mp4; }

small=(--size 64x48 --renderer cpu)
refuses 'PNG pictures have names that end in .png' "$program" render a.forest "${small[@]}" -o traced.swc
refuses 'PNG pictures have names that end in .png' "$program" render a.forest "${small[@]}" -o x.jpg
refuses 'traced.png is there and is no PNG picture' "$program" render a.forest "${small[@]}" -o traced.png
refuses 'its folder is not there' "$program" render a.forest "${small[@]}" -o nowhere/x.png
refuses 'cells is a folder' "$program" render a.forest "${small[@]}" -o cells
refuses 'MP4 films have names that end in .mp4' "$program" movie a.forest "${small[@]}" -o traced.swc
refuses 'traced.mp4 is there and is no MP4 film' "$program" movie a.forest "${small[@]}" -o traced.mp4
refuses 'traced.png is there and is no PNG picture' "$program" section a.forest --size 64x48 -o traced.png
refuses 'traced.swc is there and is no forest file' "$program" pack circuit -o traced.swc
refuses 'r.db is there and is no forest file' "$program" pack circuit -o r.db
refuses 'traced.swc is there and is no activity file' "$program" activity --spikes nowhere.h5 --circuit circuit --out traced.swc
refuses 'PNG pictures have names that end in .png' "$program" raster nowhere.activity --out traced.swc
refuses "name a forest file, which 'brainforest pack' makes" "$program" render circuit "${small[@]}" -o x.png
same

# Their own kind is replaced, an empty file filled, and what takes bytes gets them.
"$program" render a.forest "${small[@]}" -o a.png >/dev/null
cp a.png first.png
"$program" render a.forest "${small[@]}" --outline -o a.png >/dev/null
! cmp -s a.png first.png
: >empty.png
"$program" render a.forest "${small[@]}" -o empty.png >/dev/null
cmp empty.png first.png
"$program" render a.forest "${small[@]}" -o /dev/stdout | head -c "$(stat -c %s first.png)" >piped.png || true
cmp piped.png first.png
"$program" pack circuit -o a.forest >/dev/null

# Tables and drawings are somebody's until --force.
"$program" section a.forest -o areas.csv >/dev/null
"$program" section a.forest -o areas.csv >/dev/null
echo mine >>areas.csv
refuses '--force' "$program" section a.forest -o areas.csv
"$program" section a.forest -o areas.csv --force >/dev/null
! grep -q mine areas.csv
"$program" cortex grid swan -o swan.svg >/dev/null
echo mine >swan.svg
refuses '--force' "$program" cortex grid swan -o swan.svg

# A demo replaces what a demo made, and no repository of that name.
mkdir demo && cp r.db demo/neurons.db
refuses 'no demo made it' "$program" demo --out demo
echo mine >demo/about.txt
refuses 'no demo made it' "$program" demo --out demo
cmp r.db demo/neurons.db && grep -q mine demo/about.txt

# Nobody may see more of a file than the mask leaves, and what cannot be said is no success.
(umask 077 && "$program" convert traced.swc secret.asc >/dev/null && "$program" plant --recipe column-1000 --repo r.db --out secret >/dev/null)
[ "$(stat -c %a secret.asc) $(stat -c %a secret)" = '600 700' ]
fails_with 1 'cannot be written' bash -c '"$0" list --repo r.db >/dev/full' "$program"

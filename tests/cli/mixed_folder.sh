#!/usr/bin/env bash
# A stranger's folder: cells of every format, files that only share an extension with them, junk, twins and one broken file
# become one repository by one command, and its report says of every file what became of it.
set -euo pipefail
fail() { echo "mixed_folder.sh: $*" >&2; exit 1; }

mkdir -p box/deep/er box/__MACOSX
printf '1 1 0 0 0 5 -1\n2 3 0 5 0 1 1\n3 3 0 15 0 1 2\n4 3 5 20 0 1 3\n5 3 -5 20 0 1 3\n' >box/a.swc
for extension in asc nts h5 nml p; do $BRAINFOREST convert box/a.swc "box/deep/of_$extension.$extension" >/dev/null 2>&1; done
sed 's/^No. points/a slice\n&/' box/deep/of_nts.nts >box/deep/er/cell.ca1  # Eutectic's extensions are pieces of names
cp box/a.swc 'box/deep/er/the same.swc'
printf '<mbf version="4.0"><tree type="Axon"><point x="0" y="5" z="0" d="2"/><point x="0" y="9" z="0" d="2"/></tree></mbf>' >box/deep/nmf.xml
printf '1 1 0 0 0 5 -1\n2 3 0 5 0 -1 1\n3 0 0 15 0 1 2\n' >box/odd.swc
# Files that are no neurons, though they are called so.
echo '<project><target/></project>' >box/build.xml
echo '<neuroml id="n"><ionChannel id="k"/></neuroml>' >box/channel.nml
printf '<mbf version="4.0"><contour name="Pia"><point x="0" y="5" z="0" d="2"/></contour></mbf>' >box/slide.xml
printf '#!/usr/bin/perl\nprint 1;\n' >box/script.p
printf '\0\5\26\7 resource' >box/__MACOSX/._a.swc
/usr/bin/python3 -c 'import h5py; h5py.File("box/data.h5", "w")["x"] = 1' 2>/dev/null || true
printf '1,2,3,4,5,6,7\n' >box/table.csv
echo notes >box/notes.txt
# Files that are broken.
: >box/empty.swc
printf '<!DOCTYPE html><html>404</html>' >box/lost.swc
cp box/a.swc box/wrong.asc
printf '1 1 0 0 0 5 -1\n2 3 0 five 0 1 1\n' >box/word.swc
mkdir box/closed && cp box/a.swc box/closed/hidden.swc && chmod 0 box/closed
ln -s .. box/deep/circle

status=0
$BRAINFOREST import box --repo cells.db >report.txt 2>said.txt || status=$?
chmod 700 box/closed
[ $status = 1 ] || fail "status $status"
says() { grep -qF -- "$1" report.txt said.txt || { cat report.txt said.txt; fail "no '$1'"; }; }
says "box/build.xml:1: is not NeuroML: its first element is <project>, not <neuroml>; skipped"
says "holds no cell with a morphology; give a file that does; skipped"
says "box/script.p:1: "
says "box/slide.xml: holds neither a tree nor a soma"
says "box/__MACOSX/._a.swc: holds what macOS notes beside a file"
says "box/empty.swc: is empty; copy or export it again"
says "box/lost.swc: is a web page"
says "if it is, name it .swc"
says 'box/word.swc:2: column 4 (y) is "five", not a number'
says "box/deep/er/the same.swc: is the same file as that of neuron 'a'"
says "2 files of other formats are skipped (1 .csv, 1 .txt)"
says "4 not read, "
grep -q '^negative-radius  .*box/odd.swc:2 ' report.txt || fail "the oddities are not listed"
says "measure it where thickness matters"
for file in $(find box -name 'of_*') box/deep/nmf.xml box/deep/er/cell.ca1 box/a.swc; do
  grep -q "^$file .*  stored$" report.txt || { cat report.txt; fail "$file was not stored"; }
done

# What holds no neuron is told, and no failure; named by its name it is one.
rm box/empty.swc box/lost.swc box/wrong.asc box/word.swc
$BRAINFOREST import box --repo cells.db >/dev/null 2>&1
$BRAINFOREST check box --json >check.json 2>/dev/null
/usr/bin/python3 -c 'import json; d = json.load(open("check.json")); assert d["failed"] == 0 and d["skipped"] >= 4, d'
$BRAINFOREST convert box --format swc --out swc >/dev/null 2>&1 || fail "a folder is not converted because of files that are no neurons"
$BRAINFOREST measure box >/dev/null 2>&1
if $BRAINFOREST import box/build.xml --repo other.db >/dev/null 2>&1; then fail "a named file that is no neuron is no failure"; fi

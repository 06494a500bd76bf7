#!/usr/bin/env bash
# Many cells go into one file and come out of it again, whatever they are called.
set -euo pipefail
source "$FOREST_SOURCE_DIR/tests/words.sh"

"$program" grow --grammar motoneuron --count 12 --seed 3 --out cells >/dev/null
first=motoneuron-3-00000.swc
mkdir cells/deep && cp "cells/$first" cells/deep/neuron1.swc && cp "cells/motoneuron-3-00001.swc" "cells/deep/$first"
for out in all.h5 all.cells; do
  "$program" convert cells --out $out >out.txt 2>said.txt
  grep -q '^14 written as' out.txt || fail "$(cat out.txt)"
  grep -q "another neuron is called 'motoneuron-3-00000', so this one is written as 'motoneuron-3-00000-2'" said.txt || fail "$(cat said.txt)"
  "$program" convert $out --format swc --out apart-${out#all.} >/dev/null 2>&1
  [[ $(ls apart-${out#all.} | wc -l) == 14 ]] || fail "$(ls apart-${out#all.})"
  cmp cells/deep/neuron1.swc apart-${out#all.}/all-neuron1.swc
  for i in 00005 00011; do cmp cells/motoneuron-3-$i.swc apart-${out#all.}/all-motoneuron-3-$i.swc; done
  cmp "cells/deep/$first" "apart-${out#all.}/all-$first"  # comes first
  cp $out kept
  "$program" convert cells --out $out >/dev/null 2>&1
  cmp $out kept || fail "the same cells give other bytes"
  refuses "holds something else" "$program" convert "cells/$first" --out $out
  cmp $out kept
done

# One container into another keeps the names; two are told apart by their files.
"$program" convert all.cells round.h5 >/dev/null
mkdir again && "$program" convert round.h5 again/all.cells >/dev/null
"$program" convert again/all.cells --format swc --out apart >/dev/null 2>&1
diff -r apart-cells apart
"$program" convert all.h5 round.h5 --out both.h5 >both.txt 2>said.txt
grep -q '^28 written as' both.txt || fail "$(cat both.txt)"

# A repository, of several populations.
"$program" import cells/deep --repo r.db --population "a/b" >/dev/null
"$program" import "cells/$first" --repo r.db --population other >/dev/null
"$program" export --repo r.db --out exported.h5 --json >exported.json
"$program" convert exported.h5 --format swc --out exported >/dev/null 2>&1
[[ $(ls exported | wc -l) == 3 ]] || fail "$(ls exported)"
for f in exported/*other*; do cmp "$f" "cells/$first"; done
"$program" export --repo r.db --population other --format h5 --out new/other.h5 >/dev/null
refuses "holds something else" "$program" export --repo r.db --population other --out exported.h5
fails_with 2 "say different formats" "$program" export --repo r.db --format swc --out x.h5
fails_with 2 "say different formats" "$program" convert cells --format swc --out x.h5

# A broken file is told; the others are written.
printf '1 1 0 0\n' >broken.swc
fails_with 1 "1 of 2 neurons" "$program" convert broken.swc "cells/$first" --out rest.h5
"$program" convert rest.h5 rest.swc >/dev/null 2>&1
cmp rest.swc "cells/$first"
echo "containers.sh: all is well"

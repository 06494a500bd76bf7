#!/usr/bin/env bash
# Exported cells load in NEURON with the sections, lengths and areas that were measured: grown ones, made-up odd ones, every
# real one, and the samples of other formats.
set -euo pipefail
program=$BRAINFOREST
required=${BRAINFOREST_REQUIRE_DATA:-0}
data=${BRAINFOREST_DATA:-$FOREST_SOURCE_DIR/../shared/data}
unset DISPLAY  # NEURON opens windows where there is one
if ! /usr/bin/python3 -c 'import neuron' 2>/dev/null; then
  echo "neuron.sh: python3-neuron is not installed; ./dev setup installs it"
  [[ $required == 1 ]] && exit 1
  exit 77
fi

for grammar in pyramidal motoneuron; do
  "$program" grow --grammar $grammar --count 3 --seed 5 --out cells/$grammar >/dev/null
done
mkdir -p cells/odd cells/real
# A soma that branches, with a neurite on each of its points; kinds of all numbers; a lost piece; a fork of stems in one point.
cat >cells/odd/all.swc <<'SWC'
1 1 0 0 0 5 -1
2 1 0 6 0 4 1
3 1 0 12 0 2 2
4 1 6 6 0 2 2
5 1 -6 0 0 3 1
6 1 0 0 9 2 1
7 1 5 0 9 2 6
8 3 0 14 0 1 3
9 3 0 34 0 .5 8
10 2 8 8 0 1 4
11 2 18 8 0 .4 10
12 4 -8 0 0 1 5
13 4 -9 0 0 1 12
14 4 -9 10 0 1 12
15 5 0 0 -3 1 1
16 5 0 0 -30 1 15
17 6 7 0 9 1 7
18 6 7 0 19 1 17
19 0 2 2 2 1 2
20 0 2 2 12 1 19
21 9 3 3 3 1 6
22 9 3 3 40 .3 21
23 3 500 0 0 1 -1
24 3 500 10 0 1 23
25 3 500 10 0 3 24
26 3 500 20 0 0 25
SWC
printf '1 3 0 0 0 1 -1\n2 3 0 9 0 1 1\n3 3 4 12 0 1 2\n4 3 -4 12 0 1 2\n' >cells/odd/no_soma.swc
printf '1 1 0 0 0 0 -1\n2 3 0 9 0 0 1\n3 3 4 12 0 0 2\n' >cells/odd/no_radii.swc
if [[ -d $data/morphologies/real ]]; then
  number=0
  gather() {  # folder, extension…: the files below, by names of their own
    local to=$1 folder=$2 extension
    mkdir -p "$to"
    for extension in "${@:3}"; do
      while IFS= read -r -d '' file; do
        cp "$file" "$to/$((number++))-$(basename "$file")"
      done < <(find "$folder" -name "*.$extension" -print0 | sort -z)
    done
  }
  gather cells/real "$data/morphologies/real" swc asc
  # HDF5 holds all of a neuron, and files of several cells become several.
  gather others "$data/morphologies/real" xml
  gather others "$data/morphologies/h5" h5
  gather others "$data/eutectic" nts
  gather others "$data/genesis" p
  gather others "$data/neuroml/smith_l23" nml
  gather others "$data/neuroml/cvapp_cases" nml
  "$program" convert others --format h5 --out cells/others >/dev/null 2>&1 || true  # some are no neurons
elif [[ $required == 1 ]]; then
  echo "neuron.sh: there is no real data in $data"
  exit 1
fi

"$program" measure cells --metric number_of_sections total_length total_area soma_surface_area --csv measured.csv >/dev/null
"$program" convert cells --format hoc --out hoc >/dev/null 2>lost.txt
"$program" convert cells --format neuron-python --out python >/dev/null 2>&1
grep -q 'no_radii.hoc: zero-radii: 3 points have no diameter' lost.txt
/usr/bin/python3 "$FOREST_SOURCE_DIR/tests/neuron_cells.py" measured.csv hoc python 2>&1

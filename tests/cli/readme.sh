# SPDX-License-Identifier: Apache-2.0
# Every command of the README's first steps, in its order, works as it stands there; only the film is made smaller.
ln -s "$FOREST_SOURCE_DIR/data" data
ln -s "$FOREST_SOURCE_DIR/examples" examples
unset DISPLAY  # NEURON opens windows where there is one
export PATH="$(dirname "$BRAINFOREST"):$PATH"
export EDITOR="sed -i '\$ a # mine'"

grep -e '^brainforest ' -e '^/usr/bin/python3 ' -e '^mv ' "$FOREST_SOURCE_DIR/README.md" | grep -v -e ' view ' -e ' fetch ' -e ' cortex ' -e ' --elements ' |  # a window needs a display, a service a network, elements minutes
  sed 's/^brainforest movie .*/& --size 320x180 --fps 5 --samples 2/' >commands
grep -q '^brainforest import' commands
grep -q 'simulate_column.py' commands
if ! /usr/bin/python3 -c 'import neuron, h5py' 2>/dev/null; then  # what it simulates and all that plays it
  [ "${BRAINFOREST_REQUIRE_DATA:-0}" = 1 ] && { echo "readme.sh: python3-neuron or python3-h5py is not installed"; exit 1; }
  sed -i -e '/ run\.activity/d' -e '/ run\//d' commands
fi

while read -r command; do
  bash -euo pipefail -c "$command" </dev/null || { echo "the README's command failed: $command"; exit 1; }
  for made in $(grep -oP '(?<=--out |-o |--csv |--repo )\S+' <<<"$command"); do
    [ -s "$made" ] || { echo "$made is not there after: $command"; exit 1; }
  done
done <commands

# SPDX-License-Identifier: Apache-2.0
# brainforest bench peers: what it prints and refuses; the part with VTK only where VTK is.
trap 'echo "failed in line $LINENO: $BASH_COMMAND"' ERR

source "$FOREST_SOURCE_DIR/tests/words.sh"
small=(--neurons 20 --size 96x64 --frames 2 --samples 4)
fails_with 2 modes "$BRAINFOREST" bench peers --modes spheres
refuses 'nowhere/python cannot be started' "$BRAINFOREST" bench peers "${small[@]}" --python nowhere/python

# A Python without VTK: told which package to install.
mkdir bare
printf '#!/bin/sh\nexec /usr/bin/python3 -S -I "$@"\n' >bare/python
chmod +x bare/python
refuses 'install python3-vtk9' "$BRAINFOREST" bench peers "${small[@]}" --python bare/python

/usr/bin/python3 -c 'import vtkmodules.vtkRenderingOpenGL2' 2>/dev/null && command -v xvfb-run >/dev/null ||
  { echo "VTK for Python (python3-vtk9) or xvfb-run is missing: not compared"; exit 77; }
"$BRAINFOREST" bench peers "${small[@]}" --out kept --json >out.json
/usr/bin/python3 - <<'PY'
import json
out = json.load(open("out.json"))
assert set(out["modes"]) == {"ours", "lines", "impostors", "tubes"}, out
for name, mode in out["modes"].items():
    assert {"frame_seconds", "core_seconds", "peak_bytes", "agreement"} <= set(mode), out
    assert mode["frame_seconds"] > 0 and mode["core_seconds"] > 0 and mode["peak_bytes"] > 1e7, (name, mode)
    assert .3 < mode["agreement"] <= 1, f"{name} shows something else: {mode}"
assert set(out["ratio"]) == {"lines", "impostors", "tubes"}, out
assert all(set(r) == {"frame", "core", "memory"} for r in out["ratio"].values()), out
PY
for mode in ours lines impostors tubes reference; do
  [ -s kept/$mode-1.png ] || { echo "no picture by $mode"; exit 1; }
done
"$BRAINFOREST" bench peers "${small[@]}" --modes lines | grep -q '^VTK lines '

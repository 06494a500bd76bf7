#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Where OpenGL is missing or too old, pictures are drawn on the processor, or it is said what to install; and no picture is
# black without a word.
set -euo pipefail
source "$FOREST_SOURCE_DIR/tests/words.sh"

small_forest 1
picture=(render a.forest --size 320x240)
"$program" "${picture[@]}" --renderer cpu -o cpu.png >/dev/null

# Drivers that lack what is needed.
for lacking in MESA_GL_VERSION_OVERRIDE=3.3 MESA_GL_VERSION_OVERRIDE=4.4 MESA_EXTENSION_OVERRIDE=-GL_ARB_compute_shader; do
  refuses "and 4.5 is needed for its compute shaders; install" env $lacking "$program" "${picture[@]}" --renderer opengl -o x.png
  grep -qE 'offers OpenGL [34]\.[0-9]' err.txt || fail "the driver is not named: $(cat err.txt)"
  env $lacking "$program" "${picture[@]}" -o auto.png >/dev/null
  cmp cpu.png auto.png || fail "without OpenGL the processor draws otherwise ($lacking)"
done
# No driver, and no library.
refuses "install libegl1 and libgl1-mesa-dri" env __EGL_VENDOR_LIBRARY_FILENAMES=/nowhere.json "$program" "${picture[@]}" --renderer opengl -o x.png
mkdir -p none/egl none/gl
for library in egl/libEGL.so.1 gl/libOpenGL.so.0 gl/libGL.so.1; do echo none >none/$library; done
refuses "libEGL.so.1 cannot be opened, without which OpenGL draws nothing; install libegl1" \
  env LD_LIBRARY_PATH="$PWD/none/egl" "$program" "${picture[@]}" --renderer opengl -o x.png
refuses "install libopengl0" env LD_LIBRARY_PATH="$PWD/none/gl" "$program" "${picture[@]}" --renderer opengl -o x.png
for folder in egl gl; do
  LD_LIBRARY_PATH="$PWD/none/$folder" "$program" "${picture[@]}" -o auto.png >/dev/null
  cmp cpu.png auto.png || fail "without a library of OpenGL the processor draws otherwise"
done
[[ ! -e x.png ]] || fail "a refused command left a file behind"

# A picture of nothing is made, and why it is empty is said.
says() {  # words, command…
  local words=$1
  shift
  "$@" >/dev/null 2>err.txt || fail "failed: $*"
  grep -qF -- "$words" err.txt || fail "no '$words' from: $* ($(cat err.txt))"
}
says "no neuron that is visible lies in this view" "$program" "${picture[@]}" --view '{"eye":[1e5,0,0],"target":[2e5,0,0]}' -o away.png
says "no neuron belongs to the target 'L5 and L6'" "$program" "${picture[@]}" --only "L5 and L6" -o none.png
says "the film shows nothing" "$program" movie a.forest --only "L5 and L6" --size 64x64 --seconds .1 -o none.mp4

# A film that is killed leaves the old one, and nothing else.
echo old >walk.mp4
timeout -s KILL 1 "$program" movie a.forest --size 320x240 --seconds 60 -o walk.mp4 >/dev/null 2>&1 || true
[[ $(cat walk.mp4) == old && $(ls -A | grep -c 'walk.mp4') == 1 ]] || fail "a film that was killed left $(ls -A)"
echo "drivers.sh: all is well"

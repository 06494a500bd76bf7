# SPDX-License-Identifier: Apache-2.0
# brainforest grow --environment and plant with grammars: growth by what is around.
trap 'echo "failed in line $LINENO: $BASH_COMMAND"' ERR

source "$FOREST_SOURCE_DIR/tests/words.sh"
cortex="$FOREST_SOURCE_DIR/examples/cortex.toml"

# The same model deep below the pia and near it; the same bytes at any number of threads.
for depth in 1500 150; do
  $BRAINFOREST grow --grammar tufted --environment "$cortex" --depth $depth --count 4 --seed 3 --out d$depth --threads 1 >/dev/null
  $BRAINFOREST grow --grammar tufted --environment "$cortex" --depth $depth --count 4 --seed 3 --out again$depth --threads 4 >/dev/null
  diff -r d$depth again$depth
done
$BRAINFOREST grow --grammar tufted --environment "$cortex" --at 0,700,0 --count 4 --seed 3 --out at >/dev/null
diff -r d1500 at
grep -q 'grown_at.*0, 700, 0' at/tufted-3-00000.swc
grep -q 'environment.*cortex.toml' at/tufted-3-00000.swc
$BRAINFOREST grow --grammar tufted --count 4 --seed 3 --out nowhere >/dev/null
[ "$(cat nowhere/*.swc | grep -c 'grown_at\|environment')" = 0 ]
# The hash is of what is in it: the same under another name, another where anything is moved.
hash_in() { grep -h 'environment_hash' "$1"/*.swc | sort -u; }
sed 's/^# .*//' "$cortex" >same.toml
sed '0,/^thickness = [0-9]*/s//&.5/' "$cortex" >other.toml
for file in same other; do $BRAINFOREST grow --grammar tufted --environment $file.toml --at 0,700,0 --seed 3 --out in_$file --repo env.db --population $file >/dev/null; done
[ "$(hash_in at)" = "$(hash_in in_same)" ]
[ "$(hash_in at)" != "$(hash_in in_other)" ]
$BRAINFOREST show tufted-3-00000 --repo env.db --population same >shown.txt
grep -q 'environment *same.toml' shown.txt
$BRAINFOREST grow --grammar tufted --environment column-1000 --depth 900 --seed 3 --out recipe >/dev/null
cat >reach.py <<'PY'
import glob, sys
def highest(folder):  # surface of the highest neurite of each cell
    return [max(float(f[3]) + float(f[5]) for f in (line.split() for line in open(name)) if f and f[0] != "#")
            for name in sorted(glob.glob(folder + "/*.swc"))]
PY
/usr/bin/python3 - <<'PY'
from reach import highest
deep, shallow, nowhere, recipe = (highest(f) for f in ("d1500", "d150", "nowhere", "recipe"))
assert all(1350 < y <= 1500.001 for y in deep), deep
assert all(50 < y <= 150.001 for y in shallow), shallow
assert all(y > 1100 for y in nowhere), nowhere
assert all(700 < y <= 900.001 for y in recipe), recipe
PY

# Neurons that grow where they stand: none above the pia, none through a soma.
cat >recipe.toml <<'TOML'
name = "grown"
[column]
radius = 60
[soma]
gap = 1
[[type]]
name = "tufted cell"
grammar = "tufted"
[[layer]]
name = "L1"
thickness = 100
count = 0
mix = { "tufted cell" = 1 }
[[layer]]
name = "L5"
thickness = 300
count = 40
mix = { "tufted cell" = 1 }
TOML
$BRAINFOREST plant --recipe recipe.toml --seed 5 --out planted --threads 1 >/dev/null
$BRAINFOREST plant --recipe recipe.toml --seed 5 --out planted4 --threads 4 >/dev/null
diff -r planted planted4
/usr/bin/python3 - <<'PY'
import glob, h5py, math
with h5py.File(glob.glob("planted/**/nodes.h5", recursive=True)[0]) as f:
    group = next(iter(f["nodes"].values()))["0"]
    places = list(zip(*(group[axis][:].tolist() for axis in "xyz")))
    names = group["morphology"][:]
    library = group["@library/morphology"][:] if "@library" in group else None
names = [(library[n] if library is not None else n) for n in names]
names = [n.decode() if isinstance(n, bytes) else n for n in names]
assert len(places) == 40 and len(set(names)) == 40
files = {name.split("/")[-1][:-4]: name for name in glob.glob("planted/**/*.swc", recursive=True)}
cells, radii = [], []
for place, name in zip(places, names):
    rows = [line.split() for line in open(files[name]) if line.strip() and line[0] != "#"]
    at = {r[0]: tuple(float(r[2 + k]) + place[k] for k in range(3)) for r in rows}
    radii.append(next(float(r[5]) for r in rows if r[1] == "1"))
    cells.append([(at[r[0]], at[r[6]]) for r in rows if r[1] != "1" and r[6] in at])
    assert all(float(r[3]) + float(r[5]) + place[1] <= 400.001 for r in rows if r[1] != "1"), name
def distance(p, a, b):
    ab = [b[k] - a[k] for k in range(3)]
    length = sum(x * x for x in ab)
    t = min(1, max(0, sum((p[k] - a[k]) * ab[k] for k in range(3)) / length)) if length else 0
    return math.dist(p, [a[k] + t * ab[k] for k in range(3)])
for i, cell in enumerate(cells):
    for j, (place, radius) in enumerate(zip(places, radii)):
        if i != j:
            worst = min(distance(place, a, b) for a, b in cell)
            assert worst > radius - 1e-3, (i, j, worst, radius)
PY
# … and into what is planted already.
$BRAINFOREST grow --grammar tufted --environment planted --at 0,150,0 --out among >/dev/null
[ -s among/tufted-0-00000.swc ]
sed 's/^grammar.*/&\npopulation = "x"/' recipe.toml >both.toml
sed 's/"tufted"/"nobody"/' recipe.toml >nobody.toml
sed 's/^grammar.*//' recipe.toml >stored.toml
fails_with 1 'has a grammar and a population' $BRAINFOREST plant --recipe both.toml --out x
fails_with 1 'there is no such grammar' $BRAINFOREST plant --recipe nobody.toml --out x
fails_with 1 'name its repository with --repo' $BRAINFOREST plant --recipe stored.toml --out x

# A time lapse of a cell that takes branches back: it has more dendrites in between than at the end.
$BRAINFOREST grow --grammar retraction --seed 1 --out week --time-lapse 10 >/dev/null
/usr/bin/python3 - <<'PY'
import glob
def stems(name):
    rows = [line.split() for line in open(name) if line.strip() and line[0] != "#"]
    soma = {r[0] for r in rows if r[1] == "1"}
    return sum(r[1] != "1" and (r[6] in soma or r[6] == "-1") for r in rows)
counts = [stems(name) for name in sorted(glob.glob("week/*step*.swc"))]
assert max(counts) >= 4 and counts[-1] == 1, counts
PY

# What is wrong is said with file, line and remedy.
printf '[[layer]]\nname = "L1"\nthickness = -3\n' >bad.toml
fails_with 1 'bad.toml:3: ' $BRAINFOREST grow --grammar tufted --environment bad.toml --depth 1 --out x
printf '[[soma]]\nat = [1, 2, 3]\nradius = 5\n' >flat.toml
fails_with 1 'say where with --at' $BRAINFOREST grow --grammar tufted --environment flat.toml --depth 1 --out x
$BRAINFOREST grow --grammar tufted --environment flat.toml --at 0,0,0 --out flat >/dev/null
fails_with 1 'give --at X,Y,Z or --depth UM' $BRAINFOREST grow --grammar tufted --environment "$cortex" --out x
fails_with 1 'column-1000' $BRAINFOREST grow --grammar tufted --environment nowhere.toml --depth 1 --out x
fails_with 2 'no place' $BRAINFOREST grow --grammar tufted --environment "$cortex" --at 1,2 --out x
fails_with 2 'no place' $BRAINFOREST grow --grammar tufted --environment "$cortex" --at 1,2,nan --out x
fails_with 2 '' $BRAINFOREST grow --grammar tufted --environment "$cortex" --at 1,2,3 --depth 4 --out x
fails_with 2 '' $BRAINFOREST grow --grammar tufted --depth 4 --out x
[ ! -e x ]

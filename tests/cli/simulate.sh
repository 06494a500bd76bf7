# SPDX-License-Identifier: Apache-2.0
# The example: a planted column simulated by NEURON, its report packed and clamped. Skipped where NEURON is missing.
trap 'echo "failed in line $LINENO: $BASH_COMMAND"' ERR
program=$BRAINFOREST
unset DISPLAY  # NEURON opens windows where there is one
if ! /usr/bin/python3 -c 'import neuron, h5py' 2>/dev/null; then
  echo "simulate.sh: python3-neuron or python3-h5py is not installed; ./dev setup installs them"
  [ "${BRAINFOREST_REQUIRE_DATA:-0}" = 1 ] && exit 1
  exit 77
fi
examples=$FOREST_SOURCE_DIR/examples

"$program" grow --grammar pyramidal --count 4 --seed 1 --repo cells.db >/dev/null
"$program" grow --grammar purkinje --count 2 --seed 1 --repo cells.db >/dev/null
"$program" plant --recipe "$examples/column-20.toml" --repo cells.db --seed 3 --out column >/dev/null
/usr/bin/python3 "$examples/simulate_column.py" column --out run --ms 30 >simulated.txt 2>err.txt || { cat err.txt; exit 1; }
grep -q '^20 neurons, [0-9]* compartments, 300 rows' simulated.txt
[ ! -e run/compartments.h5.part ]
if /usr/bin/python3 "$examples/simulate_column.py" column --out no --ms 1 --step .04 2>err.txt; then exit 1; fi
grep -q 'must be a multiple of --dt' err.txt && [ ! -e no ]
"$program" activity run/compartments.h5 --circuit column --spikes run/spikes.h5 --out run.activity --json >packed.json
"$program" clamp run.activity --neuron 0 7 19 --csv traces.csv >/dev/null
"$program" raster run.activity --out raster.png >/dev/null
/usr/bin/python3 - <<'PY'
import csv, h5py, json
packed = json.load(open("packed.json"))
assert packed["neurons"] == 20 and packed["steps"] == 300 and packed["spikes"] > 0, packed
assert packed["not_numbers"] == packed["clamped"] == 0, packed
with h5py.File("run/compartments.h5") as file:
    report = file["report/column-20"]
    first, data = report["mapping/index_pointers"][:], report["data"]
    somata = [int(first[node]) for node in (0, 7, 19)]
    rows = list(csv.reader(open("traces.csv")))[1:]
    worst = max(abs(float(row[k + 1]) - data[i, somata[k]]) for i, row in enumerate(rows) for k in range(3))
    assert worst <= .3, worst
    assert data[:].max() > 0 and data[0].max() < -60, "nothing spikes"
PY

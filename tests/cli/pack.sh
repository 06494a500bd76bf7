#!/usr/bin/env bash
# Packing neurons that do not fit into memory; killed, failing and without room it leaves nothing behind.
set -euo pipefail
source "$FOREST_SOURCE_DIR/tests/words.sh"

small_forest 4
mkdir out
"$program" pack circuit -o out/a.forest --json >a.json
told a.json '0 < d["segments"] < d["planted_segments"] and d["seconds"] > 0 and d["peak_bytes"] > 1e6'
told a.json 'abs(d["segments_per_second"] * d["seconds"] / d["segments"] - 1) < 1e-6 and 3 < d["distinct"] <= 12'
told a.json "d['bytes'] == $(stat -c %s out/a.forest)"
"$program" pack circuit -o out/b.forest --threads 1 >/dev/null
cmp out/a.forest out/b.forest || fail "the bytes depend on the number of threads"
"$program" pack circuit -o /dev/stdout 2>/dev/null | head -c "$(stat -c %s out/a.forest)" | cmp - out/a.forest || fail "a stream gets other bytes"
rm out/b.forest

# A morphology that is no neuron: one sentence that names it, and the old file stays.
cp -r circuit bad
victim=$(ls bad/morphologies | tail -1)
echo "1 1 0 0 0 five -1" >"bad/morphologies/$victim"
sum=$(sha256sum <out/a.forest)
refuses "$victim:1" "$program" pack bad -o out/a.forest
[[ $sum == $(sha256sum <out/a.forest) && $(ls out) == a.forest ]] || fail "a failure left something behind"

# No room: the limit on the size of files stands for a full disk.
(ulimit -f 2000; refuses "disk has room" "$program" bench pack --neurons 500 --folder out)
[[ $(ls out) == a.forest ]] || fail "without room $(ls out) was left"

# Killed in the middle, while its files grow.
"$program" bench pack --neurons 100000 --folder out >/dev/null 2>&1 &
pid=$!
for ((i = 0; i < 400; ++i)); do
  grown=$(stat -Lc %s /proc/$pid/fd/* 2>/dev/null | sort -n | tail -1 || true)
  ((${grown:-0} > 20000000)) && break
  sleep 0.05
done
kill -9 $pid
wait $pid 2>/dev/null || true
((${grown:-0} > 20000000)) || fail "it did not begin to write within twenty seconds"
[[ $(ls out) == a.forest ]] || fail "killed, it left $(ls out)"

# A file of 500 MB by a program that may have 300 MB of memory of its own.
(ulimit -d 300000; "$program" bench pack --neurons 3000 --folder out --threads 2 --json) >large.json
told large.json 'd["bytes"] > 4e8 and d["peak_bytes"] < 2e8 and d["neurons"] == 3000'
[[ $(ls out) == a.forest ]] || fail "the benchmark left $(ls out)"
echo "pack.sh: all is well"

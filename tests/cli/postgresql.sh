# SPDX-License-Identifier: Apache-2.0
# The same verbs on a PostgreSQL server, one of its own.
trap 'echo "failed in line $LINENO: $BASH_COMMAND"' ERR
folder=$(mktemp -d)
trap '"$FOREST_SOURCE_DIR/tests/postgresql.sh" stop "$folder"' EXIT
port=$("$FOREST_SOURCE_DIR/tests/postgresql.sh" start "$folder") || { [ -n "${BRAINFOREST_REQUIRE_DATA-}" ] && exit 1; exit 77; }
psql -X -q -h 127.0.0.1 -p "$port" -U forest -d postgres -c 'create database cells'
repo=postgresql://forest@127.0.0.1:$port/cells
json() { python3 -c "import json,sys; d=json.load(sys.stdin); print($1)"; }

$BRAINFOREST grow --grammar motoneuron --count 5 --seed 2 --out cells/ >out.txt
for grammar in pyramidal purkinje motoneuron; do $BRAINFOREST grow --grammar $grammar --count 2 --seed 1 --repo "$repo" >out.txt; done
$BRAINFOREST import cells --repo "$repo" --population traced --type "alpha 'moto'" >out.txt
$BRAINFOREST import cells --repo "$repo" --population traced >again.txt
grep -q '^0 stored, 5 already there' again.txt
[ "$($BRAINFOREST list --repo "$repo" --json | json 'len(d["neurons"])')" = 11 ]
[ "$($BRAINFOREST list --repo "$repo" --where "type = 'alpha ''moto''' and total_length > 0" --json | json 'len(d["neurons"])')" = 5 ]
$BRAINFOREST show motoneuron-2-00000 --repo "$repo" >out.txt
$BRAINFOREST measure --repo "$repo" --population traced --csv cells.csv >out.txt
$BRAINFOREST export --repo "$repo" --population traced --out exported >out.txt
for cell in cells/*; do cmp "$cell" "exported/$(basename "$cell")"; done
$BRAINFOREST plant --recipe column-1000 --repo "$repo" --seed 7 --out circuit >out.txt
# An independent reader, and a question that would write.
[ "$(psql -X -At -h 127.0.0.1 -p "$port" -U forest -d cells -c "select count(*) from neuron where population = 'traced'")" = 5 ]
! $BRAINFOREST query "delete from neurons" --repo "$repo" 2>err.txt
grep -q 'read and not write' err.txt
[ "$($BRAINFOREST query "select count(*), avg(value) from metric where metric = 'total_length'" --repo "$repo" --json | json 'd["rows"][0][0]')" = 11 ]
$BRAINFOREST check --repo "$repo" | grep -q 'all is well'

# SPDX-License-Identifier: Apache-2.0
# brainforest check --repo: whatever follows from a neuron's points and says something else is found, and told with the
# neuron, the column and both values.
trap 'echo "failed in line $LINENO: $BASH_COMMAND"' ERR

printf '# CREATURE rat\n1 1 0 0 0 5 -1\n2 3 0 5 0 1 1\n3 3 0 15 0 1 2\n4 3 5 20 0 1 3\n5 3 -5 20 0 1 3\n6 2 0 -5 0 1 1\n7 2 0 -25 0 1 6\n' >plain.swc
{ echo '# Brain Forest SWC 1 (INCF v1)'; echo '# FOREST_SPINE 0 4 1 0 0 .5 .1 2'; grep -v '^#' plain.swc; } >spiny.swc
$BRAINFOREST import plain.swc spiny.swc --repo cells.db >/dev/null
[ "$($BRAINFOREST check --repo cells.db)" = 'cells.db: all is well' ]

finds() {  # the change, the words
  local got=0
  cp cells.db hurt.db
  sqlite3 hurt.db "$1"
  $BRAINFOREST check --repo hurt.db >out.txt 2>err.txt || got=$?
  [ "$got" = 1 ] && grep -qE -- "$2" err.txt || { echo "status $got of: $1"; cat err.txt; exit 1; }
}
one="neuron 'plain' \(id 1\) is not what its points say"
finds 'update sections set length_pm = 1 where id >> 24 = 1' "$one \(length_pm of sections is 1 in row 0, not 10000000, and 3 more values\); take it out with"
grep -q 'hurt.db: 1 finding' err.txt
finds 'update sections set length_pm = 1' "neuron 'spiny' .* \(length_pm of sections is 1 in row 0, not 10000000, and 3 more values\)"
grep -q 'hurt.db: 2 findings' err.txt
for column in arbor branch_order daughters area_nm2 start_diameter_pm end_diameter_pm end_x_pm end_y_pm end_z_pm; do
  finds "update sections set $column = $column + 3 where id = (1 << 24) + 2" "$one \($column of sections is [^ ]+ in row 2, not [^ ]+\);"
done
for column in stems points spines length; do
  finds "update neurons set $column = $column + 1 where id = 1" "$one \($column of neurons is "
done
for column in x y z radius area; do
  finds "update somata set $column = $column + 1 where neuron = 1" "$one \($column of somata is "
done
for column in root kind sections terminals max_order length; do
  finds "update arbors set $column = $column + 1 where neuron = 1 and number = 1" "$one \($column of arbors is [^ ]+ in row 1, not "
done
finds 'update neuron_metrics set value = value + 1 where neuron = 1 and metric = 3' "$one \(value of neuron_metrics is "
finds 'delete from neuron_metrics where neuron = 1 and metric = 3' "$one \(neuron_metrics has [0-9]+ rows, not [0-9]+\)"
finds 'delete from arbors where neuron = 1 and number = 1' "$one \(arbors has 1 rows, not 2\)"
finds 'update spines set position = position + 1' "neuron 'spiny' \(id 2\) is damaged"
# What was not known when a neuron was stored is not missed.
cp cells.db older.db
sqlite3 older.db 'delete from neuron_metrics where metric = (select max(id) from metrics); delete from metrics where id = (select max(id) from metrics)'
[ "$($BRAINFOREST check --repo older.db)" = 'older.db: all is well' ]

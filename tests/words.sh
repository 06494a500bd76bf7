# SPDX-License-Identifier: Apache-2.0
# Words that the scripts of tests/cli share: source "$FOREST_SOURCE_DIR/tests/words.sh"

# What Python in a script may import: tests/*.py, without leaving files beside them.
export PYTHONPATH="$FOREST_SOURCE_DIR/tests" PYTHONDONTWRITEBYTECODE=1

program=$BRAINFOREST

fail() { echo "$(basename "$0"): $*" >&2; exit 1; }

# A command ends with this status and says these words. What it said stays in out.txt and err.txt.
fails_with() {  # status, words, command…
  local status=$1 words=$2 got=0
  shift 2
  "$@" >out.txt 2>err.txt || got=$?
  [ "$got" = "$status" ] || { echo "status $got, not $status: $*"; cat err.txt; exit 1; }
  grep -qF -- "$words" err.txt || { echo "no '$words' from: $*"; cat err.txt; exit 1; }
  ! grep -qE 'json\.exception|[0-9]{30}' err.txt || { echo "not our own words: $*"; cat err.txt; exit 1; }
}

# A command ends with status 1 and says these words in one sentence, and nothing else.
refuses() {  # words, command…
  fails_with 1 "$@"
  [ "$(wc -l <err.txt)" = 1 ] || { echo "more than a sentence from: ${*:2}"; cat err.txt; exit 1; }
}

# A statement in Python about `d`, what a JSON file holds, is true.
told() {  # file, statement
  /usr/bin/python3 -c "import json, sys; d = json.load(open('$1')); sys.exit(not ($2))" || fail "$1: not so: $2"
}

# a.forest: a column of a thousand neurons of the three built-in grammars, so many distinct ones each.
small_forest() {  # how many
  local grammar
  for grammar in pyramidal purkinje motoneuron; do "$program" grow --grammar $grammar --count "$1" --seed 1 --repo r.db >/dev/null; done
  "$program" plant --recipe column-1000 --repo r.db --seed 7 --out circuit >/dev/null
  "$program" pack circuit -o a.forest >/dev/null
}

# two_cells POPULATION RADIUS: two neurons into the population of cells.db, the soma away from the origin.
two_cells() {
  local i
  for i in 1 2; do
    cat >$1-$i.swc <<SWC
1 1 10 20 30 $(($2 + i)) -1
2 3 10 3$i 30 1 1
3 3 10 9$i 30 1 2
4 3 60 15$i 30 .5 3
5 3 -40 14$i 50 .5 3
SWC
  done
  $BRAINFOREST import $1-*.swc --repo cells.db --population $1 >import.txt
}

# SPDX-License-Identifier: Apache-2.0
# brainforest model: what neurons grow from is kept in versions; none is changed, none is lost unasked.
set -E
trap 'echo "failed in line $LINENO: $BASH_COMMAND"' ERR

source "$FOREST_SOURCE_DIR/tests/words.sh"
short() {  # as fails_with, in two lines at most
  fails_with "$@"
  [ "$(wc -l <err.txt)" -le 2 ] || { echo "not a sentence: ${*:3}"; cat err.txt; exit 1; }
}
json() { python3 -c "import json,sys; d=json.load(sys.stdin); print($1)"; }

check_verbs() {  # of the empty repository $1, in the folder of the same verbs
  local repo=$1 model="$BRAINFOREST model"
  cat >bush.lsys <<'TEXT'
# A bush.
steps: 5
#define half 0.5
distribution ratio = truncnormal(half, 0.1, 0.2, 1)  # of diameters
distribution turn = uniform(20, 40)
axiom: Soma(10) Basal !(2) A(2)
grow: A(d) { r = ratio() } -> F(10, d) [ +(turn()) A(r * d) ] -(turn()) A(d)
TEXT

  # import: the same text is the same version, a changed one the next.
  $model import bush.lsys pyramidal --repo "$repo" --population L5 >out.txt
  [ "$($model import bush.lsys --repo "$repo" --json | json 'd["models"][0]')" = "{'name': 'bush', 'version': 1, 'already_there': True}" ]
  sed -i 's/uniform(20, 40)/uniform(10, 50)/' bush.lsys
  [ "$($model import bush.lsys --repo "$repo" --json | json 'd["models"][0]["version"]')" = 2 ]
  # A file as export writes it is a text of that model, whatever program reads it; the mark of Windows' editors is none of it.
  $model export bush@1 bush@2 --repo "$repo" --out exported >/dev/null
  { printf '\xef\xbb\xbf'; cat exported/bush@2.lsys; } >bush@2.lsys
  [ "$($model import exported/bush@2.lsys bush@2.lsys --repo "$repo" --json | json '[(m["name"], m["version"]) for m in d["models"]]')" = "[('bush', 2), ('bush', 2)]" ]
  rm -r exported bush@2.lsys
  cp bush.lsys second.lsys
  [ "$($model list --repo "$repo" --json | json '[(m["name"], m["version"], m["population"], len(m["distributions"]) > 0, m["origin"]) for m in d]')" = \
    "[('bush', 2, 'L5', True, 'from bush.lsys'), ('pyramidal', 1, 'L5', True, 'the built-in grammar pyramidal')]" ]
  [ "$($model list --repo "$repo" --all --json | json 'len(d)')" = 3 ]
  [ "$($model list --repo "$repo" --population none --json | json 'd')" = '[]' ]
  $model list --repo "$repo" | grep -q '^bush  *2  L5  *2  *0  from bush.lsys$'

  # show: the text, to the byte; of a distribution with all it needs; it kept its version where only the other changed.
  $model show bush --repo "$repo" | cmp - second.lsys
  $model show bush@1 --repo "$repo" | sed 's/uniform(20, 40)/uniform(10, 50)/' | cmp - second.lsys
  [ "$($model show bush.ratio --repo "$repo")" = $'#define half 0.5\ndistribution ratio = truncnormal(half, 0.1, 0.2, 1)  # of diameters' ]
  [ "$($model show bush@2 --repo "$repo" --json | json '[(x["name"], x["version"]) for x in d[0]["distributions"]]')" = "[('bush.ratio', 1), ('bush.turn', 2)]" ]
  [ "$($model show bush.turn@1 --repo "$repo")" = 'distribution turn = uniform(20, 40)' ]
  [ "$($BRAINFOREST query "select text from distribution where name = 'bush.turn' and version = 2" --repo "$repo" --json | json 'd["rows"][0][0]')" = 'distribution turn = uniform(10, 50)' ]
  short 1 "there is no model 'shrub'; those that are there: bush, pyramidal" $model show shrub --repo "$repo"
  short 1 "model 'bush' has no version 3; its newest is 2" $model show bush@3 --repo "$repo"

  # edit: what the editor leaves is the next version; as it was, no grammar, or an editor that fails: nothing.
  EDITOR="sed -i 's/^steps:.*/steps: 7/'" $model edit bush@1 --repo "$repo" >out.txt
  grep -q '^bush  *3  stored$' out.txt
  [ "$($model show bush --repo "$repo")" = "$(sed 's/^steps:.*/steps: 7/; s/uniform(10, 50)/uniform(20, 40)/' second.lsys)" ]
  [ "$($model list --repo "$repo" --json | json '[(m["origin"], m["population"]) for m in d if m["name"] == "bush"]')" = "[('edited from version 1', 'L5')]" ]
  EDITOR=true $model edit bush --repo "$repo" | grep -q 'bush@3 is as it was; nothing is stored'
  short 1 'the editor ended with an error, so nothing is stored' env EDITOR=false $BRAINFOREST model edit bush --repo "$repo"
  EDITOR=true $model edit bush --repo "$repo" --population L6 --json | grep -q '"version": 4'
  EDITOR='sed -i "1s/.*/# A bush of layer 5/"' $model edit bush@3 --repo "$repo" >out.txt
  [ "$($model list --repo "$repo" --all --json | json '[m["population"] for m in d if m["name"] == "bush"]')" = "['L5', 'L5', 'L5', 'L6', 'L5']" ]
  mkdir -p passing
  short 1 'nothing is stored and the text is kept' env TMPDIR="$PWD/passing" EDITOR='sed -i s/^axiom/axion/' $BRAINFOREST model edit bush --repo "$repo"
  grep -q 'bush.lsys:6' err.txt
  grep -q '^axion' passing/*/bush.lsys
  [ "$($model list --repo "$repo" --all --json | json 'len(d)')" = 6 ]

  # diff: what patch reads, of two versions or of the last step.
  [ "$($model diff bush@1 bush@2 --repo "$repo")" = '--- bush@1
+++ bush@2
@@ -2,6 +2,6 @@
 steps: 5
 #define half 0.5
 distribution ratio = truncnormal(half, 0.1, 0.2, 1)  # of diameters
-distribution turn = uniform(20, 40)
+distribution turn = uniform(10, 50)
 axiom: Soma(10) Basal !(2) A(2)
 grow: A(d) { r = ratio() } -> F(10, d) [ +(turn()) A(r * d) ] -(turn()) A(d)' ]
  $model diff bush@3 --repo "$repo" >step.txt
  [ "$(grep -c '^[-+][^-+]' step.txt)" = 4 ]
  $model diff bush@4 bush@3 --repo "$repo" | grep -q 'are the same text'
  [ "$($model diff bush --repo "$repo" --json | json 'd["from"]["version"], d["to"]["version"], d["diff"][:10]')" = '4 5 --- bush@4' ]
  short 1 'pyramidal@1 has no version before it' $model diff pyramidal --repo "$repo"

  # export, and back: nothing new. A file that holds something else stays.
  $model export --repo "$repo" --out models >out.txt
  [ "$(ls models)" = $'bush.lsys\npyramidal.lsys' ]
  $model export bush@1 bush@2 --repo "$repo" --out models >out.txt
  cmp models/bush@2.lsys second.lsys
  [ "$($model import models/bush.lsys models/pyramidal.lsys --repo "$repo" --json | json '[m["already_there"] for m in d["models"]]')" = '[True, True]' ]
  echo '# mine' >>models/bush.lsys
  short 1 'is there and holds something else' $model export --repo "$repo" --out models
  tail -1 models/bush.lsys | grep -q mine
  $model export --repo "$repo" --out models --force >out.txt
  ! grep -q mine models/bush.lsys

  # One that is no grammar among good ones: none is stored, and its line is told.
  printf 'axiom: A\ngrow: A -> B(\n' >bad.lsys
  sed 's/uniform(20, 40)/uniform(0, 1)/' models/bush.lsys >good.lsys
  short 1 'bad.lsys:2' $model import good.lsys bad.lsys --repo "$repo"
  short 1 'missing.lsys: there is no such grammar' $model import good.lsys missing.lsys --repo "$repo"
  head -c 2000 /dev/urandom >noise.lsys
  short 1 'noise.lsys' $model import noise.lsys --repo "$repo"
  short 2 '--name is for one file' $model import good.lsys bush.lsys --name other --repo "$repo"
  [ "$($model list --repo "$repo" --all --json | json 'len(d)')" = 6 ]

  # What neurons are grown from is a model as if it had been imported.
  $BRAINFOREST grow --grammar motoneuron --count 1 --repo "$repo" >out.txt
  [ "$($model import motoneuron --repo "$repo" --json | json 'd["models"][0]["already_there"]')" = True ]
  [ "$($model list --repo "$repo" --json | json '[len(m["distributions"]) for m in d if m["name"] == "motoneuron"]')" = '[3]' ]

  # A model grows neurons, which name it; growing makes no version of a text that is there.
  $BRAINFOREST grow --model bush@2 --count 3 --seed 1 --repo "$repo" --out grown >out.txt
  $BRAINFOREST grow --grammar second.lsys --count 3 --seed 1 --out same >out.txt
  cmp <(grep -v '^#' grown/bush-1-00002.swc) <(grep -v '^#' same/second-1-00002.swc)
  [ "$($model list --repo "$repo" --all --json | json '[m["neurons"] for m in d if m["name"] == "bush"]')" = '[0, 3, 0, 0, 0]' ]
  short 1 "there is no model 'shrub'" $BRAINFOREST grow --model shrub --repo "$repo"
  short 2 '--repo' $BRAINFOREST grow --model bush --out x
  $BRAINFOREST check --repo "$repo" | grep -q 'all is well'

  # The questions of the page are answered.
  python3 - "$FOREST_SOURCE_DIR/docs/repository/knowledge.md" >questions <<'PY'
import re, sys
for block in re.findall("```sql(.*?)```", open(sys.argv[1]).read(), re.S):
    for question in block.split(";")[:-1]:
        print(" ".join(re.sub("--.*", "", question).split()).replace("pyramidal", "bush").replace("motoneuron", "bush"))
PY
  [ "$(wc -l <questions)" = 3 ]
  while read -r question; do $BRAINFOREST query "$question" --repo "$repo" >>answers.txt; done <questions
  grep -q '^bush-1-00001' answers.txt
  grep -q '^5 rows' answers.txt

  # Hostile names and texts.
  { cat bush.lsys; printf '# \033[31mred\007 \xff\r\n'; } >odd.lsys
  $model import odd.lsys --name "'); drop table models; --" --repo "$repo" >out.txt
  $model show "'); drop table models; --" --repo "$repo" >odd.txt
  ! grep -q $'[\033\007]' odd.txt
  $model export "'); drop table models; --" --repo "$repo" --out odd >out.txt
  cmp odd/* odd.lsys
  $model list --repo "$repo" | grep -q 'drop table models'

  # remove: the newest version, one that is named, or all; neurons keep what they grew from. All that are named or none.
  $model remove "'); drop table models; --" --repo "$repo" | grep -q '^1 version removed from'
  short 1 "there is no model 'shrub'; those that are there: bush, motoneuron, pyramidal" $model remove bush shrub --repo "$repo"
  short 1 "model 'bush' has no version 9" $model remove bush@9 --repo "$repo"
  short 1 "'bush@2' is one version" $model remove bush@2 --all --repo "$repo"
  short 2 'what is given is empty' $model remove '' --repo "$repo"
  short 2 '--repo' $model remove bush
  short 2 'names' $model remove --repo "$repo"
  [ "$($model list --repo "$repo" --all --json | json '[m["version"] for m in d if m["name"] == "bush"]')" = '[1, 2, 3, 4, 5]' ]
  [ "$($model remove bush bush@2 bush bush@5 --repo "$repo" --json | json '[(m["version"], m["neurons"]) for m in d["removed"]]')" = '[(2, 3), (5, 0)]' ]
  [ "$($model list --repo "$repo" --all --json | json '[m["version"] for m in d if m["name"] == "bush"]')" = '[1, 3, 4]' ]
  [ "$($model diff bush@3 --repo "$repo" --json | json 'd["from"]["version"]')" = 1 ]
  [ "$($BRAINFOREST query "select version from distribution where name = 'bush.turn' and population = 'L5' order by version" --repo "$repo" --json | json 'd["rows"]')" = '[[1], [3]]' ]
  $BRAINFOREST check --repo "$repo" | grep -q 'all is well'
  $BRAINFOREST export bush-1-00002 --repo "$repo" --out again >out.txt
  cmp <(grep -v '^#' grown/bush-1-00002.swc) <(grep -v '^#' again/bush-1-00002.swc)
  $model remove bush --all --repo "$repo" >out.txt
  short 1 "there is no model 'bush'" $model show bush --repo "$repo"
  [ "$($BRAINFOREST query "select count(*) from distribution where name like 'bush.%'" --repo "$repo" --json | json 'd["rows"][0][0]')" = 0 ]
  [ "$($BRAINFOREST query "select count(*) from provenance o join grammars g on g.id = o.grammar where g.name = 'bush'" --repo "$repo" --json | json 'd["rows"][0][0]')" = 3 ]
  $BRAINFOREST check --repo "$repo" | grep -q 'all is well'
  [ "$($model import bush.lsys --repo "$repo" --json | json 'd["models"][0]["version"]')" = 1 ]
}

mkdir file && cd file
check_verbs cells.db
short 1 'no such repository' $BRAINFOREST model list --repo none.db
short 1 'no such repository' $BRAINFOREST model edit bush --repo none.db
short 1 'no such repository' $BRAINFOREST model remove bush --repo none.db
[ ! -e none.db ]
cd ..

# The same on a server, when there is one here.
folder=$(mktemp -d)
trap '"$FOREST_SOURCE_DIR/tests/postgresql.sh" stop "$folder"' EXIT
port=$("$FOREST_SOURCE_DIR/tests/postgresql.sh" start "$folder") || { [ -n "${BRAINFOREST_REQUIRE_DATA-}" ] && exit 1; exit 0; }
psql -X -q -h 127.0.0.1 -p "$port" -U forest -d postgres -c 'create database cells'
mkdir server && cd server
check_verbs "postgresql://forest@127.0.0.1:$port/cells"

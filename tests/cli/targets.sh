#!/usr/bin/env bash
# Targets: listed, defined, written as SONATA's node sets, shown and hidden in pictures.
set -euo pipefail
source "$FOREST_SOURCE_DIR/tests/words.sh"

small_forest 3

"$program" targets a.forest --json >list.json
told list.json '{t["name"]: t["neurons"] for t in d["targets"]}["all"] == d["neurons"] == 1000'
told list.json 'sum(t["neurons"] for t in d["targets"] if t["origin"] == "layer") == 1000'
told list.json 'sum(t["neurons"] for t in d["targets"] if t["origin"] == "type") == 1000'
told list.json 'sum(t["neurons"] for t in d["targets"] if t["origin"] == "sign") == 1000'
told list.json '[t["name"] for t in d["targets"] if t["origin"] == "population"] == ["column-1000"]'

# Combined, edited, written, read again by us and by h5py's owner of the truth: the circuit's own file.
"$program" targets a.forest --define 'deep=(L5 or L6) and not inhibitory' --define 'top={"y":{"$gt":1300}}' \
  --define 'either=deep or top' --out sets.json >/dev/null
told sets.json 'd["either"] == ["deep", "top"] and d["top"] == {"y": {"$gt": 1300.0}} and d["deep"]["population"] == "column-1000"'
/usr/bin/python3 - <<'PY' || fail "the nodes of a set are not those of the circuit's file"
import csv, json, h5py
nodes = h5py.File("circuit/nodes.h5")["nodes/column-1000"]
group = nodes["0"]
layers = [group["@library/layer"].asstr()[i] for i in group["layer"]]
types = {row["node_type_id"]: row for row in csv.DictReader(open("circuit/node_types.csv"), delimiter=" ")}
sign = [types[str(t)]["ei"] for t in nodes["node_type_id"]]
deep = [int(i) for i in nodes["node_id"] if layers[i] in ("L5", "L6") and sign[i] == "e"]
assert json.load(open("sets.json"))["deep"]["node_id"] == deep and deep, "deep"
PY
"$program" targets a.forest --node-sets sets.json --members 'either and not deep' --json >members.json
/usr/bin/python3 - <<'PY' || fail "wrong members"
import json, h5py
y = h5py.File("circuit/nodes.h5")["nodes/column-1000/0/y"][:]
deep = set(json.load(open("sets.json"))["deep"]["node_id"])
assert json.load(open("members.json"))["members"] == {"column-1000": [i for i in range(1000) if y[i] > 1300 and i not in deep]}
PY
"$program" targets a.forest --node-sets sets.json --remove either --out fewer.json >/dev/null
told fewer.json 'sorted(d) == ["deep", "top"]'
refuses "fewer.json" "$program" targets a.forest --node-sets sets.json --out fewer.json
"$program" targets a.forest --node-sets sets.json --out fewer.json --force >/dev/null
cmp sets.json fewer.json || fail "node sets are not written as they were read"

# In pictures.
view='"eye":[1700,1500,1900],"target":[0,1300,0],"samples":2'
draw() { "$program" render a.forest --size 200x150 -o "$1.png" --json "${@:2}" >"$1.json"; }
draw all --view "{$view}"
draw only --view "{$view}" --only L2 --node-sets sets.json --hide "top and inhibitory"
draw shown --view "{$view,\"targets\":[{\"name\":\"all\",\"visible\":false},{\"name\":\"L2\",\"visible\":true},{\"name\":\"top and inhibitory\",\"visible\":false}]}" --node-sets sets.json
cmp only.png shown.png || fail "--only and --hide are not what the view says"
told only.json '0 < d["neurons"] <= 218 and d["segments"] > 0'
told all.json 'd["neurons"] > 218'
draw clear --view "{$view,\"targets\":[{\"name\":\"all\",\"opacity\":0.3,\"kind\":\"lines\",\"colour\":\"#ff8800\"}]}"
told clear.json 'd["view"]["targets"] == [{"name": "all", "colour": "#ff8800", "kind": "lines", "opacity": 0.3}]'
/usr/bin/python3 -c 'import json; assert json.load(open("clear.json"))["covered"] < .9 * json.load(open("all.json"))["covered"]' ||
  fail "what is transparent covers as much as what is not"
"$program" movie a.forest --seconds 0.1 --size 160x90 --samples 1 --only L4 -o walk.mp4 >/dev/null
# An empty target is said, not shown as a black picture without a word.
said=$("$program" render a.forest --size 64x64 -o none.png --only L1 2>&1 >/dev/null)
[[ $said == *"no neuron belongs to the target 'L1'"* ]] || fail "an empty target: '$said'"
"$program" bench targets --neurons 200 --repeats 2 --size 160x90 --json >bench.json
told bench.json 'd["worst_milliseconds"] > 0 and len(d["changes"]) >= 8 and all(c["picture_changed"] > 0 for c in d["changes"])'

refuses "no target 'L7'" "$program" render a.forest --only L7 -o x.png
refuses "is no set of neurons" "$program" render a.forest --only "L2 and" -o x.png
refuses "'opacty' is no key" "$program" render a.forest --view "{$view,\"targets\":[{\"name\":\"all\",\"opacty\":1}]}" -o x.png
refuses "no neuron 1000" "$program" render a.forest --view "{$view,\"targets\":[{\"neuron\":1000,\"visible\":false}]}" -o x.png
echo '{"a": ["b"], "b": ["a"], "c": {"etype": "x"}}' >bad.json
refuses "'a' → 'b' → 'a'" "$program" render a.forest --node-sets bad.json --only a -o x.png
refuses "asks for 'etype'" "$program" render a.forest --node-sets bad.json --only c -o x.png
refuses "'etype'" "$program" targets a.forest --node-sets bad.json --members c
[[ $("$program" targets a.forest --node-sets bad.json 2>/dev/null | grep -c '?$') == 3 ]] || fail "sets that cannot be used are not listed as such"
printf '{"a": {"layer": 5},\n "b" {}}' >slip.json
refuses "slip.json:2: is no JSON" "$program" targets a.forest --node-sets slip.json

# A circuit that names its node sets brings them along; a file of them that cannot be read stops nobody.
cp -r circuit with
cp sets.json with/sets.json
sed -i '0,/{/s//{ "node_sets_file": "$BASE_DIR\/sets.json",/' with/circuit_config.json
"$program" pack with -o with.forest >/dev/null 2>err.txt
[[ ! -s err.txt ]] || fail "packing said $(cat err.txt)"
"$program" targets with.forest --members 'either and not deep' --json >own.json
told own.json 'd["members"] == json.load(open("members.json"))["members"] and d["members"]'
"$program" render with.forest --only deep --size 64x64 -o own.png >/dev/null
rm own.png
echo '{"deep": {"layer": "L2"}}' >more.json
"$program" targets with.forest --node-sets more.json --members deep --json >replaced.json 2>err.txt
grep -q "more.json replaces the node set 'deep' of the forest" err.txt || fail "it is not said that a set is replaced"
told replaced.json 'sum(map(len, d["members"].values())) == next(t["neurons"] for t in json.load(open("list.json"))["targets"] if t["name"] == "L2")'
for broken in '{"deep"' '{"deep": 3}'; do
  echo "$broken" >with/sets.json
  "$program" pack with -o without.forest >/dev/null 2>err.txt
  grep -q "sets.json.*; the forest file has none of these node sets" err.txt || fail "nothing is said of $broken"
done
truncate -s 1G with/sets.json
"$program" pack with -o without.forest >/dev/null 2>err.txt
grep -q "sets.json: has 1024 MB.*; the forest file has none of these node sets" err.txt || fail "nothing is said of a gigabyte"
rm with/sets.json
"$program" pack with -o without.forest >/dev/null 2>err.txt
grep -q "cannot be opened.*; the forest file has none of these node sets" err.txt || fail "nothing is said of sets that are missing"
[[ $(wc -l <err.txt) == 1 ]] || fail "sets that are missing take more than a sentence"
cmp without.forest a.forest || fail "sets that cannot be read change the forest file"
for odd in 7 '"$NOWHERE\/sets.json"'; do
  sed "s/\"node_sets_file\": [^,]*,/\"node_sets_file\": $odd,/" with/circuit_config.json >with/odd.json
  "$program" pack with/odd.json --verbose -o without.forest >/dev/null 2>err.txt
  grep -q '"node_sets_file".*; the circuit has no node sets' err.txt || fail "nothing is said of $odd"
  cmp without.forest a.forest || fail "sets without a file change the forest file"
done
# Whatever the circuit's files tell of its neurons can be asked for: arrays of the nodes file, with a library or without, and
# columns of the types; a set that asks for what nobody tells is named, the others work.
cp -r circuit rich
/usr/bin/python3 - <<'PY' || fail "the circuit cannot be enriched"
import h5py, json, numpy
with h5py.File("rich/nodes.h5", "a") as file:
    group = file["nodes/column-1000/0"]
    group["minicolumn"] = numpy.arange(1000) % 40
    group["score"] = numpy.where(numpy.arange(1000) % 5, numpy.arange(1000) / 1000, numpy.nan)
    group["region"] = numpy.arange(1000) % 3
    group.create_dataset("@library/region", data=["S1FL", "S1HL", "V1"], dtype=h5py.string_dtype())
    group.create_dataset("tag", data=[f"t{i % 7}" for i in range(1000)], dtype=h5py.string_dtype())
rows = open("rich/node_types.csv").read().splitlines()
rows = [row + (" etype" if i == 0 else " bAC" if i % 2 else " cNAC") for i, row in enumerate(rows)]
open("rich/node_types.csv", "w").write("\n".join(rows) + "\n")
json.dump({"mini": {"minicolumn": {"$gte": 10, "$lt": 12}}, "one": {"minicolumn": 7}, "some": {"score": {"$gt": .5}},
           "hand": {"region": {"$regex": "^S1"}}, "tags": {"tag": ["t1", "t2"]}, "etype": {"etype": "bAC"},
           "every": ["mini", "one"], "both": {"population": "column-1000", "region": "V1", "minicolumn": [3, 4]},
           "none": {"hemisphere": "left"}}, open("rich/sets.json", "w"))
PY
sed -i '0,/{/s//{ "node_sets_file": "$BASE_DIR\/sets.json",/' rich/circuit_config.json
"$program" pack rich -o rich.forest >/dev/null 2>err.txt
[[ ! -s err.txt ]] || fail "packing said $(cat err.txt)"
"$program" targets rich.forest --json >rich.json 2>err.txt
grep -q "the node set 'none' asks for 'hemisphere', which is not known" err.txt || fail "it is not said what a set lacks: $(cat err.txt)"
told rich.json '[t["name"] for t in d["targets"] if "problem" in t] == ["none"]'
for set in mini one some hand tags every both; do
  "$program" targets rich.forest --members $set --json >members-$set.json
done
/usr/bin/python3 - <<'PY' || fail "sets by other attributes have other members"
import json
wanted = {"mini": lambda i: i % 40 in (10, 11), "one": lambda i: i % 40 == 7, "some": lambda i: i % 5 and i > 500,
          "hand": lambda i: i % 3 < 2, "tags": lambda i: i % 7 in (1, 2), "every": lambda i: i % 40 in (7, 10, 11),
          "both": lambda i: i % 3 == 2 and i % 40 in (3, 4)}
for name, holds in wanted.items():
    assert json.load(open(f"members-{name}.json"))["members"]["column-1000"] == [i for i in range(1000) if holds(i)], name
targets = {t["name"]: t.get("neurons") for t in json.load(open("rich.json"))["targets"]}
assert 0 < targets["etype"] < 1000, targets
PY
"$program" render rich.forest --only "mini and hand" --size 64x64 -o rich.png >/dev/null
rm rich.png

refuses "no target 'deep'" "$program" targets without.forest --members deep

refuses "defines nothing" "$program" targets a.forest --define L2
refuses "no node set 'x'" "$program" targets a.forest --remove x
[[ ! -e x.png ]] || fail "a refused command left a file behind"
echo "targets.sh: all is well"

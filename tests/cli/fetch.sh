# SPDX-License-Identifier: Apache-2.0
# brainforest fetch, from a service on the loopback (tests/cell_service.py) that can behave badly. Nothing else is asked.
trap 'echo "failed in line $LINENO: $BASH_COMMAND"' ERR
for name in http_proxy https_proxy all_proxy HTTPS_PROXY ALL_PROXY; do unset "$name"; done
export XDG_CACHE_HOME=$PWD/cache_home
service=$FOREST_SOURCE_DIR/tests/cell_service.py

source "$FOREST_SOURCE_DIR/tests/words.sh"
json() { /usr/bin/python3 -c "import json,sys; d=json.load(sys.stdin); print($1)"; }
told_of() { grep -qE "^$1: .*$2" err.txt || { echo "no '$2' of $1"; cat err.txt; exit 1; }; }
requests() { grep -c "$1" log.jsonl || true; }

# Cells that we grew, under names that tell the service how to behave.
$BRAINFOREST grow --grammar motoneuron --count 5 --seed 3 --out grown >/dev/null
mkdir cells
for i in 0 1 2 3 4; do cp grown/motoneuron-3-0000$i.swc cells/plain-$i.swc; done
for trick in busy ill away gone page nonsense file circle moved short huge flood silent wrong cut changed weak slow liar; do
  cp grown/motoneuron-3-00000.swc cells/$trick-1.swc
done
sed -i 40G cells/plain-4.swc  # a blank line among the rows
mv cells/slow-1.swc slow.swc && for i in 1 2 3; do cat slow.swc; done | awk '{print} NR%3==0 {print "# a line that makes the file longer"}' >comments
{ cat slow.swc; sed 's/^/# /' comments; } >cells/slow-1.swc && cp cells/slow-1.swc cells/slow-2.swc

/usr/bin/python3 "$service" cells port log.jsonl & service_id=$!
trap 'kill $service_id' EXIT
for _ in $(seq 100); do [ -s port ] && break; sleep .1; done
from=http://127.0.0.1:$(cat port)
fetch() { timeout 60 $BRAINFOREST fetch --from "$from" --rate 200 "$@"; }

# By name and by number, into a folder: the very bytes, and what is said of the cell beside.
fetch plain-0 NMO_00016 plain-0 --out out >said.txt
grep -q '^2 fetched (0 of them from the cache), 0 failed$' said.txt
grep -q 'plain-0  *Test Lab  *rat  *neocortex, somatosensory  *thick-tufted, pyramidal  *[0-9]* .* fetched$' said.txt
cmp out/plain-1.swc cells/plain-1.swc  # the sixteenth, as the service counts
cmp out/plain-0.swc cells/plain-0.swc
[ "$(json 'd["record"]["reference_doi"], d["record"]["license"], d["bytes"]' <out/plain-0.json)" = "['10.1000/xyz'] CC BY 4.0 $(stat -c %s cells/plain-0.swc)" ]
grep -q '"User-Agent": "BrainForest/[0-9.]* (brainforest fetch)"' log.jsonl
[ "$(ls out | wc -l)" = 4 ]

# What is odd in the files is told by kind, and with --verbose one by one.
fetch plain-4 plain-0 --out odd >said.txt 2>err.txt
grep -q '^blank-line  *1  *1  *plain-4:41  *.*brainforest check --repair writes it so' said.txt
! grep -q blank-line err.txt
fetch plain-4 --out odd --verbose 2>err.txt >said.txt
grep -q '^plain-4:41: blank-line: ' err.txt

# What has come is not asked for again, also without a network; a damaged entry of the cache is.
before=$(requests .)
fetch plain-0 --out again | grep -q '^1 fetched (1 of them from the cache), 0 failed$'
fetch plain-0 --out out >/dev/null  # the same bytes may be written again
$BRAINFOREST fetch plain-0 --out offline --offline --from "$from" --json | json 'd["cells"][0]["outcome"]' | grep -qx 'from the cache'
cmp offline/plain-0.swc cells/plain-0.swc
fails_with 1 'not in the cache' $BRAINFOREST fetch plain-1 --out offline --offline --from "$from"
[ "$(requests .)" = "$before" ]
entry=$(grep -l 'plain-0.CNG.swc' cache_home/brainforest/*)
sed -i '2s/./x/' "$entry"
fails_with 1 'not in the cache' $BRAINFOREST fetch plain-0 --out offline --offline --from "$from"
fetch plain-0 --out again | grep -q '0 of them from the cache'
cmp again/plain-0.swc cells/plain-0.swc
head -c 900 "$entry" >cut && cp cut "$entry"
fetch plain-0 --out again >/dev/null && cmp again/plain-0.swc cells/plain-0.swc

# --refresh asks whether there is something newer, and gets it.
fetch plain-0 --out again --refresh >/dev/null
tail -1 log.jsonl | grep -q '"If-None-Match": "\\"'
cp out/plain-0.swc mine.swc && echo '# my own' >>again/plain-0.swc
fails_with 1 'holds something else' fetch plain-0 --out again
tail -1 again/plain-0.swc | grep -qx '# my own'
fetch plain-0 --out again --force >/dev/null && cmp again/plain-0.swc mine.swc

# A query, page after page, into a repository: metadata, annotations, provenance; again, and nothing changes.
fetch --query 'species:rat AND brain_region:neocortex' --limit 3 --repo r.db --population wild --json >said.json
[ "$(json 'd["fetched"], d["matching"], [c["name"] for c in d["cells"]]' <said.json)" = "3 131 ['plain-0', 'plain-1', 'plain-2']" ]
grep -q '"path": "/api/neuron/select?q=species%3Arat&fq=brain_region%3Aneocortex&page=0&size=3"' log.jsonl
[ "$(sqlite3 r.db "select count(*) from neuron where population = 'wild' and species = 'rat' and region = 'neocortex, somatosensory' and layer = 'layer 5' and type = 'thick-tufted, pyramidal'")" = 3 ]
[ "$(sqlite3 r.db "select value from annotations join neurons on id = neuron where neurons.name = 'plain-1' and annotations.name = 'reference_doi'")" = 10.1000/xyz ]
sqlite3 r.db 'select source_file from provenance' | grep -qx "$from/dableFiles/test%20lab/CNG%20version/plain-1.CNG.swc"
cp r.db r2.db
fetch --query 'species:rat AND brain_region:neocortex' --limit 5 --repo r.db --population wild | grep -c 'already there' | grep -qx 3
fetch --query 'species:rat AND brain_region:neocortex' --limit 3 --repo r2.db --population wild >/dev/null
[ "$(sqlite3 r2.db 'select count(*) from neurons')" = 3 ]

# A service that waits, is ill for a while, or has moved: patience. One that breaks off: the rest and only the rest.
fetch busy-1 ill-1 moved-1 cut-1 changed-1 weak-1 wrong-1 --out patient >/dev/null 2>err.txt
for cell in patient/*.swc; do cmp "$cell" "cells/$(basename "$cell")"; done
[ "$(ls patient/*.swc | wc -l)" = 7 ]
/usr/bin/python3 - <<'PY'
import json, os
lines = [json.loads(line) for line in open("log.jsonl")]
of = lambda name: [line for line in lines if name + ".CNG.swc" in line["path"]]
half = os.path.getsize("cells/cut-1.swc") // 2
assert of("busy-1")[1]["time"] - of("busy-1")[0]["time"] >= 1
assert len(of("ill-1")) == 3
assert [line["Range"] for line in of("cut-1")] == [None, f"bytes={half}-"] and of("cut-1")[1]["If-Range"]
assert of("changed-1")[1]["If-Range"] == '"old"'
assert [line["Range"] for line in of("weak-1")] == [None, None]  # a weak ETag promises nothing about bytes
PY
[ -z "$(ls cache_home/brainforest | grep part || true)" ]

# One bad cell after the other, each with its sentence, and the good one among them.
got=0
fetch gone-1 page-1 nonsense-1 file-1 circle-1 short-1 huge-1 liar-1 no-such ../../etc/passwd a%2fb plain-3 --out bad --retries 1 \
  >said.txt 2>err.txt || got=$?
[ "$got" = 1 ]
grep -q '^1 fetched (1 of them from the cache), 11 failed$' said.txt && cmp bad/plain-3.swc cells/plain-3.swc
[ "$(ls bad)" = $'plain-3.json\nplain-3.swc' ]
told_of gone-1 'does not have it \(status 404\)'
told_of page-1 'is a web page and no SWC file'
told_of nonsense-1 'holds no point'
told_of file-1 'cannot be had \(Protocol "file"'
told_of circle-1 'Maximum \(5\) redirects'
told_of short-1 'broke off after 2 attempts with [0-9]+ bytes there'
told_of huge-1 'larger than 200000000 bytes; raise --max-size'
told_of liar-1 "another neuron, 'other'"
told_of no-such 'check the name'
told_of '../../etc/passwd' 'no single piece of an address'
told_of 'a%2fb' 'no single piece of an address'
grep -q '11 of 12 cells could not be fetched' err.txt
fails_with 1 'larger than 1000000 bytes' fetch flood-1 --out bad --max-size 1 --retries 0
fails_with 1 'broke off' fetch silent-1 --out bad --timeout 1 --retries 0
fails_with 1 'alone for 86400 seconds' fetch away-1 plain-0 --out away  # and what is in the cache is served
cmp away/plain-0.swc cells/plain-0.swc
grep -q '1 of 2 cells' err.txt

# Queries to a service that lies end, and names out of them lead nowhere.
fetch --query species:endless --limit 1000 --out endless >/dev/null
[ "$(ls endless)" = $'plain-0.json\nplain-0.swc' ]
[ "$(requests endless)" = 2 ]
fails_with 1 '250 of 250 cells' fetch --query species:new --limit 250 --out never
[ "$(requests species%3Anew)" = 3 ] && [ ! -e never ]
fetch --query species:empty --out never | grep -q '^0 fetched'
fails_with 1 '3 of 4 cells' fetch --query species:hostile --out hostile
! grep -q $'\e' out.txt err.txt  # nor their terminal's commands
[ "$(find . -name '*escaped*')" = '' ] && [ ! -e ../../escaped.swc ] && [ "$(ls hostile | wc -l)" = 2 ]
fails_with 1 'pages ended early' fetch --query species:broken --limit 200 --out broken --retries 0
[ "$(ls broken/*.swc | wc -l)" = 5 ]
fails_with 1 'is no JSON' fetch --query species:broken --limit 200 --out broken --retries 0

# Killed in the middle: the same command continues where it was.
/usr/bin/python3 - <<'PY'
import glob, json, os, signal, subprocess, time
command = [os.environ["BRAINFOREST"], "fetch", "slow-1", "--out", "killed", "--from", "http://127.0.0.1:" + open("port").read()]
size, rounds = os.path.getsize("cells/slow-1.swc"), 0
def received():  # bytes of the part, none where it has just become the cell
    try: return max(map(os.path.getsize, glob.glob("cache_home/brainforest/*.part")), default=0)
    except FileNotFoundError: return 0
while True:
    child = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    begin = time.monotonic()
    part = received()
    while child.poll() is None and time.monotonic() - begin < 30:  # a fourth of it, then the axe
        if received() - part > size // 4: break
        time.sleep(.02)
    if child.poll() is not None: break
    child.send_signal(signal.SIGKILL)
    child.wait()
    rounds += 1
    assert not os.path.exists("killed/slow-1.swc") and rounds < 8
assert child.returncode == 0 and rounds >= 2, (child.returncode, rounds)
assert open("killed/slow-1.swc", "rb").read() == open("cells/slow-1.swc", "rb").read()
begins = [line["Range"] for line in map(json.loads, open("log.jsonl")) if "slow-1.CNG.swc" in line["path"]]
starts = [0 if b is None else int(b[6:-1]) for b in begins]
assert starts == sorted(set(starts)) and len(starts) == rounds + 1, starts
PY

# Two at once share a cache: the second waits and finds everything there.
fetch slow-2 --out first >/dev/null & one=$!
fetch slow-2 --out second >/dev/null
wait $one
cmp first/slow-2.swc cells/slow-2.swc && cmp second/slow-2.swc cells/slow-2.swc
[ "$(requests slow-2.CNG.swc)" = 1 ]

# Never faster than agreed.
timeout 60 $BRAINFOREST fetch plain-0 plain-1 plain-2 --out polite --cache fresh --rate 4 --from "$from" >/dev/null
/usr/bin/python3 - <<'PY'
import json
times = [json.loads(line)["time"] for line in open("log.jsonl")][-6:]
assert times[-1] - times[0] > 1 and min(b - a for a, b in zip(times, times[1:])) > .1, times  # but for delays of the log
PY

# A full disk, a cache that is a file, a server that is not there: a sentence each, and not one for every cell's retries.
got=0
(ulimit -f 8 && exec $BRAINFOREST fetch slow-1 --out full --cache full_cache --from "$from") >/dev/null 2>err.txt || got=$?
[ "$got" = 1 ] && grep -q 'the disk has room' err.txt && [ ! -e full ]
fails_with 1 'no folder that can be written' fetch plain-0 --out x --cache log.jsonl
fails_with 1 '3 of 3 cells' $BRAINFOREST fetch a b c --out x --from http://127.0.0.1:1 --retries 1
grep -q '^a: .*no answer from the service after 2 attempts' err.txt && grep -q '^c: .*no answer' err.txt

# Over TLS only from a server that proves who it is.
openssl req -x509 -newkey rsa:2048 -nodes -keyout key.pem -out cert.pem -days 2 -subj /CN=localhost \
  -addext subjectAltName=IP:127.0.0.1 2>/dev/null
/usr/bin/python3 "$service" cells tls_port tls.jsonl cert.pem key.pem 2>/dev/null & tls_id=$!
trap 'kill $service_id $tls_id' EXIT
for _ in $(seq 100); do [ -s tls_port ] && break; sleep .1; done
fails_with 1 'certificate' $BRAINFOREST fetch plain-0 plain-1 --out tls --from "https://127.0.0.1:$(cat tls_port)"
[ ! -e tls.jsonl ]
SSL_CERT_FILE=cert.pem timeout 60 $BRAINFOREST fetch plain-0 --out tls --from "https://127.0.0.1:$(cat tls_port)" >/dev/null
cmp tls/plain-0.swc cells/plain-0.swc

# Bad usage.
fails_with 2 'say which neurons' fetch --out x
fails_with 2 '--out,--repo' fetch plain-0
fails_with 2 'no address of a service' $BRAINFOREST fetch a --out x --from file:///etc
fails_with 2 'without user' $BRAINFOREST fetch a --out x --from http://me:secret@host
! grep -q secret err.txt
fails_with 2 'is no condition' fetch --query rat --out x
fails_with 2 '--repo' fetch a --out x --population p
fails_with 2 'offline' fetch a --out x --offline --refresh
fails_with 2 '--rate' fetch a --out x --rate 0
[ ! -e x ]

# SPDX-License-Identifier: Apache-2.0
# Bad usage ends with status 2 and a short sentence that says what would be good; one bad file among good ones with status 1.
trap 'echo "failed in line $LINENO: $BASH_COMMAND"' ERR

source "$FOREST_SOURCE_DIR/tests/words.sh"

fails_with 2 "no verb 'frob'; there are: demo, import, fetch, list" $program frob
fails_with 2 'say which verb, one of: demo' $program
fails_with 2 "no benchmark 'nosuch'; there are: activity, column" $program bench nosuch
fails_with 2 'one of: activity, column, gaze, grid, grow' $program bench
fails_with 2 'say which action, one of: list, show' $program model
fails_with 2 "no action 'nosuch'; there are: list, show, edit" $program model nosuch
fails_with 2 'files or --repo' $program check
fails_with 2 'files' $program convert
fails_with 2 'say where the files go' $program convert a.swc
fails_with 2 'with --format' $program convert a.swc --out x

for seed in -1 18446744073709551616 1e3 7x ''; do
  fails_with 2 'is no whole number from 0 to 18446744073709551615' $program grow --grammar motoneuron --out x --seed "$seed"
  fails_with 2 'is no whole number from 0 to 18446744073709551615' $program clamp x.activity --neuron "$seed"
  fails_with 2 'is no whole number from 0 to 18446744073709551615' $program plant --recipe column-1000 --repo x.db --out x --seed "$seed"
  fails_with 2 'is no whole number from 0 to 18446744073709551615' $program demo --out x --seed "$seed"
  fails_with 2 'is no whole number from 0 to 18446744073709551615' $program bench column --seed "$seed"
done
[ ! -e x ]
$program grow --grammar motoneuron --out x --seed 18446744073709551615 --json | grep -q '"seed": 18446744073709551615'
fails_with 2 "'-1' is no whole number from 0 to 4096" $program list --repo x.db --threads -1
fails_with 2 "'foo' is none of auto, cpu, opengl" $program render x.forest -o x.png --renderer foo
fails_with 2 "'blue' is none of sign, target" $program render x.forest -o x.png --synapse-colour blue
fails_with 2 "'nan' is no number from 0 to 1" $program render x.forest -o x.png --gaze nan .5
fails_with 2 'what is given is empty; give a value, or leave the option out' $program render x.forest -o x.png --view ''
for command in 'import' 'check' 'convert' 'convert --format swc --out x'; do
  fails_with 2 'what is given is empty' $program $command ''
done
fails_with 2 "'nan' is no number from 0.001 to 1000" $program fetch --query x:y --out x --rate nan
fails_with 2 "'nan' is no number from 1 to 3600" $program fetch --query x:y --out x --timeout nan
fails_with 2 "'nan' is no number from 0 to 1000" $program convert a.swc b.ply --detail nan
fails_with 2 "'nan' is no number from" $program raster x.activity -o x.png --to nan
long=$(printf 'a%.0s' {1..300})
fails_with 1 'File name too long; check the path, and who may read and write there' $program list --repo $long
fails_with 1 'File name too long; check the path, and who may read and write there' $program import x.swc --repo $long
fails_with 2 'what is given is empty; give a value, or leave the option out' $program cortex surfaces x.svg --out ''
for benchmark in activity pick targets; do
  $program bench $benchmark --help | grep -q "brainforest bench $benchmark --neurons"
done
for size in 12by9 0x9 12x9x3 -1x5 20000x1; do
  fails_with 2 'is no size of a picture' $program render x.forest -o x.png --size "$size"
  fails_with 2 'is no size of a picture' $program bench column --size "$size"
done
fails_with 2 'must be even' $program movie x.forest -o x.mp4 --size 13x90

# The good ones among bad ones are taken, and folders say what they skip.
printf '1 1 0 0 0 5 -1\n2 3 0 5 0 1 1\n3 3 0 9 0 1 2\n' >good.swc
fails_with 1 'missing.swc: cannot be opened' $program import good.swc missing.swc --repo r.db
$program list --repo r.db | grep -q good
fails_with 1 '1 of 2' $program check good.swc missing.swc
fails_with 1 'missing.swc' $program measure good.swc missing.swc
fails_with 1 'missing.swc' $program convert good.swc missing.swc --format swc --out converted
cmp <($program measure good.swc --json) <($program measure converted/good.swc --json | sed 's/converted\///')
# What cannot be said on standard error is lost, and nothing else.
printf '1 1 0 0 0 5 -1\n2 3 0 5 0 0 1\n3 3 0 9 0 0 2\n' >thin.swc
$program import thin.swc missing.swc --repo full.db >/dev/null 2>/dev/full && exit 1 || [ $? = 1 ]
$program import thin.swc missing.swc --repo closed.db >/dev/null 2>&- && exit 1 || [ $? = 1 ]
for repo in full closed; do $program list --repo $repo.db | grep -q thin; done
mkdir folder && cp good.swc folder/ && touch folder/notes.txt folder/.hidden
for verb in import check measure convert; do
  more=()
  [ $verb != import ] || more=(--repo f.db)
  [ $verb != convert ] || more=(--format swc --out c)
  $program $verb folder "${more[@]}" >/dev/null 2>err.txt
  [ "$(cat err.txt)" = '2 files of other formats are skipped (1 without extension, 1 .txt)' ] || { echo "$verb: $(cat err.txt)"; exit 1; }
done

# A file without radii: the first few are told and the rest counted.
/usr/bin/python3 -c '
print("1 1 0 0 0 5 -1")
for i in range(2, 5000): print(i, 3, 0, 3 * i, 0, 0, i - 1)' >thin.swc
$program check thin.swc >out.txt
[ "$(wc -l <out.txt)" -lt 30 ]
grep -q 'thin.swc  *2  zero-radius' out.txt
grep -q 'the same on 4978 more lines' out.txt

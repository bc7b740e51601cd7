#!/bin/bash
# sensor takes a cube with missing tiles without a word; compare takes different parts of a film; export fails after it has written
# SPECTILE=path/to/spectile ./run.sh     prints PASS or FAIL
S=$(realpath "${SPECTILE:?set it to the path of the program}"); HERE=$(cd "$(dirname "$0")" && pwd)
T=$(mktemp -d); trap 'rm -rf "$T"' EXIT; cp -r "$HERE"/. "$T"; cd "$T"
export XDG_RUNTIME_DIR=$T RUST_BACKTRACE=0
bad=0; wrong() { echo "  wrong: $*"; bad=1; }
end() { [ $bad = 0 ] && echo PASS || { echo FAIL; exit 1; }; }
# refused WHAT WORDS COMMAND...: exits with a code between 2 and 5, and says WORDS
refused() { local what=$1 words=$2 code=0; shift 2; "$@" >out 2>err || code=$?
  [ $code -ge 2 ] && [ $code -le 5 ] && grep -q -- "$words" err || wrong "$what: exit $code: $(head -c 300 err)"; }
"$S" render scene.toml -o c.zarr --spp 1 >/dev/null 2>&1
"$S" render scene.toml -o part.zarr --spp 1 --size 16x16 --tile 8 --tiles 0..2 >/dev/null 2>&1
printf 'nm,a\n400,1\n500,1\n' > r.csv
"$S" sensor part.zarr --responses r.csv -o s.zarr >out 2>err; grep -q '2 of 4 tiles have no samples yet' out || wrong "sensor says nothing of missing tiles: $(cat out err)"
for part in '[0,0,4,8]' '[4,0,8,8]'; do "$S" render scene.toml -o "p$part.zarr" --spp 1 --set "film.crop=$part" >/dev/null 2>&1; done
refused 'two halves' 'begins at pixel 0, 0' "$S" compare 'p[0,0,4,8].zarr' 'p[4,0,8,8].zarr'
rm -rf c.zarr/.spectile c.zarr/samples/c
for name in o.csv o.img o.exr o.png; do
  refused "$name of a copy without samples" 'is missing' "$S" export c.zarr -o $name
  [ -e $name ] && wrong "$name was written by an export that failed"
done
end

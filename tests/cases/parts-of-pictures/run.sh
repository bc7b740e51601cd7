#!/bin/bash
# sensor takes a cube with missing tiles without a word; compare takes different parts of a film; export fails after it has written
# SPECTILE=path/to/spectile ./run.sh     prints PASS or FAIL
source "$(dirname "$0")/../../support/cases.sh"
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

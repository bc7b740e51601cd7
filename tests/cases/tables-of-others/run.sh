#!/bin/bash
# export -o replaces any CSV whose first columns are called x and y; --overwrite removes what others put into a cube
# SPECTILE=path/to/spectile ./run.sh     prints PASS or FAIL
source "$(dirname "$0")/../../support/cases.sh"
survey() { printf 'x,y,temperature\n1,2,300.5\n4,5,301.25\n' > points.csv; }
survey; refused 'a survey' 'table of spectra' "$S" export c.zarr -o points.csv
survey > /dev/null; [ "$(sed -n 3p points.csv)" = 4,5,301.25 ] || wrong 'a survey was overwritten'
"$S" export c.zarr -o own.csv >/dev/null 2>&1; "$S" export c.zarr -o own.csv --crop 2,2,5,6 >/dev/null 2>err && "$S" export c.zarr -o own.csv >/dev/null 2>>err || wrong "an export of its own is not replaced: $(cat err)"
"$S" export c.zarr -o own.csv --crop 2,2,3,8 >/dev/null 2>&1; "$S" export c.zarr -o own.csv >/dev/null 2>err || wrong "a column of its own is not replaced: $(cat err)"
cp -r c.zarr a.zarr; mkdir a.zarr/.spectile/notes; echo work > a.zarr/.spectile/notes/day1.txt
refused 'notes within' 'notes' "$S" render scene.toml -o a.zarr --spp 1 --overwrite
[ -e a.zarr/.spectile/notes/day1.txt ] || wrong 'notes were removed'
sed -i 's/"attributes": {/"attributes": { "lab notes": "three days",/' c.zarr/zarr.json
refused 'an attribute' 'lab notes' "$S" render scene.toml -o c.zarr --spp 1 --overwrite
grep -q 'lab notes' c.zarr/zarr.json || wrong 'an attribute was removed'
end

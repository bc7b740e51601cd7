#!/bin/bash
# a copy of a cube that xarray wrote with other units or packing is read as if nothing had changed; healthy ones that it compressed are called damaged
# SPECTILE=path/to/spectile ./run.sh     prints PASS or FAIL
source "$(dirname "$0")/../../support/cases.sh"
rm -rf c.zarr/.spectile
python -W ignore - <<'P'
import xarray as xr
d = xr.open_zarr('c.zarr').load()
d.to_zarr('same.zarr')
d.radiance.attrs['units'] = 'mW m-2 sr-1 nm-1'
d.to_zarr('mw.zarr')
d = xr.open_zarr('c.zarr')
d.radiance.encoding['scale_factor'] = 0.5
d.to_zarr('packed.zarr')
d = xr.open_zarr('c.zarr').load()
encoding = dict(d.wavelength.encoding)
d = d.assign_coords(wavelength=('wavelength', d.wavelength.values / 1000, {**d.wavelength.attrs, 'units': 'um'}))
d.wavelength.encoding = encoding
d.to_zarr('um.zarr')
(xr.open_zarr('c.zarr') * 2).to_zarr('twice.zarr')
P
[ "$("$S" spectrum same.zarr 1 1 | sed -n 2p)" = 450,5.0 ] || wrong "a copy by xarray: $("$S" spectrum same.zarr 1 1 2>&1 | sed -n 2p)"
refused 'a copy in mW' 'gave `radiance` the units `mW m-2 sr-1 nm-1`' "$S" spectrum mw.zarr 1 1
refused 'a packed copy' 'gave `radiance` a `scale_factor` of 0.5' "$S" export packed.zarr -o p.csv
refused 'wavelengths in micrometres' 'gave `wavelength` the units `um`' "$S" compare um.zarr same.zarr
refused 'a compressed copy' 'stored `.*` in another way' "$S" info twice.zarr
python -W ignore -c "
import zarr; g=zarr.open_group('same.zarr'); r=g['radiance'][:]; r[0,0,0]=float('inf'); g['radiance'][:]=r"
printf 'nm,a\n400,1\n500,1\n' > r.csv
refused 'an infinite value' 'not finite' "$S" sensor same.zarr --responses r.csv -o s.zarr
[ -e s.zarr ] && wrong 'a sensor cube of an infinite value was left'
end

"""Open exports that lie on a map as GIS users do, with rasterio (GDAL) and rioxarray, and check where they are and what they hold.

    python -W error read_map.py upright|turned FILE…

Beside them lies cube.zarr, of which they have the columns 3 to 31 and lines 1 to 19.
"""

import sys
import warnings

import numpy as np
import rasterio
import rioxarray  # noqa: F401  (the accessor)
import xarray as xr

# Of rioxarray itself, about affine.
warnings.simplefilter("ignore", PendingDeprecationWarning)

turned = sys.argv[1] == "turned"
cube = xr.open_zarr("cube.zarr")
values = cube.radiance.values[:, 1:20, 3:32]
# The cube itself, in the words of GeoZarr.
assert cube.attrs["proj:code"] == cube.attrs["crs"] == "EPSG:32631"
assert list(cube.attrs["spatial:transform"]) == list(cube.attrs["affine"])
a, b, c, d, e, f = cube.attrs["affine"]
expected = np.array([a, b, 3 * a + b + c, d, e, 3 * d + e + f])


def same_place(transform):
    np.testing.assert_allclose(np.array(transform)[:6], expected, rtol=0, atol=2e-6)


for file in sys.argv[2:]:
    if file.endswith(".zarr"):
        store = xr.open_zarr(file)
        assert np.array_equal(store.radiance.values, values)
        assert store.radiance.rio.crs.to_epsg() == 32631, store.radiance.rio.crs
        same_place(store.radiance.rio.transform())
        if not turned:
            np.testing.assert_allclose(store.x.values, expected[2] + a * (np.arange(29) + 0.5), rtol=0, atol=1e-6)
            np.testing.assert_allclose(store.y.values, expected[5] + e * (np.arange(19) + 0.5), rtol=0, atol=1e-6)
            assert store.x.attrs["standard_name"] == "projection_x_coordinate"
        continue
    with rasterio.open(file) as image:
        assert image.crs is not None and image.crs.to_epsg() == 32631, (file, image.crs)
        same_place(image.transform)
        assert np.array_equal(image.read(), values), file
        if file.endswith(".tif"):
            assert image.descriptions == tuple(cube.attrs["channel_names"])
            assert image.units[0] == "W m-2 sr-1 nm-1" and np.isnan(image.nodata)
            assert float(image.tags(1)["wavelength"]) == float(cube.wavelength[0])

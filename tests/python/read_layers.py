"""Open a cube with layers as its users do, with xarray, and check names, units and what they say of one another.

    python -W error read_layers.py CUBE.zarr

The cube is that of tests/render/layers.rs: seen from straight above.
"""

import sys

import numpy as np
import xarray as xr

cube = xr.open_zarr(sys.argv[1])
assert cube.depth.dims == ("y", "x") and cube.depth.attrs["units"] == "m" and cube.depth.dtype == np.float32
assert cube.normal.dims == ("y", "x", "xyz") and cube.coordinates.dims == ("y", "x", "xyz")
assert cube.coordinates.dtype == np.float64 and cube.coordinates.attrs["units"] == "m"
assert cube.object.dtype == np.int32 and cube.material.dtype == np.int32

seen = cube.object.values >= 0
assert seen.any() and not seen.all()
for name in ["depth", "normal", "coordinates", "sun"]:
    values = cube[name].values.reshape(*seen.shape, -1)
    assert np.array_equal(~np.isnan(values).any(axis=2), seen), name
np.testing.assert_allclose(cube.depth.values[seen], 10.0 - cube.coordinates.values[seen][:, 2], atol=2e-6)
np.testing.assert_allclose(np.linalg.norm(cube.normal.values[seen], axis=1), 1.0, atol=1e-6)

# Masks by name.
names = cube.material.attrs["flag_meanings"].split(" ")
numbers = dict(zip(names, cube.material.attrs["flag_values"]))
assert sorted(numbers) == ["a_ball", "cloth", "floor", "veil"]
ball = cube.where(cube.material == numbers["a_ball"])
assert float(ball.coordinates.isel(xyz=2).max()) <= 1.5 and int(ball.radiance.isel(wavelength=0).count()) > 10

"""Open cubes as their users do, with xarray and zarr, and check what they see.

    python -W error read_cube.py still CUBE.zarr EXPECTED.json
    python -W error read_cube.py growing CUBE.zarr TIMES

`still`: every value of every array against EXPECTED.json and the raw little-endian files it names. `growing`: the cube
is being rendered while it is opened and read, TIMES times and then until it was seen to grow, for a minute at most; every
tile holds one number at any moment.
"""

import json
import os
import sys
import time

import numpy as np
import xarray as xr
import zarr


def still(path, expected_path):
    with open(expected_path) as file:
        expected = json.load(file)
    width, height = expected["size"]
    tile_width, tile_height = expected["tile"]
    bounds = np.array(expected["bounds"])
    channels = len(bounds)
    folder = os.path.dirname(expected_path)
    radiance = np.fromfile(os.path.join(folder, expected["radiance"]), "<f4").reshape(height, width, channels)
    preview = np.fromfile(os.path.join(folder, expected["preview"]), "<f4").reshape(height, width, 3)
    samples = np.array(expected["samples"])

    ds = xr.open_zarr(path)
    da = ds["radiance"]
    assert da.dims == ("wavelength", "y", "x"), da.dims
    assert da.shape == (channels, height, width) and da.dtype == np.float32
    assert da.attrs["units"] == "W m-2 sr-1 nm-1" and da.attrs["long_name"]
    same_bits(da.transpose("y", "x", "wavelength").values, radiance)

    # Labels and units.
    assert ds["wavelength"].attrs["units"] == "nm"
    assert ds["wavelength"].attrs["standard_name"] == "radiation_wavelength"
    assert ds["wavelength"].attrs["bounds"] == "wavelength_bounds"
    assert np.array_equal(da["wavelength"].values, 0.5 * (bounds[:, 0] + bounds[:, 1]))
    assert np.array_equal(ds["wavelength_bounds"].values, bounds)
    assert ds["wavelength_bounds"].dims == ("wavelength", "bnds")
    assert np.array_equal(da["response_integral"].values, bounds[:, 1] - bounds[:, 0])
    x0, y0 = expected["origin"]
    assert np.array_equal(da["x"].values, x0 + np.arange(width))
    assert np.array_equal(da["y"].values, y0 + np.arange(height))
    assert ds.attrs["Conventions"].startswith("CF-") and ds.attrs["scene_digest"] == "0123abcd"
    assert ds.attrs["seed"] == 7 and len(ds.attrs["channel_names"]) == channels

    # One pixel and one channel by label, as a user would.
    k = channels // 2
    one = da.sel(x=x0 + 1, y=y0).isel(wavelength=k)
    assert one.values.tobytes() == radiance[0, 1, k].tobytes()
    if da.indexes["wavelength"].is_monotonic_increasing:
        nearest = da.sel(wavelength=float(da["wavelength"][k]) + 1e-3, method="nearest")
        same_bits(nearest.values, radiance[:, :, k])

    # NaN exactly where a tile has no samples.
    rows = np.arange(height) // tile_height
    columns = np.arange(width) // tile_width
    rendered = samples[rows[:, None], columns[None, :]] > 0
    assert np.array_equal(~np.isnan(da.values).any(axis=0), rendered)
    assert ds["samples"].dims == ("tile_y", "tile_x") and ds["samples"].dtype == np.uint32
    assert np.array_equal(ds["samples"].values, samples)

    assert ds["preview"].dims == ("y", "x", "rgb") and ds["preview"].shape == (height, width, 3)
    same_bits(ds["preview"].values, preview)
    assert np.array_equal(~np.isnan(ds["preview"].values).any(axis=2), rendered)

    overview = ds["overview"]
    assert overview.dims == ("wavelength", "overview_y", "overview_x")
    assert overview.shape == (channels, -(-height // 8), -(-width // 8))
    for row in range(overview.shape[1]):
        for column in range(overview.shape[2]):
            block = radiance[8 * row : 8 * row + 8, 8 * column : 8 * column + 8].astype(np.float64)
            np.testing.assert_allclose(overview.values[:, row, column], block.mean(axis=(0, 1)), rtol=1e-6)

    # The same through zarr alone: the group, and an array opened by itself.
    group = zarr.open_group(path, mode="r")
    arrays = {
        "radiance", "wavelength", "wavelength_bounds", "response_integral", "x", "y", "samples", "preview", "overview",
    }
    assert set(dict(group.arrays())) == arrays
    alone = zarr.open_array(os.path.join(path, "radiance"), mode="r")
    assert alone.chunks == (channels, tile_height, tile_width)
    same_bits(np.asarray(alone[:]).transpose(1, 2, 0), radiance)


def growing(path, times):
    tile_height, tile_width = 16, 16
    seen = set()
    # A slow disk may merge less often than a fast reader reads.
    reads, end = 0, time.monotonic() + 60
    while reads < int(times) or (len(seen) < 2 and time.monotonic() < end):
        reads += 1
        ds = xr.open_zarr(path)
        values = ds["radiance"].values
        for y in range(0, values.shape[1], tile_height):
            for x in range(0, values.shape[2], tile_width):
                tile = values[:, y : y + tile_height, x : x + tile_width]
                assert np.isnan(tile).all() or (tile == tile[0, 0, 0]).all(), "a tile is torn"
        seen.add(float(values[0, 0, 0]))
    print(len(seen))


def same_bits(got, expected):
    """Equal to the last bit; NaN counts as NaN whatever its payload."""
    missing = np.isnan(expected)
    assert got.shape == expected.shape, (got.shape, expected.shape)
    assert np.array_equal(np.isnan(got), missing)
    got, expected = (np.ascontiguousarray(a)[~missing].view(np.uint32) for a in (got, expected))
    assert np.array_equal(got, expected)


if __name__ == "__main__":
    {"still": still, "growing": growing}[sys.argv[1]](*sys.argv[2:])

"""Counts of a sensor as their users open them, and what is made of them.

    python -W error read_counts.py store COUNTS.zarr
    python -W error read_counts.py exports FOLDER BITS
    python -W error read_counts.py example SENSORS.md FOLDER

`store`: the layout, and SNR, noise and clipping of every band recomputed from electrons and attributes alone. `exports`: the files that
`export` made of FOLDER/counts.zarr hold its whole numbers, and say which one is no data. `example`: runs the page's program in FOLDER,
and prints what it found as JSON.
"""

import json
import os
import sys
import warnings

import numpy as np
import xarray as xr


def store(path):
    raw = xr.open_zarr(path, mask_and_scale=False)
    masked = xr.open_zarr(path)
    about = raw.attrs
    counts = raw["counts"].values
    fill = raw["counts"].attrs["_FillValue"]
    kind = np.uint16 if about["bits"] < 16 else np.uint32
    assert raw["counts"].dims == ("band", "y", "x") and counts.dtype == kind, counts.dtype
    assert fill == np.iinfo(kind).max and raw["counts"].attrs["units"] == "1"
    missing = counts == fill
    assert missing.any() and not missing.all()
    assert np.array_equal(np.isnan(masked["counts"].values), missing)
    most = 2 ** about["bits"] - 1
    assert counts[~missing].max() <= most
    electrons = raw["electrons"].values.astype(float)
    assert np.array_equal(np.isnan(electrons), missing)
    assert raw["wavelength_bounds"].shape == (counts.shape[0], 2)
    for band, name in enumerate(about["band_names"]):
        there = ~missing[band]
        expected = electrons[band][there]
        light = expected.mean() - about["background_signal"][band]
        gain = about["gain_electrons_per_count"]

        def variance(signal):
            return signal + about["dark_electrons"] + about["read_noise_electrons"] ** 2 + gain**2 / 12

        snr = light / np.sqrt(variance(expected.mean()))
        # Electrons are f32.
        np.testing.assert_allclose(snr, about["snr_at_mean"][band], rtol=1e-5)
        np.testing.assert_allclose(expected.mean(), about["mean_signal"][band], rtol=1e-6)
        # What is counted is what is expected, with noise and fixed patterns: by z over all pixels, and by chi-square, at 4 sigma. A pixel's
        # rounding error is part of the variance, and patterns add to it.
        mean = (expected + about["dark_electrons"]) / gain + about["offset_counts"]
        spread = variance(expected) + (about["prnu"] * expected) ** 2 + about["dsnu"] ** 2
        z = (counts[band][there] - mean) * gain / np.sqrt(spread)
        clipped = about["full_wells"][band] + about["clipped_above"][band] + about["clipped_below"][band]
        assert clipped == 0, name
        n = z.size
        assert abs(z.mean()) < 4 / np.sqrt(n), (name, z.mean())
        assert abs((z**2).mean() - 1) < 4 * np.sqrt(2 / n), (name, (z**2).mean())
    print(f"{path}: {counts.shape[0]} bands, {int((~missing).sum())} counts")


def exports(folder, bits):
    import OpenEXR
    import rasterio
    import spectral.io.envi

    source = xr.open_zarr(os.path.join(folder, "counts.zarr"), mask_and_scale=False)
    counts = source["counts"].values
    kind = np.uint16 if int(bits) < 16 else np.uint32
    none = np.iinfo(kind).max
    names = source.attrs["band_names"]
    bounds = source["wavelength_bounds"].values
    assert counts.dtype == kind and (counts == none).any()

    for interleave in ("bil", "bip", "bsq"):
        data = os.path.join(folder, f"c_{interleave}.{interleave}")
        image = spectral.io.envi.open(data[:-4] + ".hdr", data)
        values = np.asarray(image.open_memmap(interleave="bip"))
        assert values.dtype == kind, values.dtype
        assert np.array_equal(values.transpose(2, 0, 1), counts)
        assert int(image.metadata["data ignore value"]) == none and image.metadata["band names"] == names
        assert np.allclose(image.bands.centers, bounds.mean(axis=1))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", rasterio.errors.NotGeoreferencedWarning)
        for name in ("c.tif", "c_bil.bil"):
            with rasterio.open(os.path.join(folder, name)) as dataset:
                assert dataset.dtypes[0] == kind.__name__ and dataset.nodata == none, (name, dataset.dtypes, dataset.nodata)
                assert np.array_equal(dataset.read(), counts), name
                # Of ENVI with wavelengths: GDAL puts these behind.
                assert all(told.startswith(band) for told, band in zip(dataset.descriptions, names, strict=True))
                # Masks are those of what is missing.
                assert np.array_equal(dataset.read_masks() == 0, counts == none), name
    channels = OpenEXR.File(os.path.join(folder, "c.exr"), separate_channels=True).channels()
    assert sorted(channels) == sorted(names), sorted(channels)
    for band, name in enumerate(names):
        pixels = channels[name].pixels
        assert pixels.dtype == np.uint32
        whole = counts[band].astype(np.uint32)
        assert np.array_equal(pixels, np.where(counts[band] == none, np.uint32(2**32 - 1), whole)), name
    for name in ("c.zarr", "plain.zarr"):
        exported = xr.open_zarr(os.path.join(folder, name), mask_and_scale=False)["counts"]
        assert exported.dtype == kind and exported.attrs["_FillValue"] == none and exported.attrs["units"] == "1"
        assert np.array_equal(exported.values, counts)
        masked = xr.open_zarr(os.path.join(folder, name))["counts"].values
        assert np.array_equal(np.isnan(masked), counts == none)
    with open(os.path.join(folder, "c.csv")) as file:
        header, *lines = file.read().splitlines()
    assert header.split(",") == ["x", "y", *names]
    assert len(lines) == counts.shape[1] * counts.shape[2]
    for line in lines:
        x, y, *cells = line.split(",")
        for band, cell in enumerate(cells):
            count = counts[band, int(y), int(x)]
            assert cell == ("" if count == none else str(count)), line
    print(f"{folder}: every format has {kind.__name__}")


def example(page, folder):
    with open(page) as file:
        text = file.read()
    program = text.split("```python\n", 1)[1].split("```", 1)[0]
    os.chdir(folder)
    names = {}
    exec(compile(program, page, "exec"), names)
    found = {"snr": float(np.nanmax(names["snr"])), "median": float(np.nanmedian(names["snr"])), "pixels": int(names["hot"].sum())}
    print(json.dumps({**found, "ranges": names["ranges"], "air": names["through_air"]}))


if __name__ == "__main__":
    {"store": store, "exports": exports, "example": example}[sys.argv[1]](*sys.argv[2:])

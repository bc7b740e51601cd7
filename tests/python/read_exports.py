"""Open exported files with the programs that people open them with, and check every value and label.

    python -W error read_exports.py EXPECTED.json

EXPECTED.json names the files, a raw little-endian file of the values [y][x][band], and what the labels must be.
"""

import json
import os
import sys
import warnings

import numpy as np


def main(path):
    with open(path) as file:
        expected = json.load(file)
    folder = os.path.dirname(path)
    width, height = expected["size"]
    bands = len(expected["wavelength"])
    values = np.fromfile(os.path.join(folder, expected["values"]), "<f4").reshape(height, width, bands)
    names = [os.path.join(folder, name) for name in expected["files"]]
    {"envi": envi, "exr": exr, "exr-split": exr_split, "zarr": zarr, "csv": csv}[expected["format"]](names, values, expected)


def envi(names, values, expected):
    import rasterio
    import spectral.io.envi

    data, header = names
    interleave = expected["interleave"]
    missing = np.where(np.isnan(values), np.float32(-9999), values)

    image = spectral.io.envi.open(header, data)
    assert image.shape == values.shape
    # Neither scale nor anything else may be applied: the bits as they are.
    same_bits(np.asarray(image.open_memmap(interleave="bip")), missing)
    same_bits(np.asarray(image.load(dtype=np.float32)), missing)
    assert image.metadata["interleave"] == interleave
    assert np.array_equal(image.bands.centers, expected["wavelength"])
    assert np.array_equal(image.bands.bandwidths, expected["fwhm"])
    assert image.bands.band_unit == "Nanometers"
    assert image.metadata["band names"] == expected["names"]
    assert image.metadata["data units"] == expected["units"]
    assert [int(band) for band in image.metadata["default bands"]] == [band + 1 for band in expected["default_bands"]]
    assert len(image.metadata["bbl"]) == values.shape[2] and float(image.metadata["data ignore value"]) == -9999

    with warnings.catch_warnings():
        # There is nowhere on earth that these pictures are.
        warnings.simplefilter("ignore", rasterio.errors.NotGeoreferencedWarning)
        with rasterio.open(data) as dataset:
            assert dataset.driver == "ENVI" and dataset.nodata == -9999
            assert (dataset.height, dataset.width, dataset.count) == values.shape
            same_bits(dataset.read().transpose(1, 2, 0), missing)
            for band, nm in enumerate(expected["wavelength"], 1):
                tags = dataset.tags(band)
                assert float(tags["wavelength"]) == nm and tags["wavelength_units"] == "Nanometers", tags


def exr_channels(name):
    import OpenEXR

    with OpenEXR.File(name, separate_channels=True) as file:
        header = dict(file.header())
        return header, {channel: np.array(data.pixels) for channel, data in file.channels().items()}


def exr_name(nm):
    return f"S0.{nm:.6f}nm".replace(".", ",").replace(",", ".", 1)


def exr(names, values, expected):
    (name,) = names
    header, channels = exr_channels(name)
    assert header["spectralLayoutVersion"] == "1.0" and header["emissiveUnits"] == expected["units"]
    assert "tiles" in header and header["compression"].name == "ZIP_COMPRESSION"
    assert len(channels) == values.shape[2] + 3
    for band, nm in enumerate(expected["wavelength"]):
        same_bits(channels[exr_name(nm)], values[:, :, band])
        low, high = (float(item.split("nm:")[0]) for item in header[exr_name(nm)].strip(";").split(";"))
        assert high - low == expected["fwhm"][band] or abs(high - low - expected["fwhm"][band]) < 1e-9
    rgb = np.stack([channels[c] for c in "RGB"], axis=2)
    missing = np.isnan(values[:, :, 0])
    assert np.array_equal(np.isnan(rgb).all(axis=2), missing)
    same_bits(rgb, np.fromfile(os.path.join(os.path.dirname(name), expected["rgb"]), "<f4").reshape(rgb.shape))

    if values.shape[2] + 3 <= 1024:
        with warnings.catch_warnings():
            # What it could import and does not need here, and units that say "per nanometre".
            warnings.simplefilter("ignore")
            import colour

            components, _ = colour.read_spectral_image_Fichet2021(name, additional_data=True)
        wavelengths, data = components["S0"]
        # Not sorted: in the order of the names.
        order = np.argsort(wavelengths)
        by_wavelength = np.argsort(expected["wavelength"])
        np.testing.assert_allclose(np.asarray(wavelengths)[order], np.asarray(expected["wavelength"])[by_wavelength], atol=1e-6)
        same_bits(np.asarray(data)[:, :, order].astype(np.float32), values[:, :, by_wavelength])


def exr_split(names, values, expected):
    by_wavelength = np.argsort(expected["wavelength"], kind="stable")
    seen = []
    for name in names:
        _, channels = exr_channels(name)
        nms = sorted(float(c[3:-2].replace(",", ".")) for c in channels if c.startswith("S0"))
        # The colours first, as viewers want them.
        assert len(nms) <= expected["split"] and set(list(channels)[:3]) == {"R", "G", "B"}
        for nm in nms:
            band = by_wavelength[len(seen)]
            assert abs(expected["wavelength"][band] - nm) < 1e-6
            same_bits(channels[exr_name(nm)], values[:, :, band])
            seen.append(nm)
    assert len(seen) == values.shape[2]


def zarr(names, values, expected):
    import xarray as xr
    import zarr

    (name,) = names
    ds = xr.open_zarr(name)
    da = ds[expected["variable"]]
    assert da.dims == ("wavelength", "y", "x") and da.dtype == np.float32
    assert da.attrs["units"] == expected["units"]
    same_bits(da.transpose("y", "x", "wavelength").values, values)
    assert ds["wavelength"].attrs["units"] == "nm"
    assert ds["wavelength"].attrs["standard_name"] == "radiation_wavelength"
    assert np.array_equal(da["wavelength"].values, expected["wavelength"])
    assert np.array_equal(da["wavelength_width"].values, expected["fwhm"])
    assert np.array_equal(ds["wavelength_bounds"].values.mean(axis=1), expected["wavelength"])
    x0, y0 = expected["origin"]
    assert np.array_equal(da["x"].values, x0 + np.arange(values.shape[1]))
    assert np.array_equal(da["y"].values, y0 + np.arange(values.shape[0]))
    alone = zarr.open_array(os.path.join(name, expected["variable"]), mode="r")
    assert (alone.shards is not None) == expected["sharded"], alone.shards
    assert alone.chunks[0] <= 64 and alone.chunks[1] == alone.chunks[2] == 32
    same_bits(np.asarray(alone[:]).transpose(1, 2, 0), values)


def csv(names, values, expected):
    import pandas as pd

    (name,) = names
    # As text first: pandas rounds what it reads as numbers a second time.
    table = pd.read_csv(name, dtype=str)
    assert list(table.columns) == ["x", "y", *expected["names"]]
    height, width, bands = values.shape
    x0, y0 = expected["origin"]
    assert np.array_equal(table["x"].to_numpy().astype(int).reshape(height, width)[0], x0 + np.arange(width))
    assert np.array_equal(table["y"].to_numpy().astype(int).reshape(height, width)[:, 0], y0 + np.arange(height))
    numbers = table[expected["names"]].fillna("nan").to_numpy().astype(np.float32)
    same_bits(numbers.reshape(values.shape), values)


def same_bits(got, expected):
    """Equal to the last bit; NaN counts as NaN whatever its payload."""
    missing = np.isnan(expected)
    assert got.shape == expected.shape, (got.shape, expected.shape)
    assert got.dtype == np.float32, got.dtype
    assert np.array_equal(np.isnan(got), missing)
    got, expected = (np.ascontiguousarray(a)[~missing].view(np.uint32) for a in (got, expected))
    assert np.array_equal(got, expected)


if __name__ == "__main__":
    main(sys.argv[1])

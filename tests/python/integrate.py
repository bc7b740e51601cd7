"""Sensors and colours of a cube, integrated here with numpy and colour-science only.

    python -W error integrate.py sensor CUBE.zarr RESPONSES.csv SENSOR.zarr
    python -W error integrate.py xyz CUBE.zarr OBSERVER XYZ.zarr

`sensor`: every band of SENSOR.zarr against the integral of the piecewise linear response over each channel of CUBE.zarr.
`xyz`: X, Y, Z of every pixel against sums with colour-science's own tables.
"""

import csv
import sys

import numpy as np
import xarray as xr


def read_responses(path):
    with open(path) as file:
        rows = list(csv.reader(line for line in file if not line.startswith("#")))
    header, rows = rows[0], rows[1:]
    if header[0] == "band":
        names = list(dict.fromkeys(row[0] for row in rows))
        columns = {name: [(row[1], row[2]) for row in rows if row[0] == name] for name in names}
    else:
        columns = {name: [(row[0], row[i + 1]) for row in rows if row[i + 1]] for i, name in enumerate(header[1:])}
    tables = {}
    for name, pairs in columns.items():
        nm, value = np.array(pairs, float).T
        tables[name] = nm, np.maximum(value, 0.0)
    return tables


def integral(nm, value, low, high):
    """Of the piecewise linear response, zero outside its table, from low to high."""
    low, high = max(low, nm[0]), min(high, nm[-1])
    if low >= high:
        return 0.0
    x = np.concatenate([[low], nm[(nm > low) & (nm < high)], [high]])
    return float(np.trapezoid(np.interp(x, nm, value), x))


def sensor(cube_path, responses, sensor_path):
    cube, made = xr.open_zarr(cube_path), xr.open_zarr(sensor_path)
    bounds = cube["wavelength_bounds"].values
    spectra = cube["radiance"].transpose("y", "x", "wavelength").values.astype(np.float64)
    bands = made["radiance"].transpose("y", "x", "wavelength").values
    tables = read_responses(responses)
    names = made.attrs["channel_names"]
    assert names == [name for name in tables if name in names] and len(names) > 0
    for b, name in enumerate(names):
        nm, value = tables[name]
        weights = np.array([integral(nm, value, low, high) for low, high in bounds])
        covered = weights.sum()
        whole = integral(nm, value, nm[0], nm[-1])
        assert covered >= 0.99 * whole, (name, covered / whole)
        expected = spectra @ weights / covered
        np.testing.assert_allclose(bands[:, :, b], expected, rtol=3e-7)
        np.testing.assert_allclose(made["response_integral"].values[b], whole, rtol=1e-12)
        centroid = np.average(0.5 * (nm[1:] + nm[:-1]), weights=0.5 * np.diff(nm) * (value[1:] + value[:-1]) + 1e-300)
        assert abs(made["wavelength"].values[b] - centroid) < np.diff(nm).max()
    print(len(names))


def xyz(cube_path, observer, xyz_path):
    import warnings

    with warnings.catch_warnings():
        # What it could import and does not need here.
        warnings.simplefilter("ignore")
        import colour

        cmfs = colour.MSDS_CMFS[
            {
                "1931": "CIE 1931 2 Degree Standard Observer",
                "1964": "CIE 1964 10 Degree Standard Observer",
                "2015": "CIE 2015 2 Degree Standard Observer",
            }[observer]
        ]
    nm, tables = np.asarray(cmfs.wavelengths), np.asarray(cmfs.values)
    cube, made = xr.open_zarr(cube_path), xr.open_zarr(xyz_path)
    bounds = cube["wavelength_bounds"].values
    spectra = cube["radiance"].transpose("y", "x", "wavelength").values.astype(np.float64)
    luminous = integral(nm, tables[:, 1], nm[0], nm[-1])
    for i in range(3):
        weights = np.array([integral(nm, tables[:, i], low, high) for low, high in bounds]) / luminous
        np.testing.assert_allclose(made["xyz"].transpose("y", "x", "wavelength").values[:, :, i], spectra @ weights, rtol=3e-7)


if __name__ == "__main__":
    {"sensor": sensor, "xyz": xyz}[sys.argv[1]](*sys.argv[2:])

"""Radiance from the arrays of a factored cube, by docs/cube.md alone: read_weights.py WEIGHTS.zarr RADIANCE.zarr."""

import json
import sys

import numpy as np
import xarray as xr


def curve(definition, nm):
    kind, of = next(iter(definition.items()))
    if kind == "constant":
        return np.full(nm.shape, of)
    if kind == "linear":
        ends = {} if of["outside"] == "hold" else {"left": 0.0, "right": 0.0}
        return np.interp(nm, of["nm"], of["value"], **ends)
    raise NotImplementedError(kind)


def expression(of, spectra, nm):
    value = np.full(nm.shape, of["scale"])
    for term in of["terms"]:
        (kind, which), = term.items()
        assert kind in ("spectrum", "complement"), kind
        factor = curve(spectra[which]["curve"], nm)
        value = value * (factor if kind == "spectrum" else 1.0 - factor)
    return value


def main(weights, radiance):
    cube = xr.open_zarr(weights, consolidated=True)
    wanted = xr.open_zarr(radiance, consolidated=True)
    basis = json.loads(cube.attrs["factored"])["basis"]
    spectra = basis["spectra"]
    bounds = cube["wavelength_bounds"].values
    # Gauss's rule between all nodes of the tables would be exact; many points of the midpoint rule are enough here.
    steps = (np.arange(2000) + 0.5) / 2000
    nm = bounds[:, :1] + (bounds[:, 1:] - bounds[:, :1]) * steps
    factors = [expression(of, spectra, nm) for of in basis["factors"]]
    sources = [expression(of, spectra, nm) for of in basis["sources"]]
    height, width = wanted["radiance"].shape[1:]
    preview = cube["preview"]
    tile_height, tile_width = preview.encoding["chunks"][:2]
    made = np.zeros((len(bounds), height, width))
    for row in range(cube.sizes["tile_y"]):
        for column in range(cube.sizes["tile_x"]):
            entries = cube["weights"][row, column].values.astype(np.float64)
            entries = entries[:, entries[2] != 0.0]
            products = cube["products"][row, column].values
            rows = {}
            for pixel, product, weight in entries[:3].T:
                product = int(product)
                if product not in rows:
                    source, *of = [int(i) for i in products[product] if i != 65535]
                    rows[product] = np.prod([sources[source], *(factors[i] for i in of)], axis=0).mean(axis=1)
                y, x = divmod(int(pixel), tile_width)
                made[:, row * tile_height + y, column * tile_width + x] += weight * rows[product]
    if "remainder" in cube:
        made += cube["remainder"].values
    peak = wanted["radiance"].values.max(axis=(1, 2), keepdims=True)
    wrong = np.abs(made - wanted["radiance"].values) / peak
    assert wrong.max() < 2e-4, wrong.max()


main(*sys.argv[1:])

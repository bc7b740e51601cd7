"""Radiance of a plane sky by PythonicDISORT, as CSV: the answers that tests/render/sky.rs holds renders against.

    spectile sky --scene FOLDER …
    disort_sky.py FOLDER NM[,NM…] > tests/data/disort_sky.csv

reads the layers, coefficients, sun and ground of the scene itself (scene.toml, CSV and Zarr), so that nothing is shared with how Spectile
makes them but the files. Irradiance above the air is 1. Lines: nm, row and column of a map of 36 x 180 pixels, the mean radiance there, sr-1,
and diffuse and direct irradiance of level ground. Rows are that around the zenith, that of the sun (its almucantar) and some between; of
the columns those to the east, since the sun stands in the north. Needs numpy and PythonicDISORT 1.8.
"""

import csv
import math
import pathlib
import sys
import tomllib

import numpy
from PythonicDISORT import subroutines
from PythonicDISORT.pydisort import pydisort

STREAMS = 48


def column(folder, spec, nm):
    """A spectrum of the scene at `nm`, linear between its rows."""
    rows = [row for row in csv.reader((folder / spec["file"]).open()) if not row[0].startswith("#")]
    at = rows[0].index(spec["column"])
    table = numpy.array([[float(row[0]), float(row[at])] for row in rows[1:]])
    return numpy.interp(nm, table[:, 0], table[:, 1])


def layers(folder, component):
    """Density by layer, from the top down; the last layer of the file is the one below the ground."""
    data = (folder / component["density"]["grid"] / "c/0/0/0").read_bytes()
    return numpy.frombuffer(data, "<f4").astype(float)[:0:-1]


def legendre(component, folder, nm):
    """Coefficients g_l of a phase function sum (2 l + 1) g_l P_l."""
    phase = component["phase"]
    order = numpy.arange(STREAMS)
    if "hg" in phase:
        return column(folder, phase["hg"], nm) ** order
    gamma = phase["rayleigh"] / (2 - phase["rayleigh"])
    moments = numpy.zeros(STREAMS)
    moments[0], moments[2] = 1, (1 - gamma) / (10 * (1 + 2 * gamma))
    return moments


def main():
    folder = pathlib.Path(sys.argv[1])
    scene = tomllib.loads((folder / "scene.toml").read_text())
    x, y, z = scene["lights"][0]["directional"]["direction"]
    mu0 = -z / math.sqrt(x * x + y * y + z * z)
    sun = math.degrees(math.asin(mu0))
    albedo = scene["materials"]["ground"]["diffuse"]["reflectance"]
    components = scene["media"]["air"]["components"]
    print("# Radiance of a plane sky under an irradiance of 1 above the air, by PythonicDISORT 1.8, tests/python/disort_sky.py")
    print(f"# COMPUTED with {STREAMS} streams; sun at an elevation of {sun:.6f} degrees, albedo {albedo}")
    print("nm,row,column,radiance,diffuse,direct")
    for nm in map(float, sys.argv[2].split(",")):
        scattering, extinction, moments = 0, 0, 0
        for component in components:
            density = layers(folder, component)
            if "scattering" in component:
                scattered = column(folder, component["scattering"], nm) * density
                scattering = scattering + scattered
                extinction = extinction + scattered
                moments = moments + scattered[:, None] * legendre(component, folder, nm)[None, :]
            if "absorption" in component:
                extinction = extinction + column(folder, component["absorption"], nm) * density
        depth = numpy.cumsum(extinction)
        single = numpy.minimum(scattering / extinction, 1 - 1e-7)
        _, _, down, _, radiance = pydisort(
            depth, single, STREAMS, moments / scattering[:, None], mu0, 1.0, 0.0, BDRF_Fourier_modes=[albedo])
        between = subroutines.interpolate(radiance)
        diffuse, direct = down(depth[-1])
        for row in sorted({0, 20, math.floor(90 - sun), 65, 80}):
            for number in range(18, 36):
                elevations = numpy.radians(90 - row - (numpy.arange(4) + 0.5) / 4)
                azimuths = numpy.radians(10 * (number - 18) + numpy.arange(10) + 0.5)
                mean = numpy.mean(between(-numpy.sin(elevations), depth[-1], azimuths))
                print(f"{nm:g},{row},{number},{mean:.6e},{float(diffuse):.6e},{float(direct):.6e}", flush=True)


if __name__ == "__main__":
    main()

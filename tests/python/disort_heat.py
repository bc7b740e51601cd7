"""Heat of a plane sky at night by PythonicDISORT, as CSV: the answers that tests/render/heat_of_sky.rs holds renders against.

    spectile sky --night --scene FOLDER …
    disort_heat.py FOLDER NM[,NM…] > tests/data/disort_heat.csv

reads layers, temperatures, coefficients and ground of the scene itself, as disort_sky.py does; each layer has one temperature. Lines: nm, row
of a map of 180, the mean radiance there, W m-2 sr-1 nm-1, and the irradiance of level ground. Needs numpy and PythonicDISORT 1.8.
"""

import math
import pathlib
import sys
import tomllib

import numpy
from PythonicDISORT import subroutines
from PythonicDISORT.pydisort import pydisort

from disort_sky import column, legendre

STREAMS = 32
ROWS = 0, 30, 60, 80, 87


def planck(nm, kelvin):
    """W m-2 sr-1 nm-1, by CODATA 2018."""
    h, c, k = 6.62607015e-34, 299792458.0, 1.380649e-23
    metres = nm * 1e-9
    return 2e-9 * h * c**2 / metres**5 / numpy.expm1(h * c / (metres * k * kelvin))


def grid(folder, name):
    """From the top down, without what is below the ground."""
    return numpy.frombuffer((folder / name / "c/0/0/0").read_bytes(), "<f4").astype(float)[:0:-1]


def stack(folder, medium, thickness, above):
    """Kilometres, temperatures and components' densities of a medium's layers from `above` (km) up, from the top down."""
    temperature = grid(folder, medium["temperature"]["grid"])
    densities = [grid(folder, component["density"]["grid"]) for component in medium["components"]]
    kept = len(temperature) - round(above / thickness)
    return numpy.full(kept, thickness), temperature[:kept], [density[:kept] for density in densities]


def main():
    folder = pathlib.Path(sys.argv[1])
    scene = tomllib.loads((folder / "scene.toml").read_text())
    high, low = (scene["media"][name] for name in ("air", "low_air"))
    parts = stack(folder, high, 1.0, 2.0), stack(folder, low, 0.1, 0.0)
    thickness, kelvin = (numpy.concatenate([part[i] for part in parts]) for i in (0, 1))
    densities = [numpy.concatenate(pair) for pair in zip(parts[0][2], parts[1][2])]
    ground = scene["materials"]["ground"]["diffuse"]
    print("# Radiance of a plane sky at night, W m-2 sr-1 nm-1, by PythonicDISORT 1.8, tests/python/disort_heat.py")
    print(f"# COMPUTED with {STREAMS} streams; the ground at {ground['temperature']} K")
    print("nm,row,radiance,irradiance")
    for nm in map(float, sys.argv[2].split(",")):
        reflectance = numpy.interp(nm, *numpy.array(ground["reflectance"]["samples"]).T)
        scattering, extinction, moments = 0, 0, 0
        for component, density in zip(high["components"], densities):
            amount = density * thickness
            if "scattering" in component:
                scattered = column(folder, component["scattering"], nm) * amount
                scattering = scattering + scattered
                extinction = extinction + scattered
                moments = moments + scattered[:, None] * legendre(component, folder, nm)[None, :STREAMS]
            if "absorption" in component:
                extinction = extinction + column(folder, component["absorption"], nm) * amount
        depth = numpy.cumsum(extinction)
        _, _, down, _, radiance = pydisort(
            depth, scattering / extinction, STREAMS, moments / scattering[:, None], 0.5, 0.0, 0.0, NFourier=1,
            BDRF_Fourier_modes=[reflectance], b_pos=(1 - reflectance) * planck(nm, ground["temperature"]),
            s_poly_coeffs=planck(nm, kelvin)[:, None])
        between = subroutines.interpolate(radiance)
        for row in ROWS:
            elevations = numpy.radians(90 - row - (numpy.arange(4) + 0.5) / 4)
            mean = numpy.mean(between(-numpy.sin(elevations), depth[-1], 0.0))
            print(f"{nm:g},{row},{mean:.6e},{float(down(depth[-1])[0]):.6e}", flush=True)


if __name__ == "__main__":
    main()

"""A sky of `spectile sky` in the conditions of ASTM G173 against that standard and against SPCTRAL2 (PyPI pvlib), band by band:

    spectile sky --sun-elevation 41.81031 --aerosol 0.0767 --ozone 343.8 --water 1.4164 -o sky.zarr
    sky_irradiance.py sky.zarr

G173 gives direct light on a plane that faces the sun, and all light on a plane tilted by 37 degrees to the south. The second is summed up here
from the sky's own pixels, above and below the horizon. SPCTRAL2 gives level ground. Needs numpy, xarray, zarr and pvlib.
"""

import csv
import sys

import numpy
import pvlib
import xarray


def table(path, column):
    rows = [row for row in csv.reader(open(path)) if not row[0].startswith("#")]
    at = rows[0].index(column)
    return numpy.array([[float(row[0]), float(row[at])] for row in rows[1:]]).T


def main():
    path = sys.argv[1]
    stem = path.removesuffix(".zarr")
    cube = xarray.open_zarr(path)
    radiance, nm, edges = cube.radiance.values, cube.wavelength.values, cube.wavelength_bounds.values
    _, height, width = radiance.shape
    polar = (numpy.arange(height) + 0.5) * numpy.pi / height
    # Columns run from south over west; the middle is north.
    azimuth = (numpy.arange(width) + 0.5) * 2 * numpy.pi / width - numpy.pi
    solid = 2 * numpy.pi / width * (numpy.cos(polar - numpy.pi / height / 2) - numpy.cos(polar + numpy.pi / height / 2))
    tilt = numpy.radians(37)
    cosine = numpy.cos(polar)[:, None] * numpy.cos(tilt) + numpy.sin(polar)[:, None] * numpy.sin(tilt) * numpy.cos(azimuth - numpy.pi)
    tilted_sky = (radiance * (numpy.maximum(cosine, 0) * solid[:, None])[None]).sum(axis=(1, 2))
    direct = table(f"{stem}-irradiance.csv", "direct normal (W/m2/nm)")[1]
    level = table(f"{stem}-irradiance.csv", "global horizontal (W/m2/nm)")[1]
    diffuse = table(f"{stem}-irradiance.csv", "diffuse horizontal (W/m2/nm)")[1]
    zenith = numpy.arccos(1 / 1.5)
    tilted = tilted_sky + direct * numpy.cos(zenith - tilt)

    standard = pvlib.spectrum.get_reference_spectra(standard="ASTM G173-03")
    def of_standard(name):
        at, value = standard.index.values, standard[name].values
        fine = [numpy.linspace(a, b, 200) for a, b in edges]
        return numpy.array([numpy.interp(f, at, value).mean() for f in fine])
    known = pvlib.spectrum.spectrl2(
        apparent_zenith=numpy.degrees(zenith), aoi=numpy.degrees(zenith), surface_tilt=0, ground_albedo=0.2,
        surface_pressure=101325, relative_airmass=1.5, precipitable_water=1.4164, ozone=0.3438,
        aerosol_turbidity_500nm=0.084, dayofyear=94)
    at = known["wavelength"]
    of_model = lambda name: numpy.interp(nm, at, known[name].ravel())
    direct_known, tilted_known = of_standard("direct"), of_standard("global")
    level_model = of_model("poa_direct") + of_model("poa_sky_diffuse")
    widths = edges[:, 1] - edges[:, 0]
    print("from nm  direct, tilted: off ASTM G173;  level, diffuse: off SPCTRAL2 (percent)")
    for low, high in [(380, 2500), (400, 500), (500, 600), (600, 700), (700, 900), (900, 1100), (1100, 1500), (1500, 1800), (1800, 2500)]:
        inside = (nm > low) & (nm < high)
        total = lambda spectrum: (spectrum * widths)[inside].sum()
        off = lambda a, b: 100 * (total(a) / total(b) - 1)
        print(f"{low:5} {high:5}  {off(direct, direct_known):+6.2f} {off(tilted, tilted_known):+6.2f}   "
              f"{off(level, level_model):+6.2f} {off(diffuse, of_model('poa_sky_diffuse')):+6.2f}   "
              f"W/m2: {total(direct):.1f} {total(tilted):.1f} {total(level):.1f} {total(diffuse):.1f}")


if __name__ == "__main__":
    main()

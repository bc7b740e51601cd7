"""The notebooks run as they stand, and what they say is so."""

import runpy

import pytest
from conftest import ROOT

NOTEBOOKS = ROOT / "python/notebooks"


@pytest.fixture
def run(tmp_path, monkeypatch):
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("agg")
    monkeypatch.chdir(tmp_path)

    def run(name):
        names = runpy.run_path(str(NOTEBOOKS / name))
        matplotlib.pyplot.close("all")
        return names

    return run


def test_each_is_run_here():
    there = {path.name for path in NOTEBOOKS.iterdir() if path.suffix == ".py"}
    assert there == {"first_render.py", "lamp_and_paint.py", "sentinel2.py", "error_against_time.py"}
    for name in there:
        assert (NOTEBOOKS / name).read_text().startswith("# %% [markdown]\n# # ")


def test_first_render(run):
    names = run("first_render.py")
    assert names["cube"].sizes["wavelength"] == 80
    # The paint shows, but for light that ball and floor throw at each other.
    assert names["worst"] < 0.02


def test_lamp_and_paint(run):
    pytest.importorskip("colour")
    names = run("lamp_and_paint.py")
    # A colour difference of 1 is just seen.
    assert names["differences"]["D65"] < 1 < names["differences"]["A"]


def test_sentinel2(run):
    names = run("sentinel2.py")
    bands = names["reflectance"]
    # Bare soil, to the left, has the reflectance that it was given, but for what the bands average over.
    at = {"B2": 492.4, "B4": 664.6, "B8A": 864.7, "B12": 2202.4}
    import numpy

    for name, centre in at.items():
        soil = float(bands.sel(wavelength=name).isel(x=0).mean())
        expected = numpy.interp(centre, names["nm"], names["soil"])
        assert soil == pytest.approx(expected, rel=0.05), name
    assert float(names["ndvi"].max()) > 0.7 > 0.35 > float(names["ndvi"].min())


def test_error_against_time(run):
    names = run("error_against_time.py")
    # Independent samples: one half, and the reference has a little of its own.
    assert -0.6 < names["slope"] < -0.4
    last = names["estimates"][-1][2]
    assert last == pytest.approx(names["errors"][-1], rel=0.35)

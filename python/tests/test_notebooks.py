"""The notebooks run as they stand, and what they say is so."""

import os
import pathlib
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


def test_sentinel2(run, tmp_path, monkeypatch):
    import numpy

    # The scene with what is made for it: tests/package has it made, and so does `scenes/render grove`.
    grove = pathlib.Path(os.environ.get("SPECTILE_GROVE") or ROOT / "scenes/grove")
    if not (grove / "generated/trees.csv").exists():
        pytest.skip(f"{grove} has no trees: scenes/render grove makes them")
    for folder, target in {"scenes/grove": grove, "docs/examples": ROOT / "docs/examples"}.items():
        (tmp_path / folder).parent.mkdir()
        (tmp_path / folder).symlink_to(target, target_is_directory=True)
    (tmp_path / "python/notebooks").mkdir(parents=True)
    monkeypatch.chdir(tmp_path / "python/notebooks")
    names = run("sentinel2.py")
    # The plane of litter has litter's reflectance, averaged over each band by the light, which is even but in the wide ones.
    ground = numpy.genfromtxt(ROOT / "scenes/grove/spectra/ground.csv", delimiter=",", skip_header=3)
    response = numpy.genfromtxt(ROOT / "docs/examples/sentinel2a.csv", delimiter=",", skip_header=3, dtype=None, encoding=None)
    for name, tolerance in {"B2": 0.03, "B3": 0.01, "B4": 0.01, "B5": 0.01, "B8A": 0.01, "B11": 0.01, "B12": 0.03}.items():
        nm, weight = numpy.transpose([(x, w) for band, x, w in response.tolist() if band == name])
        expected = numpy.average(numpy.interp(nm, ground[:, 0], ground[:, 2]), weights=weight)
        assert float(names["of_litter"].sel(band=name)) == pytest.approx(expected, rel=tolerance), name
    # Leaves hide the litter, whose NDVI is 0.28; where half of the trees are gone, less of it.
    assert 0.28 < float(names["ndvi"].min()) < names["thinned"] < names["dense"] - 0.05 < 0.85
    assert float(names["ndvi"].max()) > 0.85


def test_error_against_time(run):
    names = run("error_against_time.py")
    # Independent samples: one half, and the reference has a little of its own.
    assert -0.6 < names["slope"] < -0.4
    last = names["estimates"][-1][2]
    assert last == pytest.approx(names["errors"][-1], rel=0.35)

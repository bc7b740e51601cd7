"""Cubes as xarray's Datasets: what they hold, that they are lazy, and what becomes of them."""

import math
import os
import zlib

import numpy
import pytest
import xarray
from conftest import ball, content, program

import spectile as sp


@pytest.fixture(scope="module")
def cube(tmp_path_factory):
    scene = ball(integrator={"epoch": 4, "max_bounces": 2})
    return sp.render(scene, tmp_path_factory.mktemp("cube") / "cube.zarr", spp=16, uncertainty=True)


def test_engine_and_guess_open_what_zarr_holds(cube):
    path = cube.encoding["source"]
    plain = xarray.open_zarr(path)
    for found in (sp.open_cube(path), xarray.open_dataset(path, engine="spectile"), xarray.open_dataset(path)):
        assert found.radiance.equals(plain.radiance) and found.standard_error.equals(plain.standard_error)
        assert found.radiance.attrs["units"] == "W m-2 sr-1 nm-1"
        assert found.wavelength.attrs["units"] == "nm" and "wavelength_bounds" in found.coords
        assert found.wavelength_bounds.values.tolist() == [[400.0 + 50 * k, 450.0 + 50 * k] for k in range(6)]
        assert (found.standard_error > 0).any()
    assert isinstance(cube, xarray.Dataset) and isinstance(sp.open_cube(path), sp.Cube)
    part = xarray.open_dataset(path, engine="spectile", drop_variables=["overview"])
    assert "overview" not in part


def test_layers_lie_beside_the_radiance(tmp_path):
    found = sp.render(ball(), tmp_path / "cube.zarr", spp=1, layers=["material", "depth"])
    assert found.depth.dims == ("y", "x") and found.material.dtype == numpy.int32 and "normal" not in found
    assert numpy.array_equal(found.depth.isnull().values, found.material.values < 0)
    with pytest.raises(sp.UsageError, match="layers are depth, normal"):
        sp.render(ball(), tmp_path / "none.zarr", spp=1, layers=["depht"])


@pytest.mark.skipif(not os.path.exists("/proc/self/io"), reason="asks Linux what was read")
def test_a_cube_of_a_gibibyte_is_opened_without_reading_it(tmp_path):
    scene = ball(film={"width": 1024, "height": 1024}, channels={"equal": {"from": 400, "to": 700, "count": 256}})
    sp.render(scene, tmp_path / "large.zarr", spp=1, tiles=(0, 1), tile=64)

    def read():
        with open("/proc/self/io") as io:
            return int(io.readline().split()[1])

    sp.open_cube(tmp_path / "large.zarr")
    before = read()
    large = sp.open_cube(tmp_path / "large.zarr")
    assert large.radiance.nbytes == 1 << 30
    assert read() - before < 1 << 20
    before = read()
    assert large.radiance.isel(x=10, y=10).notnull().all() and large.radiance.isel(x=500, y=500).isnull().all()
    # One tile is one chunk.
    assert 1 << 20 < read() - before < 2 * 64 * 64 * 256 * 4


def test_what_is_no_cube_is_refused(tmp_path, cube):
    for path, words in [(tmp_path / "none.zarr", "no Zarr group"), (tmp_path, "no Zarr group")]:
        with pytest.raises(sp.StorageError, match=words):
            sp.open_cube(path)
    xarray.Dataset({"a": ("x", [1.0])}).to_zarr(tmp_path / "other.zarr", zarr_format=3, consolidated=False)
    with pytest.raises(sp.StorageError, match="no cube of Spectile"):
        sp.open_cube(tmp_path / "other.zarr")
    assert "a" in xarray.open_dataset(tmp_path / "other.zarr", engine="zarr", consolidated=False)


def test_rgb_is_the_picture_that_export_writes(cube, tmp_path):
    for exposure in (None, -1.5):
        option = [] if exposure is None else ["--exposure", str(exposure)]
        done = program("export", cube.encoding["source"], "-o", tmp_path / "a.png", "--overwrite", *option)
        if done.returncode == 2 and "--overwrite" in done.stderr:
            done = program("export", cube.encoding["source"], "-o", tmp_path / f"{exposure}.png", *option)
            (tmp_path / f"{exposure}.png").replace(tmp_path / "a.png")
        assert done.returncode == 0, done.stderr
        picture = sp.rgb(cube, exposure)
        assert picture.dims == ("y", "x", "rgb") and picture.dtype == numpy.uint8
        assert numpy.array_equal(decoded((tmp_path / "a.png").read_bytes()), picture.values)
        assert exposure is None or picture.attrs["exposure_ev"] == exposure
    assert numpy.array_equal(sp.rgb(cube.isel(x=slice(4, 8)), 0.0).values, sp.rgb(cube, 0.0).values[:, 4:8])


def decoded(png):
    """Pixels of an 8-bit PNG in colour, with the filters that encoders choose."""
    at, data, width, height = 8, b"", 0, 0
    while at < len(png):
        length, kind = int.from_bytes(png[at : at + 4]), png[at + 4 : at + 8]
        body = png[at + 8 : at + 8 + length]
        if kind == b"IHDR":
            width, height = int.from_bytes(body[:4]), int.from_bytes(body[4:8])
            assert body[8:10] == b"\x08\x02"
        data += body if kind == b"IDAT" else b""
        at += 12 + length
    rows, above = zlib.decompress(data), numpy.zeros(width * 3, int)
    picture = []
    for y in range(height):
        kind, row = rows[y * (width * 3 + 1)], list(rows[y * (width * 3 + 1) + 1 : (y + 1) * (width * 3 + 1)])
        for i in range(len(row)):
            a, b, c = row[i - 3] if i >= 3 else 0, int(above[i]), int(above[i - 3]) if i >= 3 else 0
            p = a + b - c
            paeth = min((a, b, c), key=lambda v: (abs(p - v), (a, b, c).index(v)))
            row[i] = (row[i] + [0, a, b, (a + b) // 2, paeth][kind]) & 255
        above = numpy.array(row)
        picture.append(row)
    return numpy.array(picture, numpy.uint8).reshape(height, width, 3)


def test_notebooks_show_picture_and_spectrum(cube, tmp_path, monkeypatch):
    import base64
    import re

    page = cube._repr_html_()
    png = base64.b64decode(re.search(r"data:image/png;base64,([^\"]+)", page)[1])
    assert numpy.array_equal(decoded(png), sp.rgb(cube).values)
    assert page.count("<svg width") == 1 and "W m⁻² sr⁻¹ nm⁻¹" in page and "<script" not in page.split("xr-wrap")[0]
    unrendered = sp.render(ball(film={"width": 64, "height": 64}), tmp_path / "c.zarr", spp=1, tiles=(0, 1), tile=8)
    assert "nothing is rendered in the middle yet" in unrendered._repr_html_()
    assert "<img" not in cube[["samples"]]._repr_html_()
    monkeypatch.setattr("spectile._cube.MOST_BYTES", 1000)
    assert "<img" not in cube._repr_html_() and "spectile.rgb shows it" in cube._repr_html_()


def test_cubes_are_written_again_as_any_dataset(cube, tmp_path):
    part = cube.isel(wavelength=slice(1, 4), x=slice(2, 9))
    assert isinstance(part, sp.Cube)
    part.to_zarr(tmp_path / "part.zarr", zarr_format=3, consolidated=False)
    again = xarray.open_zarr(tmp_path / "part.zarr", consolidated=False)
    assert again.radiance.equals(part.radiance) and again.radiance.attrs["units"] == "W m-2 sr-1 nm-1"


def test_compare_by_channel(cube, tmp_path):
    other = sp.render(ball(integrator={"epoch": 4, "max_bounces": 2}), tmp_path / "b.zarr", spp=16, seed=1)
    found = sp.compare(cube, other)
    a, b = cube.radiance.values.astype(float), other.radiance.values.astype(float)
    numpy.testing.assert_allclose(found.bias, (a - b).mean(axis=(1, 2)), rtol=1e-6, atol=1e-12)
    numpy.testing.assert_allclose(found.rmse, numpy.sqrt(((a - b) ** 2).mean(axis=(1, 2))), rtol=1e-6)
    level = (0.01 * b.mean(axis=(1, 2), keepdims=True)) ** 2
    numpy.testing.assert_allclose(found.rel_mse, ((a - b) ** 2 / (b**2 + level)).mean(axis=(1, 2)), rtol=1e-6)
    assert found.attrs["rel_mse_largest"] == pytest.approx(float(found.rel_mse.max())) and numpy.isfinite(found.z).all()
    assert not sp.compare(cube, other, tolerance=1e-9).attrs["passed"]
    assert sp.compare(cube, cube.encoding["source"], tolerance=0).attrs["passed"]


def test_changed_datasets_are_not_taken_for_what_is_on_disk(cube):
    brighter = cube.assign(radiance=cube.radiance * 2)
    for changed in (brighter, cube.isel(x=slice(0, 4)), cube.isel(wavelength=[1, 0, 2, 3, 4, 5]), cube * 2):
        with pytest.raises(sp.UsageError, match="disk"):
            sp.compare(changed, cube)
    with pytest.raises(TypeError):
        sp.compare(3, cube)


def test_sensors_by_file_and_mapping(cube, tmp_path):
    nm = numpy.arange(400.0, 701.0, 5.0)
    bands = {"blue": numpy.exp(-(((nm - 470) / 20) ** 2)), "red": numpy.exp(-(((nm - 620) / 25) ** 2))}
    with pytest.warns(sp.SpectileWarning, match="channels"):
        made = sp.sensor(cube, responses={name: (nm, response) for name, response in bands.items()})
    rows = "".join(f"{x},{b!r},{r!r}\n" for x, b, r in zip(nm.tolist(), *(v.tolist() for v in bands.values())))
    (tmp_path / "s.csv").write_text("wavelength_nm,blue,red\n" + rows)
    with pytest.warns(sp.SpectileWarning):
        by_file = sp.sensor(cube, tmp_path / "s.zarr", responses=tmp_path / "s.csv")
    assert by_file.attrs["channel_names"] == ["blue", "red"]
    assert numpy.array_equal(made.radiance.values, by_file.radiance.values)
    # The mean of spectra that are constant within each channel, weighted by the response, linear between its nodes.
    fine = numpy.linspace(400, 700, 30001)
    weights = numpy.interp(fine, nm, bands["red"])
    which = numpy.clip(((fine - 400) / 50).astype(int), 0, 5)
    expected = numpy.trapezoid(weights * cube.radiance.values[which, 8, 8], fine) / numpy.trapezoid(weights, fine)
    assert float(made.radiance[1, 8, 8]) == pytest.approx(expected, rel=1e-4)
    with pytest.raises(sp.UsageError, match="not both"):
        sp.sensor(cube)
    with pytest.raises(sp.UsageError, match="exists already"):
        sp.sensor(cube, tmp_path / "s.zarr", responses=tmp_path / "s.csv")


MODEL = """\
[optics]
f_number = 2.5
[detector]
pitch = 15e-6
integration_time = 1e-6
quantum_efficiency = 0.8
read_noise = 20
gain = 100
bits = 14
[[bands]]
name = "red"
from = 600
to = 700
"""


def test_sensor_models_make_the_counts_of_the_program(cube, tmp_path):
    (tmp_path / "sensor.toml").write_text(MODEL)
    # A few samples are noisier than the sensor.
    with pytest.warns(sp.SpectileWarning, match="the noise of the cube itself"):
        counts = sp.sensor(cube, model=tmp_path / "sensor.toml", seed=3, electrons=True)
    words = ["--model", tmp_path / "sensor.toml", "--seed", "3", "--electrons", "-o", tmp_path / "counts.zarr", "--json"]
    done = program("sensor", cube.encoding["source"], *words)
    assert done.returncode == 0, done.stderr
    assert content(counts.encoding["source"]) == content(tmp_path / "counts.zarr")
    found = xarray.open_dataset(tmp_path / "counts.zarr", engine="spectile", mask_and_scale=False)
    assert found.counts.dtype == numpy.uint16 and counts.counts.sizes["band"] == 1 and "electrons" in counts
    assert numpy.array_equal(found.counts.values, counts.counts.values) and counts.counts.max() > 0
    with pytest.raises(sp.SceneError, match="gain") as caught:
        (tmp_path / "wrong.toml").write_text(MODEL.replace("gain = 100", "gain = -1"))
        sp.sensor(cube, model=tmp_path / "wrong.toml")
    assert (caught.value.line, caught.value.key) == (8, "detector.gain")
    with pytest.raises(sp.UsageError, match="no `preview`"):
        sp.rgb(counts)
    with pytest.raises(sp.UsageError, match="does not come from"):
        sp.compare(counts, cube)


def test_units_are_quantities_of_pint(cube):
    pytest.importorskip("pint_xarray")
    units = pytest.importorskip("cf_xarray.units").units
    radiance = cube.pint.quantify(unit_registry=units).radiance
    assert radiance.pint.to("mW / cm**2 / sr / um").pint.magnitude.max() == pytest.approx(
        100 * float(cube.radiance.max()), rel=1e-6
    )


def test_colour_science_both_ways(cube):
    colour = pytest.importorskip("colour")
    nm = numpy.arange(400.0, 701.0, 10.0)
    bands = numpy.stack([numpy.exp(-(((nm - centre) / 30) ** 2)) for centre in (480, 600)], axis=1)
    with pytest.warns(sp.SpectileWarning, match="channels"):
        by_colour = sp.sensor(cube, responses=colour.MultiSpectralDistributions(bands, nm, labels=["a", "b"]))
        by_arrays = sp.sensor(cube, responses={"a": (nm, bands[:, 0]), "b": (nm, bands[:, 1])})
    assert by_colour.attrs["channel_names"] == ["a", "b"] and by_colour.radiance.equals(by_arrays.radiance)
    pixel = sp.to_colour(cube.radiance.isel(x=8, y=8))
    assert isinstance(pixel, colour.SpectralDistribution)
    assert pixel.wavelengths.tolist() == cube.wavelength.values.tolist()
    row = sp.to_colour(cube.radiance.isel(y=8))
    assert isinstance(row, colour.MultiSpectralDistributions) and row.values.shape == (6, 16)
    assert numpy.array_equal(row.values[:, 8], pixel.values)
    scene = ball()
    paint = colour.SpectralDistribution({380: 0.05, 500: 0.1, 600: 0.7, 780: 0.8})
    scene["spectra"]["paint"] = paint
    assert scene.digest == ball().digest


def test_illuminants_are_the_standards():
    colour = pytest.importorskip("colour")
    for name in ("A", "D65", "D50", "FL2"):
        known = colour.SDS_ILLUMINANTS[name]
        found = dict(map(tuple, sp.illuminant(name, 3.0)["samples"]))
        at_560 = numpy.interp(560, known.wavelengths, known.values)
        shared = [(nm, value) for nm, value in zip(known.wavelengths, known.values) if float(nm) in found]
        assert len(shared) > 50 and found[560.0] == pytest.approx(3.0)
        for nm, value in shared:
            # The tables have six digits: half a unit of the last is 5e-6 at most.
            assert found[float(nm)] == pytest.approx(3.0 * value / at_560, rel=5e-6, abs=0), (name, nm)
    with pytest.raises(sp.UsageError, match="there is no"):
        sp.illuminant("Z")
    with pytest.raises(sp.UsageError, match="scale"):
        sp.illuminant("A", math.nan)
    scene = ball()
    scene["objects"][2]["emission"] = sp.illuminant("A", 5.0)
    assert scene.check()["warnings"] == []

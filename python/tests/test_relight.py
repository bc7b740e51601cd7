"""Factored cubes: other lamps, paints, temperatures and channels without tracing a path."""

import numpy
import pytest
from conftest import ball, content, program

import spectile as sp


@pytest.fixture(scope="module")
def weights(tmp_path_factory):
    scene = ball()
    scene["spectra"]["lamp"] = {"blackbody": 2856}
    scene["objects"][2]["emission"] = "lamp"
    scene["materials"]["floor"]["diffuse"]["temperature"] = 300
    return sp.render(scene, tmp_path_factory.mktemp("cube") / "weights.zarr", spp=16, factored=True)


def test_weights_are_the_bytes_of_the_program(weights, tmp_path):
    assert "radiance" not in weights and weights["weights"].dims == ("tile_y", "tile_x", "column", "entry")
    assert "paint" in weights.attrs["factored"]
    path = weights.encoding["source"]
    program("relight", path, "-o", tmp_path / "a.zarr", "--set", "spectra.paint=0.25")
    relit = sp.relight(weights, tmp_path / "b.zarr", spectra={"paint": 0.25})
    assert content(tmp_path / "a.zarr") == content(tmp_path / "b.zarr")
    assert relit.radiance.shape == (6, 16, 16)
    by_device = sp.relight(weights, spectra={"paint": 0.25}, devices=1)
    assert numpy.allclose(by_device.radiance, relit.radiance, rtol=2e-6, atol=0)


def test_spectra_are_taken_as_scenes_take_them(weights):
    nm = numpy.array([400.0, 500.0, 700.0])
    value = numpy.array([0.1, 0.8, 0.3])
    of_arrays = sp.relight(weights, spectra={"paint": (nm, value)})
    of_lists = sp.relight(weights, spectra={"paint": {"samples": [[400, 0.1], [500, 0.8], [700, 0.3]]}})
    assert of_arrays.radiance.equals(of_lists.radiance)
    assert not of_arrays.radiance.equals(sp.relight(weights).radiance)
    assert sp.relight(weights, paint=(nm, value)).radiance.equals(of_arrays.radiance)
    lamps = sp.relight(weights, lamp=sp.illuminant("A", 5.0), spectra={"paint": (nm, value)})
    assert lamps.radiance.equals(sp.relight(weights, spectra={"paint": (nm, value), "lamp": sp.illuminant("A", 5.0)}).radiance)
    dark = sp.relight(weights, spectra={"lamp": 0.0})
    twice = sp.relight(weights, spectra={"lamp": {"blackbody": 2856, "scale": 2.0}})
    once = sp.relight(weights)
    assert float(dark.radiance.max()) < 1e-12
    assert numpy.allclose(twice.radiance, 2 * once.radiance, rtol=1e-5)


def test_channels_bands_and_temperatures(weights):
    infrared = {"equal": {"from": 8000, "to": 12000, "count": 4}}
    cold, warm = (
        sp.relight(weights, channels=infrared, spectra={"lamp": 0.0}, temperatures={"floor": kelvin}) for kelvin in (300, 330)
    )
    assert cold.sizes["wavelength"] == 4
    # All light is the floor's: as Planck's law has it, hc/k = 14387.769 um K.
    um = cold.wavelength.values / 1000
    law = [1 / numpy.expm1(14387.769 / (um * kelvin)) for kelvin in (300, 330)]
    ratio = warm.radiance.mean(("x", "y")) / cold.radiance.mean(("x", "y"))
    assert numpy.allclose(ratio, law[1] / law[0], rtol=3e-3)
    green = sp.relight(weights, responses={"green": (numpy.array([500.0, 550.0, 600.0]), numpy.array([0.0, 1.0, 0.0]))})
    assert green.sizes["wavelength"] == 1 and float(green.wavelength[0]) == pytest.approx(550)


def test_what_cannot_be_changed_is_refused(weights, tmp_path):
    with pytest.raises(sp.UsageError, match="paint"):
        sp.relight(weights, spectra={"pain": 0.5})
    with pytest.raises(sp.UsageError, match="overwrit"):
        sp.relight(weights, overwrit=True)
    with pytest.raises(sp.UsageError, match="`paint` is given twice"):
        sp.relight(weights, paint=0.5, spectra={"paint": 0.5})
    with pytest.raises(sp.SceneError, match="must lie in"):
        sp.relight(weights, spectra={"paint": 1.5})
    with pytest.raises(sp.UsageError, match="not both"):
        sp.relight(weights, channels={"equal": {}}, responses="s.csv")
    plain = sp.render(ball(), tmp_path / "plain.zarr", spp=1)
    with pytest.raises(sp.UsageError, match="holds radiance"):
        sp.relight(plain)


def test_what_does_not_separate_is_kept_in_channels(tmp_path):
    scene = ball()
    scene["materials"]["shiny"] = {"plastic": {"reflectance": 0.5, "eta": 1.5, "roughness": 0.2}}
    scene["objects"][0]["material"] = "shiny"
    cube = sp.render(scene, tmp_path / "cube.zarr", spp=16, factored=True)
    remainder = cube["remainder"]
    assert remainder.dims == ("wavelength", "y", "x") and remainder.attrs["units"] == "W m-2 sr-1 nm-1"
    whole = sp.relight(cube)
    with pytest.warns(sp.SpectileWarning, match="is left out"):
        without = sp.relight(cube, without_remainder=True)
    assert float(remainder.max()) > 0
    assert numpy.allclose(whole.radiance.values, without.radiance.values + remainder.values, rtol=1e-6)
    other = {"equal": {"from": 400, "to": 700, "count": 5}}
    with pytest.raises(sp.UsageError, match="is no union of channels"):
        sp.relight(cube, channels=other)
    with pytest.warns(sp.SpectileWarning, match="is left out"):
        assert sp.relight(cube, channels=other, without_remainder=True).sizes["wavelength"] == 5

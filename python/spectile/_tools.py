"""What else Spectile does, from Python."""

from __future__ import annotations

import csv
import os
import tempfile
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from . import _spectile, _work
from ._errors import CheckFailed, NoDevice, UsageError
from ._scene import Scene, Spectrum, _overrides, _Reader, taken

if TYPE_CHECKING:
    import xarray

    from ._cube import Cube


def plan(
    scene: Scene | Mapping[str, Any] | str | os.PathLike[str],
    *,
    spp: int = 64,
    size: tuple[int, int] | None = None,
    tile: int | None = None,
    devices: str | int | list[int] = "all",
    memory: int | str | None = None,
    pilot: bool = False,
    overrides: Mapping[str, Any] | None = None,
) -> dict[str, Any]:
    """What rendering a scene would take, without rendering it: `features`, `evaluator`, `disk_bytes`, `device_scene_bytes`, `paths_per_s`,
    `predicted_s` and others; docs/json.md says what each means. Arguments are those of `render`; `pilot` decides by samples which paths are
    worth evaluating, as `render` does."""
    scene = taken(scene)
    arguments = ["plan", f"--spp={_work.whole('spp', spp)}", f"--devices={_work.chosen(devices)}"]
    arguments += _work.option("size", _work.pair(size)) + _work.option("pilot", bool(pilot))
    for name, value in {"tile": tile, "memory": memory}.items():
        arguments += _work.option(name, _work.whole(name, value))
    arguments += [f"--set={key}={value}" for key, value in _overrides(overrides)]
    facts = _work.run([*arguments, "--json", "--", scene.file], draft=scene._draft())
    return {key: value for key, value in facts.items() if key not in ("event", "time_s")}


def devices() -> list[dict[str, Any]]:
    """The adapters of this machine, in the order in which `render` counts them: name, kind, backend, driver, limits, `unusable` with the
    reason why one cannot render or None, and `chosen`, whether `render` takes it where one device is asked for. No adapter, no entry."""
    found: list[dict[str, Any]] = []

    def hear(event: dict[str, Any]) -> None:
        if event["event"] == "device":
            found.append({key: value for key, value in event.items() if key not in ("event", "time_s")})

    try:
        chosen = _work.run(["devices", "--json"], listener=hear).get("chosen")
    except NoDevice:
        chosen = None
    for entry in found:
        entry["chosen"] = entry["unusable"] is None and entry["name"] == chosen
        # Of adapters of one name the first.
        chosen = None if entry["chosen"] else chosen
    return found


def compare(a: Any, b: Any, *, tolerance: float | None = None) -> xarray.Dataset:
    """How a cube differs from a reference, channel by channel: `bias`, `rmse` in W m-2 sr-1 nm-1, `rel_mse`, the means of both, and where a
    cube has standard errors `z` and `z_rms`, all over `wavelength` in nm. Attributes: `pixels` compared, `pixels_in_all`, `rel_mse_mean`,
    `rel_mse_largest`, and with a tolerance of the largest relMSE `passed`.

    Both are cubes by name, or as `render` and `open_cube` give them.
    """
    import numpy
    import xarray

    from ._cube import path_of

    facts: dict[str, Any] = {}
    arguments = ["compare", *_work.option("tolerance", tolerance), "--json", "--", path_of(a, "compare"), path_of(b, "compare")]
    task = _Keeping(facts)
    try:
        _work.run(arguments, task=task)
    except CheckFailed:
        pass
    if not facts:
        raise UsageError("compare: ended without an answer")
    radiance = "W m-2 sr-1 nm-1"
    words = {
        "mean": ("mean radiance of the cube", radiance),
        "reference_mean": ("mean radiance of the reference", radiance),
        "bias": ("mean difference to the reference", radiance),
        "rmse": ("root of the mean squared difference", radiance),
        "rel_mse": ("relative mean squared difference", "1"),
        "z": ("difference of the means in units of its standard error", "1"),
        "z_rms": ("differences of pixels in units of their standard errors, root mean square", "1"),
    }

    def variable(name: str) -> tuple[str, Any, dict[str, str]]:
        each = [numpy.nan if channel[name] is None else channel[name] for channel in facts["channels"]]
        long_name, units = words[name]
        return "wavelength", numpy.array(each), {"long_name": long_name, "units": units}

    values = {name: variable(name) for name in words}
    nm = [channel["wavelength_nm"] for channel in facts["channels"]]
    attributes = {
        "pixels": facts["pixels"],
        "pixels_in_all": facts["pixels_in_all"],
        "rel_mse_mean": facts["rel_mse"]["mean"],
        "rel_mse_largest": facts["rel_mse"]["largest"],
    }
    if facts["passed"] is not None:
        attributes["passed"] = facts["passed"]
    wavelength = ("wavelength", nm, {"standard_name": "radiation_wavelength", "units": "nm"})
    return xarray.Dataset(values, coords={"wavelength": wavelength}, attrs=attributes)


class _Keeping:
    """A task that keeps `done` though the command fails after it."""

    def __init__(self, facts: dict[str, Any]) -> None:
        self.facts, self.task = facts, _spectile.Task()

    def run(self, arguments: list[str], draft: Any, hear: Any) -> None:
        def keep(event: dict[str, Any]) -> None:
            if event["event"] == "done":
                self.facts.update(event)
            hear(event)

        self.task.run(arguments, draft, keep)


def sensor(
    cube: Any,
    out: str | os.PathLike[str] | None = None,
    *,
    responses: Any = None,
    model: str | os.PathLike[str] | None = None,
    seed: int = 0,
    noise: bool = True,
    electrons: bool = False,
    partial: bool = False,
    overwrite: bool = False,
) -> Cube:
    """What a sensor would see of a cube.

    responses: the name of a CSV file, a mapping of band names to spectra as a scene takes them, or colour-science's
        `MultiSpectralDistributions`: mean radiances by band, a cube.
    model: the name of a file with optics and detector (docs/SENSORS.md): counts, with noise by `seed` unless `noise` is False, and
        `electrons` beside them; `partial` takes a cube of which tiles are missing.
    out: the store to make; None for a temporary one.

    >>> from spectile import render
    >>> cube = render({
    ...     "camera": {"orthographic": {"position": [0, 0, 1], "look_at": [0, 0, 0], "up": [0, 1, 0], "width": 2}},
    ...     "film": {"width": 4, "height": 2},
    ...     "channels": {"equal": {"from": 400, "to": 700, "count": 3}},  # nm
    ...     "spectra": {"light": 0.25},  # W m-2 sr-1 nm-1
    ...     "environment": {"radiance": "light"},
    ... }, spp=1)
    >>> bands = sensor(cube, responses={"blue": ([400, 500], [1, 1]), "all": ([400, 700], [1, 1])})  # nm, response
    >>> bands.attrs["channel_names"], bands.radiance.dims, bands.radiance.shape, float(bands.radiance.max())
    (['blue', 'all'], ('wavelength', 'y', 'x'), (2, 2, 4), 0.25)
    """
    import shutil

    from ._cube import opened, path_of, temporary

    if (responses is None) == (model is None):
        raise UsageError("sensor: give `responses` or `model`, and not both")
    if responses is not None and (seed or not noise or electrons or partial):
        raise UsageError("sensor: `seed`, `noise`, `electrons` and `partial` go with `model` only")
    if model is not None and not isinstance(model, (str, os.PathLike)):
        raise TypeError(f"sensor: `model` is the name of a file (docs/SENSORS.md), not a {type(model).__name__}")
    folder = tempfile.mkdtemp(prefix="spectile-")
    path = os.path.join(folder, "sensor.zarr") if out is None else os.fspath(out)
    try:
        arguments = ["sensor", f"--output={path}", *_work.option("overwrite", bool(overwrite))]
        if model is not None:
            arguments += [f"--model={os.fspath(model)}", f"--seed={seed}", f"--noise={'on' if noise else 'off'}"]
            arguments += _work.option("electrons", bool(electrons)) + _work.option("partial", bool(partial))
        else:
            arguments.append(_of_responses(folder, responses))
        _work.run([*arguments, "--json", "--", path_of(cube, "sensor")])
        if out is None:
            return temporary(folder, path)
    except BaseException:
        shutil.rmtree(folder, ignore_errors=True)
        raise
    shutil.rmtree(folder, ignore_errors=True)
    return opened(path)


def relight(
    cube: Any,
    out: str | os.PathLike[str] | None = None,
    *,
    spectra: Mapping[str, Any] | None = None,
    temperatures: Mapping[str, float] | None = None,
    channels: Mapping[str, Any] | None = None,
    responses: Any = None,
    without_remainder: bool = False,
    devices: str | int | list[int] | None = None,
    overwrite: bool = False,
    **named: Any,
) -> Cube:
    """A factored cube (`render(…, factored=True)`) under other spectra, temperatures or channels; no path is traced.

    spectra: by their names in the scene, each as a scene takes it: a number, a mapping such as {"blackbody": 2700}, wavelengths and
        values in any form of which `Scene` makes spectra. Those whose names are words may be arguments of their own:
        `relight(cube, lamp=illuminant("A"))`.
    temperatures: of materials by name, K. channels: as in a scene, such as {"equal": {"from": 400, "to": 700, "count": 30}}.
    responses: channels that are bands of a sensor, as `sensor` takes them.
    without_remainder: leave out what does not separate, which else is as it was rendered, and known only in unions of its channels.
    devices: make radiance on these, as `render` takes them, and not on the processor; the last bits of values may differ.
    out: the cube to make; None for a temporary one.

    >>> from spectile import render
    >>> cube = render({
    ...     "camera": {"orthographic": {"position": [0, 0, 1], "look_at": [0, 0, 0], "up": [0, 1, 0], "width": 2}},
    ...     "film": {"width": 4, "height": 2},
    ...     "channels": {"equal": {"from": 400, "to": 700, "count": 3}},  # nm
    ...     "spectra": {"light": 0.25},  # W m-2 sr-1 nm-1
    ...     "environment": {"radiance": "light"},
    ... }, spp=1, factored=True)
    >>> relit = relight(cube, light=0.5)
    >>> relit.radiance.dims, relit.radiance.shape, float(relit.radiance.max())
    (('wavelength', 'y', 'x'), (3, 2, 4), 0.5)
    """
    import shutil

    from ._cube import opened, path_of, temporary

    if channels is not None and responses is not None:
        raise UsageError("relight: give `channels` or `responses`, and not both")
    reader = _Reader("spectra")
    folder = tempfile.mkdtemp(prefix="spectile-")
    path = os.path.join(folder, "relit.zarr") if out is None else os.fspath(out)
    try:
        arguments = ["relight", f"--output={path}", *_work.option("overwrite", bool(overwrite))]
        arguments += _work.option("without-remainder", bool(without_remainder))
        arguments += _work.option("devices", None if devices is None else _work.chosen(devices))
        twice = sorted(set(named) & set(spectra or {}))
        if twice:
            raise UsageError(f"relight: `{twice[0]}` is given twice, by itself and in `spectra`")
        for i, (name, given) in enumerate({**(spectra or {}), **named}.items()):
            spectrum = reader.spectrum(given, (str(name),))
            value = given if spectrum is None else {"samples": spectrum.pairs}
            if spectrum is not None and not spectrum.is_plain:
                value = {"file": _write_spectrum(os.path.join(folder, f"spectrum-{i}.csv"), spectrum)}
            arguments.append(f"--set=spectra.{_work.toml(str(name))}={_work.toml(value)}")
        for name, kelvin in (temperatures or {}).items():
            arguments.append(f"--set=materials.{_work.toml(str(name))}.temperature={_work.toml(kelvin)}")
        arguments += [f"--channels={key}={_work.toml(value)}" for key, value in (channels or {}).items()]
        if responses is not None:
            arguments.append(_of_responses(folder, responses))
        _work.run([*arguments, "--json", "--", path_of(cube, "relight")])
        if out is None:
            return temporary(folder, path)
    except BaseException:
        shutil.rmtree(folder, ignore_errors=True)
        raise
    shutil.rmtree(folder, ignore_errors=True)
    return opened(path)


def _of_responses(folder: str, responses: Any) -> str:
    """The argument that names responses: their file, or one that is made of them in `folder`."""
    if isinstance(responses, (str, os.PathLike)):
        return f"--responses={os.fspath(responses)}"
    file = os.path.join(folder, "responses.csv")
    _write_responses(file, responses)
    return f"--responses={file}"


def _write_responses(file: str, responses: Any) -> None:
    """A CSV file of bands; each keeps its own wavelengths."""
    if hasattr(responses, "wavelengths") and hasattr(responses, "labels"):
        nm = responses.wavelengths
        bands = {str(label): (nm, responses.values[:, i]) for i, label in enumerate(responses.labels)}
    elif isinstance(responses, Mapping):
        bands = dict(responses)
    else:
        raise TypeError(f"responses are a file, a mapping of names to spectra, or colour-science's, not {type(responses).__name__}")
    reader = _Reader("responses")
    with open(file, "w", newline="", encoding="utf-8") as text:
        rows = csv.writer(text)
        rows.writerow(["band", "wavelength_nm", "response"])
        for name, spectrum in bands.items():
            found = reader.spectrum(spectrum, (str(name),))
            if found is None:
                raise UsageError(f"the response of band {name!r} is no spectrum; give an array [n, 2] of nm and response")
            # Of responses the unit does not matter.
            samples = found.plain(reader, [found.header[0], "value"]) if found.axis else found.pairs
            rows.writerows([str(name), repr(nm), repr(value)] for nm, value in samples)


def _write_spectrum(file: str, spectrum: Spectrum) -> str:
    """A CSV file of what an array says of its spectrum; gives its name back."""
    with open(file, "w", newline="", encoding="utf-8") as text:
        rows = csv.writer(text)
        rows.writerow(spectrum.header[:2])
        rows.writerows([repr(nm), repr(value)] for nm, value in spectrum.pairs)
    return file


def illuminant(name: str, scale: float = 1.0) -> dict[str, Any]:
    """A standard illuminant as a spectrum of a scene, of the value `scale` at 560 nm (such as W m-2 sr-1 nm-1 of a lamp's radiance).

    "A" by the CIE's formula (CIE 015:2018, 4.1.1), every nm from 300 to 830; "D65", every 5 nm from 300 to 780; "E", equal at all
    wavelengths; and, where colour-science is installed, every other that it has, under its name there ("D50", "FL2", …).

    >>> illuminant("E")
    {'constant': 1.0}
    >>> lamp = illuminant("A", scale=2.0)
    >>> [value for nm, value in lamp["samples"] if nm == 560.0]
    [2.0]
    """
    import math

    if not (scale >= 0.0 and math.isfinite(scale)):
        raise UsageError(f"illuminant: `scale` is a number of at least 0, not {scale}")
    if name == "E":
        return {"constant": float(scale)}
    if name == "A":
        at_560 = math.expm1(1.435e7 / (2848.0 * 560.0))
        power = [(float(nm), (560.0 / nm) ** 5 * at_560 / math.expm1(1.435e7 / (2848.0 * nm))) for nm in range(300, 831)]
        return {"samples": [[nm, scale * value] for nm, value in power]}
    if name == "D65":
        return {"samples": [[nm, scale * value] for nm, value in _spectile.D65]}
    try:
        import colour
    except ImportError:
        raise UsageError(
            f'illuminant: "{name}" is not A, D65 or E; with colour-science installed its illuminants are there too'
        ) from None
    known = colour.SDS_ILLUMINANTS
    if name not in known:
        raise UsageError(f'illuminant: there is no "{name}"; colour-science has {", ".join(sorted(known))}')
    distribution = known[name]
    nm, values = distribution.wavelengths.tolist(), distribution.values.tolist()
    at = float(_interpolated(560.0, nm, values))
    if at <= 0.0:
        raise UsageError(f'illuminant: "{name}" is dark at 560 nm, where `scale` is its value')
    return {"samples": [[x, scale * value / at] for x, value in zip(nm, values, strict=True)]}


def _interpolated(x: float, xs: list[float], ys: list[float]) -> Any:
    import numpy

    return numpy.interp(x, xs, ys)


def to_colour(spectra: xarray.DataArray) -> Any:
    """`spectra` over `wavelength` for colour-science: a SpectralDistribution, or MultiSpectralDistributions of all others of its values, in the
    order of its other dimensions, labelled by their positions. Wavelengths must be in nm, and ascend once sorted.

    Raises ImportError where colour-science is not installed.

    >>> import numpy, xarray
    >>> flat = xarray.DataArray(numpy.ones((3, 2)), dims=("wavelength", "x"), coords={"wavelength": [400.0, 500.0, 600.0]})
    >>> to_colour(flat.isel(x=0)).values.tolist()
    [1.0, 1.0, 1.0]
    >>> to_colour(flat).labels
    ['0', '1']
    """
    import colour
    import numpy

    if not (hasattr(spectra, "dims") and hasattr(spectra, "ndim")):
        kind = type(spectra).__name__
        raise TypeError(f"to_colour: spectra are an xarray.DataArray over `wavelength`, such as cube.radiance, not a {kind}")
    if "wavelength" not in spectra.dims:
        raise UsageError("to_colour: the array has no dimension `wavelength`")
    ordered = spectra.transpose("wavelength", ...).sortby("wavelength")
    nm = ordered["wavelength"].values
    if (numpy.diff(nm) <= 0).any():
        raise UsageError("to_colour: channels of one wavelength cannot be told apart in colour-science")
    if ordered.ndim == 1:
        return colour.SpectralDistribution(
            dict(zip(nm.tolist(), ordered.values.tolist(), strict=True)), name=str(spectra.name or "spectrum")
        )
    shape = ordered.shape[1:]
    labels = [" ".join(map(str, index)) for index in numpy.ndindex(shape)]
    values = ordered.values.reshape(len(nm), -1).astype(float)
    return colour.MultiSpectralDistributions(values, nm, labels=labels)

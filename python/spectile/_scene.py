"""Scenes as nested mappings, and what of Python stands in them for spectra, meshes, textures and grids."""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Mapping, Sequence
from typing import Any, TypeGuard

from . import _spectile, _work
from ._errors import SceneError, mistake

# Pairs of numbers stand there as they are; anywhere else an array of pairs is a spectrum.
_PAIRS = ("samples", "intervals")
# Where a file would be named that holds a picture or voxels.
_NUMBERS = ("texture", "grid")
# Where a file would be named that holds columns of numbers.
_COLUMNS = ("placements",)
# What the columns of an array of matrices [n, 3 or 4, 4] are.
_MATRIX = tuple(f"m{row}{column}" for row in range(3) for column in range(4))
# Where the name of a file stands and nothing else does.
_FILES = ("mesh", "file", "map", "table", "responses", "nk")
# Tables of items under names of the user's own, which mean nothing by themselves.
_NAMED = ("materials", "spectra", "media", "assemblies")
# What CF's attributes do to the numbers that they stand beside, and where they do nothing.
_PACKED = {"scale_factor": 1.0, "add_offset": 0.0}
# Far beyond any scene.
_DEEPEST = 60
# Nanometres in one unit of a wavelength; words also in the plural, and as the British spell them.
_NM = {"nm": 1.0, "nanometer": 1.0, "um": 1e3, "µm": 1e3, "μm": 1e3, "micrometer": 1e3, "micron": 1e3, "m": 1e9, "meter": 1e9}
_NM |= {"angstrom": 0.1, "Å": 0.1}


class Scene(dict[str, Any]):
    """A scene as nested dicts and lists, edited like the TOML that a scene file is.

    `Scene(mapping, folder=…)` makes one; `load` reads one from a file. Paths in it are relative to `folder`, that of the file or else
    the working directory at the time. Mappings and lists are copied, arrays are not.

    Wherever the scene has a spectrum, these may stand too: an array [n, 2] of wavelength in nm and value, a pair (wavelengths, values) of
    arrays of one dimension or lists, a mapping of wavelengths to values, an xarray.DataArray over `wavelength`, a pandas.Series over its
    index, or a `SpectralDistribution` of colour-science. In the place of a file's name: `mesh` takes a mapping of `vertices` [vertex, 3],
    `faces` [face, 3] counted from 0, and `uv` and `normals` by vertex or by corner [face, 3, …]; `texture` takes an array [y, x] or
    [y, x, channel], rows from the top, linear numbers; `grid` takes an array [z, y, x]; `placements` takes positions [n, 3] in metres,
    matrices [n, 4, 4] or their first three rows [n, 3, 4], or columns by name, as a mapping, a pandas.DataFrame or a structured array:
    `x`, `y`, `z`, and `yaw_degrees` and `scale` or not.

    >>> scene = Scene({"film": {"width": 64, "height": 48}})
    >>> scene["film"]["width"] = 32
    >>> scene
    Scene({'film': {'width': 32, 'height': 48}})
    """

    def __init__(self, mapping: Mapping[str, Any] = {}, *, folder: str | os.PathLike[str] | None = None) -> None:
        if not isinstance(mapping, Mapping):
            raise TypeError(f"a Scene is made of a mapping, not a {type(mapping).__name__}; spectile.load reads one from a file")
        super().__init__({key: _copied(value, (str(key),)) for key, value in mapping.items()})
        # Nothing is read from there: it says where relative paths begin, and what messages call the scene.
        self.file: str = os.path.join(os.path.abspath("." if folder is None else os.fspath(folder)), "<scene>")
        self._text: str = ""
        if isinstance(mapping, Scene) and folder is None:
            self.file, self._text = mapping.file, mapping._text

    @property
    def folder(self) -> str:
        """Where relative paths in the scene begin."""
        return os.path.dirname(self.file)

    def copy(self) -> Scene:
        """A scene of its own: what is changed in it does not change this one."""
        return Scene(self)

    def __copy__(self) -> Scene:
        return Scene(self)

    def __or__(self, other: Mapping[str, Any]) -> Scene:  # type: ignore[override]
        scene = Scene(self)
        scene.update({key: _copied(value, (str(key),)) for key, value in other.items()})
        return scene

    def __repr__(self) -> str:
        return f"Scene({super().__repr__()})"

    def check(self, overrides: Mapping[str, Any] | None = None) -> dict[str, Any]:
        """Reads all that the scene names and checks it, without rendering.

        `overrides` are as in `render`. Gives `digest`, the hex SHA-256 of all that decides the values of a cube, `warnings`, `size`
        (width and height in pixels) and `bounds_nm`, the two ends of each channel.

        Raises `SceneError` with every independent mistake.

        >>> import numpy
        >>> scene = Scene({
        ...     "camera": {"orthographic": {"position": [0, 0, 1], "look_at": [0, 0, 0], "up": [0, 1, 0], "width": 2}},
        ...     "film": {"width": 4, "height": 2},
        ...     "channels": {"intervals": numpy.array([[400, 500], [500, 700]])},  # [channel, 2], nm
        ...     "environment": {"radiance": numpy.array([[400, 0.0], [700, 0.3]])},  # [n, 2]: nm, W m-2 sr-1 nm-1
        ... })
        >>> facts = scene.check()
        >>> facts["size"], facts["bounds_nm"], len(facts["digest"])
        ([4, 2], [[400.0, 500.0], [500.0, 700.0]], 64)
        """
        _work.begin()
        return self._draft().check(_overrides(overrides))

    @property
    def digest(self) -> str:
        """Hex SHA-256 of the scene with all that it reads: two scenes that have one make the same cube with the same seed."""
        return str(self.check()["digest"])

    def _draft(self) -> _spectile.Draft:
        plain = _Reader(self.file).mapping(self, ())
        return _spectile.Draft(self.file, self._text, plain)


def load(file: str | os.PathLike[str]) -> Scene:
    """The scene in a TOML file (docs/scene.md), to be rendered or edited.

    Only the syntax is checked here; what the scene says is, when it is rendered or by `Scene.check`. Values that stay as they are in
    the file are named with their line in errors.

    Raises `SceneError` where the file cannot be read or is not TOML.
    """
    path = os.fspath(file)
    text, tree = _spectile.read_scene(path)
    scene = Scene(tree)
    scene.file, scene._text = os.path.abspath(path), text
    return scene


def taken(scene: Scene | Mapping[str, Any] | str | os.PathLike[str]) -> Scene:
    """The scene that a mapping is, or a file holds."""
    if isinstance(scene, Scene):
        return scene
    if isinstance(scene, Mapping):
        return Scene(scene)
    if not isinstance(scene, (str, os.PathLike)):
        raise TypeError(f"a scene is a Scene or another mapping, or the name of a file, not a {type(scene).__name__}")
    return load(scene)


def _overrides(overrides: Mapping[str, Any] | None) -> list[tuple[str, str]]:
    reader = _Reader("overrides")
    found = []
    for key, value in (overrides or {}).items():
        path = tuple(str(key).split("."))
        # Spectra in all forms that scenes take.
        spectrum = None if path[-1] in _PAIRS else reader.spectrum(value, path)
        if spectrum is not None:
            value = {"samples": spectrum.plain(reader)}
        found.append((key, _work.toml(value)))
    return found


def _copied(value: Any, path: tuple[str, ...]) -> Any:
    if not isinstance(value, (Mapping, list)):
        return value
    _not_too_deep("scene", path)
    if isinstance(value, Mapping):
        return {key: _copied(inner, (*path, str(key))) for key, inner in value.items()}
    return [_copied(item, (*path, str(i))) for i, item in enumerate(value)]


def _not_too_deep(file: str, path: tuple[str, ...]) -> None:
    if len(path) > _DEEPEST:
        raise mistake(file, _spelt(path[:4]) + " …", "is nested too deeply", "a mapping or list cannot contain itself")


def _spelt(path: tuple[str, ...]) -> str:
    """The dotted key; parts that TOML would quote are quoted."""
    return ".".join(part if re.fullmatch(r"[A-Za-z0-9_-]+", part) else _work.toml(part) for part in path)


def _of_numbers(mapping: Mapping[Any, Any]) -> bool:
    """Whether it is a spectrum as colour-science takes them: values by wavelengths."""
    return len(mapping) > 1 and all(hasattr(key, "__float__") for key in mapping)


def is_array(value: Any) -> TypeGuard[Any]:
    """Whether it is one of numpy, or can become one, and has dimensions."""
    return getattr(value, "ndim", 0) > 0 and hasattr(value, "__array__")


def _said(value: Any, *keys: str) -> list[str]:
    """What attributes of an array say, without what says nothing."""
    attributes = getattr(value, "attrs", None)
    found = [attributes.get(key) for key in keys] if isinstance(attributes, Mapping) else []
    return [text for text in (" ".join(said.split()) for said in found if isinstance(said, str)) if text]


class Spectrum:
    """Wavelengths and values, both [n], and what they are called as in the header of a file: `axis`, or `""`; values by several names, or
    none."""

    def __init__(self, path: tuple[str, ...], nm: Any, values: Any, axis: str = "", names: Sequence[str] = ()) -> None:
        self.path, self.axis, self.names = path, axis, [*names]
        self.pairs = [[float(x), float(y)] for x, y in zip(nm.tolist(), values.tolist(), strict=True)]

    @property
    def header(self) -> list[str]:
        return [self.axis or "wavelength (nm)", *(self.names or ["value"])]

    @property
    def is_plain(self) -> bool:
        return not (self.axis or self.names)

    def data(self, header: list[str]) -> _spectile.Data:
        import numpy

        return _spectile.spectrum(f"{_spelt(self.path)} (array {len(self.pairs)})", header, numpy.array(self.pairs))

    def plain(self, reader: _Reader, header: list[str] | None = None) -> list[list[float]]:
        """[nm, value] of a spectrum that is written where nothing is known of what it is to be."""
        if self.is_plain:
            return self.pairs
        samples = self.data(header or self.header).samples()
        if samples is None:
            message = f"calls its numbers `{', '.join(self.header)}`, which is not heeded here"
            help = "give them alone, as a pair of arrays: nm, and the unit that docs/scene.md names"
            raise reader.mistake(self.path, message, help)
        return [[nm, value] for nm, value in samples]

    def table(self) -> dict[str, Any]:
        """As a scene has it."""
        return {"samples": self.pairs} if self.is_plain else {"file": self.data(self.header)}


class _Reader:
    """Makes of a scene what the library takes: dicts, lists, scalars, and numbers where a file would be."""

    def __init__(self, file: str) -> None:
        self.file = file
        # What is held twice is copied once.
        self.known: dict[tuple[int, ...], Any] = {}

    def mistake(self, path: tuple[str, ...], message: str, help: str) -> SceneError:
        return mistake(self.file, _spelt(path), message, help)

    def mapping(self, mapping: Mapping[str, Any], path: tuple[str, ...]) -> dict[str, Any]:
        return {key: self.value(value, (*path, str(key))) for key, value in mapping.items()}

    def value(self, value: Any, path: tuple[str, ...]) -> Any:
        if isinstance(value, (str, bool, int, float)):
            return value
        _not_too_deep(self.file, path)
        key = "" if len(path) == 2 and path[0] in _NAMED else path[-1]
        if key in _COLUMNS and value is not None and not isinstance(value, os.PathLike):
            return self.columns(value, path)
        if isinstance(value, Mapping) and not _of_numbers(value):
            return self.mesh(value, path) if key == "mesh" else self.labelled(self.mapping(value, path), path)
        if hasattr(value, "magnitude") and hasattr(value, "units"):
            message = f"has a unit of its own, {value.units}, which is not converted here"
            raise self.mistake(path, message, "give `.magnitude` in the unit that docs/scene.md names")
        if key in _NUMBERS and (is_array(value) or isinstance(value, (list, tuple))):
            return self.numbers(value, path)
        if key in _FILES and is_array(value):
            help = "a mesh is a mapping of vertices and faces" if key == "mesh" else "give the name of a file"
            raise self.mistake(path, "must not be an array", help)
        # As `samples` beside a `scale`: what has a name or a unit of its own may be told to be meant as it is.
        spectrum = None if key in _PAIRS and not hasattr(value, "attrs") else self.spectrum(value, path)
        if spectrum is not None:
            return spectrum.table()
        if is_array(value):
            return self.array(value, path, "iuf").tolist()
        if hasattr(value, "item") and getattr(value, "ndim", None) == 0:
            return value.item()
        if isinstance(value, (list, tuple)):
            return [self.value(item, (*path, str(i))) for i, item in enumerate(value)]
        return os.fspath(value) if isinstance(value, os.PathLike) else value

    def labelled(self, table: dict[str, Any], path: tuple[str, ...]) -> dict[str, Any]:
        """A table whose `samples` are an array that is a spectrum by itself, with what that is in their place."""
        spectrum = None if path in [(name,) for name in _NAMED] else table.get("samples")
        return {**{k: v for k, v in table.items() if k != "samples"}, **spectrum} if isinstance(spectrum, dict) else table

    def array(self, value: Any, path: tuple[str, ...], kinds: str) -> Any:
        """As numpy's, of one of some kinds of number."""
        import numpy

        attributes = getattr(value, "attrs", None)
        attributes = attributes if isinstance(attributes, Mapping) else {}
        for key, neutral in _PACKED.items():
            if key in attributes and attributes[key] != neutral:
                message = f"has the attribute `{key}` = {attributes[key]}, which is not applied here"
                raise self.mistake(path, message, "decode it, as xarray.decode_cf does, or remove the attribute")
        for holder in (value, getattr(value, "data", None)):
            unit = getattr(holder, "units", None) if hasattr(holder, "magnitude") else None
            if unit is not None:
                message = f"has a unit of its own, {unit}, which is not converted here"
                raise self.mistake(path, message, "give `.magnitude` in the unit that is meant: nm, and what docs/scene.md names")
        if numpy.ma.is_masked(value):
            raise self.mistake(path, "has masked values, of which nothing is known", "fill them, as with .filled(…)")
        array = numpy.asarray(value)
        if array.dtype.kind not in kinds:
            wanted = {"iu": "whole numbers", "f": "floating-point numbers"}.get(kinds, "numbers")
            raise self.mistake(path, f"must hold {wanted}, but is of type {array.dtype}", "convert it first")
        return array

    def spectrum(self, value: Any, path: tuple[str, ...]) -> Spectrum | None:
        """What is a spectrum by itself; None where nothing says that it is."""
        axis, names = "", []
        if isinstance(value, Mapping):
            if not _of_numbers(value):
                return None
            nm, values = [*value], [*value.values()]
        elif hasattr(value, "wavelengths") and hasattr(value, "values"):
            nm, values = value.wavelengths, value.values  # colour-science
        elif "wavelength" in getattr(value, "coords", ()):
            written = str(value.coords["wavelength"].attrs.get("units", "nm")).strip()
            unit = written if len(written) < 3 else written.lower().removesuffix("s").replace("metre", "meter")
            if unit not in _NM:
                raise self.mistake(path, f"has wavelengths in `{written}`", f"convert them to one of {', '.join(_NM)}")
            if value.dims != ("wavelength",):
                message = f"has the dimensions {', '.join(map(str, value.dims)) or 'none'}, but a spectrum has `wavelength` alone"
                raise self.mistake(path, message, "choose one, as with .isel(x=0, y=0)")
            nm = self.array(value.coords["wavelength"], path, "iuf") * _NM[unit]
            values = self.array(value, path, "iuf")
            words = re.findall("[a-z]+", " ".join(_said(value.coords["wavelength"], "long_name", "standard_name")).lower())
            axis, names = "wavelength in air (nm)" if "air" in words else "", self.names(value)
        elif hasattr(value, "index") and hasattr(value, "to_numpy") and not callable(value.index):
            if value.ndim != 1:
                raise self.mistake(path, "must not be a table", "choose one column of it")
            nm, values = value.index.to_numpy(), value.to_numpy()  # pandas
            axis, names = value.index.name if isinstance(value.index.name, str) else "", self.names(value)
        elif isinstance(value, tuple) and len(value) == 2 and all(is_array(part) or isinstance(part, list) for part in value):
            nm, values = value
        elif "wavelength" in getattr(value, "dims", ()):
            raise self.mistake(path, "has no coordinate `wavelength`", "add the wavelengths, as with .assign_coords(wavelength=nm)")
        elif is_array(value) and value.ndim == 2 and value.shape[1] == 2:
            pairs = self.array(value, path, "iuf")
            nm, values = pairs[:, 0], pairs[:, 1]
        else:
            return None
        nm, values = self.array(nm, path, "iuf"), self.array(values, path, "iuf")
        if nm.ndim != 1 or nm.shape != values.shape:
            message = f"has wavelengths of the shape {list(nm.shape)} and values of {list(values.shape)}"
            raise self.mistake(path, message, "a spectrum has one value for each wavelength")
        return Spectrum(path, nm, values, axis, names)

    def names(self, value: Any) -> list[str]:
        """What an array calls its numbers, the first with its unit, as in the header of a file."""
        names = [*_said(value, "long_name", "standard_name"), *([value.name] if isinstance(value.name, str) and value.name else [])]
        for unit in _said(value, "units"):
            names[:1] = [f"{re.sub(r'[([].*', '', names[0] if names else '').strip() or 'value'} ({unit})"]
        return names

    def once(self, parts: tuple[Any, ...], make: Callable[[], Any]) -> Any:
        key = tuple(id(part) for part in parts)
        if key not in self.known:
            # The parts are kept, so that nothing else gets their ids.
            self.known[key] = (make(), parts)
        return self.known[key][0]

    def numbers(self, value: Any, path: tuple[str, ...]) -> Any:
        import numpy

        def make() -> Any:
            ordered, kinds = value, "iuf" if path[-1] == "grid" else "f"
            if kinds == "f" and getattr(getattr(value, "dtype", None), "kind", "f") in "iub":
                message = f"holds whole numbers ({value.dtype}), which does not say what 1 is"
                raise self.mistake(path, message, "give linear floating-point numbers, as with array / 255 where they are shares")
            axes = ("z", "y", "x") if path[-1] == "grid" else ("y", "x")
            if set(axes) <= set(getattr(value, "dims", ())):
                ordered = value.transpose(*axes, ...)
            with numpy.errstate(over="ignore"):
                # What is too large becomes infinite, and is refused as that.
                array = numpy.require(self.array(ordered, path, kinds), numpy.float32, "A")
            if path[-1] == "grid" and array.ndim == 3:
                array = array[self.upward(ordered, path, axes)]
            shape = " x ".join(str(n) for n in array.shape)
            units, names = _said(value, "units"), _said(value, "standard_name", "long_name", "quantity")
            if isinstance(getattr(value, "name", None), str):
                names.append(value.name)
            return _spectile.numbers(f"{_spelt(path)} (array {shape})", array, units[0] if units else None, names)

        return self.once((value,), make)

    def upward(self, value: Any, path: tuple[str, ...], axes: tuple[str, ...]) -> tuple[slice, ...]:
        """What turns round the axes along which coordinates of a grid descend, as in Zarr arrays."""
        import numpy

        turned = []
        for axis in axes:
            places, down = numpy.zeros(0), False
            if axis in getattr(value, "coords", ()):
                coordinate = value.coords[axis]
                places, down = self.array(coordinate, path, "iuf").astype(float), "down" in _said(coordinate, "positive")
            steps = numpy.diff(places)
            if steps.size and not (steps[0] != 0 and numpy.allclose(steps, steps.mean(), rtol=1e-3, atol=0)):
                message = f"has coordinates along {axis} that are not evenly spaced"
                raise self.mistake(path, message, "resample it: the voxels of a grid have one size")
            turned.append(slice(None, None, -1) if steps.size and (steps[0] < 0) != down else slice(None))
        return tuple(turned)

    def columns(self, value: Any, path: tuple[str, ...]) -> Any:
        """Placements: numbers by name, or an array that says by its shape what it holds."""
        import numpy

        help = "give positions [n, 3], matrices [n, 4, 4] or [n, 3, 4], or columns x, y, z, yaw_degrees, scale by name"
        names = getattr(getattr(value, "dtype", None), "names", None)
        if names is None and (isinstance(value, Mapping) or hasattr(value, "columns")):
            names = [*value]

        def make() -> Any:
            if names is not None:
                # The library says which there may be.
                each = [self.array(value[name], (*path, str(name)), "iuf") for name in names]
                if len({column.shape for column in each}) > 1 or any(column.ndim != 1 for column in each):
                    shapes = ", ".join(f"{name} {list(column.shape)}" for name, column in zip(names, each, strict=True))
                    raise self.mistake(
                        path, f"has columns of different shapes: {shapes}", "give one number each for every instance"
                    )
                columns, rows = [str(name) for name in names], numpy.stack(each, axis=-1) if each else numpy.zeros((0, 0))
            else:
                array = self.array(value, path, "iuf")
                if array.ndim == 2 and array.shape[1] == 3:
                    columns, rows = ["x", "y", "z"], array
                elif array.ndim == 3 and array.shape[1:] in ((3, 4), (4, 4)):
                    if array.shape[1] == 4 and (array[:, 3] != [0, 0, 0, 1]).any():
                        row = array[(array[:, 3] != [0, 0, 0, 1]).any(axis=1), 3][0]
                        message = f"has a matrix whose last row is {row.tolist()}, not 0, 0, 0, 1"
                        raise self.mistake(path, message, "matrices act on column vectors: the translation is the last column")
                    columns, rows = list(_MATRIX), array[:, :3].reshape(-1, 12)
                else:
                    raise self.mistake(path, f"has the shape {list(array.shape)}", help)
            if not columns:
                raise self.mistake(path, "has no columns", help)
            rows = numpy.require(rows, numpy.float64, "A")
            return _spectile.table(f"{_spelt(path)} ({len(rows)} placements)", columns, rows)

        return self.once((value,), make)

    def mesh(self, value: Mapping[str, Any], path: tuple[str, ...]) -> Any:
        import numpy

        known = ("vertices", "faces", "uv", "normals")
        for key in value:
            if key not in known:
                raise self.mistake((*path, str(key)), f"unknown key `{key}`", f"known keys: {', '.join(known)}")
        for key in known[:2]:
            if value.get(key) is None:
                message = f"`{key}` is missing"
                raise self.mistake((*path, key), message, "a mesh has vertices [vertex, 3] and faces [face, 3]")

        def make() -> Any:
            def floats(key: str) -> Any:
                return numpy.require(self.array(value[key], (*path, key), "iuf"), numpy.float64, "A")

            faces = self.array(value["faces"], (*path, "faces"), "iu")
            wrong = faces[(faces < 0) | (faces > 0xFFFF_FFFF)]
            if wrong.size:
                raise self.mistake((*path, "faces"), f"names vertex {wrong[0]}", "vertices are counted from 0")
            parts = {key: floats(key) for key in ("uv", "normals") if value.get(key) is not None}
            name = f"{_spelt(path)} ({len(faces)} faces)"
            try:
                return _spectile.mesh(name, floats("vertices"), numpy.require(faces, numpy.uint32, "A"), **parts)
            except ValueError as error:
                raise self.mistake(path, str(error), "see spectile.Scene for the shapes") from None

        return self.once(tuple(value.get(key) for key in known), make)

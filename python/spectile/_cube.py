"""Cubes as xarray has them, and how they look in a notebook."""

from __future__ import annotations

import base64
import html
import math
import os
import struct
import zlib
from typing import Any

import numpy
import xarray

from . import _spectile, _work
from ._engine import Engine, Temporary
from ._errors import UsageError

# A picture in a notebook is reduced to this many pixels, and one that takes more bytes to read is not shown.
SHOWN_PIXELS = 1 << 18
MOST_BYTES = 1 << 28


class Cube(xarray.Dataset):
    """An xarray.Dataset of a cube (docs/cube.md): `radiance` [wavelength, y, x] in W m-2 sr-1 nm-1, `standard_error` where it was asked
    for, `samples` per tile, `preview` [y, x, rgb], `overview`, over `wavelength` in nm with its bounds. In a notebook it shows its
    picture and the spectrum in its middle above what a Dataset shows."""

    __slots__ = ()

    def _repr_html_(self) -> str:
        shown = []
        try:
            if "preview" in self and self["preview"].dims == ("y", "x", "rgb"):
                shown.append(_picture(self["preview"]))
            if "radiance" in self and set(self["radiance"].dims) == {"wavelength", "y", "x"}:
                shown.append(_spectrum(self["radiance"]))
        except (OSError, ValueError, MemoryError) as error:
            # What a Dataset says of itself is there all the same.
            shown = [f"<p>no picture: {html.escape(str(error))}</p>"]
        row = "".join(f"<div>{part}</div>" for part in shown)
        return f'<div style="display:flex;gap:1em;flex-wrap:wrap">{row}</div>{super()._repr_html_()}'


def open_cube(path: str | os.PathLike[str]) -> Cube:
    """Opens a cube, or what `sensor` made of one. Values are read when they are needed.

    Raises `StorageError` where there is none.
    """
    if not isinstance(path, (str, os.PathLike)):
        raise TypeError(f"open_cube: a cube is opened by its name, not a {type(path).__name__}")
    return opened(path)


def opened(path: Any) -> Cube:
    dataset = xarray.open_dataset(path, engine=Engine, cache=False)
    return _as_cube(dataset)


def temporary(folder: str, path: str) -> Cube:
    store: Any = Temporary(folder, path)
    dataset = xarray.open_dataset(store, engine=Engine, cache=False)
    return _as_cube(dataset)


def _as_cube(dataset: xarray.Dataset) -> Cube:
    cube = Cube(dataset.data_vars, dataset.coords, dataset.attrs)
    cube.encoding = dict(dataset.encoding)
    return cube


def path_of(cube: Any, what: str) -> str:
    """The folder of a cube that is given by name, or as it was opened.

    A Dataset that is not as it is on disk is refused: commands read what is there.
    """
    if isinstance(cube, (str, os.PathLike)):
        return os.fspath(cube)
    if not isinstance(cube, xarray.Dataset):
        raise TypeError(f"{what}: a cube is the name of one or a Dataset, not {type(cube).__name__}")
    source = cube.encoding.get("source")
    # Factored cubes hold weights of products of spectra.
    values = next((name for name in ("radiance", "weights") if name in cube), None)
    if source is None or values is None:
        raise UsageError(f"{what}: this Dataset does not come from a cube on disk; give one as `render` or `open_cube` made it")
    there = opened(source)
    whole = cube[values].encoding.get("source") == source and all(
        name in cube.coords and cube.coords[name].equals(there.coords[name]) for name in ("wavelength", "y", "x")
    )
    if not whole or cube.attrs.get("scene_digest") != there.attrs.get("scene_digest"):
        raise UsageError(f"{what}: this Dataset is not {source} as it is on disk, which is what would be read; give that one")
    return str(source)


def tone(linear: Any, exposure: float | None = None) -> tuple[numpy.ndarray, float]:
    """8-bit sRGB [y, x, rgb] of linear sRGB [y, x, rgb], and its exposure in EV.

    Without `exposure` the 99th percentile of lit pixels is white. What is brighter or outside the gamut is cut, NaN is black: the same
    bytes as in pictures of `spectile export`.

    >>> picture, ev = tone(numpy.full((1, 2, 3), 0.5), exposure=1.0)
    >>> picture.shape, picture.dtype.name, int(picture[0, 0, 0]), ev
    ((1, 2, 3), 'uint8', 255, 1.0)
    """
    _work.begin()
    linear = numpy.ascontiguousarray(linear, dtype=numpy.float32)
    ev, data = _spectile.tone(linear, exposure)
    return numpy.frombuffer(data, dtype=numpy.uint8).reshape(linear.shape), ev


def rgb(cube: Any, exposure: float | None = None) -> xarray.DataArray:
    """The picture of a cube, 8-bit sRGB [y, x, rgb], as `spectile export -o picture.png` writes it; `exposure_ev` is among its
    attributes.

    `cube` is a Dataset with `preview`, also a part of one, or the name of a cube.
    """
    if not isinstance(cube, (xarray.Dataset, str, os.PathLike)):
        raise TypeError(
            f"rgb: a picture is made of a cube, which holds it as `preview`, or of its name, not of a {type(cube).__name__}"
        )
    dataset = cube if isinstance(cube, xarray.Dataset) else opened(cube)
    if "preview" not in dataset:
        raise UsageError("rgb: there is no `preview` in this Dataset, as in counts by a sensor model")
    preview = dataset["preview"].transpose("y", "x", "rgb")
    picture, ev = tone(preview.values, exposure)
    attributes = {"long_name": f"sRGB, 8 bits: {preview.attrs.get('long_name', 'preview')}", "exposure_ev": ev}
    shown = preview.copy(data=picture)
    shown.attrs = attributes
    return shown


def _reduced(size: int, other: int) -> int:
    return max(1, math.ceil(math.sqrt(size * other / SHOWN_PIXELS)))


def _picture(preview: xarray.DataArray) -> str:
    if preview.nbytes > MOST_BYTES:
        return f"<p>a picture of {preview.nbytes / (1 << 20):.0f} MiB: spectile.rgb shows it</p>"
    factor = _reduced(*preview.shape[:2])
    picture, ev = tone(preview[::factor, ::factor].values)
    data = base64.b64encode(png(picture)).decode()
    width = min(picture.shape[1], 480)
    return f'<img width="{width}" style="image-rendering:pixelated" alt="exposure {ev:+.2f} EV" src="data:image/png;base64,{data}">'


def png(picture: numpy.ndarray) -> bytes:
    """A PNG file of 8-bit sRGB [y, x, rgb]."""
    height, width, _ = picture.shape
    rows = numpy.concatenate([numpy.zeros((height, 1), numpy.uint8), picture.reshape(height, -1)], axis=1)

    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    parts = [(b"IHDR", header), (b"sRGB", b"\0"), (b"IDAT", zlib.compress(rows.tobytes(), 6)), (b"IEND", b"")]
    return b"\x89PNG\r\n\x1a\n" + b"".join(chunk(kind, data) for kind, data in parts)


def _spectrum(radiance: xarray.DataArray) -> str:
    """The spectrum in the middle of the picture, drawn."""
    column, row = radiance.sizes["x"] // 2, radiance.sizes["y"] // 2
    pixel = radiance.isel(x=column, y=row)
    nm, values = pixel["wavelength"].values.astype(float), pixel.values.astype(float)
    there = numpy.isfinite(values)
    if not there.any():
        return "<p>nothing is rendered in the middle yet</p>"
    order = numpy.argsort(nm[there], kind="stable")
    nm, values = nm[there][order], values[there][order]
    left, right, low, high = nm[0], nm[-1], min(values.min(), 0.0), values.max()
    across, up = (right - left) or 1.0, (high - low) or 1.0
    points = " ".join(
        f"{30 + 280 * (x - left) / across:.1f},{170 - 150 * (y - low) / up:.1f}" for x, y in zip(nm, values, strict=True)
    )
    text = 'font-size="11" fill="currentColor"'
    return (
        f'<svg width="330" height="205" role="img" aria-label="spectrum of the pixel in the middle">'
        f'<polyline points="30,15 30,170 312,170" fill="none" stroke="currentColor" stroke-opacity="0.4"/>'
        f'<polyline points="{points}" fill="none" stroke="currentColor" stroke-width="1.5"/>'
        f'<text x="34" y="12" {text}>{high:.3g} W m⁻² sr⁻¹ nm⁻¹</text><text x="30" y="184" {text}>{left:g}</text>'
        f'<text x="312" y="184" text-anchor="end" {text}>{right:g} nm</text>'
        f'<text x="30" y="200" {text}>pixel {column} {row} of this Dataset</text></svg>'
    )

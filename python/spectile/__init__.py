"""Spectile: spectral images, K channels per pixel, rendered on every GPU.

    import spectile as sp

    scene = sp.load("scene.toml")
    scene["channels"] = {"equal": {"from": 400, "to": 700, "count": 60}}
    cube = sp.render(scene, "out.zarr", spp=256, progress=True)
    cube.radiance.sel(wavelength=550, method="nearest").plot()

`render` gives an xarray.Dataset. docs/python.md tells more.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from ._errors import (
    CheckFailed,
    DeviceError,
    DeviceLost,
    DeviceMemoryError,
    InternalError,
    NoDevice,
    SceneError,
    SpectileError,
    SpectileWarning,
    Stopped,
    StorageError,
    UsageError,
)
from ._render import Epoch, epochs, render
from ._scene import Scene, load
from ._spectile import __version__
from ._tools import compare, devices, illuminant, plan, relight, sensor, to_colour

if TYPE_CHECKING:
    from ._cube import Cube, open_cube, rgb, tone

# These need numpy and xarray, which take longer to import than everything else.
_LATE = ("Cube", "open_cube", "rgb", "tone")

__all__ = [
    "CheckFailed",
    "Cube",
    "DeviceError",
    "DeviceLost",
    "DeviceMemoryError",
    "Epoch",
    "InternalError",
    "NoDevice",
    "Scene",
    "SceneError",
    "SpectileError",
    "SpectileWarning",
    "Stopped",
    "StorageError",
    "UsageError",
    "__version__",
    "compare",
    "devices",
    "epochs",
    "illuminant",
    "load",
    "open_cube",
    "plan",
    "relight",
    "render",
    "rgb",
    "sensor",
    "to_colour",
    "tone",
]


def __getattr__(name: str) -> Any:
    if name in _LATE:
        from . import _cube

        return getattr(_cube, name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted(__all__)

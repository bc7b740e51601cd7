"""The engine `spectile` of xarray: cubes, and what `sensor` makes of them, lazily, with all that docs/cube.md says of them as coordinates
and attributes."""

from __future__ import annotations

import json
import os
import shutil
import weakref
from collections.abc import Iterable
from typing import Any

import xarray
import zarr
from xarray.backends import BackendEntrypoint
from xarray.backends.zarr import ZarrBackendEntrypoint

from ._errors import StorageError

# Of cubes, and of counts by sensor models, by the attribute that holds it.
FORMATS = {"spectile_format": (1, 2), "spectile_sensor_format": (1, 2)}


def attributes(path: str) -> dict[str, Any] | None:
    """The attributes of the Zarr group in a folder; None where there is none."""
    try:
        with open(os.path.join(path, "zarr.json"), encoding="utf-8") as file:
            found = json.load(file).get("attributes", {})
    except (OSError, ValueError, AttributeError):
        return None
    return found if isinstance(found, dict) else None


class Engine(BackendEntrypoint):
    """Opens cubes: `xarray.open_dataset("cube.zarr", engine="spectile")`. Values are read when they are needed."""

    description = "Open cubes of Spectile"
    open_dataset_parameters = ("filename_or_obj", "drop_variables", "mask_and_scale", "decode_times")

    def open_dataset(
        self,
        filename_or_obj: Any,
        *,
        drop_variables: str | Iterable[str] | None = None,
        mask_and_scale: bool = True,
        decode_times: bool = False,
    ) -> xarray.Dataset:
        store = filename_or_obj if isinstance(filename_or_obj, zarr.storage.LocalStore) else None
        path = os.path.abspath(str(store.root) if store is not None else os.fspath(filename_or_obj))
        found = attributes(path)
        if found is None:
            raise StorageError(f"{path}: is no cube: it has no Zarr group", path)
        known = {key: found[key] for key in FORMATS if key in found}
        if not known:
            raise StorageError(f"{path}: is no cube of Spectile; xarray.open_zarr opens other Zarr groups", path)
        for key, version in known.items():
            if version not in FORMATS[key]:
                versions = " and ".join(map(str, FORMATS[key]))
                raise StorageError(f"{path}: is of format {version}; this version reads {versions}", path)
        dataset = ZarrBackendEntrypoint().open_dataset(
            path if store is None else store,  # type: ignore[arg-type]
            mask_and_scale=mask_and_scale,
            decode_times=decode_times,
            decode_coords="all",
            drop_variables=drop_variables,
        )
        dataset.encoding["source"] = path
        for variable in dataset.variables.values():
            variable.encoding["source"] = path
        return dataset

    def guess_can_open(self, filename_or_obj: Any) -> bool:
        if not isinstance(filename_or_obj, (str, os.PathLike)):
            return False
        found = attributes(os.fspath(filename_or_obj))
        return found is not None and any(key in found for key in FORMATS)


class Temporary(zarr.storage.LocalStore):
    """A cube that is removed when nobody reads from it any more: every lazy array of it holds this store."""

    def __init__(self, folder: str, cube: str) -> None:
        super().__init__(cube, read_only=True)
        weakref.finalize(self, shutil.rmtree, folder, ignore_errors=True)

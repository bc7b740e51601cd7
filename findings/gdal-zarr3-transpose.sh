#!/usr/bin/env bash
# GDAL 3.12.2 (the library in the wheel of rasterio 1.5.2) reads Zarr v3 arrays whose codec `transpose` has an order that is
# not its own inverse with the values in other places, without an error. Orders that are their own inverse, [0, 1, 2] and
# [2, 1, 0], are read right. zarr 3.1.6, which wrote the arrays, reads all of them back.
#
# Zarr v3 core, codec `transpose`: `order` is a permutation such that dimension i of the encoded array is dimension order[i]
# of the decoded one. The array here has three different sizes and one chunk.
#
# Seen on 2026-11-29, Python 3.11, x86-64 Linux:
#   order (0, 1, 2): same
#   order (2, 1, 0): same
#   order (1, 2, 0): other values, no error
#   order (2, 0, 1): other values, no error
# Fails if any of these changes.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check zarr==3.1.6 numpy==2.4.6
# The wheel for another Python than this one may have: only its library is used.
"$tmp/venv/bin/pip" download -q --disable-pip-version-check --no-deps --only-binary=:all: --python-version 3.12 \
  --platform manylinux_2_28_x86_64 --platform manylinux_2_27_x86_64 -d "$tmp" rasterio==1.5.2
"$tmp/venv/bin/python" -m zipfile -e "$tmp"/rasterio-*.whl "$tmp/wheel"
"$tmp/venv/bin/python" -W ignore - "$tmp" <<'PYTHON' | tee "$tmp/seen"
import ctypes
import glob
import sys

import numpy as np
import zarr

folder = sys.argv[1]
gdal = ctypes.CDLL(glob.glob(f"{folder}/wheel/rasterio.libs/libgdal*")[0])
gdal.GDALOpen.restype = ctypes.c_void_p
gdal.GDALVersionInfo.restype = ctypes.c_char_p
gdal.GDALAllRegister()
assert gdal.GDALVersionInfo(b"RELEASE_NAME") == b"3.12.2", gdal.GDALVersionInfo(b"RELEASE_NAME")

values = np.arange(2 * 3 * 5, dtype="f4").reshape(2, 3, 5)
for order in [(0, 1, 2), (2, 1, 0), (1, 2, 0), (2, 0, 1)]:
    path = f"{folder}/{''.join(map(str, order))}.zarr"
    array = zarr.create_array(
        path, shape=values.shape, chunks=values.shape, dtype="f4", zarr_format=3, compressors=None,
        filters=[zarr.codecs.TransposeCodec(order=order)],
    )
    array[:] = values
    assert np.array_equal(zarr.open_array(path, mode="r")[:], values)
    dataset = gdal.GDALOpen(path.encode(), 0)
    if not dataset:
        print(f"order {order}: not opened")
        continue
    read = np.full_like(values, np.nan)
    bands, rows, columns = values.shape
    failed = gdal.GDALDatasetRasterIO(
        ctypes.c_void_p(dataset), 0, 0, 0, columns, rows, read.ctypes.data_as(ctypes.c_void_p), columns, rows, 6, bands,
        None, 0, 0, 0,
    )
    same = np.array_equal(read, values)
    print(f"order {order}: {'an error' if failed else 'same' if same else 'other values, no error'}")
PYTHON
diff "$tmp/seen" - <<'SEEN' || { echo "this has changed"; exit 1; }
order (0, 1, 2): same
order (2, 1, 0): same
order (1, 2, 0): other values, no error
order (2, 0, 1): other values, no error
SEEN
echo "as it was"

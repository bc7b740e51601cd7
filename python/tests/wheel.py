#!/usr/bin/env python3
"""Installs a wheel into fresh environments, and sees that it works there: `wheel.py WHEEL [PYTHON]…`, by default with the oldest and the newest
Python of this machine that the package takes. Environments are made in a temporary folder; pip fetches what the package needs."""

import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

OLDEST = (3, 11)

# In the environment: what a user does first, with as little as the package needs.
FIRST_STEPS = """
import importlib.metadata, sys
import spectile as sp
assert not {"numpy", "xarray", "zarr"} & set(sys.modules), "imported too early"
scene = sp.load(sys.argv[1])
scene["film"] = {"width": 16, "height": 16}
scene["channels"] = {"equal": {"from": 400, "to": 700, "count": 6}}
cube = sp.render(scene, "cube.zarr", spp=4)
import numpy, xarray
assert numpy.isfinite(cube.radiance).all() and float(cube.radiance.max()) > 0
assert xarray.open_dataset("cube.zarr", engine="spectile").radiance.equals(cube.radiance)
files = {str(file) for file in importlib.metadata.files("spectile")}
assert any(name.endswith("LICENSE-MIT") for name in files), files
print("Python", sys.version.split()[0], "spectile", sp.__version__)
"""


def version(python: str) -> tuple[int, ...] | None:
    """Of an interpreter that can make environments; None where it cannot, or is not one."""
    code = "import ensurepip, sys, venv; print(*sys.version_info[:3])"
    done = subprocess.run([python, "-c", code], capture_output=True, text=True)
    return tuple(map(int, done.stdout.split())) if done.returncode == 0 else None


def pythons() -> list[str]:
    """The oldest and the newest that the package takes."""
    found: dict[tuple[int, ...], str] = {}
    names = [shutil.which(f"python3.{minor}") for minor in range(OLDEST[1], 30)]
    installed = sorted(pathlib.Path.home().glob(".pyenv/versions/*/bin/python"))
    for python in [*filter(None, names), *map(str, installed), sys.executable]:
        number = version(python)
        if number is not None and number >= OLDEST:
            found.setdefault(number, python)
    return [found[number] for number in sorted({min(found), max(found)})] if found else []


def main() -> None:
    wheel, scene = pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(__file__).resolve().parents[2] / "scenes/cornell/cornell.toml"
    if not re.search(r"-cp311-abi3-[^-]+\.whl$", wheel.name):
        sys.exit(f"{wheel.name} is not for every Python from 3.11 on")
    for python in sys.argv[2:] or pythons():
        with tempfile.TemporaryDirectory(prefix="spectile-wheel-") as folder:
            subprocess.run([python, "-m", "venv", f"{folder}/venv"], check=True)
            there = f"{folder}/venv/bin"
            subprocess.run([f"{there}/pip", "install", "--quiet", "--disable-pip-version-check", str(wheel)], check=True)
            subprocess.run([f"{there}/python", "-c", FIRST_STEPS, str(scene)], check=True, cwd=folder)
            for words in (["--version"], ["info", "cube.zarr"], ["compare", "cube.zarr", "cube.zarr", "--tolerance", "0"]):
                done = subprocess.run([f"{there}/spectile", *words], cwd=folder, capture_output=True, text=True)
                assert done.returncode == 0, done
            # Nodes of a cluster run the script that was called.
            words = ["submit", str(scene), "-o", "c.zarr", "--spp", "1", "--size", "16x16", "--dry-run"]
            said = subprocess.run([f"{there}/spectile", *words], cwd=folder, capture_output=True, text=True, check=True).stdout
            assert f"exec {there}/spectile array-task" in said, said
    print("works")


if __name__ == "__main__":
    main()

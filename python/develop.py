#!/usr/bin/env python3
"""Puts the package together without a wheel, for tests and development.

    cargo build --release -p spectile-python          (PYO3_BUILD_EXTENSION_MODULE=1)
    python/develop.py target/release FOLDER
    PYTHONPATH=FOLDER python

FOLDER gets links to the modules of `python/spectile/` and to the library, and what an installed package says of itself, so that xarray
finds its engine. A folder that is already so is left as it is.
"""

import os
import pathlib
import re
import sys
import tomllib

HERE = pathlib.Path(__file__).resolve().parent


def library(folder: pathlib.Path) -> pathlib.Path:
    names = {"darwin": "lib_spectile.dylib", "win32": "_spectile.dll"}
    path = folder / names.get(sys.platform, "lib_spectile.so")
    if not path.exists():
        sys.exit(f"{path} is not there: cargo build -p spectile-python makes it")
    return path.resolve()


def link(there: pathlib.Path, target: pathlib.Path) -> None:
    if there.is_symlink() and pathlib.Path(os.readlink(there)) == target:
        return
    there.unlink(missing_ok=True)
    there.symlink_to(target)


def write(there: pathlib.Path, text: str) -> None:
    if not there.exists() or there.read_text() != text:
        there.write_text(text)


def main() -> None:
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    built, out = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2])
    version = re.search(r'(?m)^\[workspace\.package\]\nversion = "(.+)"', (HERE.parent / "Cargo.toml").read_text())[1]
    project = tomllib.loads((HERE / "pyproject.toml").read_text())["project"]
    package, facts = out / "spectile", out / f"spectile-{version}.dist-info"
    package.mkdir(parents=True, exist_ok=True)
    facts.mkdir(exist_ok=True)
    modules = {path.name: path for path in (HERE / "spectile").iterdir() if path.suffix in (".py", ".pyi", ".typed")}
    wanted = dict(modules, **{"_spectile.pyd" if sys.platform == "win32" else "_spectile.abi3.so": library(built)})
    for path in package.iterdir():
        if path.is_symlink() and path.name not in wanted:
            path.unlink()
    for name, target in wanted.items():
        link(package / name, target)
    write(facts / "METADATA", f"Metadata-Version: 2.1\nName: spectile\nVersion: {version}\n")
    points = {"console_scripts": project["scripts"], **project["entry-points"]}
    text = "".join(f"[{group}]\n" + "".join(f"{k} = {v}\n" for k, v in each.items()) for group, each in points.items())
    write(facts / "entry_points.txt", text)


if __name__ == "__main__":
    main()

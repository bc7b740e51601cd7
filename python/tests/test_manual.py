"""The page on Python: its programs run, one after the other as they stand, and its tables name what is there."""

import ast
import inspect
import re

from conftest import ROOT

import spectile as sp

PAGE = (ROOT / "docs/python.md").read_text()


def test_programs_run(toml, monkeypatch, capsys):
    folder = toml.parent
    monkeypatch.chdir(folder)
    toml.rename(folder / "scene.toml")
    (folder / "camera.csv").write_text((ROOT / "scenes/cornell/camera.csv").read_text())
    programs = re.findall(r"^```python\n(.*?)^```$", PAGE, re.MULTILINE | re.DOTALL)
    assert len(programs) == 7
    names = {}
    for program in programs:
        exec(compile(program, "docs/python.md", "exec"), names)
    assert names["fine"].sizes["wavelength"] == 90 and names["red"].radiance.notnull().all()
    assert names["camera"].sizes["wavelength"] == 3 and names["picture"].shape == (32, 32, 3)
    said = capsys.readouterr().out
    assert said.count("(32, 32, 3)") == 8 and "film.width" in said


def test_the_stub_says_what_the_module_takes():
    from spectile import _spectile

    def taken(arguments):
        """Names of parameters, and whether each may be left out."""
        names = [argument.arg for argument in arguments.args if argument.arg not in ("self", "cls")]
        return {name: i >= len(names) - len(arguments.defaults) for i, name in enumerate(names)}

    stub = ast.parse((ROOT / "python/spectile/_spectile.pyi").read_text()).body
    said = {node.name: taken(node.args) for node in stub if isinstance(node, ast.FunctionDef)}
    for kind in [node for node in stub if isinstance(node, ast.ClassDef)]:
        methods = [node for node in kind.body if isinstance(node, ast.FunctionDef)]
        said |= {(kind.name if node.name == "__new__" else f"{kind.name}.{node.name}"): taken(node.args) for node in methods}
    found = {}
    for name, thing in vars(_spectile).items():
        if callable(thing):
            found[name] = thing
            public = [key for key in vars(thing) if not key.startswith("_")] if isinstance(thing, type) else []
            found |= {f"{name}.{key}": getattr(thing, key) for key in public}
    del found["Data"]  # Only `mesh` and the like make one.
    there = {}
    for name, thing in found.items():
        parameters = inspect.signature(thing).parameters.values()
        there[name] = {p.name: p.default is not p.empty for p in parameters if p.name != "self"}
    assert said == there


def test_tables_name_what_there_is():
    code = set(re.findall(r"`(\w+)\(", PAGE)) | {"Scene", "Cube"}
    exceptions = set(re.findall(r"`(\w+Error|NoDevice|DeviceLost|Stopped)`", PAGE))
    own = {name for name in sp.__all__ if not name.startswith("_")}
    errors = {name for name in own if isinstance(getattr(sp, name), type) and issubclass(getattr(sp, name), sp.SpectileError)}
    # Not told: those that others are kinds of, what `compare` never lets out, and what callbacks get.
    assert own - errors - {"SpectileWarning", "Epoch"} <= code, own - errors - code
    assert errors - exceptions == {"SpectileError", "DeviceError", "CheckFailed"} - exceptions
    assert all(hasattr(sp, name) or hasattr(__builtins__, name) or name in dir(__import__("builtins")) for name in exceptions)

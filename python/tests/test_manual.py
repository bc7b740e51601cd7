"""The page on Python: its programs run, one after the other as they stand, and its tables name what is there."""

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


def test_tables_name_what_there_is():
    code = set(re.findall(r"`(\w+)\(", PAGE)) | {"Scene", "Cube"}
    exceptions = set(re.findall(r"`(\w+Error|NoDevice|DeviceLost|Stopped)`", PAGE))
    own = {name for name in sp.__all__ if not name.startswith("_")}
    errors = {name for name in own if isinstance(getattr(sp, name), type) and issubclass(getattr(sp, name), sp.SpectileError)}
    # Not told: those that others are kinds of, what `compare` never lets out, and what callbacks get.
    assert own - errors - {"SpectileWarning", "Epoch"} <= code, own - errors - code
    assert errors - exceptions == {"SpectileError", "DeviceError", "CheckFailed"} - exceptions
    assert all(hasattr(sp, name) or hasattr(__builtins__, name) or name in dir(__import__("builtins")) for name in exceptions)

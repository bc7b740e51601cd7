"""What the tests of the package share. They need the package (python/develop.py puts it together) and a device."""

import pathlib
import subprocess
import sys

import pytest

import spectile as sp

ROOT = pathlib.Path(__file__).resolve().parents[2]


def pytest_addoption(parser):
    parser.addoption("--long", action="store_true", help="also the tests that take minutes")


def pytest_collection_modifyitems(config, items):
    if not config.getoption("--long"):
        for item in items:
            if "long" in item.keywords:
                item.add_marker(pytest.mark.skip(reason="long: --long runs it"))


def ball(**changes):
    """A ball under a lamp, in 6 channels and 16 x 16 pixels."""
    scene = sp.Scene(
        {
            "camera": {"perspective": {"position": [0, -4, 1.5], "look_at": [0, 0, 0.5], "up": [0, 0, 1], "fov": 40}},
            "film": {"width": 16, "height": 16},
            "channels": {"equal": {"from": 400, "to": 700, "count": 6}},
            "integrator": {"max_bounces": 2},
            "spectra": {"paint": {"samples": [[380, 0.05], [500, 0.1], [600, 0.7], [780, 0.8]]}},
            "materials": {
                "floor": {"diffuse": {"reflectance": 0.5}},
                "ball": {"diffuse": {"reflectance": "paint"}},
                "lamp": {"black": {}},
            },
            "objects": [
                {"quad": {"corner": [-5, -5, 0], "edge_u": [10, 0, 0], "edge_v": [0, 10, 0]}, "material": "floor"},
                {"sphere": {"center": [0, 0, 0.5], "radius": 0.5}, "material": "ball"},
                {
                    "disk": {"center": [1.5, -1, 3], "normal": [0, 0, -1], "radius": 0.5},
                    "material": "lamp",
                    "emission": {"blackbody": 2856},
                },
            ],
        }
    )
    return scene | changes


BALL_TOML = """\
[camera.perspective]
position = [0, -4, 1.5]
look_at = [0, 0, 0.5]
up = [0, 0, 1]
fov = 40
[film]
width = 16
height = 16
[channels]
equal = { from = 400, to = 700, count = 6 }
[integrator]
max_bounces = 2
[spectra.paint]
samples = [[380, 0.05], [500, 0.1], [600, 0.7], [780, 0.8]]
[materials]
floor.diffuse.reflectance = 0.5
ball.diffuse.reflectance = "paint"
lamp.black = {}
[[objects]]
quad = { corner = [-5, -5, 0], edge_u = [10, 0, 0], edge_v = [0, 10, 0] }
material = "floor"
[[objects]]
sphere = { center = [0, 0, 0.5], radius = 0.5 }
material = "ball"
[[objects]]
disk = { center = [1.5, -1, 3], normal = [0, 0, -1], radius = 0.5 }
material = "lamp"
emission = { blackbody = 2856 }
"""


@pytest.fixture
def toml(tmp_path):
    file = tmp_path / "ball.toml"
    file.write_text(BALL_TOML)
    return file


def program(*arguments, **options):
    """The program of the package, as its script starts it."""
    command = [sys.executable, "-P", "-c", "import sys; from spectile._program import main; sys.exit(main())", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, timeout=300, **options)


def content(cube):
    """Name and bytes of every file of a cube's arrays."""
    return {
        str(path.relative_to(cube)): path.read_bytes()
        for path in sorted(pathlib.Path(cube).rglob("*"))
        if path.is_file() and ".spectile" not in path.parts
    }

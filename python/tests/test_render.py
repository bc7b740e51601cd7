"""Rendering: the bytes of the program, from Python and its threads, stopped and gone on with."""

import asyncio
import os
import pathlib
import pickle
import signal
import subprocess
import sys
import threading
import time

import pytest
from conftest import ball, content, program

import spectile as sp


def test_the_same_bytes_as_the_program(tmp_path, toml):
    done = program("render", toml, "-o", tmp_path / "a.zarr", "--spp", "4", "--seed", "3", "--quiet", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    cube = sp.render(ball(), tmp_path / "b.zarr", spp=4, seed=3)
    assert content(tmp_path / "a.zarr") == content(tmp_path / "b.zarr")
    assert cube.attrs["seed"] == 3 and cube.sizes["wavelength"] == 6
    assert cube.attrs["scene_digest"] == ball().digest
    # Whatever the scene names is not replaced by a picture of it.
    scene = ball()
    scene["materials"]["floor"]["diffuse"]["reflectance"] = {"texture": str(tmp_path / "c.png")}
    # A scene file by its name, and options that change no value.
    sp.render(toml, tmp_path / "c.zarr", spp=4, seed=3, memory="64MiB", devices=1, preview=tmp_path / "c.png", exposure=1)
    assert content(tmp_path / "a.zarr") == content(tmp_path / "c.zarr")
    picture = (tmp_path / "c.png").read_bytes()
    assert picture.startswith(b"\x89PNG")
    with pytest.raises(sp.UsageError, match="read from this file"):
        sp.render(scene, spp=1, preview=tmp_path / "c.png")
    assert (tmp_path / "c.png").read_bytes() == picture
    assert int(sp.render(ball(), spp=1, devices=[0]).samples.max()) == 1


def test_the_program_of_the_package_ends_as_the_program_does(tmp_path):
    assert program("--version").stdout.strip() == f"spectile {sp.__version__}"
    assert (program("info", tmp_path / "none.zarr").returncode, program("render").returncode) == (5, 2)


def test_epochs_call_back_with_preview_and_error(tmp_path):
    import numpy

    seen = []

    def callback(epoch):
        picture = epoch.preview()
        assert picture.shape == (16, 16, 3) and picture.dtype == numpy.float32 and numpy.isfinite(picture).all()
        assert epoch.preview(most_pixels=64).shape == (8, 8, 3)
        seen.append(epoch)

    cube = sp.render(ball(integrator={"epoch": 4}), spp=16, callback=callback)
    assert [epoch.samples for epoch in seen] == [1, 2, 4, 8, 12, 16]
    assert seen[0].error_estimate is None and 0 < seen[-1].error_estimate < 1
    assert numpy.array_equal(seen[-1].preview(), cube.preview.values)
    assert seen[-1].devices[0]["units"] > 0 and "16 samples/pixel" in repr(seen[-1])


def test_tiles_end_by_their_own_errors(tmp_path):
    import numpy

    seen = []
    scene = ball(integrator={"epoch": 4})
    cube = sp.render(scene, spp=512, tile=8, error=0.02, error_per="tile", callback=seen.append)
    samples = cube.samples.values
    assert samples.shape == (2, 2) and samples.min() >= 40 and samples.max() > samples.min()
    assert seen[-1].tile_ends["ended"] == seen[-1].tile_ends["tiles"] == 4 and seen[-1].samples == samples.min()
    # Each tile is what it is in a render of as many samples everywhere.
    even = sp.render(scene, spp=int(samples.min()), tile=8)
    y, x = (8 * index for index in numpy.argwhere(samples == samples.min())[0])
    same = [cube.radiance.values[:, y : y + 8, x : x + 8], even.radiance.values[:, y : y + 8, x : x + 8]]
    assert numpy.array_equal(*same)
    with pytest.raises(sp.UsageError, match="error-per"):
        sp.render(scene, error_per="tile")


def test_what_a_callback_raises_stops_in_order_and_the_cube_is_gone_on_with(tmp_path):
    sp.render(ball(), tmp_path / "whole.zarr", spp=64)

    def callback(epoch):
        if epoch.samples == 2:
            raise RuntimeError("enough")

    with pytest.raises(RuntimeError, match="enough") as caught:
        sp.render(ball(), tmp_path / "cube.zarr", time="10m", callback=callback)
    assert "keeps every unit merged so far" in caught.value.__notes__[0]
    assert sp.open_cube(tmp_path / "cube.zarr").samples.values.min() >= 2
    with pytest.raises(sp.UsageError, match="--resume"):
        sp.render(ball(), tmp_path / "cube.zarr", spp=64)
    left = tmp_path / "cube.zarr"
    if sp.open_cube(left).samples.values.max() <= 64:
        sp.render(ball(), left, spp=64, resume=True)
        assert content(left) == content(tmp_path / "whole.zarr")
    with pytest.raises(sp.SpectileError, match='film.filter: "box" in the cube'):
        sp.render(ball(film={"width": 16, "height": 16, "filter": "gaussian"}), left, spp=64, resume=True)


def test_stop_is_an_error_of_its_own(tmp_path):
    with pytest.raises(sp.Stopped):
        sp.render(ball(), tmp_path / "cube.zarr", time="10m", callback=lambda epoch: epoch.stop())
    assert sp.open_cube(tmp_path / "cube.zarr").samples.values.min() >= 1


@pytest.mark.skipif(os.name != "posix", reason="sends a signal")
def test_ctrl_c_leaves_a_cube_that_is_gone_on_with(tmp_path, toml):
    code = (
        # Whoever starts tests in the background may have it ignored.
        "import signal, sys, spectile as sp\n"
        "signal.signal(signal.SIGINT, signal.default_int_handler)\n"
        "try:\n"
        f"    sp.render({str(toml)!r}, 'cube.zarr', time='10m', callback=lambda e: print(e.samples, flush=True))\n"
        "except KeyboardInterrupt as stop:\n"
        "    print('stopped:', stop.__notes__[0])\n"
    )
    process = subprocess.Popen([sys.executable, "-P", "-c", code], cwd=tmp_path, stdout=subprocess.PIPE, text=True)
    assert process.stdout.readline() == "1\n"
    process.send_signal(signal.SIGINT)
    said, _ = process.communicate(timeout=120)
    assert process.returncode == 0 and "stopped: interrupted: cube.zarr keeps every unit merged so far" in said
    samples = int(sp.open_cube(tmp_path / "cube.zarr").samples.values.max())
    more = 64 * (samples // 64 + 1)
    sp.render(toml, tmp_path / "cube.zarr", spp=more, resume=True)
    sp.render(toml, tmp_path / "whole.zarr", spp=more)
    assert content(tmp_path / "cube.zarr") == content(tmp_path / "whole.zarr")


def test_two_threads_render_at_once_and_python_goes_on(tmp_path):
    began = threading.Barrier(3)
    cubes = {}

    def work(seed):
        began.wait()
        cubes[seed] = sp.render(ball(), tmp_path / f"{seed}.zarr", spp=256, seed=seed)

    threads = [threading.Thread(target=work, args=(seed,)) for seed in (1, 2)]
    [thread.start() for thread in threads]
    began.wait()
    counted = 0
    while any(thread.is_alive() for thread in threads):
        counted += 1
        time.sleep(0.001)
    for seed in (1, 2):
        sp.render(ball(), tmp_path / f"alone{seed}.zarr", spp=256, seed=seed)
        assert content(tmp_path / f"{seed}.zarr") == content(tmp_path / f"alone{seed}.zarr")
    assert content(tmp_path / "1.zarr") != content(tmp_path / "2.zarr")
    # Holding the GIL would have let this thread run before and after only.
    assert counted > 5


@pytest.mark.skipif(not hasattr(os, "fork"), reason="forks")
def test_a_fork_of_a_process_that_has_rendered_is_told_so(tmp_path):
    code = """
import os, multiprocessing, sys
sys.path.insert(0, sys.argv[1])
from conftest import ball
import spectile as sp
def digest(_):
    return ball().digest
fork = multiprocessing.get_context("fork")
with fork.Pool(1) as pool:
    assert pool.map(digest, [0]) == [digest(0)]
with fork.Pool(1) as pool:
    try:
        pool.map(digest, [0])
    except sp.UsageError as error:
        print(error)
"""
    folder = str(pathlib.Path(__file__).parent)
    done = subprocess.run([sys.executable, "-P", "-c", code, folder], capture_output=True, text=True, timeout=120)
    assert done.returncode == 0 and "forked from" in done.stdout and "spawn" in done.stdout, done


def test_temporary_cubes_go_when_nobody_reads_them(tmp_path, monkeypatch):
    import gc
    import tempfile

    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    cube = sp.render(ball(), spp=1)
    path = pathlib.Path(cube.encoding["source"])
    part = cube.radiance.isel(wavelength=2)
    del cube
    gc.collect()
    assert path.exists() and part.mean() > 0
    del part
    gc.collect()
    assert not path.parent.exists()
    # Nothing is left of one that failed.
    for tiles in ((5, 9), 3):
        with pytest.raises(sp.UsageError, match="tiles"):
            sp.render(ball(), spp=1, tiles=tiles)
    assert path.is_relative_to(tmp_path) and not list(tmp_path.iterdir())


def test_epochs_iterate_beside_an_event_loop(tmp_path):
    async def watch():
        rendering = sp.epochs(ball(), tmp_path / "cube.zarr", spp=8)
        samples = [epoch.samples async for epoch in rendering]
        return samples, await rendering.cube()

    samples, cube = asyncio.run(watch())
    assert samples == [1, 2, 4, 8] and int(cube.samples.max()) == 8

    async def stop():
        rendering = sp.epochs(ball(), tmp_path / "stopped.zarr", time="10m")
        async for epoch in rendering:
            rendering.stop()

    with pytest.raises(sp.Stopped):
        asyncio.run(stop())
    assert sp.open_cube(tmp_path / "stopped.zarr").samples.values.min() >= 1

    async def wrong():
        async for _ in sp.epochs(ball(film={})):
            pass

    with pytest.raises(sp.SceneError, match="film"):
        asyncio.run(wrong())


def test_warnings_are_warnings_and_do_not_end_a_render(tmp_path):
    scene = ball()
    scene["spectra"]["paint"] = {"samples": [[500, 0.1], [600, 0.7]]}
    with pytest.warns(sp.SpectileWarning, match="does not cover"):
        cube = sp.render(scene, tmp_path / "cube.zarr", spp=1)
    assert int(cube.samples.min()) == 1


def test_errors_have_their_kinds(tmp_path, toml):
    with pytest.raises(sp.UsageError, match="--spp"):
        sp.render(toml, tmp_path / "a.zarr", spp=0)
    with pytest.raises(sp.StorageError) as caught:
        sp.render(toml, tmp_path / "none" / "deep" / "a.zarr", spp=1)
    assert isinstance(caught.value, OSError) and "none" in str(caught.value.filename)
    code = "import spectile as sp; print(sp.devices())\ntry: sp.render('ball.toml', 'a.zarr')\nexcept sp.NoDevice as e: print('none:', e)"
    environment = dict(os.environ, VK_DRIVER_FILES="/nonexistent.json", VK_ICD_FILENAMES="/nonexistent.json")
    done = subprocess.run([sys.executable, "-P", "-c", code], cwd=tmp_path, env=environment, capture_output=True, text=True)
    assert done.returncode == 0 and done.stdout.startswith("[]\nnone: "), done
    assert not (tmp_path / "a.zarr").exists()


@pytest.mark.parametrize(
    "settings, words",
    [
        ({"spp": 2.5}, "`spp` is a whole number, not 2.5"),
        ({"spp": True}, "`spp` is a whole number"),
        ({"seed": [1]}, "`seed` is a whole number"),
        ({"size": 32}, "`size` is .width, height. in pixels"),
        ({"size": (1, 2, 3)}, "`size` is .width, height. in pixels"),
        ({"tiles": 1}, "`tiles` is .a, b."),
        ({"tiles": range(0, 4, 2)}, "without a gap"),
        ({"devices": []}, "`devices` is"),
        ({"devices": None}, "`devices` is"),
        ({"time": "soon"}, r"a time is a positive number with s, min or h, such as 90s, 10m, 2min or 1.5h$"),
    ],
)
def test_arguments_that_make_no_sense_are_refused_in_a_sentence(settings, words):
    with pytest.raises(sp.UsageError, match=words):
        sp.render(ball(), **settings)


def test_what_is_of_a_wrong_type_is_told_what_is_right(tmp_path):
    cube = sp.render(ball(), tmp_path / "cube.zarr", spp=2e0, size=[8.0, 8])
    assert int(cube.samples.max()) == 2
    for call, words in {
        lambda: sp.render(None): "the name of a file, not a NoneType",
        lambda: sp.Scene("scene.toml"): "spectile.load",
        lambda: sp.render(ball(), callback=3): "called with an Epoch",
        lambda: sp.open_cube(cube): "by its name",
        lambda: sp.rgb(cube.radiance): "not of a DataArray",
        lambda: sp.to_colour(cube): "cube.radiance",
        lambda: sp.sensor(cube, model={}): "name of a file",
    }.items():
        with pytest.raises(TypeError, match=words):
            call()


def test_every_error_of_the_library_has_an_exception():
    from spectile import _errors

    for kind, built_in in {
        "usage": ValueError,
        "memory": MemoryError,
        "no_device": RuntimeError,
        "devices_lost": sp.DeviceLost,
        "check": sp.CheckFailed,
        "interrupted": sp.Stopped,
        "internal": sp.InternalError,
        "storage": OSError,
        "input": sp.SceneError,
    }.items():
        problem = {"file": pathlib.Path("s.toml"), "line": 3, "column": 1, "key": "a.b", "message": "is wrong", "help": None}
        error = _errors.make(kind, "what, where", {"path": pathlib.Path("cube.zarr"), "problems": [problem]})
        assert isinstance(error, sp.SpectileError) and isinstance(error, built_in) and str(error) == "what, where"
        again = pickle.loads(pickle.dumps(error))
        assert type(again) is type(error) and str(again) == str(error) and vars(again) == vars(error)


def test_progress_is_shown_where_it_is_wanted(tmp_path, capsys, monkeypatch):
    monkeypatch.setitem(sys.modules, "tqdm", None)
    monkeypatch.setitem(sys.modules, "tqdm.auto", None)
    sp.render(ball(), spp=2)
    assert capsys.readouterr() == ("", "")
    sp.render(ball(), spp=2, progress=True)
    said = capsys.readouterr()
    assert said.out == "" and "1 samples/pixel" in said.err and "2 samples/pixel" in said.err
    monkeypatch.undo()
    tqdm = pytest.importorskip("tqdm")
    sp.render(ball(), spp=2, progress=True)
    assert f"2/2" in capsys.readouterr().err.replace(".0", ""), tqdm


def test_plan_and_devices(toml):
    facts = sp.plan(ball(), spp=100, overrides={"film.width": 32})
    assert facts["size"] == [32, 16] and facts["samples"] == 128 and facts["channels"] == 6
    found = sp.devices()
    assert sum(device["chosen"] for device in found) == 1
    assert facts["device"] in [device["name"] for device in found]

"""Rendering from Python."""

from __future__ import annotations

import asyncio
import inspect
import os
import shutil
import sys
import tempfile
from collections.abc import AsyncIterator, Callable, Iterable, Mapping
from typing import TYPE_CHECKING, Any

from . import _spectile, _work
from ._errors import UsageError
from ._scene import Scene, _overrides, taken

if TYPE_CHECKING:
    import numpy

    from ._cube import Cube


class Epoch:
    """How far a render is at the end of an epoch: the picture has `samples` per pixel everywhere, or more where tiles have
    ends of their own.

    `samples`, `samples_next` per pixel; `paths` and `rays` so far; `paths_per_s`; `error_estimate`, the largest of all channels, relative,
    None below two full epochs; `tile_ends`, with `error_per="tile"` a dict of `ended`, `by_samples`, `tiles` and `worst`; `time_s` since
    the beginning; `remaining_s`, None where it is not known; `devices`, a dict each with `name`, `units`, `busy_s` and `idle_s`.
    """

    def __init__(self, event: Mapping[str, Any], task: Any) -> None:
        self._task = task
        self.samples: int = event["samples"]
        self.samples_next: int = event["samples_next"]
        self.paths: int = event["paths"]
        self.rays: int = event["rays"]
        self.paths_per_s: float = event["paths_per_s"]
        self.error_estimate: float | None = event["error_estimate"]
        self.tile_ends: dict[str, Any] | None = event["tile_ends"]
        self.time_s: float = event["time_s"]
        self.remaining_s: float | None = event["remaining_s"]
        self.devices: list[dict[str, Any]] = event["devices"]

    def preview(self, most_pixels: int = 1 << 20) -> numpy.ndarray | None:
        """The picture as it is now, linear sRGB [y, x, rgb] in W m-2 sr-1 nm-1, float32, reduced by a whole factor until it has no more
        than `most_pixels`; NaN where nothing is rendered. `spectile.tone` makes 8-bit sRGB of it. None where there is no cube yet."""
        import numpy

        found = self._task.preview(most_pixels)
        if found is None:
            return None
        width, height, data = found
        return numpy.frombuffer(data, dtype="<f4").reshape(height, width, 3)

    def stop(self) -> None:
        """Ends the render in order, as Ctrl-C does; `render` then raises `Stopped`, and the cube can be gone on with."""
        self._task.stop()

    def __repr__(self) -> str:
        error = "" if self.error_estimate is None else f", error {100 * self.error_estimate:.2f} %"
        return f"<Epoch: {self.samples} samples/pixel in {self.time_s:.1f} s{error}>"


def render(
    scene: Scene | Mapping[str, Any] | str | os.PathLike[str],
    out: str | os.PathLike[str] | None = None,
    *,
    spp: int | None = None,
    time: float | str | None = None,
    error: float | None = None,
    error_per: str = "image",
    seed: int = 0,
    uncertainty: bool = False,
    factored: bool = False,
    layers: Iterable[str] = (),
    resume: bool = False,
    overwrite: bool = False,
    tiles: tuple[int, int] | range | None = None,
    size: tuple[int, int] | None = None,
    tile: int | None = None,
    devices: str | int | list[int] = "all",
    memory: int | str | None = None,
    preview: str | os.PathLike[str] | None = None,
    exposure: float | None = None,
    overrides: Mapping[str, Any] | None = None,
    progress: bool = False,
    callback: Callable[[Epoch], Any] | None = None,
) -> Cube:
    """Renders a scene into a cube and opens it.

    scene: a `Scene`, another mapping, or the name of a scene file.
    out: the cube to make, a folder; None for a temporary one, which is removed when nothing reads from it any more.
    spp, time, error: stop after so many samples per pixel, so many seconds (or text such as "10m"), or when the estimated relative error
        of every channel is so small; the first that is reached, at the end of an epoch. Without any, 64 samples (512 with `uncertainty`).
    error_per: "image", or "tile": each tile ends by its own error, at `spp` at the latest; those with the largest errors come first.
    uncertainty: also store the standard error of every value.
    factored: keep weights of products of spectra instead of radiance, of which `relight` makes cubes under other lamps and paints.
    layers: names of what of the first surface behind each pixel is stored too, such as ["depth", "normal", "material"].
    resume: go on with a cube that an earlier render of the same scene has begun. overwrite: replace a cube that is there.
    tiles: (a, b), the tiles a to b - 1 alone. size: (width, height) in place of the film's. tile: side of the tiles in pixels.
    devices: "all", a number, or positions as `devices` lists them. memory: bytes of each device that may be used, or text such as "2GiB".
    preview: a PNG picture to keep up to date, at an `exposure` in EV or a fitting one.
    overrides: keys of the scene by dotted path, as with `--set`: {"channels.equal.count": 30}.
    progress: a bar, by tqdm where that is installed, else lines on stderr.
    callback: called after every epoch with an `Epoch`. What it raises ends the render in order and is raised from here.

    Gives a `Cube`, an xarray.Dataset of which values are read when they are needed. The GIL is released while rendering. Ctrl-C ends the
    render in order and raises KeyboardInterrupt: what was merged stays in the cube, and `resume=True` goes on from there; a second one
    does not wait for that. The same scene, settings and seed give the same bytes as the program `spectile render`.

    >>> cube = render({
    ...     "camera": {"orthographic": {"position": [0, 0, 1], "look_at": [0, 0, 0], "up": [0, 1, 0], "width": 2}},
    ...     "film": {"width": 4, "height": 2},
    ...     "channels": {"equal": {"from": 400, "to": 700, "count": 3}},  # nm
    ...     "environment": {"radiance": 0.25},  # W m-2 sr-1 nm-1, seen by every pixel
    ... }, spp=1)
    >>> cube.radiance.dims, cube.radiance.shape, float(cube.radiance.min()), cube.radiance.attrs["units"]
    (('wavelength', 'y', 'x'), (3, 2, 4), 0.25, 'W m-2 sr-1 nm-1')

    Raises `SceneError`, `UsageError`, `NoDevice`, `DeviceLost`, `DeviceMemoryError`, `StorageError`, `Stopped`.
    """
    settings = {name: value for name, value in locals().items() if name not in ("scene", "out")}
    return _render(_spectile.Task(), scene, out, settings)


def _render(task: _spectile.Task, scene: Any, out: str | os.PathLike[str] | None, settings: Mapping[str, Any]) -> Cube:
    """`render` with its settings by name, as a task that others may stop."""
    from ._cube import opened, temporary

    scene = taken(scene)
    folder = tempfile.mkdtemp(prefix="spectile-") if out is None else None
    path = os.path.join(folder, "cube.zarr") if folder is not None else os.fspath(out or "")
    callback = settings["callback"]
    try:
        arguments = _arguments(path, settings)
        draft = scene._draft()
        with _Bar(settings["progress"], settings["spp"]) as bar:

            def hear(event: dict[str, Any]) -> None:
                if event["event"] in ("start", "progress", "epoch"):
                    bar.hear(event)
                if event["event"] == "epoch" and callback is not None:
                    callback(Epoch(event, task))

            # Of the warnings' way here: run, _render, render.
            _work.run([*arguments, "--json", "--", scene.file], draft=draft, listener=hear, task=task, stacklevel=4)
    except BaseException:
        if folder is not None:
            shutil.rmtree(folder, ignore_errors=True)
        raise
    return opened(path) if folder is None else temporary(folder, path)


def _arguments(path: str, settings: Mapping[str, Any]) -> list[str]:
    """The command line of a render."""
    tiles, preview = settings["tiles"], settings["preview"]
    if tiles is not None:
        if isinstance(tiles, range) and tiles.step != 1:
            raise UsageError(f"`tiles` are a to b - 1 without a gap, not {tiles}: a render each for others, with `resume`")
        ends = (tiles.start, tiles.stop) if isinstance(tiles, range) else tiles
        first, end = _work.two("tiles", ends, "(a, b), the tiles a to b - 1")
        tiles = f"{_work.whole('tiles', first)}..{_work.whole('tiles', end)}"
    if settings["callback"] is not None and not callable(settings["callback"]):
        raise TypeError(f"`callback` is called with an Epoch, which {settings['callback']!r} cannot be")
    seed = _work.whole("seed", settings["seed"])
    arguments = ["render", f"--output={path}", f"--seed={seed}", f"--devices={_work.chosen(settings['devices'])}"]
    options = {
        "time": _work.seconds(settings["time"]),
        "size": _work.pair(settings["size"]),
        "tiles": tiles,
        "layers": ",".join([settings["layers"]] if isinstance(settings["layers"], str) else settings["layers"]) or None,
        "preview": None if preview is None else os.fspath(preview),
        **{name: bool(settings[name]) for name in ("uncertainty", "factored", "resume", "overwrite")},
        **{name: _work.whole(name, settings[name]) for name in ("spp", "tile", "memory")},
        **{name: settings[name] for name in ("error", "exposure")},
        # The program's own default goes without `error`.
        "error-per": None if settings["error_per"] == "image" else settings["error_per"],
    }
    for name, value in options.items():
        arguments += _work.option(name, value)
    return arguments + [f"--set={key}={value}" for key, value in _overrides(settings["overrides"])]


class _Bar:
    """Tells how far a render is, where that is wanted."""

    def __init__(self, wanted: bool, spp: int | None) -> None:
        self.bar: Any = None
        self.lines = False
        if not wanted:
            return
        try:
            from tqdm.auto import tqdm
        except ImportError:
            self.lines = True
        else:
            self.bar = tqdm(total=spp, unit=" samples/pixel", unit_scale=False, mininterval=0.2)

    def __enter__(self) -> _Bar:
        return self

    def __exit__(self, *_: Any) -> None:
        if self.bar is not None:
            self.bar.close()

    def hear(self, event: dict[str, Any]) -> None:
        if self.bar is not None:
            if event["event"] == "start":
                self.bar.total = event["samples_limit"]
                return
            done, following = event["samples"], event["samples_next"]
            # The share of the epoch under way that is merged.
            share = event["units"] / max(event["units_total"], 1) if event["event"] == "progress" else 0.0
            self.bar.n = round(done + (following - done) * share, 1)
            if event["error_estimate"] is not None:
                self.bar.set_postfix(error=f"{100 * event['error_estimate']:.2f} %", refresh=False)
            self.bar.update(0)
        elif self.lines and event["event"] == "epoch":
            error = "" if event["error_estimate"] is None else f", error {100 * event['error_estimate']:.2f} %"
            print(f"{event['samples']} samples/pixel, {event['paths_per_s']:,.0f} paths/s{error}", file=sys.stderr)


class epochs:
    """Renders while an event loop goes on, and yields an `Epoch` after every epoch:

        rendering = spectile.epochs(scene, "out.zarr", time="1m")
        async for epoch in rendering:
            picture.set_data(spectile.tone(epoch.preview())[0])
        cube = await rendering.cube()

    Takes what `render` takes but `callback`. Who is slow sees every epoch, late; the render does not wait. Leaving the loop with `break`
    does not end the render; `stop` does, in order, and so does cancelling what awaits `cube`, or the end of the event loop.
    """

    def __init__(self, scene: Any, out: str | os.PathLike[str] | None = None, **settings: Any) -> None:
        if "callback" in settings:
            raise TypeError("epochs() takes no callback: it yields what one would get")
        bound = inspect.signature(render).bind(scene, out, **settings)
        bound.apply_defaults()
        self._settings = bound.arguments
        self._task = _spectile.Task()
        self._queue: asyncio.Queue[Epoch | None] = asyncio.Queue()
        self._work: asyncio.Task[Cube] | None = None

    def _start(self) -> asyncio.Task[Cube]:
        if self._work is None:
            loop = asyncio.get_running_loop()
            settings = dict(self._settings)
            scene, out = settings.pop("scene"), settings.pop("out")
            settings["callback"] = lambda epoch: loop.call_soon_threadsafe(self._queue.put_nowait, epoch)

            async def work() -> Cube:
                try:
                    return await asyncio.to_thread(_render, self._task, scene, out, settings)
                except asyncio.CancelledError:
                    # The thread ends soon after, and is waited for by the loop.
                    self.stop()
                    raise
                finally:
                    self._queue.put_nowait(None)

            self._work = asyncio.create_task(work())
        return self._work

    async def __aiter__(self) -> AsyncIterator[Epoch]:
        work = self._start()
        while (epoch := await self._queue.get()) is not None:
            yield epoch
        # An error of the render is one of the loop over it.
        await work

    def stop(self) -> None:
        """Ends the render in order; what awaits it gets `Stopped`."""
        self._task.stop()

    async def cube(self) -> Cube:
        """The cube, when the render has ended; raises what `render` raises."""
        try:
            return await asyncio.shield(self._start())
        except asyncio.CancelledError:
            self.stop()
            raise

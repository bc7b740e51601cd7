"""Commands of Spectile as calls."""

from __future__ import annotations

import contextlib
import os
import sys
import warnings
from collections.abc import Callable, Mapping
from typing import Any

from . import _spectile
from ._errors import SpectileWarning, UsageError

# Whether anything of the library has run in this process, and whether it had in the one that this was forked from.
_began = False
_left_behind = False

Listener = Callable[[dict[str, Any]], None]


def begin() -> None:
    """Before anything of the library that may take threads: those are not copied by a fork, and who waits for them waits for good."""
    global _began
    if _left_behind:
        raise UsageError(
            "Spectile has worked in the process that this one was forked from, and its threads and devices are not here: "
            'start processes with multiprocessing.get_context("spawn"), or before Spectile does anything'
        )
    _began = True


def _forked() -> None:
    global _left_behind
    _left_behind = _began


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_forked)


def run(
    arguments: list[str], *, draft: Any = None, listener: Listener | None = None, task: Any = None, stacklevel: int = 3
) -> dict[str, Any]:
    """Runs `spectile ARGUMENTS --json` and gives its last event, `done`; `listener` gets all others.

    Warnings become warnings of Python, once the work has ended: one that is made an error must not end a render.
    """
    begin()
    last: dict[str, Any] = {}
    said: list[str] = []

    def hear(event: dict[str, Any]) -> None:
        if event["event"] == "warning":
            said.append(event["message"])
        elif event["event"] == "done":
            last.update(event)
        elif listener is not None:
            listener(event)

    try:
        (task or _spectile.Task()).run(arguments, draft, hear)
    except BaseException:
        # Where warnings are errors, what went wrong is still the one to raise.
        with contextlib.suppress(SpectileWarning):
            _warn(said, stacklevel + 1)
        raise
    finally:
        _give_back()
    _warn(said, stacklevel + 1)
    return last


def _warn(said: list[str], stacklevel: int) -> None:
    for message in dict.fromkeys(said):
        warnings.warn(message, SpectileWarning, stacklevel=stacklevel)


def _give_back() -> None:
    """Gives memory that is free back to the system. glibc keeps it for as many threads as ever asked for some at a time: after renders that is
    tens of megabytes, which would look like a leak."""
    if sys.platform == "linux":
        import ctypes

        # Other libraries of C have nothing of the kind.
        trim = getattr(ctypes.CDLL(None), "malloc_trim", None)
        if trim is not None:
            trim(0)


def whole(name: str, value: Any) -> Any:
    """A whole number, which 1e3 is too; what is none is left to whoever knows what it may be."""
    if value is None or isinstance(value, str):
        return value
    try:
        exact = int(value)
    except (TypeError, ValueError, OverflowError):
        exact = None
    if exact is None or isinstance(value, bool) or exact != value:
        raise UsageError(f"`{name}` is a whole number, not {value!r}")
    return exact


def option(name: str, value: Any) -> list[str]:
    """`--name=value`, or nothing where there is no value."""
    if value is None or value is False:
        return []
    return [f"--{name}"] if value is True else [f"--{name}={value}"]


def seconds(value: Any) -> str | None:
    """A number of seconds, a timedelta, or text such as "10m"."""
    if value is None or isinstance(value, str):
        return value
    return repr(float(value.total_seconds() if hasattr(value, "total_seconds") else value))


def chosen(devices: Any) -> str:
    """ "all", a number of devices, or their positions."""
    if isinstance(devices, (str, int)) and not isinstance(devices, bool):
        return str(devices)
    try:
        positions = [int(position) for position in devices]
    except (TypeError, ValueError):
        positions = []
    if not positions:
        raise UsageError(f'`devices` is "all", a number of devices, or a list of positions, not {devices!r}')
    return ",".join(map(str, positions)) + ","


def pair(size: Any) -> str | None:
    """(width, height) or text such as "640x480"."""
    if size is None or isinstance(size, str):
        return size
    return "x".join(str(whole("size", side)) for side in two("size", size, '(width, height) in pixels, or text such as "640x480"'))


def two(name: str, value: Any, what: str) -> tuple[Any, Any]:
    """Both of a pair."""
    try:
        first, second = value
    except (TypeError, ValueError):
        raise UsageError(f"`{name}` is {what}, not {value!r}") from None
    return first, second


def toml(value: Any) -> str:
    """The value as TOML spells it."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if hasattr(value, "tolist"):
        return toml(value.tolist())
    if isinstance(value, (int, float)):
        return repr(value)
    if isinstance(value, (str, os.PathLike)):
        return _quoted(os.fspath(value))
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{_quoted(str(key))} = {toml(inner)}" for key, inner in value.items()) + " }"
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(toml(item) for item in value) + "]"
    if hasattr(value, "isoformat"):
        return str(value.isoformat())
    raise TypeError(f"an override is a string, number, boolean, date, list or mapping, not {type(value).__name__}")


def _quoted(text: str) -> str:
    """A basic string of TOML."""
    special = {'"': '\\"', "\\": "\\\\"}
    written = (special.get(c) or (f"\\u{ord(c):04x}" if ord(c) < 32 or ord(c) == 127 else c) for c in text)
    return f'"{"".join(written)}"'

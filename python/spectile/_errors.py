"""What can go wrong. Each exception says what, where, and what to do, in the words of the program `spectile`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any


class SpectileError(Exception):
    """Anything that Spectile itself reports."""


class SceneError(SpectileError, ValueError):
    """A scene, or a file that it or a sensor names, is wrong.

    Independent mistakes come together: `problems` holds a dict for each, with `file`, `line`, `column`, `key`, `message` and `help`,
    where what is not known is None. `file`, `line`, `column`, `key` and `help` of the exception are those of the first.
    """

    def __init__(self, message: str, problems: Sequence[Mapping[str, Any]] = ()) -> None:
        super().__init__(message)
        self.problems = [dict(problem) for problem in problems]
        first = self.problems[0] if self.problems else {}
        self.file: str | None = first.get("file")
        self.line: int | None = first.get("line")
        self.column: int | None = first.get("column")
        self.key: str | None = first.get("key")
        self.help: str | None = first.get("help")

    def __reduce__(self) -> tuple[Any, ...]:
        return (type(self), (self.args[0], self.problems))


class UsageError(SpectileError, ValueError):
    """Arguments that make no sense, or a render that cannot fit. Options are named as those of the command line: `--spp` is `spp`."""


class DeviceError(SpectileError, RuntimeError):
    """No device does the work."""


class NoDevice(DeviceError):
    """No adapter of this machine can run the shaders."""


class DeviceLost(DeviceError):
    """Every device was lost while rendering. What was merged before is in the cube: `resume=True` goes on from there."""


class DeviceMemoryError(SpectileError, MemoryError):
    """A device's memory does not hold what it is given."""


class StorageError(SpectileError, OSError):
    """A cube or another output cannot be read or written; `filename` is its path."""

    def __init__(self, message: str, path: Any = None) -> None:
        OSError.__init__(self, message)
        self.filename = None if path is None else str(path)

    def __str__(self) -> str:
        # As it is: an OSError with a file name would say it again.
        return str(self.args[0]) if self.args else ""

    def __reduce__(self) -> tuple[Any, ...]:
        return (type(self), (str(self), self.filename))


class CheckFailed(SpectileError):
    """The work was done, and its answer is no."""


class Stopped(SpectileError):
    """The work was asked to stop, and did so in order: a cube keeps what was merged and can be gone on with."""


class InternalError(SpectileError, RuntimeError):
    """A broken promise inside Spectile: a bug worth reporting."""


class SpectileWarning(UserWarning):
    """What Spectile does with doubtful input, once for each."""


_KINDS: dict[str, type[SpectileError]] = {
    "usage": UsageError,
    "memory": DeviceMemoryError,
    "no_device": NoDevice,
    "devices_lost": DeviceLost,
    "check": CheckFailed,
    "interrupted": Stopped,
    "internal": InternalError,
}


def make(kind: str, message: str, details: Mapping[str, Any]) -> SpectileError:
    """The exception for an error of the library, which calls this."""
    if kind == "input":
        problems = [dict(problem, file=str(problem["file"])) for problem in details["problems"]]
        return SceneError(message, problems)
    if kind == "storage":
        return StorageError(message, details["path"])
    return _KINDS[kind](message)


def mistake(file: str, key: str, message: str, help: str) -> SceneError:
    """A mistake in one key of a scene in memory."""
    problem = {"file": file, "line": None, "column": None, "key": key, "message": message, "help": help}
    return SceneError(f"{file}: `{key}`: {message} ({help})", [problem])

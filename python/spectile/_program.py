"""The program `spectile` of this package: the same library, run by a script."""

from __future__ import annotations

import signal
import sys

from . import _spectile


def main() -> int:
    """Runs the command that `sys.argv` spells and gives its exit code."""
    # From here on the library watches signals itself; Python would raise KeyboardInterrupt after an orderly end.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    if hasattr(signal, "SIGXFSZ"):
        signal.signal(signal.SIGXFSZ, signal.SIG_DFL)
    return _spectile.program(sys.argv)


if __name__ == "__main__":
    sys.exit(main())

"""What takes longer: `./check --full` runs it."""

import ctypes
import gc
import json
import os
import pathlib
import subprocess
import sys

import pytest
from conftest import ball

import spectile as sp

MALLINFO = ("arena", "ordblks", "smblks", "hblks", "hblkhd", "usmblks", "fsmblks", "uordblks", "fordblks", "keepcost")


class Mallinfo(ctypes.Structure):
    """glibc's `struct mallinfo2`: of all heaps, bytes in use, bytes free, and bytes in blocks of their own."""

    _fields_ = [(name, ctypes.c_size_t) for name in MALLINFO]


def held():
    """What this process holds, in KiB: `resident`; `used` and `free`, what malloc has given away and what it keeps; and how many
    `threads` and open `files`."""
    gc.collect()
    # What was freed after the last render's end is free, too.
    ctypes.CDLL(None).malloc_trim(0)
    with open("/proc/self/status") as status:
        facts = dict(line.split(":", 1) for line in status)
    mallinfo = ctypes.CDLL(None).mallinfo2
    mallinfo.restype = Mallinfo
    said = mallinfo()
    return {
        "resident": int(facts["VmRSS"].split()[0]),
        "used": (said.uordblks + said.hblkhd) >> 10,
        "free": said.fordblks >> 10,
        "threads": int(facts["Threads"]),
        "files": len(os.listdir("/proc/self/fd")),
    }


def measure():
    """Prints what is held after twenty renders, after a hundred more, and with a leak of 64 KiB for each of those."""

    def render(times):
        for _ in range(times):
            assert sp.render(ball(), spp=4).radiance.notnull().all()
        return held()

    # What is made once, of drivers and caches, is made in the first few.
    found = [render(20), render(100)]
    kept = [os.urandom(1 << 16) for _ in range(100)]
    print(json.dumps([*found, held(), len(kept)]))


def grows(before, after):
    """By what share is held more: of all that is allocated, and of resident memory beside what is free.

    Free memory is no leak, and how much of it stays resident is chance where threads come and go: glibc has up to eight heaps for each core, a
    new thread gets any of them, and of a heap's free end `malloc_trim` gives nothing back. Threads that need much are kept for the next render,
    and devices, whose drivers have threads of their own.
    """
    beside = [found["resident"] - found["free"] for found in (before, after)]
    return after["used"] / before["used"] - 1, (beside[1] - beside[0]) / before["resident"]


@pytest.mark.long
@pytest.mark.skipif(
    sys.platform != "linux" or not hasattr(ctypes.CDLL(None), "mallinfo2"), reason="asks Linux, and its usual library of C"
)
@pytest.mark.parametrize("heaps", ["as they come", "one"])
def test_a_hundred_renders_leak_nothing(heaps):
    # In a process that holds nothing else.
    environment = (
        dict(os.environ, MALLOC_ARENA_MAX="1")
        if heaps == "one"
        else {k: v for k, v in os.environ.items() if k != "MALLOC_ARENA_MAX"}
    )
    code = f"import sys; sys.path.insert(0, {str(pathlib.Path(__file__).parent)!r}); import test_long; test_long.measure()"
    done = subprocess.run([sys.executable, "-P", "-c", code], capture_output=True, text=True, env=environment)
    assert done.returncode == 0, done.stderr
    before, after, leaking, _ = json.loads(done.stdout)
    assert max(grows(before, after)) < 0.02, (before, after)
    assert min(grows(before, leaking)) > 0.02, (before, leaking)
    assert (after["threads"], after["files"]) == (before["threads"], before["files"]), (before, after)
    assert after["resident"] < 1.02 * before["resident"], (before, after)

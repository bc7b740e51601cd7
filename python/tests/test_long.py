"""What takes longer: `./check --full` runs it."""

import gc
import json
import os
import pathlib
import subprocess
import sys

import pytest
from conftest import ball

import spectile as sp


def _held():
    """Resident memory in KiB, threads and open files of this process."""
    gc.collect()
    with open("/proc/self/status") as status:
        facts = dict(line.split(":", 1) for line in status)
    return int(facts["VmRSS"].split()[0]), int(facts["Threads"]), len(os.listdir("/proc/self/fd"))


def measure():
    """Prints what is held after twenty renders, after a hundred more, and with a leak of 64 KiB for each of those."""

    def render(times):
        for _ in range(times):
            assert sp.render(ball(), spp=4).radiance.notnull().all()
        return _held()

    # What is made once, of drivers and caches, is made in the first few.
    held = [render(20), render(100)]
    kept = [os.urandom(1 << 16) for _ in range(100)]
    print(json.dumps([*held, _held(), len(kept)]))


@pytest.mark.long
@pytest.mark.skipif(not os.path.exists("/proc/self/status"), reason="asks Linux")
def test_a_hundred_renders_leak_nothing():
    # In a process that holds nothing else, whose memory is one heap: glibc has up to eight for each core, and which of them threads get, that
    # live for one render, is chance. What the free parts of those hold is no leak, and differs by more than the 2 % asked for here.
    environment = dict(os.environ, MALLOC_ARENA_MAX="1")
    code = f"import sys; sys.path.insert(0, {str(pathlib.Path(__file__).parent)!r}); import test_long; test_long.measure()"
    done = subprocess.run([sys.executable, "-P", "-c", code], capture_output=True, text=True, env=environment)
    assert done.returncode == 0, done.stderr
    before, after, leaking, _ = json.loads(done.stdout)
    assert after[0] < 1.02 * before[0] and after[1:] == before[1:], (before, after)
    assert leaking[0] > 1.02 * before[0], (before, leaking)

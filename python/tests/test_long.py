"""What takes longer: `./check --full` runs it."""

import gc
import os

import pytest
from conftest import ball

import spectile as sp


def _held():
    """Resident memory in KiB, threads and open files of this process."""
    gc.collect()
    with open("/proc/self/status") as status:
        facts = dict(line.split(":", 1) for line in status)
    return int(facts["VmRSS"].split()[0]), int(facts["Threads"]), len(os.listdir("/proc/self/fd"))


@pytest.mark.long
@pytest.mark.skipif(not os.path.exists("/proc/self/status"), reason="asks Linux")
def test_a_hundred_renders_leak_nothing():
    def render(times):
        for _ in range(times):
            assert sp.render(ball(), spp=4).radiance.notnull().all()
        return _held()

    # What is made once, of drivers and caches, is made in the first few.
    before, after = render(20), render(100)
    assert after[0] < 1.02 * before[0] and after[1:] == before[1:], (before, after)
    # A leak of 64 KiB a render would be seen.
    kept = [bytearray(os.urandom(1 << 16)) for _ in range(100)]
    assert _held()[0] > 1.02 * after[0] and kept

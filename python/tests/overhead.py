#!/usr/bin/env python3
"""What rendering from Python costs over the program, measured side by side, by turns.

    PYTHONPATH=FOLDER python -P python/tests/overhead.py SPECTILE [SCENE] [--spp N] [--rounds N] [--csv FILE]

SPECTILE is the program of the same build as the package in FOLDER. Whole processes are measured: processor time of all cores, wall time,
the most memory that they held; and how long `import spectile` takes. Over the program is what is left of the package when what a Python that has
imported numpy, xarray and zarr takes has been taken away, by rounds, which are three processes one after the other: medians, and how far
those are known (the standard deviation of the median of rounds drawn again). What is over has a part that every process pays once, and one that
goes with the work: the thread of Python that waits for a render, whose time is known to a millisecond whatever else runs.
"""

import argparse
import csv
import os
import pathlib
import random
import statistics
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
RENDER = "import sys, spectile as sp; sp.render(sys.argv[1], sys.argv[2], spp=int(sys.argv[3]), overwrite=True)"
IMPORT = "import time; t = time.perf_counter(); import spectile; print(time.perf_counter() - t)"
# With its first coordinate xarray imports what it knows of other arrays, such as pint where that is installed.
IMPORTS = 'import numpy, xarray, zarr; xarray.DataArray([0.0], coords={"x": [0.0]}, dims="x")'
# Python's own thread, which listens while others render, and opens the cube; without the imports.
OWN = f"""
import resource, sys, time, spectile as sp
{IMPORTS}
t = time.thread_time()
sp.render(sys.argv[1], sys.argv[2], spp=int(sys.argv[3]), overwrite=True)
used = resource.getrusage(resource.RUSAGE_SELF)
print(time.thread_time() - t, used.ru_utime + used.ru_stime)
"""
MEASURED = ("cpu_s", "wall_s", "memory_mib")


def measured(command: list[str]) -> tuple[float, float, float]:
    """Seconds of all cores, seconds, and MiB at most."""
    began = time.perf_counter()
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    _, status, usage = os.wait4(process.pid, 0)
    wall = time.perf_counter() - began
    if status != 0:
        sys.exit(f"{command[0]} failed")
    return usage.ru_utime + usage.ru_stime, wall, usage.ru_maxrss / 1024


def spread(values: list[float]) -> float:
    """How far the median is known."""
    numbers = random.Random(0)
    return statistics.stdev(statistics.median(numbers.choices(values, k=len(values))) for _ in range(2000))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program")
    parser.add_argument("scene", nargs="?", default=str(ROOT / "scenes/cornell/cornell.toml"))
    parser.add_argument("--spp", type=int, default=8)
    parser.add_argument("--rounds", type=int, default=15)
    parser.add_argument("--csv", help="where each process is written down")
    arguments = parser.parse_args()
    rounds: list[dict[str, tuple[float, float, float]]] = []
    imports, own = [], []
    with tempfile.TemporaryDirectory() as folder:
        out, spp = f"{folder}/cube.zarr", str(arguments.spp)
        commands = {
            "program": [arguments.program, "render", arguments.scene, "-o", out, "--spp", spp, "--overwrite", "--quiet"],
            "package": [sys.executable, "-P", "-c", RENDER, arguments.scene, out, spp],
            "imports": [sys.executable, "-P", "-c", IMPORTS],
        }
        # Files and kernels are read from the disk once, before anything counts.
        for kind in commands:
            measured(commands[kind])
        order = list(commands)
        for _ in range(arguments.rounds):
            # Who comes first may find a warmer machine: each in turn.
            order = order[1:] + order[:1]
            rounds.append({kind: measured(commands[kind]) for kind in order})
            said = subprocess.run([sys.executable, "-P", "-c", IMPORT], capture_output=True, text=True, check=True)
            imports.append(float(said.stdout))
            command = [sys.executable, "-P", "-c", OWN, arguments.scene, out, spp]
            said = subprocess.run(command, capture_output=True, text=True, check=True)
            own.append(tuple(map(float, said.stdout.split())))
    print(f"{'':8} {'processors':>12} {'wall':>10} {'memory':>11}")
    for kind in commands:
        cpu, wall, memory = (statistics.median(found[kind][i] for found in rounds) for i in range(3))
        print(f"{kind:8} {cpu:10.2f} s {wall:8.2f} s {memory:7.1f} MiB")
    for i, what in enumerate(MEASURED):
        more = [found["package"][i] - found["imports"][i] - found["program"][i] for found in rounds]
        usual = statistics.median(found["program"][i] for found in rounds)
        share = f" ({100 * statistics.median(more) / usual:+.2f} % ± {100 * spread(more) / usual:.2f} %)"
        print(f"over the program, beside the imports: {what} {statistics.median(more):+.3f} ± {spread(more):.3f}{share}")
    waiting, whole = (statistics.median(found[i] for found in own) for i in range(2))
    print(f"the thread of Python while it renders: {waiting:.3f} s, {100 * waiting / whole:.2f} % of the process's {whole:.2f} s")
    print(f"import spectile: {statistics.median(imports):.3f} s")
    if arguments.csv:
        with open(arguments.csv, "w", newline="", encoding="utf-8") as file:
            table = csv.writer(file, lineterminator="\n")
            table.writerow(["round", "process", *MEASURED])
            for i, found in enumerate(rounds):
                table.writerows([i, kind, *(f"{value:.3f}" for value in found[kind])] for kind in commands)


if __name__ == "__main__":
    main()

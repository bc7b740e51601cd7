#!/usr/bin/env python3
"""What rendering from Python costs over the program, measured side by side, by turns.

    PYTHONPATH=FOLDER python -P python/tests/overhead.py SPECTILE [SCENE] [--spp N] [--rounds N]

SPECTILE is the program of the same build as the package in FOLDER. Prints processor time of whole processes, the most memory that they held,
and how long `import spectile` takes; medians of the rounds. Memory over the program is what is left when what a Python that has imported
numpy, xarray and zarr holds has been taken away.
"""

import argparse
import os
import pathlib
import statistics
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
RENDER = "import sys, spectile as sp; sp.render(sys.argv[1], sys.argv[2], spp=int(sys.argv[3]), overwrite=True)"
IMPORT = "import time; t = time.perf_counter(); import spectile; print(time.perf_counter() - t)"


def measured(command: list[str]) -> tuple[float, float]:
    """Seconds of all cores, and MiB at most."""
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    _, status, usage = os.wait4(process.pid, 0)
    if status != 0:
        sys.exit(f"{command[0]} failed")
    return usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1024


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program")
    parser.add_argument("scene", nargs="?", default=str(ROOT / "scenes/cornell/cornell.toml"))
    parser.add_argument("--spp", type=int, default=8)
    parser.add_argument("--rounds", type=int, default=5)
    arguments = parser.parse_args()
    kinds: dict[str, list[tuple[float, float]]] = {"program": [], "package": [], "imports": []}
    imports = []
    with tempfile.TemporaryDirectory() as folder:
        out, spp = f"{folder}/cube.zarr", str(arguments.spp)
        commands = {
            "program": [arguments.program, "render", arguments.scene, "-o", out, "--spp", spp, "--overwrite", "--quiet"],
            "package": [sys.executable, "-P", "-c", RENDER, arguments.scene, out, spp],
            "imports": [sys.executable, "-P", "-c", "import numpy, xarray, zarr"],
        }
        # Files and kernels are read from the disk once, before anything counts.
        for kind in commands:
            measured(commands[kind])
        for _ in range(arguments.rounds):
            for kind, command in commands.items():
                kinds[kind].append(measured(command))
            said = subprocess.run([sys.executable, "-P", "-c", IMPORT], capture_output=True, text=True, check=True)
            imports.append(float(said.stdout))
    seconds = {kind: statistics.median(s for s, _ in each) for kind, each in kinds.items()}
    mebibytes = {kind: statistics.median(m for _, m in each) for kind, each in kinds.items()}
    for kind in kinds:
        spread = max(s for s, _ in kinds[kind]) - min(s for s, _ in kinds[kind])
        print(f"{kind:8} {seconds[kind]:8.2f} s (spread {spread:.2f} s)  {mebibytes[kind]:7.1f} MiB")
    more = seconds["package"] - seconds["imports"] - seconds["program"]
    print(f"over the program, beside the imports: {more:+.2f} s ({100 * more / seconds['program']:+.1f} %)", end=", ")
    print(f"{mebibytes['package'] - mebibytes['imports'] - mebibytes['program']:+.1f} MiB")
    print(f"import spectile: {statistics.median(imports):.3f} s")


if __name__ == "__main__":
    main()

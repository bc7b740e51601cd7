"""Mitsuba 3 and Spectile on the Cornell box, in turns on one core: what each needs to an equal error.

Error is relMSE (docs/METHOD.md, Errors), mean over channels, against renders of Spectile with other seeds, whose own noise is subtracted.
Time is CPU time of the process, without compilation, and without what a render of one sample takes: others' work on the machine does
not count, nor does tracing in Mitsuba or start-up in Spectile. Spectile writes its cube to disk, Mitsuba keeps its picture in memory.
relMSE of independent samples goes as 1 / time, so that runs are compared by relMSE x seconds.
"""

import argparse
import csv
import datetime
import json
import os
import select
import shutil
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
SIZE, PIXELS = 64, 64 * 64
FROM, TO = 380, 780
MODES = ["specfilm", "scripted"]
LAMPS = {
    "box": (ROOT / "scenes/cornell/lamp.csv", "value", "the lamp of the box, smooth"),
    "mercury": (ROOT / "scenes/conference/spectra/lamps.csv", "mercury", "a measured mercury lamp (NIST and RIT, through colour-science 0.4.7)"),
}
# Against specfilm and the best scripted use.
GOALS = {400: (40, 8), 1000: (100, 12)}


class Spectile:
    def __init__(self, arguments, channels, lamp, folder):
        self.arguments, self.folder = arguments, folder
        path, column, _ = LAMPS[lamp]
        self.scene = [
            "scenes/cornell/cornell.toml", "--size", f"{SIZE}x{SIZE}", "--set", f"channels.equal.count={channels}",
            "--set", f"spectra.lamp.file={path}", "--set", f"spectra.lamp.column={column}",
        ]  # fmt: skip
        self.channels = channels
        # The first run fills the driver's cache of shaders.
        self.run(1, 0)
        self.startup = statistics.median(self.run(1, 0)["cpu_s"] for _ in range(3))

    def run(self, samples, seed, picture=False):
        cube = self.folder / "box.zarr"
        shutil.rmtree(cube, ignore_errors=True)
        command = [self.arguments.spectile, "render", *self.scene, "-o", cube, "--seed", str(seed), "--spp", str(samples), "--json"]
        process = subprocess.Popen(pinned(self.arguments.core, command), stdout=subprocess.PIPE, text=True, env=ONE_THREAD, cwd=ROOT)
        events, peak = [], 0
        for event in process.stdout:
            events.append(json.loads(event))
            peak = max(peak, peak_mib(process.pid))
        _, status, usage = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
        done = events[-1]
        if process.returncode or done["event"] != "done":
            sys.exit(f"spectile ended with {process.returncode}: {done}")
        cpu = usage.ru_utime + usage.ru_stime
        result = {"samples": done["samples"], "cpu_s": cpu, "wall_s": done["time_s"], "peak_mib": peak}
        if picture:
            raw = self.folder / "box.img"
            for file in (raw, raw.with_suffix(".hdr")):
                file.unlink(missing_ok=True)
            export = [self.arguments.spectile, "export", cube, "-o", raw, "--interleave", "bip"]
            subprocess.run(export, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, env=ONE_THREAD)
            result["picture"] = np.fromfile(raw, np.float32).reshape(PIXELS, self.channels)
        return result

    def render(self, samples, seed):
        result = self.run(samples, seed, picture=True)
        return {**result, "cpu_s": result["cpu_s"] - self.startup}


class Mitsuba:
    def __init__(self, arguments, channels, lamp, folder, mode):
        path, column, _ = LAMPS[lamp]
        # A home of its own: compiled kernels of earlier runs would be found there.
        home = folder / mode
        home.mkdir(exist_ok=True)
        command = [sys.executable, ROOT / "benches/peer/mitsuba_box.py", mode, str(channels), path, column]
        self.process = subprocess.Popen(
            pinned(arguments.core, command), stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, env={**os.environ, "HOME": str(home)}
        )
        self.raw, self.channels = folder / f"{mode}.raw", channels
        # Compilation goes as the square of the number of channels where a processor lacks AVX-512: hours for a thousand.
        if not select.select([self.process.stdout], [], [], arguments.compilation_limit)[0]:
            self.process.kill()
            self.process.wait()
            raise TimeoutError
        self.facts = self.answer()

    def answer(self):
        line = self.process.stdout.readline()
        if not line:
            sys.exit(f"Mitsuba ended with {self.process.wait()}; DRJIT_LIBLLVM_PATH is {os.environ.get('DRJIT_LIBLLVM_PATH')}")
        return json.loads(line)

    def render(self, samples, seed):
        self.process.stdin.write(f"{samples} {seed} {self.raw}\n")
        self.process.stdin.flush()
        answer = {**self.answer(), "peak_mib": peak_mib(self.process.pid)}
        return {**answer, "picture": np.fromfile(self.raw, np.float32).reshape(PIXELS, self.channels)}

    def close(self):
        self.process.stdin.close()
        self.process.wait()


class Reference:
    """Means of several independent renders; their spread is the noise of their mean."""

    def __init__(self, pictures):
        pictures = np.stack(pictures).astype(np.float64)
        self.mean = pictures.mean(axis=0)
        # eps_k = (0.01 mean)^2 keeps dark pixels from ruling; a channel without any light has no error either.
        self.scale = self.mean**2 + (0.01 * self.mean.mean(axis=0)) ** 2
        self.scale[self.scale == 0] = np.inf
        variance = pictures.var(axis=0, ddof=1) / len(pictures)
        self.noise = (variance / self.scale).mean()

    def rel_mse(self, picture):
        return ((picture - self.mean) ** 2 / self.scale).mean() - self.noise


def peak_mib(pid):
    """The most resident memory so far; what wait4 tells is at least that of this program, which a child shares until it execs."""
    try:
        lines = Path(f"/proc/{pid}/status").read_text().splitlines()
    except OSError:
        return 0
    return max((int(line.split()[1]) / 1024 for line in lines if line.startswith("VmHWM:")), default=0)


def pinned(core, command):
    command = [str(part) for part in command]
    return ["taskset", "-c", str(core), *command] if shutil.which("taskset") else command


ONE_THREAD = {**os.environ, "LP_NUM_THREADS": "1"}


def samples_for(rate, seconds):
    """Epochs end at multiples of 64, and Mitsuba's passes have as many."""
    return max(1, round(seconds * rate / PIXELS / 64)) * 64


def measure(arguments, channels, lamp, folder):
    spectile = Spectile(arguments, channels, lamp, folder)
    trial = spectile.run(64, 0)
    samples = {"spectile": samples_for(64 * PIXELS / max(1e-3, trial["cpu_s"] - spectile.startup), arguments.seconds)}
    # Long enough that what is subtracted is a small part of Spectile's own error.
    long = [spectile.run(4 * samples["spectile"], 10_000 + seed, picture=True) for seed in range(4)]
    reference = Reference([run["picture"] for run in long])
    agreement = against_peer(arguments, reference, channels, lamp)
    programs = {}
    for mode in MODES:
        try:
            programs[mode] = Mitsuba(arguments, channels, lamp, folder, mode)
        except TimeoutError:
            print(f"{mode} with K = {channels} has not compiled in {arguments.compilation_limit:.0f} s: left out", flush=True)
            continue
        trial = programs[mode].render(64, 0)
        samples[mode] = samples_for(64 * PIXELS / max(1e-3, trial["cpu_s"]), arguments.seconds)
    programs["spectile"] = spectile
    rounds = {name: [] for name in programs}
    for seed in range(1, arguments.rounds + 1):
        for name, program in programs.items():
            run = program.render(samples[name], seed)
            error = reference.rel_mse(run["picture"])
            rounds[name].append({
                "samples": run["samples"], "cpu_s": run["cpu_s"], "wall_s": run["wall_s"], "peak_mib": run["peak_mib"], "rel_mse": error,
                "product": error * run["cpu_s"], "paths_per_s": run["samples"] * PIXELS / run["cpu_s"],
                # Of all light in the picture: both render the same scene.
                "brightness": float(run["picture"].mean() / reference.mean.mean()),
            })  # fmt: skip
    result = {"channels": channels, "lamp": lamp, "reference_noise": reference.noise, "reference_samples": 4 * long[0]["samples"]}
    if agreement is not None:
        result["reference_against_peer"] = agreement
    for name in rounds:
        result[name] = {key: spread([run[key] for run in rounds[name]]) for key in rounds[name][0]}
    for mode in programs.keys() & MODES:
        result[mode].update(programs[mode].facts)
        programs[mode].close()
        # Round by round, as what the machine does meanwhile is then the same.
        pairs = zip(rounds[mode], rounds["spectile"])
        result[mode]["ratio"] = spread([theirs["product"] / ours["product"] for theirs, ours in pairs])
    return result


def against_peer(arguments, reference, channels, lamp):
    """relMSE between the reference and the peer's own, where that is known."""
    if channels != 32 or lamp != "box" or not arguments.reference:
        return None
    with np.load(arguments.reference) as file:
        theirs = file["ref"].reshape(PIXELS, 32) / np.diff(file["edges_nm"])
    return float(reference.rel_mse(theirs))


def spread(values):
    return {"median": statistics.median(values), "least": min(values), "most": max(values)}


def verdicts(results):
    for result in results:
        goals = GOALS.get(result["channels"])
        if goals and result["lamp"] == "box":
            for mode, goal in zip(MODES, goals):
                name = f"K = {result['channels']}, {mode}"
                if mode not in result:
                    yield f"{name}: not measured, as it did not compile in time; the goal is {goal}"
                    continue
                ratio = result[mode]["ratio"]["median"]
                yield f"{name}: {ratio:.1f} times, the goal of {goal} is {'met' if ratio >= goal else 'NOT met'}"


def measured(result):
    return [name for name in ["spectile", *MODES] if name in result]


def line(result):
    parts = [f"{result['lamp']:8} K = {result['channels']:4}"]
    for name in measured(result):
        r = result[name]
        text = f"{name} {r['paths_per_s']['median'] / 1e3:.0f} k paths/s, relMSE x s {r['product']['median']:.3g}, {r['peak_mib']['median']:.0f} MiB"
        if name in MODES:
            ratio = r["ratio"]
            text += f": {ratio['median']:.3g} times ({ratio['least']:.3g} to {ratio['most']:.3g})"
        parts.append(text)
    return "; ".join(parts)


def write(folder, document):
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "peer.json").write_text(json.dumps(document, indent=1) + "\n")
    keys = ["rel_mse", "cpu_s", "product", "paths_per_s", "peak_mib", "brightness", "ratio"]
    with open(folder / "peer.csv", "w", newline="") as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow(["lamp", "channels", "program", "samples", *(f"{key}{end}" for key in keys for end in ("", "_least", "_most")), "compilation_s", "tracing_s"])
        for result in document["results"]:
            for name in measured(result):
                r = result[name]
                numbers = [f"{r[key][end]:.5g}" if key in r else "" for key in keys for end in ("median", "least", "most")]
                table.writerow([result["lamp"], result["channels"], name, r["samples"]["median"], *numbers, *(f"{r[key]:.3g}" if key in r else "" for key in ("compilation_s", "tracing_s"))])


def processor():
    try:
        names = [l.split(":")[1].strip() for l in Path("/proc/cpuinfo").read_text().splitlines() if l.startswith("model name")]
    except OSError:
        names = []
    return f"{os.cpu_count()} x {names[0]}" if names else f"{os.cpu_count()} cores"


def main():
    parser = argparse.ArgumentParser(prog="benches/peer/run", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--channels", default="8,32,100,400,1000", help="numbers of channels (default %(default)s)")
    parser.add_argument("--lamps", default=",".join(LAMPS), help="; ".join(f"{name}: {what}" for name, (_, _, what) in LAMPS.items()))
    parser.add_argument("--seconds", type=float, default=10, help="CPU seconds of a run (default %(default)s)")
    parser.add_argument("--rounds", type=int, default=5, help="rounds, in which each runs once (default %(default)s)")
    parser.add_argument("--compilation-limit", type=float, default=900, help="seconds that Mitsuba may compile for (default %(default)s)")
    parser.add_argument("--core", type=int, default=0, help="the core that all run on (default %(default)s)")
    parser.add_argument("--reference", default="tests/data/cornell_reference_K32.npz", help="the peer's own reference in 32 channels, to check ours against")
    parser.add_argument("-o", "--output", type=Path, default=Path("out/peer"), help="the folder for peer.csv and peer.json (default %(default)s)")
    parser.add_argument("--spectile", required=True, help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    document = {
        "command": "benches/peer/run " + " ".join(sys.argv[3:]),
        "date": datetime.date.today().isoformat(),
        "processor": processor(),
        "load_at_start": os.getloadavg(),
        "llvm": os.environ.get("DRJIT_LIBLLVM_PATH"),
        "lamps": {name: what for name, (_, _, what) in LAMPS.items()},
        "results": [],
    }
    for lamp in arguments.lamps.split(","):
        for channels in map(int, arguments.channels.split(",")):
            with tempfile.TemporaryDirectory(prefix="spectile-peer-") as folder:
                result = measure(arguments, channels, lamp, Path(folder))
            result["load"] = os.getloadavg()[0]
            document["results"].append(result)
            print(line(result), flush=True)
            write(arguments.output, document)
    document["verdicts"] = list(verdicts(document["results"]))
    write(arguments.output, document)
    print("\n".join(document["verdicts"]))


if __name__ == "__main__":
    main()

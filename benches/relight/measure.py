"""Factored cubes against ordinary ones: how fast they render, what they take, how fast they are relit, whether that is what a fresh render of other
seed shows, and what wavelengths cost.

    measure.py --spectile PROGRAM [-o FOLDER] [--rounds N] [--samples N]

Renders take turns, medians are told. Times of renders are those of the processor on software devices (a machine with other things to do takes
hardly more of it), without what two renders of few and many samples have in common: compilation, scenes, tables. Relighting is on one core.
Needs nothing but Python 3.9 and the program.
"""

import argparse
import csv
import html
import json
import os
import pathlib
import resource
import shutil
import statistics
import subprocess
import tempfile
import time

SCENES = [("cornell/cornell", "64x64", ["spectra.lamp.blackbody=2700"]), ("lounge/lounge", "64x40", ["spectra.ceiling_lamp.scale=0.1"])]
# Other lamps, paints and light, by scene; and which of these make a picture, in how many channels.
LAMPS = {"cornell": {"spectra.lamp.blackbody": "2700", "spectra.lamp.scale": "1e-4"},
         "lounge": {"spectra.ceiling_lamp": "0.0", "spectra.standing_lamp.blackbody": "2500"}}
PAINTS = {"cornell": {"spectra.red": "0.3"}, "lounge": {"spectra.wall": "0.4", "spectra.sofa": "0.7"}}
LIGHT = {"cornell": {"spectra.lamp": '{ illuminant = "FL11", scale = 0.02 }'}, "lounge": {"spectra.window": '{ illuminant = "D75", scale = 0.02 }'}}
CHANGES = [("lamps", [LAMPS], 60), ("paints", [PAINTS], 60), ("illuminant", [LIGHT], 60), ("lamps, paints", [LAMPS, PAINTS], 37), ("illuminant, paints", [LIGHT, PAINTS], 200)]
CHANNELS = [400, 2000]
# Lines of mercury in the Cornell box.
SPIKY = "spectra.lamp={{ file = \"{}\", column = \"mercury\" }}"


class Program:
    def __init__(self, path, scenes):
        self.path, self.scenes = path, scenes
        adapter = next(event for event in self.run("devices", "--json") if event["event"] == "device")
        self.device, self.is_software = adapter["name"], adapter["is_software"]
        self.folder = pathlib.Path(tempfile.mkdtemp())

    def run(self, *arguments, cores=None):
        environment = {**os.environ, **({"RAYON_NUM_THREADS": str(cores)} if cores else {})}
        done = subprocess.run([self.path, *arguments], capture_output=True, text=True, env=environment)
        if done.returncode not in (0, 1):
            raise RuntimeError(done.stderr.strip().splitlines()[0])
        return [json.loads(line) for line in done.stdout.splitlines()]

    def seconds(self, *arguments, cores=None):
        """Of a run: processor time on software devices."""
        times = lambda: (time.monotonic(), sum(resource.getrusage(resource.RUSAGE_CHILDREN)[:2]))
        before = times()
        events = self.run(*arguments, cores=cores)
        return [after - before for after, before in zip(times(), before)][self.is_software], events

    def render(self, scene, size, channels, name, samples, *more):
        """Seconds a path, with `samples` samples per pixel in the end."""
        cube = self.folder / name
        shutil.rmtree(cube, ignore_errors=True)
        arguments = ["render", str(self.scenes / f"{scene}.toml"), "-o", str(cube), "--size", size, "--json"]
        arguments += ["--set", f"channels.equal.count={channels}", *more]
        few = 64
        few_s, _ = self.seconds(*arguments, "--spp", str(few))
        more_s, _ = self.seconds(*arguments, "--resume", "--spp", str(samples))
        width, height = map(int, size.split("x"))
        # The second one sets up again, and renders what is missing.
        empty_s, _ = self.seconds(*arguments, "--resume", "--spp", str(samples))
        return (more_s - empty_s) / ((samples - few) * width * height)

    def bytes(self, name, arrays):
        files = (file for array in arrays for file in (self.folder / name / array).rglob("*") if file.is_file())
        return sum(file.stat().st_size for file in files)


def measure(program, rounds, samples):
    rows = []

    def tell(**row):
        rows.append(row)
        print(", ".join(f"{key} {value:.4g}" if isinstance(value, float) else f"{key} {value}" for key, value in row.items()), flush=True)

    for scene, size, change in SCENES:
        name = scene.split("/")[1]
        width, height = map(int, size.split("x"))
        for channels in CHANNELS:
            times = {"ordinary": [], "factored": []}
            for _ in range(rounds):
                times["ordinary"].append(program.render(scene, size, channels, "ordinary.zarr", samples))
                times["factored"].append(program.render(scene, size, channels, "factored.zarr", samples, "--factored"))
            median = {kind: statistics.median(of) for kind, of in times.items()}
            tell(
                what="render", scene=name, channels=channels, ordinary_us=1e6 * median["ordinary"], factored_us=1e6 * median["factored"],
                ratio=median["ordinary"] / median["factored"],
            )
        # Size and relighting at 1,000 channels.
        cube = str(program.folder / "factored.zarr")
        again = program.render(scene, size, 1000, "ordinary.zarr", samples) * samples * width * height
        weights = program.bytes("factored.zarr", ["weights", "products"]) / (width * height)
        found, settings = [], [argument for key in change for argument in ("--set", key)]
        for _ in range(rounds):
            relit = str(program.folder / "relit.zarr")
            arguments = ["relight", cube, "-o", relit, "--overwrite", "--channels", "equal.count=1000", *settings, "--json"]
            seconds, events = program.seconds(*arguments, cores=1)
            found.append((seconds, events[-1]["expand_s"], events[-1]["entries_per_pixel"]))
        seconds, expand, entries = (statistics.median(values) for values in zip(*found))
        values = width * height * 1000
        tell(
            what="size", scene=name, samples=samples, weights_bytes_a_pixel=weights, radiance_bytes_a_pixel=4000.0, ratio=4000.0 / weights,
            entries_a_pixel=entries,
        )
        tell(
            what="relight", scene=name, samples=samples, ns_a_value_and_its_error=1e9 * expand / values, ns_a_value_written=1e9 * seconds / values,
            relight_s=seconds, render_again_s=again, ratio=again / seconds,
        )
        # The same as a fresh render, in every channel.
        common = ["--uncertainty", "--set", "integrator.epoch=16"]
        program.render(scene, size, 60, "before.zarr", samples, "--factored", *common)
        for changed, of, channels in CHANGES:
            settings = [argument for kind in of for key, value in kind[name].items() for argument in ("--set", f"{key}={value}")]
            relit = str(program.folder / "relit.zarr")
            program.run("relight", str(program.folder / "before.zarr"), "-o", relit, "--overwrite", "--channels", f"equal.count={channels}", *settings, "--json")
            program.render(scene, size, channels, "fresh.zarr", samples, "--seed", "1", *common, *settings)
            compared = program.run("compare", relit, str(program.folder / "fresh.zarr"), "--json")
            distances = [abs(channel["z"]) for channel in compared[-1]["channels"]]
            tell(what="relit against fresh", scene=name, changed=changed, channels=channels, median_z=statistics.median(distances), largest_z=max(distances))
    # A lamp of lines in eight channels: what of the noise is that of wavelengths.
    lamps = (program.scenes / "conference/spectra/lamps.csv").resolve()
    scene, size, _ = SCENES[0]
    common = [scene, size, 8]
    lamp = ["--set", SPIKY.format(lamps)]
    program.render(*common, "truth.zarr", 64 * samples, "--factored", "--seed", "1", *lamp)
    for kind, more in [("uniform", ["--set", "integrator.wavelengths=uniform"]), ("emission", []), ("factored", ["--factored"])]:
        program.render(*common, "spiky.zarr", samples, *more, *lamp)
        compared = program.run("compare", str(program.folder / "spiky.zarr"), str(program.folder / "truth.zarr"), "--json", "--tolerance", "9")
        errors = [channel["rel_mse"] for channel in compared[-1]["channels"]]
        tell(what="lines in 8 channels", wavelengths=kind, samples=samples, rel_mse=statistics.fmean(errors), worst=max(errors))
    return rows


def page(rows, device):
    def cell(value):
        return f"{value:.3g}" if isinstance(value, float) else html.escape(str(value))

    style = "body{font:15px sans-serif;max-width:75em;margin:2em auto}td,th{padding:.15em .7em;text-align:right}td:first-child,th:first-child{text-align:left}"
    parts = [f"<!doctype html><meta charset=utf-8><title>Factored cubes</title><style>{style}</style><h1>Factored cubes against ordinary ones</h1>"]
    parts.append(
        f"<p>{html.escape(device)}. Microseconds and seconds are processor time; relighting is on one core, to 1,000 channels, written included. "
        "<i>ratio</i>: what the ordinary cube takes over what the factored one does. <i>z</i>: distance of a channel's mean in standard errors. Made by benches/relight/run.</p>"
    )
    for what in dict.fromkeys(row["what"] for row in rows):
        of = [row for row in rows if row["what"] == what]
        head = [key for key in of[0] if key != "what"]
        lines = "".join("<tr>" + "".join(f"<td>{cell(row[key])}</td>" for key in head) + "</tr>" for row in of)
        parts.append(f"<h2>{what}</h2><table><tr>{''.join(f'<th>{key}</th>' for key in head)}</tr>{lines}</table>")
    return "\n".join(parts) + "\n"


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--spectile", required=True)
    parser.add_argument("-o", "--output", default="out/relight")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--samples", type=int, default=256, help="per pixel")
    arguments = parser.parse_args()
    program = Program(arguments.spectile, pathlib.Path(__file__).resolve().parents[2] / "scenes")
    try:
        rows = measure(program, arguments.rounds, arguments.samples)
    finally:
        shutil.rmtree(program.folder, ignore_errors=True)
    output = pathlib.Path(arguments.output)
    output.mkdir(parents=True, exist_ok=True)
    fields = list(dict.fromkeys(key for row in rows for key in row))
    with open(output / "relight.csv", "w", newline="") as file:
        writer = csv.DictWriter(file, fields)
        writer.writeheader()
        writer.writerows(rows)
    (output / "relight.html").write_text(page(rows, program.device))


main()

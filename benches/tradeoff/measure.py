"""Error against time for every choice between paths and evaluations: wavelengths per channel, roulette on evaluation, and what `auto`
makes of it.

    measure.py --spectile PROGRAM [-o FOLDER] [--scenes NAMES] [--channels K,K] [--choices NAMES]
               [--rounds N] [--minutes N] [--gas FOLDER]

What was measured is kept in FOLDER/measured.jsonl, a line a render, and not measured again: so it can be done in parts. Each choice
renders the same picture for some epochs; in rounds after the first for fewer, of which only the time counts. Time is the median of the
epochs' after the first, so compilation and the pilot are apart, and then of the rounds; processor time on software devices. The choices
of a scene and number of channels take turns. Error is the cube's own estimate from the spread of its epochs, one for each channel: the
choices have the same seed, and so the same paths. Efficiency is 1 / (mean over channels of error² x time a path), of which ratios to all
paths at one wavelength are told. Needs nothing but Python 3.9 and the program.
"""

import argparse
import csv
import html
import json
import math
import pathlib
import shutil
import statistics
import subprocess
import tempfile
import time

# Scene, and the epochs and pixels that its noise asks for.
SCENES = ["cornell/cornell", "statues/statues", "aircraft/aircraft", "conference/conference", "aircraft/aircraft-infrared", "aircraft/aircraft-lines"]
# What an imaging spectrometer sees of these: `channels` are its bands, by responses.
SCENES += ["conference/conference-bands", "aircraft/aircraft-bands"]
# The infrared aircraft with a plume line by line: the scene that it is made of, and what is set there. Absorption at 1 atm in steps of 0.02
# and 0.01 cm-1, 25,000 nodes at each of five temperatures; CO as of a poor combustion.
LINES = ["lbl_co_2000-2300cm_1atm.csv", "lbl_h2o_2000-2100cm_1atm.csv"]
EPOCH, EPOCHS = 16, 16
# Epochs of a render that is only timed.
TIMED = 6
SIZE = "32x20"


class Choice:
    def __init__(self, name, settings, scale=None):
        self.name, self.settings, self.scale = name, settings, scale


def choices(scene, channels, sweep):
    """What is compared, all paths at one wavelength first."""
    found = [
        Choice("all", {"evaluation": "all", "wavelengths_per_channel": 1}),
        Choice("auto", {"evaluation": "auto", "wavelengths_per_channel": "auto"}),
        Choice("roulette", {"evaluation": "roulette", "wavelengths_per_channel": 1}),
    ]
    if channels <= 32 or scene.endswith("-bands"):
        found += [Choice(f"m={m}", {"evaluation": "all", "wavelengths_per_channel": m}) for m in (2, 4, 8, 16)]
    if sweep:
        found += [Choice(f"s x {factor:g}", {"evaluation": "roulette", "wavelengths_per_channel": 1}, factor) for factor in (0.125, 0.5, 2, 8)]
    return found


class Program:
    def __init__(self, path, scenes, gas):
        self.path, self.scenes, self.gas = path, scenes, gas.resolve()
        self.is_software = False
        adapter = next(event for event in self.run("devices", "--json") if event["event"] == "device")
        self.device, self.is_software = adapter["name"], adapter["is_software"]
        self.folder = pathlib.Path(tempfile.mkdtemp())

    def run(self, *arguments):
        return [event for event, _ in self.timed(*arguments)]

    def timed(self, *arguments):
        """Events of a run, each with the seconds at which it came: processor time of the run on software devices (so on Linux), of which
        a machine with other things to do takes hardly more."""
        with tempfile.TemporaryFile("w+") as errors:
            process = subprocess.Popen([self.path, *arguments], stdout=subprocess.PIPE, stderr=errors, text=True)
            events = [(json.loads(line), self.seconds(process)) for line in process.stdout]
            if process.wait() != 0:
                errors.seek(0)
                raise RuntimeError(errors.readline().strip())
        return events

    def seconds(self, process):
        if not self.is_software:
            return time.monotonic()
        # What clock_getcpuclockid(3) gives on Linux: the clock of all threads of a process, while there is one.
        try:
            return time.clock_gettime((~process.pid << 3) | 2)
        except OSError:
            return math.nan

    def of_scene(self, scene, channels):
        """Its file, and what is set in it."""
        if scene.endswith("-bands"):
            return self.scenes / f"{scene.removesuffix('-bands')}.toml", [f'channels={{ responses = "{self.bands(channels)}" }}']
        if not scene.endswith("-lines"):
            return self.scenes / f"{scene}.toml", self.count(self.scenes / f"{scene}.toml", channels)
        tables = [self.gas / name for name in LINES]
        missing = [str(table) for table in tables if not table.exists()]
        if missing:
            raise RuntimeError(f"{missing[0]} is not there (--gas)")
        species = ", ".join(f'{{ table = "{table}", fraction = {fraction} }}' for table, fraction in zip(tables, (0.01, 0.034)))
        settings = [f"media.plume.species=[{species}]", "channels.equal.from=4350", "channels.equal.to=4990"]
        file = self.scenes / "aircraft/aircraft-infrared.toml"
        return file, settings + self.count(file, channels)

    @staticmethod
    def count(file, channels):
        """Settings for so many channels where the scene has them."""
        text = file.read_text()
        key = "wavenumber" if "\nwavenumber" in text else "equal"
        settings = [f"channels.{key}.count={channels}"]
        if "false_colour" in text:
            settings.append(f"channels.false_colour=[{channels - 1},{channels // 2},0]")
        return settings

    def bands(self, count):
        """A file of bands side by side from 400 to 700 nm, bells that are 1.2 times as wide at half their height as they are apart."""
        file, step = self.folder / f"bands-{count}.csv", 300 / count
        bell = [(1.2 * step * i / 16, math.exp(-4 * math.log(2) * (i / 16) ** 2)) for i in range(-24, 25)]
        centres = [400 + step * (k + 0.5) for k in range(count)]
        rows = [f"{k},{centre + x:.6f},{value:.6f}" for k, centre in enumerate(centres) for x, value in bell]
        file.write_text("\n".join(["band,wavelength_nm,response", *rows, ""]))
        return file

    def render(self, scene, channels, choice, turn):
        """Seconds a path, error of every channel (of the first turn), what was chosen."""
        file, set_in_scene = self.of_scene(scene, channels)
        cube = self.folder / "cube.zarr"
        shutil.rmtree(cube, ignore_errors=True)
        settings = {**choice.settings, "epoch": EPOCH}
        arguments = ["render", str(file), "-o", str(cube), "--size", SIZE, "--json"]
        for setting in set_in_scene:
            arguments += ["--set", setting]
        for name, value in settings.items():
            arguments += ["--set", f"integrator.{name}={value}"]
        if choice.scale:
            self.run(*arguments, "--spp", "1")
            chosen = cube / ".spectile/choices.json"
            written = json.loads(chosen.read_text())
            if written["scale"] is None:
                raise RuntimeError(written["reason"])
            written["scale"] *= choice.scale
            chosen.write_text(json.dumps(written))
            arguments.append("--resume")
        ends = [seconds for event, seconds in self.timed(*arguments, "--spp", str(EPOCH * (TIMED if turn else EPOCHS))) if event["event"] == "epoch"]
        ends = [seconds for seconds in ends if not math.isnan(seconds)]
        # Setting up is before the end of the first.
        width, height = map(int, SIZE.split("x"))
        seconds = statistics.median(after - before for before, after in zip(ends, ends[1:])) / (EPOCH * width * height)
        info = self.run("info", str(cube), "--json")[-1]
        errors = None if turn else [channel["error_estimate"] for channel in info["channels"]]
        return seconds, errors, info["choices"]


class Measured:
    """What is known, by scene, channels, choice and turn: kept in a file, a line for each."""

    def __init__(self, file):
        self.file, self.found = file, {}
        for line in file.read_text().splitlines() if file.exists() else []:
            render = json.loads(line)
            self.found[tuple(render["what"])] = render["result"]

    def add(self, what, result):
        self.found[what] = result
        with open(self.file, "a") as file:
            file.write(json.dumps({"what": what, "result": result}) + "\n")

    def turns(self, scene, channels, choice):
        """All turns; or why there are none, or None where nobody has asked yet."""
        found = [result for (s, k, c, _), result in self.found.items() if (s, k, c) == (scene, channels, choice)]
        refused = [result for result in found if isinstance(result, str)]
        return refused[0] if refused else found or None


def measure(program, measured, scenes, channel_counts, wanted, rounds, until):
    """Whatever is missing, turn by turn, while there is time."""
    for turn in range(rounds):
        for scene in scenes:
            for channels in channel_counts:
                for choice in choices(scene, channels, channels == max(channel_counts)):
                    if wanted and choice.name not in wanted:
                        continue
                    what = (scene, channels, choice.name, turn)
                    if what in measured.found or isinstance(measured.turns(scene, channels, choice.name), str):
                        continue
                    if time.monotonic() > until:
                        return
                    try:
                        result = program.render(scene, channels, choice, turn)
                    except RuntimeError as refused:
                        result = str(refused)
                    measured.add(what, result)
                    print(*what, result if isinstance(result, str) else f"{1e6 * result[0]:.1f} us a path", flush=True)


def taken(chosen):
    """What `auto` took, by the name of that fixed choice where it is one."""
    kind = "roulette" if chosen["scale"] else "all"
    several = chosen["wavelengths_per_channel"] or 1
    return kind if several == 1 else f"m={several}" + (", roulette" if chosen["scale"] else "")


def times(measured, scene, channels, choice):
    """Seconds a path of all turns. Where `auto` takes a fixed choice both are the same render, so that their times are of both."""
    auto = measured.turns(scene, channels, "auto")
    same = taken(auto[0][2]) if auto and not isinstance(auto, str) and auto[0][2] else None
    names = {"auto", same} if choice in ("auto", same) else {choice}
    found = [measured.turns(scene, channels, name) for name in names]
    return [turn[0] for turns in found if turns and not isinstance(turns, str) for turn in turns]


def table_of(measured):
    """A row for each choice of each scene and number of channels of which all paths were measured too."""
    rows = []
    known = {(scene, channels) for scene, channels, _, _ in measured.found}
    for scene, channels in sorted(known, key=lambda s: (SCENES.index(s[0]), s[1])):
        base = measured.turns(scene, channels, "all")
        for choice in choices(scene, channels, True):
            turns = measured.turns(scene, channels, choice.name)
            if turns is not None and base is not None and (isinstance(turns, str) or not isinstance(base, str)):
                of_both = [[] if isinstance(turns, str) else times(measured, scene, channels, name) for name in (choice.name, "all")]
                rows.append(row(scene, channels, choice, turns, base, *of_both))
                print(rows[-1]["text"], flush=True)
    return rows


def against_fixed(rows):
    """Of each scene and number of channels: auto's gain, and the best fixed choice's."""
    found = []
    for scene, channels in dict.fromkeys((r["scene"], r["channels"]) for r in rows):
        here = {r["choice"]: r for r in rows if (r["scene"], r["channels"]) == (scene, channels) and "gain" in r}
        fixed = {name: r["gain"] for name, r in here.items() if name in ("all", "roulette") or name.startswith("m=")}
        if "auto" not in here or not fixed:
            continue
        auto, best = here["auto"], max(fixed, key=fixed.get)
        kind = taken({"scale": auto["scale"], "wavelengths_per_channel": auto["wavelengths"]})
        found.append({"scene": scene, "channels": channels, "auto": kind, "expected": auto["predicted"], "gain": auto["gain"],
                      "best": best, "best_gain": fixed[best], "of_best": auto["gain"] / fixed[best]})
    return found


def row(scene, channels, choice, turns, base, own_times, times_of_all):
    result = {"scene": scene.split("/")[1], "channels": channels, "choice": choice.name}
    if isinstance(turns, str):
        return {**result, "note": turns, "text": f"{result['scene']} {channels} {choice.name}: {turns}"}
    seconds, of_all = statistics.median(own_times), statistics.median(times_of_all)
    squares = [[error**2 for error in next(turn[1] for turn in several if turn[1])] for several in (turns, base)]
    lit = [k for k in range(channels) if squares[1][k] > 0]
    growth = [squares[0][k] / squares[1][k] for k in lit]
    chosen = turns[0][2] or {}
    mean = statistics.fmean(growth)
    result |= {
        "microseconds": 1e6 * seconds,
        "error": math.sqrt(statistics.fmean(squares[0][k] for k in lit)),
        "time": seconds / of_all,
        "variance": mean,
        "worst_variance": max(growth),
        "gain": of_all / (seconds * mean),
        "predicted": chosen["gain"] * chosen["wavelengths_gain"] if chosen else None,
        "wavelengths": chosen.get("wavelengths_per_channel"),
        "evaluated": chosen.get("evaluated"),
        "scale": chosen.get("scale"),
        "note": chosen.get("reason", ""),
    }
    predicted = "" if chosen.get("scale") is None else f", predicted {chosen['gain']:.2f} with {100 * chosen['evaluated']:.0f} % of the paths"
    text = f"{result['scene']} {channels} {choice.name}: {result['microseconds']:.1f} us a path, variance x {mean:.2f}"
    return {**result, "text": f"{text} (at most {max(growth):.2f}), gain {result['gain']:.2f}{predicted}"}


def fewer(rows):
    """n of K channels a path, drawn anew for each: error² goes as K/n, so its efficiency, over that of all K, is n/K T(K)/T(n)."""
    times = {(r["scene"], r["channels"]): r["microseconds"] for r in rows if r["choice"] == "all" and "microseconds" in r}
    found = []
    for (scene, n), of_n in times.items():
        for (other, many), of_many in times.items():
            if other == scene and n < many == max(k for s, k in times if s == scene):
                found.append({"scene": scene, "n": n, "channels": many, "efficiency": n / many * of_many / of_n})
    return found


FIELDS = ["scene", "channels", "choice", "microseconds", "error", "time", "variance", "worst_variance", "gain", "predicted", "wavelengths", "evaluated", "scale", "note"]


def page(rows, device, rounds):
    """One file with tables, and a drawing of gain against s for every scene."""

    def cell(value):
        return "" if value is None else f"{value:.3g}" if isinstance(value, float) else html.escape(str(value))

    def table(head, lines):
        body = "".join("<tr>" + "".join(f"<td>{cell(value)}</td>" for value in line) + "</tr>" for line in lines)
        return "<table><tr>" + "".join(f"<th>{html.escape(name)}</th>" for name in head) + f"</tr>{body}</table>"

    style = "body{font:15px sans-serif;max-width:75em;margin:2em auto}td,th{padding:.15em .7em;text-align:right}td:first-child,th:first-child,td:last-child{text-align:left}"
    parts = [f"<!doctype html><meta charset=utf-8><title>Paths against evaluations</title><style>{style}</style>"]
    parts.append("<h1>Paths against evaluations</h1>")
    parts.append(
        f"<p>{html.escape(device)}; {SIZE} pixels, {EPOCH * EPOCHS} samples each, {rounds} rounds of times. <i>Gain</i>: error² x time of all paths at one wavelength a "
        "channel, over that of the choice; <i>predicted</i>: by the pilot, before the render. Made by benches/tradeoff/run.</p>"
    )
    parts.append("<h2>Fewer wavelengths than channels: n of K a path</h2><p>Efficiency over that of all K, from the measured times.</p>")
    parts.append(table(["scene", "n", "K", "efficiency"], [[f["scene"], f["n"], f["channels"], f["efficiency"]] for f in fewer(rows)]))
    parts.append(
        "<h2>Auto against the best fixed choice</h2><p>Gains over all paths at one wavelength; <i>over best</i>: auto's over that of the best "
        "fixed choice. What auto takes and the fixed choice of that kind are the same render, and have their times together.</p>"
    )
    names = ["scene", "channels", "auto", "expected", "gain", "best", "best_gain", "of_best"]
    heads = ["scene", "channels", "auto took", "expected", "gain", "best fixed", "its gain", "over best"]
    parts.append(table(heads, [[f[name] for name in names] for f in against_fixed(rows)]))
    parts.append("<h2>Several wavelengths a channel, roulette on evaluation, auto</h2>")
    parts.append(table(FIELDS, [[r.get(field) for field in FIELDS] for r in rows]))
    parts.append("<h2>Gain against s</h2><p>Dots: measured. The first line of each scene's table above is all paths, gain 1.</p>")
    parts.append(drawing(rows))
    return "\n".join(parts)


def drawing(rows):
    """Gain of roulette against its scale s, both logarithmic, a colour a scene."""
    colours = ["#1b6ca8", "#c0392b", "#27864b", "#8e5ea2", "#b7791f"]
    width, height, left = 640, 320, 60
    scenes = {}
    for r in rows:
        if r.get("scale") and "gain" in r:
            scale = r["scale"]
            scenes.setdefault((r["scene"], r["channels"]), {})[scale] = r["gain"]
    scenes = {key: points for key, points in scenes.items() if len(points) > 2}
    if not scenes:
        return ""
    every = [(s, g) for points in scenes.values() for s, g in points.items()]
    span = [[math.log(min(p[i] for p in every)), math.log(max(p[i] for p in every))] for i in (0, 1)]
    place = lambda value, i, size: (math.log(value) - span[i][0]) / (span[i][1] - span[i][0] or 1.0) * size
    parts = [f'<svg viewBox="0 0 {width + left + 220} {height + 50}" width="{width + left + 220}" xmlns="http://www.w3.org/2000/svg">']
    for value in sorted({round(math.exp(span[1][0]), 2), 1.0, round(math.exp(span[1][1]), 2)}):
        y = height - place(value, 1, height - 20)
        parts.append(f'<line x1="{left}" x2="{left + width}" y1="{y:.1f}" y2="{y:.1f}" stroke="#ccc"/><text x="5" y="{y + 4:.1f}">{value:g}</text>')
    for number, ((scene, channels), points) in enumerate(scenes.items()):
        colour = colours[number % len(colours)]
        line = [(left + place(s, 0, width), height - place(g, 1, height - 20)) for s, g in sorted(points.items())]
        parts.append(f'<polyline fill="none" stroke="{colour}" points="' + " ".join(f"{x:.1f},{y:.1f}" for x, y in line) + '"/>')
        parts += [f'<circle cx="{x:.1f}" cy="{y:.1f}" r="4" fill="{colour}"/>' for x, y in line]
        parts.append(f'<text x="{left + width + 10}" y="{20 + 20 * number}" fill="{colour}">{html.escape(scene)}, {channels}</text>')
    for value in sorted({s for s, _ in every}):
        parts.append(f'<text x="{left + place(value, 0, width) - 10:.1f}" y="{height + 30}" font-size="11">{value:.3g}</text>')
    return "".join(parts) + "</svg>"


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("--spectile", required=True, help="the program")
    parser.add_argument("--scene-folder", type=pathlib.Path, default=pathlib.Path("scenes"), help="where scenes are")
    parser.add_argument("-o", "--output", type=pathlib.Path, default=pathlib.Path("out/tradeoff"))
    parser.add_argument("--scenes", default=",".join(SCENES))
    parser.add_argument("--channels", default="8,32,128,512")
    parser.add_argument("--rounds", type=int, default=1, help="turns of every choice: medians of times")
    parser.add_argument("--choices", help="only these, such as all,auto")
    parser.add_argument("--minutes", type=float, default=math.inf, help="begins no render after these; the next call goes on")
    parser.add_argument("--gas", type=pathlib.Path, default=pathlib.Path("../shared/data/gas"), help=f"where {' and '.join(LINES)} are")
    arguments = parser.parse_args()
    arguments.output.mkdir(parents=True, exist_ok=True)
    measured = Measured(arguments.output / "measured.jsonl")
    program = Program(arguments.spectile, arguments.scene_folder, arguments.gas)
    until = time.monotonic() + 60 * arguments.minutes
    try:
        channels = [int(k) for k in arguments.channels.split(",")]
        wanted = arguments.choices and arguments.choices.split(",")
        measure(program, measured, arguments.scenes.split(","), channels, wanted, arguments.rounds, until)
    finally:
        shutil.rmtree(program.folder, ignore_errors=True)
    rows = table_of(measured)
    with open(arguments.output / "tradeoff.csv", "w", newline="") as file:
        writer = csv.DictWriter(file, FIELDS, extrasaction="ignore")
        writer.writeheader()
        writer.writerows(rows)
    (arguments.output / "tradeoff.html").write_text(page(rows, program.device, arguments.rounds))


if __name__ == "__main__":
    main()

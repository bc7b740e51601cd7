"""Tiles that end by their own errors (`--error-per tile`) against pictures that end as a whole.

    measure.py --spectile PROGRAM [-o FOLDER] [--seeds N] [--only gain|bias] [--scene NAME]

*Gain*: to bring every tile to the same error, an even render takes everywhere the samples of the tile that needs most. The same tile has
the same bytes in both, so one render with `--error-per tile` tells what both take: the mean and the most of `samples`.

*Bias*: a rule that looks at data stops sooner where these happen to agree. Renders of many seeds, 4 x 4 tiles of a scene, are compared with even ones of the same seeds that go on to more samples, whose mean has no such bias. Told of each tile and channel: the mean
difference in standard errors of one render's tile mean, and the error's true size over its estimate.
Needs nothing but Python 3.9 and the program.
"""

import argparse
import array
import csv
import json
import math
import pathlib
import statistics
import subprocess
import sys
import tempfile

SIMPLE = ["--set", 'integrator.evaluation="all"', "--set", "integrator.wavelengths_per_channel=1"]
# Scene, nm, size, tile, samples of an epoch, error, most samples.
GAINS = [
    ("conference", (380, 780), "96x60", 8, 16, 0.3, 16384),
    ("aircraft", (380, 780), "96x60", 8, 16, 0.1, 16384),
    ("aircraft-infrared", (1500, 5500), "48x32", 8, 4, 0.2, 2048),
]
# Scene, error, samples of the even renders.
BIASES = [("cornell", 0.1, 512), ("conference", 0.8, 256)]
TILES, TILE, CHANNELS, EPOCH = 4, 8, 8, 4


def channels(nm):
    """Eight of them. What a scene says of its own, such as false colours, goes."""
    return f"channels={{ equal = {{ from = {nm[0]}.0, to = {nm[1]}.0, count = {CHANNELS} }} }}"


def render(program, scene, out, *more):
    folder = scene.split("-")[0]
    command = [program, "render", f"scenes/{folder}/{scene}.toml", "-o", out, "--overwrite", "--json", "--quiet", *SIMPLE, *more]
    done = subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True).stdout
    return json.loads(done.strip().splitlines()[-1])


def numbers(path, kind):
    values = array.array(kind)
    values.frombytes(path.read_bytes())
    if sys.byteorder == "big":
        values.byteswap()
    return values


def samples(cube):
    """Samples per pixel of every tile."""
    return [numbers(path, "I")[0] for path in sorted((cube / "samples/c").glob("*/*"))]


def means(cube):
    """[tile][channel]: the mean over the tile's pixels."""
    tiles = []
    for row in range(TILES):
        for column in range(TILES):
            values = numbers(cube / f"radiance/c/0/{row}/{column}", "f")
            tiles.append([math.fsum(values[k::CHANNELS]) / TILE**2 for k in range(CHANNELS)])
    return tiles


def pixels(cube):
    """[tile][pixel and channel]"""
    return [numbers(cube / f"radiance/c/0/{i // TILES}/{i % TILES}", "f") for i in range(TILES**2)]


def gain(program, folder, of):
    for scene, nm, size, tile, epoch, error, most in GAINS:
        if of not in (None, scene):
            continue
        cube = pathlib.Path(folder) / "gain.zarr"
        stop = ["--error", str(error), "--error-per", "tile", "--spp", str(most)]
        shape = ["--size", size, "--tile", str(tile), "--set", channels(nm), "--set", f"integrator.epoch={epoch}"]
        done = render(program, scene, str(cube), *shape, *stop)
        found = samples(cube)
        mean = statistics.fmean(found)
        full = done["tile_ends"]["by_samples"]
        print(f"{scene}: {mean:.0f} samples a pixel, the most {max(found)} ({full} of {len(found)} tiles by --spp): {max(found) / mean:.2f} times fewer paths")
        yield ["gain", scene, size, tile, epoch, error, len(found), full, min(found), f"{mean:.1f}", max(found), f"{max(found) / mean:.3f}"]


def bias(program, folder, of, seeds):
    for scene, error, even in BIASES:
        if of in (None, scene):
            yield from bias_of(program, folder, scene, error, even, seeds)


def bias_of(program, folder, scene, wanted, samples_of_even, seeds):
    cube = pathlib.Path(folder) / "bias.zarr"
    side = TILES * TILE
    shape = ["--size", f"{side}x{side}", "--tile", str(TILE), "--set", channels((380, 780)), "--set", f"integrator.epoch={EPOCH}"]
    cells = TILES**2
    ended, even, squares, spread = [], [], None, []
    for seed in range(seeds):
        stop = ["--error", str(wanted), "--error-per", "tile"]
        render(program, scene, str(cube), *shape, "--seed", str(seed), "--uncertainty", *stop)
        ended.append((samples(cube), means(cube), pixels(cube)))
        errors = [numbers(cube / f"standard_error/c/0/{i // TILES}/{i % TILES}", "f") for i in range(cells)]
        spread.append([[math.fsum(v * v for v in tile[k::CHANNELS]) for k in range(CHANNELS)] for tile in errors])
        render(program, scene, str(cube), *shape, "--seed", str(seed), "--spp", str(samples_of_even))
        even.append((means(cube), pixels(cube)))
        if seed % 20 == 19:
            print(f"{seed + 1} of {seeds} seeds", file=sys.stderr)
    n = len(ended)
    truth = [[statistics.fmean(e[0][i][k] for e in even) for k in range(CHANNELS)] for i in range(cells)]
    of_pixels = [[math.fsum(e[1][i][j] for e in even) / n for j in range(TILE**2 * CHANNELS)] for i in range(cells)]
    shifts, ratios = [], []
    for i in range(cells):
        for k in range(CHANNELS):
            # Of the mean over the tile, as one render has it.
            error = math.sqrt(statistics.fmean(s[i][k] for s in spread)) / TILE**2
            shift = (statistics.fmean(e[1][i][k] for e in ended) - truth[i][k]) / error if error > 0 else 0.0
            real = statistics.fmean(math.fsum((e[2][i][j] - of_pixels[i][j]) ** 2 for j in range(k, TILE**2 * CHANNELS, CHANNELS)) for e in ended)
            told = statistics.fmean(s[i][k] for s in spread)
            ratio = math.sqrt(real / told) if told > 0 else 1.0
            shifts.append(shift)
            ratios.append(ratio)
            taken = statistics.fmean(e[0][i] for e in ended)
            yield ["bias", scene, wanted, i, k, n, f"{taken:.1f}", f"{shift:.4f}", f"{ratio:.4f}"]
    print(f"{scene}, bias over {n} seeds: mean {statistics.fmean(shifts):+.3f} standard errors, from {min(shifts):+.3f} to {max(shifts):+.3f}; "
          f"true error over estimate {statistics.fmean(ratios):.3f}, from {min(ratios):.3f} to {max(ratios):.3f}")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--spectile", required=True)
    parser.add_argument("-o", "--output", default="out/tiles", type=pathlib.Path)
    parser.add_argument("--seeds", default=200, type=int)
    parser.add_argument("--only", choices=["gain", "bias"])
    parser.add_argument("--scene")
    asked = parser.parse_args()
    asked.output.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as folder:
        for name, head, rows in [
            ("gain", "kind,scene,size,tile,epoch,error,tiles,ended_by_samples,least,mean,most,times_fewer_paths", lambda: gain(asked.spectile, folder, asked.scene)),
            ("bias", "kind,scene,error,tile,channel,seeds,samples,shift_in_standard_errors,true_error_over_estimate", lambda: bias(asked.spectile, folder, asked.scene, asked.seeds)),
        ]:
            if asked.only in (None, name):
                with open(asked.output / f"tiles-{name}.csv", "w", newline="") as file:
                    writer = csv.writer(file, lineterminator="\n")
                    writer.writerow(head.split(","))
                    writer.writerows(rows())


if __name__ == "__main__":
    main()

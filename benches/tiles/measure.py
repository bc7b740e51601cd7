"""Tiles that end by their own errors (`--error-per tile`) against pictures that end as a whole.

    measure.py --spectile PROGRAM [-o FOLDER] [--seeds N] [--only gain|bias] [--scene NAME]

*Gain*: to bring every tile to the same error, an even render takes everywhere the samples of the tile that needs most. The same tile has
the same bytes in both, so one render with `--error-per tile` tells what both take: the mean and the most of `samples`.

*Bias*: a rule that looks at data stops sooner where these happen to agree. Renders of many seeds, 4 x 4 tiles of a scene, are read where the rule may end a tile for the first time, and gone on with until it has ended all. A mean over a number of samples that no data decide has no such bias, so the
mean difference of the two is what is sought; told by tile and channel in standard errors of one render's tile mean, with its own uncertainty, and beside it the error's true size over its estimate.
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
# Scene, error. Epochs are those of the scenes: 64 samples, and a tile ends at the second look in a row, after ten of them at the earliest.
BIASES = [("cornell", 0.08), ("conference", 0.35)]
FIRST = 640
TILES, TILE, CHANNELS = 4, 8, 8


def channels(nm):
    """Eight of them. What a scene says of its own, such as false colours, goes."""
    return f"channels={{ equal = {{ from = {nm[0]}.0, to = {nm[1]}.0, count = {CHANNELS} }} }}"


def render(program, scene, out, *more):
    folder = scene.split("-")[0]
    command = [program, "render", f"scenes/{folder}/{scene}.toml", "-o", out, "--json", "--quiet", *SIMPLE, *more]
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
        done = render(program, scene, str(cube), *shape, *stop, "--overwrite")
        found = samples(cube)
        mean = statistics.fmean(found)
        full = done["tile_ends"]["by_samples"]
        print(f"{scene}: {mean:.0f} samples a pixel, the most {max(found)} ({full} of {len(found)} tiles by --spp): {max(found) / mean:.2f} times fewer paths")
        yield ["gain", scene, size, tile, epoch, error, len(found), full, min(found), f"{mean:.1f}", max(found), f"{max(found) / mean:.3f}"]


def bias(program, folder, of, seeds):
    for scene, error in BIASES:
        if of in (None, scene):
            yield from bias_of(program, folder, scene, error, seeds)


def renders(program, cube, scene, error, seed):
    """One seed: means of tiles after `FIRST` samples; and of what has ended samples, means, pixels and sums of squared errors of pixels."""
    side = TILES * TILE
    shape = ["--size", f"{side}x{side}", "--tile", str(TILE), "--set", channels((380, 780)), "--seed", str(seed), "--uncertainty"]
    rule = ["--error", str(error), "--error-per", "tile"]
    render(program, scene, str(cube), *shape, *rule, "--spp", str(FIRST), "--overwrite")
    assert set(samples(cube)) == {FIRST}
    first = means(cube)
    render(program, scene, str(cube), *shape, *rule, "--resume")
    errors = [numbers(cube / f"standard_error/c/0/{i // TILES}/{i % TILES}", "f") for i in range(TILES**2)]
    squares = [[math.fsum(v * v for v in tile[k::CHANNELS]) for k in range(CHANNELS)] for tile in errors]
    return first, samples(cube), means(cube), pixels(cube), squares


def bias_of(program, folder, scene, wanted, seeds):
    cube, cells, found = pathlib.Path(folder) / "bias.zarr", TILES**2, []
    for seed in range(seeds):
        found.append(renders(program, cube, scene, wanted, seed))
        if seed % 10 == 9:
            print(f"{scene}: {seed + 1} of {seeds} seeds", file=sys.stderr, flush=True)
    n = len(found)
    shifts, ratios = [], []
    for i in range(cells):
        # The pixels' means over all seeds have the bias itself in them, which is small beside a pixel's error.
        middle = [math.fsum(f[3][i][j] for f in found) / n for j in range(TILE**2 * CHANNELS)]
        for k in range(CHANNELS):
            told = statistics.fmean(f[4][i][k] for f in found)
            # Of the mean over the tile, as one render has it.
            error = math.sqrt(told) / TILE**2
            differences = [f[2][i][k] - f[0][i][k] for f in found]
            shift, known = (statistics.fmean(differences) / error, statistics.stdev(differences) / math.sqrt(n) / error) if error > 0 else (0.0, 0.0)
            real = math.fsum(math.fsum((f[3][i][j] - middle[j]) ** 2 for j in range(k, TILE**2 * CHANNELS, CHANNELS)) for f in found) / (n - 1)
            ratio = math.sqrt(real / told) if told > 0 else 1.0
            shifts.append(shift)
            ratios.append(ratio)
            taken = statistics.fmean(f[1][i] for f in found)
            yield ["bias", scene, wanted, i, k, n, f"{taken:.1f}", f"{shift:.4f}", f"{known:.4f}", f"{ratio:.4f}"]
    by_tile = [statistics.fmean(shifts[i * CHANNELS:(i + 1) * CHANNELS]) for i in range(cells)]
    print(f"{scene}, bias over {n} seeds: mean {statistics.fmean(shifts):+.3f} standard errors, by tile {min(by_tile):+.3f} to {max(by_tile):+.3f}, by tile and channel {min(shifts):+.3f} to {max(shifts):+.3f}; "
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
            ("bias", "kind,scene,error,tile,channel,seeds,samples,shift_in_standard_errors,known_to,true_error_over_estimate", lambda: bias(asked.spectile, folder, asked.scene, asked.seeds)),
        ]:
            if asked.only in (None, name):
                with open(asked.output / f"tiles-{name}.csv", "w", newline="") as file:
                    writer = csv.writer(file, lineterminator="\n")
                    writer.writerow(head.split(","))
                    writer.writerows(rows())


if __name__ == "__main__":
    main()

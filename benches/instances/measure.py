"""Things that are placed against their copies: bytes on a device, seconds of `plan` (which renders a little), and time of a path.

    measure.py --spectile PROGRAM [-o FOLDER] [--rounds N] [--samples N]

Nine trees of the grove stand close together, placed or copied; ten thousand and a million are placed. Renders take turns, medians are told,
of processor time and without what two renders of few and many samples have in common: compilation, meshes, trees.
Needs nothing but Python 3.9 and the program.
"""

import argparse
import csv
import json
import pathlib
import random
import resource
import statistics
import subprocess
import tempfile

SIZE = 128
FEW = 4
SCENE = """
[camera.perspective]
position = [0.0, 30.0, 30.0]
look_at = [0.0, 5.0, 0.0]
up = [0.0, 1.0, 0.0]
fov = 40.0

[film]
width = {size}
height = {size}

[channels]
intervals = [[500, 600]]

[integrator]
max_bounces = 8
evaluation = "all"
wavelengths_per_channel = 1

[environment]
radiance = 1.0

[materials]
leaf.diffuse.reflectance = 0.4
bark.diffuse.reflectance = 0.3
litter.diffuse.reflectance = 0.3

[[objects]]
quad = {{ corner = [-40, 0, 40], edge_u = [80, 0, 0], edge_v = [0, 0, -80] }}
material = "litter"
"""


def places(side):
    chance = random.Random(side)
    spread = lambda i: 6.0 * (i - 0.5 * (side - 1)) + chance.uniform(-2, 2)
    grid = [(i, j) for i in range(side) for j in range(side)]
    return [(spread(i), spread(j), chance.uniform(0, 360), chance.uniform(0.6, 1.1)) for i, j in grid]


def write(folder, tree):
    """The scenes, by name."""
    scenes = {"one": f'[[objects]]\nmesh = "{tree}"\n', "copied": ""}
    for x, z, yaw, scale in places(3):
        turn = f"scale = {scale}, rotate = [0, 1, 0, {yaw}], translate = [{x}, 0, {z}]"
        scenes["copied"] += f'[[objects]]\nmesh = "{tree}"\ntransform = {{ {turn} }}\n'
    for name, side in [("placed", 3), ("ten thousand", 100), ("a million", 1000)]:
        file = folder / f"{side}.csv"
        lines = (f"{x:.4f},0,{z:.4f},{yaw:.4f},{scale:.5f}\n" for x, z, yaw, scale in places(side))
        file.write_text("x,y,z,yaw_degrees,scale\n" + "".join(lines))
        scenes[name] = f'[[assemblies.tree.objects]]\nmesh = "{tree}"\n[[instances]]\nassembly = "tree"\nplacements = "{file}"\n'
    paths = {}
    for name, more in scenes.items():
        paths[name] = folder / f"{name.replace(' ', '-')}.toml"
        paths[name].write_text(SCENE.format(size=SIZE) + more)
    return paths


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--spectile", required=True)
    parser.add_argument("-o", "--output", type=pathlib.Path, default=pathlib.Path("report"))
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--samples", type=int, default=64, help="per pixel, a power of two above 4")
    arguments = parser.parse_args()

    def run(*words):
        """Events, and seconds of the processor."""
        before = sum(resource.getrusage(resource.RUSAGE_CHILDREN)[:2])
        done = subprocess.run([arguments.spectile, *map(str, words), "--json"], capture_output=True, text=True)
        if done.returncode:
            raise SystemExit(done.stderr.strip().splitlines()[0])
        return [json.loads(line) for line in done.stdout.splitlines()], sum(resource.getrusage(resource.RUSAGE_CHILDREN)[:2]) - before

    folder = pathlib.Path(tempfile.mkdtemp())
    scenes = write(folder, pathlib.Path("scenes/grove/generated/tree.obj").resolve())
    rows = []
    times = {name: [] for name in ("copied", "placed")}
    for _ in range(arguments.rounds):
        for name in times:
            cube = folder / "cube.zarr"
            few = run("render", scenes[name], "-o", cube, "--overwrite", "--spp", FEW)[1]
            many = run("render", scenes[name], "-o", cube, "--overwrite", "--spp", arguments.samples)[1]
            times[name].append((many - few) / (SIZE * SIZE * (arguments.samples - FEW)))
    for name, scene in scenes.items():
        loads = []
        for _ in range(arguments.rounds):
            events, seconds = run("plan", scene)
            loads.append(seconds)
        plan = events[-1]
        path = statistics.median(times[name]) * 1e6 if name in times else None
        rows.append([name, plan["primitives"], plan["instances"], plan["device_scene_bytes"], statistics.median(loads), path])
    arguments.output.mkdir(parents=True, exist_ok=True)
    head = ["trees", "triangles", "instances", "bytes on a device", "seconds of plan", "us a path"]
    with open(arguments.output / "instances.csv", "w", newline="") as file:
        table = csv.writer(file)
        table.writerow(head)
        table.writerows([[f"{x:.3g}" if isinstance(x, float) else x for x in row] for row in rows])
    for row in rows:
        print(*(f"{x:.3g}" if isinstance(x, float) else x for x in row), sep="\t")


if __name__ == "__main__":
    main()

"""Mitsuba at work on the Cornell box: a process that compiles once, then renders as often as it is asked on stdin.

    python mitsuba_box.py MODE CHANNELS LAMP.csv COLUMN

MODE is `specfilm` (Mitsuba's spectral film with a box response for each channel) or `scripted` (user code that asks the plain path
integrator for its four stratified wavelengths and adds each to its channel: no film costs anything for channels that a path does not
have). A request is a line: samples per pixel, seed, and the file for the picture, or - for none. The answer is a line of JSON.
"""

import json
import sys
import time
from pathlib import Path

import drjit as dr
import mitsuba as mi
import numpy as np

mi.set_variant("llvm_ad_spectral")
# A process of one thread: its CPU time is its own, whoever else is on the machine.
dr.set_thread_count(1)

SIZE, FROM, TO = 64, 380.0, 780.0
BOX = Path(__file__).resolve().parents[2] / "scenes/cornell"
# Samples of a pass: from a few on up to hundreds rates differ by some percent, and memory by as many times.
PASS = 64


def spectrum(path, column):
    lines = [line.split(",") for line in Path(path).read_text().splitlines() if line and not line.startswith("#")]
    at = lines[0].index(column)
    nm, values = ([row[i] for row in lines[1:]] for i in (0, at))
    return {"type": "irregular", "wavelengths": ", ".join(nm), "values": ", ".join(values)}


def load(channels, lamp):
    edges = np.linspace(FROM, TO, channels + 1)
    film = {"type": "specfilm", "width": SIZE, "height": SIZE, "component_format": "float32", "rfilter": {"type": "box"}}
    for k in range(channels):
        # Bands come in the order of their names. Nodes at equal distances compile and run faster than given ones.
        box = {"wavelength_min": float(edges[k]), "wavelength_max": float(edges[k + 1]), "values": "1, 1"}
        film[f"band{k:05}"] = {"type": "regular", **box}
    look = mi.ScalarTransform4f().look_at(origin=[278, 273, -800], target=[278, 273, 0], up=[0, 1, 0])
    scene = {
        "type": "scene",
        # Light seen directly is of depth 1, after five scattering events of depth 6.
        "integrator": {"type": "path", "max_depth": 6, "rr_depth": 1000},
        "sensor": {
            "type": "perspective", "fov": 39.3077, "fov_axis": "x", "near_clip": 1.0, "far_clip": 1e5, "to_world": look,
            "film": film, "sampler": {"type": "independent"},
        },
        "lamp": {
            "type": "obj", "filename": str(BOX / "light.obj"), "face_normals": True,
            "bsdf": {"type": "diffuse", "reflectance": {"type": "uniform", "value": 0.0}},
            "emitter": {"type": "area", "radiance": lamp},
        },
    }
    for mesh, colour in {"white": "white", "red": "red", "green": "green", "tall": "white", "short": "white"}.items():
        diffuse = {"type": "diffuse", "reflectance": spectrum(BOX / f"{colour}.csv", "value")}
        scene[mesh] = {
            "type": "obj", "filename": str(BOX / f"{mesh}.obj"), "face_normals": True,
            "bsdf": {"type": "twosided", "bsdf": diffuse},
        }
    return mi.load_dict(scene)


class Specfilm:
    def __init__(self, channels, lamp):
        self.scene = load(channels, lamp)

    def start(self):
        self.sum, self.samples = 0.0, 0

    def render(self, samples, seed):
        image = mi.render(self.scene, spp=samples, seed=seed)
        dr.eval(image)
        dr.sync_thread()
        self.sum, self.samples = self.sum + samples * image, self.samples + samples
        dr.eval(self.sum)

    def mean(self):
        return np.array(self.sum / self.samples)


class Scripted:
    def __init__(self, channels, lamp):
        # One response over all channels: wavelengths are even over the range, and the film itself is never used.
        self.scene, self.channels = load(1, lamp), channels
        self.sensor, self.integrator = self.scene.sensors()[0], self.scene.integrator()

    def start(self):
        self.sum, self.samples = dr.zeros(mi.Float, SIZE * SIZE * self.channels), 0
        dr.eval(self.sum)

    def render(self, samples, seed):
        paths = SIZE * SIZE * samples
        sampler = self.sensor.sampler().clone()
        sampler.set_sample_count(samples)
        sampler.seed(seed, paths)
        # Neighbours are in different pixels, so that the lanes of a vector never add to the same place.
        pixel = dr.arange(mi.UInt32, paths) % (SIZE * SIZE)
        corner = mi.Point2f(mi.Float(pixel % SIZE), mi.Float(pixel // SIZE))
        ray, weight = self.sensor.sample_ray(0, sampler.next_1d(), (corner + sampler.next_2d()) / SIZE, 0)
        radiance, _, _ = self.integrator.sample(self.scene, sampler, mi.RayDifferential3f(ray))
        value = radiance * weight / 4
        for i in range(4):
            place = dr.maximum(ray.wavelengths[i] - FROM, 0) * (self.channels / (TO - FROM))
            band = dr.minimum(mi.UInt32(place), self.channels - 1)
            at = pixel * self.channels + band
            dr.scatter_reduce(dr.ReduceOp.Add, self.sum, value[i], at, mode=dr.ReduceMode.NoConflicts)
        dr.eval(self.sum)
        dr.sync_thread()
        self.samples += samples

    def mean(self):
        return np.array(self.sum).reshape(SIZE, SIZE, self.channels) / self.samples


def main(mode, channels, lamp, column):
    channels = int(channels)
    began = time.process_time()
    box = {"specfilm": Specfilm, "scripted": Scripted}[mode](channels, spectrum(lamp, column))

    def cpu(samples, seed):
        began = time.process_time()
        box.render(samples, seed)
        return time.process_time() - began

    box.start()
    cpu(PASS, 0)
    compilation = time.process_time() - began
    # A pass of one sample is its tracing, which a longer one has as well.
    cpu(1, 1)
    tracing = sorted(cpu(1, seed) for seed in range(2, 5))[1]
    print(json.dumps({"mitsuba": mi.__version__, "compilation_s": compilation, "tracing_s": tracing}), flush=True)
    for line in sys.stdin:
        samples, seed, path = line.split()
        passes, wall = max(1, int(samples) // PASS), time.monotonic()
        box.start()
        # The sample whose cost was taken for tracing counts as a path all the same.
        seconds = sum(cpu(PASS, 1000 * int(seed) + i) - tracing for i in range(passes))
        wall = time.monotonic() - wall
        if path != "-":
            # The film integrates radiance over each channel; cubes hold the mean over it.
            (box.mean() * channels / (TO - FROM)).astype(np.float32).tofile(path)
        print(json.dumps({"samples": box.samples, "cpu_s": seconds, "wall_s": wall}), flush=True)


if __name__ == "__main__":
    main(*sys.argv[1:])

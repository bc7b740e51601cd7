"""Balls in even light by the renderers that scenes are imported from: what the importer's approximations are measured against.

python balls.py, with mitsuba (3.9.1 wrote what is there), reads balls.json beside this repository's tests/data and writes balls.csv there: of
each ball, seen from far away under light of radiance 1 from everywhere, the radiance of 32 pixels from its middle to its rim, each 1/32 of its
radius wide. That is its directional reflectance at angles of asin((i + 1/2) / 32).

Balls of Mitsuba are rendered by it. Coats of pbrt and the surfaces of glTF are calculated here: the first by light that goes to and fro between
GGX's facets above and what is below, as pbrt's LayeredBxDF does, the others by the formulas of glTF's appendix B.
"""

import json
import pathlib
import sys

import numpy as np

DATA = pathlib.Path(__file__).resolve().parent.parent / "data"
PIXELS = 32
SAMPLES = 40_000
MITSUBA_SAMPLES = 8192
random = np.random.default_rng(7)


def of_mitsuba(bsdf):
    import mitsuba as mi

    mi.set_variant("scalar_rgb")
    scene = f"""<scene version="3.0.0"><integrator type="path"><integer name="max_depth" value="2"/></integrator>
        <emitter type="constant"><float name="radiance" value="1"/></emitter>
        <sensor type="orthographic"><transform name="to_world"><lookat origin="0,0,5" target="0,0,0" up="0,1,0"/></transform>
        <film type="hdrfilm"><integer name="width" value="{2 * PIXELS}"/><integer name="height" value="1"/>
        <rfilter type="box"/></film></sensor><shape type="sphere">{bsdf}</shape></scene>"""
    row = np.array(mi.render(mi.load_string(scene), spp=MITSUBA_SAMPLES))[0, :, 1]
    return 0.5 * (row[PIXELS:] + row[:PIXELS][::-1])


def dielectric(cosine, eta):
    """Fresnel's reflectance, from outside where eta is the index inside over that outside."""
    square = 1 - (1 - cosine**2) / eta**2
    inside = np.sqrt(np.maximum(square, 0))
    s = (cosine - eta * inside) / (cosine + eta * inside)
    p = (eta * cosine - inside) / (eta * cosine + inside)
    return np.where(square <= 0, 1.0, 0.5 * (s * s + p * p))


def conductor(cosine, n, k):
    c2, s2 = cosine**2, 1 - cosine**2
    t0 = n * n - k * k - s2
    ab = np.sqrt(t0 * t0 + 4 * n * n * k * k)
    a = np.sqrt(np.maximum(0.5 * (ab + t0), 0))
    rs = (ab + c2 - 2 * a * cosine) / (ab + c2 + 2 * a * cosine)
    rp = rs * (c2 * ab + s2 * s2 - 2 * a * cosine * s2) / (c2 * ab + s2 * s2 + 2 * a * cosine * s2)
    return 0.5 * (rs + rp)


def facets(o, alpha):
    """Normals that are seen from o (z > 0), by their visible area (Heitz 2018)."""
    if alpha == 0:
        return np.broadcast_to([0.0, 0.0, 1.0], o.shape)
    v = np.stack([alpha * o[:, 0], alpha * o[:, 1], o[:, 2]], 1)
    v /= np.linalg.norm(v, axis=1, keepdims=True)
    flat = v[:, 0] ** 2 + v[:, 1] ** 2
    t1 = np.stack([-v[:, 1], v[:, 0], 0 * flat], 1) / np.sqrt(np.maximum(flat, 1e-20))[:, None]
    t1[flat < 1e-20] = [1.0, 0.0, 0.0]
    t2 = np.cross(v, t1)
    u = random.random((2, len(o)))
    r, phi = np.sqrt(u[0]), 2 * np.pi * u[1]
    x, y = r * np.cos(phi), r * np.sin(phi)
    s = 0.5 * (1 + v[:, 2])
    y = (1 - s) * np.sqrt(np.maximum(1 - x * x, 0)) + s * y
    z = np.sqrt(np.maximum(1 - x * x - y * y, 0))
    n = x[:, None] * t1 + y[:, None] * t2 + z[:, None] * v
    n = np.stack([alpha * n[:, 0], alpha * n[:, 1], np.maximum(n[:, 2], 1e-9)], 1)
    return n / np.linalg.norm(n, axis=1, keepdims=True)


def hidden(d, alpha):
    """Smith's Lambda."""
    c2 = np.maximum(d[:, 2] ** 2, 1e-20)
    return 0.5 * (np.sqrt(1 + alpha**2 * (1 - c2) / c2) - 1)


def seen_both(o, i, alpha, transmitted=False):
    """Of facets that are seen from o, the share that i sees too."""
    if alpha == 0:
        return np.ones(len(o))
    a, b = hidden(o, alpha), hidden(i, alpha)
    if transmitted:
        # As pbrt's: height-correlated masking, on both sides alike.
        return (1 + a) / (1 + a + b)
    return (1 + a) / (1 + a + b)


def mirrored(o, h):
    return 2 * np.sum(o * h, 1, keepdims=True) * h - o


def refracted(o, h, eta):
    """Into what has an index of eta times that of o's side; the sign of z turns."""
    c = np.sum(o * h, 1, keepdims=True)
    inside = np.sqrt(np.maximum(1 - (1 - c * c) / eta**2, 0))
    return -o / eta + (c / eta - inside) * h


def cosine_weighted(count):
    u = random.random((2, count))
    r, phi = np.sqrt(u[0]), 2 * np.pi * u[1]
    return np.stack([r * np.cos(phi), r * np.sin(phi), np.sqrt(np.maximum(1 - u[0], 0))], 1)


def layered(o, eta, above, base, depth=10):
    """Of light that goes to and fro, the share that comes out, for each of the directions o."""
    out = np.zeros(len(o))
    weight = np.ones(len(o))
    h = facets(o, above)
    reflects = random.random(len(o)) < dielectric(np.sum(o * h, 1), eta)
    i = mirrored(o, h)
    out += np.where(reflects & (i[:, 2] > 0), seen_both(o, i, above), 0)
    d = refracted(o, h, eta)
    weight = np.where(~reflects & (d[:, 2] < 0), seen_both(o, d, above, True), 0)
    for _ in range(depth // 2):
        # At the bottom, seen from above it.
        up, factor = base(np.where(weight[:, None] > 0, -d, [0.0, 0.0, 1.0]))
        weight = np.where(up[:, 2] > 1e-9, weight * factor, 0)
        # At the coat from below: turned upside down.
        o = np.where(weight[:, None] > 0, up, [0.0, 0.0, 1.0])
        h = facets(o, above)
        f = dielectric(np.sum(o * h, 1), 1 / eta)
        reflects = random.random(len(o)) < f
        i = mirrored(o, h)
        t = refracted(o, h, 1 / eta)
        leaves = ~reflects & (t[:, 2] < 0)
        out += np.where(leaves, weight * seen_both(o, t, above, True), 0)
        stays = reflects & (i[:, 2] > 0)
        weight = np.where(stays, weight * seen_both(o, i, above), 0)
        # Its mirror image goes down.
        d = np.where(stays[:, None], i * [1, 1, -1], [0.0, 0.0, -1.0])
        d = np.where(d[:, 2:] < 0, d, d * [1, 1, -1])
    return out


def coated_diffuse(o, rho, eta, above):
    return layered(o, eta, above, lambda d: (cosine_weighted(len(d)), np.full(len(d), rho)))


def coated_conductor(o, n, k, eta, above, below):
    def base(d):
        h = facets(d, below)
        i = mirrored(d, h)
        return i, conductor(np.sum(d * h, 1), n / eta, k / eta) * seen_both(d, i, below)

    return layered(o, eta, above, base)


def metallic_roughness(o, colour, metallic, roughness):
    """glTF's appendix B.3: a metal whose F0 is the colour; else Fresnel's share, by Schlick with F0 = 0.04, of a coat over Lambert's law."""
    alpha = roughness**2
    schlick = lambda c, f0: f0 + (1 - f0) * (1 - c) ** 5
    h = facets(o, alpha)
    i = mirrored(o, h)
    c = np.sum(o * h, 1)
    single = np.where(i[:, 2] > 0, seen_both(o, i, alpha), 0)
    l = cosine_weighted(len(o))
    half = (o + l) / np.linalg.norm(o + l, axis=1, keepdims=True)
    through = 1 - schlick(np.sum(o * half, 1), 0.04)
    return metallic * single * schlick(c, colour) + (1 - metallic) * (single * schlick(c, 0.04) + through * colour)


def calculated(model):
    pixels = []
    for pixel in range(PIXELS):
        x = (pixel + random.random(SAMPLES)) / PIXELS
        y = (random.random(SAMPLES) - 0.5) / PIXELS
        square = x * x + y * y
        c = np.sqrt(np.maximum(1 - square, 1e-12))
        o = np.stack([np.sqrt(np.minimum(square, 1 - 1e-12)), 0 * c, c], 1)
        # Beside the ball light arrives as it is.
        pixels.append(np.where(square < 1, model(o), 1.0).mean())
    return np.array(pixels)


MODELS = {"coated_diffuse": coated_diffuse, "coated_conductor": coated_conductor, "metallic_roughness": metallic_roughness}


def main():
    balls = json.loads((DATA / "balls.json").read_text())
    rows = []
    for ball in balls:
        print(ball["name"], file=sys.stderr)
        if "model" in ball:
            model, parameters = MODELS[ball["model"]], ball["parameters"]
            row = calculated(lambda o: model(o, **parameters))
        else:
            row = of_mitsuba(ball["text"])
        rows.append([ball["name"], *(f"{v:.5f}" for v in row)])
    head = ["# What balls of balls.json show from their middle to their rim; tests/python/balls.py wrote it and says how.", "name," + ",".join(map(str, range(PIXELS)))]
    (DATA / "balls.csv").write_text("\n".join(head + [",".join(row) for row in rows]) + "\n")


main()

# %% [markdown]
# # Lamps and paints
#
# Two paints that look alike under daylight (metamers), under an incandescent lamp: how far apart are they? Colours and their differences
# by colour-science. Every lamp is a render of its own here, all with one seed, so that they share their noise.

# %%
import colour
import numpy as np

import spectile as sp

nm = np.arange(380.0, 781.0, 5.0)
observer = colour.MSDS_CMFS["CIE 1931 2 Degree Standard Observer"].copy().align(colour.SpectralShape(380, 780, 5)).values
daylight = np.interp(nm, *np.transpose(sp.illuminant("D65")["samples"]))

# %% [markdown]
# A paint, and another that differs by what the eye does not see under D65: the part of three bumps that is orthogonal to the observer's
# functions times the light.

# %%
first = 0.25 + 0.3 * np.exp(-(((nm - 620) / 60) ** 2))
seen = observer * daylight[:, None]
bumps = 0.17 * np.cos((nm - 380) / 400 * 5 * np.pi)
unseen = bumps - seen @ np.linalg.lstsq(seen, bumps, rcond=None)[0]
second = first + unseen
assert 0 < second.min() and second.max() < 1


# %%
def room(lamp):
    """Two panels side by side, and the lamp before them."""
    panel = {"edge_u": [1, 0, 0], "edge_v": [0, 0, 1]}
    return {
        "camera": {"orthographic": {"position": [0, -2, 0.5], "look_at": [0, 0, 0.5], "up": [0, 0, 1], "width": 2}},
        "film": {"width": 32, "height": 16},
        "channels": {"equal": {"from": 380, "to": 780, "count": 80}},
        "materials": {
            "left": {"diffuse": {"reflectance": (nm, first)}},
            "right": {"diffuse": {"reflectance": (nm, second)}},
        },
        "objects": [
            {"quad": {"corner": [-1, 0, 0], **panel}, "material": "left"},
            {"quad": {"corner": [0, 0, 0], **panel}, "material": "right"},
        ],
        "lights": [{"directional": {"direction": [0, 1, -0.3], "irradiance": lamp}}],
    }


def lab(spectrum, lamp):
    """CIE L*a*b* of a radiance, the white being a perfect diffuser in the same light, by sums over 5 nm."""
    there = np.interp(spectrum.wavelength, nm, np.arange(len(nm)))
    functions = np.stack([np.interp(there, np.arange(len(nm)), column) for column in observer.T], axis=1)
    light = np.interp(spectrum.wavelength, *np.transpose(lamp["samples"]))
    white = functions.T @ light
    white = white / white[1]
    XYZ = functions.T @ spectrum.values
    return colour.XYZ_to_Lab(XYZ / XYZ_scale(lamp, functions), colour.XYZ_to_xy(white))


def XYZ_scale(lamp, functions):
    """Y of a white diffuser where the panels are: reflectance 1, by the cosine of the light."""
    cosine = 1 / np.hypot(1, 0.3)
    light = np.interp(channels, *np.transpose(lamp["samples"])) * cosine / np.pi
    return float(functions[:, 1] @ light)


# %%
channels = np.arange(382.5, 780, 5)
differences = {}
for name in ("D65", "A"):
    lamp = sp.illuminant(name)
    cube = sp.render(room(lamp), spp=16)
    left, right = (cube.radiance.isel(x=part).mean(("x", "y")) for part in (slice(2, 14), slice(18, 30)))
    differences[name] = float(colour.delta_E(lab(left, lamp), lab(right, lamp), method="CIE 2000"))
    print(f"{name}: dE2000 = {differences[name]:.2f}")

# %% [markdown]
# # A first render
#
# A ball under a lamp, as a mapping; its picture, and spectra of three of its pixels. Cells begin with `# %%`: Jupyter (by jupytext),
# VS Code, Spyder and PyCharm open this file as a notebook.

# %%
import matplotlib.pyplot as plt
import numpy as np

import spectile as sp

nm = np.arange(380.0, 781.0, 5.0)
paint = 0.05 + 0.75 / (1 + np.exp((585 - nm) / 12))  # an invented red

scene = sp.Scene(
    {
        "camera": {"perspective": {"position": [0, -4, 1.5], "look_at": [0, 0, 0.5], "up": [0, 0, 1], "fov": 40}},
        "film": {"width": 48, "height": 48},
        "channels": {"equal": {"from": 380, "to": 780, "count": 80}},
        "materials": {
            "floor": {"diffuse": {"reflectance": 0.5}},
            "ball": {"diffuse": {"reflectance": (nm, paint)}},
            "lamp": {"black": {}},
        },
        "objects": [
            {"quad": {"corner": [-5, -5, 0], "edge_u": [10, 0, 0], "edge_v": [0, 10, 0]}, "material": "floor"},
            {"sphere": {"center": [0, 0, 0.5], "radius": 0.5}, "material": "ball"},
            {
                "disk": {"center": [1.5, -1, 3], "normal": [0, 0, -1], "radius": 0.5},
                "material": "lamp",
                "emission": sp.illuminant("A", 0.01),
            },
        ],
    }
)

# %%
cube = sp.render(scene, spp=64, progress=True)
cube

# %% [markdown]
# `cube` is an `xarray.Dataset`. Values are read when they are needed.

# %%
figure, (left, right) = plt.subplots(1, 2, figsize=(10, 4))
left.imshow(sp.rgb(cube), extent=(0, 48, 48, 0))
for column, row, what in [(24, 20, "ball"), (24, 44, "floor"), (30, 34, "floor by the ball")]:
    left.plot(column, row, "w+")
    cube.radiance.isel(x=column, y=row).plot(ax=right, label=what)
right.set_title("")
right.legend()

# %% [markdown]
# What the ball reflects is what its paint does, times the light that arrives. Seen beside the floor, which reflects one half at every
# wavelength, the light cancels but for what ball and floor throw at each other.

# %%
region = cube.radiance.isel(x=slice(20, 28), y=slice(14, 20)).mean(("x", "y"))
floor = cube.radiance.isel(x=slice(20, 28), y=slice(42, 46)).mean(("x", "y"))
ratio = region / floor
scaled = ratio / ratio.sel(wavelength=slice(700, 780)).mean()
expected = np.interp(cube.wavelength, nm, paint)
expected /= expected[cube.wavelength.values > 700].mean()
plt.figure()
scaled.plot(label="rendered")
plt.plot(cube.wavelength, expected, "k:", label="paint")
plt.legend()
worst = float(abs(scaled - expected).max())
print(f"largest difference of the two curves: {worst:.3f}")

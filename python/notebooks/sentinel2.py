# %% [markdown]
# # A Sentinel-2 view of the grove
#
# The gallery's `grove` (scenes/grove), from above, in pixels of 10 m: trees of 24,000 leaves, of which one is in memory, over litter, under
# sun and sky. Reflectances and NDVI as Sentinel-2A's instrument (MSI) sees them, and how they change where every other tree is felled.
#
# Leaves are PROSPECT-D's, bark and litter measured, the bands ESA's measured responses; the radiance of the sky is a choice.
# `scenes/render grove` makes the meshes that the scene names, and has to have run once. This notebook is in `python/notebooks` of the
# repository; paths begin there.

# %%
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd

import spectile as sp

grove = Path("../../scenes/grove")
scene = sp.load(grove / "grove.toml")
scene["camera"] = {"orthographic": {"position": [0, 300, 0], "look_at": [0, 0, 0], "up": [0, 0, -1], "width": 120}}
scene["film"] = {"width": 12, "height": 12}
scene["channels"]["equal"]["count"] = 820  # of 2.5 nm, fine enough for B5

# %% [markdown]
# Where trees stand is a table: x, y, z in metres, yaw and scale. Those that neither are seen nor shade what is seen are left out, and to
# the right of the middle every other one.

# %%
trees = pd.read_csv(grove / "generated/trees.csv")
near = (abs(trees.x) < 90) & (abs(trees.z) < 90)
kept = (trees.x < 0) | (trees.index % 2 == 0)
scene["instances"] = [{"assembly": "tree", "placements": trees[near & kept]}]
cube = sp.render(scene, spp=32)


# %%
def bands(cube):
    """Mean radiance in Sentinel-2A's bands, by their names."""
    image = sp.sensor(cube, responses="../../docs/examples/sentinel2a.csv")
    return image.radiance.assign_coords(wavelength=image.attrs["channel_names"]).rename(wavelength="band")


# %% [markdown]
# Radiance becomes reflectance by a white panel, here a plane of it in the same light. A plane of litter beside it says whether that
# works: its reflectance is known.


# %%
def plane(material):
    """A plane of one material in the light of the grove, as seen from above."""
    flat = scene.copy()
    del flat["assemblies"], flat["instances"]
    flat["materials"]["white"] = {"diffuse": {"reflectance": 1.0}}
    ground = {"corner": [-200, 0, 200], "edge_u": [400, 0, 0], "edge_v": [0, 0, -400]}
    flat["objects"] = [{"quad": ground, "material": material}]
    return bands(sp.render(flat, size=(4, 4), spp=16)).mean(("x", "y"))


white = plane("white")
of_litter = plane("litter") / white
reflectance = (bands(cube) / white).assign_attrs(long_name="reflectance factor", units="1")

# %%
red, infrared = reflectance.sel(band="B4"), reflectance.sel(band="B8A")
ndvi = ((infrared - red) / (infrared + red)).assign_attrs(long_name="NDVI", units="1")
dense, thinned = (float(ndvi.isel(x=half).mean()) for half in (slice(0, 6), slice(6, 12)))
print(f"NDVI {dense:.3f} where all trees stand, {thinned:.3f} where every other one does")

# %%
figure, (left, right) = plt.subplots(1, 2, figsize=(10, 4))
false_colour = reflectance.sel(band=["B8A", "B4", "B3"]).transpose("y", "x", "band")
left.imshow(np.clip(false_colour / 0.3, 0, 1))
left.set_title("B8A, B4, B3")
ndvi.plot(ax=right, yincrease=False)
right.set_title("every other tree felled to the right")

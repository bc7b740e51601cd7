# %% [markdown]
# # A field as Sentinel-2 sees it
#
# Soil with stripes of vegetation under the sun, seen from above in channels of 5 nm, and then in bands of Sentinel-2's instrument (MSI).
# Spectra of soil and leaves here are invented curves of the right kind: a red edge at 715 nm, absorption by chlorophyll and by water.
# The bands are Gaussians of the centres and widths that ESA states for Sentinel-2A, not its measured responses: for a study give
# those, as a CSV file.

# %%
import matplotlib.pyplot as plt
import numpy as np

import spectile as sp

nm = np.arange(400.0, 2501.0, 10.0)


def bump(centre, width):
    return np.exp(-(((nm - centre) / width) ** 2))


soil = 0.08 + 0.25 * (1 - np.exp(-(nm - 380) / 700)) - 0.04 * bump(1930, 60)
leaf = 0.04 + 0.04 * bump(550, 35) + 0.42 / (1 + np.exp((715 - nm) / 12))
leaf *= 1 - 0.55 * bump(1450, 80) - 0.75 * bump(1940, 110) - 0.25 / (1 + np.exp((1900 - nm) / 100))

# %% [markdown]
# How much of each texel is covered: rows of plants, denser to the right. The rest is soil.

# %%
size = 64
column, row = np.meshgrid(np.arange(size), np.arange(size))
cover = np.clip(column / size, 0, 1) * (row // 8 % 2)
shares = np.stack([1 - cover, cover], axis=-1)

scene = {
    "camera": {"orthographic": {"position": [0, 0, 500], "look_at": [0, 0, 0], "up": [0, 1, 0], "width": 100}},
    "film": {"width": 48, "height": 48},
    "channels": {"equal": {"from": 420, "to": 2500, "count": 416}},
    "materials": {
        "field": {"diffuse": {"reflectance": {"texture": shares, "endmembers": ["soil", "leaf"], "filter": "nearest"}}},
    },
    "spectra": {"soil": (nm, soil), "leaf": (nm, leaf)},
    "objects": [{"quad": {"corner": [-50, -50, 0], "edge_u": [100, 0, 0], "edge_v": [0, 100, 0]}, "material": "field"}],
    "lights": [{"sun": {"azimuth": 150, "elevation": 50, "up": [0, 0, 1], "north": [0, 1, 0], "irradiance": "am1.5"}}],
}
cube = sp.render(scene, spp=16)

# %% [markdown]
# Centre and full width at half maximum in nm (ESA, Sentinel-2 MSI user guide).

# %%
msi = {"B2": (492.4, 66), "B3": (559.8, 36), "B4": (664.6, 31), "B8A": (864.7, 21), "B11": (1613.7, 91), "B12": (2202.4, 175)}


def response(centre, width):
    x = np.linspace(centre - 1.5 * width, centre + 1.5 * width, 121)
    return x, np.exp(-4 * np.log(2) * ((x - centre) / width) ** 2)


image = sp.sensor(cube, responses={name: response(*band) for name, band in msi.items()})
bands = dict(zip(image.attrs["channel_names"], image.radiance, strict=True))

# %% [markdown]
# Reflectances are radiances over those of a white panel: the same scene with a white field.

# %%
white_scene = {**scene, "materials": {"field": {"diffuse": {"reflectance": 1.0}}}}
white = sp.sensor(sp.render(white_scene, spp=16), responses={name: response(*band) for name, band in msi.items()})
reflectance = image.radiance / white.radiance
reflectance = reflectance.assign_coords(wavelength=list(msi))
ndvi = (reflectance.sel(wavelength="B8A") - reflectance.sel(wavelength="B4")) / (
    reflectance.sel(wavelength="B8A") + reflectance.sel(wavelength="B4")
)

# %%
figure, (left, right) = plt.subplots(1, 2, figsize=(10, 4))
false_colour = reflectance.sel(wavelength=["B8A", "B4", "B3"]).transpose("y", "x", "wavelength")
left.imshow(np.clip(false_colour / 0.5, 0, 1))
left.set_title("B8A, B4, B3")
ndvi.plot(ax=right, yincrease=False)
right.set_title("NDVI")
print(f"NDVI from {float(ndvi.min()):.2f} to {float(ndvi.max()):.2f}")

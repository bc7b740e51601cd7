# %% [markdown]
# # Error against time
#
# How the noise falls while a scene is rendered: the estimate that `render` makes itself, and the true error against a longer render.

# %%
import matplotlib.pyplot as plt
import numpy as np

import spectile as sp

scene = sp.Scene(
    {
        "camera": {"perspective": {"position": [0, -4, 1.5], "look_at": [0, 0, 0.5], "up": [0, 0, 1], "fov": 40}},
        "film": {"width": 24, "height": 24},
        "channels": {"equal": {"from": 400, "to": 700, "count": 10}},
        "integrator": {"epoch": 16, "sampler": "independent"},
        "materials": {"floor": {"diffuse": {"reflectance": 0.5}}, "ball": {"diffuse": {"reflectance": 0.8}}, "lamp": {"black": {}}},
        "objects": [
            {"quad": {"corner": [-5, -5, 0], "edge_u": [10, 0, 0], "edge_v": [0, 10, 0]}, "material": "floor"},
            {"sphere": {"center": [0, 0, 0.5], "radius": 0.5}, "material": "ball"},
            {
                "disk": {"center": [1.5, -1, 3], "normal": [0, 0, -1], "radius": 0.5},
                "material": "lamp",
                "emission": {"blackbody": 2856},
            },
        ],
    }
)

# %%
reference = sp.render(scene, spp=1024, seed=1)

# %% [markdown]
# A render tells how far it is after every epoch. The true error needs its radiance, so it is rendered again to some numbers of samples:
# with one seed they are the same samples.

# %%
estimates = []
sp.render(scene, spp=128, callback=lambda epoch: estimates.append((epoch.time_s, epoch.samples, epoch.error_estimate)))


# %%
def error(cube):
    """The root of the sum of squared differences over that of squares, largest of all channels."""
    difference = ((cube.radiance - reference.radiance) ** 2).sum(("x", "y"))
    return float(np.sqrt(difference / (reference.radiance**2).sum(("x", "y"))).max())


samples = [8, 16, 32, 64, 128]
errors = [error(sp.render(scene, spp=n)) for n in samples]
slope = np.polyfit(np.log(samples), np.log(errors), 1)[0]
print(f"the error falls with the power {slope:.3f} of the samples")

# %%
plt.loglog(samples, errors, "o-", label="true error")
plt.loglog(*zip(*[(n, e) for _, n, e in estimates if e is not None], strict=True), ".", label="estimate")
plt.xlabel("samples per pixel")
plt.ylabel("relative error")
plt.legend()

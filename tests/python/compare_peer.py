"""Compare renders of the Cornell box, made with different seeds, with a reference that a separate program made.

    python -W error compare_peer.py REFERENCE.npz CUBE.zarr CUBE.zarr ...

Prints what was compared and how large a deviation would have been noticed; any deviation beyond chance is an
assertion.

The reference is [y, x, k] of radiance integrated over each channel, with noise of its own: its relMSE is about 5e-5 in
the mean over channels, and nothing more is known of it. It traces the same paths without their wavelengths' noise, so
its variance is taken to be a fixed share of that of these renders, the same everywhere: c = 5e-5 / (mean relMSE of
their mean).

Each family of tests has alpha = 1 % in all: two-sided, Sidak-corrected over its members. The pixels of a render are
independent (each has its own scrambling), its channels are not (they share paths), which makes Sidak's correction
conservative.
"""

import sys

import numpy as np
import xarray as xr

ALPHA = 0.01
REFERENCE_REL_MSE = 5e-5
BLOCK = 8


def main(reference_path, *cube_paths):
    with np.load(reference_path) as file:
        reference, edges = file["ref"].astype(np.float64), file["edges_nm"]
    width_nm = np.diff(edges)
    runs, samples = zip(*(read(path, edges) for path in cube_paths))
    runs, samples = np.stack(runs) * width_nm, sum(samples)
    seeds = len(runs)
    assert runs.shape[1:] == reference.shape, (runs.shape, reference.shape)
    assert seeds >= 8, "too few seeds to know their spread"

    mean, variance = runs.mean(axis=0), runs.var(axis=0, ddof=1) / seeds
    scale = reference**2 + (0.01 * reference.mean(axis=(0, 1))) ** 2
    own = (variance / scale).mean(axis=(0, 1))
    share = REFERENCE_REL_MSE / own.mean()
    total = variance * (1 + share)
    print(f"{seeds} seeds, {samples} samples per pixel, relMSE of their mean {own.mean():.2e}, the reference's share {share:.3f}")
    # The reference must be the better of the two, or this would test the reference.
    assert share < 0.5

    def check(mean):
        difference = mean - reference
        check_rel_mse(difference, variance, scale, share)
        lamp = reference.mean(axis=2) > 0.5 * reference.mean(axis=2).max()
        assert 10 < lamp.sum() < 40, "the lamp covers 1 % of the picture"
        check_image_means(difference, total, reference, {"all pixels": lamp | True, "without the lamp": ~lamp})
        check_blocks(difference, total, reference, seeds)
        check_pixels(difference, total, reference, seeds, samples)

    check(mean)
    wrong = {
        "1 % brighter": 1.01 * mean,
        "one pixel to the right": np.roll(mean, 1, axis=1),
        "mirrored": mean[:, ::-1],
        "one channel further": np.roll(mean, 1, axis=2),
    }
    for name, mean in wrong.items():
        print(f"must fail, {name}:")
        try:
            check(mean)
        except AssertionError:
            continue
        raise AssertionError(f"a picture that is {name} is not noticed")


def read(path, edges):
    """Mean radiance [y, x, k], and samples per pixel."""
    ds = xr.open_zarr(path)
    radiance = ds["radiance"]
    assert radiance.attrs["units"] == "W m-2 sr-1 nm-1"
    bounds = ds["wavelength_bounds"].values
    assert np.allclose(bounds, np.stack([edges[:-1], edges[1:]], axis=1), rtol=0, atol=1e-9), bounds
    values = radiance.transpose("y", "x", "wavelength").values.astype(np.float64)
    assert np.isfinite(values).all() and (values >= 0).all()
    (samples,) = np.unique(ds["samples"].values)
    return values, int(samples)


def check_rel_mse(difference, variance, scale, share):
    """Per channel, relMSE less the renders' own part is the reference's part, within what pixels scatter."""
    excess = (difference**2 - variance) / scale
    expected = share * (variance / scale).mean(axis=(0, 1))
    pixels = excess.shape[0] * excess.shape[1]
    error = excess.std(axis=(0, 1), ddof=1) / np.sqrt(pixels)
    z = (excess.mean(axis=(0, 1)) - expected) / error
    bound = t_quantile(sidak(len(z)), pixels - 1)
    unseen = np.sqrt((bound * error).max())
    print(f"relMSE: z {z.min():+.2f} to {z.max():+.2f}, bound {bound:.2f}; a relative bias of {unseen:.1%} rms is seen")
    assert np.abs(z).max() < bound, z
    assert unseen < 0.02


def check_image_means(difference, total, reference, masks):
    for name, mask in masks.items():
        error = np.sqrt(total[mask].sum(axis=0)) / mask.sum()
        z = difference[mask].mean(axis=0) / error
        # Thousands of pixels make up the error: as good as known.
        bound = t_quantile(sidak(len(z) * len(masks)), 1000)
        unseen = (bound * error / reference[mask].mean(axis=0)).max()
        print(f"mean of {name}: z {z.min():+.2f} to {z.max():+.2f}, bound {bound:.2f}; a bias of {unseen:.2%} is seen")
        assert np.abs(z).max() < bound, (name, z)
        assert unseen < 0.01


def check_blocks(difference, total, reference, seeds):
    """Means of 8 x 8 pixels; the degrees of freedom of their errors are Welch's and Satterthwaite's."""
    error = np.sqrt(blocks(total)) / BLOCK
    freedom = (seeds - 1) * blocks(total) ** 2 / (blocks(total**2) / BLOCK**2)
    t = blocks(difference) / error
    # Rounded down, for fewer quantiles.
    freedom = np.maximum(seeds - 1, freedom // 20 * 20)
    bounds = {n: t_quantile(sidak(t.size), n) for n in np.unique(freedom)}
    bound = np.vectorize(bounds.get)(freedom)
    worst = np.unravel_index(np.argmax(np.abs(t) / bound), t.shape)
    unseen = np.median(bound * error / blocks(reference))
    print(f"8 x 8 pixels: t {t[worst]:+.2f} at most, bound {bound[worst]:.2f}; half of them see a bias of {unseen:.1%}")
    assert (np.abs(t) < bound).all(), (worst, t[worst], bound[worst])
    assert unseen < 0.03


def check_pixels(difference, total, reference, seeds, samples):
    # Where all seeds agree to the bit the radiance is a constant, apart from rounding to f32: the lamp, or nothing. Or
    # light is so rare that no sample met it: then its share of the pixel is below log(1 / level) / samples.
    rounding = reference * 2.0**-23
    exact = total == 0
    rare = -np.log(sidak(exact.any(axis=2).sum())) / samples * neighbourhood(reference)
    assert (np.abs(difference) <= np.maximum(rounding, rare))[exact].all(), "a constant is not exact"
    assert (exact & (reference > 1)).any(), "no pixel sees the lamp alone"

    excess = np.maximum(np.abs(difference) - rounding, 0)
    t = excess[~exact] / np.sqrt(total[~exact])
    bound = t_quantile(sidak(t.size), seeds - 1)
    print(f"{t.size} pixels and channels: t {t.max():.2f} at most, bound {bound:.2f}; {exact.sum()} exact")
    assert t.max() < bound


def neighbourhood(values):
    """The largest of the 3 x 3 pixels around each."""
    height, width, _ = values.shape
    padded = np.pad(values, ((1, 1), (1, 1), (0, 0)))
    return np.max([padded[y : y + height, x : x + width] for y in range(3) for x in range(3)], axis=0)


def blocks(values):
    """Means over 8 x 8 pixels."""
    height, width, channels = values.shape
    return values.reshape(height // BLOCK, BLOCK, width // BLOCK, BLOCK, channels).mean(axis=(1, 3))


def sidak(tests):
    """The level of one of so many tests."""
    return -np.expm1(np.log1p(-ALPHA) / tests)


def t_quantile(alpha, freedom):
    """The bound that |t| of Student's distribution exceeds with probability alpha.

    With t = sqrt(freedom) tan(a) the density is proportional to cos(a)^(freedom - 1).
    """

    def integral(begin, end):
        a = np.linspace(begin, end, 5_001)
        return np.trapezoid(np.cos(a) ** (freedom - 1), a)

    whole = integral(0, np.pi / 2)
    low, high = 0.0, np.pi / 2
    for _ in range(40):
        middle = 0.5 * (low + high)
        if integral(middle, np.pi / 2) > alpha * whole:
            low = middle
        else:
            high = middle
    return np.sqrt(freedom) * np.tan(high)


if __name__ == "__main__":
    main(*sys.argv[1:])

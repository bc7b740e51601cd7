"""The largest delta E 2000 between rendered patches and X, Y, Z that colour-science integrates.

    python colour_checker.py PATCHES.csv ILLUMINANTS.csv XYZ.csv OBSERVER

XYZ.csv has a line a patch (columns x, y, X, Y, Z), under D65 times 0.01 from every direction.
"""

import csv
import sys
import warnings

import numpy as np

warnings.simplefilter("ignore")
import colour  # noqa: E402  (it warns of what it could import and does not need here)


def table(path):
    with open(path) as file:
        rows = list(csv.reader(line for line in file if not line.startswith("#")))
    return rows[0], np.array(rows[1:], float)


def main(patches, illuminants, rendered, observer):
    shape = colour.SpectralShape(380, 780, 1)

    def spectrum(nm, values):
        # Straight lines between the table's values, as the renderer reads them.
        sd = colour.SpectralDistribution(values, nm, interpolator=colour.LinearInterpolator)
        return sd.interpolate(shape, interpolator=colour.LinearInterpolator)

    name = {"1931": "CIE 1931 2 Degree Standard Observer", "1964": "CIE 1964 10 Degree Standard Observer"}[observer]
    cmfs = colour.MSDS_CMFS[name].copy().trim(shape)
    header, lights = table(illuminants)
    d65 = spectrum(lights[:, 0], 0.01 * lights[:, header.index("D65")])
    white = colour.sd_to_XYZ(d65 * 0 + 1, cmfs, d65, method="Integration")
    chromaticity = colour.XYZ_to_xy(white)

    header, reflectances = table(patches)
    columns, pixels = table(rendered)
    assert columns == ["x", "y", "X", "Y", "Z"] and len(pixels) == len(header) - 1
    # Rendered values are divided by the integral of ybar; white is what D65 itself would be.
    luminous = np.trapezoid(colour.MSDS_CMFS[name].values[:, 1], colour.MSDS_CMFS[name].wavelengths)
    white_rendered = (cmfs.values[:, 1] * d65.values).sum() / luminous
    worst = 0.0
    for i, pixel in enumerate(pixels):
        expected = colour.sd_to_XYZ(spectrum(reflectances[:, 0], reflectances[:, i + 1]), cmfs, d65, method="Integration")
        got = pixel[2:] / white_rendered * white[1]
        lab = [colour.XYZ_to_Lab(np.asarray(v) / white[1], chromaticity) for v in (expected, got)]
        worst = max(worst, float(colour.delta_E(*lab, method="CIE 2000")))
    print(worst)


if __name__ == "__main__":
    main(*sys.argv[1:])

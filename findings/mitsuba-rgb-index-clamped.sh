#!/usr/bin/env bash
# Mitsuba 3.9.1, conductor whose `eta` and `k` are given as RGB: its spectral variants take every value above 1 as 1, without a
# word, so that a metal of index 2 + 3 i reflects as one of 1 + i. Its RGB variants take them as written, and so do all variants where
# the same numbers are spectra. Fresnel's equations, normal incidence: ((n - 1)² + k²) / ((n + 1)² + k²), 0.556 and 0.2.
#
# Seen on 2026-11-30, Python 3.11, x86-64 Linux:
#   scalar_rgb: rgb 0.556, spectrum 0.556
#   scalar_spectral: rgb 0.200, spectrum 0.556
# Fails if any of these changes.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check mitsuba==3.9.1 numpy==2.4.6
"$tmp/venv/bin/python" - <<'PYTHON' | tee "$tmp/seen"
import mitsuba as mi
import numpy as np

for variant in ["scalar_rgb", "scalar_spectral"]:
    mi.set_variant(variant)

    def reflects(kind, n, k):
        bsdf = mi.load_string(
            f'<bsdf version="3.0.0" type="conductor"><{kind} name="eta" value="{n}"/><{kind} name="k" value="{k}"/></bsdf>'
        )
        surface = mi.SurfaceInteraction3f()
        surface.wi = [0, 0, 1]
        surface.p = [0, 0, 0]
        if "spectral" in variant:
            surface.wavelengths = [550] * 4
        _, weight = bsdf.sample(mi.BSDFContext(), surface, 0.5, [0.5, 0.5])
        return float(np.array(weight)[0])

    print(f"{variant}: rgb {reflects('rgb', '2,2,2', '3,3,3'):.3f}, spectrum {reflects('spectrum', 2, 3):.3f}")
PYTHON
diff "$tmp/seen" - <<'SEEN' || { echo "this has changed"; exit 1; }
scalar_rgb: rgb 0.556, spectrum 0.556
scalar_spectral: rgb 0.200, spectrum 0.556
SEEN
echo "as it was"

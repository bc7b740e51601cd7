#!/usr/bin/env bash
# Mitsuba 3.9.1: `rotate` about an axis whose length is not 1 is no rotation. The axis is not brought to length 1, nor refused: a square
# of side 2 that is turned by 90 degrees about (0, 2, 0) becomes a rectangle of 4 by 8. So does `Transform4f.rotate` in Python.
#
# Seen on 2026-11-30, Python 3.11, x86-64 Linux:
#   axis 0 1 0: determinant 1.0, sides 2.0 and 2.0
#   axis 0 2 0: determinant 16.0, sides 8.0 and 4.0
# Fails if any of these changes.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check mitsuba==3.9.1 numpy==2.4.6
"$tmp/venv/bin/python" - <<'PYTHON' | tee "$tmp/seen"
import mitsuba as mi
import numpy as np

mi.set_variant("scalar_rgb")
for length in [1, 2]:
    matrix = np.array(mi.ScalarTransform4f().rotate([0, length, 0], 90).matrix)
    scene = mi.load_string(
        '<scene version="3.0.0"><shape type="rectangle"><transform name="to_world">'
        f'<rotate x="0" y="{length}" z="0" angle="90"/></transform></shape></scene>'
    )
    box = scene.shapes()[0].bbox()
    sides = np.array(box.max) - np.array(box.min)
    print(f"axis 0 {length} 0: determinant {np.linalg.det(matrix):.1f}, sides {sides[1]:.1f} and {sides[2]:.1f}")
PYTHON
diff "$tmp/seen" - <<'SEEN' || { echo "this has changed"; exit 1; }
axis 0 1 0: determinant 1.0, sides 2.0 and 2.0
axis 0 2 0: determinant 16.0, sides 8.0 and 4.0
SEEN
echo "as it was"

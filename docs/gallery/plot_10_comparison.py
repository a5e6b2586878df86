"""
The comparison page
===================

Which filter, and how strong? :func:`~meshlab_specsmooth.compare` applies MeshLab's smoothing filters and these to a
mesh, and estimates the error of each without ground truth.
"""

import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pyvista as pv

import meshlab_specsmooth as mss

solid = pv.ParametricTorus(u_res=120, v_res=80, w_res=8).clean().triangulate()
solid.points += 0.006 * np.random.default_rng(0).standard_normal(solid.points.shape)

# %%
# With ``out=`` it also writes a page for any browser, with linked 3D views and every filter over its strengths, and a
# MeshLab project with one layer per result.

out = Path(tempfile.mkdtemp())
found = mss.compare(solid, filters=["laplacian", "taubin", "automatic"], out=out)
print(found)
print(sorted(path.name for path in out.iterdir()))

# %%
# The estimated error of each filter over its strengths; the page has this plot with values under the mouse.

plt.figure(figsize=(8, 3.5))
for curve in found.curves:
    points = [p for p in curve.points if p.values.get("estimated_error") is not None]
    plt.plot([p.strength for p in points], [p.values["estimated_error"] for p in points], "o-", label=curve.spec.name)
plt.legend()
plt.tight_layout()
plt.show()

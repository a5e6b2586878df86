"""
A region
========

Smooth a part of a mesh, and keep or enhance the detail of another one. The effect fades out at the border of a region.
"""

from pathlib import Path

import numpy as np
import pymeshlab
import pyvista as pv

bunny = pv.read(Path(pymeshlab.__file__).parent / "tests/sample_meshes/bunny.obj")
x, y, z = bunny.points.T

# %%
# A mask is one weight in [0, 1] for each vertex, or True and False:

body = y < 0.32
smoothed = bunny.specsmooth.smooth(mask=body, barycenter_weight=0.03)

# %%
# Features keep their detail (a gain of 1), or have it enhanced:

haunch = np.linalg.norm(bunny.points - [0.38, 0.12, 0.4], axis=1) < 0.2
enhanced = bunny.specsmooth.smooth(features=haunch, feature_gain=1.8, barycenter_weight=0.1)

plotter = pv.Plotter(shape=(1, 3))
for column, (mesh, title) in enumerate(
    [(bunny, "given"), (smoothed, "the body alone is smoothed"), (enhanced, "the haunch is enhanced")]
):
    plotter.subplot(0, column)
    plotter.add_text(title, font_size=9)
    plotter.add_mesh(mesh)
    plotter.view_xy()
    plotter.camera.zoom(1.4)
plotter.show()

# %%
still = ~body
print(
    "outside of the mask nothing has moved:", np.array_equal(smoothed.points[still], bunny.points[still].astype(float))
)

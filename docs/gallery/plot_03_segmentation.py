"""
A segmentation
==============

The surface of a binary mask has terraces. They are recognized, and smoothed as far as the voxels allow: the true
surface is within half a voxel.
"""

import numpy as np
import pyvista as pv
from skimage.measure import marching_cubes

import meshlab_specsmooth as mss

x, y, z = np.mgrid[-1:1:56j, -1:1:56j, -1:1:56j]
mask = (np.hypot(np.hypot(x, y) - 0.55, z) < 0.25) | (np.linalg.norm([x, y - 0.1, z], axis=0) < 0.32)

V, F, *_ = marching_cubes(mask.astype(float), level=0.5)
result = mss.smooth(V, F)
print(result)

# %%
plotter = pv.Plotter(shape=(1, 2))
for column, (vertices, title) in enumerate([(V, "marching cubes"), (result.vertices, "smooth()")]):
    plotter.subplot(0, column)
    plotter.add_text(title, font_size=10)
    plotter.add_mesh(pv.PolyData.from_regular_faces(vertices, F), smooth_shading=False)
    plotter.camera_position = [(140, 60, 110), (27, 27, 27), (0, 0, 1)]
    plotter.camera.zoom(1.2)
plotter.show()

# %%
# No vertex is moved further than the mask allows, and the volume is kept:

moved = np.linalg.norm(result.vertices - V, axis=1)
before, after = (pv.PolyData.from_regular_faces(X, F).volume for X in (V, result.vertices))
print(
    f"moved by at most {moved.max():.2f} voxels; volume {100 * (after / before - 1):+.2f} %; mask {mask.sum()} voxels"
)

# %%
# Voxels with sides of different lengths are recognized too; where they are not, as after a remesh, pass
# ``spacing=(0.7, 0.7, 3)``.

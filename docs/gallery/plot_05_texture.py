"""
A textured mesh with seams
==========================

Along the seams of a texture a place has several vertices. They move as one, so that the seam does not open, and texture
coordinates, colors and materials stay as they are.
"""

from pathlib import Path

import numpy as np
import pymeshlab
import pyvista as pv

import meshlab_specsmooth as mss

folder = Path(pymeshlab.__file__).parent / "tests/sample_meshes"
mesh = pv.read(folder / "bunny10k_textured.obj")
print(f"{mesh.n_points} vertices, {len(np.unique(mesh.points, axis=0))} places; {mesh.point_data.keys()}")

# %%
# Noise that is the same for all vertices at one place:

places, at = np.unique(mesh.points, axis=0, return_inverse=True)
edge = mss.estimate_noise(mesh).mean_edge
scan = mesh.copy()
scan.points += (0.15 * edge * np.random.default_rng(0).standard_normal(places.shape))[at.ravel()]

smooth = scan.specsmooth.denoise()
result = smooth.specsmooth.result
print(result)
print(f"seams closed: {len(np.unique(smooth.points, axis=0)) == len(places)}")
print(f"texture coordinates kept: {np.array_equal(smooth.active_texture_coordinates, mesh.active_texture_coordinates)}")

# %%
texture = pv.read_texture(next(folder.glob("*.png")))
plotter = pv.Plotter(shape=(1, 2))
for column, (each, title) in enumerate([(scan, "scan"), (smooth, "denoise()")]):
    plotter.subplot(0, column)
    plotter.add_text(title, font_size=10)
    plotter.add_mesh(each, texture=texture)
    plotter.view_xy()
    plotter.camera.zoom(1.4)
plotter.show()

# %%
# Files are treated alike: ``specsmooth denoise bunny10k_textured.obj smooth.obj`` copies material and texture.

"""
A million vertices
==================

No eigenvectors are computed: a million vertices take seconds.
"""

import time

import numpy as np
import pyvista as pv

import meshlab_specsmooth as mss

n = 1000
x, y = np.meshgrid(np.arange(n, dtype=float), np.arange(n, dtype=float))
z = 30 * np.sin(x / 90) * np.cos(y / 120) + 4 * np.sin((x + 2 * y) / 25)
truth = np.c_[x.ravel(), y.ravel(), z.ravel()]
at = (np.arange(n - 1)[:, None] * n + np.arange(n - 1)).ravel()
faces = np.concatenate([np.c_[at, at + 1, at + n + 1], np.c_[at, at + n + 1, at + n]]).astype(np.int32)
scan = truth + 0.3 * np.random.default_rng(0).standard_normal(truth.shape)

# %%
# The first call compiles, which takes some seconds once and is kept on the disk; the second one shows the time.

mss.smooth(scan[: 10 * n], faces[(faces < 10 * n).all(axis=1)])
began = time.perf_counter()
result = mss.smooth(scan, faces)
print(f"{len(scan)} vertices in {time.perf_counter() - began:.1f} s")
print(result)
print(f"true error of the heights: {np.sqrt(((result.vertices - truth)[:, 2] ** 2).mean()):.3f}, before 0.300")

# %%
window = (slice(420, 580), slice(420, 580))
plotter = pv.Plotter(shape=(1, 2))
for column, (vertices, title) in enumerate([(scan, "scan, a part"), (result.vertices, "smooth(), the same part")]):
    plotter.subplot(0, column)
    plotter.add_text(title, font_size=10)
    X, Y, Z = (c.reshape(n, n)[window] for c in vertices.T)
    plotter.add_mesh(pv.StructuredGrid(X, Y, Z).extract_surface(algorithm="dataset_surface"))
    plotter.camera.zoom(1.2)
plotter.show()

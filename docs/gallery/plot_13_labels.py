"""
Tissues that touch
==================

Four bodies of a label image, whose surfaces share borders, are smoothed at once: there is neither a gap nor an overlap.
"""

import numpy as np
import pyvista as pv

import meshlab_specsmooth as mss

# A ball of voxels that is cut into four bodies
n = 40
grid = np.stack(np.meshgrid(*[np.arange(n)] * 3, indexing="ij"), axis=-1) - (n - 1) / 2
centers = np.array([[1, 0.2, 0.1], [-0.8, 0.9, -0.2], [-0.3, -1, 0.6], [0.1, 0.2, -1.2]]) * n * 0.2
nearest = np.argmin([np.linalg.norm(grid - c, axis=-1) for c in centers], axis=0) + 1
voxels = np.where(np.linalg.norm(grid, axis=-1) < 0.42 * n, nearest, 0)

# %%
# The squares between voxels of different labels, and the label behind each and in front of it:

corners, labels = [], []
for axis, square in enumerate(([1, 2], [2, 0], [0, 1])):
    back, front = np.delete(voxels, -1, axis), np.delete(voxels, 0, axis)
    at = np.argwhere(back != front) + np.eye(3, dtype=int)[axis]
    u, v = np.eye(3, dtype=int)[square]
    corners.append(np.stack([at, at + u, at + u + v, at + v], axis=1))
    labels.append(np.stack([back[back != front], front[back != front]], axis=1))
V, squares = np.unique(np.concatenate(corners).reshape(-1, 3), axis=0, return_inverse=True)
squares, labels = squares.reshape(-1, 4), np.concatenate(labels)

result = mss.smooth_labels(V, squares, labels=labels)
print(result)

# %%
# One body is left out in the lower row, so that the borders inside are seen.

colors = ["#d8a47f", "#7f9fd8", "#9fd87f", "#d87fb0"]
plotter = pv.Plotter(shape=(2, 2), window_size=(900, 800))
for column, vertices in enumerate((V.astype(float), result.vertices)):
    for row in range(2):
        plotter.subplot(row, column)
        for label in range(1 + row, 5):
            mesh = pv.PolyData.from_regular_faces(vertices, squares[(labels == label).any(axis=1)])
            plotter.add_mesh(mesh, color=colors[label - 1])
        plotter.camera_position = [(120, 70, 60), (20, 20, 20), (0, 0, 1)]
        plotter.camera.zoom(1.4)
plotter.show()

# %%
for each in result.labels:
    print(f"label {each.label}: {each.before:.0f} voxels, {100 * each.change:+.2f} %")
print(f"{result.still_shared} of {result.shared} shared vertices are still shared")

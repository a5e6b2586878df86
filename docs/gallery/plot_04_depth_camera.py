"""
A depth-camera scan
===================

Noise that grows with the distance: it is measured as a field, and removed by its level at each place.
"""

import numpy as np
import pyvista as pv

# A corrugated wall that recedes, seen by a camera
n = 180
u, v = np.meshgrid(np.linspace(-0.7, 0.7, n), np.linspace(-0.7, 0.7, n))
depth = 1.2 + 2.4 * (u + 0.7) / 1.4 + 0.08 * np.sin(6 * v)
rays = np.stack([u, v, np.ones_like(u)], axis=-1)
rng = np.random.default_rng(0)
measured = depth + 0.0004 * depth**3 * rng.standard_normal(depth.shape)
at = (np.arange(n - 1)[:, None] * n + np.arange(n - 1)).ravel()
faces = np.concatenate([np.c_[at, at + n + 1, at + 1], np.c_[at, at + n, at + n + 1]])
scan = pv.PolyData.from_regular_faces((rays * measured[..., None]).reshape(-1, 3), faces)
truth = (rays * depth[..., None]).reshape(-1, 3)

# %%
noise = scan.specsmooth.estimate_noise()
print(noise)
scan.point_data["noise level"] = noise.local
camera = [(-0.4, -0.2, -2.2), (0.15, 0, 3), (0, -1, 0)]
scan.plot(scalars="noise level", cmap="viridis", cpos=camera, zoom=1.5)

# %%
smooth = scan.specsmooth.denoise()
print(smooth.specsmooth.summary)
plotter = pv.Plotter(shape=(1, 2))
for column, (mesh, title) in enumerate([(scan, "scan"), (smooth, "denoise()")]):
    plotter.subplot(0, column)
    plotter.add_text(title, font_size=10)
    plotter.add_mesh(mesh, color="#d8c9a8")
    plotter.camera_position = camera
    plotter.camera.zoom(1.5)
plotter.show()

# %%
for name, points in (("scan", scan.points), ("denoise()", smooth.points)):
    error = np.linalg.norm(points - truth, axis=1).reshape(n, n)
    near, far = error[:, : n // 3], error[:, -n // 3 :]
    print(f"{name:10} near {np.sqrt((near**2).mean()):.4f}, far {np.sqrt((far**2).mean()):.4f} (RMS)")

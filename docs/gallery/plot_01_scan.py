"""
A noisy scan
============

The Stanford bunny with noise, denoised without a parameter: the noise is measured, and the strength is chosen by the
estimated error.
"""

from pathlib import Path

import numpy as np
import pymeshlab
import pyvista as pv

import meshlab_specsmooth as mss

truth = pv.read(Path(pymeshlab.__file__).parent / "tests/sample_meshes/bunny.obj")
edge = mss.estimate_noise(truth).mean_edge
scan = truth.copy()
scan.points += 0.2 * edge * np.random.default_rng(1).standard_normal(scan.points.shape)

# %%
# Every ``PolyData`` has the filters, with the extra ``pyvista``.

smooth = scan.specsmooth.denoise()
result = smooth.specsmooth.result
print(result)

# %%
# Beside MeshLab's Taubin filter at its defaults:

ms = pymeshlab.MeshSet()
ms.add_mesh(pymeshlab.Mesh(scan.points, scan.regular_faces))
ms.apply_coord_taubin_smoothing()
taubin = pv.PolyData.from_regular_faces(ms.current_mesh().vertex_matrix(), scan.regular_faces)

plotter = pv.Plotter(shape=(1, 3))
for column, (mesh, title) in enumerate([(scan, "scan"), (taubin, "MeshLab, Taubin"), (smooth, "denoise()")]):
    plotter.subplot(0, column)
    plotter.add_text(title, font_size=10)
    plotter.add_mesh(mesh, smooth_shading=False)
    plotter.view_xy()
    plotter.camera.zoom(1.4)
plotter.show()

# %%
# The estimate of the error needs no ground truth; here there is one to compare with:

for name, mesh in (("Taubin", taubin), ("denoise()", smooth)):
    error = mss.deviation(truth, mesh)
    print(f"{name:10} RMS {error.rms / edge:.3f} edges along the normals")
print(f"estimated  RMS {result.error / edge:.3f} edges")

# %%
# Where the result can be trusted: the expected error around each vertex.

smooth.point_data["expected error, in edges"] = result.error_field / edge
smooth.plot(scalars="expected error, in edges", cmap="viridis", cpos="xy", zoom=1.4)

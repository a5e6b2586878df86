"""
A machined part with edges
==========================

Edges stay sharp: :func:`~meshlab_specsmooth.denoise` also considers the edge-aware filter, which smooths the normals of
the faces, but not across creases.
"""

import numpy as np
import pymeshlab
import pyvista as pv

import meshlab_specsmooth as mss

# A plate with a step and a boss, remeshed to triangles of one size
plate = pv.Box(bounds=(-1, 1, -0.6, 0.6, -0.15, 0.15)).triangulate()
ms = pymeshlab.MeshSet()
ms.add_mesh(pymeshlab.Mesh(plate.points, plate.regular_faces))
boss = pv.Cylinder(center=(0.35, 0, 0.1), direction=(0, 0, 1), radius=0.35, height=0.6, resolution=96).triangulate()
boss = boss.clean()
ms.add_mesh(pymeshlab.Mesh(boss.points, boss.regular_faces))
ms.generate_boolean_union(first_mesh=0, second_mesh=1)
ms.meshing_isotropic_explicit_remeshing(iterations=8, targetlen=pymeshlab.PureValue(0.035), featuredeg=25)
V, F = ms.current_mesh().vertex_matrix(), ms.current_mesh().face_matrix()

truth = pv.PolyData.from_regular_faces(V, F)
edge = mss.estimate_noise(truth).mean_edge
scan = truth.copy()
scan.points = V + 0.15 * edge * np.random.default_rng(0).standard_normal(V.shape)

# %%
denoised = scan.specsmooth.denoise()
isotropic = scan.specsmooth.smooth()
print(denoised.specsmooth.summary)

plotter = pv.Plotter(shape=(1, 3))
for column, (mesh, title) in enumerate([(scan, "scan"), (isotropic, "smooth()"), (denoised, "denoise()")]):
    plotter.subplot(0, column)
    plotter.add_text(title, font_size=10)
    plotter.add_mesh(mesh, smooth_shading=False)
    plotter.camera_position = [(2.4, -3.2, 2.6), (0, 0, 0.05), (0, 0, 1)]
    plotter.camera.zoom(1.25)
plotter.show()

# %%
# The angles between the normals of the faces and the true ones:


def normal_error(mesh):
    """Mean angle between the normals and those of the part, in degrees."""
    a, b = (m.compute_normals(point_normals=False, consistent_normals=False)["Normals"] for m in (mesh, truth))
    return np.degrees(np.arccos(np.clip((a * b).sum(axis=1), -1, 1))).mean()


for name, mesh in (("scan", scan), ("smooth()", isotropic), ("denoise()", denoised)):
    print(f"{name:10} {normal_error(mesh):.2f} degrees")

# %%
# Creases that are known, as from a CAD model, can be given: nothing is smoothed across them.

held = mss.denoise(scan.points, F, creases=60)
print(held.summary)

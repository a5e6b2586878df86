"""
A batch
=======

Many files, each in a process of its own: a mesh that crashes its process costs no other. An interrupted run is gone on
with by the same call.
"""

import tempfile
from pathlib import Path

import matplotlib.image
import matplotlib.pyplot as plt
import numpy as np
import pyvista as pv

import meshlab_specsmooth as mss

folder = Path(tempfile.mkdtemp())
rng = np.random.default_rng(0)
solids = {"torus": pv.ParametricTorus(), "ellipsoid": pv.ParametricEllipsoid(1, 0.7, 0.5), "ball": pv.Icosphere(nsub=5)}
for name, solid in solids.items():
    mesh = solid.clean().triangulate()
    mesh.points += 0.004 * rng.standard_normal(mesh.points.shape)
    mesh.save(folder / f"{name}.ply")
(folder / "damaged.ply").write_text("ply\nformat ascii 1.0\nelement vertex 9\n")

# %%
summary = mss.batch(folder, folder / "smooth", workers=2)
print(summary)

# %%
# A contact sheet shows each mesh before and after:

(sheet,) = (folder / "smooth").glob("contact-*.png")
plt.figure(figsize=(9, 3))
plt.imshow(matplotlib.image.imread(sheet))
plt.axis("off")
plt.subplots_adjust(0, 0, 1, 1)
plt.show()

# %%
# In a shell it is ``specsmooth batch FOLDER --out smooth``; ``--scheduler`` sends the meshes to a Dask cluster.

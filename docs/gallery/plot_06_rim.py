"""
An open rim
===========

The boundary of a scan, or of a mesh that was cut, is jagged. :func:`~meshlab_specsmooth.smooth_boundary` smooths it
along itself; the rest stays.
"""

from pathlib import Path

import numpy as np
import pymeshlab
import pyvista as pv

bunny = pv.read(Path(pymeshlab.__file__).parent / "tests/sample_meshes/bunny.obj")
height = bunny.cell_centers().points @ [0.25, 1.0, 0.2]
cut = bunny.extract_cells(np.flatnonzero(height < 0.3)).extract_surface(algorithm="dataset_surface")

# %%
smooth = cut.specsmooth.smooth_boundary()
print(smooth.specsmooth.result)

plotter = pv.Plotter(shape=(1, 2))
for column, (mesh, title) in enumerate([(cut, "cut"), (smooth, "smooth_boundary()")]):
    plotter.subplot(0, column)
    plotter.add_text(title, font_size=10)
    plotter.add_mesh(mesh, show_edges=True, edge_opacity=0.3)
    plotter.camera_position = [(0.3, 1.3, 0.9), (0.3, 0.2, 0.25), (0, 1, 0)]
    plotter.camera.zoom(2.6)
plotter.show()

# %%
# A few rings of inner vertices follow, less and less; all others stay to the bit. With ``rings=0`` the inner vertices
# stay as well.

moved = np.linalg.norm(smooth.points - cut.points, axis=1) > 0
print(f"{moved.sum()} of {cut.n_points} vertices have moved")
print(cut.specsmooth.smooth_boundary(rings=0).specsmooth.summary)

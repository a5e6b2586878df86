"""
A response of your own
======================

A transfer function is a function from the cut-off, an eigenvalue of the Laplacian, to a
:class:`~meshlab_specsmooth.Response`; filters take it as it is.
"""

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pymeshlab
import pyvista as pv

import meshlab_specsmooth as mss


def band_stop(cutoff):
    """1, but for waves around the cut-off, which are removed."""

    def gain(x):
        return 1 - np.exp(-((np.log2(np.maximum(x, 1e-12) / cutoff) / 0.8) ** 2))

    return mss.Response(f"band stop({cutoff:.3g})", gain, gain)


x = np.geomspace(1e-4, 2, 400)
plt.figure(figsize=(8, 3))
plt.semilogx(x, band_stop(0.02)(x), label="band stop")
plt.semilogx(x, mss.Response.__call__(band_stop(0.1), x), "--", label="at a higher cut-off")
plt.xlabel("eigenvalue of the Laplacian")
plt.ylabel("gain")
plt.legend()
plt.tight_layout()
plt.show()

# %%
bunny = pv.read(Path(pymeshlab.__file__).parent / "tests/sample_meshes/bunny.obj")
stopped = bunny.specsmooth.low_pass(response=band_stop, wavelength=0.15)
plotter = pv.Plotter(shape=(1, 2))
for column, (mesh, title) in enumerate([(bunny, "given"), (stopped, "waves of 0.15 are removed, finer ones stay")]):
    plotter.subplot(0, column)
    plotter.add_text(title, font_size=9)
    plotter.add_mesh(mesh)
    plotter.view_xy()
    plotter.camera.zoom(1.4)
plotter.show()
print(stopped.specsmooth.summary)

"""
A tolerance report
==================

No vertex moves further than a limit, and a report says where a result deviates, and whether a tolerance is kept.
"""

from pathlib import Path

import matplotlib.image
import matplotlib.pyplot as plt
import numpy as np
import pymeshlab
import pyvista as pv

import meshlab_specsmooth as mss

scan = pv.read(Path(pymeshlab.__file__).parent / "tests/sample_meshes/bunny.obj")
edge = mss.estimate_noise(scan).mean_edge
scan.points += 0.2 * edge * np.random.default_rng(1).standard_normal(scan.points.shape)
tolerance = 0.5 * edge

# %%
free = scan.specsmooth.denoise()
found = scan.specsmooth.deviation(free, tolerance=tolerance)
print(found)

# %%
# The report as a picture; :func:`~meshlab_specsmooth.write_deviation` writes a mesh file with these colors.

mss.draw_deviation("deviation.png", found, title="denoise()")
plt.figure(figsize=(10, 7))
plt.imshow(matplotlib.image.imread("deviation.png"))
plt.axis("off")
plt.subplots_adjust(0, 0, 1, 1)
plt.show()

# %%
# ``max_displacement`` is a constraint of the least squares: the vertices around those at the limit follow.

limited = scan.specsmooth.denoise(max_displacement=tolerance)
print(limited.specsmooth.result.limited, "vertices are at the limit")
print(scan.specsmooth.deviation(limited, tolerance=tolerance).summary)

# %%
# In a shell, the exit code stops a pipeline where the tolerance is exceeded::
#
#     $ specsmooth deviation scan.ply smooth.ply --tolerance 0.05 --picture deviation.png --json deviation.json
#     14 of 28088 vertices beyond the tolerance of 0.05: ...
#     $ echo $?
#     3
Path("deviation.png").unlink()

"""Impulses: outliers at many vertices, clipped to the surface before anything is smoothed."""

from __future__ import annotations

import numpy as np

from meshlab_specsmooth.arrays import Floats
from meshlab_specsmooth.geometry.triangles import compute_vertex_normals
from meshlab_specsmooth.operators.assemble import Operators
from meshlab_specsmooth.operators.reconstruction import reconstruct

# Vertices are clipped to within the median distance of a surface that is smoothed from them, repeatedly; impulses lie
# far beyond the median. The weight keeps edges while the iterations spread.
# docs/constants.md: _ITERATIONS
_ITERATIONS = 15
# docs/constants.md: _WEIGHT
_WEIGHT = 0.7


def clip_impulses(ops: Operators) -> Floats:
    """(k, 3) positions with impulses clipped: Huber's M-estimate of the surface by half-quadratic iterations.

    Each iteration smooths, and replaces a vertex that is farther from the smooth surface than the median, along the
    normals, by the point at that distance.
    """
    X = ops.positions
    Y, clipped = reconstruct(ops.L, ops.gram, X, _WEIGHT), X
    for _ in range(_ITERATIONS):
        n = compute_vertex_normals(Y, ops.faces)
        distance = ((X - Y) * n).sum(axis=1)
        limit = np.median(np.abs(distance))
        clipped = Y + n * np.clip(distance, -limit, limit)[:, None]
        Y = reconstruct(ops.L, ops.gram, clipped, _WEIGHT)
    return clipped

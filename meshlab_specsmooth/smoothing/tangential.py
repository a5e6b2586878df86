"""The tangential part of a displacement, which shifts vertices along the surface."""

from __future__ import annotations

import numpy as np

from meshlab_specsmooth.arrays import Floats
from meshlab_specsmooth.geometry.triangles import compute_vertex_normals
from meshlab_specsmooth.noise.model import Noise
from meshlab_specsmooth.operators.assemble import Operators
from meshlab_specsmooth.operators.reconstruction import reconstruct

# Smoothing shifts vertices along the surface, which repairs the triangles that noise has disturbed. Below the first
# level, in edges, noise has not disturbed any, and the shift is removed; above the second all of it is kept.
# docs/constants.md: _TANGENTIAL_RAMP
_TANGENTIAL_RAMP = (0.03, 0.1)


def tangential_fraction(noise: Noise) -> float:
    """The fraction of the tangential displacement that is kept, in [0, 1]."""
    low, high = _TANGENTIAL_RAMP
    return float(np.clip((noise.level_in_edges - low) / (high - low), 0.0, 1.0))


def remove_tangential(displacement: Floats, ops: Operators, fraction: float) -> Floats:
    """(k, 3) displacement with only a fraction of its tangential part."""
    n = compute_vertex_normals(ops.positions + displacement, ops.faces)
    normal = n * (displacement * n).sum(axis=1)[:, None]
    return np.asarray(normal + fraction * (displacement - normal))


def move_boundary_along_normals(ops: Operators, weight: float) -> Floats:
    """(k, 3) positions with the boundary displaced as by smoothing, but along the normals only: it does not shrink."""
    X, at = ops.positions, ops.boundary_vertices
    Y = reconstruct(ops.L, ops.gram, X, weight)
    n = compute_vertex_normals(Y, ops.faces)[at]
    moved = X.copy()
    moved[at] += n * ((Y - X)[at] * n).sum(axis=1)[:, None]
    return moved

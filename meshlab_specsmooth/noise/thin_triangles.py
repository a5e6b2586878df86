"""Vertices amid long thin triangles, where the uniform Laplacian sees the shape of the triangles as noise."""

from __future__ import annotations

import numpy as np

from meshlab_specsmooth.arrays import Booleans, Floats
from meshlab_specsmooth.geometry.triangles import compute_aspects
from meshlab_specsmooth.operators.assemble import Operators

# A face of this aspect does not show the noise at its corners. White noise of half an edge on even triangles gives an
# aspect above it to 2 % of the faces, and hardly ever to a third of those at a vertex and at half of its neighbors.
# docs/constants.md: _MAX_ASPECT
_MAX_ASPECT = 12.0

# Between such faces a vertex that would move by more than this many noise levels is not moved.
_MAX_LEVELS = 8.0


def find_uneven_vertices(ops: Operators) -> Booleans:
    """(k,) vertices amid triangles that are too thin: a third of the faces at one, and at half of its neighbors."""
    is_thin = compute_aspects(ops.positions, ops.faces) > _MAX_ASPECT
    n = len(ops.positions)
    if not is_thin.any():
        return np.zeros(n, dtype=np.bool_)
    faces = np.bincount(ops.faces.ravel(), minlength=n)
    thin = np.bincount(ops.faces[is_thin].ravel(), minlength=n)
    uneven = (3 * thin >= faces) & (thin > 0)
    graph = ops.L.graph
    around = graph.adjacency(np.ones(len(graph.indices))) @ uneven.astype(np.float64)
    return np.asarray(uneven & (around >= 0.5 * ops.L.degree[:, 0]))


def find_lost_vertices(displacement: Floats, ops: Operators, level: float) -> Booleans | None:
    """(k,) vertices amid thin triangles that would move farther than noise of a level explains; None if there are none.

    Parameters
    ----------
    displacement : (k, 3) float64
        In the units of the positions.
    ops : Operators
    level : float
        Standard deviation of the noise, in the same units.
    """
    is_far = np.einsum("ij,ij->i", displacement, displacement) > (_MAX_LEVELS * level) ** 2
    if not is_far.any():
        return None
    is_far &= find_uneven_vertices(ops)
    return is_far if is_far.any() else None


def describe_lost(lost: Booleans) -> str:
    """A sentence for the warning of a result."""
    count = int(lost.sum())
    return f"{count} {'vertex' if count == 1 else 'vertices'} between long thin triangles left alone"

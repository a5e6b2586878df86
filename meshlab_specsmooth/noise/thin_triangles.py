"""Vertices amid long thin triangles, where the uniform Laplacian sees the shape of the triangles as noise."""

from __future__ import annotations

import numpy as np

from meshlab_specsmooth.arrays import Booleans, Floats
from meshlab_specsmooth.geometry.triangles import compute_aspects
from meshlab_specsmooth.graph.laplacian import neighbors_of
from meshlab_specsmooth.operators.assemble import Operators
from meshlab_specsmooth.runtime import blocks

# A face of this aspect does not show the noise at its corners. White noise of half an edge on even triangles gives an
# aspect above it to 2 % of the faces, and hardly ever to a third of those at a vertex and at half of its neighbors.
# docs/constants.md: _MAX_ASPECT
_MAX_ASPECT = 12.0

# Between such faces a vertex that would move by more than this many noise levels is not moved.
_MAX_LEVELS = 8.0


def find_uneven_vertices(ops: Operators, among: Booleans) -> Booleans:
    """(k,) vertices amid triangles that are too thin: a third of the faces at one, and at half of its neighbors.

    Parameters
    ----------
    ops : Operators
    among : (k,) bool
        Vertices that are looked at.
    """
    n, F = len(ops.positions), ops.faces
    near = among.copy()
    near[neighbors_of(ops.L, np.flatnonzero(among))[1]] = True
    is_near = np.empty(len(F), dtype=np.bool_)

    def look(at: slice) -> None:
        is_near[at] = near.take(F[at]).any(axis=1)

    blocks.parallel_rows(look, len(F))
    F = F[is_near]
    is_thin = compute_aspects(ops.positions, F) > _MAX_ASPECT
    if not is_thin.any():
        return np.zeros(n, dtype=np.bool_)
    faces = np.bincount(F.ravel(), minlength=n)
    thin = np.bincount(F[is_thin].ravel(), minlength=n)
    uneven = (3 * thin >= faces) & (thin > 0)
    at = np.flatnonzero(uneven & among)
    row, neighbor = neighbors_of(ops.L, at)
    around = np.bincount(row[uneven[neighbor]], minlength=len(at))
    found = np.zeros(n, dtype=np.bool_)
    found[at] = around >= 0.5 * np.diff(ops.L.graph.indptr)[at]
    return found


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
    lost = find_uneven_vertices(ops, is_far)
    return lost if lost.any() else None


def describe_lost(lost: Booleans) -> str:
    """A sentence for the warning of a result."""
    count = int(lost.sum())
    return f"{count} {'vertex' if count == 1 else 'vertices'} between long thin triangles left alone"

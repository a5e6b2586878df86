"""Staircases: surfaces of binary masks, whose vertices lie on a lattice of voxels.

Marching cubes puts the vertices of a mask's surface at the middle of lattice edges, other methods at the corners of
voxels. Either way all edges are multiples of half a voxel along three orthogonal axes, however the mesh is turned or
scaled, and the surface goes up and down in steps. The true surface is within half a voxel or so of each vertex.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np

from meshlab_specsmooth.arrays import Booleans, Floats, Integers
from meshlab_specsmooth.geometry.triangles import compute_heights, normalize_rows

# Edges of marching cubes take some 40 values but for their sign, those of voxels' faces 9.
_MAX_DIFFERENT = 150

# Whether there are more is seen on a part of the edges first.
_MAX_LOOKED_AT = 3000

# Directions that are tried as axes.
_MAX_CANDIDATES = 40

# Edges are equal to within this fraction of a mean edge: coordinates of single precision leave a tenth of it in a
# volume of a thousand voxels. They are orthogonal, and multiples of half a voxel, to within the second.
# docs/constants.md: _EXACT
_EXACT = 1e-3
# docs/constants.md: _TOLERANCE
_TOLERANCE = 1e-2

# Of the edges of a staircase, so many turn up and as many turn down; a box on a lattice turns one way.
# docs/constants.md: _MIN_TURNS, _MIN_OTHER_TURNS
_MIN_TURNS, _MIN_OTHER_TURNS = 0.08, 0.1


@dataclass(frozen=True, eq=False)
class Voxels:
    """The lattice of a mask.

    Attributes
    ----------
    axes : (3, 3) float64
        Unit vectors, a row each.
    spacing : (3,) float64
        Length of a voxel along each axis.
    has_corners : bool
        Whether the vertices are the corners of voxels, not the middles of lattice edges.
    """

    axes: Floats
    spacing: Floats
    has_corners: bool = False

    @staticmethod
    def of(spacing: float | tuple[float, float, float], factor: float = 1.0) -> Voxels:
        """Along x, y and z, with sides times a factor."""
        return Voxels(np.eye(3), np.broadcast_to(np.asarray(spacing, dtype=np.float64) * factor, 3))

    def measure(self, D: Floats) -> Floats:
        """(k,) largest component of displacements along an axis, in halves of a voxel."""
        return np.asarray(np.abs(D @ self.axes.T * (2 / self.spacing)).max(axis=1))

    def covariance(self) -> Floats:
        """(3, 3) that of an error that is uniform over a voxel along each axis."""
        return np.asarray(self.axes.T @ np.diag(self.spacing**2 / 12) @ self.axes)


def find_voxels(X: Floats, F: Integers) -> Voxels | None:
    """The voxels of the mask that a surface was made from; None if it was not.

    Parameters
    ----------
    X : (k, 3) float64
    F : (m, 3) int
    """
    edges = np.concatenate([X[F[:, k]] - X[F[:, k - 1]] for k in range(3)])
    unit = float(np.linalg.norm(edges, axis=1).mean())
    if not unit > 0:
        return None
    some = edges[:: max(1, len(edges) // _MAX_LOOKED_AT)] / unit
    different = None if _find_different(some) is None else _find_different(edges / unit)
    if different is None or not _has_steps(X / unit, F):
        return None
    axes = _find_axes(different)
    if axes is None:
        return None
    has_corners = not _find_odd_halves(axes, different).any()
    return Voxels(normalize_rows(axes), np.linalg.norm(axes, axis=1) * unit, has_corners)


def _find_different(edges: Floats) -> Floats | None:
    """(d, 3) the different edges, but for their sign, the most frequent first; None if there are too many."""
    cell = np.rint(edges / _EXACT).astype(np.int64)
    leading = np.argmax(cell != 0, axis=1)
    sign = np.sign(np.take_along_axis(cell, leading[:, None], axis=1))
    same, first, count = np.unique(cell * sign, axis=0, return_index=True, return_counts=True)
    # a value on the border of two cells is in both
    frequent = np.flatnonzero(count > 1e-3 * len(edges))
    if len(frequent) > 2 * _MAX_DIFFERENT or count[frequent].sum() < 0.9 * len(edges):
        return None
    return np.asarray(edges[first[np.lexsort((*same.T, -count))]][: 4 * _MAX_DIFFERENT])


def _find_axes(different: Floats) -> Floats | None:
    """(3, 3) the sides of a voxel: orthogonal edges of least volume that all others are multiples of, see below."""
    length = np.linalg.norm(different, axis=1)
    kept: list[int] = []
    for i in np.argsort(length, kind="stable"):  # the shortest of each direction
        parallel = np.abs(different[kept] @ different[i]) > (1 - _EXACT) * length[kept] * length[i]
        if length[i] > _EXACT and not parallel.any():
            kept.append(int(i))
    directions, length = different[kept[:_MAX_CANDIDATES]], length[kept[:_MAX_CANDIDATES]]
    orthogonal = np.abs(directions @ directions.T) < _TOLERANCE * np.outer(length, length)
    triples = [
        list(each)
        for each in itertools.combinations(range(len(directions)), 3)
        if all(orthogonal[pair] for pair in itertools.combinations(each, 2))
    ]
    for triple in sorted(triples, key=lambda each: float(np.prod(length[each]))):
        if _is_voxel(directions[triple], different):
            return np.asarray(directions[triple])
    return None


def _is_voxel(axes: Floats, edges: Floats) -> bool:
    """Whether edges join corners of voxels, or middles of their edges, which differ by halves along no axis or two."""
    halves = 2 * (edges @ axes.T) / (axes**2).sum(axis=1)
    if (np.abs(halves) > 2 + _TOLERANCE).any():  # an edge is within a voxel, unlike those between rounded coordinates
        return False
    if (np.abs(halves - np.rint(halves)) > _TOLERANCE).any():
        return False
    odd = _find_odd_halves(axes, edges)
    return bool(not odd.any() or (odd.any(axis=0).all() and np.isin(odd.sum(axis=1), (0, 2)).all()))


def _find_odd_halves(axes: Floats, edges: Floats) -> Booleans:
    """(d, 3) whether an edge is an odd number of halves along each axis."""
    return np.asarray(np.rint(2 * (edges @ axes.T) / (axes**2).sum(axis=1)) % 2 == 1)


def _has_steps(X: Floats, F: Integers) -> bool:
    """Whether a good part of the edges turn up, and another down."""
    heights = compute_heights(X, F)
    if len(heights) == 0:
        return False
    up, down = float((heights > _EXACT).mean()), float((heights < -_EXACT).mean())
    return bool(up + down > _MIN_TURNS and min(up, down) > _MIN_OTHER_TURNS * max(up, down))

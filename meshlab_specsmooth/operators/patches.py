"""The part of a mesh that noise is measured and settings are chosen on: the whole, or patches from all over it.

What is drawn is the same for every order of vertices and faces: places are taken at equal steps along Morton's curve,
patches grow ring by ring, and the vertices are numbered by their coordinates.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from meshlab_specsmooth.arrays import Booleans, Floats, Integers
from meshlab_specsmooth.graph.laplacian import Laplacian

# Meshes of more vertices than this are judged by so many patches of so many vertices each
WHOLE = 10_000
_COUNT = 5
_SIZE = 1600
# At least so many vertices must be left where only a part of the mesh counts
MIN_COUNTED = 200


@dataclass(frozen=True, eq=False)
class Sample:
    """A part of a mesh in an order of its own.

    Attributes
    ----------
    vertices : (k,) int64
        Indices into the mesh, ordered by coordinates.
    faces : (m, 3) int32
        By the numbers of these vertices, each from its lowest corner on, sorted.
    """

    vertices: npt.NDArray[np.int64]
    faces: Integers


def draw_sample(X: Floats, F: Integers, L: Laplacian, counted: Booleans | None = None) -> Sample:
    """The mesh where it is small, else patches of it, the same for any order of vertices and faces.

    Parameters
    ----------
    X : (n, 3) float64
    F : (m, 3) int32
    L : Laplacian
        Of the mesh, whose graph the patches grow on.
    counted : (n,) bool, optional
        Where patches start: everywhere by default, or where fewer than :data:`MIN_COUNTED` vertices are left.
    """
    n = len(X)
    if n <= WHOLE:
        return _numbered(X, F, np.arange(n))
    if counted is not None and counted.sum() >= MIN_COUNTED:
        among = np.flatnonzero(counted)
        starts = [int(among[at]) for at in _spread(X[among])]
    else:
        starts = _spread(X)
    chosen = np.zeros(n, dtype=np.bool_)
    for start in starts:
        chosen |= _grow(L, start)
    kept = F[chosen[F[:, 0]]]  # few are left to look at
    kept = kept[chosen[kept].all(axis=1)]
    at = np.unique(kept).astype(np.int64)
    place = np.full(n, -1, dtype=np.int32)
    place[at] = np.arange(len(at), dtype=np.int32)
    return _numbered(X[at], place[kept], at)


# Cells to a side of the grid that starts are spread over
_CELLS = 32
# The bits of a cell's number along one axis, at the places 0, 3, 6, ...
_SPREAD = np.array([sum((i >> bit & 1) << 3 * bit for bit in range(5)) for i in range(_CELLS)], dtype=np.int64)


def _spread(X: Floats) -> list[int]:
    """Indices of vertices at equal steps along Morton's curve through a grid, the lowest of each cell."""
    low, high = X.min(axis=0), X.max(axis=0)
    widest = float((high - low).max())
    cell = ((X - low) * ((_CELLS - 1) / widest if widest > 0 else 0.0)).astype(np.intp)
    code = _SPREAD[cell[:, 0]] + 2 * _SPREAD[cell[:, 1]] + 4 * _SPREAD[cell[:, 2]]
    below = np.cumsum(np.bincount(code))
    starts = []
    for k in range(_COUNT):
        chosen = np.searchsorted(below, (2 * k + 1) * len(X) / (2 * _COUNT))
        there = np.flatnonzero(code == chosen)
        starts.append(int(there[np.lexsort(X[there].T)[0]]))
    return starts


def _numbered(X: Floats, F: Integers, at: npt.NDArray[np.int64]) -> Sample:
    order = np.lexsort(X.T)
    rank = np.empty(len(X), dtype=np.int32)
    rank[order] = np.arange(len(X), dtype=np.int32)
    faces = rank[F]
    # the orientation stays
    turn = (np.argmin(faces, axis=1)[:, None] + np.arange(3)) % 3
    faces = np.take_along_axis(faces, turn, axis=1)
    return Sample(at[order], np.ascontiguousarray(faces[np.lexsort(faces.T[::-1])]))


def _grow(L: Laplacian, start: int) -> Booleans:
    """The vertices nearest to one, by whole rings."""
    first, neighbors = L.graph.indptr, L.graph.indices
    reached = np.zeros(L.size, dtype=np.bool_)
    ring, count = np.array([start]), 0
    while len(ring):
        reached[ring] = True
        count += len(ring)
        if count >= _SIZE:
            break
        degree = first[ring + 1] - first[ring]
        begin = np.cumsum(degree) - degree
        beyond = neighbors[np.repeat(first[ring] - begin, degree) + np.arange(degree.sum())]
        ring = np.unique(beyond[~reached[beyond]])
    return reached

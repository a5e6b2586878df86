"""Vertex clustering: fewer vertices for display, each of them one of the given ones."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from meshlab_specsmooth.arrays import Floats, Integers

_MAX_ROUNDS = 30


def cluster_vertices(V: Floats, F: Integers, max_count: int) -> tuple[npt.NDArray[np.int64], Integers]:
    """Select vertices and re-index the faces: in each cell of a grid the first vertex represents all.

    Parameters
    ----------
    V : (n, 3) float64
    F : (m, 3) int
    max_count : int
        Upper bound on the number of vertices, nearly attained on surfaces.

    Returns
    -------
    kept : (k,) int64
        The selected vertices.
    faces : (j, 3) int32
        Indices into ``kept``, without collapsed and repeated faces.
    """
    low, extent = V.min(axis=0), float(np.ptp(V, axis=0).max()) or 1.0
    # a surface fills about as many cells as the square of their number along a side
    cells = math.sqrt(max_count) / 1.2
    for _ in range(_MAX_ROUNDS):
        at = np.floor((V - low) / extent * cells).astype(np.int64)
        key = (at[:, 0] * 2**40) + (at[:, 1] * 2**20) + at[:, 2]
        kept, faces = collapse_cells(key, F)
        if len(kept) <= max_count:
            break
        cells *= 0.98 * math.sqrt(max_count / len(kept))
    _, first = np.unique(np.sort(faces, axis=1), axis=0, return_index=True)
    return kept, faces[np.sort(first)]


def collapse_cells(cell: npt.NDArray[np.int64], F: Integers) -> tuple[npt.NDArray[np.int64], Integers]:
    """Replace the vertices of each cell by the first of them, and drop the faces that collapse.

    Parameters
    ----------
    cell : (n,) int64
        Number of the cell of each vertex.
    F : (m, 3) int

    Returns
    -------
    kept : (k,) int64
        The first vertex of each cell.
    faces : (j, 3) int32
        Indices into ``kept``.

    Examples
    --------
    >>> import numpy as np
    >>> from meshlab_specsmooth.geometry.decimate import collapse_cells
    >>> kept, faces = collapse_cells(np.array([7, 7, 8, 9]), np.array([[0, 1, 2], [1, 2, 3]]))
    >>> kept.tolist(), faces.tolist()
    ([0, 2, 3], [[0, 1, 2]])
    """
    _, kept, number = np.unique(cell, return_index=True, return_inverse=True)
    faces = number.reshape(-1)[F].astype(np.int32)
    a, b, c = faces.T
    return kept, faces[(a != b) & (b != c) & (c != a)]

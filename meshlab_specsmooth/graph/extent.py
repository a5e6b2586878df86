"""Volume, area and squared edges of a mesh, summed over its faces in one pass."""

from __future__ import annotations

import numpy as np

from meshlab_specsmooth.arrays import Floats, Integers
from meshlab_specsmooth.runtime import backend, blocks


def sum_faces(X: Floats, F: Integers) -> Floats:
    """Sums over the faces (3,): signed volume, area, and mean squared length of the three sides.

    Compiled where the extra ``fast`` is installed.
    """
    sums = np.empty((blocks.count(len(F)), 3))

    def add(first: int, last: int) -> None:
        for i in range(first, last):
            sums[i] = np.sum(measure_faces(X, F[blocks.rows(i, len(F))]), axis=1)

    work = _compiled(X, F, sums) if backend.is_compiled(len(X)) else add
    blocks.in_threads(work, len(F))
    return np.asarray(sums.sum(axis=0))


def _compiled(X: Floats, F: Integers, sums: Floats) -> blocks.Work:
    from meshlab_specsmooth.graph.extent_compiled import add_faces

    def add(first: int, last: int) -> None:
        for i in range(first, last):
            at = blocks.rows(i, len(F))
            add_faces(at.start, at.stop, X, F, sums[i])

    return add


def measure_faces(X: Floats, F: Integers) -> tuple[Floats, Floats, Floats]:
    """(m,) of the same for each face, by numpy: the reference."""
    a, b, c = X[F[:, 0]], X[F[:, 1]], X[F[:, 2]]
    across = np.cross(b - a, c - a)
    squares = ((b - a) ** 2 + (c - b) ** 2 + (a - c) ** 2).sum(axis=1) / 3
    return np.einsum("ij,ij->i", a, across) / 6, np.linalg.norm(across, axis=1) / 2, squares

"""Volume, area and squared edge lengths of faces with numpy: the reference."""

from __future__ import annotations

import numpy as np

from meshlab_specsmooth.arrays import Floats, Integers


def measure_faces(X: Floats, F: Integers) -> tuple[Floats, Floats, Floats]:
    """(m,) signed volume, area, and mean squared length of the three edges of each face."""
    a, b, c = X[F[:, 0]], X[F[:, 1]], X[F[:, 2]]
    across = np.cross(b - a, c - a)
    squares = ((b - a) ** 2 + (c - b) ** 2 + (a - c) ** 2).sum(axis=1) / 3
    return np.einsum("ij,ij->i", a, across) / 6, np.linalg.norm(across, axis=1) / 2, squares


def sum_faces(low: int, high: int, X: Floats, F: Integers, sums: Floats) -> None:
    """``sums`` (3,) becomes the sums of :func:`measure_faces` over the faces from ``low`` to ``high``."""
    sums[:] = np.sum(measure_faces(X, F[low:high]), axis=1)

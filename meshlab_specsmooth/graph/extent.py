"""Volume, area and squared edge lengths of a mesh, summed over its faces in one pass."""

from __future__ import annotations

import numpy as np

from meshlab_specsmooth.arrays import Floats, Integers
from meshlab_specsmooth.graph import backend
from meshlab_specsmooth.runtime import blocks


def sum_faces(X: Floats, F: Integers) -> Floats:
    """Sums over the faces (3,): signed volume, area, and mean squared length of the three edges."""
    sums, add = np.empty((blocks.count(len(F)), 3)), backend.select(len(X)).sum_faces

    def work(first: int, last: int) -> None:
        for i in range(first, last):
            at = blocks.rows(i, len(F))
            add(at.start, at.stop, X, F, sums[i])

    blocks.parallel_for(work, len(F))
    return np.asarray(sums.sum(axis=0))

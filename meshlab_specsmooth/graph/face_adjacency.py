"""Data types for graphs of faces: two faces are neighbors if they share a vertex."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_array

from meshlab_specsmooth.arrays import Integers

# Faces around a vertex with more faces than this (the hub of a fan) are neighbors only through their other vertices:
# all pairs of them would grow as the square of their number.
MAX_FACES_OF_A_VERTEX = 32


@dataclass(frozen=True, eq=False)
class FaceGraph:
    """Which faces share a vertex, and which faces each vertex has.

    Attributes
    ----------
    corners : (m, 3) int32
        The vertices of each face.
    indptr, indices : (m + 1,) and (e,) int32
        The neighbors of each face, ascending; each pair in both directions, no face its own neighbor.
    vertex_indptr, vertex_faces : (n + 1,) and (c,) int32
        The faces at each vertex, ascending; a face with several corners there counts once.
    """

    corners: Integers
    indptr: Integers
    indices: Integers
    vertex_indptr: Integers
    vertex_faces: Integers

    @property
    def size(self) -> int:
        """Number of faces."""
        return len(self.corners)

    def adjacency(self) -> csr_array:
        """(m, m) matrix that is 1 where two faces are neighbors."""
        ones = np.ones(len(self.indices))
        return csr_array((ones, self.indices, self.indptr), shape=(self.size, self.size))

    @property
    def order(self) -> int:
        """Number of vertices."""
        return len(self.vertex_indptr) - 1

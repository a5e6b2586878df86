"""The face barycenters C (paper, eq. 5-6) and their Gram matrix C^T C, which step 3 holds them by."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array, csr_array

from meshlab_specsmooth.arrays import Floats, Integers
from meshlab_specsmooth.graph.adjacency import MeshGraph


@dataclass(frozen=True, eq=False)
class Gram:
    """C^T C = diagonal + regular_edge A + irregular, where A is 1 at every edge.

    Nothing is stored for an edge of two faces, so that a sweep reads indices alone.

    Attributes
    ----------
    diagonal : (n, 1) float64
    regular_edge : float
        Entry at an edge with two faces.
    irregular : (n, n) csr_array
        What the entries at other edges differ by.
    """

    diagonal: Floats
    regular_edge: float
    irregular: csr_array

    def scaled(self, factor: float) -> Gram:
        """The matrix times a factor."""
        return Gram(factor * self.diagonal, factor * self.regular_edge, factor * self.irregular)


def gram_of_barycenters(mesh: MeshGraph) -> Gram:
    """C^T C: 1/9 for each face at a vertex, and for each at an edge."""
    n = mesh.graph.size
    irregular = coo_array(((mesh.irregular_face_count - 2) / 9, mesh.irregular_ends()), shape=(n, n)).tocsr()
    return Gram(mesh.corner_count[:, None] / 9, 2 / 9, irregular)


def weighted_gram_of_barycenters(F: Integers, n: int, weights: Floats) -> Gram:
    """C^T W^2 C for a weight W of each face, (m,), which differs over the surface: stored entry by entry."""
    C = barycenters(F, n)
    squared = csr_array(C.T @ C.multiply(weights[:, None] ** 2).tocsr())
    diagonal = squared.diagonal()
    squared.setdiag(0.0)
    squared.eliminate_zeros()
    return Gram(diagonal[:, None], 0.0, squared)


def barycenters(F: Integers, n: int) -> csr_array:
    """C of shape (m, n), three entries of 1/3 a row: ``C @ V`` are the face barycenters (paper, eq. 5)."""
    m = len(F)
    return csr_array((np.full(3 * m, 1 / 3), F.ravel(), np.arange(0, 3 * m + 1, 3)), shape=(m, n))

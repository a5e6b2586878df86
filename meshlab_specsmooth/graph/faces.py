"""The graph of faces: two are neighbors that share a vertex; and the sweeps over it.

What goes over all faces is written twice, as elsewhere in this room: with scipy here, which says what it means, and
compiled in :mod:`meshlab_specsmooth.graph.faces_compiled`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from scipy.sparse import csr_array

from meshlab_specsmooth.arrays import Floats, Integers
from meshlab_specsmooth.runtime import backend

# A vertex of so many faces is the hub of a fan; its faces are neighbors through the rim's vertices only, as all pairs
# of them would take the square of their number.
MOST_FACES_OF_A_VERTEX = 32


@dataclass(frozen=True, eq=False)
class FaceGraph:
    """Which faces share a vertex, and which faces each vertex has.

    Attributes
    ----------
    corners : (m, 3) int32
        The vertices of each face.
    indptr, indices : (m + 1,) and (e,) int32
        The neighbors of each face, rising; each pair in both directions, no face its own neighbor.
    vertex_indptr, vertex_faces : (n + 1,) and (c,) int32
        The faces at each vertex, rising; a face with several corners there counts once.
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

    @property
    def order(self) -> int:
        """Number of vertices."""
        return len(self.vertex_indptr) - 1


class FaceKernels(Protocol):
    """Sweeps over a graph of faces; arrays are float64 and the results new."""

    name: str

    def frames(self, V: Floats) -> tuple[Floats, Floats, Floats]:
        """(m, 3) centroids, (m, 3) unit normals, zero for a face of no area, and (m,) doubled areas."""

    def weigh(self, center: Floats, normal: Floats, root: Floats, near: float, alike: float) -> tuple[Floats, Floats]:
        """Weights of neighbors, and their sums.

        w_ij = root_i root_j (1 - x / 8)^8, and 0 where x = near |c_i - c_j|^2 + alike |n_i - n_j|^2 is above 8: a
        Gaussian exp(-x) to which nothing that is far off contributes at all.

        Returns
        -------
        weight : (e,) float64
        degree : (m,) float64
        """

    def solve(
        self, weight: Floats, diagonal: Floats, t: float, B: Floats, X: Floats, tolerance: float, most: int
    ) -> Floats:
        """(m, 3) solution of (diag(diagonal) - t W) Y = B, from X on.

        By at most so many conjugate gradients with a Jacobi preconditioner, until the residual in its norm is the
        tolerance's part of B's. The three columns share their steps, so that the outcome turns with the axes.
        """

    def fit(self, V: Floats, normal: Floats, pull: Floats, sweeps: int) -> Floats:
        """(n, 3) vertices after sweeps of the vertex update; see :mod:`meshlab_specsmooth.edge_aware`.

        In every sweep each vertex moves by pull times the sum over its faces of n n.(c - v), c the face's centroid.
        """


def neighbors(corners: Integers, n: int) -> FaceGraph:
    """The graph of the given faces, by scipy: the reference."""
    m = len(corners)
    at = csr_array(
        (np.ones(3 * m, dtype=np.int32), corners.ravel(), np.arange(0, 3 * m + 1, 3, dtype=np.int32)), shape=(m, n)
    )
    of_vertex = at.T.tocsr()
    of_vertex.sum_duplicates()
    few = (np.diff(of_vertex.indptr) <= MOST_FACES_OF_A_VERTEX)[corners.ravel()].astype(np.int32)
    thin = csr_array((few, at.indices, at.indptr), shape=(m, n), copy=True)
    thin.eliminate_zeros()
    pairs = (thin @ thin.T).tocoo()
    other = pairs.row != pairs.col
    shared = csr_array((pairs.data[other], (pairs.row[other], pairs.col[other])), shape=(m, m))
    shared.sort_indices()
    return FaceGraph(
        corners,
        shared.indptr.astype(np.int32),
        shared.indices.astype(np.int32),
        of_vertex.indptr.astype(np.int32),
        of_vertex.indices.astype(np.int32),
    )


class ReferenceFaceKernels:
    """See :class:`FaceKernels`."""

    name = "scipy"

    def __init__(self, graph: FaceGraph) -> None:
        self.graph = graph
        self.rows = np.repeat(np.arange(graph.size), np.diff(graph.indptr))
        ones = np.ones(len(graph.vertex_faces))
        self.at = csr_array((ones, graph.vertex_faces, graph.vertex_indptr), shape=(graph.order, graph.size))

    def frames(self, V: Floats) -> tuple[Floats, Floats, Floats]:  # noqa: D102 (the protocol says it)
        a, b, c = (V[self.graph.corners[:, k]] for k in range(3))
        across = np.cross(b - a, c - a)
        area = np.linalg.norm(across, axis=1)
        normal = np.divide(across, area[:, None], out=np.zeros_like(across), where=area[:, None] > 0)
        return (a + b + c) / 3, normal, area

    def weigh(  # noqa: D102
        self, center: Floats, normal: Floats, root: Floats, near: float, alike: float
    ) -> tuple[Floats, Floats]:
        i, j = self.rows, self.graph.indices
        apart = near * ((center[i] - center[j]) ** 2).sum(axis=1) + alike * ((normal[i] - normal[j]) ** 2).sum(axis=1)
        weight = root[i] * root[j] * np.maximum(1 - apart / 8, 0) ** 8
        return weight, np.bincount(i, weights=weight, minlength=self.graph.size).astype(np.float64)

    def solve(  # noqa: D102
        self, weight: Floats, diagonal: Floats, t: float, B: Floats, X: Floats, tolerance: float, most: int
    ) -> Floats:
        m = self.graph.size
        W = csr_array((weight, self.graph.indices, self.graph.indptr), shape=(m, m))
        inverse, diagonal = 1 / diagonal[:, None], diagonal[:, None]
        R = B - (diagonal * X - t * (W @ X))
        P = inverse * R
        X, rz = X.copy(), (R * P).sum()
        enough = tolerance**2 * (B * inverse * B).sum()
        for _ in range(most):
            if rz <= enough:
                break
            Q = diagonal * P - t * (W @ P)
            step = rz / (P * Q).sum()
            X += P * step
            R -= Q * step
            now = (R * inverse * R).sum()
            P = inverse * R + P * (now / rz)
            rz = now
        return X

    def fit(self, V: Floats, normal: Floats, pull: Floats, sweeps: int) -> Floats:  # noqa: D102
        m, n = self.graph.size, self.graph.order
        squares = self.at @ (normal[:, :, None] * normal[:, None, :]).reshape(m, 9)
        for _ in range(sweeps):
            height = (normal * V[self.graph.corners].sum(axis=1)).sum(axis=1) / 3
            drawn = self.at @ (normal * height[:, None])
            V = V + pull[:, None] * (drawn - np.einsum("nij,nj->ni", squares.reshape(n, 3, 3), V))
        return V


def face_graph(corners: Integers, n: int) -> FaceGraph:
    """The graph of faces on n vertices; compiled where the extra ``fast`` is installed."""
    if not backend.is_compiled(n):
        return neighbors(corners, n)
    from meshlab_specsmooth.graph import faces_compiled

    return faces_compiled.neighbors(corners, n)


def face_kernels(graph: FaceGraph) -> FaceKernels:
    """Compiled sweeps where the extra ``fast`` is installed, else scipy's."""
    if not backend.is_compiled(graph.order):
        return ReferenceFaceKernels(graph)
    from meshlab_specsmooth.graph.faces_compiled import CompiledFaceKernels

    return CompiledFaceKernels(graph)

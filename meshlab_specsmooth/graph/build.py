"""The graph of a mesh: who is whose neighbor, and how many faces each edge has."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.sparse import coo_array, csr_array, diags_array

from meshlab_specsmooth.arrays import Floats, Integers
from meshlab_specsmooth.runtime import backend

Neighbors = tuple[Integers, Integers, npt.NDArray[np.int64], Integers, Integers]


@dataclass(frozen=True, eq=False)
class Graph:
    """An undirected graph without loops, each edge stored in both directions.

    Attributes
    ----------
    indptr : (n + 1,) int32
        Where each vertex' neighbors start in ``indices``.
    indices : (2 e,) int32
        The neighbors, in rising order for each vertex.
    weights : (2 e,) float64 or None
        Positive and symmetric; None where every edge weighs 1, so that a sweep need not read them.
    degree : (n, 1) float64
        Sum of each vertex' weights, positive: every vertex has an edge.
    """

    indptr: Integers
    indices: Integers
    weights: Floats | None
    degree: Floats

    @property
    def size(self) -> int:
        """Number of vertices."""
        return len(self.degree)

    def adjacency(self, values: npt.NDArray[np.generic] | None = None) -> csr_array:
        """(n, n) matrix with the weights (or other values, one a direction of an edge) at the edges."""
        if values is None:
            values = np.ones(len(self.indices)) if self.weights is None else self.weights
        return csr_array((values, self.indices, self.indptr), shape=(self.size, self.size))

    def symmetric_laplacian(self) -> csr_array:
        """S = I - D^-1/2 W D^-1/2, symmetric to the bit, for those who need a matrix: eigensolvers."""
        W = self.adjacency()
        root = 1 / np.sqrt(self.degree[:, 0])
        # w_ij times (r_i r_j): the product of the roots is the same number for both directions
        W = W.tocoo()
        values = W.data * (root[W.row] * root[W.col])
        S = diags_array(np.ones(self.size)) - coo_array((values, (W.row, W.col)), shape=W.shape)
        return S.tocsr()


@dataclass(frozen=True, eq=False)
class MeshGraph:
    """What :func:`of_mesh` reads off the faces.

    Attributes
    ----------
    graph : Graph
        With weights of 1.
    odd : (k,) int64
        Where in ``graph.indices`` the edges stand that have not two faces, rising.
    odd_faces : (k,) int32
        How many these have.
    corner_count : (n,) int32
        Diagonal of 9 C^T C: the faces at each vertex (a face with two of its corners there counts four times).
    """

    graph: Graph
    odd: npt.NDArray[np.int64]
    odd_faces: Integers
    corner_count: Integers

    def ends(self) -> Integers:
        """(e, 2) int32 ends of each edge once, smaller index first, sorted."""
        return self._once(np.arange(len(self.graph.indices)))

    def boundary(self) -> Integers:
        """(b, 2) int32 ends of each edge that has one face only."""
        return self._once(self.odd[self.odd_faces == 1])

    def ends_of_odd(self) -> tuple[Integers, Integers]:
        """(k,) int32 from and to, both directions of all edges that have not two faces."""
        return self._ends_at(self.odd)

    def _once(self, at: npt.NDArray[np.int64]) -> Integers:
        start, end = self._ends_at(at)
        return np.stack([start, end], axis=1)[start < end]

    def _ends_at(self, at: npt.NDArray[np.int64]) -> tuple[Integers, Integers]:
        row = np.searchsorted(self.graph.indptr, at, side="right") - 1
        return row.astype(np.int32), self.graph.indices[at]


def of_mesh(F: Integers, n: int) -> MeshGraph:
    """The graph of the mesh's edges.

    Parameters
    ----------
    F : (m, 3) int32
        Every vertex must be an end of a side that joins two different ones.
    n : int
        Number of vertices.
    """
    indptr, indices, odd, odd_faces, corner_count = _best_neighbors(n)(F, n)
    if corner_count.sum() < F.size:
        # a face with a side from a vertex to itself has two corners there, which count four times, and one side leaves
        for k in range(3):
            np.add.at(corner_count, F[F[:, k] == F[:, k - 1], k], 3)
    degree = np.diff(indptr).astype(np.float64)[:, None]
    return MeshGraph(Graph(indptr, indices, None, degree), odd, odd_faces, corner_count)


def neighbors(F: Integers, n: int) -> Neighbors:
    """What the compiled :func:`meshlab_specsmooth.graph.counting.neighbors` returns: the reference, by conversion."""
    start, end = F.ravel(), F[:, [1, 2, 0]].ravel()
    side = start != end
    start, end = start[side], end[side]
    leaving = np.bincount(start, minlength=n).astype(np.int32)
    # duplicates are added up, so the data count faces
    there = coo_array((np.ones(len(start), dtype=np.int32), (start, end)), shape=(n, n)).tocsr()
    there.sum_duplicates()  # and sorts, without which the sum would take five times as long
    both = there + there.T.tocsr()
    odd = np.flatnonzero(both.data != 2)
    indptr, indices = (x.astype(np.int32, copy=False) for x in (both.indptr, both.indices))
    return indptr, indices, odd, both.data[odd], leaving


def _best_neighbors(n: int) -> Callable[[Integers, int], Neighbors]:
    """For n vertices; the compiled one where the extra ``fast`` is installed."""
    if not backend.is_compiled(n):
        return neighbors
    from meshlab_specsmooth.graph import counting

    return counting.neighbors


def weighted(n: int, ends: Integers, weight: Floats) -> Graph:
    """The graph with the given edges, each once, and their positive weights; every vertex must have an edge."""
    W = coo_array((weight, (ends[:, 0], ends[:, 1])), shape=(n, n)).tocsr()
    W = (W + W.T.tocsr()).tocsr()
    W.sort_indices()
    return Graph(W.indptr, W.indices, W.data, np.asarray(W.sum(axis=1))[:, None])

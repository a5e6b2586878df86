"""Data types for graphs of vertices."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.sparse import coo_array, csr_array, diags_array

from meshlab_specsmooth.arrays import Floats, Integers


@dataclass(frozen=True, eq=False)
class Graph:
    """An undirected graph without loops, each edge stored in both directions.

    Attributes
    ----------
    indptr : (n + 1,) int32
        Where each vertex' neighbors start in ``indices``.
    indices : (2 e,) int32
        The neighbors, ascending for each vertex.
    weights : (2 e,) float64 or None
        Positive and symmetric; None where every edge weighs 1, so that kernels need not read them.
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
        """(n, n) matrix of the weights, or of other values, one for each direction of an edge."""
        if values is None:
            values = np.ones(len(self.indices)) if self.weights is None else self.weights
        return csr_array((values, self.indices, self.indptr), shape=(self.size, self.size))

    def symmetric_laplacian(self) -> csr_array:
        """S = I - D^-1/2 W D^-1/2, symmetric to the bit, for eigensolvers, which need a matrix."""
        W = self.adjacency()
        root = 1 / np.sqrt(self.degree[:, 0])
        # w_ij times (r_i r_j): the product of the roots is the same number for both directions
        W = W.tocoo()
        values = W.data * (root[W.row] * root[W.col])
        S = diags_array(np.ones(self.size)) - coo_array((values, (W.row, W.col)), shape=W.shape)
        return S.tocsr()


class Adjacency(NamedTuple):
    """The neighbors of every vertex of a mesh, and the faces of its edges.

    Attributes
    ----------
    indptr : (n + 1,) int32
    indices : (2 e,) int32
        Ascending for each vertex.
    irregular : (k,) int64
        Positions in ``indices`` of the edges that do not have exactly two faces, ascending.
    irregular_face_count : (k,) int32
        Number of faces of each of these edges.
    halfedge_count : (n,) int32
        Halfedges that leave each vertex.
    """

    indptr: Integers
    indices: Integers
    irregular: npt.NDArray[np.int64]
    irregular_face_count: Integers
    halfedge_count: Integers


@dataclass(frozen=True, eq=False)
class MeshGraph:
    """The graph of a mesh's edges, with the number of faces of each.

    Attributes
    ----------
    graph : Graph
        With weights of 1.
    irregular : (k,) int64
        Positions in ``graph.indices`` of the edges that do not have exactly two faces, ascending.
    irregular_face_count : (k,) int32
        Number of faces of each of these edges.
    corner_count : (n,) int32
        Diagonal of 9 C^T C: the faces at each vertex (a face with two of its corners there counts four times).
    """

    graph: Graph
    irregular: npt.NDArray[np.int64]
    irregular_face_count: Integers
    corner_count: Integers

    def ends(self) -> Integers:
        """(e, 2) int32 ends of each edge once, smaller index first, sorted."""
        return self._once(np.arange(len(self.graph.indices)))

    def boundary(self) -> Integers:
        """(b, 2) int32 ends of each edge that has a single face."""
        return self._once(self.irregular[self.irregular_face_count == 1])

    def irregular_ends(self) -> tuple[Integers, Integers]:
        """(k,) int32 first and second ends of the irregular edges, in both directions."""
        return self._ends_at(self.irregular)

    def _once(self, at: npt.NDArray[np.int64]) -> Integers:
        start, end = self._ends_at(at)
        return np.stack([start, end], axis=1)[start < end]

    def _ends_at(self, at: npt.NDArray[np.int64]) -> tuple[Integers, Integers]:
        row = np.searchsorted(self.graph.indptr, at, side="right") - 1
        return row.astype(np.int32), self.graph.indices[at]

"""The Laplacian L (paper, eq. 1-2) of a graph, as a matrix-free operator."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from meshlab_specsmooth.arrays import Floats, Integers
from meshlab_specsmooth.graph import backend
from meshlab_specsmooth.graph.adjacency import Graph
from meshlab_specsmooth.graph.protocols import COLUMNS, VertexKernels
from meshlab_specsmooth.runtime import blocks


@dataclass(frozen=True, eq=False)
class Laplacian:
    """L = I - P, with P = D^-1 W the mean over the neighbors and D the row sums of the weights W.

    L is not symmetric. S = D^1/2 L D^-1/2 is symmetric and has the same eigenvalues, all in [0, 2], and every function
    satisfies h(L) = D^-1/2 h(S) D^1/2. So polynomials of L are evaluated directly, while projections and inner products
    use S or, equivalently, weights D.

    Attributes
    ----------
    graph : Graph
    kernels : VertexKernels
        The implementation of the products.
    """

    graph: Graph
    kernels: VertexKernels

    @property
    def size(self) -> int:
        """Number of vertices."""
        return self.graph.size

    @property
    def degree(self) -> Floats:
        """(n, 1) diagonal of D."""
        return self.graph.degree

    def step(
        self,
        X: Floats,
        now: Floats,
        before: Floats,
        *,
        factor: float = 2.0,
        coefficient: float = 0.0,
        free: Floats | None = None,
    ) -> None:
        """``before`` becomes coefficient X + factor free (L - I) now - before: Chebyshev's recurrence, in place.

        Parameters
        ----------
        X, now, before : (n, 3) float64, C order
        free : (n, 1) float64, optional
            1 at the vertices that L is restricted to, where X, ``now`` and ``before`` vanish at all others; 0 there.
        """
        work = self.kernels.chebyshev_step
        blocks.parallel_for(lambda first, last: work(first, last, X, now, before, factor, coefficient, free), len(X))

    def __matmul__(self, X: Floats) -> Floats:
        """L X for X of shape (n, k): each row minus the weighted mean of its neighbors."""
        return by_column_blocks(lambda block: self.product(block, np.empty_like(block)), X)

    def inner_products(self, X: Floats, Y: Floats) -> tuple[float, float]:
        """The sums over columns of x^T D x and x^T D y, for X and Y of shape (n, 3)."""
        sums, work = np.empty((blocks.count(self.size), 2)), self.kernels.inner_products
        blocks.parallel_for(lambda first, last: work(first, last, X, Y, sums), self.size)
        square, product = sums.sum(axis=0)
        return float(square), float(product)

    def mean_edge_length(self, X: Floats) -> float:
        """Mean edge length of the graph with vertices at X, (n, 3)."""
        sums, work = np.empty((blocks.count(self.size), 1)), self.kernels.edge_lengths
        blocks.parallel_for(lambda first, last: work(first, last, X, sums), self.size)
        return float(sums.sum()) / max(1, len(self.graph.indices))

    def product(self, X: Floats, out: Floats) -> Floats:
        """Write L X, (n, 3), to ``out``."""
        out.fill(0.0)
        self.step(X, X, out, factor=1.0, coefficient=1.0)
        return out

    def sums_of_squares(self, v: Floats) -> Floats:
        """(n, 1) sums of w_ij^2 v_j over each vertex' neighbors j, for v of shape (n, 1)."""
        sums, work = np.empty_like(v), self.kernels.sum_squared_weights
        blocks.parallel_for(lambda first, last: work(first, last, v, sums), self.size)
        return sums


def laplacian(graph: Graph) -> Laplacian:
    """The Laplacian of a graph, with the fastest kernels available."""
    return Laplacian(graph, backend.select(graph.size).vertex_kernels(graph))


def neighbors_of(L: Laplacian, vertices: npt.NDArray[np.integer]) -> tuple[npt.NDArray[np.int64], Integers]:
    """All neighbors of some vertices: the row in ``vertices`` whose neighbor each is, and the neighbor."""
    first = L.graph.indptr
    degree = first[np.asarray(vertices) + 1] - first[vertices]
    begin = np.cumsum(degree) - degree
    entries = np.repeat(first[vertices] - begin, degree) + np.arange(degree.sum())
    return np.repeat(np.arange(len(vertices)), degree), L.graph.indices[entries]


def spread_highest(L: Laplacian, values: Floats, rings: int = 1) -> Floats:
    """(n,) the highest of the values, (n,), within some rings of each vertex; every vertex has a neighbor."""
    first = L.graph.indptr[:-1].astype(np.intp)
    for _ in range(rings):
        values = np.maximum(values, np.maximum.reduceat(values[L.graph.indices], first))
    return values


def by_column_blocks(work: Callable[[Floats], Floats], X: Floats) -> Floats:
    """Apply a three-column kernel to any number of columns."""
    k = X.shape[1]
    if k == COLUMNS:
        return work(np.ascontiguousarray(X, dtype=np.float64))
    padded = np.pad(X, ((0, 0), (0, -k % COLUMNS)))
    parts = [work(np.ascontiguousarray(padded[:, i : i + COLUMNS], dtype=np.float64)) for i in range(0, k, COLUMNS)]
    return np.hstack([*parts, np.empty((len(X), 0))])[:, :k]

"""The Laplacian L (paper, eq. 1-2) of a graph, as an operator: no matrix is formed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from meshlab_specsmooth.arrays import Floats
from meshlab_specsmooth.graph import kernels
from meshlab_specsmooth.graph.build import Graph
from meshlab_specsmooth.graph.kernels import COLUMNS, Kernels
from meshlab_specsmooth.runtime import blocks


@dataclass(frozen=True, eq=False)
class Laplacian:
    """L = I - P, P = D^-1 W the walk to the neighbors, D the row sums of the weights W.

    L is not symmetric; its twin S = D^1/2 L D^-1/2 is, has the same eigenvalues, all inside [0, 2], and for every
    function h(L) = D^-1/2 h(S) D^1/2. So polynomials of L are summed as they stand, while whatever projects or takes
    inner products does it with S, or weighs by D, which is the same.

    Attributes
    ----------
    graph : Graph
    kernels : Kernels
        How its sweeps are done.
    """

    graph: Graph
    kernels: Kernels

    @property
    def size(self) -> int:
        """Number of vertices."""
        return self.graph.size

    @property
    def degree(self) -> Floats:
        """(n, 1) diagonal of D."""
        return self.graph.degree

    def step(self, X: Floats, now: Floats, before: Floats, *, factor: float = 2.0, share: float = 0.0) -> None:
        """``before`` becomes share X + factor (L - I) now - before: Chebyshev's recurrence, in place.

        Parameters
        ----------
        X, now, before : (n, 3) float64, C order
        """
        work = self.kernels.step
        blocks.in_threads(lambda first, last: work(first, last, X, now, before, factor, share), len(X))

    def __matmul__(self, X: Floats) -> Floats:
        """L X for X of shape (n, k): each row less the weighted mean of its neighbors."""
        return in_threes(lambda three: self.product(three, np.empty_like(three)), X)

    def inner_products(self, X: Floats, Y: Floats) -> tuple[float, float]:
        """The sums over columns of x^T D x and x^T D y, for X and Y of shape (n, 3)."""
        sums, work = np.empty((blocks.count(self.size), 2)), self.kernels.inner_products
        blocks.in_threads(lambda first, last: work(first, last, X, Y, sums), self.size)
        square, product = sums.sum(axis=0)
        return float(square), float(product)

    def mean_edge_length(self, X: Floats) -> float:
        """Mean distance between the ends of the edges, when the vertices are at X, (n, 3)."""
        sums, work = np.empty((blocks.count(self.size), 1)), self.kernels.edge_lengths
        blocks.in_threads(lambda first, last: work(first, last, X, sums), self.size)
        return float(sums.sum()) / max(1, len(self.graph.indices))

    def product(self, X: Floats, out: Floats) -> Floats:
        """L X, (n, 3), written over ``out``."""
        out.fill(0.0)
        self.step(X, X, out, factor=1.0, share=1.0)
        return out

    def sums_of_squares(self, v: Floats) -> Floats:
        """(n, 1) sums of w_ij^2 v_j over each vertex' neighbors j, for v of shape (n, 1)."""
        sums, work = np.empty_like(v), self.kernels.squares
        blocks.in_threads(lambda first, last: work(first, last, v, sums), self.size)
        return sums


def laplacian(graph: Graph) -> Laplacian:
    """The Laplacian of a graph, with the fastest kernels that there are."""
    return Laplacian(graph, kernels.best(graph))


def in_threes(work: Callable[[Floats], Floats], X: Floats) -> Floats:
    """Do work that takes three columns for any number of them."""
    k = X.shape[1]
    if k == COLUMNS:
        return work(np.ascontiguousarray(X, dtype=np.float64))
    padded = np.pad(X, ((0, 0), (0, -k % COLUMNS)))
    parts = [work(np.ascontiguousarray(padded[:, i : i + COLUMNS], dtype=np.float64)) for i in range(0, k, COLUMNS)]
    return np.hstack([*parts, np.empty((len(X), 0))])[:, :k]

"""Vertex kernels with scipy's sparse products and numpy: the reference, and the fallback without the extra ``fast``."""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_array

from meshlab_specsmooth.arrays import Floats
from meshlab_specsmooth.graph.adjacency import Graph
from meshlab_specsmooth.runtime import blocks


class ScipyVertexKernels:
    """See :class:`meshlab_specsmooth.graph.protocols.VertexKernels`."""

    name = "scipy"

    def __init__(self, graph: Graph) -> None:
        self.degree = graph.degree
        self.graph = graph
        values = np.repeat(1 / graph.degree[:, 0], np.diff(graph.indptr))
        if graph.weights is not None:
            values *= graph.weights
        # one matrix for each block of rows; all of them share the arrays of the whole
        self.walk = _by_blocks(graph.adjacency(values))
        self.neighbors = None if graph.weights is None else _by_blocks(graph.adjacency(np.ones(len(values))))
        self.squared = None if graph.weights is None else _by_blocks(graph.adjacency(graph.weights**2))

    def chebyshev_step(
        self,
        first: int,
        last: int,
        X: Floats,
        now: Floats,
        before: Floats,
        factor: float,
        coefficient: float,
        free: Floats | None,
    ) -> None:
        for i, rows in self._blocks(first, last):
            t = self.walk[i] @ now
            t *= -factor
            if free is not None:
                t *= free[rows]
            t -= before[rows]
            if coefficient:
                t += coefficient * X[rows]
            before[rows] = t

    def normal_matvec_1(
        self, first: int, last: int, p: Floats, rows: Floats | None, edge_coefficient: float, z: Floats
    ) -> None:
        for i, at in self._blocks(first, last):
            y = p[at] - self.walk[i] @ p
            y /= self.degree[at]
            if rows is not None:
                y *= rows[at]
            z[at] = y if self.neighbors is not None else edge_coefficient * p[at] - y

    def normal_matvec_2(
        self,
        first: int,
        last: int,
        p: Floats,
        z: Floats,
        free: Floats | None,
        edge_coefficient: float,
        gram_diagonal: Floats,
        q: Floats,
        sums: Floats,
    ) -> None:
        for i, at in self._blocks(first, last):
            t = self.walk[i] @ z
            if self.neighbors is None:
                t += edge_coefficient * p[at] - z[at]
                t *= self.degree[at]
            else:
                t = self.degree[at] * (z[at] - t) + edge_coefficient * (self.neighbors[i] @ p)
            t += gram_diagonal[at] * p[at]
            if free is not None:
                t *= free[at]
            q[at] = t / self.degree[at]
            sums[i] = np.einsum("ij,ij->", t, p[at])

    def update_solution(
        self, first: int, last: int, alpha: float, p: Floats, q: Floats, x: Floats, r: Floats, sums: Floats
    ) -> None:
        for i, at in self._blocks(first, last):
            x[at] += alpha * p[at]
            r[at] -= alpha * q[at]
            # not with BLAS, whose sums depend on its number of threads
            d = self.degree[at, 0]
            sums[i] = np.einsum("i,ij,ij->", d, x[at], x[at]), np.einsum("i,ij,ij->", d, r[at], r[at])

    def update_direction(self, first: int, last: int, beta: float, z: Floats, p: Floats) -> None:
        for _, at in self._blocks(first, last):
            p[at] *= beta
            p[at] += z[at]

    def sum_squared_weights(self, first: int, last: int, v: Floats, sums: Floats) -> None:
        for i, at in self._blocks(first, last):
            sums[at] = self.degree[at] * (self.walk[i] @ v) if self.squared is None else self.squared[i] @ v

    def inner_products(self, first: int, last: int, X: Floats, Y: Floats, sums: Floats) -> None:
        for i, at in self._blocks(first, last):
            weighted = self.degree[at] * X[at]
            # not with BLAS, whose sums depend on its number of threads
            sums[i] = np.einsum("ij,ij->", weighted, X[at]), np.einsum("ij,ij->", weighted, Y[at])

    def edge_lengths(self, first: int, last: int, X: Floats, sums: Floats) -> None:
        for i, at in self._blocks(first, last):
            start, *_, end = self.graph.indptr[at.start : at.stop + 1]
            apart = X[self.graph.indices[start:end]]
            apart -= np.repeat(X[at], np.diff(self.graph.indptr[at.start : at.stop + 1]), axis=0)
            sums[i] = np.sqrt(np.einsum("ij,ij->i", apart, apart)).sum()

    def _blocks(self, first: int, last: int) -> list[tuple[int, slice]]:
        return [(i, slice(i * blocks.ROWS, min((i + 1) * blocks.ROWS, len(self.degree)))) for i in range(first, last)]


def _by_blocks(M: csr_array) -> list[csr_array]:
    parts = []
    for low in range(0, M.shape[0], blocks.ROWS):
        high = min(low + blocks.ROWS, M.shape[0])
        start, end = M.indptr[low], M.indptr[high]
        part = (M.data[start:end], M.indices[start:end], M.indptr[low : high + 1] - start)
        parts.append(csr_array(part, shape=(high - low, M.shape[1])))
    return parts

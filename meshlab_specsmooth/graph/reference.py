"""Sweeps by scipy's sparse product and numpy: the reference, and what there is without the extra ``fast``."""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_array

from meshlab_specsmooth.arrays import Floats
from meshlab_specsmooth.graph.build import Graph
from meshlab_specsmooth.runtime import blocks


class ReferenceKernels:
    """See :class:`meshlab_specsmooth.graph.kernels.Kernels`."""

    name = "scipy"

    def __init__(self, graph: Graph) -> None:
        self.degree = graph.degree
        self.graph = graph
        share = np.repeat(1 / graph.degree[:, 0], np.diff(graph.indptr))
        if graph.weights is not None:
            share *= graph.weights
        # one matrix for each block of rows, which share the arrays of the whole
        self.walk = _by_blocks(graph.adjacency(share))
        self.neighbors = None if graph.weights is None else _by_blocks(graph.adjacency(np.ones(len(share))))
        self.squared = None if graph.weights is None else _by_blocks(graph.adjacency(graph.weights**2))

    def step(  # noqa: D102 (the protocol says it)
        self, first: int, last: int, X: Floats, now: Floats, before: Floats, factor: float, share: float
    ) -> None:
        for i, rows in self._blocks(first, last):
            t = self.walk[i] @ now
            t *= -factor
            t -= before[rows]
            if share:
                t += share * X[rows]
            before[rows] = t

    def differ(  # noqa: D102
        self, first: int, last: int, p: Floats, rows: Floats | None, kappa: float, z: Floats
    ) -> None:
        for i, at in self._blocks(first, last):
            y = p[at] - self.walk[i] @ p
            y /= self.degree[at]
            if rows is not None:
                y *= rows[at]
            z[at] = y if self.neighbors is not None else kappa * p[at] - y

    def gather(  # noqa: D102
        self,
        first: int,
        last: int,
        p: Floats,
        z: Floats,
        free: Floats | None,
        kappa: float,
        gram: Floats,
        q: Floats,
        sums: Floats,
    ) -> None:
        for i, at in self._blocks(first, last):
            t = self.walk[i] @ z
            if self.neighbors is None:
                t += kappa * p[at] - z[at]
                t *= self.degree[at]
            else:
                t = self.degree[at] * (z[at] - t) + kappa * (self.neighbors[i] @ p)
            t += gram[at] * p[at]
            if free is not None:
                t *= free[at]
            q[at] = t
            t *= p[at]
            sums[i] = blocks.reduced(np.add, t)

    def descend(  # noqa: D102
        self, first: int, last: int, step: Floats, q: Floats, m: Floats, r: Floats, sums: Floats
    ) -> None:
        steps = _in_rows(step)
        for i, at in self._blocks(first, last):
            t = r[at]
            t -= steps[: len(t)] * q[at]
            squares = t * t
            sums[i, :3] = blocks.reduced(np.add, squares)
            squares *= m[at]
            sums[i, 3:] = blocks.reduced(np.add, squares)

    def turn(  # noqa: D102
        self, first: int, last: int, step: Floats, turn: Floats, m: Floats, r: Floats, x: Floats, p: Floats
    ) -> None:
        steps, turns = _in_rows(step), _in_rows(turn)
        for _, at in self._blocks(first, last):
            t = p[at]
            x[at] += steps[: len(t)] * t
            t *= turns[: len(t)]
            t += m[at] * r[at]

    def squares(self, first: int, last: int, v: Floats, sums: Floats) -> None:  # noqa: D102
        for i, at in self._blocks(first, last):
            sums[at] = self.degree[at] * (self.walk[i] @ v) if self.squared is None else self.squared[i] @ v

    def inner_products(self, first: int, last: int, X: Floats, Y: Floats, sums: Floats) -> None:  # noqa: D102
        for i, at in self._blocks(first, last):
            weighted = self.degree[at] * X[at]
            # not by BLAS, whose threads show in its sums
            sums[i] = np.einsum("ij,ij->", weighted, X[at]), np.einsum("ij,ij->", weighted, Y[at])

    def edge_lengths(self, first: int, last: int, X: Floats, sums: Floats) -> None:  # noqa: D102
        for i, at in self._blocks(first, last):
            start, *_, end = self.graph.indptr[at.start : at.stop + 1]
            apart = X[self.graph.indices[start:end]]
            apart -= np.repeat(X[at], np.diff(self.graph.indptr[at.start : at.stop + 1]), axis=0)
            sums[i] = np.sqrt(np.einsum("ij,ij->i", apart, apart)).sum()

    def _blocks(self, first: int, last: int) -> list[tuple[int, slice]]:
        return [(i, slice(i * blocks.ROWS, min((i + 1) * blocks.ROWS, len(self.degree)))) for i in range(first, last)]


def _in_rows(factors: Floats) -> Floats:
    """A block whose rows are these three: numpy takes four times as long to multiply by one such row."""
    return np.tile(factors, (blocks.ROWS, 1))


def _by_blocks(M: csr_array) -> list[csr_array]:
    parts = []
    for low in range(0, M.shape[0], blocks.ROWS):
        high = min(low + blocks.ROWS, M.shape[0])
        start, end = M.indptr[low], M.indptr[high]
        part = (M.data[start:end], M.indices[start:end], M.indptr[low : high + 1] - start)
        parts.append(csr_array(part, shape=(high - low, M.shape[1])))
    return parts

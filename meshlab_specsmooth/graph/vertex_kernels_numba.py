"""Vertex kernels compiled with numba (the extra ``fast``): one pass each, reading only indices if all weights are 1."""

from __future__ import annotations

import numpy as np

from meshlab_specsmooth.arrays import Floats
from meshlab_specsmooth.graph import vertex_loops_numba as loops
from meshlab_specsmooth.graph.adjacency import Graph
from meshlab_specsmooth.runtime import blocks


class NumbaVertexKernels:
    """See :class:`meshlab_specsmooth.graph.protocols.VertexKernels`."""

    name = "numba"

    def __init__(self, graph: Graph) -> None:
        self.graph = (graph.indptr.view(np.uint32), graph.indices.view(np.uint32), graph.weights)
        self.degree = graph.degree[:, 0]
        self.size = graph.size

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
        low, high = self._rows(first, last)
        loops.chebyshev_step(low, high, *self.graph, self.degree, X, now, before, factor, coefficient, _flat(free))

    def normal_matvec_1(
        self, first: int, last: int, p: Floats, rows: Floats | None, edge_coefficient: float, z: Floats
    ) -> None:
        low, high = self._rows(first, last)
        loops.normal_matvec_1(low, high, *self.graph, self.degree, p, _flat(rows), edge_coefficient, z)

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
        for i in range(first, last):
            low, high = self._rows(i, i + 1)
            sums[i] = loops.normal_matvec_2(
                low, high, *self.graph, self.degree, p, z, _flat(free), edge_coefficient, gram_diagonal[:, 0], q
            )

    def update_solution(
        self, first: int, last: int, alpha: float, p: Floats, q: Floats, x: Floats, r: Floats, sums: Floats
    ) -> None:
        for i in range(first, last):
            sums[i] = loops.update_solution(*self._rows(i, i + 1), self.degree, alpha, p, q, x, r)

    def update_direction(self, first: int, last: int, beta: float, z: Floats, p: Floats) -> None:
        loops.update_direction(*self._rows(first, last), beta, z, p)

    def sum_squared_weights(self, first: int, last: int, v: Floats, sums: Floats) -> None:
        loops.sum_squared_weights(*self._rows(first, last), *self.graph, v[:, 0], sums[:, 0])

    def inner_products(self, first: int, last: int, X: Floats, Y: Floats, sums: Floats) -> None:
        for i in range(first, last):
            sums[i] = loops.inner_products(*self._rows(i, i + 1), self.degree, X, Y)

    def edge_lengths(self, first: int, last: int, X: Floats, sums: Floats) -> None:
        for i in range(first, last):
            sums[i] = loops.edge_lengths(*self._rows(i, i + 1), *self.graph[:2], X)

    def _rows(self, first: int, last: int) -> tuple[int, int]:
        return first * blocks.ROWS, min(last * blocks.ROWS, self.size)


def _flat(column: Floats | None) -> Floats | None:
    return None if column is None else column[:, 0]

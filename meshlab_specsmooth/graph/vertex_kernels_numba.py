"""Vertex kernels compiled with numba (the extra ``fast``): one pass each, reading only indices if all weights are 1.

Compiled at first use and cached on disk. Indices are unsigned, as signed ones are tested for wrap-around.
"""

from __future__ import annotations

import functools

import numba
import numpy as np

from meshlab_specsmooth.arrays import Floats
from meshlab_specsmooth.graph.adjacency import Graph
from meshlab_specsmooth.graph.row_sums_numba import UNROLLED, sum_first_rows
from meshlab_specsmooth.runtime import backend, blocks

# sums may be reordered and contracted to fused multiply-adds; NaN and infinity keep their meaning
_compiled = functools.partial(numba.njit, nogil=True, cache=backend.CAN_CACHE, fastmath={"reassoc", "contract"})
_inlined = functools.partial(numba.njit, inline="always")  # a call for each vertex would double the time


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
        _chebyshev_step(low, high, *self.graph, self.degree, X, now, before, factor, coefficient, _flat(free))

    def normal_matvec_1(
        self, first: int, last: int, p: Floats, rows: Floats | None, edge_coefficient: float, z: Floats
    ) -> None:
        low, high = self._rows(first, last)
        _normal_matvec_1(low, high, *self.graph, self.degree, p, _flat(rows), edge_coefficient, z)

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
            sums[i] = _normal_matvec_2(
                low, high, *self.graph, self.degree, p, z, _flat(free), edge_coefficient, gram_diagonal[:, 0], q
            )

    def update_solution(
        self, first: int, last: int, alpha: float, p: Floats, q: Floats, x: Floats, r: Floats, sums: Floats
    ) -> None:
        for i in range(first, last):
            sums[i] = _update_solution(*self._rows(i, i + 1), self.degree, alpha, p, q, x, r)

    def update_direction(self, first: int, last: int, beta: float, z: Floats, p: Floats) -> None:
        _update_direction(*self._rows(first, last), beta, z, p)

    def sum_squared_weights(self, first: int, last: int, v: Floats, sums: Floats) -> None:
        _sum_squared_weights(*self._rows(first, last), *self.graph, v[:, 0], sums[:, 0])

    def inner_products(self, first: int, last: int, X: Floats, Y: Floats, sums: Floats) -> None:
        for i in range(first, last):
            sums[i] = _inner_products(*self._rows(i, i + 1), self.degree, X, Y)

    def edge_lengths(self, first: int, last: int, X: Floats, sums: Floats) -> None:
        for i in range(first, last):
            sums[i] = _edge_lengths(*self._rows(i, i + 1), *self.graph[:2], X)

    def _rows(self, first: int, last: int) -> tuple[int, int]:
        return first * blocks.ROWS, min(last * blocks.ROWS, self.size)


def _flat(column: Floats | None) -> Floats | None:
    return None if column is None else column[:, 0]


@_inlined
def _degree(i, indptr, weights, degree):  # type: ignore[no-untyped-def]
    """The degree; the number of neighbors where all weights are 1, as that has been read already."""
    return np.float64(indptr[i + 1] - indptr[i]) if weights is None else degree[i]


@_inlined
def _sum_neighbors(i, indptr, indices, weights, X):  # type: ignore[no-untyped-def]
    """Sum w_ij X_j over the neighbors j of vertex i, for three columns."""
    k, end = indptr[i], indptr[i + 1]
    s0 = s1 = s2 = 0.0
    if weights is None:
        s0, s1, s2 = sum_first_rows(k, end - k, indices, X)
        k += np.uint32(UNROLLED)
        while k < end:
            j = indices[k]
            s0 += X[j, 0]
            s1 += X[j, 1]
            s2 += X[j, 2]
            k += np.uint32(1)
    else:
        while k < end:
            j = indices[k]
            w = weights[k]
            s0 += w * X[j, 0]
            s1 += w * X[j, 1]
            s2 += w * X[j, 2]
            k += np.uint32(1)
    return s0, s1, s2


@_compiled
def _chebyshev_step(low, high, indptr, indices, weights, degree, X, now, before, factor, c, free):  # type: ignore[no-untyped-def]
    for i in range(low, high):
        s0, s1, s2 = _sum_neighbors(i, indptr, indices, weights, now)
        f = -factor / _degree(i, indptr, weights, degree)
        if free is not None:
            f *= free[i]
        before[i, 0] = f * s0 - before[i, 0] + c * X[i, 0]
        before[i, 1] = f * s1 - before[i, 1] + c * X[i, 1]
        before[i, 2] = f * s2 - before[i, 2] + c * X[i, 2]


@_compiled
def _normal_matvec_1(low, high, indptr, indices, weights, degree, p, rows, edge, z):  # type: ignore[no-untyped-def]
    for i in range(low, high):
        s0, s1, s2 = _sum_neighbors(i, indptr, indices, weights, p)
        f = 1 / _degree(i, indptr, weights, degree)
        g = f if rows is None else rows[i] * f
        if weights is None:
            z[i, 0] = edge * p[i, 0] - g * (p[i, 0] - f * s0)
            z[i, 1] = edge * p[i, 1] - g * (p[i, 1] - f * s1)
            z[i, 2] = edge * p[i, 2] - g * (p[i, 2] - f * s2)
        else:
            z[i, 0] = g * (p[i, 0] - f * s0)
            z[i, 1] = g * (p[i, 1] - f * s1)
            z[i, 2] = g * (p[i, 2] - f * s2)


@_compiled
def _normal_matvec_2(low, high, indptr, indices, weights, degree, p, z, free, edge, gram, q):  # type: ignore[no-untyped-def]
    total = 0.0
    for i in range(low, high):
        s0, s1, s2 = _sum_neighbors(i, indptr, indices, weights, z)
        d = _degree(i, indptr, weights, degree)
        if weights is None:
            s0 += d * (edge * p[i, 0] - z[i, 0])
            s1 += d * (edge * p[i, 1] - z[i, 1])
            s2 += d * (edge * p[i, 2] - z[i, 2])
        else:
            t0, t1, t2 = _sum_neighbors(i, indptr, indices, None, p)
            s0 = d * z[i, 0] - s0 + edge * t0
            s1 = d * z[i, 1] - s1 + edge * t1
            s2 = d * z[i, 2] - s2 + edge * t2
        s0 += gram[i] * p[i, 0]
        s1 += gram[i] * p[i, 1]
        s2 += gram[i] * p[i, 2]
        if free is not None:
            s0 *= free[i]
            s1 *= free[i]
            s2 *= free[i]
        q[i, 0] = s0 / d
        q[i, 1] = s1 / d
        q[i, 2] = s2 / d
        total += p[i, 0] * s0 + p[i, 1] * s1 + p[i, 2] * s2
    return total


@_compiled
def _update_solution(low, high, degree, alpha, p, q, x, r):  # type: ignore[no-untyped-def]
    size = rest = 0.0
    for i in range(low, high):
        xx = rr = 0.0
        for k in range(3):
            s = x[i, k] + alpha * p[i, k]
            t = r[i, k] - alpha * q[i, k]
            x[i, k] = s
            r[i, k] = t
            xx += s * s
            rr += t * t
        size += degree[i] * xx
        rest += degree[i] * rr
    return size, rest


@_compiled
def _update_direction(low, high, beta, z, p):  # type: ignore[no-untyped-def]
    for i in range(low, high):
        for k in range(3):
            p[i, k] = z[i, k] + beta * p[i, k]


@_compiled
def _sum_squared_weights(low, high, indptr, indices, weights, v, sums):  # type: ignore[no-untyped-def]
    for i in range(low, high):
        total = 0.0
        for k in range(indptr[i], indptr[i + 1]):
            total += v[indices[k]] if weights is None else weights[k] ** 2 * v[indices[k]]
        sums[i] = total


@_compiled
def _inner_products(low, high, degree, X, Y):  # type: ignore[no-untyped-def]
    square = product = 0.0
    for i in range(low, high):
        square += degree[i] * (X[i, 0] * X[i, 0] + X[i, 1] * X[i, 1] + X[i, 2] * X[i, 2])
        product += degree[i] * (X[i, 0] * Y[i, 0] + X[i, 1] * Y[i, 1] + X[i, 2] * Y[i, 2])
    return square, product


@_compiled
def _edge_lengths(low, high, indptr, indices, X):  # type: ignore[no-untyped-def]
    total = 0.0
    for i in range(low, high):
        for k in range(indptr[i], indptr[i + 1]):
            j = indices[k]
            a = X[j, 0] - X[i, 0]
            b = X[j, 1] - X[i, 1]
            c = X[j, 2] - X[i, 2]
            total += np.sqrt(a * a + b * b + c * c)
    return total

"""The loops of the vertex kernels, compiled at first use and cached on disk by numba.

Indices are unsigned, as signed ones are tested for wrap-around. The sum over neighbors is written in LLVM's
instructions, which takes a third of the time off a sweep. Two things slow a compiled loop over neighbors down: the
number of neighbors differs from vertex to vertex, so that the processor predicts the end of every second loop wrongly,
and the three coordinates are added one by one. Here eight neighbors are read in any case, the first one in place of
those that a vertex does not have, which is subtracted again; and two coordinates are added by one instruction, which
every processor of 64 bits has.

The cache notices changes of this file only: what is compiled must not call compiled code of another one.
"""

from __future__ import annotations

import functools
from typing import Any

import numba
import numpy as np
from llvmlite import ir
from numba import types
from numba.extending import intrinsic

from meshlab_specsmooth.runtime import backend

# sums may be reordered and contracted to fused multiply-adds; NaN and infinity keep their meaning
_compiled = functools.partial(numba.njit, nogil=True, cache=backend.CAN_CACHE, fastmath={"reassoc", "contract"})
_inlined = functools.partial(numba.njit, inline="always")  # a call for each vertex would double the time


#: Neighbors that are added without a loop; nearly every vertex has no more.
UNROLLED = 8

# Every vertex has a neighbor.
_LEAST = 1

_INDEX, _LANE, _NUMBER = ir.IntType(64), ir.IntType(32), ir.DoubleType()
_PAIR = ir.VectorType(_NUMBER, 2)
_CONTRACT = ("contract",)  # to a fused multiply-add


@intrinsic  # type: ignore[untyped-decorator]
def sum_first_rows(typing: Any, k: Any, count: Any, indices: Any, X: Any) -> Any:
    """The sums of X[indices[k]], ..., at most :data:`UNROLLED` of the ``count`` rows, as three float64.

    Parameters
    ----------
    k, count : unsigned integer
        ``count`` is at least 1.
    indices : array of uint32
    X : (n, 3) array of float64, C order
    """
    del typing
    signature = types.UniTuple(types.float64, 3)(k, count, indices, X)
    return signature, _generate


def _generate(context: Any, builder: ir.IRBuilder, signature: Any, arguments: Any) -> Any:
    first, count = (_widen(builder, each) for each in arguments[:2])
    indices, rows = (
        context.make_array(kind)(context, builder, value).data
        for kind, value in zip(signature.args[2:], arguments[2:], strict=True)
    )

    def load(t: int) -> tuple[Any, Any]:
        """A pair and a number: the coordinates of the neighbor t, or of the first where there is none."""
        at = builder.add(first, _INDEX(t))
        if t >= _LEAST:
            at = builder.select(builder.icmp_unsigned(">", count, _INDEX(t)), at, first)
        row = builder.mul(_widen(builder, builder.load(builder.gep(indices, [at]))), _INDEX(3))
        pair = builder.load(builder.bitcast(builder.gep(rows, [row]), _PAIR.as_pointer()), align=8)
        return pair, builder.load(builder.gep(rows, [builder.add(row, _INDEX(2))]))

    terms = [load(t) for t in range(UNROLLED)]
    extra = terms[0]
    while len(terms) > 1:  # by pairs, so that additions do not wait for each other
        terms = [
            (builder.fadd(a[0], b[0]), builder.fadd(a[1], b[1])) for a, b in zip(terms[::2], terms[1::2], strict=True)
        ]
    missing = builder.select(
        builder.icmp_unsigned("<", count, _INDEX(UNROLLED)), builder.sub(_INDEX(UNROLLED), count), _INDEX(0)
    )
    times = builder.uitofp(missing, _NUMBER)
    twice = ir.Constant(_PAIR, ir.Undefined)
    for lane in range(2):
        twice = builder.insert_element(twice, times, _LANE(lane))
    pair = builder.fsub(terms[0][0], builder.fmul(extra[0], twice, flags=_CONTRACT), flags=_CONTRACT)
    third = builder.fsub(terms[0][1], builder.fmul(extra[1], times, flags=_CONTRACT), flags=_CONTRACT)
    sums = [*(builder.extract_element(pair, _LANE(lane)) for lane in range(2)), third]
    return context.make_tuple(builder, signature.return_type, sums)


def _widen(builder: ir.IRBuilder, value: Any) -> Any:
    return value if value.type.width == _INDEX.width else builder.zext(value, _INDEX)


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
def chebyshev_step(low, high, indptr, indices, weights, degree, X, now, before, factor, c, free):  # type: ignore[no-untyped-def]
    """See :meth:`meshlab_specsmooth.graph.protocols.VertexKernels.chebyshev_step`."""
    for i in range(low, high):
        s0, s1, s2 = _sum_neighbors(i, indptr, indices, weights, now)
        f = -factor / _degree(i, indptr, weights, degree)
        if free is not None:
            f *= free[i]
        before[i, 0] = f * s0 - before[i, 0] + c * X[i, 0]
        before[i, 1] = f * s1 - before[i, 1] + c * X[i, 1]
        before[i, 2] = f * s2 - before[i, 2] + c * X[i, 2]


@_compiled
def normal_matvec_1(low, high, indptr, indices, weights, degree, p, rows, edge, z):  # type: ignore[no-untyped-def]
    """See :meth:`meshlab_specsmooth.graph.protocols.VertexKernels.normal_matvec_1`."""
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
def normal_matvec_2(low, high, indptr, indices, weights, degree, p, z, free, edge, gram, q):  # type: ignore[no-untyped-def]
    """See :meth:`meshlab_specsmooth.graph.protocols.VertexKernels.normal_matvec_2`."""
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
def update_solution(low, high, degree, alpha, p, q, x, r):  # type: ignore[no-untyped-def]
    """See :meth:`meshlab_specsmooth.graph.protocols.VertexKernels.update_solution`."""
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
def update_direction(low, high, beta, z, p):  # type: ignore[no-untyped-def]
    """See :meth:`meshlab_specsmooth.graph.protocols.VertexKernels.update_direction`."""
    for i in range(low, high):
        for k in range(3):
            p[i, k] = z[i, k] + beta * p[i, k]


@_compiled
def sum_squared_weights(low, high, indptr, indices, weights, v, sums):  # type: ignore[no-untyped-def]
    """See :meth:`meshlab_specsmooth.graph.protocols.VertexKernels.sum_squared_weights`."""
    for i in range(low, high):
        total = 0.0
        for k in range(indptr[i], indptr[i + 1]):
            total += v[indices[k]] if weights is None else weights[k] ** 2 * v[indices[k]]
        sums[i] = total


@_compiled
def inner_products(low, high, degree, X, Y):  # type: ignore[no-untyped-def]
    """See :meth:`meshlab_specsmooth.graph.protocols.VertexKernels.inner_products`."""
    square = product = 0.0
    for i in range(low, high):
        square += degree[i] * (X[i, 0] * X[i, 0] + X[i, 1] * X[i, 1] + X[i, 2] * X[i, 2])
        product += degree[i] * (X[i, 0] * Y[i, 0] + X[i, 1] * Y[i, 1] + X[i, 2] * Y[i, 2])
    return square, product


@_compiled
def edge_lengths(low, high, indptr, indices, X):  # type: ignore[no-untyped-def]
    """See :meth:`meshlab_specsmooth.graph.protocols.VertexKernels.edge_lengths`."""
    total = 0.0
    for i in range(low, high):
        for k in range(indptr[i], indptr[i + 1]):
            j = indices[k]
            a = X[j, 0] - X[i, 0]
            b = X[j, 1] - X[i, 1]
            c = X[j, 2] - X[i, 2]
            total += np.sqrt(a * a + b * b + c * c)
    return total

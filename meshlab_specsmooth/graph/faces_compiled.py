"""The graph of faces and the sweeps over it, compiled by numba (the extra ``fast``)."""

from __future__ import annotations

import functools

import numba
import numpy as np

from meshlab_specsmooth.arrays import Floats, Integers
from meshlab_specsmooth.graph.faces import MOST_FACES_OF_A_VERTEX, FaceGraph
from meshlab_specsmooth.runtime import backend, blocks

_compiled = functools.partial(numba.njit, nogil=True, cache=backend.IS_KEPT)
_inlined = functools.partial(numba.njit, inline="always")
_fused = functools.partial(numba.njit, nogil=True, cache=backend.IS_KEPT, fastmath={"reassoc", "contract"})


def _over(rows: int):  # type: ignore[no-untyped-def]
    """Run ``work(low, high)`` over so many rows, in threads."""

    def run(work):  # type: ignore[no-untyped-def]
        blocks.in_threads(lambda a, b: work(a * blocks.ROWS, min(b * blocks.ROWS, rows)), rows)

    return run


def neighbors(corners: Integers, n: int) -> FaceGraph:
    """What :func:`meshlab_specsmooth.graph.faces.neighbors` makes."""
    m = len(corners)
    start = np.zeros(n + 1, dtype=np.int32)
    _count_corners(corners, start)
    np.cumsum(start, out=start)
    of_vertex = np.empty(start[-1], dtype=np.int32)
    _fill_corners(corners, start[:-1].copy(), of_vertex)
    indptr = np.zeros(m + 1, dtype=np.int32)
    nothing = np.empty(0, dtype=np.int32)
    over = _over(m)
    over(lambda low, high: _adjacent(low, high, corners, start, of_vertex, indptr, nothing, False))
    total = int(indptr.sum(dtype=np.int64))
    if total > np.iinfo(np.int32).max:
        raise MemoryError(f"{total} pairs of neighboring faces")
    np.cumsum(indptr, out=indptr)
    indices = np.empty(total, dtype=np.int32)
    over(lambda low, high: _adjacent(low, high, corners, start, of_vertex, indptr, indices, True))
    return FaceGraph(corners, indptr, indices, start, of_vertex)


class CompiledFaceKernels:
    """See :class:`meshlab_specsmooth.graph.faces.FaceKernels`."""

    name = "numba"

    def __init__(self, graph: FaceGraph) -> None:
        self.graph = graph
        self.sides = (graph.indptr.view(np.uint32), graph.indices.view(np.uint32))
        self.at = (graph.vertex_indptr.view(np.uint32), graph.vertex_faces.view(np.uint32))
        self.corners = graph.corners.view(np.uint32)

    def weigh(  # noqa: D102 (the protocol says it)
        self, center: Floats, normal: Floats, root: Floats, near: float, alike: float
    ) -> tuple[Floats, Floats]:
        weight, degree = np.empty(len(self.graph.indices)), np.empty(self.graph.size)
        over = _over(self.graph.size)
        over(lambda low, high: _weigh(low, high, *self.sides, center, normal, root, near, alike, weight, degree))
        return weight, degree

    def frames(self, V: Floats) -> tuple[Floats, Floats, Floats]:  # noqa: D102
        m = self.graph.size
        center, normal, area = np.empty((m, 3)), np.empty((m, 3)), np.empty(m)
        _over(m)(lambda low, high: _frames(low, high, self.corners, V, center, normal, area))
        return center, normal, area

    def solve(  # noqa: D102
        self, weight: Floats, diagonal: Floats, t: float, B: Floats, X: Floats, tolerance: float, most: int
    ) -> Floats:
        m = self.graph.size
        X, R, P, Q = X.copy(), np.empty_like(X), np.empty_like(X), np.empty_like(X)
        sums = np.empty((blocks.count(m), 2))
        system = (*self.sides, weight, diagonal, t)

        def summed(work) -> Floats:  # type: ignore[no-untyped-def]
            """The sums of all blocks, added in order."""

            def run(first: int, last: int) -> None:
                for k in range(first, last):
                    work(k * blocks.ROWS, min((k + 1) * blocks.ROWS, m), sums[k])

            blocks.in_threads(run, m)
            return np.asarray(sums.sum(axis=0))

        rz, size = summed(lambda low, high, out: _begin(low, high, *system, B, X, R, P, out))
        for _ in range(most):
            if rz <= tolerance**2 * size:
                break
            step = rz / summed(lambda low, high, out: _multiply(low, high, *system, P, Q, out))[0]
            now = summed(lambda low, high, out, step=step: _descend(low, high, diagonal, step, P, Q, X, R, out))[0]
            _over(m)(lambda low, high, turn=now / rz: _turn(low, high, diagonal, turn, R, P))
            rz = now
        return X

    def fit(self, V: Floats, normal: Floats, pull: Floats, sweeps: int) -> Floats:  # noqa: D102
        V, moved = V.copy(), np.empty_like(V)
        drawn = np.empty((self.graph.size, 4))
        drawn[:, :3] = normal
        for _ in range(sweeps):
            _over(self.graph.size)(lambda low, high, V=V: _heights(low, high, self.corners, V, drawn))
            _over(len(V))(lambda low, high, V=V, moved=moved: _move(low, high, *self.at, drawn, pull, V, moved))
            V, moved = moved, V
        return V


@_compiled
def _count_corners(corners, start):  # type: ignore[no-untyped-def]
    for f in range(len(corners)):
        a, b, c = corners[f]
        start[a + 1] += 1
        if b != a:
            start[b + 1] += 1
        if c not in (a, b):
            start[c + 1] += 1


@_compiled
def _fill_corners(corners, place, of_vertex):  # type: ignore[no-untyped-def]
    for f in range(len(corners)):
        a, b, c = corners[f]
        of_vertex[place[a]] = f
        place[a] += 1
        if b != a:
            of_vertex[place[b]] = f
            place[b] += 1
        if c not in (a, b):
            of_vertex[place[c]] = f
            place[c] += 1


@_compiled
def _adjacent(low, high, corners, start, of_vertex, indptr, indices, fill):  # type: ignore[no-untyped-def]
    """The neighbors of faces: how many, one row further on, or with ``fill`` which."""
    found = np.empty(3 * MOST_FACES_OF_A_VERTEX, dtype=np.int32)
    for f in range(low, high):
        count = 0
        for k in range(3):
            v = corners[f, k]
            if start[v + 1] - start[v] > MOST_FACES_OF_A_VERTEX:
                continue
            for s in range(start[v], start[v + 1]):
                g = of_vertex[s]
                if g == f:
                    continue
                at = count
                while at > 0 and found[at - 1] > g:
                    at -= 1
                if at > 0 and found[at - 1] == g:
                    continue
                for q in range(count, at, -1):
                    found[q] = found[q - 1]
                found[at] = g
                count += 1
        if fill:
            for q in range(count):
                indices[indptr[f] + q] = found[q]
        else:
            indptr[f + 1] = count


@_fused
def _frames(low, high, corners, V, center, normal, area):  # type: ignore[no-untyped-def]
    for f in range(low, high):
        i, j, k = corners[f, 0], corners[f, 1], corners[f, 2]
        a, b, c = V[j, 0] - V[i, 0], V[j, 1] - V[i, 1], V[j, 2] - V[i, 2]
        d, e, g = V[k, 0] - V[i, 0], V[k, 1] - V[i, 1], V[k, 2] - V[i, 2]
        x, y, z = b * g - c * e, c * d - a * g, a * e - b * d
        size = np.sqrt(x * x + y * y + z * z)
        area[f] = size
        by = 1 / size if size > 0 else 0.0
        normal[f, 0], normal[f, 1], normal[f, 2] = x * by, y * by, z * by
        for q in range(3):
            center[f, q] = (V[i, q] + V[j, q] + V[k, q]) / 3


@_fused
def _weigh(low, high, indptr, indices, center, normal, root, near, alike, weight, degree):  # type: ignore[no-untyped-def]
    for i in range(low, high):
        total = 0.0
        for k in range(indptr[i], indptr[i + 1]):
            j = indices[k]
            a = center[i, 0] - center[j, 0]
            b = center[i, 1] - center[j, 1]
            c = center[i, 2] - center[j, 2]
            u = normal[i, 0] - normal[j, 0]
            v = normal[i, 1] - normal[j, 1]
            w = normal[i, 2] - normal[j, 2]
            y = max(1 - (near * (a * a + b * b + c * c) + alike * (u * u + v * v + w * w)) / 8, 0.0)
            y *= y
            y *= y
            value = root[i] * root[j] * (y * y)
            weight[k] = value
            total += value
        degree[i] = total


@_inlined
def _row(i, indptr, indices, weight, diagonal, t, X):  # type: ignore[no-untyped-def]
    """Row i of (diagonal - t W) X."""
    a = b = c = 0.0
    for k in range(indptr[i], indptr[i + 1]):
        j, w = indices[k], weight[k]
        a += w * X[j, 0]
        b += w * X[j, 1]
        c += w * X[j, 2]
    d = diagonal[i]
    return d * X[i, 0] - t * a, d * X[i, 1] - t * b, d * X[i, 2] - t * c


@_fused
def _begin(low, high, indptr, indices, weight, diagonal, t, B, X, R, P, sums):  # type: ignore[no-untyped-def]
    """R = B - M X, P = R / diagonal; the sums of R . P and of B . B / diagonal."""
    a = b = 0.0
    for i in range(low, high):
        x, y, z = _row(i, indptr, indices, weight, diagonal, t, X)
        x, y, z = B[i, 0] - x, B[i, 1] - y, B[i, 2] - z
        by = 1 / diagonal[i]
        R[i, 0], R[i, 1], R[i, 2] = x, y, z
        P[i, 0], P[i, 1], P[i, 2] = x * by, y * by, z * by
        a += (x * x + y * y + z * z) * by
        b += (B[i, 0] * B[i, 0] + B[i, 1] * B[i, 1] + B[i, 2] * B[i, 2]) * by
    sums[0], sums[1] = a, b


@_fused
def _multiply(low, high, indptr, indices, weight, diagonal, t, P, Q, sums):  # type: ignore[no-untyped-def]
    a = 0.0
    for i in range(low, high):
        x, y, z = _row(i, indptr, indices, weight, diagonal, t, P)
        Q[i, 0], Q[i, 1], Q[i, 2] = x, y, z
        a += x * P[i, 0] + y * P[i, 1] + z * P[i, 2]
    sums[0] = a


@_fused
def _descend(low, high, diagonal, step, P, Q, X, R, sums):  # type: ignore[no-untyped-def]
    """X += step P, R -= step Q; the sum of R . R / diagonal."""
    a = 0.0
    for i in range(low, high):
        X[i, 0] += step * P[i, 0]
        X[i, 1] += step * P[i, 1]
        X[i, 2] += step * P[i, 2]
        x, y, z = R[i, 0] - step * Q[i, 0], R[i, 1] - step * Q[i, 1], R[i, 2] - step * Q[i, 2]
        R[i, 0], R[i, 1], R[i, 2] = x, y, z
        a += (x * x + y * y + z * z) / diagonal[i]
    sums[0] = a


@_fused
def _turn(low, high, diagonal, turn, R, P):  # type: ignore[no-untyped-def]
    for i in range(low, high):
        by = 1 / diagonal[i]
        P[i, 0] = R[i, 0] * by + turn * P[i, 0]
        P[i, 1] = R[i, 1] * by + turn * P[i, 1]
        P[i, 2] = R[i, 2] * by + turn * P[i, 2]


@_fused
def _heights(low, high, corners, V, drawn):  # type: ignore[no-untyped-def]
    """Column 3 becomes n.c, columns 0 to 2 being n."""
    for f in range(low, high):
        a, b, c = corners[f, 0], corners[f, 1], corners[f, 2]
        drawn[f, 3] = (
            drawn[f, 0] * (V[a, 0] + V[b, 0] + V[c, 0])
            + drawn[f, 1] * (V[a, 1] + V[b, 1] + V[c, 1])
            + drawn[f, 2] * (V[a, 2] + V[b, 2] + V[c, 2])
        ) / 3


@_fused
def _move(low, high, indptr, indices, drawn, pull, V, moved):  # type: ignore[no-untyped-def]
    for i in range(low, high):
        x, y, z = V[i, 0], V[i, 1], V[i, 2]
        a = b = c = 0.0
        for k in range(indptr[i], indptr[i + 1]):
            f = indices[k]
            u, v, w = drawn[f, 0], drawn[f, 1], drawn[f, 2]
            off = drawn[f, 3] - (u * x + v * y + w * z)
            a += u * off
            b += v * off
            c += w * off
        moved[i, 0] = x + pull[i] * a
        moved[i, 1] = y + pull[i] * b
        moved[i, 2] = z + pull[i] * c

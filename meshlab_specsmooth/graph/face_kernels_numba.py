"""Face kernels compiled with numba (the extra ``fast``)."""

from __future__ import annotations

import functools

import numba
import numpy as np

from meshlab_specsmooth.arrays import Floats
from meshlab_specsmooth.graph.face_adjacency import FaceGraph
from meshlab_specsmooth.runtime import backend, blocks

_inlined = functools.partial(numba.njit, inline="always")
_fused = functools.partial(numba.njit, nogil=True, cache=backend.CAN_CACHE, fastmath={"reassoc", "contract"})


class NumbaFaceKernels:
    """See :class:`meshlab_specsmooth.graph.protocols.FaceKernels`."""

    name = "numba"

    def __init__(self, graph: FaceGraph) -> None:
        self.graph = graph
        self.neighbors = (graph.indptr.view(np.uint32), graph.indices.view(np.uint32))
        self.faces_at = (graph.vertex_indptr.view(np.uint32), graph.vertex_faces.view(np.uint32))
        self.corners = graph.corners.view(np.uint32)

    def face_geometry(self, V: Floats) -> tuple[Floats, Floats, Floats]:
        m = self.graph.size
        center, normal, area = np.empty((m, 3)), np.empty((m, 3)), np.empty(m)
        blocks.parallel_rows(lambda at: _face_geometry(at.start, at.stop, self.corners, V, center, normal, area), m)
        return center, normal, area

    def bilateral_weights(
        self, center: Floats, normal: Floats, root: Floats, inv_2sigma_s2: float, inv_2sigma_r2: float
    ) -> tuple[Floats, Floats]:
        weight, degree = np.empty(len(self.graph.indices)), np.empty(self.graph.size)
        geometry = (center, normal, root, inv_2sigma_s2, inv_2sigma_r2)

        def work(at: slice) -> None:
            _bilateral_weights(at.start, at.stop, *self.neighbors, *geometry, weight, degree)

        blocks.parallel_rows(work, self.graph.size)
        return weight, degree

    def solve(
        self, weight: Floats, diagonal: Floats, t: float, B: Floats, X: Floats, tolerance: float, max_iterations: int
    ) -> Floats:
        m = self.graph.size
        X, R, P, Q = X.copy(), np.empty_like(X), np.empty_like(X), np.empty_like(X)
        sums = np.empty((blocks.count(m), 2))
        system = (*self.neighbors, weight, diagonal, t)

        def sum_blocks(work) -> Floats:  # type: ignore[no-untyped-def]
            """Add up the sums of all blocks, in order."""

            def run(first: int, last: int) -> None:
                for k in range(first, last):
                    at = blocks.rows(k, m)
                    work(at.start, at.stop, sums[k])

            blocks.parallel_for(run, m)
            return np.asarray(sums.sum(axis=0))

        def update_residual(alpha: float) -> float:
            step = (diagonal, alpha, P, Q, X, R)
            return float(sum_blocks(lambda low, high, out: _update_residual(low, high, *step, out))[0])

        def update_direction(beta: float) -> None:
            blocks.parallel_rows(lambda at: _update_direction(at.start, at.stop, diagonal, beta, R, P), m)

        rz, bz = sum_blocks(lambda low, high, out: _first_residual(low, high, *system, B, X, R, P, out))
        for _ in range(max_iterations):
            if rz <= tolerance**2 * bz:
                break
            pAp = sum_blocks(lambda low, high, out: _multiply(low, high, *system, P, Q, out))[0]
            rz_next = update_residual(rz / pAp)
            update_direction(rz_next / rz)
            rz = rz_next
        return X

    def update_vertices(self, V: Floats, normal: Floats, step_size: Floats, sweeps: int) -> Floats:
        V, moved = V.copy(), np.empty_like(V)
        planes = np.empty((self.graph.size, 4))
        planes[:, :3] = normal

        def sweep(V: Floats, moved: Floats) -> None:
            blocks.parallel_rows(lambda at: _plane_offsets(at.start, at.stop, self.corners, V, planes), len(planes))
            blocks.parallel_rows(
                lambda at: _move_vertices(at.start, at.stop, *self.faces_at, planes, step_size, V, moved), len(V)
            )

        for _ in range(sweeps):
            sweep(V, moved)
            V, moved = moved, V
        return V


@_fused
def _face_geometry(low, high, corners, V, center, normal, area):  # type: ignore[no-untyped-def]
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
def _bilateral_weights(  # type: ignore[no-untyped-def]
    low, high, indptr, indices, center, normal, root, inv_2sigma_s2, inv_2sigma_r2, weight, degree
):
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
            y = max(1 - (inv_2sigma_s2 * (a * a + b * b + c * c) + inv_2sigma_r2 * (u * u + v * v + w * w)) / 8, 0.0)
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
def _first_residual(low, high, indptr, indices, weight, diagonal, t, B, X, R, P, sums):  # type: ignore[no-untyped-def]
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
def _update_residual(low, high, diagonal, alpha, P, Q, X, R, sums):  # type: ignore[no-untyped-def]
    """X += alpha P, R -= alpha Q; the sum of R . R / diagonal."""
    a = 0.0
    for i in range(low, high):
        X[i, 0] += alpha * P[i, 0]
        X[i, 1] += alpha * P[i, 1]
        X[i, 2] += alpha * P[i, 2]
        x, y, z = R[i, 0] - alpha * Q[i, 0], R[i, 1] - alpha * Q[i, 1], R[i, 2] - alpha * Q[i, 2]
        R[i, 0], R[i, 1], R[i, 2] = x, y, z
        a += (x * x + y * y + z * z) / diagonal[i]
    sums[0] = a


@_fused
def _update_direction(low, high, diagonal, beta, R, P):  # type: ignore[no-untyped-def]
    for i in range(low, high):
        by = 1 / diagonal[i]
        P[i, 0] = R[i, 0] * by + beta * P[i, 0]
        P[i, 1] = R[i, 1] * by + beta * P[i, 1]
        P[i, 2] = R[i, 2] * by + beta * P[i, 2]


@_fused
def _plane_offsets(low, high, corners, V, planes):  # type: ignore[no-untyped-def]
    """Write n.c into column 3; columns 0 to 2 hold n."""
    for f in range(low, high):
        a, b, c = corners[f, 0], corners[f, 1], corners[f, 2]
        planes[f, 3] = (
            planes[f, 0] * (V[a, 0] + V[b, 0] + V[c, 0])
            + planes[f, 1] * (V[a, 1] + V[b, 1] + V[c, 1])
            + planes[f, 2] * (V[a, 2] + V[b, 2] + V[c, 2])
        ) / 3


@_fused
def _move_vertices(low, high, indptr, indices, planes, step_size, V, moved):  # type: ignore[no-untyped-def]
    for i in range(low, high):
        x, y, z = V[i, 0], V[i, 1], V[i, 2]
        a = b = c = 0.0
        for k in range(indptr[i], indptr[i + 1]):
            f = indices[k]
            u, v, w = planes[f, 0], planes[f, 1], planes[f, 2]
            off = planes[f, 3] - (u * x + v * y + w * z)
            a += u * off
            b += v * off
            c += w * off
        moved[i, 0] = x + step_size[i] * a
        moved[i, 1] = y + step_size[i] * b
        moved[i, 2] = z + step_size[i] * c

"""Face kernels with scipy's sparse products and numpy: the reference."""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_array

from meshlab_specsmooth.arrays import Floats
from meshlab_specsmooth.graph.face_adjacency import FaceGraph


class ScipyFaceKernels:
    """See :class:`meshlab_specsmooth.graph.protocols.FaceKernels`."""

    name = "scipy"

    def __init__(self, graph: FaceGraph) -> None:
        self.graph = graph
        self.rows = np.repeat(np.arange(graph.size), np.diff(graph.indptr))
        ones = np.ones(len(graph.vertex_faces))
        self.at = csr_array((ones, graph.vertex_faces, graph.vertex_indptr), shape=(graph.order, graph.size))

    def face_geometry(self, V: Floats) -> tuple[Floats, Floats, Floats]:
        a, b, c = (V[self.graph.corners[:, k]] for k in range(3))
        across = np.cross(b - a, c - a)
        area = np.linalg.norm(across, axis=1)
        normal = np.divide(across, area[:, None], out=np.zeros_like(across), where=area[:, None] > 0)
        return (a + b + c) / 3, normal, area

    def bilateral_weights(
        self, center: Floats, normal: Floats, root: Floats, inv_2sigma_s2: float, inv_2sigma_r2: float
    ) -> tuple[Floats, Floats]:
        i, j = self.rows, self.graph.indices
        apart = inv_2sigma_s2 * ((center[i] - center[j]) ** 2).sum(axis=1) + inv_2sigma_r2 * (
            (normal[i] - normal[j]) ** 2
        ).sum(axis=1)
        weight = root[i] * root[j] * np.maximum(1 - apart / 8, 0) ** 8
        return weight, np.bincount(i, weights=weight, minlength=self.graph.size).astype(np.float64)

    def solve(
        self, weight: Floats, diagonal: Floats, t: float, B: Floats, X: Floats, tolerance: float, max_iterations: int
    ) -> Floats:
        m = self.graph.size
        W = csr_array((weight, self.graph.indices, self.graph.indptr), shape=(m, m))
        inverse, diagonal = 1 / diagonal[:, None], diagonal[:, None]
        R = B - (diagonal * X - t * (W @ X))
        P = inverse * R
        X, rz = X.copy(), (R * P).sum()
        threshold = tolerance**2 * (B * inverse * B).sum()
        for _ in range(max_iterations):
            if rz <= threshold:
                break
            Q = diagonal * P - t * (W @ P)
            alpha = rz / (P * Q).sum()
            X += P * alpha
            R -= Q * alpha
            rz_next = (R * inverse * R).sum()
            P = inverse * R + P * (rz_next / rz)
            rz = rz_next
        return X

    def update_vertices(self, V: Floats, normal: Floats, step_size: Floats, sweeps: int) -> Floats:
        m, n = self.graph.size, self.graph.order
        squares = self.at @ (normal[:, :, None] * normal[:, None, :]).reshape(m, 9)
        for _ in range(sweeps):
            height = (normal * V[self.graph.corners].sum(axis=1)).sum(axis=1) / 3
            pulled = self.at @ (normal * height[:, None])
            V = V + step_size[:, None] * (pulled - np.einsum("nij,nj->ni", squares.reshape(n, 3, 3), V))
        return V

"""Normals, aspects and heights of triangles."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from meshlab_specsmooth.arrays import Floats, Integers

_ASPECT_OF_EQUILATERAL = 2 / np.sqrt(3)


def compute_face_vectors(X: Floats, F: Integers) -> Floats:
    """(m, 3) normals whose length is twice the face's area."""
    return np.asarray(np.cross(X[F[:, 1]] - X[F[:, 0]], X[F[:, 2]] - X[F[:, 0]]))


def sum_at_corners(vectors: Floats, F: Integers | npt.NDArray[np.int64], n: int) -> Floats:
    """(n, 3) sums of vectors of the faces at their corners."""
    corner = F.ravel()
    # bincount counts in integers where there is nothing to count
    return np.stack([np.bincount(corner, np.repeat(c, 3), n) for c in vectors.T], axis=1).astype(np.float64)


def compute_vertex_normals(X: Floats, F: Integers) -> Floats:
    """(n, 3) unit normals of the vertices, weighted by area; zero where there is none."""
    return normalize_rows(sum_at_corners(compute_face_vectors(X, F), F, len(X)))


def number_edges(F: Integers | npt.NDArray[np.int64], n: int) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64]]:
    """The different edges (e, 2), smaller end first, and the number of each side (m, 3): from corner 0, 1 and 2."""
    start, end = F.astype(np.int64), F[:, [1, 2, 0]].astype(np.int64)
    # one integer an edge sorts much faster than rows do
    keys, edge = np.unique(np.minimum(start, end) * n + np.maximum(start, end), return_inverse=True)
    return np.stack([keys // n, keys % n], axis=1), edge.reshape(F.shape).astype(np.int64)


def normalize_rows(X: Floats) -> Floats:
    """(n, 3) rows of length one; rows of zeros stay."""
    length = np.linalg.norm(X, axis=1)[:, None]
    return np.asarray(np.divide(X, length, out=np.zeros_like(X), where=length > 0))


def compute_aspects(X: Floats, F: Integers) -> Floats:
    """(m,) longest side over altitude of each face, 1 for equilateral ones; infinite for faces without area."""
    a, b, c = X[F[:, 0]], X[F[:, 1]], X[F[:, 2]]
    longest = np.max([((p - q) ** 2).sum(axis=1) for p, q in ((a, b), (b, c), (c, a))], axis=0)
    double_area = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    return np.asarray(
        np.divide(longest, double_area, out=np.full(len(F), np.inf), where=double_area > 0) / _ASPECT_OF_EQUILATERAL
    )


def compute_heights(X: Floats, F: Integers) -> Floats:
    """(e,) height of a corner over the plane of the face on the other side, for each edge of two faces.

    Positive where the edge is concave.
    """
    n, m = len(X), len(F)
    ends = np.sort(np.concatenate([F[:, [0, 1]], F[:, [1, 2]], F[:, [2, 0]]]), axis=1).astype(np.int64)
    corner, face = np.concatenate([F[:, 2], F[:, 0], F[:, 1]]), np.tile(np.arange(m), 3)
    key = ends[:, 0] * n + ends[:, 1]
    order = np.argsort(key, kind="stable")
    key = key[order]
    pair = np.flatnonzero(key[1:] == key[:-1])
    here, there = face[order[pair]], corner[order[pair + 1]]
    normal = normalize_rows(compute_face_vectors(X, F))
    return np.asarray(np.einsum("ij,ij->i", X[there] - X[F[here, 0]], normal[here]))

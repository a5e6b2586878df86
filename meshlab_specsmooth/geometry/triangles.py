"""How triangles are shaped: whether a mesh can tell noise from shape at all.

A Laplacian that weighs all neighbors alike sees long thin triangles, fans and coarse models as noise. Two measures tell
such meshes from noisy ones: the aspect of the triangles, and how many neighboring faces lie exactly in one plane, which
noise leaves to chance.
"""

from __future__ import annotations

import numpy as np

from meshlab_specsmooth.arrays import Booleans, Floats, Integers
from meshlab_specsmooth.graph.laplacian import Laplacian

_ASPECT_OF_EQUILATERAL = 2 / np.sqrt(3)

# A face of this aspect says nothing of noise at its corners. White noise of half an edge on even triangles gives an
# aspect above it to 2 % of the faces, and hardly ever to a third of those at a vertex and at half of its neighbors.
MAX_ASPECT_AT_VERTEX = 12.0

# Between such faces a vertex that would move by more than so many noise levels is not moved
_LOST_OVER = 8.0


def compute_aspects(X: Floats, F: Integers) -> Floats:
    """(m,) longest side over altitude of each face, 1 for equilateral ones; infinite for faces without area."""
    a, b, c = X[F[:, 0]], X[F[:, 1]], X[F[:, 2]]
    longest = np.max([((p - q) ** 2).sum(axis=1) for p, q in ((a, b), (b, c), (c, a))], axis=0)
    double_area = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    return np.asarray(
        np.divide(longest, double_area, out=np.full(len(F), np.inf), where=double_area > 0) / _ASPECT_OF_EQUILATERAL
    )


def compute_heights(X: Floats, F: Integers) -> Floats:
    """(e,) distance of a corner from the plane of the face on the other side, for each edge of two faces."""
    n, m = len(X), len(F)
    ends = np.sort(np.concatenate([F[:, [0, 1]], F[:, [1, 2]], F[:, [2, 0]]]), axis=1).astype(np.int64)
    corner, face = np.concatenate([F[:, 2], F[:, 0], F[:, 1]]), np.tile(np.arange(m), 3)
    key = ends[:, 0] * n + ends[:, 1]
    order = np.argsort(key, kind="stable")
    key = key[order]
    pair = np.flatnonzero(key[1:] == key[:-1])
    here, there = face[order[pair]], corner[order[pair + 1]]
    normal = np.cross(X[F[:, 1]] - X[F[:, 0]], X[F[:, 2]] - X[F[:, 0]])
    length = np.linalg.norm(normal, axis=1)
    normal = np.divide(normal, length[:, None], out=np.zeros_like(normal), where=length[:, None] > 0)
    return np.asarray(np.abs(np.einsum("ij,ij->i", X[there] - X[F[here, 0]], normal[here])))


def find_uneven_vertices(X: Floats, F: Integers, L: Laplacian) -> Booleans:
    """(n,) vertices amid triangles that are too thin: a third of the faces at one, and at half of its neighbors."""
    is_thin = compute_aspects(X, F) > MAX_ASPECT_AT_VERTEX
    if not is_thin.any():
        return np.zeros(len(X), dtype=np.bool_)
    faces = np.bincount(F.ravel(), minlength=len(X))
    thin = np.bincount(F[is_thin].ravel(), minlength=len(X))
    uneven = (3 * thin >= faces) & (thin > 0)
    around = L.graph.adjacency(np.ones(len(L.graph.indices))) @ uneven.astype(np.float64)
    return np.asarray(uneven & (around >= 0.5 * L.degree[:, 0]))


def find_lost_vertices(displacement: Floats, X: Floats, F: Integers, L: Laplacian, level: float) -> Booleans | None:
    """(n,) vertices between long thin triangles that would move by more than any noise of a level explains, if any."""
    far = np.einsum("ij,ij->i", displacement, displacement) > (_LOST_OVER * level) ** 2
    if not far.any():
        return None
    far &= find_uneven_vertices(X, F, L)
    return far if far.any() else None


def describe_lost(lost: Booleans) -> str:
    """That such vertices are not moved."""
    count = int(lost.sum())
    return f"{count} {'vertex' if count == 1 else 'vertices'} between long thin triangles left alone"

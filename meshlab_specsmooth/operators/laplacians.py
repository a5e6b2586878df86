"""The Laplacian L = I - D^-1 A of the paper (eq. 1-2), and its kinds: how the edges are weighed."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from meshlab_specsmooth.arrays import Floats, Integers
from meshlab_specsmooth.graph.adjacency import MeshGraph
from meshlab_specsmooth.graph.build import from_edges
from meshlab_specsmooth.graph.laplacian import Laplacian, laplacian

# An angle sharper than one degree weighs as one of one degree, and an edge whose two cotangents cancel or turn
# negative (it is not Delaunay) keeps the weight of a right angle less one degree: the weights stay positive, so the
# spectrum stays inside [0, 2] and no vertex is cut off.
_SHARPEST_COTANGENT = 1 / np.tan(np.radians(1))
_LEAST_WEIGHT = np.tan(np.radians(1))

#: From vertices (n, 3), faces (m, 3) and edges (e, 2), smaller index first and sorted, to the positive weight of each.
Weigh = Callable[[Floats, Integers, Integers], Floats]


def laplacian_of_kind(kind: str, mesh: MeshGraph, V: Floats, F: Integers) -> Laplacian:
    """The Laplacian of a mesh.

    Parameters
    ----------
    kind : {"uniform", "cotangent"}
        Weight of an edge: 1 (the paper, eq. 1), or the sum of the cotangents of the angles that face it (Pinkall and
        Polthier 1993), with angles clamped so that all weights stay positive.
    mesh : MeshGraph
        Of the faces.
    V : (n, 3) float64
    F : (m, 3) int32
    """
    weigh = LAPLACIANS[kind]
    if weigh is None:
        return laplacian(mesh.graph)
    ends = mesh.ends()
    return laplacian(from_edges(len(V), ends, weigh(V, F, ends)))


def _cotangent_weights(V: Floats, F: Integers, ends: Integers) -> Floats:
    n = len(V)
    weight = np.zeros(len(ends))
    keys = ends[:, 0].astype(np.int64) * n + ends[:, 1]
    for corner in range(3):
        at, a, b = (F[:, (corner + k) % 3].astype(np.int64) for k in range(3))
        to_a, to_b = V[a] - V[at], V[b] - V[at]
        sine = np.linalg.norm(np.cross(to_a, to_b), axis=1)
        cosine = (to_a * to_b).sum(axis=1)
        # a degenerate corner has no angle: it contributes the bound that its cosine points to
        cotangent = np.sign(cosine) * _SHARPEST_COTANGENT
        np.divide(cosine, sine, out=cotangent, where=np.abs(cosine) < sine * _SHARPEST_COTANGENT)
        opposite = np.minimum(a, b) * n + np.maximum(a, b)
        real = a != b
        np.add.at(weight, np.searchsorted(keys, opposite[real]), cotangent[real])
    return np.maximum(weight, _LEAST_WEIGHT)


#: Kinds of Laplacian: how an edge is weighed; None where all edges weigh 1, so that no weights need be read.
LAPLACIANS: dict[str, Weigh | None] = {"uniform": None, "cotangent": _cotangent_weights}

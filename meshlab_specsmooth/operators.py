"""The matrices of the paper: the Laplacian L (eq. 1-2), its symmetric twin S, the face barycentres C (eq. 5-6)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.sparse import coo_array, csr_array, diags_array

from meshlab_specsmooth.spectral import SpectralFilter
from meshlab_specsmooth.spectral.progress import Progress
from meshlab_specsmooth.surface import Floats, Integers, Surface

# An angle sharper than one degree weighs as one of one degree, and an edge whose two cotangents cancel or turn
# negative (it is not Delaunay) keeps the weight of a right angle less one degree: the weights stay positive, so the
# spectrum stays inside [0, 2] and no vertex is cut off.
_SHARPEST_COTANGENT = 1 / np.tan(np.radians(1))
_LEAST_WEIGHT = np.tan(np.radians(1))


@dataclass(frozen=True, eq=False)
class Laplacian:
    """L = I - D^-1 W with symmetric weights W >= 0 and D = diag(row sums of W).

    L is not symmetric; its twin S = D^1/2 L D^-1/2 is, has the same eigenvalues, all inside [0, 2], and is what
    is projected on. Vertices without a neighbour have no row here: see :func:`laplacian`.

    Attributes
    ----------
    S : (n, n) csr_array
        Symmetric, dimensionless.
    root_degree : (n, 1) float64
        Diagonal of D^1/2.
    """

    S: csr_array
    root_degree: Floats

    def __matmul__(self, X: Floats) -> Floats:
        """L X for X of shape (n, k): each row less the weighted mean of its neighbours."""
        return np.asarray((self.S @ (X * self.root_degree)) / self.root_degree)

    def transposed(self, X: Floats) -> Floats:
        """L^T X for X of shape (n, k)."""
        return np.asarray((self.S @ (X / self.root_degree)) * self.root_degree)

    def function(self, filter_: SpectralFilter, X: Floats, progress: Progress | None = None) -> Floats:
        """h(L) X = D^-1/2 h(S) D^1/2 X: the projection is in the D-inner product, where L is symmetric."""
        return filter_.apply(self.S, X * self.root_degree, progress) / self.root_degree


def laplacian(surface: Surface, ends: Integers, kind: str = "uniform") -> Laplacian:
    """The Laplacian of the mesh graph.

    Parameters
    ----------
    surface : Surface
        Every vertex must have an edge.
    ends : (e, 2) int32
        Its edges, from :func:`meshlab_specsmooth.surface.edges`.
    kind : {"uniform", "cotangent"}
        Weight of an edge: 1 (the paper, eq. 1), or the sum of the cotangents of the angles that face it (Pinkall and
        Polthier 1993), with angles clamped so that all weights stay positive.

    """
    return graph_laplacian(len(surface.vertices), ends, LAPLACIANS[kind](surface, ends.astype(np.int64)))


def graph_laplacian(n: int, ends: Integers, weight: Floats) -> Laplacian:
    """The Laplacian of any graph with n vertices, each of which has an edge, and positive weights."""
    W = coo_array((weight, (ends[:, 0], ends[:, 1])), shape=(n, n))
    W = (W + W.T).tocsr()
    root_degree = np.sqrt(np.asarray(W.sum(axis=1)))
    scale = diags_array(1 / root_degree)
    S = (diags_array(np.ones(n)) - scale @ W @ scale).tocsr()
    # the product rounds S_ij and S_ji apart in the last bit; the mean of both is symmetric to the bit
    S = ((S + S.T) * 0.5).tocsr()
    S.sort_indices()
    return Laplacian(S, root_degree[:, None])


def _uniform_weights(surface: Surface, ends: Any) -> Floats:
    return np.ones(len(ends))


def _cotangent_weights(surface: Surface, ends: Any) -> Floats:
    V, F = surface.vertices, surface.faces.astype(np.int64)
    n = len(V)
    weight = np.zeros(len(ends))
    keys = ends[:, 0] * n + ends[:, 1]
    for corner in range(3):
        at, a, b = F[:, corner], F[:, (corner + 1) % 3], F[:, (corner + 2) % 3]
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


#: Kinds of Laplacian: how an edge is weighted.
LAPLACIANS: dict[str, Callable[[Surface, Any], Floats]] = {
    "uniform": _uniform_weights,
    "cotangent": _cotangent_weights,
}


def barycenters(surface: Surface) -> csr_array:
    """C of shape (m, n), three entries of 1/3 a row: ``C @ V`` are the face barycentres (paper, eq. 5)."""
    F = surface.faces
    m = len(F)
    return coo_array(
        (np.full(3 * m, 1 / 3), (np.repeat(np.arange(m), 3), F.ravel())), shape=(m, len(surface.vertices))
    ).tocsr()

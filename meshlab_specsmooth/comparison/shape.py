"""What can be measured of a result without the truth: noise left, features lost, angles, triangles, boundary."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.sparse import coo_array, csr_array, diags_array, eye_array

from meshlab_specsmooth.arrays import Booleans, Floats
from meshlab_specsmooth.geometry.surface import Surface, edges, face_vectors, mean_edge_length, vertex_normals

# The averaging that noise hardly survives and shape does: so many steps of (I + D^-1 A) / 2, some three edges wide
_AVERAGED = 16
# The share of vertices, those that curve the most, that are taken for features
_FEATURES = 0.1
# Median of the absolute value of a standard normal
_MEDIAN = 0.6744897501960817


@dataclass(frozen=True, eq=False)
class Ruler:
    """What measuring results of one mesh takes, held for many of them.

    Attributes
    ----------
    surface : Surface
        The mesh that the results are compared with: the truth where it is known, else the mesh as given.
    given : Surface
        The mesh as given to the filters; of the same faces.
    edge : float
        Mean edge of ``surface``, the unit of lengths.
    walk : (n, n) sparse
        (I + D^-1 A) / 2.
    twice : (n, n) sparse
        L^2 by the norms of its rows, so that white noise of standard deviation s gives s.
    used : (n,) bool
        Vertices that have an edge.
    features : (k,) int
        The vertices where ``surface``, averaged, curves the most.
    normals : (n, 3) float64
        Of ``surface``, averaged.
    averaged : (n, 3) float64
        Its averaged vertices.
    """

    surface: Surface
    given: Surface
    edge: float
    walk: csr_array
    twice: csr_array
    used: Booleans
    features: npt.NDArray[np.int64]
    normals: Floats
    averaged: Floats

    @staticmethod
    def of(surface: Surface, given: Surface) -> Ruler:
        """The ruler for results that are to look like a surface; both have the same faces."""
        n = len(surface.vertices)
        ends, _ = edges(surface)
        one_way = coo_array((np.ones(len(ends)), (ends[:, 0], ends[:, 1])), shape=(n, n))
        A = csr_array(one_way + one_way.T)
        degree = np.asarray(A.sum(axis=1)).ravel()
        used = degree > 0
        mean = csr_array(diags_array(1 / np.maximum(degree, 1)) @ A)
        L = csr_array(diags_array(used.astype(np.float64)) - mean)
        walk = csr_array(eye_array(n) - 0.5 * L)
        twice = csr_array(L @ L)
        norms = np.sqrt(np.asarray(twice.multiply(twice).sum(axis=1)).ravel())
        twice = csr_array(diags_array(1 / np.where(norms > 0, norms, 1.0)) @ twice)
        averaged = _steps(walk, surface.vertices)
        smooth = Surface(averaged, surface.faces)
        bent = np.linalg.norm(L @ averaged, axis=1)
        inner = used.copy()
        inner[ends[_rim(surface)].ravel()] = False
        candidates = np.flatnonzero(inner if inner.any() else used)
        count = max(1, round(_FEATURES * len(candidates)))
        features = candidates[np.argsort(-bent[candidates], kind="stable")[:count]].astype(np.int64)
        return Ruler(
            surface, given, mean_edge_length(surface), walk, twice, used, features, vertex_normals(smooth), averaged
        )

    def noise_left(self, result: Surface) -> float:
        """Median |n . L^2 X| / (0.6745 r), r the norms of the rows of L^2, n the averaged normals; in mean edges.

        White noise of standard deviation s along the normals gives s, smooth shape next to nothing (Donoho, Johnstone,
        *Ideal spatial adaptation by wavelet shrinkage*, 1994, for the median).
        """
        along = ((self.twice @ result.vertices) * self.normals).sum(axis=1)[self.used]
        return float(np.median(np.abs(along))) / _MEDIAN / self.edge

    def feature_loss(self, result: Surface) -> float:
        """How far the surface, averaged over some three edges, has moved along its normals where it curves the most.

        Root mean square over the tenth of the vertices whose averaged surface has the largest |L V|, in mean edges.
        Averaging leaves little of noise, so what has moved is shape: ridges that sank, tips that withdrew.
        """
        moved = _steps(self.walk, result.vertices - self.surface.vertices)[self.features]
        along = (moved * self.normals[self.features]).sum(axis=1)
        return float(np.sqrt((along**2).mean())) / self.edge

    def offset(self, result: Surface) -> float:
        """Mean move along the normals, weighted by area, in mean edges: volume swept per area; negative inward."""
        surface = self.surface
        weights = np.repeat(np.linalg.norm(face_vectors(surface), axis=1), 3)
        areas = np.bincount(surface.faces.ravel(), weights, len(surface.vertices))
        along = ((result.vertices - surface.vertices) * self.normals).sum(axis=1)
        return float((areas * along).sum() / areas.sum()) / self.edge

    def displacement(self, result: Surface) -> float:
        """Root mean square distance of the vertices from where they were given, in mean edges."""
        squared = ((result.vertices - self.given.vertices) ** 2).sum(axis=1)[self.used]
        return float(np.sqrt(squared.mean())) / self.edge


def _steps(walk: csr_array, X: Floats) -> Floats:
    for _ in range(_AVERAGED):
        X = walk @ X
    return np.asarray(X)


def _rim(surface: Surface) -> Booleans:
    _, count = edges(surface)
    return np.asarray(count == 1)


def dihedral_deviation(surface: Surface) -> float:
    """Mean angle in degrees between the normals of faces that share an edge: 0 of a plane.

    Examples
    --------
    >>> import meshlab_specsmooth as mss
    >>> from meshlab_specsmooth.comparison.shape import dihedral_deviation
    >>> bent = mss.Surface([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], [[0, 1, 2], [1, 0, 3]])
    >>> round(dihedral_deviation(bent), 6)
    90.0
    """
    F, n = surface.faces, len(surface.vertices)
    halves = np.sort(np.concatenate([F[:, [0, 1]], F[:, [1, 2]], F[:, [2, 0]]]), axis=1)
    keys, face = halves[:, 0].astype(np.int64) * n + halves[:, 1], np.tile(np.arange(len(F)), 3)
    order = np.argsort(keys, kind="stable")
    keys, face = keys[order], face[order]
    same = np.flatnonzero(keys[1:] == keys[:-1])
    normals = face_vectors(surface)
    a, b = normals[face[same]], normals[face[same + 1]]
    proper = (np.linalg.norm(a, axis=1) > 0) & (np.linalg.norm(b, axis=1) > 0)
    if not proper.any():
        return 0.0
    a, b = a[proper], b[proper]
    return float(np.degrees(np.arctan2(np.linalg.norm(np.cross(a, b), axis=1), (a * b).sum(axis=1))).mean())


def triangle_quality(surface: Surface) -> float:
    """Mean of 2 r / R, inscribed by circumscribed radius: 1 of equilateral triangles, 0 of degenerate ones.

    Examples
    --------
    >>> import meshlab_specsmooth as mss
    >>> from meshlab_specsmooth.comparison.shape import triangle_quality
    >>> round(triangle_quality(mss.Surface([[0, 0, 0], [1, 0, 0], [0.5, 0.75**0.5, 0]], [[0, 1, 2]])), 9)
    1.0
    """
    V, F = surface.vertices, surface.faces
    a, b, c = (np.linalg.norm(V[F[:, i]] - V[F[:, j]], axis=1) for i, j in ((1, 2), (2, 0), (0, 1)))
    # 2 r / R = 8 (s - a) (s - b) (s - c) / (a b c) = (b + c - a) (c + a - b) (a + b - c) / (a b c)
    product = a * b * c
    above = (b + c - a) * (c + a - b) * (a + b - c)
    return float(np.divide(above, product, out=np.zeros_like(above), where=product > 0).mean())


def area(surface: Surface) -> float:
    """Area of all faces, in squared mesh units."""
    return float(np.linalg.norm(face_vectors(surface), axis=1).sum()) / 2


def boundary_length(surface: Surface) -> float:
    """Length of all edges with one face, in mesh units; 0 of a closed surface."""
    ends, _ = edges(surface)
    ends = ends[_rim(surface)]
    return float(np.linalg.norm(surface.vertices[ends[:, 0]] - surface.vertices[ends[:, 1]], axis=1).sum())


def mean_curvature(ruler: Ruler, result: Surface) -> Floats:
    """(n,) signed bending of the averaged surface, n . (umbrella), by mean edge; positive where it is convex."""
    X = ruler.walk @ (ruler.walk @ result.vertices)
    bent = 2 * (X - ruler.walk @ X)
    return np.asarray((bent * vertex_normals(Surface(X, result.faces))).sum(axis=1)) / ruler.edge

"""Measures of results on one mesh that need its operators: noise left, features lost, displacement."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from meshlab_specsmooth.arrays import Floats
from meshlab_specsmooth.comparison.metrics import boundary_edges
from meshlab_specsmooth.geometry.surface import Surface, face_vectors, mean_edge_length, vertex_normals
from meshlab_specsmooth.noise.scales import bilaplacian_row_norms, walk
from meshlab_specsmooth.operators.assemble import Operators

# Steps of the lazy random walk (I + D^-1 A) / 2, which average over about three edges: little noise is left, most of
# the shape is
_AVERAGING_STEPS = 16
# Fraction of the vertices, those of largest curvature, that are taken as features
_FEATURE_FRACTION = 0.1
_CURVATURE_DIGITS = 9
# Median of the absolute value of a standard normal variable
_MAD_OF_UNIT_NORMAL = 0.6744897501960817


@dataclass(frozen=True, eq=False)
class MeasureContext:
    """A reference surface with the operators of the mesh, for the measures of many results.

    Attributes
    ----------
    reference : Surface
        Results are compared with this: the truth if it has the same faces, else the mesh as given.
    given : Surface
        Input of the filters, with the same faces.
    operators : Operators
        Of ``given``, with the uniform Laplacian.
    row_norms : (k,) float64
        Norms of the rows of L^2.
    edge : float
        Mean edge of ``reference``, the unit of lengths.
    features : (f,) int64
        Vertices where the averaged reference has the largest curvature.
    normals : (n, 3) float64
        Of the averaged reference.
    """

    reference: Surface
    given: Surface
    operators: Operators
    row_norms: Floats
    edge: float
    features: npt.NDArray[np.int64]
    normals: Floats

    @staticmethod
    def of(reference: Surface, given: Surface, operators: Operators) -> MeasureContext:
        """Prepare the measures of results that are compared with a reference."""
        averaged = _average(operators, reference.vertices, _AVERAGING_STEPS)
        return MeasureContext(
            reference,
            given,
            operators,
            bilaplacian_row_norms(operators.L)[0],
            mean_edge_length(reference),
            _find_features(reference, averaged, operators),
            vertex_normals(Surface(averaged, reference.faces)),
        )

    def average(self, X: Floats, steps: int = _AVERAGING_STEPS) -> Floats:
        """Return (n, 3) values after ``steps`` steps of the lazy random walk (I + D^-1 A) / 2."""
        return _average(self.operators, X, steps)

    def noise_left(self, result: Surface) -> float:
        """Noise level: median |n . L^2 X| / (0.6745 r) in mean edges, with r the row norms of L^2.

        White noise of standard deviation s along the normals gives s, a smooth shape almost 0 (Donoho, Johnstone,
        *Ideal spatial adaptation by wavelet shrinkage*, 1994, for the median).
        """
        L, active = self.operators.L, self.operators.active
        along = ((L @ (L @ result.vertices[active])) * self.normals[active]).sum(axis=1)
        norms = np.where(self.row_norms > 0, self.row_norms, 1.0)
        return float(np.median(np.abs(along / norms))) / _MAD_OF_UNIT_NORMAL / self.edge

    def feature_loss(self, result: Surface) -> float:
        """Root mean square displacement of the averaged surface along its normals at the features, in mean edges.

        Averaging removes most of the noise, so this displacement is a change of shape: ridges and tips that recede.
        """
        displacement = self.average(result.vertices - self.reference.vertices)[self.features]
        along = (displacement * self.normals[self.features]).sum(axis=1)
        return float(np.sqrt((along**2).mean())) / self.edge

    def offset(self, result: Surface) -> float:
        """Area-weighted mean displacement along the normals in mean edges (swept volume per area); inward negative."""
        surface = self.reference
        weights = np.repeat(np.linalg.norm(face_vectors(surface), axis=1), 3)
        areas = np.bincount(surface.faces.ravel(), weights, len(surface.vertices))
        along = ((result.vertices - surface.vertices) * self.normals).sum(axis=1)
        return float((areas * along).sum() / areas.sum()) / self.edge

    def displacement(self, result: Surface) -> float:
        """Root mean square displacement of the vertices from the given mesh, in mean edges."""
        active = self.operators.active
        squared = ((result.vertices - self.given.vertices) ** 2).sum(axis=1)[active]
        return float(np.sqrt(squared.mean())) / self.edge

    def curvature(self, result: Surface) -> Floats:
        """Return the (n,) signed curvature of the surface averaged by two steps; positive where it is convex.

        It is n . L X in mean edges.
        """
        X = self.average(result.vertices, 2)
        bending = 2 * (X - self.average(X, 1))
        return np.asarray((bending * vertex_normals(Surface(X, result.faces))).sum(axis=1)) / self.edge


def _average(operators: Operators, X: Floats, steps: int) -> Floats:
    """(n, 3) values after steps of the lazy random walk; vertices without an edge keep theirs."""
    Y = walk(operators.L, X.take(operators.active, axis=0), steps)
    if operators.active_index is None:
        return Y
    averaged, has_edges = X.copy(), operators.active_index >= 0
    averaged[has_edges] = Y[operators.active_index[has_edges]]
    return averaged


def _find_features(surface: Surface, averaged: Floats, operators: Operators) -> npt.NDArray[np.int64]:
    """The vertices with the largest |L X|, those on the boundary excluded if there are others."""
    active = np.sort(operators.active)
    is_boundary = np.zeros(len(surface.vertices), dtype=np.bool_)
    is_boundary[boundary_edges(surface).ravel()] = True
    inner = active[~is_boundary[active]]
    candidates = inner if len(inner) else active
    curvature = np.linalg.norm(averaged - _average(operators, averaged, 1), axis=1)[candidates]
    # symmetric shapes have equal curvatures: rounding errors must not decide which of them are the largest
    largest = float(curvature.max()) or 1.0
    order = np.argsort(-np.round(curvature / largest, _CURVATURE_DIGITS), kind="stable")
    return candidates[order[: max(1, round(_FEATURE_FRACTION * len(candidates)))]].astype(np.int64)

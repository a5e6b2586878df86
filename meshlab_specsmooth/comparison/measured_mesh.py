"""A mesh on which filters are measured: its operators, the prepared error estimate, and all measures of a result."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
from scipy.sparse import coo_array, csr_array
from scipy.sparse.csgraph import breadth_first_order

from meshlab_specsmooth.arrays import Booleans, Floats
from meshlab_specsmooth.comparison import metrics
from meshlab_specsmooth.comparison.distances import distances
from meshlab_specsmooth.comparison.measure_context import MeasureContext
from meshlab_specsmooth.geometry.surface import Surface
from meshlab_specsmooth.meshlab.measures import hausdorff, self_intersecting_faces
from meshlab_specsmooth.noise.model import UNCLEAR, Noise
from meshlab_specsmooth.operators.assemble import assemble_surface
from meshlab_specsmooth.risk.estimate_error import SurfaceProbe, prepare_probe
from meshlab_specsmooth.spectral.density import band_energies


@dataclass(frozen=True)
class EstimatedError:
    """An estimated error in mean edges, with the parts of its uncertainty in squared mean edges (those of the risk).

    Attributes
    ----------
    error : float
    scatter : float
        Standard error of the risk over the probes; NaN for one probe.
    level_term : float
        Signed change of the risk for a change of the noise level by one standard error.
    risks : tuple of float
        Risk estimated by each probe.
    """

    error: float
    scatter: float
    level_term: float
    risks: tuple[float, ...]

    @property
    def uncertainty(self) -> float:
        """Increase of the error for one standard error of the risk; for one probe, that of the noise level alone."""
        return math.sqrt(self.error**2 + math.hypot(np.nan_to_num(self.scatter), self.level_term)) - self.error


_BANDS = 40
_ANGLES = np.linspace(0, np.pi, _BANDS + 1)
_MIN_MODES_OF_BAND = 30  # to measure a transfer function by a random perturbation

#: Centers of the bands, as eigenvalues of the Laplacian, (b,).
EIGENVALUES = 1 - np.cos((_ANGLES[1:] + _ANGLES[:-1]) / 2)


@dataclass(frozen=True, eq=False)
class MeasuredMesh:
    """A mesh on which filters are measured.

    Attributes
    ----------
    given : Surface
        Input of the filters.
    truth : Surface or None
        It may have other faces.
    corresponds : bool
        Whether the truth has the same faces.
    context : MeasureContext
    risk : SurfaceProbe
        The error estimate at all vertices that have an edge.
    risk_in_core : SurfaceProbe
        The same for the vertices whose error counts: those far from a cut.
    perturbed : list of (n, 3) float64
        Perturbed vertices, one array a probe; empty where none are needed.
    noise_given : float
        Noise level of the given mesh, measured as that of results.
    diagonal_ratio : float
        Diagonal of the bounding box of the whole mesh divided by that of this part.
    single_run : bool
        Whether filters run once, without perturbations, and the expensive measures are left out.
    """

    given: Surface
    truth: Surface | None
    corresponds: bool
    context: MeasureContext
    risk: SurfaceProbe
    risk_in_core: SurfaceProbe
    perturbed: list[Floats]
    noise_given: float
    diagonal_ratio: float = 1.0
    single_run: bool = False

    @staticmethod
    def of(
        given: Surface, truth: Surface | None, probes: int, noise: Noise | None = None, single_run: bool = False
    ) -> MeasuredMesh:
        """Assemble the operators of a mesh and prepare its error estimate; the noise is measured if not given."""
        corresponds = (
            truth is not None
            and truth.vertices.shape == given.vertices.shape
            and np.array_equal(truth.faces, given.faces)
        )
        operators = assemble_surface(given)
        risk = prepare_probe(operators, noise=noise, probes=probes)
        context = MeasureContext.of(truth if truth is not None and corresponds else given, given, operators)
        perturbed = risk.perturb() if risk.probe.draws.any() and not single_run else []
        noise_given = context.noise_left(given)
        return MeasuredMesh(
            given, truth, corresponds, context, risk, risk, perturbed, noise_given, single_run=single_run
        )

    def cut(self, patch: npt.NDArray[np.int64], probes: int) -> MeasuredMesh:
        """Return the mesh of some vertices and the faces between them, with the noise and the unit of the whole."""
        given = _restrict(self.given, patch)
        truth = _restrict(self.truth, patch) if self.truth is not None and self.corresponds else None
        diagonals = [float(np.linalg.norm(np.ptp(s.vertices, axis=0))) for s in (self.given, given)]
        noise = self.risk.noise
        if noise.local is not None:
            noise = replace(noise, local=noise.local[patch])
        part = MeasuredMesh.of(given, truth, probes, noise)
        context = replace(part.context, edge=self.context.edge)
        return replace(
            part,
            context=context,
            risk_in_core=_restrict_risk(part.risk, ~_is_near_cut(self.given, patch)),
            noise_given=context.noise_left(given),
            diagonal_ratio=diagonals[0] / diagonals[1] if diagonals[1] > 0 else 1.0,
        )

    @property
    def has_estimates(self) -> bool:
        """Whether noise can be separated from shape, without which no error can be estimated."""
        return self.risk.noise.kind != UNCLEAR

    def estimate_error(self, result: Floats, perturbed: Sequence[Floats | None]) -> EstimatedError:
        """Estimate the error of a result, (n, 3), from the results of the same filter on the perturbed meshes."""
        found, area = self.risk_in_core.estimate(result, perturbed), self.context.edge**2
        displacement = float((self.risk_in_core.project(self.given.vertices, result) ** 2).mean())
        # the risk is the squared displacement plus a term proportional to the squared level
        level, interval = found.noise.level, found.noise.high - found.noise.low
        level_term = 2 * (found.risk - displacement) * interval / (4 * level) if level > 0 else 0.0
        return EstimatedError(
            found.error / self.context.edge,
            found.standard_error / area,
            level_term / area,
            tuple(risk / area for risk in found.risks),
        )

    def measure_basic(self, result: Surface) -> dict[str, float]:
        """Return the measures that are taken at every strength, by key."""
        context = self.context
        fraction_left = context.noise_left(result) / self.noise_given if self.noise_given > 0 else 1.0
        values = {
            "noise_removed": 100 * (1 - fraction_left),
            "feature_loss": context.feature_loss(result),
            "offset": context.offset(result),
            "displacement": context.displacement(result),
        }
        if metrics.has_volume(context.reference):
            values["volume"] = metrics.volume_change(result, context.reference)
        if self.corresponds and self.truth is not None:
            along = self.risk_in_core.project(self.truth.vertices, result.vertices)
            values["true_error"] = float(np.sqrt((along**2).mean())) / context.edge
            values["normal_error"] = metrics.normal_error(result, self.truth)
        return values

    def measure_all(self, result: Surface) -> tuple[dict[str, float], dict[str, Floats]]:
        """Return all measures by key, and (n,) values to color the surface by."""
        context, values = self.context, self.measure_basic(result)
        values |= {
            "area": 100 * (metrics.area(result) / metrics.area(self.given) - 1),
            "dihedral": metrics.dihedral_deviation(result),
            "quality": metrics.triangle_quality(result),
            "flips": metrics.flipped(result, context.reference),
        }
        if not self.single_run:
            values["intersections"] = 100 * float(self_intersecting_faces(result.vertices, result.faces).mean())
        boundary = metrics.boundary_length(self.given)
        if boundary > 0:
            values["boundary"] = 100 * (metrics.boundary_length(result) / boundary - 1)
        colors = {
            "displacement": np.linalg.norm(result.vertices - self.given.vertices, axis=1) / context.edge,
            "curvature": context.curvature(result),
        }
        if self.truth is not None and self.corresponds:
            values["vertex_error"] = metrics.vertex_error(result, self.truth)
        if self.truth is not None and self.single_run and self.corresponds:
            along = ((result.vertices - self.truth.vertices) * context.normals).sum(axis=1)
            colors["error"] = np.abs(along) / context.edge
        elif self.truth is not None:
            to_truth = distances(result.vertices, self.truth)
            values["surface_error"] = metrics.root_mean_square(to_truth, result) / context.edge
            colors["error"] = to_truth / context.edge
            if not self.single_run:
                values["hausdorff"] = hausdorff(result, self.truth) / context.edge
        return values, colors

    def power(self, vertices: Floats) -> Floats:
        """Return the (b,) energy of the differential coordinates in each band, in squared mean edges."""
        L = self.context.operators.L
        X = vertices[self.context.operators.active] / self.context.edge
        return np.maximum(band_energies(L, L @ (X - X.mean(axis=0)), _ANGLES), 0.0)

    def response(self, result: Floats, perturbed: Sequence[Floats | None]) -> Floats | None:
        """Return the (b,) transfer function for small perturbations along the normals; None without perturbations.

        With g the perturbation and r the change of the result it is <g, r> / <g, g> in each band, by polarization; NaN
        for bands with too few modes.
        """
        pairs = [(X, Y) for X, Y in zip(self.perturbed, perturbed, strict=False) if Y is not None]
        if not pairs:
            return None
        L = self.context.operators.L
        g = self.risk.project(self.given.vertices, pairs[0][0])[:, None]
        r = self.risk.project(result, pairs[0][1])[:, None]
        scale = float(np.abs(g).max())
        g, r = g / scale, r / scale
        plus, minus, energy = (band_energies(L, X, _ANGLES) for X in (g + r, g - r, g))
        # the energy of a random perturbation in a band is proportional to its number of modes
        is_known = energy * len(g) >= _MIN_MODES_OF_BAND * energy.sum()
        return np.where(is_known, (plus - minus) / (4 * np.where(is_known, energy, 1.0)), np.nan)


def _restrict_risk(risk: SurfaceProbe, counted: Booleans) -> SurfaceProbe:
    """The error estimate for some vertices, (n,) bool, or for all if none of these has an edge."""
    kept = counted[risk.ops.active]
    return replace(risk, probe=replace(risk.probe, counted=kept)) if kept.any() else risk


# Rings at the cut whose errors are excluded: filters treat the cut as a boundary
_CUT_RINGS = 20
_SEED = 7
_MAX_STARTS = 100


def select_patch(surface: Surface, size: int) -> npt.NDArray[np.int64]:
    """Return ``size`` vertices, sorted, in one patch unless its component is smaller."""
    n, F = len(surface.vertices), surface.faces
    graph = csr_array(coo_array((np.ones(3 * len(F)), (F.ravel(), F[:, [1, 2, 0]].ravel())), shape=(n, n)))
    rng, selected = np.random.default_rng(_SEED), np.zeros(n, dtype=np.bool_)
    for _ in range(_MAX_STARTS):
        reached = breadth_first_order(graph, int(F[rng.integers(len(F)), 0]), directed=False, return_predecessors=False)
        selected[reached[: size - int(selected.sum())]] = True
        if selected.sum() >= size:
            break
    return np.flatnonzero(selected).astype(np.int64)


def _restrict(surface: Surface, patch: npt.NDArray[np.int64]) -> Surface:
    """Return the surface of some vertices and the faces between them."""
    number = np.full(len(surface.vertices), -1)
    number[patch] = np.arange(len(patch))
    faces = number[surface.faces]
    return Surface(surface.vertices[patch], faces[(faces >= 0).all(axis=1)])


def _is_near_cut(surface: Surface, patch: npt.NDArray[np.int64]) -> Booleans:
    """Return for each vertex of a patch, (k,), whether it lies within 20 rings of the rest of the surface."""
    is_near = np.ones(len(surface.vertices), dtype=np.bool_)
    is_near[patch] = False
    for _ in range(_CUT_RINGS):
        is_near[surface.faces[is_near[surface.faces].any(axis=1)]] = True
    return np.asarray(is_near[patch])

"""The barycenter weight of least estimated error, without the truth to compare with.

The filter is linear, so what it makes of the noise is computed once for each weight (see :mod:`.sure`).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, cast

import numpy as np
import numpy.typing as npt

from meshlab_specsmooth.arrays import Booleans, Floats
from meshlab_specsmooth.noise.estimate import (
    GUIDE_RTOL,
    MAX_WEIGHT,
    MIN_WEIGHT,
    NoiseEstimate,
    compute_guide_normals,
    estimate,
    initial_weight,
)
from meshlab_specsmooth.noise.local import VaryingNoise, find_varying_noise
from meshlab_specsmooth.noise.model import IMPULSE, Noise
from meshlab_specsmooth.noise.sample import sample
from meshlab_specsmooth.noise.voxels import Voxels
from meshlab_specsmooth.operators.assemble import Operators, at_positions
from meshlab_specsmooth.operators.barycenters import weighted_gram_of_barycenters
from meshlab_specsmooth.operators.patches import Patches, draw_patches, find_interior, widen_patches
from meshlab_specsmooth.operators.reconstruction import Constraints, error_gain, reconstruct
from meshlab_specsmooth.risk.impulses import clip_impulses
from meshlab_specsmooth.risk.sure import compute_risk
from meshlab_specsmooth.runtime import blocks
from meshlab_specsmooth.runtime.progress import Progress, announce, subrange
from meshlab_specsmooth.spectral.chebyshev import ChebyshevSeries
from meshlab_specsmooth.spectral.design import design
from meshlab_specsmooth.spectral.low_pass import Heat
from meshlab_specsmooth.spectral.response import Family, Response

_SEED = 20251

# Weights are evaluated in steps of this factor from the first guess, downhill, until the error rises; the minimum is
# that of the parabola through the last three.
# docs/constants.md: _STEP, _MAX_STEPS
_STEP, _MAX_STEPS = 2.0, 7

# Fraction of the time of a choice that the noise takes, and what each weight leaves of the rest.
_MEASURING, _REMAINING = 0.25, 0.75

# The low-pass is computed to this fraction of the displacement.
# docs/constants.md: _TOLERANCE
_TOLERANCE = 2.5e-3

# The error is flat about its minimum, and that of normals still falls with the weight: of all weights whose error is
# within this fraction of the least, the lowest is taken.
# docs/constants.md: _RISK_TOLERANCE
_RISK_TOLERANCE = 0.02

# Weights differ over the surface by no more than this factor from that of the mean level.
_MAX_PROFILE = 16.0

# A smaller weight smooths waves that are as long as patches are wide; then wider ones decide.
_NARROW = 0.1

#: Terraces are waves of many edges, which the default low-pass would keep; two gentle passes leave less of them than a
#: strong one.
# docs/constants.md: STAIRCASE_WAVELENGTH, STAIRCASE_ITERATIONS
STAIRCASE_WAVELENGTH, STAIRCASE_ITERATIONS = 200.0, 2

# This fraction of the vertices of a staircase moves by no more than so many halves of a voxel along every axis. The
# weight is found to within a few per cent.
# docs/constants.md: _MAX_HALVES, _MAX_HALVES_OF_CORNERS
_WITHIN, _MAX_HALVES, _MAX_HALVES_OF_CORNERS = 0.99, 1.3, 1.4
_MAX_WEIGHT_OF_STAIRCASE, _ACCURACY = 2.0, 0.1

# Below this fraction of an edge there is nothing to choose for.
_MIN_LEVEL = 0.002

# Beyond this many vertices only the first low-pass is considered: the choice is to take a small part of the time.
LARGE = 100_000


@dataclass(frozen=True)
class CandidateLowPass:
    """A low-pass to choose from: a ready response, or a family and its shortest wave in mean edges."""

    response: Response | Family
    shortest: float | None = None

    def remover(self, ops: Operators, weight: float) -> Callable[[Floats], tuple[Floats, Floats | None]]:
        """What step 2 removes: (h(L) - 1) L X, and the displacement that has this difference but for the lowest modes.

        To the accuracy that a reconstruction with ``weight`` or more needs.
        """
        L = ops.L
        if self.shortest is not None and self.shortest > 2 * np.sqrt(L.size):
            # no wave fits on the mesh: only constants are kept
            return lambda X: (-(L @ X), None)
        filter_ = design(
            L,
            self.response,
            wavelength=self.shortest,
            method="chebyshev",
            tolerance=_TOLERANCE,
            error_gain=lambda eigenvalues: error_gain(eigenvalues, weight),
        ).filter
        constant, divided = cast("ChebyshevSeries", filter_).divide()

        def remove(X: Floats) -> tuple[Floats, Floats | None]:
            delta = L @ X
            # one-sided: the weights that are chosen on patches are then nearest to the best for the whole
            delta[ops.boundary_vertices] = 0.0
            start = divided.apply(L, delta)
            return L @ start + (constant - 1) * delta, start

        return remove


@dataclass(frozen=True)
class ConsideredWeight:
    """A weight, the index of its low-pass among the candidates, and the estimated mean square error of both."""

    weight: float
    low_pass: int
    risk: float


@dataclass(frozen=True, eq=False)
class WeightChoice:
    """A weight and the evidence for it.

    Attributes
    ----------
    weight : float
        w of the least estimated error.
    risk : float
        Estimated mean square error along the normals at that weight, in squared units of the positions; it may be
        negative where the error is small.
    noise : Noise
        In the units of the positions.
    low_pass : int
        Index among the candidates.
    considered : tuple of ConsideredWeight
        All weights that were evaluated.
    varying : VaryingNoise or None
        Where the noise varies: ``weight`` is then that of the mean level, see :func:`compute_profile`.
    """

    weight: float
    risk: float
    noise: Noise
    low_pass: int = 0
    considered: tuple[ConsideredWeight, ...] = field(default=())
    varying: VaryingNoise | None = None

    @property
    def error(self) -> float:
        """The root of the risk, in the units of the positions; 0 where it is negative."""
        return float(np.sqrt(max(self.risk, 0.0)))

    @property
    def weights(self) -> float | Floats:
        """The weight, or where the noise varies, (k,) weights of the vertices."""
        return self.weight if self.varying is None else self.weight * compute_profile(self.varying)


def compute_profile(varying: VaryingNoise) -> Floats:
    """(k,) weights that are inverse to the level of the noise, relative to that of the mean level."""
    relative = np.where(varying.is_noisy, varying.relative, np.inf)
    ratio = np.clip(_mean_relative(varying) / relative, 1 / _MAX_PROFILE, _MAX_PROFILE)
    return np.asarray(np.where(varying.is_noisy, ratio, 1.0))


def _mean_relative(varying: VaryingNoise) -> float:
    return float(np.sqrt((varying.relative[varying.is_noisy] ** 2).mean()))


def choose_weight(
    ops: Operators,
    candidates: Sequence[CandidateLowPass],
    mask: Booleans | None = None,
    progress: Progress | None = None,
    voxels: Voxels | None = None,
) -> WeightChoice:
    """Choose the barycenter weight, and the low-pass, of least estimated error.

    Parameters
    ----------
    ops : Operators
    candidates : sequence of CandidateLowPass
        On a large mesh only the first is considered.
    mask : (k,) bool, optional
        Vertices that count, where these are enough; all by default.
    progress : callable, optional
        Called with the fraction done; the number of weights is not known beforehand.
    voxels : Voxels, optional
        Of the mask that the surface was made from, where these are known.
    """
    announce(progress, "measuring noise")
    varying = find_varying_noise(ops, mask) if voxels is None else None
    if varying is not None:
        mask = varying.is_noisy if mask is None else mask & varying.is_noisy
    patches = draw_patches(ops, mask)
    if varying is None:
        found = estimate(patches.ops, patches.counted, voxels)
    else:
        found = NoiseEstimate(varying.noise, compute_guide_normals(patches.ops, varying.noise.level))
    if progress is not None:
        progress(_MEASURING)
    announce(progress, "choosing")
    rest = subrange(progress, _MEASURING, 1 - _MEASURING)
    return choose_on_patches(ops, patches, found, candidates, mask, rest, varying)


def choose_on_patches(
    ops: Operators,
    patches: Patches,
    found: NoiseEstimate,
    candidates: Sequence[CandidateLowPass],
    mask: Booleans | None = None,
    progress: Progress | None = None,
    varying: VaryingNoise | None = None,
) -> WeightChoice:
    """The same where patches are drawn and their noise is measured; parameters as for :func:`choose_weight`."""
    noise, on, counted = found.noise, patches.ops, patches.counted
    if noise.is_left_alone:
        return WeightChoice(MAX_WEIGHT, max(noise.level, noise.resolution) ** 2, noise)
    if found.voxels is not None:
        wide = widen_patches(ops, patches, mask) if patches.starts else patches
        weight = _choose_within_voxels(wide.ops, wide.counted, found.voxels)
        return WeightChoice(weight, 0.0, noise)
    if noise.kind == IMPULSE:
        on = at_positions(on, clip_impulses(on))
        counted = find_interior(on)
        found = estimate(on, counted)
    if len(ops.positions) > LARGE:
        candidates = candidates[:1]
    share = 1 / len(candidates)
    is_wide = not patches.starts or noise.kind == IMPULSE
    lowest = MIN_WEIGHT if is_wide else _NARROW / 2
    considered, minima = [], []
    locally = None if varying is None else LocalProbe.of(varying, patches.vertices)
    for i, candidate in enumerate(candidates):
        report = subrange(progress, i * share, share)
        weight, risk, curve = search_weight(on, counted, found, candidate, report, lowest=lowest, locally=locally)
        minima.append(ConsideredWeight(weight, i, risk))
        considered += [ConsideredWeight(w, i, r) for w, r in curve]
    best = min(minima, key=lambda each: each.risk)
    if not is_wide and best.weight < _NARROW:
        wide = widen_patches(ops, patches, mask)
        on, candidate = wide.ops, candidates[best.low_pass]
        found = replace(found, normals=compute_guide_normals(on, noise.level))
        locally = None if varying is None else LocalProbe.of(varying, wide.vertices)
        weight, risk, curve = search_weight(on, wide.counted, found, candidate, guess=best.weight / 2, locally=locally)
        best = ConsideredWeight(weight, best.low_pass, risk)
        considered = [ConsideredWeight(w, best.low_pass, r) for w, r in curve]
    return WeightChoice(best.weight, best.risk, noise, best.low_pass, tuple(considered), varying)


def _choose_within_voxels(ops: Operators, counted: Booleans, voxels: Voxels) -> float:
    """The smallest weight with which nearly all vertices stay as near as the true surface is.

    With the heat response of :data:`STAIRCASE_WAVELENGTH`, :data:`STAIRCASE_ITERATIONS` times.
    """
    X, constraints = ops.positions, _hold(ops, None)
    remove = CandidateLowPass(Heat().family, STAIRCASE_WAVELENGTH).remover(ops, MIN_WEIGHT)
    most = _MAX_HALVES_OF_CORNERS if voxels.has_corners else _MAX_HALVES

    def is_within(weight: float) -> bool:
        shape = X
        for _ in range(STAIRCASE_ITERATIONS):
            change, start = remove(shape)
            shape = reconstruct(ops.L, ops.gram, shape, weight, change, GUIDE_RTOL, start, constraints)
        return float(np.quantile(voxels.measure(shape - X)[counted], _WITHIN)) <= most

    low, high = np.log(MIN_WEIGHT), np.log(_MAX_WEIGHT_OF_STAIRCASE)
    while high - low > _ACCURACY:
        middle = (low + high) / 2
        low, high = (low, middle) if is_within(float(np.exp(middle))) else (middle, high)
    return float(np.exp(high))


@dataclass(frozen=True, eq=False)
class LocalProbe:
    """Noise that varies, on patches.

    Attributes
    ----------
    level : (k,) float64
        Standard deviation, relative to the level of the noise.
    profile : (k,) float64
        Weights, relative to the one that is searched for.
    begin : float
        A first guess of it.
    """

    level: Floats
    profile: Floats
    begin: float

    @staticmethod
    def of(varying: VaryingNoise, vertices: npt.NDArray[np.int64]) -> LocalProbe:
        """On some vertices."""
        level = np.where(varying.is_noisy, varying.level, 0.0)[vertices] / varying.noise.level
        return LocalProbe(level, compute_profile(varying)[vertices], initial_weight(_mean_relative(varying)))


def search_weight(
    ops: Operators,
    counted: Booleans,
    found: NoiseEstimate,
    candidate: CandidateLowPass,
    progress: Progress | None = None,
    guess: float | None = None,
    lowest: float = MIN_WEIGHT,
    locally: LocalProbe | None = None,
) -> tuple[float, float, list[tuple[float, float]]]:
    """Weight and risk at the minimum for one low-pass, and all that were evaluated, from a guess on."""
    noise, n = found.noise, found.normals
    if noise.level <= _MIN_LEVEL * ops.mean_edge:
        return initial_weight(0.0), noise.level**2, []
    z, gram = sample(ops.L, n, noise, _SEED), ops.gram
    begin = initial_weight(noise.level / ops.mean_edge)
    if locally is not None:
        z *= locally.level[:, None]
        gram = weighted_gram_of_barycenters(ops.faces, ops.L.size, locally.profile[ops.faces].mean(axis=1))
        begin = locally.begin
    begin = begin if guess is None else guess
    remove = candidate.remover(ops, MIN_WEIGHT)
    constraints = _hold(ops, None if locally is None else locally.level == 0)
    both = ops.positions, z
    removed = _in_threads(remove, both)
    curve: list[tuple[float, float]] = []

    def risk(log_weight: float) -> float:
        weight = float(np.exp(log_weight))

        def apply(given: tuple[Floats, tuple[Floats, Floats | None]]) -> Floats:
            X, (change, start) = given
            return reconstruct(ops.L, gram, X, weight, change, GUIDE_RTOL, start, constraints)

        shape, filtered = _in_threads(apply, zip(both, removed, strict=True))
        moved = ((shape - ops.positions) * n).sum(axis=1)[counted]
        value, _ = compute_risk(moved, z[counted], filtered[counted])
        curve.append((weight, value))
        if progress is not None:
            progress(1 - _REMAINING ** len(curve))
        return value

    log_weight, least = _minimize(risk, float(np.log(begin)), _RISK_TOLERANCE, lowest)
    return float(np.clip(np.exp(log_weight), MIN_WEIGHT, MAX_WEIGHT)), least, curve


def _in_threads(work: Callable[[Any], Any], items: Iterable[Any]) -> list[Any]:
    """The results for some items, each in a thread: patches are too small to be split."""
    items = list(items)
    results = [None] * len(items)

    def run(k: int) -> None:
        results[k] = work(items[k])

    blocks.map_threads(run, range(len(items)))
    return results


def _hold(ops: Operators, still: Booleans | None) -> Constraints | None:
    """Hold the boundary, as that of patches would be pulled inward, and what is smoothed next to it; and what is still.

    ``still``: (k,) vertices without noise, where it varies.
    """
    if len(ops.boundary_vertices) == 0 and still is None:
        return None
    rows = np.ones((ops.L.size, 1))
    rows[ops.boundary_vertices] = 0.0
    free = rows if still is None else rows * ~still[:, None]
    return Constraints(free, rows, np.zeros((ops.L.size, 3)))


def _minimize(risk: Callable[[float], float], start: float, tolerance: float, lowest: float) -> tuple[float, float]:
    """The minimum of the risk near ``start``, and the lowest argument whose root is within ``tolerance`` of it."""
    step = float(np.log(_STEP))
    x = [start - step, start, start + step]
    y = [risk(at) for at in x]
    for _ in range(_MAX_STEPS):
        if y[1] <= min(y) or not np.log(lowest) < x[0] < x[2] < np.log(MAX_WEIGHT):
            break
        if y[0] < y[2]:
            x = [x[0] - step, *x[:2]]
            y = [risk(x[0]), *y[:2]]
        else:
            x = [*x[1:], x[2] + step]
            y = [*y[1:], risk(x[2])]
    curvature, slope = (y[0] - 2 * y[1] + y[2]) / 2, (y[2] - y[0]) / 2
    if y[1] > min(y) or not curvature > 0:
        at = int(np.argmin(y))
        return x[at], y[at]
    least = y[1] - slope**2 / (4 * curvature)
    lower = np.sqrt(((1 + tolerance) ** 2 - 1) * max(least, 0.0) / curvature)
    return x[1] + step * float(-slope / (2 * curvature) - min(lower, 0.5)), least

"""Level and kind of the noise along the normals, measured on a mesh with its operators.

The residual is the component of L^2 V along the normals of a smoothed guide, divided by the norms of the rows of L^2,
so that white noise of standard deviation s has standard deviation s at every vertex. L^2 leaves nearly nothing of a
smooth shape: of the curvature, which L leaves, only its change. The median of the residual is insensitive to the few
vertices at sharp edges.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from meshlab_specsmooth.arrays import Booleans, Floats
from meshlab_specsmooth.geometry.triangles import compute_vertex_normals
from meshlab_specsmooth.noise.classify import (
    classify,
    compute_noise_fraction,
    compute_quantization_std,
    describe_terraces,
    find_doubt,
    fit_covariance,
    split_white_correlated,
)
from meshlab_specsmooth.noise.model import CORRELATED, IMPULSE, NEGLIGIBLE, QUANTIZED, STAIRCASE, Noise
from meshlab_specsmooth.noise.scales import (
    bilaplacian_row_norms,
    compute_levels,
    filter_by_bands,
    filter_by_powers,
)
from meshlab_specsmooth.noise.voxels import Voxels, find_voxels
from meshlab_specsmooth.operators.assemble import Operators
from meshlab_specsmooth.operators.patches import MIN_VERTICES
from meshlab_specsmooth.operators.reconstruction import reconstruct

# On a regular mesh with noise of s edges the weight 0.07 / s removes nearly all of it (measured).
# docs/constants.md: WEIGHT_TIMES_LEVEL
WEIGHT_TIMES_LEVEL = 0.07

MIN_WEIGHT, MAX_WEIGHT = 0.005, 1000.0

# Relative error allowed in the displacement of surfaces that only serve an estimate, which scatters by far more.
# docs/constants.md: GUIDE_RTOL
GUIDE_RTOL = 1e-2

MAD_OF_UNIT_NORMAL = 0.6744897501960817  # median of the absolute value of a standard normal

_SEED = 20251

# Rounding to a lattice leaves its error at most vertices, so the median shows it; the rings of a turned part lie on a
# lattice as well.
# docs/constants.md: _MIN_OF_ROUNDING
_MIN_OF_ROUNDING = 0.4

# The estimate's standard error is this over the root of the number of vertices: the residuals of L^2 at neighbors are
# correlated, so that there are half as many independent ones as vertices. The remainder is the bias due to the guide
# and the shape.
# docs/constants.md: _STANDARD_ERROR
_STANDARD_ERROR = 1.25
# docs/constants.md: _BIAS
_BIAS = 0.03


@dataclass(frozen=True, eq=False)
class NoiseEstimate:
    """Noise in the units of the positions, and the normals that it was measured along.

    Attributes
    ----------
    noise : Noise
    normals : (k, 3) float64
        Of the smoothed guide.
    voxels : Voxels or None
        Of the mask that the surface was made from, if it is a staircase.
    """

    noise: Noise
    normals: Floats
    voxels: Voxels | None = None


def estimate(ops: Operators, counted: Booleans, voxels: Voxels | None = None) -> NoiseEstimate:
    """Estimate level and kind of the noise.

    Parameters
    ----------
    ops : Operators
        Uniform: with it the noise of every vertex weighs the same.
    counted : (k,) bool
        Vertices that are measured, see :func:`meshlab_specsmooth.operators.patches.find_interior`.
    voxels : Voxels, optional
        Of the mask that the surface was made from, where these are known; recognized otherwise.
    """
    X, L = ops.positions, ops.L
    if ops.mean_edge == 0:
        return NoiseEstimate(Noise.zero(ops.mean_edge), compute_vertex_normals(X, ops.faces))
    if len(X) < MIN_VERTICES:
        noise = Noise.zero(ops.mean_edge).unclear(ops.mean_edge, f"there are fewer than {MIN_VERTICES} vertices")
        return NoiseEstimate(noise, compute_vertex_normals(X, ops.faces))
    white = np.random.default_rng(_SEED).standard_normal(X.shape)
    level, normals, residual, peakedness = _level_by_fixed_point(ops, counted)
    powers, bands = filter_by_powers(L, X), filter_by_bands(L, X)
    white_powers, white_bands = filter_by_powers(L, white), filter_by_bands(L, white)
    levels_by_power = compute_levels(powers, white_powers, normals, counted)
    levels_by_band = compute_levels(bands, white_bands, normals, counted)
    residual, at = residual[counted], normals[counted]

    covariance, rms_level = fit_covariance(residual**2, at, level)
    square = float((residual**2).mean())
    kurtosis = float((residual**4).mean()) / square**2 - 3 if square > 0 else 0.0
    outliers = float((np.abs(residual) > 3 * max(level, np.finfo(np.float64).tiny)).mean())
    white_level, correlated_level = split_white_correlated(ops, counted, levels_by_band, white_bands, _SEED + 1)
    noise_fraction = compute_noise_fraction(levels_by_band)
    kind = classify(
        level,
        rms_level,
        noise_fraction,
        levels_by_power,
        levels_by_band,
        correlated_level,
        covariance,
        ops.mean_edge,
        int(counted.sum()),
        kurtosis,
    )
    rms_level, covariance = noise_fraction * rms_level, noise_fraction**2 * covariance
    standard_error = _STANDARD_ERROR / np.sqrt(len(residual))
    rounding = compute_quantization_std(X)
    expected = float(np.sqrt((at**2 @ rounding**2).mean()))
    # the mean square in L^4 sees impulses in full, and of shape the least
    along = (powers[-1] * normals).sum(axis=1)[counted]
    seen = float(np.sqrt((along**2).mean() / (white_powers[-1][counted] ** 2).mean()))
    is_rounded = level > _MIN_OF_ROUNDING * expected and 0.5 * expected < seen < 2 * expected
    if kind != CORRELATED and NEGLIGIBLE * ops.mean_edge < expected and is_rounded:
        # the error of rounding is known, but not normal: many vertices hardly move
        kind, rms_level, covariance = QUANTIZED, expected, np.diag(rounding**2)
    impulse_density = 1.0
    if kind == IMPULSE:
        rms_level = seen
        # the fourth moment of noise that a fraction p of the vertices has is 3 / p, and L^2 adds up some of them
        impulse_density = 3 / (3 + max(kurtosis, 0.0) / peakedness)
        # few vertices carry the variance
        standard_error *= np.sqrt(1 + max(kurtosis, 0.0) / 2)
    if kind == CORRELATED:
        rms_level, low, high = float(np.hypot(white_level, correlated_level)), 0.5, 2.0
    else:
        correlated_level = 0.0
        width = float(np.hypot(2 * standard_error, _BIAS))
        low, high = max(1 - width, 0.0), 1 + width
    noise = Noise(
        level=rms_level,
        low=low * rms_level,
        high=high * rms_level,
        kind=kind,
        mean_edge=ops.mean_edge,
        levels_by_power=levels_by_power,
        levels_by_band=levels_by_band,
        kurtosis=kurtosis,
        outliers=outliers,
        correlated_level=correlated_level,
        covariance=covariance / rms_level**2 if rms_level > 0 else np.zeros((3, 3)),
        impulse_density=impulse_density,
    )
    voxels = find_voxels(X, ops.faces) if voxels is None else voxels
    if voxels is not None:
        return NoiseEstimate(_describe_staircase(noise, voxels, at), normals, voxels)
    reason = find_doubt(ops, counted, noise, residual)
    if reason is not None:
        noise = noise.unclear(max(high * rms_level, level), reason)
    else:
        noise = replace(noise, reason=describe_terraces(ops, counted, noise))
    return NoiseEstimate(noise, normals)


def _describe_staircase(noise: Noise, voxels: Voxels, normals: Floats) -> Noise:
    """The error of a mask's surface: uniform within a voxel, along one axis at each vertex."""
    covariance = voxels.covariance()
    # the share of the vertices on lattice edges along an axis is that of the normals' components
    share = np.abs(normals @ voxels.axes.T)
    share /= np.maximum(share.sum(axis=1, keepdims=True), np.finfo(np.float64).tiny)
    variance = ((normals @ voxels.axes.T) ** 2 * share * voxels.spacing**2 / 12).sum(axis=1)
    level = float(np.sqrt(variance.mean()))
    return replace(
        noise,
        level=level,
        low=0.5 * level,
        high=2.0 * level,
        kind=STAIRCASE,
        correlated_level=0.0,
        impulse_density=1.0,
        covariance=covariance / level**2,
        spacing=tuple(voxels.spacing.tolist()),
    )


def initial_weight(level: float) -> float:
    """A first guess of the barycenter weight for noise of ``level`` mean edges."""
    return float(np.clip(WEIGHT_TIMES_LEVEL / max(level, 1e-6), 2 * MIN_WEIGHT, MAX_WEIGHT))


def compute_guide_normals(ops: Operators, level: float) -> Floats:
    """(k, 3) normals of the surface smoothed as noise of a level, in the units of the positions, asks for."""
    weight = min(initial_weight(level / ops.mean_edge), 1.0)  # a guide is smooth in any case
    guide = reconstruct(ops.L, ops.gram, ops.positions, max(weight, 0.1), rtol=GUIDE_RTOL)
    return compute_vertex_normals(guide, ops.faces)


def _level_by_fixed_point(ops: Operators, counted: Booleans) -> tuple[float, Floats, Floats, float]:
    """Level, normals of the guide, residual, and the mean of sum h^4 / (sum h^2)^2 over the rows h of L^2.

    The guide is smoothed as strongly as the last level asks for, which settles in two iterations.
    """
    X, L = ops.positions, ops.L
    norms, peakedness = bilaplacian_row_norms(L)
    twice = L @ (L @ X)
    level = 0.3 * ops.mean_edge
    for _ in range(3):
        normals = compute_guide_normals(ops, level)
        residual = (twice * normals).sum(axis=1) / norms
        level = float(np.median(np.abs(residual[counted]))) / MAD_OF_UNIT_NORMAL
    return level, normals, residual, peakedness

"""The kind of the noise, and reasons to doubt that it is noise at all."""

from __future__ import annotations

import numpy as np
from scipy.special import ndtr

from meshlab_specsmooth.arrays import Booleans, Floats, Integers
from meshlab_specsmooth.geometry.triangles import (
    compute_aspects,
    compute_face_vectors,
    compute_heights,
    sum_at_corners,
)
from meshlab_specsmooth.noise.model import (
    CORRELATED,
    DIRECTIONAL,
    IMPULSE,
    NEGLIGIBLE,
    NONE,
    QUANTIZED,
    WHITE,
    Noise,
)
from meshlab_specsmooth.noise.scales import correlate, filter_by_bands
from meshlab_specsmooth.operators.assemble import Operators

# Beyond this many standard deviations a residual is an outlier, or shape.
# docs/constants.md: _OUTLIER_SIGMAS
_OUTLIER_SIGMAS = 2.5

# Where impulses lie amid white noise the median rises less, but the residual has more than this kurtosis. Under less
# noise than that, in edges, sharp edges have it as well.
# docs/constants.md: _MIN_KURTOSIS_OF_IMPULSES, _MIN_LEVEL_OF_TAILS
_MIN_KURTOSIS_OF_IMPULSES, _MIN_LEVEL_OF_TAILS = 4.0, 0.05

# White noise is the same in L, L^2, L^3, L^4; the median of impulses, which only few vertices have, rises with the
# power, as every power spreads them over more vertices. By this factor, and by this many standard errors besides.
# docs/constants.md: _MIN_RISE_OF_IMPULSES
_MIN_RISE_OF_IMPULSES = 1.05
# docs/constants.md: _STANDARD_ERRORS
_STANDARD_ERRORS = 2.0

# For a smooth shape the band level decays at least 6x from the third band to the second and 3x from the fourth to the
# third (measured on clean surfaces); that of noise decays less. What remains of a band after subtracting the coarser
# one over these factors is noise. It is correlated where its variance exceeds that of the first band, and is higher
# again in the third.
# docs/constants.md: _SHAPE_BAND_DECAY
_SHAPE_BAND_DECAY = (6.0, 3.0)
# docs/constants.md: _MIN_OVER_FIRST_BAND, _MIN_OVER_SECOND_BAND
_MIN_OVER_FIRST_BAND, _MIN_OVER_SECOND_BAND = 1.1**2, 2.0

# A surface has normals because its waves decay faster than they shorten: from an octave to the next the amplitude more
# than doubles (the power of its modes falls faster than 1 / lambda^2). Below what is called noise in the shortest waves
# noise is correlated only where, over two octaves, it does not: then the normals are lost in longer waves.
# docs/constants.md: _GROWTH_OF_SHAPE
_GROWTH_OF_SHAPE = 2.0
_FINER_BAND, _COARSER_BAND = 2, 4

# Where triangles are coarse for the shape, its detail is in the first band too, and grows by this factor to the second
# (measured on clean scans and models of a few thousand vertices); noise grows by no more than its scatter.
# docs/constants.md: _GROWTH_OF_DETAIL, _SCATTER
_GROWTH_OF_DETAIL, _SCATTER = 1.6, 1.1

# Coordinates that are rounded to a lattice take few values, each many times.
# docs/constants.md: _MIN_LATTICE_STEPS, _MIN_VERTICES_PER_STEP
_MIN_LATTICE_STEPS, _MIN_VERTICES_PER_STEP = 8, 4

# Half of the triangles longer than this against their altitude: the uniform Laplacian sees their shape as noise. White
# noise of half an edge on even triangles gives a median of 2 to 3, adaptive meshes have 2, stretched ones 3 to 5.
# docs/constants.md: _MAX_ASPECT
_MAX_ASPECT = 6.0

# Detail of a coarse shape resembles correlated noise, but grows from band to band like shape, and is as high in L^4 as
# in L^2, where correlated noise decays (measured on decimated models; noise correlated over two edges or more).
# docs/constants.md: _GROWTH_OF_COARSE
_GROWTH_OF_COARSE = (2.6, 2.1)
# docs/constants.md: _MIN_LEVEL_RATIO
_MIN_LEVEL_RATIO = 0.85
# docs/constants.md: _MAX_OUTLIERS
_MAX_OUTLIERS = 0.1  # where only a part of the surface has noise there are more

# White noise leaves a hundredth of the corners within this fraction of its level of the plane of the next face. Where
# it is a fifth, the faces are flat by design. Staircases of masks have such faces too, but even triangles, and no
# shape that dominates within two octaves.
# docs/constants.md: _FLAT_HEIGHT, _MAX_FLAT
_FLAT_HEIGHT, _MAX_FLAT = 0.02, 0.2
# docs/constants.md: _MAX_ASPECT_OF_FLAT
_MAX_ASPECT_OF_FLAT = 3.5
# docs/constants.md: _GROWTH_OF_FLAT
_GROWTH_OF_FLAT = 2.2

# Corners within a millionth of an edge of the plane of the next face are exact. On a surface of revolution made of
# quadrilaterals it is every diagonal, a third of the edges, and more at its caps; on a mask's surface more than two
# thirds are, and with noise none.
# docs/constants.md: _EXACT_HEIGHT, _EXACT_FRACTIONS
_EXACT_HEIGHT, _EXACT_FRACTIONS = 1e-6, (0.3, 0.68)

# Of the largest tenth of the deviations of an exact model a third and more are equal to others, to a millionth of an
# edge; of impulses hardly any, and a tenth where a flat part has many of one height. A lattice keeps some symmetry, of
# 16 copies about an axis; a turned part has more.
# docs/constants.md: _LARGEST, _REPEATED, _MAX_REPEATS
_LARGEST, _REPEATED, _MAX_REPEATS = 0.9, 1e-6, {IMPULSE: 0.25, QUANTIZED: 0.95}

# Noise of more edges than this has lost the surface: it is a coarse shape.
# docs/constants.md: _MAX_LEVEL
_MAX_LEVEL = 1.0

# Sums of the faces' vectors at a vertex that are smaller than this fraction of their areas cancel.
_CANCELED = 1e-6

# Eigenvalues of the covariance of isotropic noise are within a factor of two of their mean, and the median and the mean
# square of its residual agree.
# docs/constants.md: _MIN_ANISOTROPY, _MAX_RMS_OVER_MAD
_MIN_ANISOTROPY, _MAX_RMS_OVER_MAD = 2.0, 1.1

# Regularization of the covariance, as a fraction of the mean level: where normals see only few directions (on a box
# only those at its edges see more than axes), the others get the mean level.
# docs/constants.md: _RIDGE
_RIDGE = 0.03


def split_white_correlated(
    ops: Operators, counted: Booleans, levels_by_band: tuple[float, ...], white: list[Floats], seed: int
) -> tuple[float, float]:
    """Standard deviations of the white and of the correlated part of the noise; the latter is 0 for white noise.

    ``white`` holds the bands of white noise.
    """
    first = levels_by_band[0] ** 2
    second, third = (
        max(levels_by_band[i] ** 2 - (levels_by_band[i + 1] / _SHAPE_BAND_DECAY[i - 1]) ** 2, 0.0) for i in (1, 2)
    )
    if second <= _MIN_OVER_FIRST_BAND * first or third <= _MIN_OVER_SECOND_BAND * second:
        return levels_by_band[0], 0.0
    correlated = correlate(ops.L, np.random.default_rng(seed).standard_normal(ops.positions.shape))
    # its variance in the bands, relative to white noise; two bands, two unknowns; the first bounds the white part
    in_second, in_third = (
        float((other[counted] ** 2).mean() / (reference[counted] ** 2).mean())
        for other, reference in list(zip(filter_by_bands(ops.L, correlated, 3), white, strict=False))[1:]
    )
    variance = max((third - second) / (in_third - in_second), 0.0)
    white_variance = min(max(second - variance * in_second, 0.0), first)
    return float(np.sqrt(white_variance)), float(np.sqrt(variance))


def fit_covariance(squares: Floats, normals: Floats, level: float) -> tuple[Floats, float]:
    """The covariance S that makes n^T S n the variance along the normals n, and the root of its mean.

    Least squares, weighted by the inverse variance; residuals beyond 2.5 standard deviations are excluded, and the
    variance is corrected for that as for normal noise, until nothing changes.
    """
    x, y, z = normals.T
    rows = np.stack([x * x, y * y, z * z, 2 * x * y, 2 * x * z, 2 * y * z], axis=1)
    isotropic = np.array([1.0, 1, 1, 0, 0, 0])
    density = np.exp(-(_OUTLIER_SIGMAS**2) / 2) / np.sqrt(2 * np.pi)
    kept_variance = 1 - 2 * _OUTLIER_SIGMAS * density / (2 * ndtr(_OUTLIER_SIGMAS) - 1)
    variance = np.full(len(normals), level**2)
    entries = level**2 * isotropic
    for _ in range(12):
        mean = variance.mean()
        if not mean > 0:
            break
        kept = squares < _OUTLIER_SIGMAS**2 * variance
        if not kept.any():
            break
        weighted = rows[kept] / np.maximum(variance[kept], 0.05 * mean)[:, None]
        matrix = weighted.T @ rows[kept]
        ridge = _RIDGE * np.trace(matrix) / 6
        entries = np.linalg.solve(
            matrix + ridge * np.eye(6), weighted.T @ squares[kept] / kept_variance + ridge * mean * isotropic
        )
        variance = rows @ entries
        variance = np.maximum(variance, 0.02 * max(float(variance.mean()), 0.0))
    xx, yy, zz, xy, xz, yz = entries
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]), float(np.sqrt(max(variance.mean(), 0.0)))


def compute_quantization_std(X: Floats) -> Floats:
    """(3,) standard deviation of rounding to the lattice of the coordinates, step / sqrt(12); 0 without a lattice."""
    steps = np.zeros(3)
    for axis, column in enumerate(X.T):
        values = np.unique(column)
        gaps = np.diff(values)
        gaps = gaps[gaps > 1e-9 * (values[-1] - values[0])]
        if len(gaps) < _MIN_LATTICE_STEPS or len(values) * _MIN_VERTICES_PER_STEP > len(column):
            continue
        multiples = gaps / gaps.min()
        if (np.abs(multiples - np.rint(multiples)) < 1e-3 * multiples).all():
            steps[axis] = gaps.min()
    return np.asarray(steps / np.sqrt(12))


def compute_noise_fraction(levels_by_band: tuple[float, ...]) -> float:
    """The fraction of the level in the first band that is white noise, not detail of the shape."""
    first, second = levels_by_band[:2]
    return float(fraction_by_growth(np.array(second / first))) if first else 1.0


def fraction_by_growth(growth: Floats) -> Floats:
    """The same for the growth b_1 / b_0 of the level from the first band to the second.

    b_0^2 = s^2 + d^2 and b_1^2 = (c s)^2 + (g d)^2 with a detail d that grows g-fold from a band to the next, and noise
    that seems to grow c-fold at most.
    """
    detail, scatter = _GROWTH_OF_DETAIL**2, _SCATTER**2
    return np.asarray(np.sqrt(np.clip((detail - growth**2) / (detail - scatter), 0.0, 1.0)))


def classify(
    level: float,
    rms_level: float,
    noise_fraction: float,
    levels_by_power: tuple[float, ...],
    levels_by_band: tuple[float, ...],
    correlated_level: float,
    covariance: Floats,
    mean_edge: float,
    count: int,
    kurtosis: float,
) -> str:
    """The kind of noise by its evidence at ``count`` vertices, except ``"quantized"`` and ``"unclear"``."""
    error = _STANDARD_ERRORS / np.sqrt(count)
    growth = _GROWTH_OF_SHAPE ** (_COARSER_BAND - _FINER_BAND)
    grows = levels_by_band[_COARSER_BAND] >= growth * levels_by_band[_FINER_BAND]
    if correlated_level and not (max(level, rms_level) < NEGLIGIBLE * mean_edge and grows):
        return CORRELATED
    if noise_fraction * max(level, rms_level) < NEGLIGIBLE * mean_edge:
        return NONE
    has_tails = kurtosis > _MIN_KURTOSIS_OF_IMPULSES and level > _MIN_LEVEL_OF_TAILS * mean_edge
    rise = 1.0 if has_tails else _MIN_RISE_OF_IMPULSES
    if levels_by_power[3] > (rise + error) * levels_by_power[1]:
        return IMPULSE
    eigenvalues = np.linalg.eigvalsh(covariance)
    is_anisotropic = eigenvalues[-1] > _MIN_ANISOTROPY * np.trace(covariance) / 3
    if is_anisotropic and rms_level > _MAX_RMS_OVER_MAD * level:
        return DIRECTIONAL
    return WHITE


def find_doubt(ops: Operators, counted: Booleans, noise: Noise, residual: Floats) -> str | None:
    """The reason why noise that was measured at the vertices that count may be shape; None if there is none."""
    faces = _find_counted_faces(ops, counted)
    if _is_two_sided(ops):
        return "faces that look opposite ways lie upon each other"
    if noise.kind == NONE:
        return None
    aspect = float(np.median(compute_aspects(ops.positions, faces))) if len(faces) else np.inf
    if aspect > _MAX_ASPECT:
        return f"half of the triangles are more than {_MAX_ASPECT:.0f} times as long as high"
    if noise.level > _MAX_LEVEL * ops.mean_edge:
        return "the measured level is larger than the triangles"
    first, second, third = noise.levels_by_band[1:4]
    grows = second > _GROWTH_OF_COARSE[0] * first and third > _GROWTH_OF_COARSE[1] * second
    is_steady = noise.levels_by_power[3] > _MIN_LEVEL_RATIO * noise.levels_by_power[1]
    if noise.kind == CORRELATED and grows and is_steady and noise.outliers < _MAX_OUTLIERS:
        return "the shape has detail as fine as the triangles"
    if noise.kind in (IMPULSE, QUANTIZED):
        repeats = _compute_repeats(residual, _REPEATED * ops.mean_edge) > _MAX_REPEATS[noise.kind]
        return "the largest deviations repeat exactly, as at the edges of a CAD model" if repeats else None
    heights = np.abs(compute_heights(ops.positions, faces))
    low, high = _EXACT_FRACTIONS
    exact = float((heights < _EXACT_HEIGHT * ops.mean_edge).mean()) if len(heights) else 0.0
    if low < exact < high:
        return f"{100 * exact:.0f} % of the edges are exactly flat, as in a CAD model"
    flat = _compute_flat_fraction(heights, noise)
    grows = noise.levels_by_band[3] > _GROWTH_OF_FLAT * noise.levels_by_band[2]
    if flat > _MAX_FLAT and (aspect > _MAX_ASPECT_OF_FLAT or grows):
        return f"{100 * flat:.0f} % of the edges are exactly flat, as in a CAD model, and the rest is too coarse"
    return None


def describe_terraces(ops: Operators, counted: Booleans, noise: Noise) -> str | None:
    """That the noise has the flat faces of a mask's staircase; None if it has not."""
    if noise.kind not in (WHITE, DIRECTIONAL):
        return None
    faces = _find_counted_faces(ops, counted)
    flat = _compute_flat_fraction(np.abs(compute_heights(ops.positions, faces)), noise)
    if flat <= _MAX_FLAT:
        return None
    return f"{100 * flat:.0f} % of the edges are exactly flat, as on the terraces of a mask"


def _find_counted_faces(ops: Operators, counted: Booleans) -> Integers:
    """All faces, or where most of the vertices do not count, those between vertices that do."""
    return ops.faces if 2 * counted.sum() > len(counted) else ops.faces[counted[ops.faces].all(axis=1)]


def _compute_flat_fraction(heights: Floats, noise: Noise) -> float:
    return float((heights < _FLAT_HEIGHT * noise.level).mean()) if len(heights) else 0.0


def _compute_repeats(residual: Floats, tolerance: float) -> float:
    """The fraction of the largest sizes that equal the next, as on an exact model; those of impulses do not."""
    sizes = np.sort(np.abs(residual))
    gaps = np.diff(sizes[sizes >= np.quantile(sizes, _LARGEST)])
    return float((gaps < tolerance).mean()) if len(gaps) else 0.0


def _is_two_sided(ops: Operators) -> bool:
    """Whether the faces at most vertices cancel each other: then there are no normals."""
    F, n = ops.faces, len(ops.positions)
    vectors = compute_face_vectors(ops.positions, F)
    areas = np.bincount(F.ravel(), np.repeat(np.linalg.norm(vectors, axis=1), 3), n)
    canceled = np.linalg.norm(sum_at_corners(vectors, F, n), axis=1) < _CANCELED * areas
    return bool(2 * canceled.sum() > n)

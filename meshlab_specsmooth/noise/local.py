"""Noise that varies over the surface: its level as a field.

The residual of :mod:`meshlab_specsmooth.noise.estimate` is averaged over a neighborhood, by its logarithm: that is as
accurate as the median, and few large values at sharp edges hardly move it. Detail of the shape is recognized by its
growth from the first band to the second. Levels are relative to the edges there, by which a filter must be as strong as
the noise is high.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from meshlab_specsmooth.arrays import Booleans, Floats
from meshlab_specsmooth.geometry.triangles import compute_vertex_normals
from meshlab_specsmooth.graph.laplacian import spread_highest
from meshlab_specsmooth.noise.classify import fraction_by_growth
from meshlab_specsmooth.noise.estimate import GUIDE_RTOL, estimate
from meshlab_specsmooth.noise.model import DIRECTIONAL, NEGLIGIBLE, WHITE, Noise
from meshlab_specsmooth.noise.scales import bilaplacian_row_norms, filter_by_bands, walk
from meshlab_specsmooth.operators.assemble import Operators
from meshlab_specsmooth.operators.patches import MIN_COUNTED, draw_patches, draw_spots, find_interior
from meshlab_specsmooth.operators.reconstruction import reconstruct

# Steps of the lazy random walk that a neighborhood spans: some 130 vertices, within 4 edges; for the growth, which is a
# quotient, 400.
# docs/constants.md: _STEPS, _STEPS_OF_GROWTH
_STEPS, _STEPS_OF_GROWTH = 18, 60

# Of ln |x| for a standard normal x: -(ln 2 + Euler's constant) / 2.
_MEAN_OF_LOG = -0.6351814227307392

# Smaller levels, in edges, are alike.
_LOWEST = 1e-4

# The weight of the guide.
_GUIDE_WEIGHT = 0.3

# Of levels in the same noise, those that two of a hundred vertices exceed are no more than three times as high as those
# that all but two exceed.
# docs/constants.md: _MIN_RATIO, _SHARE
_MIN_RATIO, _SHARE = 4.0, 0.02

# Where the noise is highest, at least this fraction of the level must be noise and not detail of the shape.
# docs/constants.md: _MIN_FRACTION
_MIN_FRACTION = 0.9

# The variance along a normal across which there is no noise, relative to the mean.
_MIN_VARIANCE = 1e-3

# Bands of the level with a smaller share of the vertices are treated as the next one.
# docs/constants.md: _MIN_SHARE_OF_BAND
_MIN_SHARE_OF_BAND = 0.08

# The level changes within a neighborhood where noise ends: the highest within so many rings counts, and where it is
# this many times the lowest, nothing is measured.
# docs/constants.md: _RINGS, _MAX_STEP
_RINGS, _MAX_STEP = 4, 2.0

# Meshes of more vertices are only measured everywhere where spots from all over them differ.
_MAX_MEASURED = 20_000


@dataclass(frozen=True, eq=False)
class LocalLevel:
    """The level at the vertices.

    Attributes
    ----------
    seen : (k,) float64
        Level of all that is as fine as the triangles, noise or detail, in edges of the neighborhood.
    noise : (k,) float64
        Level without the detail of the shape, in the same unit.
    edge : (k,) float64
        Mean edge in the neighborhood, in the units of the positions.
    normals : (k, 3) float64
        Of the smoothed guide.
    """

    seen: Floats
    noise: Floats
    edge: Floats
    normals: Floats


@dataclass(frozen=True, eq=False)
class VaryingNoise:
    """Noise that is not the same everywhere, or is so, but not relative to the edges (then ``noise.varies`` is False).

    Attributes
    ----------
    noise : Noise
        Where it is high; its level is the root mean square over the vertices with noise.
    level : (k,) float64
        In the units of the positions.
    relative : (k,) float64
        The highest level within a few rings, in edges of the neighborhood: what the strength goes by.
    is_noisy : (k,) bool
        The others are left as they are.
    is_steady : (k,) bool
        Where noise does not end or begin.
    """

    noise: Noise
    level: Floats
    relative: Floats
    is_noisy: Booleans
    is_steady: Booleans


def measure_local_level(ops: Operators, counted: Booleans) -> LocalLevel:
    """The level at every vertex, from the vertices that count in its neighborhood.

    Parameters
    ----------
    ops : Operators
        Uniform.
    counted : (k,) bool
        As for :func:`meshlab_specsmooth.noise.estimate.estimate`.
    """
    X, L = ops.positions, ops.L
    tiny = np.finfo(np.float64).tiny
    guide = reconstruct(L, ops.gram, X, _GUIDE_WEIGHT, rtol=GUIDE_RTOL)
    normals = compute_vertex_normals(guide, ops.faces)
    norms, _ = bilaplacian_row_norms(L)
    edge = _mean_edges(ops)
    weight = counted.astype(np.float64)

    def log_of(along: Floats) -> Floats:
        shares = np.abs((along * normals).sum(axis=1)) / np.maximum(edge, tiny)
        return np.asarray(np.log(np.maximum(shares, _LOWEST)) * weight)

    residual = log_of((L @ (L @ X)) / norms[:, None])
    first, second = (log_of(band) for band in filter_by_bands(L, X, 2))
    draws = np.empty_like(X)
    draws[np.lexsort(X.T)] = np.random.default_rng(0).standard_normal(X.shape)  # the same for any order
    white = filter_by_bands(L, draws, 2)
    growth_of_white = float(np.subtract(*(np.log(np.abs(band) + tiny).mean() for band in reversed(white))))
    mean, share, log_edge = walk(L, np.stack([residual, weight, np.log(edge)], axis=1), _STEPS).T
    grown, wide, _ = walk(L, np.stack([second - first, weight, weight], axis=1), _STEPS_OF_GROWTH).T

    def per(total: Floats, count: Floats) -> Floats:
        return np.asarray(np.divide(total, count, out=np.full(len(X), np.log(_LOWEST)), where=count > 1e-6))

    seen = np.exp(per(mean, share) - _MEAN_OF_LOG)
    fraction = fraction_by_growth(np.exp(np.maximum(per(grown, wide), -1.0) - growth_of_white))
    return LocalLevel(seen, seen * fraction, np.exp(log_edge), normals)


def find_varying_noise(ops: Operators, mask: Booleans | None = None) -> VaryingNoise | None:
    """The noise as a field; None where it is the same everywhere, or cannot be measured in parts.

    Parameters
    ----------
    ops : Operators
    mask : (k,) bool, optional
        Vertices that count.
    """
    if len(ops.positions) < 5 * MIN_COUNTED or ops.mean_edge == 0:
        return None
    if len(ops.positions) > _MAX_MEASURED:
        spots = draw_spots(ops, mask)
        if not _differs(measure_local_level(spots.ops, spots.counted).seen, spots.counted):
            return None
    counted = find_interior(ops, mask)
    local = measure_local_level(ops, counted)
    if not _differs(local.seen, counted):
        return None
    highest = float(np.quantile(local.noise[counted], 1 - _SHARE))
    is_high = counted & (local.noise > highest / 2)
    if is_high.sum() < MIN_COUNTED:
        return None
    fraction = float(np.median(local.noise[is_high] / local.seen[is_high]))
    if highest < 2 * NEGLIGIBLE or fraction < _MIN_FRACTION:
        return None
    if _is_of_direction(ops, local, counted, mask):
        return None
    is_of_edges = not _differs(local.noise * local.edge, counted)
    patches = draw_patches(ops, mask if is_of_edges else is_high)
    noise = estimate(patches.ops, patches.counted).noise
    if noise.kind not in (WHITE, DIRECTIONAL):
        return None
    if is_of_edges:
        everywhere = np.ones(len(counted), dtype=np.bool_)
        return VaryingNoise(noise, np.full(len(counted), noise.level), noise.level / local.edge, everywhere, everywhere)
    # the logarithms' mean is that of normal noise in one direction; the estimate knows better
    relative = local.noise * (noise.level / root_mean_square(local.noise[is_high] * local.edge[is_high]))
    around, least = spread_highest(ops.L, relative, _RINGS), -spread_highest(ops.L, -relative, _RINGS)
    is_noisy = around > NEGLIGIBLE
    level = relative * local.edge
    rms = root_mean_square(level[is_noisy & counted])
    scaled = replace(
        noise, level=rms, low=noise.low * rms / noise.level, high=noise.high * rms / noise.level, varies=True
    )
    is_steady = is_noisy & (around < _MAX_STEP * least)
    return VaryingNoise(scaled, level, np.where(is_noisy, around, relative), is_noisy, is_steady)


def _is_of_direction(ops: Operators, local: LocalLevel, counted: Booleans, mask: Booleans | None) -> bool:
    """Whether noise along one direction explains that its level along the normals varies."""
    patches = draw_patches(ops, mask)
    noise = estimate(patches.ops, patches.counted).noise
    if noise.kind != DIRECTIONAL:
        return False
    variance = np.einsum("ni,ij,nj->n", local.normals, noise.covariance, local.normals)
    logs = np.log(np.maximum(variance, _MIN_VARIANCE)) / 2
    expected = np.exp(walk(ops.L, np.repeat(logs[:, None], 3, axis=1), _STEPS)[:, 0])
    return not _differs(local.seen * local.edge / expected, counted)


def _differs(level: Floats, counted: Booleans) -> bool:
    low, high = np.quantile(level[counted], [_SHARE, 1 - _SHARE])
    return bool(high > _MIN_RATIO * low)


def root_mean_square(x: Floats) -> float:
    """The root of the mean of the squares."""
    return float(np.sqrt((x**2).mean()))


def _mean_edges(ops: Operators) -> Floats:
    """(k,) mean length of the edges at each vertex, of each face's sides."""
    X, F, n = ops.positions, ops.faces, len(ops.positions)
    total, count = np.zeros(n), np.zeros(n)
    for k in range(3):
        i, j = F[:, k], F[:, k - 1]
        length = np.linalg.norm(X[i] - X[j], axis=1)
        total += np.bincount(i, length, n) + np.bincount(j, length, n)
        count += np.bincount(i, minlength=n) + np.bincount(j, minlength=n)
    return np.asarray(np.maximum(total, np.finfo(np.float64).tiny) / np.maximum(count, 1))


def split_by_level(varying: VaryingNoise) -> list[tuple[Booleans, Floats]]:
    """Bands of the level, an octave each: the vertices that are in one, and (k,) shares of it in every vertex.

    The shares of all bands add up to 1 where there is noise, and are 0 elsewhere.
    """
    octave = np.log2(np.maximum(varying.relative, np.finfo(np.float64).tiny))
    highest = float(np.quantile(octave[varying.is_noisy], 1 - _SHARE))
    count = int(max(highest - np.log2(NEGLIGIBLE), 0.0)) + 1
    centers = highest - np.arange(count)
    nearest = np.abs(octave[:, None] - centers).argmin(axis=1)
    steady = varying.is_steady if varying.is_steady.sum() >= MIN_COUNTED else varying.is_noisy
    sizes = np.bincount(nearest[steady], minlength=count)
    enough = sizes >= max(MIN_COUNTED, _MIN_SHARE_OF_BAND * int(steady.sum()))
    enough[int(sizes.argmax())] = True
    centers = centers[enough][::-1]
    nearest = np.abs(octave[:, None] - centers).argmin(axis=1)
    # linear between the centers
    shares = [np.interp(octave, centers, row) for row in np.eye(len(centers))]
    return [(steady & (nearest == k), share * varying.is_noisy) for k, share in enumerate(shares)]


def describe_varying(varying: VaryingNoise) -> str | None:
    """A sentence for the warning of a result; None where it is only the edges that vary."""
    if not varying.noise.varies:
        return None
    low, high = np.quantile(varying.relative[varying.is_noisy], [0.1, 0.9])
    still = 1 - float(varying.is_noisy.mean())
    text = f"the noise varies over the surface, from {low:.2g} to {high:.2g} edges; each place is smoothed by its own"
    return text if still < 0.005 else f"{text}, and {100 * still:.0f} % of the vertices, without noise, are left alone"

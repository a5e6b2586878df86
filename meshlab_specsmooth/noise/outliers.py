"""Single stray vertices: found one by one, whatever the noise of the rest, and moved to where their neighbors are.

A few spikes leave the median of the noise as it is, but they dominate the mean square by which a strength is chosen, so
they are removed before anything else is measured. Where many vertices are far off, the noise is impulse noise, and is
clipped instead (:func:`meshlab_specsmooth.risk.impulses.clip_impulses`).
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from meshlab_specsmooth.arrays import Floats
from meshlab_specsmooth.graph.laplacian import Laplacian, neighbors_of
from meshlab_specsmooth.runtime import blocks

# The distance of a stray vertex from the mean of its neighbors exceeds the median distance by the first factor, the
# edges around it by the second, and the second largest distance among its neighbors (each without the stray) by the
# third. Corners and tips of sampled shapes stay below an edge or two; a crease has two neighbors as far off.
# docs/constants.md: _MIN_OVER_MEDIAN
_MIN_OVER_MEDIAN = 8.0
# docs/constants.md: _MIN_OVER_EDGE
_MIN_OVER_EDGE = 1.5
# docs/constants.md: _MIN_OVER_NEIGHBORS
_MIN_OVER_NEIGHBORS = 3.0

# It lies out of the plane of its neighbors by more than this fraction of that distance, or is farther from the nearest
# of them than this many edges; hubs of flat fans are neither.
# docs/constants.md: _MIN_OUT_OF_PLANE, _MIN_OUT_OF_REACH
_MIN_OUT_OF_PLANE, _MIN_OUT_OF_REACH = 0.3, 1.5

# The number of neighbors: a tip where more triangles meet is part of the shape.
# docs/constants.md: _MAX_NEIGHBORS
_MIN_NEIGHBORS, _MAX_NEIGHBORS = 3, 16

# More than this fraction of the vertices are not strays but impulse noise.
# docs/constants.md: MAX_FRACTION
MAX_FRACTION = 0.03

# Candidates, which are tested one by one, exceed the mean edge around them by this factor.
# docs/constants.md: _MIN_OVER_MEAN_EDGE
_MIN_OVER_MEAN_EDGE = 1.0

# Two strays next to each other hide each other, so they are searched for repeatedly; as each other's neighbors, their
# positions converge in a few iterations.
# docs/constants.md: _MAX_SEARCHES
_MAX_SEARCHES = 3
_FILL_ITERATIONS = 5

# Positions are rounded to this many binary digits, so that they do not depend on the order of summation.
_DIGITS = 40


def replace_outliers(
    X: Floats, L: Laplacian, held: npt.NDArray[np.integer] | None = None, median: float | None = None
) -> tuple[Floats, npt.NDArray[np.int64]]:
    """Move stray vertices to where the bending of the surface around them is least.

    Parameters
    ----------
    X : (n, 3) float64
    L : Laplacian
        Uniform.
    held : (b,) int, optional
        Vertices that are never strays, as those of a boundary, whose neighbors lie on one side.
    median : float, optional
        Median distance of a vertex from the mean of its neighbors, as of a surface that X is a piece of.

    Returns
    -------
    positions : (n, 3) float64
        X itself where there are no strays, or more than :data:`MAX_FRACTION` of the vertices.
    indices : (k,) int64
        Of the strays, ascending.
    """
    found: list[npt.NDArray[np.int64]] = []
    Y, limit = X, max(1, int(MAX_FRACTION * len(X)))
    for _ in range(_MAX_SEARCHES):
        strays = _find(Y, L, held, median)
        if len(strays) == 0:
            break
        found.append(strays)
        if len(np.unique(np.concatenate(found))) > limit:
            return X, np.empty(0, dtype=np.int64)
        Y = Y.copy() if Y is X else Y
        Y[strays] = _fill(Y, L, strays)
    if not found:
        return X, np.empty(0, dtype=np.int64)
    indices = np.unique(np.concatenate(found))
    for _ in range(_FILL_ITERATIONS):
        Y[indices] = _fill(Y, L, indices)
    digits = _DIGITS - int(np.frexp(np.abs(Y[indices]).max())[1])
    Y[indices] = np.ldexp(np.rint(np.ldexp(Y[indices], digits)), -digits)
    return Y, indices


def measure_offsets(X: Floats, L: Laplacian) -> Floats:
    """Return the (n,) distances of vertices from the means of their neighbors."""
    off, distance = L @ X, np.empty(len(X))
    blocks.parallel_rows(lambda at: np.sqrt(np.einsum("ij,ij->i", off[at], off[at]), out=distance[at]), len(X))
    return distance


def _find(X: Floats, L: Laplacian, held: npt.NDArray[np.integer] | None, median: float | None) -> npt.NDArray[np.int64]:
    distance = measure_offsets(X, L)
    if held is not None:
        distance[held] = 0.0
    if median is None:
        median = float(np.median(distance))
    candidates = np.flatnonzero(distance > max(_MIN_OVER_MEDIAN * median, np.finfo(np.float64).eps))
    candidates = candidates[distance[candidates] > _MIN_OVER_MEAN_EDGE * _mean_edges_around(X, L, candidates)]
    return np.array([i for i in candidates if _is_stray(X, L, int(i), float(distance[i]))], dtype=np.int64)


def _mean_edges_around(X: Floats, L: Laplacian, at: npt.NDArray[np.int64]) -> Floats:
    """(k,) mean length of the edges at the neighbors of some vertices, without those that end at these vertices."""
    if len(at) == 0:
        return np.empty(0)
    center, near = neighbors_of(L, at)
    of_near, far = neighbors_of(L, near)
    origin = center[of_near]
    other = far != at[origin]
    length = np.linalg.norm(X[far[other]] - X[near[of_near[other]]], axis=1)
    count = np.bincount(origin[other], minlength=len(at))
    return np.asarray(np.bincount(origin[other], weights=length, minlength=len(at)) / np.maximum(count, 1))


def _is_stray(X: Floats, L: Laplacian, i: int, distance: float) -> bool:
    first, neighbors = L.graph.indptr, L.graph.indices
    around = neighbors[first[i] : first[i + 1]]
    if not _MIN_NEIGHBORS <= len(around) <= _MAX_NEIGHBORS:
        return False
    lengths, off = [], []
    for j in around:
        others = neighbors[first[j] : first[j + 1]]
        others = others[others != i]
        if len(others) == 0:
            return False
        lengths.append(np.linalg.norm(X[others] - X[j], axis=1))
        off.append(float(np.linalg.norm(X[j] - X[others].mean(axis=0))))
    edge = float(np.median(np.concatenate(lengths)))
    if distance <= _MIN_OVER_EDGE * edge or distance <= _MIN_OVER_NEIGHBORS * sorted(off)[-2]:
        return False
    ring = X[around]
    if len(ring) > _MIN_NEIGHBORS:  # less the one that may be a stray as well
        ring = np.delete(ring, np.linalg.norm(ring - np.median(ring, axis=0), axis=1).argmax(), axis=0)
    center = ring.mean(axis=0)
    normal = np.linalg.svd(ring - center)[2][-1]
    nearest = float(np.linalg.norm(X[around] - X[i], axis=1).min())
    return bool(nearest > _MIN_OUT_OF_REACH * edge or abs((X[i] - center) @ normal) > _MIN_OUT_OF_PLANE * distance)


def _fill(X: Floats, L: Laplacian, strays: npt.NDArray[np.int64]) -> Floats:
    """(k, 3) positions of least |L X|^2, each with all others held."""
    first, neighbors = L.graph.indptr, L.graph.indices
    filled = np.empty((len(strays), 3))
    for row, i in enumerate(strays):
        around = neighbors[first[i] : first[i + 1]]
        # rows of L at i and at its neighbors j, as a x_i + b
        numerator, denominator = X[around].mean(axis=0), 1.0
        for j in around:
            others = neighbors[first[j] : first[j + 1]]
            a = -1 / len(others)
            b = X[j] + a * X[others[others != i]].sum(axis=0)
            numerator, denominator = numerator - a * b, denominator + a * a
        filled[row] = numerator / denominator
    return filled


def describe_outliers(indices: npt.NDArray[np.int64]) -> str | None:
    """A sentence for the warning of a result; None if there are no strays."""
    if len(indices) == 0:
        return None
    if len(indices) == 1:
        return "1 stray vertex was put where its neighbors expect it"
    return f"{len(indices)} stray vertices were put where their neighbors expect them"

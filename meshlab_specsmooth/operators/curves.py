"""Curves along edges, open or closed, and their low-pass in the spectrum of their own Laplacian."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
import numpy.typing as npt
from scipy.fft import dst, irfft, rfft

from meshlab_specsmooth.arrays import Booleans, Floats

Indices = npt.NDArray[np.int64]

# A direction of a curve is that between vertices so many segments apart, so that jags do not look like corners; of a
# closed curve at most this part of it, so that a round one has no corners
_REACH, _MAX_PART = 5, 8

# The curvature at an end is that of a parabola through so many wavelengths of the curve
_FITTED = 1.5


@dataclass(frozen=True, eq=False)
class Curve:
    """Vertices in order along a curve; of a closed one the last is joined to the first.

    Attributes
    ----------
    vertices : (k,) int64
    is_closed : bool
    """

    vertices: Indices
    is_closed: bool

    @property
    def segments(self) -> int:
        """Number of segments."""
        return len(self.vertices) - (not self.is_closed)


def trace_curves(segments: Indices, ends: Booleans | None = None) -> tuple[Curve, ...]:
    """Join segments to curves, which end where other than two segments meet.

    Parameters
    ----------
    segments : (s, 2) int64
        Vertices of each segment, each once.
    ends : (n,) bool, optional
        Further vertices at which curves end.

    Examples
    --------
    >>> import numpy as np
    >>> from meshlab_specsmooth.operators.curves import trace_curves
    >>> curves = trace_curves(np.array([[0, 1], [1, 2], [5, 3], [3, 4], [4, 5]]))
    >>> [(c.vertices.tolist(), c.is_closed) for c in curves]
    [([0, 1, 2], False), ([3, 5, 4], True)]
    """
    if len(segments) == 0:
        return ()
    n = int(segments.max()) + 1
    order = np.argsort(segments.ravel(), kind="stable")
    first = np.searchsorted(segments.ravel()[order], np.arange(n + 1)).tolist()
    at_vertex, rows = (order // 2).tolist(), segments.tolist()
    is_end = np.diff(first) != 2
    if ends is not None:
        is_end |= ends[:n]
    left = [True] * len(rows)

    def walk(vertex: int) -> list[int]:
        found, start = [vertex], vertex
        while True:
            segment = next((s for s in at_vertex[first[vertex] : first[vertex + 1]] if left[s]), None)
            if segment is None:
                return found
            left[segment] = False
            a, b = rows[segment]
            vertex = b if a == vertex else a
            found.append(vertex)
            if is_end[vertex] or vertex == start:
                return found

    curves = []
    for vertex in np.flatnonzero(is_end).tolist():
        for _ in range(first[vertex], first[vertex + 1]):
            found = walk(vertex)
            if len(found) > 1:
                curves.append(Curve(np.array(found), is_closed=False))
    for segment, (vertex, _) in enumerate(np.sort(segments, axis=1).tolist()):
        if left[segment]:
            curves.append(Curve(np.array(walk(vertex)[:-1]), is_closed=True))
    return tuple(curves)


def find_corners(curve: Curve, positions: Floats, angle: float) -> Indices:
    """Return the indices along a curve at which its direction turns most, by more than an angle in degrees.

    The directions are those over a few segments before and after a vertex; the ends of an open curve are no corners.
    """
    X, k = positions[curve.vertices], len(curve.vertices)
    reach = min(_REACH, k // _MAX_PART)
    if reach == 0:
        return np.empty(0, dtype=np.int64)
    before, after = X - np.roll(X, reach, axis=0), np.roll(X, -reach, axis=0) - X
    lengths = np.linalg.norm(before, axis=1) * np.linalg.norm(after, axis=1)
    along = np.einsum("ij,ij->i", before, after)
    turn = np.degrees(np.arccos(np.clip(along / np.where(lengths > 0, lengths, 1), -1, 1)))
    if not curve.is_closed:
        turn[:reach] = turn[k - reach :] = 0
    # the vertex that is least like its neighbors: of several that turn the same, the first
    highest = np.max([np.roll(turn, shift) for shift in range(-reach, reach + 1)], axis=0)
    earlier = np.max([np.roll(turn, shift) for shift in range(1, reach + 1)], axis=0)
    return np.flatnonzero((turn > angle) & (turn == highest) & (turn > earlier))


def split_curve(curve: Curve, at: Indices) -> tuple[Curve, ...]:
    """Split a curve at indices along it, in rising order."""
    if len(at) == 0:
        return (curve,)
    v = curve.vertices
    if curve.is_closed:
        v = np.roll(v, -int(at[0]))
        v, at = np.append(v, v[0]), at[1:] - at[0]
    bounds = [0, *at.tolist(), len(v) - 1]
    return tuple(replace(curve, vertices=v[a : b + 1], is_closed=False) for a, b in pairwise(bounds) if b > a)


def low_pass_curve(X: Floats, is_closed: bool, wavelength: float) -> Floats:
    """Return the points of a curve after the paper's three steps along it, with all differential coordinates removed.

    The eigenvectors of the uniform Laplacian of a curve are waves. So the least squares of the paper, with midpoints of
    segments in place of barycenters, are a product with

        h(x) = w^2 m(x) / (x^2 + w^2 m(x)),    m(x) = 1 - x / 2,

    in its spectrum, x from 0 to 2. The weight w is that for which ``h`` is 1/2 at the wavelength. Ends of an open curve
    stay where they are, and a cubic trend is kept; of a closed one the mean and the ellipse closest to it are kept.

    Parameters
    ----------
    X : (k, 3) float64
    is_closed : bool
    wavelength : float
        In segments, above 2.

    Returns
    -------
    (k, 3) float64

    Examples
    --------
    >>> import numpy as np
    >>> from meshlab_specsmooth.operators.curves import low_pass_curve
    >>> zigzag = np.array([[0, 0, 0], [1, 1, 0], [2, -1, 0], [3, 1, 0], [4, 0, 0]], dtype=float)
    >>> bool(abs(low_pass_curve(zigzag, False, 20.0)[:, 1]).max() < 0.1)
    True
    """
    k = len(X)
    if is_closed:
        waves = rfft(X, axis=0)
        gain = find_gain(2 * np.pi * np.arange(len(waves)) / k, wavelength)
        gain[:2] = 1.0
        return np.asarray(irfft(waves * gain[:, None], k, axis=0))
    segments = k - 1
    if segments < 2:
        return X.copy()
    trend = _find_trend(X, wavelength)
    waves = dst(X[1:-1] - trend[1:-1], type=1, axis=0)
    gain = find_gain(np.pi * np.arange(1, segments) / segments, wavelength)
    inner = dst(waves * gain[:, None], type=1, axis=0) / (2 * segments)
    return np.concatenate([X[:1], trend[1:-1] + inner, X[-1:]])


def _find_trend(X: Floats, wavelength: float) -> Floats:
    """The cubic polynomial through the ends of an open curve with the curvature that the curve has there.

    What is left is continued as an odd function beyond either end, as waves with fixed ends are, without a kink.
    """
    segments = len(X) - 1
    t, reach = np.arange(segments + 1.0), min(segments, math.ceil(_FITTED * wavelength))
    start, end = (2 * np.polynomial.polynomial.polyfit(t[: reach + 1], Y[: reach + 1], 2)[2] for Y in (X, X[::-1]))
    u = (t / segments)[:, None]
    bend = (start * (-(u**3) + 3 * u**2 - 2 * u) + end * (u**3 - u)) * segments**2 / 6
    return np.asarray(X[0] + u * (X[-1] - X[0]) + bend)


def find_gain(phase: Floats, wavelength: float) -> Floats:
    """The gain of waves along a curve by their phase from vertex to vertex, in radians."""
    x, cut = 1 - np.cos(phase), 1 - np.cos(2 * np.pi / wavelength)
    return np.asarray((2 - x) / ((2 - x) + (2 - cut) * (x / cut) ** 2))

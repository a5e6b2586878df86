"""Noise that is not the same everywhere: bands of its level, and how much each place has of each."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
from scipy.spatial import cKDTree

from meshlab_specsmooth.arrays import Floats

# Samples that the level at a place is interpolated from
_NEIGHBORS = 8


def group_levels(levels: Floats) -> list[npt.NDArray[np.int64]]:
    """Return the indices of levels, (k,) positive, in bands of an octave or less, from low to high.

    Examples
    --------
    >>> import numpy as np
    >>> from meshlab_specsmooth.pieces.bands import group_levels
    >>> [band.tolist() for band in group_levels(np.array([1.0, 1.2, 4.0, 1.1, 5.0]))]
    [[0, 1, 3], [2, 4]]
    """
    logs = np.log2(levels)
    span = float(np.ptp(logs))
    count = max(1, int(np.ceil(span)))
    number = np.minimum((logs - logs.min()) / max(span, 1e-9) * count, count - 1).astype(int)
    return [np.flatnonzero(number == band) for band in np.unique(number)]


def find_shares(X: Floats, levels: Sequence[Sequence[float]] | None, bands: Sequence[float]) -> Floats:
    """Return the (n, b) shares of bands at places; they add up to 1.

    Parameters
    ----------
    X : (n, 3) float64
    levels : sequence of (x, y, z, level), optional
        Where levels were measured.
    bands : sequence of float
        Their levels, rising.
    """
    if levels is None or len(bands) == 1:
        return np.ones((len(X), 1))
    known = np.array(levels)
    at, values = np.log(np.array(bands)), _interpolate(X, known[:, :3], np.log(known[:, 3]))
    return np.stack([np.interp(values, at, each) for each in np.eye(len(bands))], axis=1)


def _interpolate(X: Floats, centers: Floats, values: Floats) -> Floats:
    """(n,) values at places by the inverse distances to the nearest centers (Franke and Little's weights).

    They are continuous: a center leaves with a weight of 0.
    """
    count = min(_NEIGHBORS + 1, len(centers))
    if count == 1:
        return np.full(len(X), values[0])
    distance, at = cKDTree(centers).query(X, count)
    distance = np.maximum(distance, 1e-9 * np.ptp(centers, axis=0).max())
    reach = distance[:, -1:] if count < len(centers) else 2 * distance[:, -1:]
    weight = np.square(np.maximum(reach - distance, 0) / (reach * distance))
    # where all are as far, none is nearer than the one that leaves
    total = weight.sum(axis=1)
    even = total <= 0
    weight[even], total[even] = 1.0, count
    return np.asarray((weight * values[at]).sum(axis=1) / total)

"""The surface at several scales: powers of L, and bands of wavelength.

Bands are W^(k - 1) (I - W^k)^2, W = I - L/2 the lazy random walk, k = 1, 2, 4, ...: waves of about sqrt(k) edges. They
vanish on a plane or a paraboloid. Each scale is compared with what white noise gives at the same scale, so that white
noise has one level at all of them, until the shape dominates.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_array, eye_array

from meshlab_specsmooth.arrays import Booleans, Floats
from meshlab_specsmooth.graph.laplacian import Laplacian
from meshlab_specsmooth.noise.model import BAND_COUNT, POWER_COUNT

# Noise that is correlated between neighbors is modeled as white noise after this many steps of the lazy random walk.
# docs/constants.md: CORRELATION_STEPS
CORRELATION_STEPS = 8


def filter_by_powers(L: Laplacian, X: Floats) -> list[Floats]:
    """L X, L^2 X, ..., :data:`POWER_COUNT` of them."""
    powers = [L @ X]
    while len(powers) < POWER_COUNT:
        powers.append(L @ powers[-1])
    return powers


def filter_by_bands(L: Laplacian, X: Floats, count: int = BAND_COUNT) -> list[Floats]:
    """The first bands of X, all from one walk."""
    bands = [np.zeros_like(X) for _ in range(count)]
    coefficients = [{k - 1: 1.0, 2 * k - 1: -2.0, 3 * k - 1: 1.0} for k in (2**i for i in range(count))]
    for steps in range(max(coefficients[-1]) + 1):
        for band, of_step in zip(bands, coefficients, strict=True):
            if steps in of_step:
                band += of_step[steps] * X
        X = walk(L, X, 1)
    return bands


def walk(L: Laplacian, X: Floats, steps: int) -> Floats:
    """W^steps X, the lazy random walk."""
    for _ in range(steps):
        before = np.zeros_like(X)
        L.step(X, X, before, factor=-0.5, coefficient=0.5)
        X = before
    return X


def correlate(L: Laplacian, white: Floats) -> Floats:
    """Noise of unit variance that is correlated between neighbors, from white noise."""
    walked = walk(L, white, CORRELATION_STEPS)
    return np.asarray(walked / np.sqrt((walked**2).mean()))


def compute_levels(
    filtered: list[Floats], white: list[Floats], normals: Floats, counted: Booleans
) -> tuple[float, ...]:
    """Levels along the normals at each scale, relative to white noise that was filtered in the same way."""

    def level(given: Floats, reference: Floats) -> float:
        along = np.abs((given * normals).sum(axis=1))[counted]
        return float(np.median(along) / max(np.median(np.abs(reference[counted])), np.finfo(np.float64).tiny))

    return tuple(level(*pair) for pair in zip(filtered, white, strict=True))


def bilaplacian_row_norms(L: Laplacian) -> tuple[Floats, float]:
    """(k,) norms of the rows h of L^2, and the mean of sum h^4 / (sum h^2)^2."""
    degree = L.degree[:, 0]
    adjacency = csr_array(L.graph.adjacency(np.ones(len(L.graph.indices))))
    matrix = csr_array(eye_array(L.size) - csr_array(adjacency.multiply(1 / degree[:, None])))
    squares = csr_array(matrix @ matrix).power(2)
    sums, fourth = (np.asarray(x.sum(axis=1)).ravel() for x in (squares, squares.power(2)))
    return np.sqrt(sums), float((fourth / sums**2).mean())

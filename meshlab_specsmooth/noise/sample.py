"""Random realizations of measured noise."""

from __future__ import annotations

import numpy as np

from meshlab_specsmooth.arrays import Floats
from meshlab_specsmooth.graph.laplacian import Laplacian
from meshlab_specsmooth.noise.model import CORRELATED, DIRECTIONAL, IMPULSE, QUANTIZED, STAIRCASE, Noise
from meshlab_specsmooth.noise.scales import correlate


def sample(L: Laplacian, normals: Floats, noise: Noise, seed: int) -> Floats:
    """(k, 3): three realizations of noise, each a number along the normal of every vertex.

    Parameters
    ----------
    L : Laplacian
        Uniform.
    normals : (k, 3) float64
    noise : Noise
        In the units of the result.
    seed : int
    """
    white = np.random.default_rng(seed).standard_normal(normals.shape)
    if noise.kind == CORRELATED:
        other = np.random.default_rng([seed, 1]).standard_normal(normals.shape)
        white_level = np.sqrt(noise.level**2 - noise.correlated_level**2)
        return np.asarray(white_level * white + noise.correlated_level * correlate(L, other))
    if noise.kind in (DIRECTIONAL, QUANTIZED, STAIRCASE):
        variance = np.maximum(np.einsum("ni,ij,nj->n", normals, noise.covariance, normals), 0.0)
        return np.asarray(noise.level * np.sqrt(variance)[:, None] * white)
    if noise.kind == IMPULSE:
        is_hit = np.random.default_rng([seed, 1]).random(normals.shape) < noise.impulse_density
        return np.asarray(noise.level / np.sqrt(noise.impulse_density) * is_hit * white)
    return np.asarray(noise.level * white)

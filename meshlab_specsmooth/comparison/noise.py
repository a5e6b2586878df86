"""Synthetic noise of several kinds, seeded, for tests and benchmarks."""

from __future__ import annotations

import numpy as np
from numpy.random import default_rng
from scipy.sparse import coo_array, diags_array

from meshlab_specsmooth.arrays import Floats
from meshlab_specsmooth.geometry.surface import Surface, edges, mean_edge_length, vertex_normals


def gaussian(surface: Surface, level: float, seed: int) -> Floats:
    """White noise on every coordinate.

    Parameters
    ----------
    surface : Surface
    level : float
        Standard deviation of a coordinate, in mean edge lengths.
    seed : int
        The same seed gives the same noise.

    Returns
    -------
    (n, 3) float64
        The noisy vertices.
    """
    return surface.vertices + level * mean_edge_length(surface) * _white(surface, seed)


def along_normals(surface: Surface, level: float, seed: int) -> Floats:
    """White noise along the vertex normals, of standard deviation ``level``; see :func:`gaussian`."""
    return _displace(surface, vertex_normals(surface), level * _white(surface, seed)[:, 0])


def impulses(surface: Surface, level: float, seed: int, fraction: float = 0.1) -> Floats:
    """Gaussian noise of standard deviation ``level`` along the normals, at a random fraction of the vertices."""
    hit = default_rng([seed, 1]).random(len(surface.vertices)) < fraction
    return _displace(surface, vertex_normals(surface), level * hit * _white(surface, seed)[:, 0])


def correlated(surface: Surface, level: float, seed: int, rings: int = 2) -> Floats:
    """Correlated noise on every coordinate: white noise averaged over ``rings`` rings, scaled to ``level``."""
    ends, _ = edges(surface)
    n = len(surface.vertices)
    one_way = coo_array((np.ones(len(ends)), (ends[:, 0], ends[:, 1])), shape=(n, n))
    near = (one_way + one_way.T + diags_array(np.ones(n))).tocsr()
    mean = diags_array(1 / near.sum(axis=1)) @ near
    noise = _white(surface, seed)
    for _ in range(rings):
        noise = mean @ noise
    noise /= np.sqrt((noise**2).mean())
    return surface.vertices + level * mean_edge_length(surface) * noise


def along_view(surface: Surface, level: float, seed: int, view: tuple[float, float, float] = (0.3, 0.2, 1.0)) -> Floats:
    """White noise of standard deviation ``level`` along one direction, as from a depth sensor."""
    direction = np.array(view) / np.linalg.norm(view)
    return _displace(surface, direction[None], level * _white(surface, seed)[:, 0])


def quantized(surface: Surface, level: float, seed: int, view: tuple[float, float, float] = (0.3, 0.2, 1.0)) -> Floats:
    """Depth along one direction in steps of ``level`` mean edges, after white noise of a quarter of a step."""
    h, direction = mean_edge_length(surface), np.array(view) / np.linalg.norm(view)
    depth = surface.vertices @ direction
    measured = depth + 0.25 * level * h * _white(surface, seed)[:, 0]
    step = level * h
    return np.asarray(surface.vertices + (np.round(measured / step) * step - depth)[:, None] * direction)


KINDS = {f.__name__: f for f in (gaussian, along_normals, impulses, correlated, along_view, quantized)}


def _white(surface: Surface, seed: int) -> Floats:
    return default_rng(seed).standard_normal(surface.vertices.shape)


def _displace(surface: Surface, directions: Floats, amounts: Floats) -> Floats:
    """Return the vertices displaced along directions, by amounts in mean edges."""
    return np.asarray(surface.vertices + mean_edge_length(surface) * amounts[:, None] * directions)

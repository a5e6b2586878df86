"""Parts of a large mesh: one connected patch, and which of its vertices are far from the cut."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy.sparse import coo_array, csr_array
from scipy.sparse.csgraph import breadth_first_order

from meshlab_specsmooth.arrays import Booleans
from meshlab_specsmooth.geometry.surface import Surface

# Rings at the cut whose errors are excluded: filters treat the cut as a boundary
_CUT_RINGS = 20
_SEED = 7
_MAX_STARTS = 100


def select_patch(surface: Surface, size: int) -> npt.NDArray[np.int64]:
    """Return ``size`` vertices, sorted, in one patch unless its component is smaller."""
    n, F = len(surface.vertices), surface.faces
    graph = csr_array(coo_array((np.ones(3 * len(F)), (F.ravel(), F[:, [1, 2, 0]].ravel())), shape=(n, n)))
    rng, selected = np.random.default_rng(_SEED), np.zeros(n, dtype=np.bool_)
    for _ in range(_MAX_STARTS):
        reached = breadth_first_order(graph, int(F[rng.integers(len(F)), 0]), directed=False, return_predecessors=False)
        selected[reached[: size - int(selected.sum())]] = True
        if selected.sum() >= size:
            break
    return np.flatnonzero(selected).astype(np.int64)


def restrict(surface: Surface, patch: npt.NDArray[np.int64]) -> Surface:
    """Return the surface of some vertices and the faces between them."""
    number = np.full(len(surface.vertices), -1)
    number[patch] = np.arange(len(patch))
    faces = number[surface.faces]
    return Surface(surface.vertices[patch], faces[(faces >= 0).all(axis=1)])


def is_near_cut(surface: Surface, patch: npt.NDArray[np.int64]) -> Booleans:
    """Return for each vertex of a patch, (k,), whether it lies within 20 rings of the rest of the surface."""
    is_near = np.ones(len(surface.vertices), dtype=np.bool_)
    is_near[patch] = False
    for _ in range(_CUT_RINGS):
        is_near[surface.faces[is_near[surface.faces].any(axis=1)]] = True
    return np.asarray(is_near[patch])

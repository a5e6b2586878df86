"""A region resolved on a mesh: which active vertices may move, and how much of a change each makes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from meshlab_specsmooth.arrays import Booleans, Floats
from meshlab_specsmooth.operators.assemble import Operators
from meshlab_specsmooth.parameters import check_weights
from meshlab_specsmooth.smoothing.settings import Region

# Why nothing moves
NOTHING_SELECTED = "nothing is selected, so nothing moves: select something, or do not restrict the filter to it"
NO_FEATURES = "no vertex is a feature, so nothing is enhanced and nothing moves"
ALL_KEPT = "all vertices are features that are kept, so nothing moves"


@dataclass(frozen=True, eq=False)
class ActiveRegion:
    """Where a filter acts, as columns over the active vertices.

    Attributes
    ----------
    change : (k, 1) float64
        Factor of the change of the differential coordinates.
    inside : (k, 1) float64
        1 where vertices may move at all.
    free : (k, 1) float64
        1 where the least squares of the surface moves them; 0 on a boundary that is held.
    rows : (k, 1) float64
        1 where differential coordinates are prescribed.
    holds_boundary : bool
        Whether the boundary has no differential coordinates prescribed.
    is_constrained : bool
        Whether ``free`` or ``rows`` are 0 anywhere.
    is_partial : bool
        Whether ``change`` differs from 1 anywhere.
    """

    change: Floats
    inside: Floats
    free: Floats
    rows: Floats
    holds_boundary: bool
    is_constrained: bool
    is_partial: bool


def resolve_region(ops: Operators, region: Region, change: Floats | float = 1.0) -> ActiveRegion:
    """The region on a mesh, for a filter that makes the fraction ``change``, (k, 1), of its change at each vertex."""
    everywhere = np.ones((len(ops.active), 1))
    inside = everywhere if region.mask is None else (spread_weights(ops, "mask", region.mask) > 0).astype(np.float64)
    rows, free = everywhere.copy(), inside.copy()
    holds_boundary = region.boundary != "free" and ops.boundary is not None
    if holds_boundary:
        rows[ops.boundary_vertices] = 0
        free[ops.boundary_vertices] = 0
    change = np.broadcast_to(change, inside.shape) if region.mask is None else change * inside
    is_partial = region.mask is not None or bool((change != 1).any())
    is_constrained = holds_boundary or region.mask is not None
    return ActiveRegion(change, inside, free, rows, holds_boundary, is_constrained, is_partial)


def check_region(ops: Operators, region: Region) -> None:
    """Raise :class:`InvalidParameter` if the arrays of a region do not fit the mesh."""
    for name, given in (("mask", region.mask), ("features", region.features)):
        if given is not None:
            check_weights(name, given, len(ops.surface.vertices))


def spread_weights(ops: Operators, name: str, given: npt.ArrayLike) -> Floats:
    """(k, 1) weights of the active vertices; of vertices at one place the least mask and the greatest feature."""
    each = check_weights(name, given, len(ops.surface.vertices))
    if ops.welded == 0 or ops.active_index is None:
        return each[ops.active, None]
    is_mask, used = name == "mask", ops.active_index >= 0
    joined = np.full(len(ops.active), 1.0 if is_mask else 0.0)
    (np.minimum if is_mask else np.maximum).at(joined, ops.active_index[used], each[used])
    return joined[:, None]


def exclude_vertices(ops: Operators, region: Region, held: Booleans) -> Floats:
    """(n,) the mask of a region, 0 at the active vertices ``held``, (k,)."""
    n = len(ops.surface.vertices)
    mask = np.ones(n) if region.mask is None else check_weights("mask", region.mask, n).copy()
    if ops.active_index is None:
        mask[held] = 0.0
    else:
        mask[(ops.active_index >= 0) & held[ops.active_index]] = 0.0
    return mask


def explain_no_motion(region: Region, gain: float) -> str | None:
    """The reason if the region lets nothing move."""
    if region.mask is not None and not np.any(region.mask):
        return NOTHING_SELECTED
    if region.features is not None and gain == 1 and np.all(np.asarray(region.features) == 1):
        return ALL_KEPT
    return None

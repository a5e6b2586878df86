"""A plan applied to a piece."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from meshlab_specsmooth.arrays import Booleans, Floats
from meshlab_specsmooth.edge_aware import part as edge_aware_part
from meshlab_specsmooth.edge_aware.settings import EdgeAware
from meshlab_specsmooth.noise.estimate import MAX_WEIGHT
from meshlab_specsmooth.pieces.bands import find_shares
from meshlab_specsmooth.pieces.plan import Plan, unpack_noise
from meshlab_specsmooth.runtime.warned import unwarned
from meshlab_specsmooth.smoothing import part
from meshlab_specsmooth.smoothing.settings import Region, Smoothing
from meshlab_specsmooth.spectral.response import response


def smooth_piece(plan: Plan, V: Floats, F: npt.NDArray[np.int64], cut: Booleans) -> Floats:
    """Return the new vertices of a piece, which ends at its ``cut`` vertices, (n,), where the whole goes on."""
    shares = find_shares(V, plan.levels, [band.level for band in plan.bands])
    corners = F.astype(np.int32)
    with unwarned():
        if plan.filter == "edge_aware":
            return _keep_edges(plan, V, corners, shares)
        return _smooth(plan, V, corners, shares, cut)


def _keep_edges(plan: Plan, V: Floats, F: npt.NDArray[np.int32], shares: Floats) -> Floats:
    """The results of all bands, blended."""
    noise = unpack_noise(plan.noise)
    step = np.zeros_like(V)
    for band, share in zip(plan.bands, shares.T, strict=True):
        if band.edge_aware is None or not share.any():
            continue
        Y = edge_aware_part.smooth_part(
            V,
            F,
            EdgeAware(**band.edge_aware),
            plan.mean_edge,
            noise,
            boundary=plan.boundary,
            weld=plan.weld,
            stray_offset=plan.stray_offset,
            curve_edge=plan.curve_edge,
        )
        step += share[:, None] * (Y - V)
    return np.where(step != 0, V + step, V)


def _smooth(plan: Plan, V: Floats, F: npt.NDArray[np.int32], shares: Floats, cut: Booleans) -> Floats:
    """The isotropic filter, with a weight for each vertex where there are several bands."""
    weights = np.array([band.barycenter_weight or MAX_WEIGHT for band in plan.bands])
    has_noise = np.array([band.barycenter_weight is not None for band in plan.bands])
    weight = float(weights[0]) if len(weights) == 1 else np.exp(shares @ np.log(weights))
    inside = shares[:, has_noise].sum(axis=1) > 0
    if plan.boundary == "free":  # the cut is held, where a boundary would not be
        inside &= ~cut
    setting = Smoothing(
        low_pass=response(plan.response, plan.cutoff),
        barycenter_weight=weight,
        iterations=plan.iterations,
        method="chebyshev",
        tolerance=plan.tolerance,
    )
    region = Region(
        boundary=plan.boundary,
        mask=None if inside.all() else inside,
        max_displacement=plan.max_displacement,
    )
    return part.smooth_part(
        V,
        F,
        setting,
        plan.mean_edge,
        None if plan.stray_offset is None else unpack_noise(plan.noise),
        region,
        laplacian=plan.laplacian,
        weld=plan.weld,
        stray_offset=plan.stray_offset,
        curve_edge=plan.curve_edge,
    )

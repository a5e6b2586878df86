"""The filter on a part of a surface, which becomes there what it would in the whole."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from meshlab_specsmooth.arrays import Floats, Integers
from meshlab_specsmooth.edge_aware.denoising import apply_and_repair, find_active, find_lost, put_strays_back
from meshlab_specsmooth.edge_aware.operators import assemble_faces
from meshlab_specsmooth.edge_aware.region import FaceRegion
from meshlab_specsmooth.edge_aware.settings import EdgeAware
from meshlab_specsmooth.noise.model import Noise
from meshlab_specsmooth.operators.assemble import with_scale
from meshlab_specsmooth.runtime import blocks
from meshlab_specsmooth.smoothing.tangential import tangential_fraction


@blocks.one_blas_thread()
def smooth_part(
    V: Floats,
    F: Integers,
    setting: EdgeAware,
    mean_edge: float,
    noise: Noise,
    *,
    boundary: str = "auto",
    weld: bool = True,
    stray_offset: float | None = None,
    curve_edge: float | None = None,
) -> Floats:
    """Apply a complete setting in the units of the whole, solved to rounding, without holding the volume.

    Parameters
    ----------
    V : (n, 3) float64
        A part of a surface, with a margin.
    F : (m, 3) int32
    setting : EdgeAware
        Complete.
    mean_edge : float
        Of the whole, in mesh units.
    noise : Noise
        Of the whole, in mesh units.
    boundary : {"auto", "fixed", "curve", "free"}
    weld : bool
    stray_offset : float, optional
        Median distance of a vertex of the whole from the mean of its neighbors, if the setting was chosen by the noise:
        strays, which exceed it by far, are then put back, and vertices between thin triangles are left alone.
    curve_edge : float, optional
        Mean edge of the whole's boundary.

    Returns
    -------
    (n, 3) float64
    """
    active, index, G, _ = find_active(V, F, weld)
    if len(active) == 0:
        return V.copy()
    center = V[active].min(axis=0) / 2 + V[active].max(axis=0) / 2
    given = (V[active] - center) / mean_edge
    mesh = assemble_faces(given, G, np.ones(len(given), dtype=np.bool_), boundary, is_exact=True)
    if curve_edge is not None:
        mesh = replace(mesh, ops=with_scale(mesh.ops, 1.0, curve_edge / mean_edge))
    mesh = replace(mesh, tangential_fraction=tangential_fraction(noise))
    if stray_offset is not None:
        mesh, _ = put_strays_back(mesh, FaceRegion(), stray_offset / mean_edge)
    Y, _ = apply_and_repair(mesh, setting, None)
    lost = None if stray_offset is None else find_lost(mesh, Y, noise.level / mean_edge)
    if lost is not None:
        Y[lost] = given[lost]
    is_active = index >= 0
    step = np.zeros_like(V)
    step[is_active] = (Y - given)[index[is_active]] * mean_edge
    return np.where(step != 0, V + step, V)

"""The filter on a part of a surface, which becomes there what it would in the whole."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from meshlab_specsmooth.arrays import Floats, Integers
from meshlab_specsmooth.choices import LaplacianKind
from meshlab_specsmooth.geometry.surface import Surface
from meshlab_specsmooth.noise.model import Noise
from meshlab_specsmooth.operators.assemble import assemble_surface, with_scale
from meshlab_specsmooth.runtime import blocks
from meshlab_specsmooth.smoothing.automatic import add_repair, add_start, leave_lost, prepare_start, put_strays_back
from meshlab_specsmooth.smoothing.filter import smooth_by_setting
from meshlab_specsmooth.smoothing.limit import limit_displacement
from meshlab_specsmooth.smoothing.result import SmoothingResult
from meshlab_specsmooth.smoothing.settings import Region, Smoothing


@blocks.one_blas_thread()
def smooth_part(
    V: Floats,
    F: Integers,
    setting: Smoothing,
    mean_edge: float,
    noise: Noise | None,
    region: Region,
    *,
    laplacian: LaplacianKind = "uniform",
    weld: bool = True,
    stray_offset: float | None = None,
    curve_edge: float | None = None,
) -> Floats:
    """Apply a setting in the units of the whole, without holding the volume.

    Parameters
    ----------
    V : (n, 3) float64
        A part of a surface, with a margin.
    F : (m, 3) int32
    setting : Smoothing
        With a weight, a response and a tolerance.
    mean_edge : float
        Of the whole, in mesh units.
    noise : Noise or None
        Of the whole, in mesh units, by which the weight was chosen: strays are then put back, impulses clipped, and
        vertices between thin triangles left alone. None for a weight that was given.
    region : Region
    laplacian : {"uniform", "cotangent"}
    weld : bool
    stray_offset : float, optional
        Median distance of a vertex of the whole from the mean of its neighbors; strays exceed it by far.
    curve_edge : float, optional
        Mean edge of the whole's boundary.

    Returns
    -------
    (n, 3) float64
    """
    ops = assemble_surface(Surface(V, F), laplacian, weld=weld)
    if curve_edge is not None:
        ops = with_scale(ops, mean_edge, curve_edge)
    if noise is None:
        result = smooth_by_setting(ops, setting, region)
        return limit_displacement(result, region, ops).vertices
    in_units = noise.scaled(-ops.exponent)
    base = ops
    if stray_offset is not None:  # a stray is put back where nothing else moves, too
        base, _ = put_strays_back(ops, replace(region, mask=None), float(np.ldexp(stray_offset, -ops.exponent)))
    weight = 1.0 if setting.barycenter_weight is None else float(np.median(setting.barycenter_weight))
    begun = prepare_start(base, in_units, weight, region)

    def smooth(where: Region, start: SmoothingResult | None) -> SmoothingResult:
        return add_start(base, smooth_by_setting(begun, setting, where, start=start), begun, in_units)

    result, _, _ = leave_lost(base, in_units, region, smooth)
    return limit_displacement(add_repair(ops, result, base), region, ops).vertices

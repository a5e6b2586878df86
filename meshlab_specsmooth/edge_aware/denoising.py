"""From a surface to the result: units, noise, the choice, the filter, and what is held afterwards."""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np

from meshlab_specsmooth.automatic import drifting, warning_of
from meshlab_specsmooth.edge_aware.filtering import filtered
from meshlab_specsmooth.edge_aware.guards import MOST_REPAIRS, with_volume, without_flips
from meshlab_specsmooth.edge_aware.mesh import built, mean_side, smooth_automatically, smooth_isotropically, volume_of
from meshlab_specsmooth.edge_aware.pieces import sample_of
from meshlab_specsmooth.edge_aware.result import DRAWN_IN, Considered, EdgeAwareResult, Setting
from meshlab_specsmooth.edge_aware.search import Fixed, Row, drawn_in, estimate_on, guide_weight, ranked, searched
from meshlab_specsmooth.graph import blocks
from meshlab_specsmooth.memory import require
from meshlab_specsmooth.noise import IMPULSE, NONE, Noise, measure, nothing, sheet
from meshlab_specsmooth.smoothing import with_sides
from meshlab_specsmooth.spectral.progress import Progress, part
from meshlab_specsmooth.surface import Integers, Surface

# Where a call stands when the operators are made, and when the setting is chosen
_BUILT, _CHOSEN = 0.1, 0.6
# By so much the noise is taken for higher where normals matter more than positions: what error of position estimates
# do not see is the short waves, which the normals are made of.
_FAVORING = {"position": 1.0, "normals": 1.4}
# What a call takes at its peak, with room to spare: 600 were measured at two million faces with the compiled kernels
_BYTES_PER_FACE = 900
# Noise of a millionth of an edge is no more than rounding makes; there is nothing to smooth then.
_ROUNDING = 1e-6

FAVORS = tuple(_FAVORING)


@blocks.one_blas_thread()
def denoised(
    surface: Surface, favor: str, fixed: Fixed, with_isotropic: bool, progress: Progress | None
) -> EdgeAwareResult:
    """The whole of :func:`smooth_edge_aware` and :func:`denoise`."""
    begin = time.perf_counter()
    V, F = surface.vertices, surface.faces
    require(_BYTES_PER_FACE * len(F), f"smoothing {len(F)} faces")
    h = mean_side(V, F)
    moving, G = _used(F, len(V))
    if h == 0 or len(moving) == 0:
        return _untouched(surface, begin, nothing(0.0))
    X = (V[moving] - V[moving].mean(axis=0)) / h
    mesh = built(X, G, np.ones(len(X), dtype=np.bool_))
    sample = sample_of(mesh)
    report = progress or (lambda _: None)
    report(_BUILT)
    on = sheet(sample.V, sample.F)
    measured = measure(on)
    noise = measured.noise
    level = noise.level * _FAVORING[favor]
    mesh, sample = (replace(each, drifting=drifting(noise)) for each in (mesh, sample))
    if noise.level <= _ROUNDING and fixed == Fixed():
        return _untouched(surface, begin, noise.scaled(0, h))
    given = fixed.setting(guide_weight(level))
    if noise.kind == NONE and fixed == Fixed():
        automatic = smooth_automatically(mesh, X, favor)
        setting = Setting("smoothed", 0.0, 0.0, 0, automatic.barycenter_weight)
        rows = [Row(setting, (automatic.estimated_error or 0.0) ** 2)]
    elif given is not None:
        rows = [Row(given, np.nan)]
    else:
        estimate = estimate_on(sample, on, measured, _FAVORING[favor])
        rows = searched(estimate, fixed, with_isotropic, part(progress, _BUILT, _CHOSEN - _BUILT))
        if noise.kind == IMPULSE and fixed == Fixed():
            rows = [*rows, drawn_in(estimate, favor)]
        rows = ranked(rows, alike=favor == "position")
    report(_CHOSEN)
    setting, error = rows[0].setting, rows[0].error
    if setting.start == DRAWN_IN:
        smoothed = smooth_automatically(mesh, X, favor).vertices
    else:
        smoothed = smooth_isotropically(mesh, X, setting.barycenter_weight)
    Y = filtered(mesh, X, smoothed, setting, part(progress, _CHOSEN, 1 - _CHOSEN))
    # faces of a clean surface that look away from their neighbours are meant to
    Y, flips = without_flips(mesh, Y, smoothed, repairs=0 if noise.kind == NONE else MOST_REPAIRS)
    volume = 0.0 if mesh.rim.any() else volume_of(mesh, X)
    if volume:
        Y = with_volume(mesh, Y, volume, level)
    result = V.copy()
    result[moving] += (Y - X) * h
    report(1.0)
    return EdgeAwareResult(
        vertices=result,
        noise=noise.scaled(0, h),
        level=level * h,
        start=setting.start,
        strength=setting.strength,
        range_width=setting.range_width,
        passes=setting.passes,
        barycenter_weight=setting.barycenter_weight,
        error=_root(error) * h,
        considered=tuple(Considered(row.setting, _root(row.error) * h) for row in rows),
        flips=flips,
        volume_change=100 * (volume_of(mesh, Y) - volume) / abs(volume) if volume else np.nan,
        displacement=float(np.sqrt(((Y - X) ** 2).sum() / len(V))) * h,
        kernels=mesh.kernels.name,
        warning=warning_of(noise),
        seconds=time.perf_counter() - begin,
    )


def _used(F: Integers, n: int) -> tuple[Integers, Integers]:
    """The vertices that have an edge, and the faces of those alone, by their numbers among them."""
    used = np.zeros(n, dtype=np.bool_)
    used[with_sides(F)] = True
    at = np.cumsum(used, dtype=np.int32) - np.int32(1)
    return np.flatnonzero(used).astype(np.int32), np.ascontiguousarray(at[F[used[F].all(axis=1)]])


def _root(squared: float) -> float:
    """Of an estimate, which may turn out below zero where there is hardly an error."""
    return float(np.sqrt(max(squared, 0.0)))


def _untouched(surface: Surface, begin: float, noise: Noise) -> EdgeAwareResult:
    """For surfaces without an edge of any length, or without noise."""
    return EdgeAwareResult(
        vertices=surface.vertices.copy(),
        noise=noise,
        level=0.0,
        start="given",
        strength=0.0,
        range_width=0.0,
        passes=0,
        barycenter_weight=1.0,
        error=0.0,
        considered=(),
        flips=0,
        volume_change=np.nan,
        displacement=0.0,
        kernels="none",
        warning=None,
        seconds=time.perf_counter() - begin,
    )

"""From a surface to the result: units, noise, the choice, the filter, and what is held afterward."""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from meshlab_specsmooth.arrays import Booleans, Floats, Integers
from meshlab_specsmooth.edge_aware.creasing import creases_by_angle
from meshlab_specsmooth.edge_aware.filtering import filtered
from meshlab_specsmooth.edge_aware.guards import with_volume, without_flips
from meshlab_specsmooth.edge_aware.mesh import (
    Mesh,
    at_positions,
    built,
    mean_side,
    smooth_automatically,
    smooth_isotropically,
    volume_of,
    with_creases,
)
from meshlab_specsmooth.edge_aware.pieces import cut_sample, sample_of
from meshlab_specsmooth.edge_aware.regions import Region
from meshlab_specsmooth.edge_aware.result import CLIPPED, Considered, EdgeAwareResult, Setting
from meshlab_specsmooth.edge_aware.search import (
    Fixed,
    Row,
    clip_impulses_first,
    estimate_on,
    guide_weight,
    ranked,
    searched,
)
from meshlab_specsmooth.geometry.surface import Surface
from meshlab_specsmooth.geometry.triangles import describe_lost, find_lost_vertices
from meshlab_specsmooth.geometry.welding import find_copies
from meshlab_specsmooth.noise.estimate import IMPULSE, MOST_WEIGHT, UNCLEAR, Noise, measure, nothing
from meshlab_specsmooth.noise.outliers import describe_outliers, replace_outliers
from meshlab_specsmooth.noise.parts import (
    Part,
    describe_left_alone,
    describe_levels,
    label_components,
    split,
)
from meshlab_specsmooth.noise.shape_change import Change, compare_shapes
from meshlab_specsmooth.risk.choose_weight import drifting
from meshlab_specsmooth.runtime import blocks
from meshlab_specsmooth.runtime.memory import require
from meshlab_specsmooth.runtime.progress import Progress, announce, subrange
from meshlab_specsmooth.smoothing.api import describe_unused, find_corners, with_sides

# Where a call stands when the operators are made, and when the setting is chosen
_BUILT, _CHOSEN = 0.1, 0.6
# By so much the noise is taken for higher where normals matter more than positions: what error of position estimates
# do not see is the short waves, which the normals are made of.
_LEVEL_FACTORS = {"position": 1.0, "normals": 1.4}
# What a call takes at its peak, with room to spare: 600 were measured at two million faces with the compiled kernels
_BYTES_PER_FACE = 900

CRITERIA = tuple(_LEVEL_FACTORS)


@blocks.one_blas_thread()
def denoised(
    surface: Surface,
    criterion: str,
    fixed: Fixed,
    region: Region,
    with_isotropic: bool,
    weld: bool,
    progress: Progress | None,
) -> EdgeAwareResult:
    """The whole of :func:`smooth_edge_aware` and :func:`denoise`: part by part, where noise or scale are not alike."""
    begin = time.perf_counter()
    V, F = surface.vertices, surface.faces
    announce(progress, "assembling")
    require(_BYTES_PER_FACE * len(F), f"smoothing {len(F)} faces")
    moving, place, G, welded = _used(V, F, weld)
    region = region.on(place, len(moving))
    h = mean_side(V[moving], G) if len(moving) else 0.0
    if h == 0:
        nowhere = _untouched(V.copy(), nothing(0.0), 0.0, np.nan)
        return replace(nowhere, warning=region.warning, given=surface, seconds=time.perf_counter() - begin)
    # not the mean, whose last digits depend on the order of the vertices
    center = V[moving].min(axis=0) / 2 + V[moving].max(axis=0) / 2
    X = (V[moving] - center) / h
    mesh = built(X, G, region.judged(len(X)), region.boundary)
    parts = _parts(mesh) if fixed == Fixed() else []
    if len(parts) > 1:
        result = _denoise_parts(mesh, parts, criterion, region, with_isotropic, progress)
    else:
        result = _denoise_mesh(mesh, criterion, fixed, region, with_isotropic, progress)
    has_place = place >= 0
    step = np.zeros_like(V)
    step[has_place] = (result.vertices - X)[place[has_place]]
    displacement = float(np.sqrt((step**2).sum() / len(V))) * h
    step *= h
    return replace(
        _scaled(result, h),
        vertices=np.where(step != 0, V + step, V),
        displacement=displacement,
        welded=welded,
        given=surface,
        outliers=moving[result.outliers].astype(np.int64),
        warning="; ".join(
            filter(None, (*mesh.isotropic.doubts, *describe_unused(surface), result.warning, region.warning))
        )
        or None,
        seconds=time.perf_counter() - begin,
    )


def _parts(mesh: Mesh) -> list[Part]:
    prepared = mesh.isotropic
    count, labels = label_components(prepared.L)
    if count == 1:
        return []
    return split(prepared.positions, prepared.faces, prepared.L, count, labels)


def _denoise_parts(
    mesh: Mesh, parts: list[Part], criterion: str, region: Region, with_isotropic: bool, progress: Progress | None
) -> EdgeAwareResult:
    """Each part by its own noise and edges; the evidence is that of the largest one that can be told anything of."""
    prepared = mesh.isotropic
    Y, done = mesh.V.copy(), 0
    notes: list[str | None] = []
    results: list[tuple[EdgeAwareResult, int]] = []
    outliers = []
    for each in parts:
        if each.is_left_alone:
            notes.append(describe_left_alone(each))
            continue
        at = prepared.moving[each.vertices]
        number = np.full(len(mesh.V), -1, dtype=np.int32)
        number[at] = np.arange(len(at), dtype=np.int32)
        faces = number[prepared.moving[prepared.faces[each.faces]]]
        h, center = mean_side(mesh.V[at], faces), mesh.V[at].min(axis=0) / 2 + mesh.V[at].max(axis=0) / 2
        own = region.on(number, len(at))
        alone = built((mesh.V[at] - center) / h, faces, own.judged(len(at)), region.boundary)
        share = subrange(progress, done / len(Y), len(at) / len(Y))
        result = _denoise_mesh(alone, criterion, Fixed(), own, with_isotropic, share)
        done += len(at)
        Y[at] += (result.vertices - alone.V) * h
        outliers.append(at[result.outliers])
        results.append((_scaled(result, h), len(at)))
        if result.warning is not None:
            notes.append(f"in the part of {len(at)} of {len(Y)} vertices: {result.warning}")
    first, _ = max(results, key=lambda pair: (not pair[0].noise.is_left_alone, pair[1]))
    squares = sum(count * np.nan_to_num(result.error) ** 2 for result, count in results)
    return replace(
        first,
        vertices=Y,
        error=float(np.sqrt(squares / len(Y))),
        flips=sum(result.flips for result, _ in results),
        volume_change=_volume_change(mesh, Y),
        outliers=np.sort(np.concatenate(outliers)),
        warning="; ".join(filter(None, (describe_levels([r.noise for r, _ in results]), *notes))) or None,
    )


def _denoise_mesh(
    mesh: Mesh,
    criterion: str,
    fixed: Fixed,
    region: Region,
    with_isotropic: bool,
    progress: Progress | None,
    may_have_strays: bool = True,
) -> EdgeAwareResult:
    """Choice, filter and what is held afterward, for a mesh in units of its mean edge; so is the result."""
    is_automatic = fixed == Fixed()
    if is_automatic and may_have_strays:
        repaired, outliers = _without_outliers(mesh, region)
        if len(outliers):
            return _denoise_repaired(mesh, repaired, outliers, criterion, region, with_isotropic, progress)
    field = region.field(mesh.F, len(mesh.V))
    report = progress or (lambda _: None)
    report(_BUILT)
    announce(progress, "measuring noise")
    sample, on, drawn = sample_of(mesh)
    measured = measure(on)
    noise = measured.noise
    stays = field is not None and not field.any()
    if stays or (is_automatic and noise.is_left_alone):
        unchanged = _untouched(mesh.V, noise, max(noise.level, noise.resolution), _volume_change(mesh, mesh.V))
        creases = _find_creases(mesh, region, noise, noise.high)
        count = 0 if creases is None else len(creases)
        return replace(unchanged, creases=count, warning=None if stays else noise.warning)
    X, level = mesh.V, noise.level * _LEVEL_FACTORS[criterion]
    whole = mesh
    creases = _find_creases(mesh, region, noise, level)
    if creases is not None:
        mesh, sample = with_creases(mesh, creases), cut_sample(sample, drawn, creases, len(X))
    mesh, sample = (replace(each, drifting=drifting(noise)) for each in (mesh, sample))
    setting = fixed.setting(guide_weight(level))
    if setting is not None:
        rows = [Row(setting, np.nan)]
    else:
        announce(progress, "choosing")
        estimate = estimate_on(sample, on, measured, _LEVEL_FACTORS[criterion])
        # the isotropic filter knows of no creases
        rows = searched(
            estimate, fixed, with_isotropic and mesh.cut is None, subrange(progress, _BUILT, _CHOSEN - _BUILT)
        )
        if noise.kind == IMPULSE and is_automatic and mesh.cut is None:
            rows = [*rows, clip_impulses_first(estimate, criterion)]
        rows = ranked(rows, alike=criterion == "position")
    report(_CHOSEN)
    announce(progress, "smoothing")
    Y, flips = _apply(mesh, rows[0].setting, criterion, level, subrange(progress, _CHOSEN, 1 - _CHOSEN))
    if field is not None:
        Y = X + field[:, None] * (Y - X)
    notes = []
    lost = _find_lost(whole, Y, noise.level) if is_automatic else None
    if lost is not None:
        Y[lost] = X[lost]
        notes.append(describe_lost(lost))
    change = compare_shapes(X, Y, mesh.F, *_components(whole), noise)
    if is_automatic and change.excessive.any():
        Y, weight, note = _within_reason(whole, Y, criterion, noise, change, field)
        notes.append(note)
        rows = [Row(Setting("smoothed", 0.0, 0.0, 0, weight), np.nan), *rows]
    elif not is_automatic and change.is_large:
        notes.append(f"this setting changes the shape: {change.describe()}")
    report(1.0)
    setting = rows[0].setting
    return EdgeAwareResult(
        vertices=Y,
        noise=noise,
        level=level,
        start=setting.start,
        strength=setting.strength,
        range_sigma=setting.range_sigma,
        iterations=setting.iterations,
        barycenter_weight=setting.barycenter_weight,
        error=_root(rows[0].error),
        considered=tuple(Considered(row.setting, _root(row.error)) for row in rows),
        flips=flips,
        volume_change=_volume_change(mesh, Y),
        displacement=0.0,
        kernels=mesh.kernels.name,
        warning=_joined(*notes, noise.warning),
        seconds=0.0,
        creases=0 if mesh.cut is None else len(mesh.cut.edges),
    )


def _denoise_repaired(
    mesh: Mesh,
    repaired: Mesh,
    outliers: npt.NDArray[np.int64],
    criterion: str,
    region: Region,
    with_isotropic: bool,
    progress: Progress | None,
) -> EdgeAwareResult:
    """The same for a mesh whose strays were put back, in units of the edges that it has then."""
    center = repaired.V.min(axis=0) / 2 + repaired.V.max(axis=0) / 2
    h = mean_side(repaired.V - center, repaired.F)
    if h == 0:  # without the strays nothing is left
        return _untouched(mesh.V, nothing(0.0), 0.0, np.nan)
    rescaled = built((repaired.V - center) / h, repaired.F, repaired.counts, repaired.boundary)
    result = _denoise_mesh(rescaled, criterion, Fixed(), region, with_isotropic, progress, may_have_strays=False)
    if result.noise.kind == UNCLEAR:  # then strays cannot be told from shape either
        return replace(_scaled(result, h), vertices=mesh.V)
    if result.noise.kind == IMPULSE:  # those were the highest of many
        return _denoise_mesh(mesh, criterion, Fixed(), region, with_isotropic, progress, may_have_strays=False)
    vertices = repaired.V + (result.vertices - rescaled.V) * h
    return replace(
        _scaled(result, h),
        vertices=vertices,
        volume_change=_volume_change(mesh, vertices),
        outliers=outliers,
        warning=_joined(describe_outliers(outliers), result.warning),
    )


def _find_creases(mesh: Mesh, region: Region, noise: Noise, level: float) -> Integers | None:
    """Edges that nothing crosses, as given or by their angle; None where neither is asked for."""
    return region.creases if region.angle is None else creases_by_angle(mesh, region.angle, noise, level)


def _find_lost(mesh: Mesh, Y: Floats, level: float) -> Booleans | None:
    """Vertices that would be lost between long thin triangles, if any."""
    prepared = mesh.isotropic
    at = prepared.moving
    found = find_lost_vertices((Y - mesh.V)[at], mesh.V[at], prepared.faces, prepared.L, level)
    if found is None:
        return None
    lost = np.zeros(len(mesh.V), dtype=np.bool_)
    lost[at] = found
    return lost


def _apply(mesh: Mesh, setting: Setting, criterion: str, level: float, progress: Progress | None) -> tuple[Floats, int]:
    """What a setting makes of the mesh, its volume held, and how many faces are turned over."""
    X = mesh.V
    if setting.start == CLIPPED:
        smoothed = smooth_automatically(mesh, X, criterion).vertices
    else:
        smoothed = smooth_isotropically(mesh, X, setting.barycenter_weight)
    Y = filtered(mesh, X, smoothed, setting, progress)
    Y, flips = without_flips(mesh, Y, smoothed)
    volume = 0.0 if mesh.rim.any() else volume_of(mesh, X)
    return (with_volume(mesh, Y, volume, level) if volume else Y), flips


def _within_reason(
    mesh: Mesh, Y: Floats, criterion: str, noise: Noise, change: Change, field: Floats | None
) -> tuple[Floats, float, str]:
    """What is handed out where a result changes the shape by more than the noise explains.

    The isotropic filter's own choice, which is held to the same; where that changes too much as well, the input.
    """
    X = mesh.V
    closed, labels = _components(mesh)
    automatic = smooth_automatically(mesh, X, criterion)
    weaker = automatic.vertices
    if field is not None:
        weaker = X + field[:, None] * (weaker - X)
    still = compare_shapes(X, weaker, mesh.F, closed, labels, noise).excessive
    weaker = np.where((change.excessive & still)[labels][:, None], X, weaker)
    handed_out = np.where(change.excessive[labels][:, None], weaker, Y)
    done = "the input is" if np.array_equal(handed_out, X) else "a weaker result is"
    return handed_out, automatic.barycenter_weight, change.describe_replaced(done)


def _components(mesh: Mesh) -> tuple[npt.NDArray[np.bool_], npt.NDArray[np.int32]]:
    """Which connected components are closed, and the component of each vertex."""
    prepared = mesh.isotropic
    count, of_moving = label_components(prepared.L)
    labels = np.empty(len(mesh.V), dtype=np.int32)
    labels[prepared.moving] = of_moving
    closed = np.ones(count, dtype=np.bool_)
    closed[labels[mesh.rim]] = False
    return closed, labels


def _without_outliers(mesh: Mesh, region: Region) -> tuple[Mesh, npt.NDArray[np.int64]]:
    """The mesh with single stray vertices put back where they may move, and which these are."""
    at = mesh.isotropic.moving
    rim = None if mesh.isotropic.rim is None else mesh.isotropic.rim.vertices
    positions, strays = replace_outliers(mesh.V[at], mesh.isotropic.L, rim)
    may_move = np.ones(len(mesh.V), dtype=np.bool_) if region.inside is None else region.inside.copy()
    strays = strays[may_move[at[strays]]]
    if len(strays) == 0:
        return mesh, strays
    V = mesh.V.copy()
    V[at[strays]] = positions[strays]
    return at_positions(mesh, V), np.sort(at[strays]).astype(np.int64)


def _volume_change(mesh: Mesh, Y: Floats) -> float:
    """In per cent; NaN of an open surface."""
    volume = 0.0 if mesh.rim.any() else volume_of(mesh, mesh.V)
    return 100 * (volume_of(mesh, Y) - volume) / abs(volume) if volume else np.nan


def _scaled(result: EdgeAwareResult, h: float) -> EdgeAwareResult:
    """The evidence with lengths times h."""
    return replace(
        result,
        noise=result.noise.scaled(0, h),
        level=result.level * h,
        error=result.error * h,
        considered=tuple(Considered(row.setting, row.error * h) for row in result.considered),
    )


def _used(V: Floats, F: Integers, weld: bool) -> tuple[Integers, Integers, Integers, int]:
    """The vertices that have an edge, where each vertex is among them or -1, their faces, and how many are copies."""
    used = find_corners(F, len(V))
    copies = find_copies(V, used) if weld else None
    welded = 0
    if copies is not None:
        welded = int((copies[used] != np.flatnonzero(used)).sum())
        F = copies.take(F)
    has_edge = find_corners(with_sides(F), len(V))
    place = np.where(has_edge, np.cumsum(has_edge, dtype=np.int32) - np.int32(1), np.int32(-1))
    G = np.ascontiguousarray(place[F[has_edge[F].all(axis=1)]])
    if copies is not None:
        place[used] = place[copies[used]]
    return np.flatnonzero(has_edge).astype(np.int32), place, G, welded


def _joined(*warnings: str | None) -> str | None:
    return "; ".join(filter(None, warnings)) or None


def _root(squared: float) -> float:
    """Of an estimate, which may turn out below zero where there is hardly an error."""
    return float(np.sqrt(max(squared, 0.0)))


def _untouched(vertices: Floats, noise: Noise, error: float, volume_change: float) -> EdgeAwareResult:
    """For surfaces without an edge of any length, without noise, or with none that could be told from shape."""
    return EdgeAwareResult(
        vertices=vertices,
        noise=noise,
        level=0.0,
        start="given",
        strength=0.0,
        range_sigma=0.0,
        iterations=0,
        barycenter_weight=MOST_WEIGHT,
        error=error,
        considered=(),
        flips=0,
        volume_change=volume_change,
        displacement=0.0,
        kernels="none",
        warning=None,
        seconds=0.0,
    )

"""From a surface to the result: units, noise, the choice, the filter, and the shape held against the noise."""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from meshlab_specsmooth.adapters import Mesh, recognize
from meshlab_specsmooth.arrays import Booleans, Floats, Integers
from meshlab_specsmooth.edge_aware.creases import find_creases_by_angle
from meshlab_specsmooth.edge_aware.filter import apply_setting
from meshlab_specsmooth.edge_aware.operators import (
    FaceOperators,
    assemble_faces,
    at_positions,
    compute_mean_side,
    compute_volume,
    cut_along_creases,
    cut_sample,
    draw_sample,
    smooth_automatically,
    smooth_isotropically,
)
from meshlab_specsmooth.edge_aware.postprocess import repair_flips, restore_volume
from meshlab_specsmooth.edge_aware.region import FaceRegion, resolve_region
from meshlab_specsmooth.edge_aware.result import Considered, EdgeAwareResult
from meshlab_specsmooth.edge_aware.search import (
    Candidate,
    evaluate_clipped,
    guide_weight,
    prepare_search,
    rank,
    search_settings,
)
from meshlab_specsmooth.edge_aware.settings import CLIPPED, GIVEN, SMOOTHED, EdgeAware, EdgeAwareRegion
from meshlab_specsmooth.geometry.surface import Surface
from meshlab_specsmooth.geometry.welding import find_copies
from meshlab_specsmooth.noise.estimate import MAX_WEIGHT, NoiseEstimate, estimate
from meshlab_specsmooth.noise.local import VaryingNoise, describe_varying, find_varying_noise, split_by_level
from meshlab_specsmooth.noise.model import IMPULSE, STAIRCASE, UNCLEAR, Noise
from meshlab_specsmooth.noise.outliers import describe_outliers, replace_outliers
from meshlab_specsmooth.noise.parts import Part, describe_left_alone, describe_levels, group_components
from meshlab_specsmooth.noise.shape_change import ShapeChange, compare_shapes
from meshlab_specsmooth.noise.thin_triangles import describe_lost, find_lost_vertices
from meshlab_specsmooth.noise.voxels import Voxels
from meshlab_specsmooth.operators.assemble import (
    Operators,
    describe_unused,
    drop_point_faces,
    find_referenced_vertices,
)
from meshlab_specsmooth.operators.components import label_components
from meshlab_specsmooth.operators.patches import Patches
from meshlab_specsmooth.parameters import check_flag
from meshlab_specsmooth.risk.choose_weight import LARGE, CandidateLowPass, choose_on_patches
from meshlab_specsmooth.runtime import blocks
from meshlab_specsmooth.runtime.bars import begin
from meshlab_specsmooth.runtime.memory import require
from meshlab_specsmooth.runtime.progress import Progress, announce, finish, subrange
from meshlab_specsmooth.smoothing.filter import DEFAULT_WAVELENGTH_IN_EDGES
from meshlab_specsmooth.smoothing.limit import limit_displacement
from meshlab_specsmooth.smoothing.result import join_warnings
from meshlab_specsmooth.smoothing.tangential import tangential_fraction
from meshlab_specsmooth.spectral.low_pass import Heat

# Fractions of a call at which the operators are assembled, and the setting is chosen.
_ASSEMBLED, _CHOSEN = 0.1, 0.6

# Where noise varies, the isotropic filter is taken if its estimated error is within this factor of the least: bands of
# the level are chosen for on few vertices each, and an estimate of the least of many errors is too low.
# docs/constants.md: _AS_GOOD
_AS_GOOD = 1.07

# Peak memory of a call; 579 to 1260 bytes a face were measured.
# docs/constants.md: _BYTES_PER_FACE
_BYTES_PER_FACE = 1300


def denoise_mesh(
    mesh: Mesh,
    faces: npt.ArrayLike | None,
    setting: EdgeAware,
    region: EdgeAwareRegion,
    with_isotropic: bool,
    weld: bool,
    progress: Progress | None,
    spacing: float | tuple[float, float, float] | None = None,
    is_exact: bool = False,
) -> EdgeAwareResult:
    """Smooth a mesh of any kind by a setting, choosing what it leaves open.

    ``with_isotropic``: whether the isotropic filter is considered; ``spacing``: the sides of a mask's voxels;
    ``is_exact``: whether equations are solved to rounding, so that a part of a surface gives what the whole does.
    """
    progress = begin(progress, "assembling")
    if isinstance(mesh, Operators):
        surface, source, weld = mesh.surface, mesh.source, mesh.welded > 0
    else:
        given = recognize(mesh, faces)
        surface, source = given.surface(), given.kept()
    resolved = resolve_region(surface, region)
    result = denoise_surface(
        surface, setting, resolved, with_isotropic, check_flag("weld", weld), progress, spacing, is_exact
    )
    result = limit_displacement(result, region)
    finish(progress)
    return replace(result, source=source)


@blocks.one_blas_thread()
def denoise_surface(
    surface: Surface,
    setting: EdgeAware,
    region: FaceRegion,
    with_isotropic: bool,
    weld: bool,
    progress: Progress | None,
    spacing: float | tuple[float, float, float] | None = None,
    is_exact: bool = False,
) -> EdgeAwareResult:
    """Smooth a surface, part by part where noise or scale differ."""
    began = time.perf_counter()
    V, F = surface.vertices, surface.faces
    announce(progress, "assembling")
    require(_BYTES_PER_FACE * len(F), f"smoothing {len(F)} faces")
    active, index, G, welded = find_active(V, F, weld)
    region = region.renumbered(index, len(active))
    h = compute_mean_side(V[active], G) if len(active) else 0.0
    if h == 0:
        nowhere = _leave_unchanged(V.copy(), Noise.zero(0.0), 0.0, np.nan)
        return replace(nowhere, warning=region.warning, given=surface, seconds=time.perf_counter() - began)
    # not the mean, whose last digits depend on the order of the vertices
    center = V[active].min(axis=0) / 2 + V[active].max(axis=0) / 2
    X = (V[active] - center) / h
    voxels = None if spacing is None else Voxels.of(spacing, 1 / h)
    mesh = assemble_faces(X, G, region.counted(len(X)), region.boundary, voxels, is_exact)
    parts = _group(mesh) if setting.is_automatic and voxels is None else []
    if len(parts) > 1:
        result = _denoise_parts(mesh, parts, setting, region, with_isotropic, progress)
    else:
        result = _denoise(mesh, setting, region, with_isotropic, progress)
    is_active = index >= 0
    step = np.zeros_like(V)
    step[is_active] = (result.vertices - X)[index[is_active]]
    displacement = float(np.sqrt((step**2).sum() / len(V))) * h
    step *= h
    result = _scale(result, h)
    if result.noise.local is not None:
        local = np.zeros(len(V))
        local[is_active] = result.noise.local[index[is_active]]
        result = replace(result, noise=replace(result.noise, local=local))
    return replace(
        result,
        vertices=np.where(step != 0, V + step, V),
        displacement=displacement,
        welded=welded,
        given=surface,
        outliers=active[result.outliers].astype(np.int64),
        warning=join_warnings(*mesh.ops.notes, *describe_unused(surface), result.warning, region.warning),
        seconds=time.perf_counter() - began,
    )


def _group(mesh: FaceOperators) -> list[Part]:
    count, labels = label_components(mesh.ops.L)
    return [] if count == 1 else group_components(mesh.ops, count, labels)


def _denoise_parts(
    mesh: FaceOperators,
    parts: list[Part],
    setting: EdgeAware,
    region: FaceRegion,
    with_isotropic: bool,
    progress: Progress | None,
) -> EdgeAwareResult:
    """Smooth each part by its own noise and edges; the evidence is that of the largest measurable one."""
    ops = mesh.ops
    Y, local, done = mesh.V.copy(), np.zeros(len(mesh.V)), 0
    notes: list[str | None] = []
    results: list[tuple[EdgeAwareResult, int]] = []
    outliers = []
    for each in parts:
        if each.is_left_alone:
            notes.append(describe_left_alone(each))
            continue
        at = ops.active[each.vertices]
        index = np.full(len(mesh.V), -1, dtype=np.int32)
        index[at] = np.arange(len(at), dtype=np.int32)
        faces = index[ops.active[ops.faces[each.faces]]]
        h, center = compute_mean_side(mesh.V[at], faces), mesh.V[at].min(axis=0) / 2 + mesh.V[at].max(axis=0) / 2
        own = region.renumbered(index, len(at))
        X, counted = (mesh.V[at] - center) / h, own.counted(len(at))
        alone = assemble_faces(X, faces, counted, region.boundary, is_exact=mesh.is_exact)
        share = subrange(progress, done / len(Y), len(at) / len(Y))
        result = _denoise(alone, setting, own, with_isotropic, share)
        done += len(at)
        Y[at] += (result.vertices - alone.V) * h
        part = result.noise.scaled(0, h)
        local[at] = part.level if part.local is None else part.local
        outliers.append(at[result.outliers])
        results.append((_scale(result, h), len(at)))
        if result.warning is not None:
            notes.append(f"in the part of {len(at)} of {len(Y)} vertices: {result.warning}")
    first, _ = max(results, key=lambda pair: (not pair[0].noise.is_left_alone, pair[1]))
    squares = sum(count * np.nan_to_num(result.error) ** 2 for result, count in results)
    return replace(
        first,
        vertices=Y,
        noise=replace(first.noise, local=local),
        error=float(np.sqrt(squares / len(Y))),
        flips=sum(result.flips for result, _ in results),
        volume_change=_compute_volume_change(mesh, Y),
        outliers=np.sort(np.concatenate(outliers)),
        warning=join_warnings(describe_levels([r.noise for r, _ in results]), *notes),
    )


def _denoise(
    mesh: FaceOperators,
    setting: EdgeAware,
    region: FaceRegion,
    with_isotropic: bool,
    progress: Progress | None,
    may_have_strays: bool = True,
    may_vary: bool = True,
) -> EdgeAwareResult:
    """Choose, filter and correct, for a mesh in units of its mean edge; the result is in these too."""
    is_automatic = setting.is_automatic
    if is_automatic and may_have_strays and mesh.voxels is None:
        repaired, outliers = put_strays_back(mesh, region)
        if len(outliers):
            return _denoise_repaired(mesh, repaired, outliers, setting, region, with_isotropic, progress)
    report = progress or (lambda _: None)
    report(_ASSEMBLED)
    announce(progress, "measuring noise")
    if is_automatic and may_vary and mesh.voxels is None:
        varying = find_varying_noise(mesh.ops, mesh.counted[mesh.ops.active])
        if varying is not None and varying.noise.varies:
            return _denoise_varying(mesh, varying, setting, region, with_isotropic, progress)
    fractions = region.fractions(mesh.F, len(mesh.V))
    sample, patches, drawn = draw_sample(mesh)
    found = estimate(patches.ops, patches.counted, mesh.voxels)
    noise = found.noise
    stays = fractions is not None and not fractions.any()
    if stays or (is_automatic and noise.is_left_alone):
        unchanged = _leave_unchanged(
            mesh.V, noise, max(noise.level, noise.resolution), _compute_volume_change(mesh, mesh.V)
        )
        creases = _find_creases(mesh, region, noise, noise.high)
        count = 0 if creases is None else len(creases)
        return replace(unchanged, creases=count, warning=None if stays else noise.warning)
    X, level = mesh.V, noise.level
    whole = mesh
    creases = _find_creases(mesh, region, noise, level)
    if creases is not None:
        mesh, sample = cut_along_creases(mesh, creases), cut_sample(sample, drawn, creases, len(X))
    mesh, sample = (replace(each, tangential_fraction=tangential_fraction(noise)) for each in (mesh, sample))
    complete = setting.complete(guide_weight(level))
    if complete is not None:
        candidates = [Candidate(complete, np.nan)]
    elif is_automatic and noise.kind == STAIRCASE:  # steps are edges to the edge-aware filter
        candidates = [_choose_isotropic(mesh, patches, found)]
    else:
        announce(progress, "choosing")
        search = prepare_search(sample, patches.ops.L, found)
        # the isotropic filter has no creases
        with_isotropic = with_isotropic and mesh.cut is None
        share = subrange(progress, _ASSEMBLED, _CHOSEN - _ASSEMBLED)
        isotropic = None
        if with_isotropic and is_automatic and noise.kind != IMPULSE:
            isotropic = _choose_isotropic(mesh, patches, found)
        candidates = search_settings(search, setting, with_isotropic, isotropic, share, len(X) > LARGE)
        if noise.kind == IMPULSE and is_automatic and mesh.cut is None:
            candidates.append(evaluate_clipped(search))
        candidates = rank(candidates)
    report(_CHOSEN)
    announce(progress, "smoothing")
    if is_automatic and noise.kind == STAIRCASE:
        Y, flips = smooth_automatically(mesh, X).vertices, 0
    else:
        Y, flips = _apply(mesh, candidates[0].setting, level, subrange(progress, _CHOSEN, 1 - _CHOSEN))
    if fractions is not None:
        Y = X + fractions[:, None] * (Y - X)
    notes = []
    lost = find_lost(whole, Y, noise.level) if is_automatic else None
    if lost is not None:
        Y[lost] = X[lost]
        notes.append(describe_lost(lost))
    change = compare_shapes(X, Y, mesh.F, *_label_components(whole), noise)
    if is_automatic and change.excessive.any():
        Y, weight, note = _weaken(whole, Y, noise, change, fractions)
        notes.append(note)
        weaker = EdgeAware(iterations=0, start=SMOOTHED, barycenter_weight=weight)
        candidates = [Candidate(weaker, np.nan), *candidates]
    elif not is_automatic and change.is_large:
        notes.append(f"this setting changes the shape: {change.describe()}")
    report(1.0)
    used = candidates[0].setting
    return EdgeAwareResult(
        vertices=Y,
        noise=noise,
        level=level,
        start=used.start,
        strength=used.strength or 0.0,
        range_sigma=used.range_sigma or 0.0,
        iterations=used.iterations or 0,
        barycenter_weight=used.barycenter_weight or 0.0,
        error=_root(candidates[0].risk),
        considered=tuple(Considered(each.setting, _root(each.risk)) for each in candidates),
        flips=flips,
        volume_change=_compute_volume_change(mesh, Y),
        displacement=0.0,
        kernels=mesh.kernels.name,
        warning=join_warnings(*notes, noise.warning),
        seconds=0.0,
        creases=0 if mesh.cut is None else len(mesh.cut.edges),
    )


def _denoise_varying(
    mesh: FaceOperators,
    varying: VaryingNoise,
    setting: EdgeAware,
    region: FaceRegion,
    with_isotropic: bool,
    progress: Progress | None,
) -> EdgeAwareResult:
    """Noise that is not the same everywhere: a setting for each octave of its level, and their results blended."""
    X, at = mesh.V, mesh.ops.active
    bands = split_by_level(varying)
    Y, results, passed_on = X.copy(), [], np.zeros(len(at))
    for number, (members, share) in enumerate(bands):
        counted = np.zeros(len(X), dtype=np.bool_)
        counted[at[members]] = True
        own = subrange(progress, number / len(bands), 1 / len(bands))
        band = replace(mesh, counted=counted)
        result = _denoise(band, setting, region, with_isotropic, own, may_have_strays=False, may_vary=False)
        if result.noise.is_left_alone and number < len(bands) - 1:  # where noise ends, as the next higher band
            passed_on += share
            continue
        Y[at] += (share + passed_on)[:, None] * (result.vertices - X)[at]
        passed_on[:] = 0.0
        results.append((result, int(members.sum())))
    first, _ = max(results, key=lambda pair: (not pair[0].noise.is_left_alone, pair[1]))
    squares = sum(count * np.nan_to_num(result.error) ** 2 for result, count in results)
    isotropic = sum(count * _find_isotropic_error(result) ** 2 for result, count in results)
    local = mesh.ops.spread(np.where(varying.is_noisy, varying.level, 0.0))
    noise = replace(varying.noise, local=local).scaled(mesh.ops.exponent)
    if first.considered and isotropic <= _AS_GOOD**2 * squares:  # its strength varies without bands
        Y = smooth_automatically(mesh, X).vertices
        fractions = region.fractions(mesh.F, len(X))
        Y = Y if fractions is None else X + fractions[:, None] * (Y - X)
        chosen = min(first.considered, key=lambda each: (not each.setting.is_isotropic, each.error))
        first = replace(
            first,
            start=SMOOTHED,
            strength=0.0,
            range_sigma=0.0,
            iterations=0,
            barycenter_weight=chosen.setting.barycenter_weight or 0.0,
            considered=(chosen, *(each for each in first.considered if each is not chosen)),
        )
        squares = isotropic
    return replace(
        first,
        vertices=Y,
        noise=noise,
        level=noise.level,
        error=float(np.sqrt(squares / sum(count for _, count in results))),
        flips=max(result.flips for result, _ in results),
        volume_change=_compute_volume_change(mesh, Y),
        warning=join_warnings(describe_varying(varying), *(result.warning for result, _ in results)),
    )


def _find_isotropic_error(result: EdgeAwareResult) -> float:
    """The least estimated error of the isotropic filter; infinite where it was not tried."""
    errors = [each.error for each in result.considered if each.setting.is_isotropic]
    return min(errors, default=0.0 if result.noise.is_left_alone else np.inf)


def _choose_isotropic(mesh: FaceOperators, patches: Patches, found: NoiseEstimate) -> Candidate:
    """The isotropic filter with the weight that it chooses by itself, which lets hardly any noise through."""
    on = replace(mesh.ops, positions=mesh.V[mesh.ops.active])
    low_pass = CandidateLowPass(Heat().family, DEFAULT_WAVELENGTH_IN_EDGES)
    choice = choose_on_patches(on, patches, found, [low_pass], mesh.counted[mesh.ops.active])
    return Candidate(EdgeAware(iterations=0, start=SMOOTHED, barycenter_weight=choice.weight), choice.risk)


def _denoise_repaired(
    mesh: FaceOperators,
    repaired: FaceOperators,
    outliers: npt.NDArray[np.int64],
    setting: EdgeAware,
    region: FaceRegion,
    with_isotropic: bool,
    progress: Progress | None,
) -> EdgeAwareResult:
    """The same for a mesh whose strays were put back, in units of the edges that it has then."""
    center = repaired.V.min(axis=0) / 2 + repaired.V.max(axis=0) / 2
    h = compute_mean_side(repaired.V - center, repaired.F)
    if h == 0:  # without the strays nothing is left
        return _leave_unchanged(mesh.V, Noise.zero(0.0), 0.0, np.nan)
    X = (repaired.V - center) / h
    rescaled = assemble_faces(X, repaired.F, repaired.counted, repaired.boundary, is_exact=mesh.is_exact)
    result = _denoise(rescaled, setting, region, with_isotropic, progress, may_have_strays=False)
    if result.noise.kind == UNCLEAR:  # then strays cannot be distinguished from shape either
        return replace(_scale(result, h), vertices=mesh.V)
    if result.noise.kind == IMPULSE:  # those were the highest of many
        return _denoise(mesh, setting, region, with_isotropic, progress, may_have_strays=False)
    vertices = repaired.V + (result.vertices - rescaled.V) * h
    return replace(
        _scale(result, h),
        vertices=vertices,
        volume_change=_compute_volume_change(mesh, vertices),
        outliers=outliers,
        warning=join_warnings(describe_outliers(outliers), result.warning),
    )


def _find_creases(mesh: FaceOperators, region: FaceRegion, noise: Noise, level: float) -> Integers | None:
    """Edges that nothing crosses, as given or by their angle; None where neither is given."""
    return region.creases if region.angle is None else find_creases_by_angle(mesh, region.angle, noise, level)


def find_lost(mesh: FaceOperators, Y: Floats, level: float) -> Booleans | None:
    """Vertices that would be lost between long thin triangles; None if there are none."""
    at = mesh.ops.active
    found = find_lost_vertices((Y - mesh.V)[at], replace(mesh.ops, positions=mesh.V[at]), level)
    if found is None:
        return None
    lost = np.zeros(len(mesh.V), dtype=np.bool_)
    lost[at] = found
    return lost


def apply_and_repair(mesh: FaceOperators, setting: EdgeAware, progress: Progress | None) -> tuple[Floats, int]:
    """What a setting makes of the mesh, and how many faces are flipped."""
    X = mesh.V
    if setting.start == CLIPPED:
        smoothed = smooth_automatically(mesh, X).vertices
    else:
        smoothed = smooth_isotropically(mesh, X, setting.barycenter_weight or MAX_WEIGHT)
    Y = apply_setting(mesh, X, smoothed, setting, progress)
    return repair_flips(mesh, Y, smoothed)


def _apply(mesh: FaceOperators, setting: EdgeAware, level: float, progress: Progress | None) -> tuple[Floats, int]:
    """What a setting makes of the mesh, its volume held, and how many faces are flipped."""
    X = mesh.V
    Y, flips = apply_and_repair(mesh, setting, progress)
    volume = 0.0 if mesh.on_boundary.any() else compute_volume(mesh, X)
    return (restore_volume(mesh, Y, volume, level) if volume else Y), flips


def _weaken(
    mesh: FaceOperators, Y: Floats, noise: Noise, change: ShapeChange, fractions: Floats | None
) -> tuple[Floats, float, str]:
    """What is returned where a result changes the shape by more than the noise explains.

    It is the choice of the isotropic filter, held against the noise as well; where that changes too much, the input.
    """
    X = mesh.V
    closed, labels = _label_components(mesh)
    automatic = smooth_automatically(mesh, X)
    weaker = automatic.vertices
    if fractions is not None:
        weaker = X + fractions[:, None] * (weaker - X)
    still = compare_shapes(X, weaker, mesh.F, closed, labels, noise).excessive
    weaker = np.where((change.excessive & still)[labels][:, None], X, weaker)
    returned = np.where(change.excessive[labels][:, None], weaker, Y)
    done = "the input is" if np.array_equal(returned, X) else "a weaker result is"
    return returned, float(np.median(automatic.barycenter_weight)), change.describe_replaced(done)


def _label_components(mesh: FaceOperators) -> tuple[npt.NDArray[np.bool_], npt.NDArray[np.int32]]:
    """Which connected components are closed, and the component of each vertex."""
    count, of_active = label_components(mesh.ops.L)
    labels = np.empty(len(mesh.V), dtype=np.int32)
    labels[mesh.ops.active] = of_active
    closed = np.ones(count, dtype=np.bool_)
    closed[labels[mesh.on_boundary]] = False
    return closed, labels


def put_strays_back(
    mesh: FaceOperators, region: FaceRegion, median: float | None = None
) -> tuple[FaceOperators, npt.NDArray[np.int64]]:
    """The mesh with single stray vertices put back where they may move, and their indices.

    ``median``: the distance of a vertex from the mean of its neighbors, of a surface that the mesh is a part of.
    """
    at = mesh.ops.active
    positions, strays = replace_outliers(mesh.V[at], mesh.ops.L, mesh.ops.boundary_vertices, median)
    may_move = np.ones(len(mesh.V), dtype=np.bool_) if region.inside is None else region.inside.copy()
    strays = strays[may_move[at[strays]]]
    if len(strays) == 0:
        return mesh, strays
    V = mesh.V.copy()
    V[at[strays]] = positions[strays]
    return at_positions(mesh, V), np.sort(at[strays]).astype(np.int64)


def _compute_volume_change(mesh: FaceOperators, Y: Floats) -> float:
    """In per cent; NaN for an open surface."""
    volume = 0.0 if mesh.on_boundary.any() else compute_volume(mesh, mesh.V)
    return 100 * (compute_volume(mesh, Y) - volume) / abs(volume) if volume else np.nan


def _scale(result: EdgeAwareResult, h: float) -> EdgeAwareResult:
    """The evidence with lengths times h."""
    return replace(
        result,
        noise=result.noise.scaled(0, h),
        level=result.level * h,
        error=result.error * h,
        considered=tuple(Considered(each.setting, each.error * h) for each in result.considered),
    )


def find_active(V: Floats, F: Integers, weld: bool) -> tuple[Integers, Integers, Integers, int]:
    """The vertices with an edge, the index of each vertex among them or -1, their faces, and how many are copies."""
    used = find_referenced_vertices(F, len(V))
    copies = find_copies(V, used) if weld else None
    welded = 0
    if copies is not None:
        welded = int((copies[used] != np.flatnonzero(used)).sum())
        F = copies.take(F)
    has_edge = find_referenced_vertices(drop_point_faces(F), len(V))
    index = np.where(has_edge, np.cumsum(has_edge, dtype=np.int32) - np.int32(1), np.int32(-1))
    G = np.ascontiguousarray(index[F[has_edge[F].all(axis=1)]])
    if copies is not None:
        index[used] = index[copies[used]]
    return np.flatnonzero(has_edge).astype(np.int32), index, G, welded


def _root(squared: float) -> float:
    """The root of an estimate, which may be negative where the error is small."""
    return float(np.sqrt(max(squared, 0.0)))


def _leave_unchanged(vertices: Floats, noise: Noise, error: float, volume_change: float) -> EdgeAwareResult:
    """For surfaces without an edge of any length, without noise, or with none that can be separated from shape."""
    return EdgeAwareResult(
        vertices=vertices,
        noise=noise,
        level=0.0,
        start=GIVEN,
        strength=0.0,
        range_sigma=0.0,
        iterations=0,
        barycenter_weight=MAX_WEIGHT,
        error=error,
        considered=(),
        flips=0,
        volume_change=volume_change,
        displacement=0.0,
        kernels="none",
        warning=None,
        seconds=0.0,
    )

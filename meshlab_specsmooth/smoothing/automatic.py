"""Smoothing by the noise of the mesh: the weight is chosen, strays and impulses are removed, the shape is kept.

The steps: single stray vertices are put back; the weight of least estimated error is chosen on patches; the filter
starts from clipped impulses, or from a smoothed boundary; the result is held against what the noise explains. Groups of
components of different scale or noise are treated one by one.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from meshlab_specsmooth.arrays import Floats
from meshlab_specsmooth.geometry.surface import Surface
from meshlab_specsmooth.geometry.triangles import compute_vertex_normals
from meshlab_specsmooth.noise.estimate import MAX_WEIGHT, MIN_WEIGHT
from meshlab_specsmooth.noise.local import describe_varying
from meshlab_specsmooth.noise.model import CORRELATED, IMPULSE, STAIRCASE, UNCLEAR, Noise
from meshlab_specsmooth.noise.outliers import describe_outliers, replace_outliers
from meshlab_specsmooth.noise.parts import Part, describe_left_alone, describe_levels, group_components
from meshlab_specsmooth.noise.shape_change import ShapeChange, compare_shapes
from meshlab_specsmooth.noise.thin_triangles import describe_lost, find_lost_vertices
from meshlab_specsmooth.noise.voxels import Voxels
from meshlab_specsmooth.operators.assemble import Operators, assemble_surface, scale_by_power
from meshlab_specsmooth.operators.components import label_components
from meshlab_specsmooth.risk.choose_weight import (
    STAIRCASE_ITERATIONS,
    STAIRCASE_WAVELENGTH,
    CandidateLowPass,
    WeightChoice,
    choose_weight,
)
from meshlab_specsmooth.risk.impulses import clip_impulses
from meshlab_specsmooth.runtime import blocks
from meshlab_specsmooth.runtime.progress import Progress, finish, monotone, subrange
from meshlab_specsmooth.runtime.workspace import Workspace
from meshlab_specsmooth.smoothing.filter import (
    DEFAULT_WAVELENGTH_IN_EDGES,
    check_start,
    check_workspace,
    design_low_pass,
    get_displacement,
    leave_empty,
    make_result,
    move_vertices,
    smooth_by_setting,
    to_edges,
    with_displacement,
)
from meshlab_specsmooth.smoothing.region import (
    check_region,
    exclude_vertices,
    explain_no_motion,
    resolve_region,
    spread_weights,
)
from meshlab_specsmooth.smoothing.result import SmoothingResult, add_warnings
from meshlab_specsmooth.smoothing.settings import EVERYWHERE, Region, Smoothing
from meshlab_specsmooth.smoothing.tangential import (
    move_boundary_along_normals,
    remove_tangential,
    tangential_fraction,
)
from meshlab_specsmooth.spectral.cutoff import wavelength_in_edges
from meshlab_specsmooth.spectral.low_pass import Heat, Ideal, LowPassLike
from meshlab_specsmooth.spectral.response import Response

# If a result changes the shape by more than the noise explains, the weight is multiplied by this, this often, before
# the input is returned.
_RETRY_FACTOR, _MAX_RETRIES = 3.0, 2

# Fraction of the time of a call that the choice of a weight takes.
_CHOICE = 0.6


@dataclass(frozen=True, eq=False)
class Chosen:
    """A choice, as a setting, and where the filter starts.

    Attributes
    ----------
    choice : WeightChoice
    setting : Smoothing
        With the weight and the low-pass of the choice.
    start : Operators
        The mesh with impulses clipped, or with a smoothed boundary; as given otherwise.
    candidates : tuple
        The low-passes that were considered.
    """

    choice: WeightChoice
    setting: Smoothing
    start: Operators
    candidates: tuple[LowPassLike, ...]


@blocks.one_blas_thread()
def smooth_operators(
    ops: Operators,
    setting: Smoothing,
    region: Region = EVERYWHERE,
    *,
    start: SmoothingResult | None = None,
    workspace: Workspace | None = None,
    progress: Progress | None = None,
) -> SmoothingResult:
    """Smooth by a setting, after choosing its weight if it has none; parameters as for :func:`smooth_by_setting`."""
    if setting.barycenter_weight is not None:
        return smooth_by_setting(ops, setting, region, start=start, workspace=workspace, progress=progress)
    began = time.perf_counter()
    check_region(ops, region)
    if len(ops.active) == 0:
        return leave_empty(ops, setting, setting.low_pass or Heat(), began)
    if start is not None:
        check_start(ops, start)
    workspace = check_workspace(workspace)
    result = _smooth_automatically(ops, setting, region, start, workspace, progress, began)
    finish(progress)
    return add_warnings(result, explain_no_motion(region, region.feature_gain))


def choose_setting(
    ops: Operators, setting: Smoothing, region: Region = EVERYWHERE, progress: Progress | None = None
) -> Chosen:
    """The setting of least estimated error, and where to start from.

    Parameters
    ----------
    ops : Operators
    setting : Smoothing
        Its weight is chosen; a low-pass that is given is kept.
    region : Region
    progress : callable, optional
    """
    mask = None if region.mask is None else spread_weights(ops, "mask", region.mask)[:, 0] > 0
    # heat, whose polynomial is short for any weight, and the paper's
    given = setting.low_pass
    candidates: tuple[LowPassLike, ...] = (Heat(), Ideal()) if given is None else (given,)
    tried = [_as_candidate(ops, low_pass, setting) for low_pass in candidates]
    voxels = None if setting.spacing is None else Voxels.of(setting.spacing, 2.0**-ops.exponent)
    choice = choose_weight(ops, tried, mask, subrange(progress, 0.0, _CHOICE), voxels)
    weight: float | Floats = choice.weight
    if choice.varying is not None:
        weight = np.full(len(ops.surface.vertices), MAX_WEIGHT)
        weight[ops.active] = np.clip(choice.weights, MIN_WEIGHT, MAX_WEIGHT)
    chosen = replace(setting, low_pass=candidates[choice.low_pass], barycenter_weight=weight, spacing=None)
    if choice.noise.kind == STAIRCASE:
        wavelength = float(np.ldexp(STAIRCASE_WAVELENGTH * choice.noise.mean_edge, ops.exponent))
        chosen = replace(chosen, low_pass=Heat(wavelength=wavelength), iterations=STAIRCASE_ITERATIONS)
    return Chosen(choice, chosen, prepare_start(ops, choice.noise, choice.weight, region), candidates)


def prepare_start(ops: Operators, noise: Noise, weight: float, region: Region = EVERYWHERE) -> Operators:
    """Where the filter starts: with impulses clipped, or a boundary smoothed along the normals; the mesh otherwise."""
    if noise.kind == IMPULSE:
        free = resolve_region(ops, region).free
        return replace(ops, positions=np.where(free > 0, clip_impulses(ops), ops.positions))
    if noise.kind == CORRELATED and region.boundary == "auto" and ops.boundary is not None:
        free = resolve_region(ops, replace(region, boundary="free")).free
        return replace(ops, positions=np.where(free > 0, move_boundary_along_normals(ops, weight), ops.positions))
    return ops


def _as_candidate(ops: Operators, low_pass: LowPassLike, setting: Smoothing) -> CandidateLowPass:
    if isinstance(low_pass, Response):
        return CandidateLowPass(low_pass)
    if low_pass.modes is None:
        shortest = to_edges(ops, "wavelength", low_pass.wavelength, DEFAULT_WAVELENGTH_IN_EDGES)
    else:
        cutoff = design_low_pass(ops, low_pass, setting, 1.0).cutoff
        shortest = wavelength_in_edges(cutoff.eigenvalue)
    return CandidateLowPass(low_pass.family, shortest)


def _smooth_automatically(
    ops: Operators,
    setting: Smoothing,
    region: Region,
    start: SmoothingResult | None,
    workspace: Workspace,
    progress: Progress | None,
    began: float,
    is_part: bool = False,
) -> SmoothingResult:
    count, labels = label_components(ops.L)
    if count > 1 and not is_part and setting.spacing is None:
        parts = group_components(ops, count, labels)
        if len(parts) > 1:
            return _smooth_parts(ops, parts, setting, region, progress, began)
    base, outliers = put_strays_back(ops, region)
    chosen = choose_setting(base, setting, region, progress)
    if base is not ops and chosen.choice.noise.kind == IMPULSE:  # those were the highest of many
        base, outliers = ops, outliers[:0]
        chosen = choose_setting(base, setting, region, progress)
    if progress is not None:
        progress(_CHOICE)
    progress, noise = subrange(progress, _CHOICE, 1 - _CHOICE), chosen.choice.noise
    if noise.kind == UNCLEAR:  # then strays cannot be distinguished from shape either
        base, outliers = ops, outliers[:0]
    if noise.is_left_alone:
        result = _leave_unchanged(base, chosen, began)
    else:
        result = _smooth_within_noise(base, chosen, region, start, workspace, progress, count, labels)
    result = add_repair(ops, result, base)
    unit = ops.exponent
    if noise.varies and chosen.choice.varying is not None:
        varying = chosen.choice.varying
        noise = replace(noise, local=ops.spread(np.where(varying.is_noisy, varying.level, 0.0)))
    result = replace(
        result,
        noise=noise.scaled(unit),
        estimated_error=float(np.ldexp(chosen.choice.error, unit)),
        mean_edge=float(np.ldexp(noise.mean_edge, unit)),
        outliers=ops.active[outliers].astype(np.int64),
        seconds=time.perf_counter() - began,
    )
    return add_warnings(result, describe_outliers(outliers), noise.warning)


def _smooth_parts(
    ops: Operators,
    parts: Sequence[Part],
    setting: Smoothing,
    region: Region,
    progress: Progress | None,
    began: float,
) -> SmoothingResult:
    """Smooth each part by its own noise and edges; the evidence is that of the largest measurable one."""
    displacement = np.zeros_like(ops.positions)
    results: list[tuple[Part, SmoothingResult]] = []
    mask = None if region.mask is None else spread_weights(ops, "mask", region.mask)[:, 0]
    features = None if region.features is None else spread_weights(ops, "features", region.features)[:, 0]
    vertices = ops.surface.vertices[ops.active]
    index = np.empty(len(ops.active), dtype=np.int32)
    warnings, done = [], 0
    for each in parts:
        if each.is_left_alone:
            warnings.append(describe_left_alone(each))
            continue
        at = each.vertices
        index[at] = np.arange(len(at), dtype=np.int32)
        surface = Surface(vertices[at], index[ops.faces[each.faces]])
        alone = assemble_surface(surface, ops.laplacian, weld=False)
        result = _smooth_automatically(
            alone,
            scale_modes(setting, len(at) / len(ops.active), len(alone.active)),
            replace(
                region,
                mask=None if mask is None else mask[at],
                features=None if features is None else features[at],
            ),
            None,
            Workspace(),
            subrange(progress, done / len(vertices), len(at) / len(vertices)),
            time.perf_counter(),
            is_part=True,
        )
        done += len(at)
        displacement[at] = scale_by_power(result.vertices - vertices[at], -ops.exponent)
        results.append((each, result))
        if result.warning is not None:
            warnings.append(f"in the part of {len(at)} of {len(vertices)} vertices: {result.warning}")
    moved, rms = move_vertices(ops, displacement)
    _, first = max(
        results,
        key=lambda pair: (pair[1].noise is not None and not pair[1].noise.is_left_alone, len(pair[0].vertices)),
    )
    squares = [len(p.vertices) * (r.estimated_error or 0.0) ** 2 for p, r in results]
    local = np.zeros(len(vertices))
    for each, part in results:
        if part.noise is not None:
            local[each.vertices] = part.noise.level if part.noise.local is None else part.noise.local
    result = replace(
        first,
        vertices=moved,
        displacement=rms,
        estimated_error=float(np.sqrt(sum(squares) / len(vertices))),
        welded=ops.welded,
        outliers=np.sort(np.concatenate([ops.active[p.vertices[r.outliers]] for p, r in results])),
        warning=None,
        seconds=time.perf_counter() - began,
        given=ops.surface,
        noise=None if first.noise is None else replace(first.noise, local=ops.spread(local)),
    )
    levels = describe_levels([r.noise for _, r in results if r.noise is not None])
    return add_warnings(result, *ops.notes, levels, *warnings)


def scale_modes(setting: Smoothing, fraction: float, most: int) -> Smoothing:
    """The setting for a part of the mesh: it has its share of the modes."""
    low_pass = setting.low_pass
    if low_pass is None or isinstance(low_pass, Response) or low_pass.modes is None:
        return setting
    modes = min(max(1, round(low_pass.modes * fraction)), most)
    return replace(setting, low_pass=replace(low_pass, modes=modes))


def put_strays_back(
    ops: Operators, region: Region, median: float | None = None
) -> tuple[Operators, npt.NDArray[np.int64]]:
    """The mesh with strays put back where they may move, and their indices among the active vertices.

    ``median``: the distance of a vertex from the mean of its neighbors, of a surface that the mesh is a part of.
    """
    positions, outliers = replace_outliers(ops.positions, ops.L, ops.boundary_vertices, median)
    outliers = outliers[resolve_region(ops, region).free[outliers, 0] > 0]
    if len(outliers) == 0:
        return ops, outliers
    repaired = ops.positions.copy()
    repaired[outliers] = positions[outliers]
    return replace(ops, positions=repaired), outliers


def add_repair(ops: Operators, result: SmoothingResult, base: Operators) -> SmoothingResult:
    """The result for a mesh whose strays were put back, ``base``, as one for the mesh that was given."""
    if base is ops:
        return result
    displacement = get_displacement(ops, result.vertices)
    displacement += base.positions - ops.positions
    return with_displacement(ops, result, displacement)


def _leave_unchanged(ops: Operators, chosen: Chosen, began: float) -> SmoothingResult:
    """The surface as it is, with the evidence of the filter that was not applied."""
    setting = replace(chosen.setting, barycenter_weight=MAX_WEIGHT)
    low_pass = setting.low_pass or Heat()
    filter_ = design_low_pass(ops, low_pass, setting, MAX_WEIGHT)
    return make_result(ops, np.zeros_like(ops.positions), filter_, MAX_WEIGHT, [], setting, began)


def _smooth_within_noise(
    ops: Operators,
    chosen: Chosen,
    region: Region,
    start: SmoothingResult | None,
    workspace: Workspace,
    progress: Progress | None,
    count: int,
    labels: npt.NDArray[np.int32],
) -> SmoothingResult:
    """Smooth with the chosen weight, or a higher one, or not, so that the shape changes no more than noise explains."""
    noise, notes = chosen.choice.noise, []
    varying = chosen.choice.varying
    if varying is not None:
        if not varying.is_noisy.all():
            region = replace(region, mask=exclude_vertices(ops, region, ~varying.is_noisy))
        description = describe_varying(varying)
        notes += [] if description is None else [description]

    def smooth(setting: Smoothing, region: Region, start: SmoothingResult | None) -> SmoothingResult:
        result = smooth_by_setting(
            chosen.start, setting, region, start=start, workspace=workspace, progress=monotone(progress)
        )
        return add_start(ops, result, chosen.start, noise)

    setting = chosen.setting
    result, region, note = leave_lost(ops, noise, region, lambda region, start: smooth(setting, region, start), start)
    notes += [] if note is None else [note]
    displacement = get_displacement(ops, result.vertices)
    change = first = compare_to_result(ops, displacement, count, labels, noise)
    weight: float | Floats = 1.0 if setting.barycenter_weight is None else setting.barycenter_weight
    for _ in range(_MAX_RETRIES):
        if not change.excessive.any():
            break
        held = _hold_volume(ops, displacement, change, labels, noise, region)
        if not compare_to_result(ops, held, count, labels, noise).excessive.any():
            notes.append(f"the volume was held, which smoothing would change ({change.describe()})")
            return add_warnings(with_displacement(ops, result, held), *notes)
        weight = weight * _RETRY_FACTOR
        result = smooth(replace(setting, barycenter_weight=weight), region, None)
        displacement = get_displacement(ops, result.vertices)
        change = compare_to_result(ops, displacement, count, labels, noise)
    if first.excessive.any():
        returned = "a weaker result is"
        if change.excessive.any():  # what still changes too much is left alone, component by component
            displacement[change.excessive[labels]] = 0.0
            result = with_displacement(ops, result, displacement)
            returned = f"for {int(change.excessive.sum())} of {count} components the input is"
        notes.append(first.describe_replaced("the input is" if change.excessive.all() else returned))
    return add_warnings(result, *notes)


def leave_lost(
    ops: Operators,
    noise: Noise,
    region: Region,
    smooth: Callable[[Region, SmoothingResult | None], SmoothingResult],
    start: SmoothingResult | None = None,
) -> tuple[SmoothingResult, Region, str | None]:
    """Smooth, and once more without vertices that would be lost between thin triangles; with the region, and a note."""
    result = smooth(region, start)
    lost = find_lost_vertices(get_displacement(ops, result.vertices), ops, noise.level)
    if lost is None:
        return result, region, None
    region = replace(region, mask=exclude_vertices(ops, region, lost))
    result = smooth(region, None)
    displacement = get_displacement(ops, result.vertices)
    displacement[lost] = 0.0  # where impulses were clipped before
    return with_displacement(ops, result, displacement), region, describe_lost(lost)


def add_start(ops: Operators, result: SmoothingResult, start: Operators, noise: Noise) -> SmoothingResult:
    """The result with the clipping of impulses added, and without needless shifts along the surface."""
    fraction = tangential_fraction(noise)
    if start is ops and fraction == 1:
        return result
    displacement = get_displacement(ops, result.vertices)
    displacement += start.positions - ops.positions
    return with_displacement(ops, result, remove_tangential(displacement, ops, fraction))


def _hold_volume(
    ops: Operators,
    displacement: Floats,
    change: ShapeChange,
    labels: npt.NDArray[np.int32],
    noise: Noise,
    region: Region,
) -> Floats:
    """The displacement with components moved along their normals to their former volume, where a level suffices."""
    step = np.where(np.abs(change.offset) <= noise.level, change.offset, 0.0)[labels]
    along = step[:, None] * compute_vertex_normals(ops.positions + displacement, ops.faces)
    if region.mask is not None:
        along *= spread_weights(ops, "mask", region.mask)
    return displacement + along


def compare_to_result(
    ops: Operators, displacement: Floats, count: int, labels: npt.NDArray[np.int32], noise: Noise
) -> ShapeChange:
    """What a displacement changes of each component's shape, and whether the noise explains it."""
    closed = np.ones(count, dtype=np.bool_)
    closed[labels[ops.boundary_vertices]] = False
    return compare_shapes(
        ops.positions,
        ops.positions + displacement,
        ops.faces,
        closed,
        labels if count > 1 else None,
        noise,
    )


def warn_of_change(ops: Operators, result: SmoothingResult) -> SmoothingResult:
    """The result of a given weight, with a warning if it changes the volume or the size of a shape by per cents."""
    if len(ops.active) == 0:
        return result
    count, labels = label_components(ops.L)
    displacement = get_displacement(ops, result.vertices)
    change = compare_to_result(ops, displacement, count, labels, Noise.zero(ops.mean_edge))
    note = f"this weight changes the shape: {change.describe()}" if change.is_large else None
    return add_warnings(result, note)

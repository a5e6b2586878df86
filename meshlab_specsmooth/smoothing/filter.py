"""The three steps for a given setting: differential coordinates, their low-pass, reconstruction."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from meshlab_specsmooth.arrays import Floats
from meshlab_specsmooth.errors import InvalidParameter
from meshlab_specsmooth.graph.laplacian import Laplacian
from meshlab_specsmooth.noise.estimate import MAX_WEIGHT
from meshlab_specsmooth.noise.model import Noise
from meshlab_specsmooth.operators.assemble import Operators, scale_by_power
from meshlab_specsmooth.operators.barycenters import Gram, weighted_gram_of_barycenters
from meshlab_specsmooth.operators.boundary import BoundaryCurve, blend, extend_to_boundary
from meshlab_specsmooth.operators.reconstruction import Constraints, Solution, error_gain, solve
from meshlab_specsmooth.parameters import check_count, check_progress, show
from meshlab_specsmooth.runtime import blocks
from meshlab_specsmooth.runtime.progress import Progress, announce, finish, subrange
from meshlab_specsmooth.runtime.workspace import Workspace
from meshlab_specsmooth.smoothing.region import (
    NO_FEATURES,
    ActiveRegion,
    explain_no_motion,
    resolve_region,
    spread_weights,
)
from meshlab_specsmooth.smoothing.result import SmoothingResult, add_warnings, join_warnings
from meshlab_specsmooth.smoothing.settings import EVERYWHERE, Enhancement, LowPass, Region, Setting, Smoothing
from meshlab_specsmooth.spectral import SpectralFilter
from meshlab_specsmooth.spectral.chebyshev import ChebyshevSeries
from meshlab_specsmooth.spectral.cutoff import wavelength_in_edges
from meshlab_specsmooth.spectral.design import Design, design, design_band, is_exact
from meshlab_specsmooth.spectral.low_pass import Heat, Ideal, LowPassLike
from meshlab_specsmooth.spectral.response import Response

# The default cut-off: waves of 20 edges are shape on any mesh that resolves its shape at all, and noise has waves of a
# few edges.
DEFAULT_WAVELENGTH_IN_EDGES = 20.0

# The default band of an enhancement: longer waves are the shape, shorter ones the noise.
MAX_ENHANCED_IN_EDGES, MIN_ENHANCED_IN_EDGES = 30.0, 6.0

# Of 2, of the largest displacement in mesh units: with it, coordinates stay in the range of numbers.
_MAX_EXPONENT = 1022

# Warn if the cut-off keeps more than this fraction of the modes.
_MAX_KEPT_FRACTION = 0.9

# Maximum error of the polynomial of a plain low-pass, relative to positions, which are up to a thousand times larger
# than displacements.
POSITION_TOLERANCE = 1e-7

# Waves shorter or longer than this act like these, and their powers would overflow.
_WAVELENGTH_LIMITS = (1e-30, 1e30)


@dataclass(frozen=True, eq=False)
class _Barycenters:
    """How firmly the barycenters are held: one weight, or a Gram matrix that contains the weights of the faces.

    ``release`` is about the fraction of the low-pass' displacement that they allow, for a start of step 3.
    """

    given: float | Floats
    lowest: float
    gram: Gram
    factor: float
    release: float | Floats


@blocks.one_blas_thread()
def smooth_by_setting(
    ops: Operators,
    setting: Smoothing,
    region: Region = EVERYWHERE,
    *,
    start: SmoothingResult | None = None,
    workspace: Workspace | None = None,
    progress: Progress | None = None,
) -> SmoothingResult:
    """Apply a setting whose weight is given.

    Parameters
    ----------
    ops : Operators
    setting : Smoothing
    region : Region
    start : SmoothingResult, optional
        An earlier result for this surface with a similar setting, as a slider has it: the least squares start from it,
        which saves iterations and changes the result only within their tolerance.
    workspace : Workspace, optional
        Work arrays of earlier calls with meshes of the same size, used again.
    progress : callable, optional
    """
    began = time.perf_counter()
    progress = check_progress(progress)
    weight = setting.barycenter_weight
    if weight is None:
        raise InvalidParameter("barycenter_weight is None; choose one first")
    kept = 0.0 if region.features is None else region.feature_gain * spread_weights(ops, "features", region.features)
    active = resolve_region(ops, region, 1.0 - kept)
    guess = None if start is None else check_start(ops, start)
    low_pass = setting.low_pass or Heat()
    if len(ops.active) == 0:
        return leave_empty(ops, setting, low_pass, began)
    held = hold_barycenters(ops, weight)
    designing, progress = split_progress(setting.method, ops, progress)
    across = design_low_pass(ops, low_pass, setting, held.lowest, designing)
    longest = wavelength_in_edges(across.cutoff.eigenvalue)

    def design_along(L: Laplacian, scale: float) -> Design:
        is_response = isinstance(low_pass, Response)
        return design(
            L,
            _stretch(low_pass, scale**2) if isinstance(low_pass, Response) else low_pass.family,
            wavelength=None if is_response else scale * longest,
            method=setting.method,
            tolerance=setting.tolerance,
            error_gain=partial(error_gain, weight=held.lowest / np.sqrt(2)),
        )

    along = _design_along_boundary(ops, region, design_along)
    result = _run(ops, setting, across, along, active, held, workspace, began, progress, guess)
    if not (isinstance(low_pass, Response) or low_pass.modes is not None):
        result = add_warnings(result, _describe_short_cutoff(across, len(ops.active)))
    return add_warnings(result, explain_no_motion(region, region.feature_gain))


@blocks.one_blas_thread()
def enhance_by_setting(
    ops: Operators,
    setting: Enhancement,
    region: Region = EVERYWHERE,
    *,
    workspace: Workspace | None = None,
    progress: Progress | None = None,
) -> SmoothingResult:
    """Apply an enhancement; parameters as for :func:`smooth_by_setting`."""
    began = time.perf_counter()
    progress = check_progress(progress)
    longest = to_edges(ops, "longest", setting.longest, MAX_ENHANCED_IN_EDGES)
    shortest = to_edges(ops, "shortest", setting.shortest, MIN_ENHANCED_IN_EDGES)
    if not shortest < longest:
        raise InvalidParameter(
            f"shortest is {shortest:.3g} and longest {longest:.3g} mean edges; the first must be the smaller one"
        )
    features = region.features
    active = resolve_region(ops, region, 1.0 if features is None else spread_weights(ops, "features", features))
    if len(ops.active) == 0:
        return leave_empty(ops, setting, Ideal(), began)
    held = hold_barycenters(ops, setting.barycenter_weight)

    def design_pass(L: Laplacian, scale: float, weight: float) -> Design:
        return design_band(
            L,
            setting.family,
            scale * longest,
            scale * shortest,
            method=setting.method,
            tolerance=setting.tolerance,
            error_gain=partial(error_gain, weight=weight),
        )

    across = design_pass(ops.L, 1.0, held.lowest)
    along = _design_along_boundary(ops, region, lambda L, scale: design_pass(L, scale, held.lowest / np.sqrt(2)))
    result = _run(ops, setting, across, along, active, held, workspace, began, progress)
    note = NO_FEATURES if features is not None and not np.any(features) else None
    return add_warnings(result, explain_no_motion(replace(region, features=None), 0.0) or note)


@blocks.one_blas_thread()
def low_pass_by_setting(
    ops: Operators, setting: LowPass, region: Region = EVERYWHERE, *, progress: Progress | None = None
) -> SmoothingResult:
    """Apply a plain low-pass of the coordinates; parameters as for :func:`smooth_by_setting`."""
    began = time.perf_counter()
    designing, progress = split_progress(setting.method, ops, check_progress(progress))
    if len(ops.active) == 0:
        return leave_empty(ops, setting, setting.low_pass, began)
    low_pass = design_low_pass(ops, setting.low_pass, setting, None, designing)
    announce(progress, "smoothing")
    displacement = low_pass.filter.apply(ops.L, ops.positions, progress) - ops.positions
    if region.mask is not None:
        displacement *= blend(ops.L, spread_weights(ops, "mask", region.mask))
    result = make_result(ops, displacement, low_pass, 0.0, [], setting, began)
    return add_warnings(result, explain_no_motion(replace(region, features=None), 0.0))


def _run(
    ops: Operators,
    setting: Smoothing | Enhancement,
    across: Design,
    along: Design | None,
    region: ActiveRegion,
    held: _Barycenters,
    workspace: Workspace | None,
    began: float,
    progress: Progress | None,
    guess: Floats | None = None,
) -> SmoothingResult:
    """The three steps, by a filter on the surface and optionally one along the boundary, which is smoothed first."""
    work = check_workspace(workspace)
    iterations = setting.iterations if isinstance(setting, Smoothing) else 1
    displacement, solutions = ops.positions, []
    announce(progress, "smoothing")
    # the least squares take three or four iterations, each of a few sweeps and a polynomial of this degree or so
    sweeping = across.filter.degree / (across.filter.degree + 4 * (2.7 / min(held.lowest, 1.0) ** 0.5 + 3))
    for number in range(iterations):
        step_2 = subrange(progress, number / iterations, sweeping / iterations)
        step_3 = subrange(progress, (number + sweeping) / iterations, (1 - sweeping) / iterations)
        V = ops.positions + displacement if number else ops.positions
        delta = ops.L.product(V, work.borrow(V))
        if region.holds_boundary:
            extend_to_boundary(ops.L, delta, ops.boundary_vertices)
        change, start = _filter_coordinates(setting, across.filter, ops.L, delta, step_2, work)
        if region.is_partial:
            change *= region.change
            if start is not None:
                start *= region.change
        if start is not None and np.any(held.release != 1):
            start *= held.release
        if number == 0 and guess is not None:
            start = guess.copy()
        constraints = None
        if region.is_constrained:
            prescribed = np.zeros_like(V)
            if along is not None and ops.boundary is not None:
                prescribed[ops.boundary_vertices] = _smooth_boundary(
                    ops, setting, ops.boundary, V, across, along, region, held.lowest
                )
            constraints = Constraints(region.free, region.rows, prescribed)
        solution = solve(
            ops.L,
            held.gram,
            held.factor,
            change,
            step_3,
            constraints,
            start,
            setting.tolerance,
            work,
            overwrite_input=True,
        )
        solutions.append(solution)
        displacement = displacement + solution.displacement if number else solution.displacement
    result = make_result(ops, displacement, across, held.given, solutions, setting, began)
    work.give_back(displacement)
    finish(progress)
    return result


def _filter_coordinates(
    setting: Smoothing | Enhancement,
    filter_: SpectralFilter,
    L: Laplacian,
    delta: Floats,
    progress: Progress | None = None,
    workspace: Workspace | None = None,
) -> tuple[Floats, Floats | None]:
    """Step 2: delta' - delta, for differential coordinates of the surface or of its boundary, which are overwritten.

    And, of a polynomial, the displacement that has this difference but for the lowest modes: step 3 starts from it.
    """
    gain, kept = (setting.gain - 1, 0.0) if isinstance(setting, Enhancement) else (1.0, 1.0)
    if not isinstance(filter_, ChebyshevSeries):
        change = filter_.apply(L, delta, progress, workspace)
        change *= gain
        change -= kept * delta
        return change, None
    # p(L) delta = p(0) delta + L g(L) delta
    constant, divided = filter_.divide()
    start = divided.apply(L, delta, progress, workspace)
    if gain != 1:
        start *= gain
    # delta becomes L start + (gain p(0) - kept) delta
    blocks.parallel_rows(lambda at: np.multiply(delta[at], kept - gain * constant, out=delta[at]), len(delta))
    L.step(start, start, delta, factor=1.0, coefficient=1.0)
    return delta, start


def _smooth_boundary(
    ops: Operators,
    setting: Smoothing | Enhancement,
    curve: BoundaryCurve,
    V: Floats,
    across: Design,
    along: Design,
    region: ActiveRegion,
    weight: float,
) -> Floats:
    """(b, 3) displacement of the boundary by the same three steps along its curve."""
    at = curve.vertices
    change, start = _filter_coordinates(setting, along.filter, curve.L, curve.L @ V[at])
    change *= region.change[at]
    # A closed curve is the wave that goes around it once. Where that is cut off, with a margin for the softened step,
    # the hole would close.
    wavelength = wavelength_in_edges(across.cutoff.eigenvalue) * ops.mean_edge
    free = region.inside[at] * (curve.length > 1.25 * wavelength).astype(np.float64)
    constraints = Constraints(free, np.ones((len(at), 1)), np.zeros_like(change))
    return solve(curve.L, curve.gram, weight, change, None, constraints, start, setting.tolerance).displacement


def _design_along_boundary(ops: Operators, region: Region, make: Callable[[Laplacian, float], Design]) -> Design | None:
    """The same filter for the boundary curve; None unless the boundary is smoothed along itself.

    ``make`` takes the curve's L and the factor for wavelengths in mean edges of the surface: the curve has edges of its
    own, and the eigenvalue of a wave on a curve is twice that on a surface. The midpoints of a curve hold long waves
    half as firmly as barycenters do, so an error in delta' is amplified as for the weight over sqrt(2).
    """
    curve = ops.boundary
    if region.boundary != "curve" or curve is None or curve.mean_edge == 0:
        return None
    return make(curve.L, ops.mean_edge / curve.mean_edge / np.sqrt(2))


def _stretch(h: Response, factor: float) -> Response:
    """The response with its eigenvalues divided by a factor."""
    return Response(
        h.label,
        lambda x: h.gain(np.minimum(x * factor, 2.0)),
        lambda x: h.smooth_gain(np.minimum(x * factor, 2.0)),
        tuple((low / factor, high / factor) for low, high in h.transitions),
        min(h.support / factor, 2.0),
    )


def design_low_pass(
    ops: Operators,
    low_pass: LowPassLike,
    setting: Smoothing | LowPass,
    weight: float | None,
    progress: Progress | None = None,
) -> Design:
    """The filter of a low-pass on a mesh, for a reconstruction with ``weight``, or for the coordinates themselves."""
    modes = wavelength = None
    if not isinstance(low_pass, Response):
        modes = None if low_pass.modes is None else check_modes(ops, low_pass.modes)
        if modes is None:
            wavelength = to_edges(ops, "wavelength", low_pass.wavelength, DEFAULT_WAVELENGTH_IN_EDGES)
    return design(
        ops.L,
        low_pass if isinstance(low_pass, Response) else low_pass.family,
        modes=modes,
        wavelength=wavelength,
        method=setting.method,
        mode_count=setting.mode_count,
        tolerance=setting.tolerance if isinstance(setting, Smoothing) else POSITION_TOLERANCE,
        error_gain=None if weight is None else partial(error_gain, weight=weight),
        mode_density=ops.mode_density,
        progress=progress,
    )


def check_modes(ops: Operators, modes: int) -> int:
    """A number of modes that the mesh has; raises :class:`InvalidParameter`."""
    most = len(ops.active) or len(ops.surface.vertices)
    return check_count("modes", modes, 1, most, f"1 or more; this mesh has {most}")


def to_edges(ops: Operators, name: str, length: float | None, default: float) -> float:
    """A wavelength in mean edge lengths."""
    if length is None:
        return default
    if ops.mean_edge == 0:
        raise InvalidParameter(f"{name} has no meaning here: no edge of this mesh has a length")
    with np.errstate(over="ignore"):
        edges = np.ldexp(length, -ops.exponent) / ops.mean_edge
    return float(np.clip(edges, *_WAVELENGTH_LIMITS))


def split_progress(method: str, ops: Operators, progress: Progress | None) -> tuple[Progress | None, Progress | None]:
    """Callbacks for the design and for the rest: eigenvectors take nearly all of the time, a polynomial none."""
    designing = 0.9 if is_exact(method, ops.L.size) else 0.0
    return subrange(progress, 0.0, designing), subrange(progress, designing, 1 - designing)


def hold_barycenters(ops: Operators, weight: float | Floats) -> _Barycenters:
    """One weight, or for weights of the vertices those of the faces, the mean over the corners."""
    if not isinstance(weight, np.ndarray):
        return _Barycenters(weight, weight, ops.gram, weight, min(1.0, weight**-2.0))
    n = len(ops.surface.vertices)
    if len(weight) != n:
        raise InvalidParameter(f"barycenter_weight has {len(weight)} entries; this mesh has {n} vertices")
    of_faces = weight[ops.active][ops.faces].mean(axis=1)
    gram = weighted_gram_of_barycenters(ops.faces, len(ops.active), of_faces)
    release = np.minimum(1.0, ops.L.degree / (9 * gram.diagonal))
    return _Barycenters(weight, float(of_faces.min()), gram, 1.0, release)


def leave_empty(ops: Operators, setting: Setting, low_pass: LowPassLike, began: float) -> SmoothingResult:
    """The result for a mesh without an edge: all of its vertices stay."""
    if not isinstance(low_pass, Response):
        if low_pass.modes is not None:
            check_modes(ops, low_pass.modes)
        to_edges(ops, "wavelength", low_pass.wavelength, DEFAULT_WAVELENGTH_IN_EDGES)
    weight = getattr(setting, "barycenter_weight", 0.0)
    name = low_pass.label if isinstance(low_pass, Response) else type(low_pass).__name__.lower()
    return SmoothingResult(
        vertices=ops.surface.vertices.copy(),
        response=name,
        laplacian=ops.laplacian,
        barycenter_weight=MAX_WEIGHT if weight is None else weight,
        kernels=ops.L.kernels.name,
        seconds=time.perf_counter() - began,
        setting=setting,
        noise=Noise.zero(0.0),
        estimated_error=0.0,
        warning=join_warnings(*ops.notes),
        welded=ops.welded,
        given=ops.surface,
    )


def make_result(
    ops: Operators,
    displacement: Floats,
    low_pass: Design,
    weight: float | Floats,
    solutions: list[Solution],
    setting: Setting,
    began: float,
) -> SmoothingResult:
    """The result of a displacement of the active vertices, which is overwritten."""
    mean_edge = float(np.ldexp(ops.mean_edge, ops.exponent))
    vertices, rms = move_vertices(ops, displacement)
    return SmoothingResult(
        vertices=vertices,
        cutoff=low_pass.cutoff.eigenvalue,
        modes=low_pass.cutoff.modes,
        modes_error=low_pass.cutoff.error,
        wavelength=wavelength_in_edges(low_pass.cutoff.eigenvalue) * mean_edge,
        mean_edge=mean_edge,
        response=low_pass.response.label,
        laplacian=ops.laplacian,
        method=low_pass.method,
        barycenter_weight=weight,
        iterations=max(len(solutions), 1),
        degree=low_pass.filter.degree,
        response_error=low_pass.filter.error,
        cg_iterations=tuple(solution.iterations for solution in solutions),
        residual=max((solution.residual for solution in solutions), default=0.0),
        displacement_error=max((solution.error for solution in solutions), default=0.0),
        displacement=rms,
        kernels=ops.L.kernels.name,
        seconds=time.perf_counter() - began,
        setting=setting,
        warning=join_warnings(*ops.notes),
        welded=ops.welded,
        given=ops.surface,
    )


def move_vertices(ops: Operators, displacement: Floats) -> tuple[Floats, float]:
    """The vertices after a displacement of the active ones, which is overwritten; and its root mean square.

    It is added to the positions as given, and only where it is not zero: the rest stays to the bit.
    """
    vertices = ops.surface.vertices.copy()
    if len(displacement) == 0:
        return vertices, 0.0
    # not by BLAS, whose sums depend on its number of threads
    square = float(np.einsum("ij,ij->", displacement, displacement))
    # the exponent that a coordinate moved by the root of the square would have, at most
    if not np.isfinite(square) or np.frexp(square)[1] / 2 + ops.exponent > _MAX_EXPONENT:
        raise InvalidParameter(
            "the result leaves the range of numbers; take a lower gain or a higher barycenter_weight, or scale the "
            "mesh down"
        )
    rms = float(np.ldexp(np.sqrt(square / len(vertices)), ops.exponent))
    index = ops.active_index

    def move(at: slice) -> None:
        if index is None:
            step = displacement[at]
        else:
            step = displacement.take(index[at], axis=0, mode="wrap")  # several times as fast as brackets
            step[index[at] < 0] = 0.0
        step = scale_by_power(step, ops.exponent)
        np.add(vertices[at], step, out=vertices[at], where=step != 0)

    blocks.parallel_rows(move, len(vertices))
    return vertices, rms


def with_displacement(ops: Operators, result: SmoothingResult, displacement: Floats) -> SmoothingResult:
    """The result with another displacement of the active vertices, which is overwritten."""
    vertices, rms = move_vertices(ops, displacement)
    return replace(result, vertices=vertices, displacement=rms)


def get_displacement(ops: Operators, vertices: Floats) -> Floats:
    """(k, 3) displacement of the active vertices in the units of the positions, for (n, 3) new vertices."""
    V = ops.surface.vertices
    if ops.active_index is None:
        return scale_by_power(vertices - V, -ops.exponent)
    return scale_by_power(vertices.take(ops.active, axis=0) - V.take(ops.active, axis=0), -ops.exponent)


def check_workspace(workspace: object) -> Workspace:
    """The workspace that a caller gives, or a new one; raises :class:`InvalidParameter`."""
    if workspace is None:
        return Workspace()
    if not isinstance(workspace, Workspace):
        raise InvalidParameter(f"workspace is {show(workspace)}; it must be a Workspace")
    return workspace


def check_start(ops: Operators, start: SmoothingResult) -> Floats:
    """The displacement of an earlier result that a caller gives, checked."""
    if not isinstance(start, SmoothingResult):
        raise InvalidParameter(f"start is {show(start)}; it must be an earlier result for this mesh")
    if not isinstance(start.vertices, np.ndarray) or start.vertices.dtype != np.float64:
        raise InvalidParameter(f"start.vertices is {show(start.vertices)}; it must be what a call returned")
    n = len(ops.surface.vertices)
    if start.vertices.shape != (n, 3):
        raise InvalidParameter(f"start is a result for {len(start.vertices)} vertices; this mesh has {n}")
    with np.errstate(all="ignore"):
        guess = get_displacement(ops, start.vertices)
    if not np.isfinite(guess).all():
        raise InvalidParameter("start is too far from this mesh; it must be an earlier result for it")
    return guess


def _describe_short_cutoff(low_pass: Design, vertex_count: int) -> str | None:
    if low_pass.cutoff.modes < _MAX_KEPT_FRACTION * vertex_count:
        return None
    return (
        "the wavelength is so short that nearly all waves which the mesh can carry are longer, and are kept: take one "
        "of five mean edge lengths or more"
    )

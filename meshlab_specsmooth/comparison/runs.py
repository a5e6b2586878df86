"""Runs of filters in a process of their own: at defaults, on perturbed meshes, on a part, and over strengths."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np

from meshlab_specsmooth.arrays import Floats
from meshlab_specsmooth.comparison.filter_specs import FilterSpec
from meshlab_specsmooth.comparison.measured_mesh import EstimatedError, MeasuredMesh
from meshlab_specsmooth.comparison.rows import Curve, Point, Row
from meshlab_specsmooth.errors import FilterFailed
from meshlab_specsmooth.geometry.surface import Surface
from meshlab_specsmooth.meshlab.descriptors import Length, load
from meshlab_specsmooth.meshlab.isolated_filter import FilterProcess, FilterRun
from meshlab_specsmooth.runtime.progress import Progress
from meshlab_specsmooth.spectral.response import name_of

#: Random perturbations for the rows, and for each strength of a sweep.
PROBES, SWEEP_PROBES = 3, 1
# Two results of a filter are the same if their root mean square difference is below this fraction of the noise level;
# automatically chosen numbers are the same within this relative difference
_SAME_RESULT, _SAME_PARAMETER = 1e-4, 0.02
# A filter diverged if it displaced a vertex by more than this multiple of the diagonal of the bounding box
_MAX_DISPLACEMENT = 1.0


@dataclass(frozen=True, eq=False)
class Bench:
    """A mesh to run filters on, with the process that they run in.

    Attributes
    ----------
    mesh : MeasuredMesh
    process : FilterProcess
        Holds the faces of the mesh.
    steps : StepCounter
    """

    mesh: MeasuredMesh
    process: FilterProcess
    steps: StepCounter


class StepCounter:
    """Progress in finished runs and rows, each of the same weight.

    Parameters
    ----------
    progress : callable or None
        Called with the fraction done, from 0 to 1.
    total : int
    """

    def __init__(self, progress: Progress | None, total: int) -> None:
        self._progress = progress
        self._total = total
        self._done = 0

    def advance(self) -> None:
        """Count one more step."""
        self._done += 1
        if self._progress is not None:
            self._progress(min(self._done / self._total, 1.0))


def count_steps(specs: Sequence[FilterSpec], whole: MeasuredMesh, part: MeasuredMesh) -> int:
    """Return the expected number of steps of :func:`run_filters`."""
    swept = sum(len(spec.strength.values) for spec in specs if spec.strength is not None)
    return len(specs) * (3 + len(whole.perturbed)) + swept * (1 + min(len(part.perturbed), SWEEP_PROBES))


def run_filters(
    specs: Sequence[FilterSpec], whole: Bench, part: Bench, pool: ThreadPoolExecutor
) -> tuple[list[tuple[Row, EstimatedError | None]], tuple[Curve, ...]]:
    """Run filters on a mesh, and over their strengths on a part of it.

    Parameters
    ----------
    specs : sequence of FilterSpec
    whole, part : Bench
        The same object if strengths are swept on the whole mesh.
    pool : ThreadPoolExecutor
        With one thread, which waits for the runs while this one measures their results.

    Returns
    -------
    rows : list of (Row, EstimatedError or None)
        The mesh as given first, then one for each filter.
    curves : tuple of Curve
    """
    mesh, is_cut, steps = whole.mesh, part is not whole, whole.steps
    # the runs at defaults come first and alone, because they are timed
    first = [_run_or_reason(whole, spec, mesh.given.vertices) for spec in specs]
    pending = []
    for spec, ran in zip(specs, first, strict=True):
        repeat = None if mesh.single_run else pool.submit(_repeat, whole, spec, ran, PROBES)
        pending.append((repeat, pool.submit(_run_on_part, part, spec, ran) if is_cut else None))
    sweeps = [pool.submit(_sweep, part, spec) for spec in specs]
    rows: list[tuple[Row, EstimatedError | None]] = [_measure_given(mesh, part.mesh)]
    for spec, ran, (repeat, sampled) in zip(specs, first, pending, strict=True):
        perturbed = [] if repeat is None else repeat.result()
        results = None if sampled is None else sampled.result()
        reason = next((x for x in (ran, perturbed, results) if isinstance(x, str)), None)
        if isinstance(ran, str) or isinstance(perturbed, str) or isinstance(results, str):
            rows.append((Row(spec, None, str(reason)), None))
        else:
            rows.append(_measure_run(spec, ran, perturbed, results, mesh, part.mesh))
        steps.advance()
    curves = []
    for sweep in sweeps:
        curves.append(sweep.result())
        steps.advance()
    return rows, tuple(curve for curve in curves if curve is not None)


def _measure_given(mesh: MeasuredMesh, part: MeasuredMesh) -> tuple[Row, EstimatedError | None]:
    """The row of the mesh as given."""
    judge = part if mesh.single_run else mesh
    estimate = judge.estimate_error(judge.given.vertices, judge.perturbed) if mesh.has_estimates else None
    row = _make_row(None, mesh, FilterRun(mesh.given.vertices, {}, math.nan), estimate)
    return replace(row, power=part.power(part.given.vertices)), estimate


def _measure_run(
    spec: FilterSpec,
    ran: FilterRun,
    perturbed: list[Floats | None],
    on_part: list[Floats] | None,
    mesh: MeasuredMesh,
    part: MeasuredMesh,
) -> tuple[Row, EstimatedError | None]:
    """The row of a filter from its run, those on perturbed meshes, and those on the part if there is one."""
    result, responses = (ran.vertices, perturbed) if on_part is None else (on_part[0], [*on_part[1:]])
    estimate = None
    if mesh.has_estimates:
        judged = (part, result, responses) if mesh.single_run else (mesh, ran.vertices, perturbed)
        estimate = judged[0].estimate_error(*judged[1:])
    row = _make_row(spec, mesh, ran, estimate)
    return replace(row, power=part.power(result), response=part.response(result, responses)), estimate


def _make_row(spec: FilterSpec | None, mesh: MeasuredMesh, ran: FilterRun, estimate: EstimatedError | None) -> Row:
    surface = Surface(ran.vertices, mesh.given.faces)
    values, colors = mesh.measure_all(surface)
    uncertainty = math.nan
    if estimate is not None:
        values["estimated_error"], uncertainty = estimate.error, estimate.uncertainty
    if math.isfinite(ran.seconds):
        values["seconds"] = ran.seconds
    names = () if spec is None else spec.auto_parameters
    chosen = {name: ran.output[name] for name in names if name in ran.output}
    digest = hashlib.sha256(np.ascontiguousarray(ran.vertices).tobytes()).hexdigest()
    return Row(spec, surface, "", values, uncertainty, chosen=chosen, colors=colors, hash=digest)


def _run_or_reason(bench: Bench, spec: FilterSpec, vertices: Floats) -> FilterRun | str:
    """Run a filter; return its result, or the reason why it failed."""
    try:
        ran = bench.process.run(vertices, spec.filter, spec.parameters, spec.times)
        moved = np.linalg.norm(ran.vertices - vertices, axis=1).max() / np.linalg.norm(np.ptp(vertices, axis=0))
        if moved > _MAX_DISPLACEMENT:
            return f"diverged: it moved a vertex by {moved:.2g} diagonals of the bounding box"
        return ran
    except FilterFailed as error:
        return str(error)
    finally:
        bench.steps.advance()


def with_chosen(spec: FilterSpec, ran: FilterRun) -> FilterSpec:
    """Return the filter with its automatically chosen values as parameters, as far as it has these parameters."""
    if not spec.auto_parameters:
        return spec
    name = spec.rerun_filter or spec.filter
    own = {parameter.name for parameter in load(name).parameters}
    chosen = {each: ran.output[each] for each in spec.auto_parameters if each in own and ran.output.get(each)}
    if spec.rerun_filter and len(chosen) < len(spec.auto_parameters):
        return spec  # the other filter would choose the rest, by another rule
    if "response" in chosen:
        chosen["response"] = name_of(chosen["response"])
    chosen |= {each: value for each, value in spec.parameters.items() if each in own}
    return spec if chosen == spec.parameters else replace(spec, filter=name, parameters=chosen)


def _for_part(spec: FilterSpec, mesh: MeasuredMesh) -> FilterSpec:
    """The filter for a part of a mesh: lengths that are fractions of the diagonal refer to the whole."""
    parameters = {
        name: Length(value.fraction * mesh.diagonal_ratio) if isinstance(value, Length) else value
        for name, value in spec.parameters.items()
    }
    return replace(spec, parameters=parameters)


def _repeat(bench: Bench, spec: FilterSpec, ran: FilterRun | str, probes: int) -> list[Floats | None] | str:
    """Run a filter on the perturbed meshes at the setting of its first run; None where its choice differed."""
    if isinstance(ran, str):
        return ran
    mesh = bench.mesh
    fixed = with_chosen(spec, ran)
    if fixed is not spec:
        again = _run_or_reason(bench, fixed, mesh.given.vertices)
        # a filter may choose more than its parameters express
        difference = np.inf if isinstance(again, str) else float(np.sqrt(((again.vertices - ran.vertices) ** 2).mean()))
        if difference > _SAME_RESULT * mesh.risk.noise.level:
            fixed = spec
    runs = []
    for X in mesh.perturbed[:probes]:
        again = _run_or_reason(bench, fixed, X)
        if isinstance(again, str):
            return again
        runs.append(again)
    agree = [fixed is not spec or _chose_the_same(spec, ran, again) for again in runs]
    return [again.vertices if same or not any(agree) else None for again, same in zip(runs, agree, strict=True)]


def _chose_the_same(spec: FilterSpec, a: FilterRun, b: FilterRun) -> bool:
    """Whether a filter chose the same parameters in two runs, up to small differences of numbers."""
    for name in spec.auto_parameters:
        x, y = a.output.get(name), b.output.get(name)
        is_near = isinstance(x, float) and isinstance(y, float) and abs(x - y) <= _SAME_PARAMETER * abs(x)
        if x != y and not is_near:
            return False
    return True


def _run_on_part(part: Bench, spec: FilterSpec, ran: FilterRun | str) -> list[Floats] | str:
    """Run a filter on a part of the mesh, and on the part perturbed, at the setting of the run on the whole."""
    if isinstance(ran, str):
        return ran
    fixed = _for_part(with_chosen(spec, ran), part.mesh)
    results = []
    for X in (part.mesh.given.vertices, *part.mesh.perturbed):
        again = _run_or_reason(part, fixed, X)
        if isinstance(again, str):
            return again
        results.append(again.vertices)
    return results


def _sweep(bench: Bench, spec: FilterSpec) -> Curve | None:
    """Run a filter at each value of its strength parameter."""
    if spec.strength is None:
        return None
    mesh, points = bench.mesh, []
    for value in spec.strength.values:
        at_value = spec.with_strength(value, len(mesh.given.vertices))
        on_part = _for_part(at_value, mesh)
        ran = _run_or_reason(bench, on_part, mesh.given.vertices)
        if isinstance(ran, str):
            continue
        values, uncertainty = mesh.measure_basic(Surface(ran.vertices, mesh.given.faces)), math.nan
        perturbed = _repeat(bench, on_part, ran, SWEEP_PROBES)
        if mesh.has_estimates and not isinstance(perturbed, str):
            estimate = mesh.estimate_error(ran.vertices, perturbed)
            values, uncertainty = {"estimated_error": estimate.error, **values}, estimate.uncertainty
        points.append(Point(f"ms.{at_value.call}", value, {**values, "seconds": ran.seconds}, uncertainty))
    return Curve(spec, tuple(points))

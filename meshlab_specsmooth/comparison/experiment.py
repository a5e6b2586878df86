"""The comparison itself: every filter at its defaults and over its strengths, measured, with estimated errors."""

from __future__ import annotations

import math
import platform
import time
from collections.abc import Iterable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from importlib.metadata import PackageNotFoundError, version

import numpy as np

from meshlab_specsmooth.comparison import noise
from meshlab_specsmooth.comparison.comparison import Comparison
from meshlab_specsmooth.comparison.filter_specs import FilterSpec, select_filters
from meshlab_specsmooth.comparison.measured_mesh import EIGENVALUES, EstimatedError, MeasuredMesh, select_patch
from meshlab_specsmooth.comparison.rows import Row
from meshlab_specsmooth.comparison.runs import PROBES, SWEEP_PROBES, Bench, StepCounter, count_steps, run_filters
from meshlab_specsmooth.errors import InvalidParameter, InvalidSurface
from meshlab_specsmooth.geometry.surface import LARGEST_EXPONENT_OF_AREAS, Surface, check_extent, mean_edge_length
from meshlab_specsmooth.meshlab.isolated_filter import FilterProcess
from meshlab_specsmooth.parameters import NOISE_BOUNDS_IN_EXTENTS, check_number
from meshlab_specsmooth.runtime.progress import Progress
from meshlab_specsmooth.version import VERSION


@dataclass(frozen=True)
class SizeLimits:
    """Numbers of vertices at which a comparison saves work.

    Attributes
    ----------
    whole : int
        A larger mesh is swept, and its spectra are measured, on a part of it; its rows have one probe.
    repeated : int
        On a larger mesh each filter runs once only: errors are estimated on the part, and expensive measures are left
        out.
    part : int
        Size of the part.
    """

    whole: int = 60_000
    repeated: int = 250_000
    part: int = 20_000


def experiment(
    given: Surface,
    *,
    truth: Surface | None = None,
    added: float | None = None,
    seed: int = 1,
    filters: Iterable[str | FilterSpec] | None = None,
    name: str = "mesh",
    progress: Progress | None = None,
    limits: SizeLimits = SizeLimits(),
) -> Comparison:
    """Run and measure filters on a surface; see :func:`meshlab_specsmooth.compare`.

    Parameters
    ----------
    given : Surface
        The noisy mesh, or the clean one if noise is to be added.
    truth : Surface, optional
        The true surface, with the same faces or others. With others, measures that need corresponding vertices are
        left out.
    added : float, optional
        Standard deviation of white noise to add to every coordinate, in mean edges; ``given`` is then the truth.
    limits : SizeLimits
    """
    start = time.perf_counter()
    specs = select_filters(filters)
    if added is not None:
        if truth is not None:
            raise InvalidParameter("noise and ground_truth are both given; noise is added to a clean mesh")
        added = check_number("noise", added, *NOISE_BOUNDS_IN_EXTENTS)
        truth, given = given, Surface(noise.gaussian(given, added, seed), given.faces)
    for surface in filter(None, (given, truth)):
        for size in (np.abs(surface.vertices).max(), np.ptp(surface.vertices, axis=0).max()):
            check_extent(int(np.frexp(size)[1]), LARGEST_EXPONENT_OF_AREAS, "squares of areas")
    if mean_edge_length(given) == 0:
        raise InvalidSurface("faces", "have no edge of any length", "give a surface")
    is_cut, single_run = len(given.vertices) > limits.whole, len(given.vertices) > limits.repeated
    whole = MeasuredMesh.of(given, truth, SWEEP_PROBES if is_cut else PROBES, single_run=single_run)
    part = whole.cut(select_patch(given, limits.part), SWEEP_PROBES) if is_cut else whole
    steps = StepCounter(progress, count_steps(specs, whole, part))
    with (
        FilterProcess(given.faces) as process,
        FilterProcess(part.given.faces) as part_process,
        ThreadPoolExecutor(1) as pool,
    ):
        bench = Bench(whole, process, steps)
        try:
            rows, curves = run_filters(specs, bench, Bench(part, part_process, steps) if is_cut else bench, pool)
        except BaseException:
            process.end()  # end running filters, or the pool would wait for them
            part_process.end()
            raise
    return Comparison(
        name,
        given,
        truth,
        added,
        seed,
        whole.context.edge,
        whole.risk.noise,
        _add_gaps(rows),
        curves,
        part.given if is_cut else None,
        EIGENVALUES,
        len(part.perturbed) if single_run else len(whole.perturbed),
        single_run,
        _find_versions(),
        time.perf_counter() - start,
    )


def _find_versions() -> Mapping[str, str]:
    """The versions of all software that a result may depend on."""
    found = {"meshlab-specsmooth": VERSION, "Python": platform.python_version(), "platform": platform.platform()}
    return found | {package: _version_of(package) for package in ("pymeshlab", "numpy", "scipy", "numba")}


def _version_of(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return "not installed"


def _add_gaps(rows: Sequence[tuple[Row, EstimatedError | None]]) -> tuple[Row, ...]:
    """Return the rows with the difference of each from the best row.

    The same probes were used for all rows, so that most of their scatter cancels in the difference.
    """
    best = min((found for _, found in rows if found is not None), key=lambda found: found.error, default=None)
    return tuple(row if found is None or best is None else _with_gap(row, found, best) for row, found in rows)


def _with_gap(row: Row, found: EstimatedError, best: EstimatedError) -> Row:
    difference = np.subtract(found.risks, best.risks)
    difference = difference[np.isfinite(difference)]
    scatter = float(difference.std(ddof=1) / np.sqrt(len(difference))) if len(difference) > 1 else 0.0
    # an error of the noise level changes both in the same direction
    spread = math.hypot(scatter, found.level_term - best.level_term)
    return replace(row, gap=found.error - best.error, gap_uncertainty=spread / max(found.error + best.error, 1e-12))

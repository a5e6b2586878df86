"""The experiment: every filter at its defaults and over its strengths, measured, and its error estimated."""

from __future__ import annotations

import hashlib
import math
import platform
import time
from collections.abc import Iterable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from importlib.metadata import PackageNotFoundError, version

import numpy as np
import numpy.typing as npt
from scipy.sparse import coo_array, csr_array
from scipy.sparse.csgraph import breadth_first_order

from meshlab_specsmooth.arrays import Booleans, Floats
from meshlab_specsmooth.comparison import metrics, noise, shape
from meshlab_specsmooth.comparison.comparison import Comparison, Curve, Point, Row
from meshlab_specsmooth.comparison.competitors import Competitor, competitors
from meshlab_specsmooth.comparison.distances import distances
from meshlab_specsmooth.comparison.shape import Ruler
from meshlab_specsmooth.errors import FilterFailed, InvalidParameter, InvalidSurface
from meshlab_specsmooth.geometry.surface import (
    LARGEST_EXPONENT_OF_AREAS,
    Surface,
    check_extent,
    is_closed,
    mean_edge_length,
    signed_volume,
)
from meshlab_specsmooth.graph.laplacian import Laplacian
from meshlab_specsmooth.isolation.child import Child, Ran
from meshlab_specsmooth.meshlab.descriptors import Length, load
from meshlab_specsmooth.meshlab.measures import hausdorff, self_intersecting_faces
from meshlab_specsmooth.noise.model import UNCLEAR, Noise
from meshlab_specsmooth.operators.assemble import assemble_surface
from meshlab_specsmooth.parameters import NOISE_BOUNDS_IN_EXTENTS, check_number
from meshlab_specsmooth.risk.estimate_error import SurfaceProbe, prepare_probe
from meshlab_specsmooth.runtime.progress import Progress
from meshlab_specsmooth.spectral.density import band_energies
from meshlab_specsmooth.version import VERSION

# Random perturbations for the rows, and for each strength of a sweep
_PROBES = 3
_SWEPT_PROBES = 1
# Meshes of more vertices are swept, and their spectra taken, on a part; those rows have one probe
_WHOLE = 60_000
_SAMPLE = 20_000
# Meshes of more run through each filter once: errors are estimated on the part, and what takes longest is not measured
_ONCE = 250_000
# Rings at the cut around the part, where filters do what they do at boundaries, whose errors do not count
_RINGS = 20
_SEED = 7
_BANDS = 40
_FEWEST_MODES = 30  # in a band, to measure a response by a random perturbation
# Two runs of a filter are the same if they differ by no more than this share of the noise (root mean square); what it
# chose is the same within this share
_SAME, _ALIKE = 1e-4, 0.02
# A vertex further from where it was than the bounding box is long did not come from smoothing
_ASTRAY = 1.0


def experiment(
    given: Surface,
    *,
    truth: Surface | None = None,
    added: float | None = None,
    seed: int = 1,
    filters: Iterable[str | Competitor] | None = None,
    name: str = "mesh",
    progress: Progress | None = None,
) -> Comparison:
    """Run and measure; see :func:`meshlab_specsmooth.compare`.

    Parameters
    ----------
    given : Surface
        The mesh; the truth itself where noise is to be added.
    truth : Surface, optional
        With the same faces, or another mesh of the same surface: then what needs corresponding vertices is left out.
    added : float, optional
        Standard deviation of white noise to add on every coordinate, in mean edges: ``given`` is then the truth.
    """
    start = time.perf_counter()
    wanted = competitors(filters)
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
    large, once = len(given.vertices) > _WHOLE, len(given.vertices) > _ONCE
    bench = _Bench.of(given, truth, 1 if large else _PROBES, once=once)
    small = bench.part(_patch(given, _SAMPLE)) if large else bench
    steps = _Steps(progress, wanted, bench, small)
    with Child(given.faces) as whole, Child(small.given.faces) as part, ThreadPoolExecutor(1) as pool:
        try:
            rows, curves = _run(wanted, bench, small, whole, whole if small is bench else part, pool, steps)
        except BaseException:
            whole.end()  # what is still running, or the pool would wait for it
            part.end()
            raise
    return Comparison(
        name,
        given,
        truth,
        added,
        seed,
        bench.ruler.edge,
        bench.risk.noise,
        _compared(rows),
        curves,
        None if small is bench else small.given,
        small.eigenvalues,
        len(small.perturbed) if once else len(bench.perturbed),
        once,
        _versions(),
        time.perf_counter() - start,
    )


@dataclass(frozen=True)
class _Estimated:
    """An estimated error, in mean edges; what belongs to its square, the risk, in squared mean edges.

    ``scatter`` is the standard error over the probes, NaN of one; ``by_level`` by how much a standard error of the
    noise level moves the risk, with its sign; ``risks`` the risk by each probe.
    """

    error: float
    scatter: float
    by_level: float
    risks: tuple[float, ...]

    @property
    def uncertainty(self) -> float:
        """By how much a standard error of the risk raises the error.

        That is of the noise level alone where one probe says nothing of its scatter.
        """
        return math.sqrt(self.error**2 + math.hypot(np.nan_to_num(self.scatter), self.by_level)) - self.error


@dataclass(frozen=True, eq=False)
class _Bench:
    """A mesh to measure filters on.

    Attributes
    ----------
    given, truth : Surface
        ``truth`` may be None, or have other faces.
    corresponds : bool
        Whether the truth has the same faces.
    ruler : Ruler
    risk : SurfaceProbe
    judged : SurfaceProbe
        The same of the vertices whose error counts.
    perturbed : list of (n, 3) float64
    L : Laplacian
        Of the vertices that have an edge.
    angles : (b + 1,) float64
        Of the bands.
    noise : float
        Left in the mesh as given, by the ruler.
    stretch : float
        The bounding box's diagonal of the whole mesh by that of this part.
    once : bool
        Whether filters run once, and on nothing perturbed; and what takes longest is not measured.
    """

    given: Surface
    truth: Surface | None
    corresponds: bool
    ruler: Ruler
    risk: SurfaceProbe
    judged: SurfaceProbe
    perturbed: list[Floats]
    L: Laplacian
    angles: Floats
    noise: float
    stretch: float = 1.0
    once: bool = False

    @staticmethod
    def of(
        given: Surface, truth: Surface | None, probes: int, level: Noise | None = None, once: bool = False
    ) -> _Bench:
        """The bench of a mesh, whose noise is measured where it is not known."""
        corresponds = (
            truth is not None
            and truth.vertices.shape == given.vertices.shape
            and np.array_equal(truth.faces, given.faces)
        )
        ops = assemble_surface(given)
        risk = prepare_probe(ops, noise=level, probes=probes)
        ruler = Ruler.of(truth if truth is not None and corresponds else given, given)
        return _Bench(
            given,
            truth,
            corresponds,
            ruler,
            risk,
            risk,
            risk.perturb() if risk.probe.draws.any() and not once else [],
            ops.L,
            np.linspace(0, np.pi, _BANDS + 1),
            ruler.noise_left(given),
            once=once,
        )

    def part(self, patch: npt.NDArray[np.int64]) -> _Bench:
        """The bench of some vertices and the faces between them."""
        given = _restricted(self.given, patch)
        truth = _restricted(self.truth, patch) if self.truth is not None and self.corresponds else None
        diagonals = [float(np.linalg.norm(np.ptp(s.vertices, axis=0))) for s in (self.given, given)]
        stretch = diagonals[0] / diagonals[1] if diagonals[1] > 0 else 1.0
        # what is noise was measured on the whole, and the unit of lengths is the whole's
        bench = _Bench.of(given, truth, _SWEPT_PROBES, self.risk.noise)
        ruler = replace(bench.ruler, edge=self.ruler.edge)
        judged = _inside(bench.risk, ~_at_the_cut(self.given, patch))
        return replace(bench, ruler=ruler, judged=judged, noise=ruler.noise_left(given), stretch=stretch)

    @property
    def has_estimates(self) -> bool:
        """Whether noise can be told from shape, without which no error can be estimated."""
        return self.risk.noise.kind != UNCLEAR

    @property
    def eigenvalues(self) -> Floats:
        """Middle of the bands."""
        return np.asarray(1 - np.cos((self.angles[1:] + self.angles[:-1]) / 2))

    def estimated(self, result: Floats, perturbed: Sequence[Floats | None]) -> _Estimated:
        """The error of a result, from what the same filter made of perturbed surfaces."""
        found, area = self.judged.estimate(result, perturbed), self.ruler.edge**2
        moved = float((self.judged.project(self.given.vertices, result) ** 2).mean())
        # the risk is what has moved and something in proportion to the squared level
        level, interval = found.noise.level, found.noise.high - found.noise.low
        by_level = 2 * (found.risk - moved) * interval / (4 * level) if level > 0 else 0.0
        return _Estimated(
            found.error / self.ruler.edge,
            found.standard_error / area,
            by_level / area,
            tuple(risk / area for risk in found.risks),
        )

    def quick(self, result: Surface) -> dict[str, float]:
        """What is measured at every strength."""
        ruler = self.ruler
        values = {
            "noise_removed": 100 * (1 - ruler.noise_left(result) / self.noise) if self.noise > 0 else 0.0,
            "feature_loss": ruler.feature_loss(result),
            "offset": ruler.offset(result),
            "displacement": ruler.displacement(result),
        }
        if is_closed(ruler.surface) and signed_volume(ruler.surface) != 0:
            values["volume"] = metrics.volume_change(result, ruler.surface)
        if self.corresponds and self.truth is not None:
            along = self.judged.project(self.truth.vertices, result.vertices)
            values["true_error"] = float(np.sqrt((along**2).mean())) / ruler.edge
            values["normal_error"] = metrics.normal_error(result, self.truth)
        return values

    def full(self, result: Surface) -> tuple[dict[str, float], dict[str, Floats]]:
        """All measures, and what surfaces are colored by."""
        ruler, values = self.ruler, self.quick(result)
        values |= {
            "area": 100 * (shape.area(result) / shape.area(self.given) - 1),
            "dihedral": shape.dihedral_deviation(result),
            "quality": shape.triangle_quality(result),
            "flips": metrics.flipped(result, ruler.surface),
        }
        if not self.once:
            values["intersections"] = 100 * float(self_intersecting_faces(result.vertices, result.faces).mean())
        rim = shape.boundary_length(self.given)
        if rim > 0:
            values["boundary"] = 100 * (shape.boundary_length(result) / rim - 1)
        colors = {
            "displacement": np.linalg.norm(result.vertices - self.given.vertices, axis=1) / ruler.edge,
            "curvature": shape.mean_curvature(ruler, result),
        }
        if self.truth is not None and self.corresponds:
            values["vertex_error"] = metrics.vertex_error(result, self.truth)
        if self.truth is not None and self.once and self.corresponds:
            along = ((result.vertices - self.truth.vertices) * ruler.normals).sum(axis=1)
            colors["error"] = np.abs(along) / ruler.edge
        elif self.truth is not None:
            far = distances(result.vertices, self.truth)
            values["surface_error"] = metrics.root_mean_square(far, result) / ruler.edge
            colors["error"] = far / ruler.edge
            if not self.once:
                values["hausdorff"] = hausdorff(result, self.truth) / ruler.edge
        return values, colors

    def power(self, vertices: Floats) -> Floats:
        """(b,) energy of the differential coordinates in each band, in squared mean edges."""
        X = vertices[self.risk.ops.active] / self.ruler.edge
        return np.maximum(band_energies(self.L, self.L @ (X - X.mean(axis=0)), self.angles), 0.0)

    def response(self, result: Floats, perturbed: Sequence[Floats | None]) -> Floats | None:
        """(b,) the transfer function: how much of a small perturbation along the normals comes through, by band.

        By polarisation: with g what was put in and r what came out, <g, r> / <g, g> in each band; NaN where there are
        too few modes to tell.
        """
        pairs = [(X, Y) for X, Y in zip(self.perturbed, perturbed, strict=False) if Y is not None]
        if not pairs:
            return None
        put = self.risk.project(self.given.vertices, pairs[0][0])[:, None]
        out = self.risk.project(result, pairs[0][1])[:, None]
        scale = float(np.abs(put).max())
        put, out = put / scale, out / scale
        plus, minus, whole = (band_energies(self.L, X, self.angles) for X in (put + out, put - out, put))
        # the energy of a random perturbation is that of the modes in a band
        seen = whole * len(put) >= _FEWEST_MODES * whole.sum()
        return np.where(seen, (plus - minus) / (4 * np.where(seen, whole, 1.0)), np.nan)


def _run(
    wanted: Sequence[Competitor],
    bench: _Bench,
    small: _Bench,
    whole: Child,
    part: Child,
    pool: ThreadPoolExecutor,
    steps: _Steps,
) -> tuple[list[tuple[Row, _Estimated | None]], tuple[Curve, ...]]:
    """Rows with estimates, and curves: defaults first, on a machine that does nothing else, for the time's sake."""
    V = bench.given.vertices
    first = [_tried(whole, each, V, steps) for each in wanted]
    # from here on the filters run in their process while what they made is measured in this one
    pending = []
    for each, ran in zip(wanted, first, strict=True):
        repeated = None if bench.once else pool.submit(_repeated, whole, each, ran, bench, _PROBES, steps)
        sampled = None if small is bench else pool.submit(_sampled, part, each, ran, small, steps)
        pending.append((repeated, sampled))
    sweeps = [pool.submit(_swept, part, each, small, steps) for each in wanted]
    judge = small if bench.once else bench
    given = judge.estimated(judge.given.vertices, judge.perturbed) if bench.has_estimates else None
    untouched = replace(_row(None, bench, Ran(V, {}, math.nan), given), power=small.power(small.given.vertices))
    rows: list[tuple[Row, _Estimated | None]] = [(untouched, given)]
    for each, ran, (repeated, sampled) in zip(wanted, first, pending, strict=True):
        again = [] if repeated is None else repeated.result()
        seen = None if sampled is None else sampled.result()
        failure = next((x for x in (ran, again, seen) if isinstance(x, str)), None)
        if isinstance(ran, str) or isinstance(again, str) or isinstance(seen, str):
            rows.append((Row(each, None, str(failure)), None))
        else:
            vertices, perturbed = (ran.vertices, again) if seen is None else (seen[0], seen[1:])
            estimated = None
            if bench.has_estimates:
                estimated = small.estimated(vertices, perturbed) if bench.once else bench.estimated(ran.vertices, again)
            row = _row(each, bench, ran, estimated)
            rows.append(
                (replace(row, power=small.power(vertices), response=small.response(vertices, perturbed)), estimated)
            )
        steps.done(1)
    curves = []
    for sweep in sweeps:
        curves.append(sweep.result())
        steps.done(1)
    return rows, tuple(curve for curve in curves if curve is not None)


def _tried(child: Child, competitor: Competitor, vertices: Floats, steps: _Steps) -> Ran | str:
    """A run, or why it failed."""
    try:
        ran = child.run(vertices, competitor.filter, competitor.parameters, competitor.times)
        far = np.linalg.norm(ran.vertices - vertices, axis=1).max() / np.linalg.norm(np.ptp(vertices, axis=0))
        return f"diverged: a vertex went {far:.2g} diagonals of the bounding box away" if far > _ASTRAY else ran
    except FilterFailed as error:
        return str(error)
    finally:
        steps.done(1)


def _held(competitor: Competitor, ran: Ran) -> Competitor:
    """The filter with what it chose by itself given as parameters, as far as it has those."""
    if not competitor.holds:
        return competitor
    name = competitor.held_by or competitor.filter
    own = {parameter.name for parameter in load(name).parameters}
    held = {each: ran.output[each] for each in competitor.holds if each in own and ran.output.get(each)}
    if competitor.held_by and len(held) < len(competitor.holds):
        return competitor  # that filter would choose the rest, and not as this one does
    held |= {each: value for each, value in competitor.parameters.items() if each in own}
    return competitor if held == competitor.parameters else replace(competitor, filter=name, parameters=held)


def _on_part(competitor: Competitor, bench: _Bench) -> Competitor:
    """The filter with shares of the whole mesh's diagonal, on a part of it."""
    stretched = {
        k: Length(v.fraction * bench.stretch) if isinstance(v, Length) else v for k, v in competitor.parameters.items()
    }
    return replace(competitor, parameters=stretched)


def _repeated(
    child: Child, competitor: Competitor, ran: Ran | str, bench: _Bench, probes: int, steps: _Steps
) -> list[Floats | None] | str:
    """The runs on perturbed surfaces, at the setting of the run on the surface as given; None where it is not."""
    if isinstance(ran, str):
        return ran
    held = _held(competitor, ran)
    if held is not competitor:
        again = _tried(child, held, bench.given.vertices, steps)
        # not all that a filter chooses need be a parameter of its
        off = np.inf if isinstance(again, str) else float(np.sqrt(((again.vertices - ran.vertices) ** 2).mean()))
        if off > _SAME * bench.risk.noise.level:
            held = competitor
    runs = []
    for X in bench.perturbed[:probes]:
        again = _tried(child, held, X, steps)
        if isinstance(again, str):
            return again
        runs.append(again)
    agree = [held is not competitor or _agree(competitor, ran, again) for again in runs]
    return [again.vertices if same or not any(agree) else None for again, same in zip(runs, agree, strict=True)]


def _agree(competitor: Competitor, a: Ran, b: Ran) -> bool:
    """Whether a filter chose the same in both runs; numbers may differ as the meshes do."""
    for name in competitor.holds:
        x, y = a.output.get(name), b.output.get(name)
        alike = isinstance(x, float) and isinstance(y, float) and abs(x - y) <= _ALIKE * abs(x)
        if x != y and not alike:
            return False
    return True


def _sampled(child: Child, competitor: Competitor, ran: Ran | str, small: _Bench, steps: _Steps) -> list[Floats] | str:
    """The runs on a part of the mesh, and on the part perturbed."""
    if isinstance(ran, str):
        return ran
    results = []
    for X in (small.given.vertices, *small.perturbed):
        again = _tried(child, _on_part(_held(competitor, ran), small), X, steps)
        if isinstance(again, str):
            return again
        results.append(again.vertices)
    return results


def _swept(child: Child, competitor: Competitor, bench: _Bench, steps: _Steps) -> Curve | None:
    """A filter over its strengths."""
    if competitor.strength is None:
        return None
    points = []
    for value in competitor.strength.values:
        each = competitor.at(value, len(bench.given.vertices))
        on_part = _on_part(each, bench)
        ran = _tried(child, on_part, bench.given.vertices, steps)
        if isinstance(ran, str):
            continue
        values, uncertainty = bench.quick(Surface(ran.vertices, bench.given.faces)), math.nan
        again = _repeated(child, on_part, ran, bench, _SWEPT_PROBES, steps)
        if bench.has_estimates and not isinstance(again, str):
            estimated = bench.estimated(ran.vertices, again)
            values, uncertainty = {"estimated_error": estimated.error, **values}, estimated.uncertainty
        values = {**values, "seconds": ran.seconds}
        points.append(Point(f"ms.{each.call}", value, values, uncertainty))
    return Curve(competitor, tuple(points))


def _row(competitor: Competitor | None, bench: _Bench, ran: Ran, estimated: _Estimated | None) -> Row:
    surface = Surface(ran.vertices, bench.given.faces)
    values, colors = bench.full(surface)
    uncertainty = math.nan
    if estimated is not None:
        values["estimated_error"], uncertainty = estimated.error, estimated.uncertainty
    if math.isfinite(ran.seconds):
        values["seconds"] = ran.seconds
    chosen = {} if competitor is None else {name: ran.output[name] for name in competitor.holds if name in ran.output}
    digest = hashlib.sha256(np.ascontiguousarray(ran.vertices).tobytes()).hexdigest()
    return Row(competitor, surface, "", values, uncertainty, chosen=chosen, colors=colors, hash=digest)


def _compared(rows: Sequence[tuple[Row, _Estimated | None]]) -> tuple[Row, ...]:
    """The rows, with how far each is behind the best: by the same probes, so that most of their scatter cancels."""
    best = min((found for _, found in rows if found is not None), key=lambda found: found.error, default=None)
    return tuple(row if found is None or best is None else _behind(row, found, best) for row, found in rows)


def _behind(row: Row, found: _Estimated, best: _Estimated) -> Row:
    apart = np.subtract(found.risks, best.risks)
    apart = apart[np.isfinite(apart)]
    scatter = float(apart.std(ddof=1) / np.sqrt(len(apart))) if len(apart) > 1 else 0.0
    # a wrong noise level puts both off, and alike as far as they remove alike
    spread = math.hypot(scatter, found.by_level - best.by_level)
    return replace(
        row,
        behind=found.error - best.error,
        behind_uncertainty=spread / max(found.error + best.error, 1e-12),
    )


def _restricted(surface: Surface, patch: npt.NDArray[np.int64]) -> Surface:
    """Some vertices, and the faces between them."""
    number = np.full(len(surface.vertices), -1)
    number[patch] = np.arange(len(patch))
    faces = number[surface.faces]
    return Surface(surface.vertices[patch], faces[(faces >= 0).all(axis=1)])


def _at_the_cut(surface: Surface, patch: npt.NDArray[np.int64]) -> Booleans:
    """(k,) whether each vertex of a patch lies within some rings of where it was cut out."""
    held = np.zeros(len(surface.vertices), dtype=np.bool_)
    held[patch] = True
    near = ~held
    for _ in range(_RINGS):
        near[surface.faces[near[surface.faces].any(axis=1)]] = True
    return np.asarray(near[patch])


def _inside(risk: SurfaceProbe, counts: Booleans) -> SurfaceProbe:
    """The estimate for some vertices, or for all where none is left."""
    kept = counts[risk.ops.active]
    return replace(risk, probe=replace(risk.probe, counted=kept)) if kept.any() else risk


def _patch(surface: Surface, size: int) -> npt.NDArray[np.int64]:
    """Some vertices in one piece, as far as components are large enough; sorted."""
    n, F = len(surface.vertices), surface.faces
    graph = csr_array(coo_array((np.ones(3 * len(F)), (F.ravel(), F[:, [1, 2, 0]].ravel())), shape=(n, n)))
    rng, found = np.random.default_rng(_SEED), np.zeros(n, dtype=np.bool_)
    for _ in range(100):
        reached = breadth_first_order(graph, int(F[rng.integers(len(F)), 0]), directed=False, return_predecessors=False)
        found[reached[: size - int(found.sum())]] = True
        if found.sum() >= size:
            break
    return np.flatnonzero(found).astype(np.int64)


class _Steps:
    """Progress by finished pieces of work, each of which counts as much."""

    def __init__(self, progress: Progress | None, wanted: Sequence[Competitor], bench: _Bench, small: _Bench) -> None:
        swept = sum(len(each.strength.values) for each in wanted if each.strength is not None)
        self._total = len(wanted) * (3 + len(bench.perturbed)) + swept * (1 + min(len(small.perturbed), _SWEPT_PROBES))
        self._progress = progress
        self._done = 0

    def done(self, pieces: int) -> None:
        """So many more."""
        self._done += pieces
        if self._progress is not None:
            self._progress(min(self._done / self._total, 1.0))


def _versions() -> Mapping[str, str]:
    """Of all that has a part in it."""
    found = {"meshlab-specsmooth": VERSION, "Python": platform.python_version(), "platform": platform.platform()}
    return found | {package: _version_of(package) for package in ("pymeshlab", "numpy", "scipy", "numba")}


def _version_of(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return "not installed"

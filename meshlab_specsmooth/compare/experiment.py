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

from meshlab_specsmooth.bridge.child import Child, Ran
from meshlab_specsmooth.bridge.measures import crossing_faces, hausdorff
from meshlab_specsmooth.compare import metrics, noise, shape
from meshlab_specsmooth.compare.comparison import Comparison, Curve, Point, Row
from meshlab_specsmooth.compare.competitors import Competitor, competitors
from meshlab_specsmooth.compare.distances import distances
from meshlab_specsmooth.compare.shape import Ruler
from meshlab_specsmooth.descriptors import Length, load
from meshlab_specsmooth.errors import FilterFailed, InvalidParameter, InvalidSurface
from meshlab_specsmooth.estimation import PreparedError, prepare_error
from meshlab_specsmooth.graph.laplacian import Laplacian
from meshlab_specsmooth.noise import Noise
from meshlab_specsmooth.smoothing import assemble
from meshlab_specsmooth.spectral.density import band_energies
from meshlab_specsmooth.spectral.progress import Progress
from meshlab_specsmooth.surface import Floats, Surface, is_closed, mean_edge_length
from meshlab_specsmooth.version import VERSION

# Random perturbations for the rows, and for each strength of a sweep
_PROBES = 3
_SWEPT_PROBES = 1
# Meshes of more vertices are swept, and their spectra taken, on a part; those rows have one probe
_WHOLE = 60_000
_SAMPLE = 20_000
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
        if not 0 <= added < math.inf:
            raise InvalidParameter(f"noise is {added}; it must be finite and not negative, in mean edges")
        truth, given = given, Surface(noise.gaussian(given, added, seed), given.faces)
    if mean_edge_length(given) == 0:
        raise InvalidSurface("faces", "have no edge of any length", "give a surface")
    large = len(given.vertices) > _WHOLE
    bench = _Bench.of(given, truth, 1 if large else _PROBES)
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
        _compared(rows, bench),
        curves,
        None if small is bench else small.given,
        small.eigenvalues,
        len(bench.perturbed),
        _versions(),
        time.perf_counter() - start,
    )


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
    risk : PreparedError
    perturbed : list of (n, 3) float64
    L : Laplacian
        Of the vertices that have an edge.
    angles : (b + 1,) float64
        Of the bands.
    noise : float
        Left in the mesh as given, by the ruler.
    stretch : float
        The bounding box's diagonal of the whole mesh by that of this part.
    """

    given: Surface
    truth: Surface | None
    corresponds: bool
    ruler: Ruler
    risk: PreparedError
    perturbed: list[Floats]
    L: Laplacian
    angles: Floats
    noise: float
    stretch: float = 1.0

    @staticmethod
    def of(given: Surface, truth: Surface | None, probes: int, level: Noise | None = None) -> _Bench:
        """The bench of a mesh, whose noise is measured where it is not known."""
        corresponds = (
            truth is not None
            and truth.vertices.shape == given.vertices.shape
            and np.array_equal(truth.faces, given.faces)
        )
        risk = prepare_error(given.vertices, given.faces, noise=level, probes=probes)
        ruler = Ruler.of(truth if truth is not None and corresponds else given, given)
        return _Bench(
            given,
            truth,
            corresponds,
            ruler,
            risk,
            risk.perturbed() if risk.draws.any() else [],
            assemble(given.vertices, given.faces, "uniform").L,
            np.linspace(0, np.pi, _BANDS + 1),
            ruler.noise_left(given),
        )

    def part(self, patch: npt.NDArray[np.int64]) -> _Bench:
        """The bench of some vertices and the faces between them."""
        given = _restricted(self.given, patch)
        truth = _restricted(self.truth, patch) if self.truth is not None and self.corresponds else None
        diagonals = [float(np.linalg.norm(np.ptp(s.vertices, axis=0))) for s in (self.given, given)]
        stretch = diagonals[0] / diagonals[1] if diagonals[1] > 0 else 1.0
        # what is noise was measured on the whole
        return replace(_Bench.of(given, truth, _SWEPT_PROBES, self.risk.noise), stretch=stretch)

    @property
    def eigenvalues(self) -> Floats:
        """Middle of the bands."""
        return np.asarray(1 - np.cos((self.angles[1:] + self.angles[:-1]) / 2))

    def estimated(self, result: Floats, perturbed: Sequence[Floats | None]) -> tuple[float, float, tuple[float, ...]]:
        """Estimated error and its standard error in mean edges, and the risks by probe in squared mean edges."""
        found = self.risk.estimate(result, perturbed)
        error, edge = found.error / self.ruler.edge, self.ruler.edge
        spread = found.standard_error / edge**2 / (2 * error) if error > 0 else math.nan
        return error, spread, tuple(risk / edge**2 for risk in found.risks)

    def quick(self, result: Surface) -> dict[str, float]:
        """What is measured at every strength."""
        ruler = self.ruler
        values = {
            "noise_removed": 100 * (1 - ruler.noise_left(result) / self.noise) if self.noise > 0 else 0.0,
            "feature_loss": ruler.feature_loss(result),
            "offset": ruler.offset(result),
            "displacement": ruler.displacement(result),
        }
        if is_closed(ruler.surface):
            values["volume"] = metrics.volume_change(result, ruler.surface)
        if self.corresponds and self.truth is not None:
            along = self.risk.along_normals(self.truth.vertices, result.vertices)
            values["true_error"] = float(np.sqrt((along**2).mean())) / ruler.edge
            values["normal_error"] = metrics.normal_error(result, self.truth)
        return values

    def full(self, result: Surface) -> tuple[dict[str, float], dict[str, Floats]]:
        """All measures, and what surfaces are coloured by."""
        ruler, values = self.ruler, self.quick(result)
        values |= {
            "area": 100 * (shape.area(result) / shape.area(self.given) - 1),
            "dihedral": shape.dihedral_deviation(result),
            "quality": shape.triangle_quality(result),
            "flips": metrics.flipped(result, ruler.surface),
            "intersections": 100 * float(crossing_faces(result.vertices, result.faces).mean()),
        }
        rim = shape.boundary_length(self.given)
        if rim > 0:
            values["boundary"] = 100 * (shape.boundary_length(result) / rim - 1)
        colours = {
            "displacement": np.linalg.norm(result.vertices - self.given.vertices, axis=1) / ruler.edge,
            "curvature": shape.mean_curvature(ruler, result),
        }
        if self.truth is not None:
            far = distances(result.vertices, self.truth)
            values["surface_error"] = metrics.root_mean_square(far, result) / ruler.edge
            values["hausdorff"] = hausdorff(result, self.truth) / ruler.edge
            colours["error"] = far / ruler.edge
            if self.corresponds:
                values["vertex_error"] = metrics.vertex_error(result, self.truth)
        return values, colours

    def power(self, vertices: Floats) -> Floats:
        """(b,) energy of the differential coordinates in each band, in squared mean edges."""
        X = vertices[self.risk.moving] / self.ruler.edge
        return np.maximum(band_energies(self.L, self.L @ (X - X.mean(axis=0)), self.angles), 0.0)

    def response(self, result: Floats, perturbed: Sequence[Floats | None]) -> Floats | None:
        """(b,) the transfer function: how much of a small perturbation along the normals comes through, by band.

        By polarisation: with g what was put in and r what came out, <g, r> / <g, g> in each band; NaN where there are
        too few modes to tell.
        """
        pairs = [(X, Y) for X, Y in zip(self.perturbed, perturbed, strict=False) if Y is not None]
        if not pairs:
            return None
        put = self.risk.along_normals(self.given.vertices, pairs[0][0])[:, None]
        out = self.risk.along_normals(result, pairs[0][1])[:, None]
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
) -> tuple[list[tuple[Row, tuple[float, ...]]], tuple[Curve, ...]]:
    """Rows with their risks, and curves: defaults first, on a machine that does nothing else, for the time's sake."""
    V = bench.given.vertices
    first = [_tried(whole, each, V, steps) for each in wanted]
    # from here on the filters run in their process while what they made is measured in this one
    pending = []
    for each, ran in zip(wanted, first, strict=True):
        repeated = pool.submit(_repeated, whole, each, ran, bench, steps)
        sampled = None if small is bench else pool.submit(_sampled, part, each, ran, small, steps)
        pending.append((repeated, sampled))
    sweeps = [pool.submit(_swept, part, each, small, steps) for each in wanted]
    rows = [_row(None, bench, Ran(V, {}, math.nan), bench.perturbed)]
    rows[0] = (replace(rows[0][0], power=small.power(small.given.vertices)), rows[0][1])
    for each, ran, (repeated, sampled) in zip(wanted, first, pending, strict=True):
        again = repeated.result()
        seen = None if sampled is None else sampled.result()
        failure = next((x for x in (ran, again, seen) if isinstance(x, str)), None)
        if isinstance(ran, str) or isinstance(again, str) or isinstance(seen, str):
            rows.append((Row(each, None, str(failure)), ()))
        else:
            row, risks = _row(each, bench, ran, again)
            vertices, perturbed = (ran.vertices, again) if seen is None else (seen[0], seen[1:])
            rows.append(
                (replace(row, power=small.power(vertices), response=small.response(vertices, perturbed)), risks)
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
    own = {parameter.name for parameter in load(competitor.filter).parameters}
    held = {name: ran.output[name] for name in competitor.holds if name in own and ran.output.get(name)}
    return replace(competitor, parameters={**held, **competitor.parameters})


def _on_part(competitor: Competitor, bench: _Bench) -> Competitor:
    """The filter with shares of the whole mesh's diagonal, on a part of it."""
    stretched = {
        k: Length(v.share * bench.stretch) if isinstance(v, Length) else v for k, v in competitor.parameters.items()
    }
    return replace(competitor, parameters=stretched)


def _repeated(
    child: Child, competitor: Competitor, ran: Ran | str, bench: _Bench, steps: _Steps
) -> list[Floats | None] | str:
    """The runs on the perturbed surfaces, at the setting of the run on the surface as given; None where it is not."""
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
    for X in bench.perturbed:
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
        values = bench.quick(Surface(ran.vertices, bench.given.faces))
        again = [_tried(child, on_part, X, steps) for X in bench.perturbed[:_SWEPT_PROBES]]
        if all(isinstance(run, Ran) and _agree(competitor, ran, run) for run in again):
            error, _, _ = bench.estimated(ran.vertices, [run.vertices for run in again if isinstance(run, Ran)])
            values = {"estimated_error": error, **values}
        points.append(Point(f"ms.{each.call}", value, values))
    return Curve(competitor, tuple(points))


def _row(
    competitor: Competitor | None, bench: _Bench, ran: Ran, perturbed: Sequence[Floats | None]
) -> tuple[Row, tuple[float, ...]]:
    surface = Surface(ran.vertices, bench.given.faces)
    values, colours = bench.full(surface)
    error, spread, risks = bench.estimated(ran.vertices, perturbed)
    values |= {"estimated_error": error}
    if math.isfinite(ran.seconds):
        values["seconds"] = ran.seconds
    chosen = {} if competitor is None else {name: ran.output[name] for name in competitor.holds if name in ran.output}
    digest = hashlib.sha256(np.ascontiguousarray(ran.vertices).tobytes()).hexdigest()
    return Row(competitor, surface, "", values, spread, chosen=chosen, colours=colours, hash=digest), risks


def _compared(rows: Sequence[tuple[Row, tuple[float, ...]]], bench: _Bench) -> tuple[Row, ...]:
    """The rows, with how far each is behind the best: by the same probes, so that most of their scatter cancels."""
    best, risks = min(rows, key=lambda pair: pair[0].values.get("estimated_error", math.inf))
    compared = []
    for row, own in rows:
        if own:
            error, least = row.values["estimated_error"], best.values["estimated_error"]
            apart = np.subtract(own, risks)
            apart = apart[np.isfinite(apart)]
            spread = float(apart.std(ddof=1) / np.sqrt(len(apart))) if len(apart) > 1 else math.nan
            row = replace(row, behind=error - least, behind_uncertainty=spread / max(error + least, 1e-12))
        compared.append(row)
    return tuple(compared)


def _restricted(surface: Surface, patch: npt.NDArray[np.int64]) -> Surface:
    """Some vertices, and the faces between them."""
    number = np.full(len(surface.vertices), -1)
    number[patch] = np.arange(len(patch))
    faces = number[surface.faces]
    return Surface(surface.vertices[patch], faces[(faces >= 0).all(axis=1)])


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

"""The paper's three steps, for arrays: differential coordinates, their low-pass, reconstruction."""

from __future__ import annotations

import functools
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, TypeVar, cast

import numpy as np
import numpy.typing as npt

from meshlab_specsmooth.adapters import Mesh, Source, WithMesh, accept_meshes, recognize
from meshlab_specsmooth.arrays import Booleans, Floats, Integers
from meshlab_specsmooth.choices import AnyResponse, Boundary, Criterion, LaplacianKind, Method, ModeCount, Response
from meshlab_specsmooth.describe import Described, Pictured, Rows, count_of, format_length
from meshlab_specsmooth.errors import InvalidParameter
from meshlab_specsmooth.geometry import order
from meshlab_specsmooth.geometry.surface import Surface
from meshlab_specsmooth.geometry.triangles import describe_lost, find_lost_vertices
from meshlab_specsmooth.geometry.welding import find_copies
from meshlab_specsmooth.graph.build import mesh_graph
from meshlab_specsmooth.graph.laplacian import Laplacian
from meshlab_specsmooth.noise.estimate import (
    CORRELATED,
    IMPULSE,
    MOST_WEIGHT,
    UNCLEAR,
    Noise,
    normals,
    nothing,
)
from meshlab_specsmooth.noise.outliers import describe_outliers, replace_outliers
from meshlab_specsmooth.noise.parts import (
    Part,
    describe_left_alone,
    describe_levels,
    label_components,
    split,
)
from meshlab_specsmooth.noise.shape_change import Change as ShapeChange
from meshlab_specsmooth.noise.shape_change import compare_shapes
from meshlab_specsmooth.operators.boundary import (
    ALL_KEPT,
    BOUNDARIES,
    NO_FEATURES,
    NOTHING_SELECTED,
    Rim,
    blend,
    rim,
)
from meshlab_specsmooth.operators.laplacians import (
    LAPLACIANS,
    Gram,
    gram_of_barycenters,
    laplacian_of_kind,
)
from meshlab_specsmooth.operators.reconstruction import Constraints, Solution, error_gain, solve
from meshlab_specsmooth.parameters import (
    GAIN_BOUNDS,
    MAX_ITERATIONS,
    check_barycenter_weight,
    check_choice,
    check_count,
    check_flag,
    check_length,
    check_number,
    check_progress,
    check_weights,
    show,
)
from meshlab_specsmooth.risk.choose_weight import (
    CRITERIA,
    Choice,
    across_the_rim,
    choose,
    drifts,
    robust,
    without_drift,
)
from meshlab_specsmooth.runtime import blocks
from meshlab_specsmooth.runtime.bars import begin
from meshlab_specsmooth.runtime.memory import require
from meshlab_specsmooth.runtime.progress import Progress, announce, finish, monotone, subrange
from meshlab_specsmooth.runtime.workspace import Workspace
from meshlab_specsmooth.sentences import describe_strays, describe_unmoved, moved_rows
from meshlab_specsmooth.spectral import SpectralFilter, density, eigenbasis
from meshlab_specsmooth.spectral.chebyshev import ErrorGain
from meshlab_specsmooth.spectral.cutoff import wavelength_in_edges
from meshlab_specsmooth.spectral.density import Density
from meshlab_specsmooth.spectral.design import Design, design, design_band, is_exact
from meshlab_specsmooth.spectral.response import RESPONSES, family_of

# The default cut-off: waves of 20 edges are shape on any mesh that resolves its shape at all, waves of a few edges are
# where noise is.
DEFAULT_WAVELENGTH_IN_EDGES = 20.0

# What a call takes of memory at its peak, beyond the arrays that it is given, with room to spare: scripts/
# benchmark_speed.py measured 387 to 411 with the compiled kernels. (Those of scipy, not measured, hold a matrix
# besides, with some 72 bytes a vertex.) A copy of the input is in it.
BYTES_PER_VERTEX = 600

# Of 2, of the largest displacement in mesh units: with it, coordinates stay in the range of numbers
_LARGEST_EXPONENT = 1022

# So many arrays of the vertices' size are all that a run needs at once
_KEPT = 6

# A cut-off that keeps this share of all modes has nothing to work on
_NEARLY_ALL = 0.9

# A result out of proportion to the noise is tried again with a weight so many times as high, so often, before the input
# is handed back
_FIRMER, _RETRIES = 3.0, 2

# A given weight that changes the volume or the size by more than this is warned of
_WORTH_A_WARNING = 0.02

# Share of the time of a call that goes into what does not depend on the parameters
_ASSEMBLY = 0.25

# Share of what remains that the choice of a weight takes
_CHOICE = 0.6

# How far the polynomial may put the displacement of any mode off, relative to the mode's differential coordinates,
# which are of the displacement's size; and that of a plain low-pass, relative to positions, which are up to a thousand
# times larger, so that three digits more are needed.
DISPLACEMENT_TOLERANCE = 2.5e-3
POSITION_TOLERANCE = 1e-7

# Defaults; those of the filters, in filters_xml/, are the same
_RESPONSE: AnyResponse = "auto"
_ITERATIONS = 1
_LAPLACIAN: LaplacianKind = "uniform"
_METHOD: Method = "auto"
_MODE_COUNT: ModeCount = "estimate"
_BOUNDARY: Boundary = "auto"
_CRITERION: Criterion = "position"
_WELD = True
_FEATURE_GAIN = 1.0
_LOW_PASS_RESPONSE: Response = "ideal"  # noqa: S105 (no password)
_ENHANCING_RESPONSE: Response = "butterworth"
_ENHANCING_WEIGHT = 0.1
_GAIN = 2.0

# Responses that an automatic choice has: one whose polynomial is short whatever the weight, and the paper's
_CHOSEN_FROM: tuple[Response, ...] = ("heat", "ideal")

# The band that enhancement amplifies without further notice: longer waves are the shape, shorter ones the noise
LONGEST_ENHANCED_IN_EDGES = 30.0
SHORTEST_ENHANCED_IN_EDGES = 6.0

# Waves shorter or longer than these are no different from them, and powers of them would overflow
_DIFFERENT_IN_EDGES = (1e-30, 1e30)

# From differential coordinates to what is to be added to them, with work arrays; the operator is the surface's
# or its boundary's
Change = Callable[[Laplacian, SpectralFilter, Floats, Progress | None, Workspace], Floats]


@dataclass(frozen=True, eq=False, repr=False)
class SmoothingResult(WithMesh, Described):
    """The smoothed surface, and the evidence.

    Attributes
    ----------
    vertices : (n, 3) float64
        New positions, in mesh units; vertices without an edge are where they were, to the bit.
    cutoff : float
        Eigenvalue of the Laplacian that the response is cut off at, in (0, 2].
    modes : float
        Number of modes below the cut-off: as asked for, or from the wavelength, by the law of the regular lattice.
    modes_error : float
        Standard error of that number relative to it; 0 where the eigenvalues were computed, NaN for the lattice's law.
    wavelength : float
        Length of the surface wave at the cut-off, in mesh units.
    mean_edge : float
        Mean edge length of the input, in mesh units.
    response, laplacian, method : str
        As used; ``method`` is never ``"auto"``.
    barycenter_weight : float
        0 for the plain low-pass, which is the limit.
    iterations : int
    degree : int
        Sweeps over the mesh a pass: the degree of the Chebyshev series; 0 for the exact method.
    response_error : float
        Bound on what the polynomial puts any mode's displacement off by, relative to its differential coordinates (on a
        regular mesh), or its coordinates for a plain low-pass; 0 for the exact method. An ideal response is softened
        within 25 % of the cut-off, and modes there are not counted.
    cg_iterations : tuple of int
        Of the conjugate gradients, each pass.
    residual : float
        Largest relative residual of the least squares' normal equations.
    displacement : float
        Root mean square distance between input and result, in mesh units.
    kernels : str
        What swept over the mesh: ``"numba"`` where the extra ``fast`` is installed, else ``"scipy"``.
    seconds : float
        Wall time of the call; of a method of :class:`Prepared`, without preparation.
    noise : Noise or None
        What was measured of the input where the weight was chosen; None where it was given.
    estimated_error : float or None
        Expected root mean square error along the normals, in mesh units, where the weight was chosen. What is below
        ``noise.resolution`` is not distinguishable from none; 0 where the estimate came out below zero.
    warning : str or None
        What the choice of a weight could not take into account, what was left alone for that, or that the cut-off
        leaves next to nothing to smooth.
    welded : int
        Vertices that lie where another one does, and moved with it.
    outliers : (k,) int64
        Single stray vertices that were put where their neighbors expect them, where the weight was chosen.
    source : Source or None
        The mesh that was given, for ``mesh``.
    given : Surface or None
        The input, for a notebook's picture of before and after.
    """

    vertices: Floats
    cutoff: float
    modes: float
    modes_error: float
    wavelength: float
    mean_edge: float
    response: str
    laplacian: str
    method: str
    barycenter_weight: float
    iterations: int
    degree: int
    response_error: float
    cg_iterations: tuple[int, ...]
    residual: float
    displacement: float
    kernels: str
    seconds: float
    noise: Noise | None = None
    estimated_error: float | None = None
    warning: str | None = None
    welded: int = 0
    outliers: npt.NDArray[np.int64] = field(default_factory=lambda: np.empty(0, dtype=np.int64))
    source: Source | None = field(default=None, repr=False)
    given: Surface | None = None

    @property
    def summary(self) -> str:
        """What was done, and why, in a sentence."""
        if self.displacement == 0:
            return describe_unmoved(self.noise, self.warning)
        weight = f"isotropic, barycenter weight {self.barycenter_weight:.3g}"
        if self.noise is None or self.estimated_error is None:
            filter_ = weight if self.barycenter_weight else "low-pass of the coordinates"
            return f"{filter_} as given; moved by {format_length(self.displacement, self.mean_edge)}"
        if self.noise.is_left_alone:
            return describe_strays(self.noise, len(self.outliers))
        error = self.noise.format_error(self.estimated_error)
        return f"{weight} by estimated error {error} edges; {self.noise.summary}"

    def rows(self) -> Rows:
        """What was found and done, and how far vertices moved."""
        edge, rows = self.mean_edge, []
        if self.noise is not None and self.estimated_error is not None:
            rows.append(("noise", self.noise.describe_level()))
            if not self.noise.is_left_alone:
                rows.append(("estimated error", self.noise.describe_error(self.estimated_error)))
        kept = f"{format_length(self.wavelength, edge)}, {count_of(round(self.modes), 'mode')}"
        rows += [("response", f"{self.response}, keeps waves longer than {kept}")]
        strays, seconds = len(self.outliers), self.seconds
        return [*rows, *moved_rows(self.displacement, edge, strays, self.welded, seconds, self.warning)]

    def pictured(self) -> Pictured | None:
        """Before and after."""
        return None if self.given is None else (self.given.vertices, self.vertices, self.given.faces)


_Smoother = TypeVar("_Smoother", bound=Callable[..., SmoothingResult])


def _of_its_source(method: _Smoother) -> _Smoother:
    """Give results of a method of :class:`Prepared` the mesh that it was made of."""

    @functools.wraps(method)
    def call(self: Prepared, /, *args: Any, **kwargs: Any) -> SmoothingResult:
        result = method(self, *args, **kwargs)
        return result if self.source is None else replace(result, source=self.source)

    return cast(_Smoother, call)


@dataclass(frozen=True, eq=False)
class Prepared:
    """What does not depend on the parameters, held for many runs; made by :func:`prepare`.

    Attributes
    ----------
    surface : Surface
        As given.
    moving : (k,) int32
        The vertices that have an edge, in an order that keeps neighbors near each other; the others stay. All
        operators act on these.
    place : (n,) int32 or None
        Where each vertex is among these, -1 for those that stay; None where all move, in the order given. Vertices at
        one place are one of these.
    positions : (k, 3) float64
        Their positions, centered, times 2^-exponent, so that they lie in [-1, 1].
    exponent : int
    mean_edge : float
        Of ``positions``.
    faces : (m, 3) int32
        Those that have an edge, by the numbers of the moving vertices.
    L : Laplacian
    gram : Gram
        C^T C of the face barycenters.
    rim : Rim or None
        The boundary curve; None of a closed surface.
    kind : str
        ``"uniform"`` or ``"cotangent"``.
    modes : Density or None
        Where the modes lie, so that a number of modes costs nothing; None where that is not worth knowing beforehand.
    welded : int
        Vertices that lie where another one does.
    doubts : tuple of str
        What is to be said of the surface with every result.
    workspace : Workspace
        Work arrays of the last runs, up to 144 bytes a vertex, which the next one overwrites.
    source : Source or None
        The mesh that was given.
    """

    surface: Surface
    moving: Integers
    place: Integers | None
    positions: Floats
    exponent: int
    mean_edge: float
    faces: Integers
    L: Laplacian
    gram: Gram
    rim: Rim | None
    kind: str
    modes: Density | None = None
    welded: int = 0
    doubts: tuple[str, ...] = ()
    workspace: Workspace = field(default_factory=lambda: Workspace(_KEPT))
    source: Source | None = None

    def __repr__(self) -> str:
        """What it is for, in a line: the arrays are long."""
        V, F = self.surface.vertices, self.surface.faces
        return f"<Prepared: {len(V)} vertices, {len(F)} faces, {self.kind} Laplacian>"

    @_of_its_source
    @blocks.one_blas_thread()
    def smooth(
        self,
        *,
        modes: int | None = None,
        wavelength: float | None = None,
        response: AnyResponse = _RESPONSE,
        barycenter_weight: float | None = None,
        criterion: Criterion = _CRITERION,
        iterations: int = _ITERATIONS,
        method: Method = _METHOD,
        mode_count: ModeCount = _MODE_COUNT,
        boundary: Boundary = _BOUNDARY,
        mask: npt.ArrayLike | None = None,
        features: npt.ArrayLike | None = None,
        feature_gain: float = _FEATURE_GAIN,
        start: SmoothingResult | None = None,
        progress: Progress | None = None,
    ) -> SmoothingResult:
        """As :func:`smooth`, without preparing anew.

        ``start`` is an earlier result for this surface, with settings not far from these, as a slider has it: the least
        squares then start from it, which saves iterations and makes no difference beyond their tolerance.
        """
        began = time.perf_counter()
        progress = check_progress(progress)
        feature_gain = check_number("feature_gain", feature_gain, *GAIN_BOUNDS)
        iterations = check_count("iterations", iterations, 1, MAX_ITERATIONS)
        if barycenter_weight is not None:
            barycenter_weight = check_barycenter_weight(barycenter_weight)
        kept = 0.0 if features is None else feature_gain * self._weights("features", features)
        region = self._region(boundary, mask, 1.0 - kept)
        criterion = check_choice("criterion", criterion, CRITERIA)
        response = check_choice("response", response, ("auto", *RESPONSES))
        guess = None if start is None else self._guess_of(start)
        if len(self.moving) == 0:
            return self._nowhere(modes, wavelength, response, barycenter_weight or MOST_WEIGHT, began)
        all_chosen = modes is wavelength is barycenter_weight is None
        responses: tuple[AnyResponse, ...] = (
            (response,) if response != "auto" else _CHOSEN_FROM if all_chosen else ("ideal",)
        )
        response = responses[-1]
        if barycenter_weight is None:
            automatic = _Automatic(
                criterion,
                responses,
                {
                    "modes": modes,
                    "wavelength": wavelength,
                    "iterations": iterations,
                    "method": method,
                    "mode_count": mode_count,
                    "boundary": boundary,
                    "feature_gain": feature_gain,
                },
            )
            result = self._smooth_automatically(automatic, mask, features, start, progress, began)
            finish(progress)
            return _with_warning(result, _why_nothing_moves(mask, features, feature_gain))
        designing, progress = self._shares(method, progress)
        low_pass = self._design(modes, wavelength, response, method, mode_count, barycenter_weight, designing)
        longest = wavelength_in_edges(low_pass.cutoff.eigenvalue)
        along = self._along_rim(
            boundary,
            lambda L, scale: design(
                L,
                family_of(response),
                wavelength=scale * longest,
                method=method,
                tolerance=DISPLACEMENT_TOLERANCE,
                error_gain=_error_gain_of_a_curve(barycenter_weight),
            ),
        )

        def removed(
            L: Laplacian, filter_: SpectralFilter, delta: Floats, report: Progress | None, workspace: Workspace
        ) -> Floats:
            change = filter_.apply(L, delta, report, workspace)
            change -= delta
            return change

        result = self._run(removed, low_pass, along, region, barycenter_weight, iterations, began, progress, guess)
        if modes is None:
            result = _with_warning(result, _warning_of(low_pass, len(self.moving)))
        return _with_warning(result, _why_nothing_moves(mask, features, feature_gain))

    @_of_its_source
    @blocks.one_blas_thread()
    def enhance(
        self,
        *,
        longest: float | None = None,
        shortest: float | None = None,
        gain: float = _GAIN,
        response: Response = _ENHANCING_RESPONSE,
        barycenter_weight: float = _ENHANCING_WEIGHT,
        method: Method = _METHOD,
        boundary: Boundary = _BOUNDARY,
        mask: npt.ArrayLike | None = None,
        features: npt.ArrayLike | None = None,
        progress: Progress | None = None,
    ) -> SmoothingResult:
        """As :func:`enhance`, without preparing anew."""
        start = time.perf_counter()
        progress = check_progress(progress)
        gain = check_number("gain", gain, *GAIN_BOUNDS)
        barycenter_weight = check_barycenter_weight(barycenter_weight)
        longest_ = self._in_edges("longest", longest, LONGEST_ENHANCED_IN_EDGES)
        shortest_ = self._in_edges("shortest", shortest, SHORTEST_ENHANCED_IN_EDGES)
        if not shortest_ < longest_:
            raise InvalidParameter(
                f"shortest is {shortest_:.3g} and longest {longest_:.3g} mean edges; the first must be the smaller one"
            )
        region = self._region(boundary, mask, 1.0 if features is None else self._weights("features", features))

        if len(self.moving) == 0:
            check_choice("response", response, RESPONSES)
            return self._nowhere(None, None, response, barycenter_weight, start)

        def band_pass(L: Laplacian, scale: float, seen: ErrorGain) -> Design:
            return design_band(
                L,
                family_of(response),
                scale * longest_,
                scale * shortest_,
                method=method,
                tolerance=DISPLACEMENT_TOLERANCE,
                error_gain=seen,
            )

        def added(
            L: Laplacian, filter_: SpectralFilter, delta: Floats, report: Progress | None, workspace: Workspace
        ) -> Floats:
            change = filter_.apply(L, delta, report, workspace)
            change *= gain - 1
            return change

        across = band_pass(self.L, 1.0, _error_gain(barycenter_weight))
        along = self._along_rim(
            boundary, lambda L, scale: band_pass(L, scale, _error_gain_of_a_curve(barycenter_weight))
        )
        result = self._run(added, across, along, region, barycenter_weight, 1, start, progress)
        note = NO_FEATURES if features is not None and not np.any(features) else None
        return _with_warning(result, _why_nothing_moves(mask, None, 0.0) or note)

    @_of_its_source
    @blocks.one_blas_thread()
    def low_pass(
        self,
        *,
        modes: int | None = None,
        wavelength: float | None = None,
        response: Response = _LOW_PASS_RESPONSE,
        method: Method = _METHOD,
        mode_count: ModeCount = _MODE_COUNT,
        mask: npt.ArrayLike | None = None,
        progress: Progress | None = None,
    ) -> SmoothingResult:
        """As :func:`low_pass`, without preparing anew."""
        start = time.perf_counter()
        designing, progress = self._shares(method, check_progress(progress))
        if len(self.moving) == 0:
            check_choice("response", response, RESPONSES)
            return self._nowhere(modes, wavelength, response, 0.0, start)
        low_pass = self._design(modes, wavelength, response, method, mode_count, None, designing)
        announce(progress, "smoothing")
        displacement = low_pass.filter.apply(self.L, self.positions, progress) - self.positions
        if mask is not None:
            displacement *= blend(self.L, self._weights("mask", mask))
        result = self._result(displacement, low_pass, 0.0, [], start)
        return _with_warning(result, _why_nothing_moves(mask, None, 0.0))

    def _smooth_automatically(
        self,
        automatic: _Automatic,
        mask: npt.ArrayLike | None,
        features: npt.ArrayLike | None,
        start: SmoothingResult | None,
        progress: Progress | None,
        began: float,
        is_part: bool = False,
    ) -> SmoothingResult:
        """With a weight by the noise: part by part, without strays, and no more than the noise explains."""
        count, labels = label_components(self.L)
        if count > 1 and not is_part:
            parts = split(self.positions, self.faces, self.L, count, labels)
            if len(parts) > 1:
                return self._smooth_parts(parts, automatic, mask, features, progress, began)
        boundary = automatic.given["boundary"]
        region = self._region(boundary, mask, 1.0)
        base, outliers = self._without_outliers(region)
        chosen = base._choose(automatic, mask, progress)
        if base is not self and chosen.choice.noise.kind == IMPULSE:  # those were the highest of many
            base, outliers = self, outliers[:0]
            chosen = base._choose(automatic, mask, progress)
        if progress is not None:
            progress(_CHOICE)
        progress, noise = subrange(progress, _CHOICE, 1 - _CHOICE), chosen.choice.noise
        if noise.kind == UNCLEAR:  # then strays are not distinguishable from shape either
            base, outliers = self, outliers[:0]
        if noise.is_left_alone:
            result = self._unchanged(automatic, chosen.choice, base, began)
        else:
            result = base._smooth_within_reason(
                automatic, chosen, mask, features, start, progress, count, labels, began
            )
        if base is not self:
            displacement = self._displacement_of(result)
            displacement += base.positions - self.positions
            result = self._with_displacement(result, displacement)
        unit = self.exponent
        result = replace(
            result,
            noise=noise.scaled(unit),
            estimated_error=float(np.ldexp(chosen.choice.error, unit)),
            mean_edge=float(np.ldexp(noise.mean_edge, unit)),
            outliers=self.moving[outliers].astype(np.int64),
            seconds=time.perf_counter() - began,
        )
        result = _with_warning(result, describe_outliers(outliers))
        return _with_warning(result, noise.warning)

    def _mask_without(self, mask: npt.ArrayLike | None, held: Booleans) -> Floats:
        """(n,) the mask, 0 at some of the moving vertices, (k,)."""
        n = len(self.surface.vertices)
        free = np.ones(n) if mask is None else check_weights("mask", mask, n).copy()
        if self.place is None:
            free[held] = 0.0
        else:
            free[(self.place >= 0) & held[self.place]] = 0.0
        return free

    def _smooth_parts(
        self,
        parts: Sequence[Part],
        automatic: _Automatic,
        mask: npt.ArrayLike | None,
        features: npt.ArrayLike | None,
        progress: Progress | None,
        began: float,
    ) -> SmoothingResult:
        """Each part by its own noise and edges; the evidence is that of the largest one."""
        displacement = np.zeros_like(self.positions)
        results: list[tuple[Part, SmoothingResult]] = []
        masks = None if mask is None else self._weights("mask", mask)[:, 0]
        marked = None if features is None else self._weights("features", features)[:, 0]
        vertices = self.surface.vertices[self.moving]
        place = np.empty(len(self.moving), dtype=np.int32)
        warnings, done = [], 0
        for part_ in parts:
            if part_.is_left_alone:
                warnings.append(describe_left_alone(part_))
                continue
            at = part_.vertices
            place[at] = np.arange(len(at), dtype=np.int32)
            alone = assemble(vertices[at], place[self.faces[part_.faces]], self.kind, weld=False)
            modes = automatic.given["modes"]
            if modes is not None:  # as many of the part as of the whole
                share = max(1, round(modes * len(at) / len(self.moving)))
                own = replace(automatic, given=automatic.given | {"modes": min(share, len(alone.moving))})
            else:
                own = automatic
            result = alone._smooth_automatically(
                own,
                None if masks is None else masks[at],
                None if marked is None else marked[at],
                None,
                subrange(progress, done / len(vertices), len(at) / len(vertices)),
                time.perf_counter(),
                is_part=True,
            )
            done += len(at)
            displacement[at] = _scaled(result.vertices - vertices[at], -self.exponent)
            results.append((part_, result))
            if result.warning is not None:
                warnings.append(f"in the part of {len(at)} of {len(vertices)} vertices: {result.warning}")
        moved, rms = self._moved_by(displacement)
        # a part that can be told anything of stands for the whole
        first = max(
            results,
            key=lambda pair: (pair[1].noise is not None and not pair[1].noise.is_left_alone, len(pair[0].vertices)),
        )
        squares = [len(p.vertices) * (r.estimated_error or 0.0) ** 2 for p, r in results]
        return _with_warning(
            replace(
                first[1],
                vertices=moved,
                displacement=rms,
                estimated_error=float(np.sqrt(sum(squares) / len(vertices))),
                welded=self.welded,
                outliers=np.sort(np.concatenate([self.moving[p.vertices[r.outliers]] for p, r in results])),
                warning=None,
                seconds=time.perf_counter() - began,
                given=self.surface,
            ),
            *self.doubts,
            describe_levels([r.noise for _, r in results if r.noise is not None]),
            *warnings,
        )

    def _without_outliers(self, region: _Region) -> tuple[Prepared, npt.NDArray[np.int64]]:
        """The same with strays put back, and which these are among the moving vertices."""
        rim_ = None if self.rim is None else self.rim.vertices
        positions, outliers = replace_outliers(self.positions, self.L, rim_)
        outliers = outliers[region.free[outliers, 0] > 0]
        if len(outliers) == 0:
            return self, outliers
        repaired = self.positions.copy()
        repaired[outliers] = positions[outliers]
        return replace(self, positions=repaired), outliers

    def _choose(self, automatic: _Automatic, mask: npt.ArrayLike | None, progress: Progress | None) -> _Chosen:
        """The weight of least estimated error, and where to start from: impulses pulled in, a noisy rim smoothed."""
        faces, boundary = self.faces, automatic.given["boundary"]
        counted = None if mask is None else self._weights("mask", mask)[:, 0] > 0
        modes, wavelength = automatic.given["modes"], automatic.given["wavelength"]
        if modes is not None and wavelength is None:
            given = automatic.given
            cutoff = self._design(modes, None, automatic.responses[-1], given["method"], given["mode_count"], 1.0, None)
            shortest = wavelength_in_edges(cutoff.cutoff.eigenvalue)
        else:
            shortest = self._in_edges("wavelength", wavelength, DEFAULT_WAVELENGTH_IN_EDGES)
        choice = choose(
            self.positions,
            faces,
            self.L,
            automatic.criterion,
            automatic.responses,
            shortest,
            counted,
            subrange(progress, 0.0, _CHOICE),
        )
        start = self.positions
        if choice.noise.kind == IMPULSE:
            start = robust(start, faces, self.L, self.gram)
            start = np.where(self._region(boundary, mask, 1.0).free > 0, start, self.positions)
        elif choice.noise.kind == CORRELATED and boundary == "auto" and self.rim is not None:
            start = across_the_rim(start, faces, self.L, self.gram, self.rim.vertices, choice.weight)
            start = np.where(self._region("free", mask, 1.0).free > 0, start, self.positions)
        return _Chosen(choice, self if start is self.positions else replace(self, positions=start))

    def _smooth_within_reason(
        self,
        automatic: _Automatic,
        chosen: _Chosen,
        mask: npt.ArrayLike | None,
        features: npt.ArrayLike | None,
        start: SmoothingResult | None,
        progress: Progress | None,
        count: int,
        labels: npt.NDArray[np.int32],
        began: float,
    ) -> SmoothingResult:
        """With the chosen weight; higher, or not at all, where the shape changes by more than the noise explains."""
        noise, weight, notes = chosen.choice.noise, chosen.choice.weight, []

        def smooth_by(weight: float, mask: npt.ArrayLike | None, start: SmoothingResult | None) -> SmoothingResult:
            result = chosen.start.smooth(
                **automatic.given,
                response=cast(Response, chosen.choice.response),
                barycenter_weight=weight,
                mask=mask,
                features=features,
                start=start,
                progress=monotone(progress),
            )
            return self._from_start(result, chosen)

        result = smooth_by(weight, mask, start)
        displacement = self._displacement_of(result)
        lost = find_lost_vertices(displacement, self.positions, self.faces, self.L, noise.level)
        if lost is not None:
            mask = self._mask_without(mask, lost)
            notes.append(describe_lost(lost))
            result = smooth_by(weight, mask, None)
            displacement = self._displacement_of(result)
            displacement[lost] = 0.0  # where impulses were clipped before
            result = self._with_displacement(result, displacement.copy())
        change = first = self._compare(displacement, count, labels, noise)
        for _ in range(_RETRIES):
            if not change.excessive.any():
                break
            held = self._hold_volume(displacement, change, labels, noise, mask)
            if not self._compare(held, count, labels, noise).excessive.any():
                notes.append(f"the volume was held, which smoothing would change ({change.describe()})")
                return _with_warning(self._with_displacement(result, held), *notes)
            weight *= _FIRMER
            result = smooth_by(weight, mask, None)
            displacement = self._displacement_of(result)
            change = self._compare(displacement, count, labels, noise)
        if first.excessive.any():
            what = "a weaker result is"
            if change.excessive.any():  # what still changes too much is left alone, component by component
                displacement[change.excessive[labels]] = 0.0
                result = self._with_displacement(result, displacement)
                what = f"for {int(change.excessive.sum())} of {count} components the input is"
            notes.append(first.describe_replaced("the input is" if change.excessive.all() else what))
        return _with_warning(result, *notes)

    def _hold_volume(
        self,
        displacement: Floats,
        change: ShapeChange,
        labels: npt.NDArray[np.int32],
        noise: Noise,
        mask: npt.ArrayLike | None,
    ) -> Floats:
        """The displacement with components moved along their normals to the volume they had, where a level suffices."""
        step = np.where(np.abs(change.offset) <= noise.level, change.offset, 0.0)[labels]
        along = step[:, None] * normals(self.positions + displacement, self.faces)
        if mask is not None:
            along *= self._weights("mask", mask)
        return displacement + along

    def _with_displacement(self, result: SmoothingResult, displacement: Floats) -> SmoothingResult:
        """The result with another displacement of the moving vertices, which is written over."""
        vertices, rms = self._moved_by(displacement)
        return replace(result, vertices=vertices, displacement=rms)

    def _compare(self, displacement: Floats, count: int, labels: npt.NDArray[np.int32], noise: Noise) -> ShapeChange:
        """What a displacement changes of each component's shape, and whether the noise explains it."""
        closed = np.ones(count, dtype=np.bool_)
        if self.rim is not None:
            closed[labels[self.rim.vertices]] = False
        return compare_shapes(
            self.positions,
            self.positions + displacement,
            self.faces,
            closed,
            labels if count > 1 else None,
            noise,
        )

    def _from_start(self, result: SmoothingResult, chosen: _Chosen) -> SmoothingResult:
        """The result with what impulses were drawn in by added to it, and without needless drift."""
        if chosen.start is self and not drifts(chosen.choice.noise):
            return result
        displacement = self._displacement_of(result)
        displacement += chosen.start.positions - self.positions
        displacement = without_drift(displacement, self.positions, self.faces, chosen.choice.noise)
        return self._with_displacement(result, displacement)

    def _nowhere(
        self, modes: int | None, wavelength: float | None, response: str, weight: float, began: float
    ) -> SmoothingResult:
        """For a mesh without an edge: all of its vertices stay."""
        if modes is not None:
            check_count("modes", modes, 1, len(self.surface.vertices))
        self._in_edges("wavelength", wavelength, DEFAULT_WAVELENGTH_IN_EDGES)
        return SmoothingResult(
            vertices=self.surface.vertices.copy(),
            cutoff=2.0,
            modes=0.0,
            modes_error=0.0,
            wavelength=0.0,
            mean_edge=0.0,
            response=response,
            laplacian=self.kind,
            method="exact",
            barycenter_weight=weight,
            iterations=1,
            degree=0,
            response_error=0.0,
            cg_iterations=(),
            residual=0.0,
            displacement=0.0,
            kernels=self.L.kernels.name,
            seconds=time.perf_counter() - began,
            given=self.surface,
            noise=nothing(0.0),
            estimated_error=0.0,
            warning=_joined(*self.doubts),
            welded=self.welded,
        )

    def _unchanged(self, automatic: _Automatic, choice: Choice, base: Prepared, began: float) -> SmoothingResult:
        """The surface as it is, with what the filter would have been."""
        given = automatic.given
        low_pass = base._design(
            given["modes"],
            given["wavelength"],
            choice.response,
            given["method"],
            given["mode_count"],
            MOST_WEIGHT,
            None,
        )
        return base._result(np.zeros_like(base.positions), low_pass, MOST_WEIGHT, [], began)

    def _run(
        self,
        change_of: Change,
        across: Design,
        along: Design | None,
        region: _Region,
        weight: float,
        iterations: int,
        start: float,
        progress: Progress | None,
        guess: Floats | None = None,
    ) -> SmoothingResult:
        """The three steps, on the boundary curve first if it is smoothed by itself."""
        workspace, displacement = self.workspace, np.zeros((1, 1))
        solutions = []
        announce(progress, "smoothing")
        # an iteration of the least squares takes as long as three sweeps, and they are some seven over the weight
        sweeping = across.filter.degree / (across.filter.degree + 3 * (7 / min(weight, 1.0) + 2))
        for number in range(iterations):
            step_2 = subrange(progress, number / iterations, sweeping / iterations)
            step_3 = subrange(progress, (number + sweeping) / iterations, (1 - sweeping) / iterations)
            V = self.positions + displacement if number else self.positions
            delta = self.L.product(V, workspace.borrow(V))
            if region.is_constrained:
                delta *= region.rows
            change = change_of(self.L, across.filter, delta, step_2, workspace)
            if region.is_partial:
                change *= region.field
            prescribed = np.zeros_like(V) if region.is_constrained else None
            if prescribed is not None and along is not None and self.rim is not None:
                at, curve = self.rim.vertices, self.rim.L
                change_along = region.field[at] * change_of(curve, along.filter, curve @ V[at], None, Workspace())
                free = region.mask[at] * self._is_long(self.rim, across)
                held = Constraints(free, np.ones((len(at), 1)), np.zeros_like(change_along))
                prescribed[at] = solve(curve, self.rim.gram, weight, change_along, None, held).displacement
            constraints = None if prescribed is None else Constraints(region.free, region.rows, prescribed)
            workspace.give_back(delta)
            nearby = None if number else guess
            solutions.append(
                solve(
                    self.L,
                    self.gram,
                    weight,
                    change,
                    step_3,
                    constraints,
                    nearby,
                    workspace=workspace,
                    overwrite_change=True,
                )
            )
            displacement = displacement + solutions[-1].displacement if number else solutions[-1].displacement
        result = self._result(displacement, across, float(weight), solutions, start)
        workspace.give_back(displacement)
        if progress is not None:
            progress(1.0)
        return result

    def _design(
        self,
        modes: int | None,
        wavelength: float | None,
        response: str,
        method: str,
        mode_count: str,
        weight: float | None,
        progress: Progress | None,
    ) -> Design:
        if modes is None:
            wavelength = self._in_edges("wavelength", wavelength, DEFAULT_WAVELENGTH_IN_EDGES)
        elif wavelength is not None:
            raise InvalidParameter("modes and wavelength both set the cut-off; give one of them")
        else:
            most = len(self.moving)
            modes = check_count("modes", modes, 1, most, f"1 or more; this mesh has {most}")
        return design(
            self.L,
            family_of(response),
            modes=modes,
            wavelength=wavelength,
            method=method,
            mode_count=mode_count,
            tolerance=POSITION_TOLERANCE if weight is None else DISPLACEMENT_TOLERANCE,
            error_gain=None if weight is None else _error_gain(weight),
            mode_density=self.modes,
            progress=progress,
        )

    def _shares(self, method: str, progress: Progress | None) -> tuple[Progress | None, Progress | None]:
        """Callbacks for the design and for the rest: eigenvectors take nearly all of the time, a polynomial none."""
        designing = 0.9 if is_exact(method, self.L.size) else 0.0
        return subrange(progress, 0.0, designing), subrange(progress, designing, 1 - designing)

    def _in_edges(self, name: str, length: float | None, default: float) -> float:
        """A wavelength in mean edge lengths."""
        if length is None:
            return default
        length = check_length(name, length)
        if self.mean_edge == 0:
            raise InvalidParameter(f"{name} has no meaning here: no edge of this mesh has a length")
        with np.errstate(over="ignore"):
            edges = np.ldexp(length, -self.exponent) / self.mean_edge
        return float(np.clip(edges, *_DIFFERENT_IN_EDGES))

    def _weights(self, name: str, given: npt.ArrayLike) -> Floats:
        """Weights of the moving vertices, (k, 1); of vertices at one place the least mask and the greatest feature."""
        each = check_weights(name, given, len(self.surface.vertices))
        if self.welded == 0 or self.place is None:
            return each[self.moving, None]
        least, used = name == "mask", self.place >= 0
        joined = np.full(len(self.moving), 1.0 if least else 0.0)
        (np.minimum if least else np.maximum).at(joined, self.place[used], each[used])
        return joined[:, None]

    def _region(self, boundary: str, mask: npt.ArrayLike | None, field: Floats | float) -> _Region:
        boundary = check_choice("boundary", boundary, BOUNDARIES)
        everywhere = np.ones((len(self.moving), 1))
        inside = everywhere if mask is None else (self._weights("mask", mask) > 0).astype(np.float64)
        rows, free = everywhere.copy(), inside.copy()
        holds_rim = boundary != "free" and self.rim is not None
        if holds_rim and self.rim is not None:
            rows[self.rim.vertices] = 0
            free[self.rim.vertices] = 0
        field = np.broadcast_to(field, inside.shape) if mask is None else field * inside
        is_partial = mask is not None or bool((field != 1).any())
        return _Region(field, inside, free, rows, holds_rim or mask is not None, is_partial)

    def _along_rim(self, boundary: str, make: Callable[[Laplacian, float], Design]) -> Design | None:
        """The same filter for the boundary curve, if that is smoothed by itself.

        ``make`` takes the curve's L and what to multiply wavelengths in mean edges of the surface with: the curve has
        edges of its own, and the eigenvalue of a wave on a curve is twice that on a surface.
        """
        if boundary != "curve" or self.rim is None or self.rim.mean_edge == 0:
            return None
        return make(self.rim.L, self.mean_edge / self.rim.mean_edge / np.sqrt(2))

    def _is_long(self, curve: Rim, across: Design) -> Floats:
        """1 at the rim's vertices on curves that the cut-off leaves round.

        The roundness of a closed curve is the wave that goes round it once. Where that is cut off, and with a margin
        for the softened step, the hole would close.
        """
        wavelength = wavelength_in_edges(across.cutoff.eigenvalue) * self.mean_edge
        return (curve.length > 1.25 * wavelength).astype(np.float64)

    def _moved_by(self, displacement: Floats) -> tuple[Floats, float]:
        """The vertices after a displacement of the moving ones, which is written over; and its root mean square.

        It is added to the positions as given, and only where there is one: the rest stays to the bit.
        """
        vertices = self.surface.vertices.copy()
        if len(displacement) == 0:
            return vertices, 0.0
        # not by BLAS, whose threads show in its sums
        square = float(np.einsum("ij,ij->", displacement, displacement))
        # as a coordinate that moved by the root of the square would be, at most
        if not np.isfinite(square) or np.frexp(square)[1] / 2 + self.exponent > _LARGEST_EXPONENT:
            raise InvalidParameter(
                "the result leaves the range of numbers; take a lower gain or a higher barycenter_weight, or scale "
                "the mesh down"
            )
        rms = float(np.ldexp(np.sqrt(square / len(vertices)), self.exponent))

        def move(at: slice) -> None:
            if self.place is None:
                step = displacement[at]
            else:
                step = displacement.take(self.place[at], axis=0, mode="wrap")  # several times as fast as by brackets
                step[self.place[at] < 0] = 0.0
            step = _scaled(step, self.exponent)
            np.add(vertices[at], step, out=vertices[at], where=step != 0)

        blocks.parallel_rows(move, len(vertices))
        return vertices, rms

    def _guess_of(self, start: SmoothingResult) -> Floats:
        """The displacement of a result that a caller gives."""
        if not isinstance(start, SmoothingResult):
            raise InvalidParameter(f"start is {show(start)}; it must be an earlier result for this mesh")
        if not isinstance(start.vertices, np.ndarray) or start.vertices.dtype != np.float64:
            raise InvalidParameter(f"start.vertices is {show(start.vertices)}; it must be what a call returned")
        with np.errstate(all="ignore"):
            guess = self._displacement_of(start)
        if not np.isfinite(guess).all():
            raise InvalidParameter("start is too far from this mesh; it must be an earlier result for it")
        return guess

    def _displacement_of(self, result: SmoothingResult) -> Floats:
        """What a result moved, of the moving vertices, on the scale of ``positions``."""
        if result.vertices.shape != self.surface.vertices.shape:
            raise InvalidParameter(
                f"start is a result for {len(result.vertices)} vertices; this mesh has {len(self.surface.vertices)}"
            )
        if self.place is None:
            return _scaled(result.vertices - self.surface.vertices, -self.exponent)
        at = self.moving
        return _scaled(result.vertices.take(at, axis=0) - self.surface.vertices.take(at, axis=0), -self.exponent)

    def _result(
        self, displacement: Floats, low_pass: Design, weight: float, solutions: list[Solution], start: float
    ) -> SmoothingResult:
        mean_edge = float(np.ldexp(self.mean_edge, self.exponent))
        vertices, rms = self._moved_by(displacement)
        return SmoothingResult(
            vertices=vertices,
            cutoff=low_pass.cutoff.eigenvalue,
            modes=low_pass.cutoff.modes,
            modes_error=low_pass.cutoff.error,
            wavelength=wavelength_in_edges(low_pass.cutoff.eigenvalue) * mean_edge,
            mean_edge=mean_edge,
            response=low_pass.response.label,
            laplacian=self.kind,
            method=low_pass.method,
            barycenter_weight=weight,
            iterations=max(len(solutions), 1),
            degree=low_pass.filter.degree,
            response_error=low_pass.filter.error,
            cg_iterations=tuple(solution.iterations for solution in solutions),
            residual=max((solution.residual for solution in solutions), default=0.0),
            displacement=rms,
            kernels=self.L.kernels.name,
            seconds=time.perf_counter() - start,
            warning=_joined(*self.doubts),
            welded=self.welded,
            given=self.surface,
        )


@dataclass(frozen=True, eq=False)
class _Automatic:
    """What a choice is made by, and what else was asked for."""

    criterion: str
    responses: tuple[str, ...]
    given: dict[str, Any]


@dataclass(frozen=True, eq=False)
class _Region:
    """Where to act, as (k, 1) columns.

    ``field`` scales the change, ``mask`` is 1 where vertices may move at all, ``free`` where the surface's own least
    squares moves them, ``rows`` where differential coordinates are asked for; ``is_constrained`` unless these two are 1
    everywhere, ``is_partial`` unless the first is.
    """

    field: Floats
    mask: Floats
    free: Floats
    rows: Floats
    is_constrained: bool
    is_partial: bool


@dataclass(frozen=True, eq=False)
class _Chosen:
    """A weight, and the mesh to smooth with it."""

    choice: Choice
    start: Prepared


@accept_meshes
def prepare(
    mesh: Mesh, faces: npt.ArrayLike | None = None, *, laplacian: LaplacianKind = _LAPLACIAN, weld: bool = _WELD
) -> Prepared:
    """Build what does not depend on the parameters, to smooth the same surface many times.

    Parameters
    ----------
    mesh, faces, laplacian, weld
        As for :func:`smooth`.

    Examples
    --------
    >>> import meshlab_specsmooth as mss
    >>> corners = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]
    >>> prepared = mss.prepare(corners, [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])
    >>> [prepared.smooth(modes=k).method for k in (1, 4)]
    ['exact', 'exact']
    """
    source = recognize(mesh, faces)
    prepared = replace(assemble(source.vertices, source.faces, laplacian, weld=weld), source=source.kept())
    if prepared.L.size <= eigenbasis.DENSE_VERTICES:  # counted exactly
        return prepared
    with blocks.one_blas_thread():
        return replace(prepared, modes=density.estimate_density(prepared.L))


def assemble(
    vertices: npt.ArrayLike,
    faces: npt.ArrayLike,
    laplacian: str,
    progress: Progress | None = None,
    weld: bool = True,
) -> Prepared:
    """What every run needs, and nothing that only saves time when there are many: see :func:`prepare`."""
    weld = check_flag("weld", weld)
    report = check_progress(progress) or (lambda fraction: None)
    announce(progress, "assembling")
    surface = Surface(vertices, faces)  # type: ignore[arg-type]  # the gate takes anything and says what is wrong
    laplacian = check_choice("laplacian", laplacian, LAPLACIANS)
    V, F = surface.vertices, surface.faces
    require(BYTES_PER_VERTEX * len(V), f"smoothing {len(V)} vertices")
    report(0.2)
    copies = find_copies(V, find_corners(F, len(V))) if weld else None
    if copies is not None:
        given, F = F, copies.take(F)
    F = with_sides(F)
    moving = np.flatnonzero(find_corners(F, len(V))).astype(np.int32)
    scattered = order.is_scattered(F, len(V))
    place: Integers | None = None
    if scattered:
        # several times as fast as by brackets, here and below
        moving = moving.take(order.morton_order(V if len(moving) == len(V) else V.take(moving, axis=0)))
    if scattered or len(moving) < len(V):
        place = np.full(len(V), -1, dtype=np.int32)
        place[moving] = np.arange(len(moving), dtype=np.int32)
        F = place.take(F)
    welded = 0
    if copies is not None and place is not None:
        used = find_corners(given, len(V))
        place[used] = place[copies[used]]
        welded = int((copies[used] != np.flatnonzero(used)).sum())
    report(0.4)
    mesh = mesh_graph(F, len(moving))
    report(0.8)
    positions, exponent = _normalized(V if place is None else V.take(moving, axis=0))
    L = laplacian_of_kind(laplacian, mesh, positions, F)
    boundary = mesh.boundary()
    report(1.0)
    return Prepared(
        surface,
        moving,
        place,
        positions,
        exponent,
        L.mean_edge_length(positions),
        F,
        L,
        gram_of_barycenters(mesh),
        rim(positions, boundary),
        laplacian,
        welded=welded,
        doubts=tuple(_doubts(surface, len(boundary), len(mesh.graph.indices) // 2)),
    )


def describe_unused(surface: Surface) -> list[str]:
    """What is to be said of vertices that no face uses."""
    count = surface.unused_not_finite
    return [f"{count} vertices that no face uses are not finite and take no part"] if count else []


def _doubts(surface: Surface, boundary_edges: int, edges: int) -> list[str]:
    """What is to be said of a surface with every result."""
    doubts = describe_unused(surface)
    if 2 * boundary_edges > edges:
        doubts.append(
            f"{boundary_edges} of {edges} edges have one face only: what is not connected is not smoothed across "
            "(merge close vertices first)"
        )
    return doubts


def with_sides(F: Integers) -> Integers:
    """The faces, less those whose corners are one vertex: these have no edge, and their barycenter has no say."""
    first = F[:, 0] == F[:, 1]
    return F[~(first & (F[:, 1] == F[:, 2]))] if first.any() else F


def find_corners(F: Integers, n: int) -> Booleans:
    """(n,) whether a vertex is a corner of a face."""
    found = np.zeros(n, dtype=np.bool_)

    def mark(at: slice) -> None:
        found[F[at]] = True

    blocks.parallel_rows(mark, len(F))
    return found


@accept_meshes
def smooth(
    mesh: Mesh,
    faces: npt.ArrayLike | None = None,
    *,
    modes: int | None = None,
    wavelength: float | None = None,
    response: AnyResponse = _RESPONSE,
    barycenter_weight: float | None = None,
    criterion: Criterion = _CRITERION,
    iterations: int = _ITERATIONS,
    laplacian: LaplacianKind = _LAPLACIAN,
    method: Method = _METHOD,
    mode_count: ModeCount = _MODE_COUNT,
    boundary: Boundary = _BOUNDARY,
    mask: npt.ArrayLike | None = None,
    features: npt.ArrayLike | None = None,
    feature_gain: float = _FEATURE_GAIN,
    weld: bool = _WELD,
    progress: Progress | None = None,
) -> SmoothingResult:
    """Spectral smoothing with barycenter constraints: the paper's method.

    Step 1 takes the differential coordinates delta = L V (eq. 3-4), step 2 low-passes them, delta' = h(L) delta, and
    step 3 finds the surface that has them and keeps its face barycenters: the V' that minimizes
    ``|L V' - delta'|^2 + w^2 |C V' - C V|^2`` (eq. 5-6).

    Parameters
    ----------
    mesh : (n, 3) real array, or a mesh of any kind
        Vertices, in mesh units; or, without ``faces``, a mesh of pymeshlab (a MeshSet's current mesh), trimesh,
        PyVista, Open3D, meshio or vedo, a tuple of vertices and faces, or the path of a file. Never changed;
        ``result.mesh`` is one of the same kind.
    faces : (m, 3) integer array, optional
        Never changed. Quads and polygons are split into triangles for the computation.
    modes : int, optional
        Number of modes kept, lowest first (the paper's f_a).
    wavelength : float, optional
        Shortest surface wave kept, in mesh units. Without this and ``modes``: 20 mean edge lengths.
    response : {"auto", "ideal", "butterworth", "gaussian", "heat"}
        Shape of the low-pass; see :mod:`meshlab_specsmooth.spectral.response`. ``"auto"`` is ideal;
        where neither a cut-off nor a weight is given, heat or ideal, by estimated error (beyond 100 000 vertices heat,
        which is cheap).
    barycenter_weight : float, optional
        w from 1.5e-8 to 6.7e7, dimensionless: how firmly the barycenters are held. It is the strength of the filter,
        more than the cut-off is: 1 is the paper, 0.3 suits noise of 0.2 edge lengths. Without it the noise is measured
        (:func:`meshlab_specsmooth.estimate_noise`), impulses are pulled to the surface, and the weight of least
        estimated error is taken, for a low cut-off; result.noise says what was found. Single stray vertices are put
        back first. Components of unlike scale or noise are smoothed one by one. Where noise and shape are not
        distinguishable, nothing is moved, and where the shape would change by more than the noise explains, a weaker
        result or the input is returned; result.warning says so.
    criterion : {"position", "normals"}
        Whose error a chosen weight makes small; normals ask for more smoothing.
    iterations : int
        How often all of it is done, each time to the last result; 1000 times at most.
    laplacian : {"uniform", "cotangent"}
        See :func:`meshlab_specsmooth.operators.laplacians.laplacian`.
    method : {"auto", "exact", "chebyshev"}
        How h(L) is applied: with eigenvectors, or with a polynomial; ``"auto"`` is exact up to 1000 vertices.
    mode_count : {"estimate", "exact"}
        How ``modes`` becomes a cut-off: from the density of modes, with the error that the result states, or by a few
        sparse factorizations; up to 1000 vertices it is always exact.
    boundary : {"auto", "fixed", "curve", "free"}
        What happens at the boundary of an open surface: it stays; its curve is smoothed along itself, by the same three
        steps, except small holes (shorter round than the wavelength), which stay; or it is smoothed like the rest,
        which draws it inward (the paper). ``"auto"`` is ``"fixed"``, unless the weight is chosen and the noise is
        shared between neighbors: then the boundary moves as the rest does, but across the surface only.
    mask : (n,) array of weights in [0, 1] or of bool, optional
        Vertices that may move: those whose weight is above 0. The others stay to the bit, and the displacement fades
        out toward them without a seam.
    features : (n,) array of weights in [0, 1] or of bool, optional
        Vertices whose detail is to be kept or enhanced.
    feature_gain : float
        What features keep of the differential coordinates that smoothing removes: 0 smooths them as the rest, 1 keeps
        them, above 1 enhances them. Without ``features`` it has no effect.
    weld : bool
        Whether vertices at one place move as one, as along texture seams and in triangle soups. Without, each copy is a
        vertex of its own, and the surface ends at its edges.
    progress : callable, optional
        Called with the fraction done, rising to 1.

    Returns
    -------
    SmoothingResult
        ``vertices`` and the evidence.

    Raises
    ------
    InvalidSurface
        The arrays are no triangle mesh.
    InvalidParameter
        A parameter is out of range, or modes and wavelength are both given.
    NotConverged
        The least squares did not reach its tolerance.
    TooLarge
        A mesh that would not fit in memory, or whose eigenvectors would not, with ``method="exact"``.

    Examples
    --------
    >>> import numpy as np
    >>> import meshlab_specsmooth as mss
    >>> octahedron = np.vstack([np.eye(3), -np.eye(3)])
    >>> faces = [[0, 1, 2], [1, 3, 2], [3, 4, 2], [4, 0, 2], [1, 0, 5], [3, 1, 5], [4, 3, 5], [0, 4, 5]]
    >>> result = mss.smooth(octahedron, faces, modes=4)
    >>> result.method, result.modes, np.allclose(result.vertices, octahedron)
    ('exact', 4, True)
    """
    start = time.perf_counter()
    progress = begin(progress, "assembling")
    source = recognize(mesh, faces)
    prepared = assemble(source.vertices, source.faces, laplacian, subrange(progress, 0.0, _ASSEMBLY), weld)
    result = prepared.smooth(
        modes=modes,
        wavelength=wavelength,
        response=response,
        barycenter_weight=barycenter_weight,
        criterion=criterion,
        iterations=iterations,
        method=method,
        mode_count=mode_count,
        boundary=boundary,
        mask=mask,
        features=features,
        feature_gain=feature_gain,
        progress=subrange(progress, _ASSEMBLY, 1 - _ASSEMBLY),
    )
    if barycenter_weight is not None:
        result = warn_of_change(prepared, result)
    finish(progress)
    return replace(result, source=source.kept(), seconds=time.perf_counter() - start)


def warn_of_change(prepared: Prepared, result: SmoothingResult) -> SmoothingResult:
    """The result of a given weight, which says so if it changes the volume or the size of a shape by per cents."""
    if len(prepared.moving) == 0:
        return result
    count, labels = label_components(prepared.L)
    change = prepared._compare(prepared._displacement_of(result), count, labels, nothing(prepared.mean_edge))
    note = f"this weight changes the shape: {change.describe()}" if change.is_large else None
    return _with_warning(result, note)


@accept_meshes
def low_pass(
    mesh: Mesh,
    faces: npt.ArrayLike | None = None,
    *,
    modes: int | None = None,
    wavelength: float | None = None,
    response: Response = _LOW_PASS_RESPONSE,
    laplacian: LaplacianKind = _LAPLACIAN,
    method: Method = _METHOD,
    mode_count: ModeCount = _MODE_COUNT,
    mask: npt.ArrayLike | None = None,
    weld: bool = _WELD,
    progress: Progress | None = None,
) -> SmoothingResult:
    """Plain spectral smoothing of the coordinates, V' = h(L) V: what the paper compares with.

    It is the limit of :func:`smooth` for a barycenter weight of 0 (up to a shift of open components, whose mean is
    another over edges than over faces); it loses all detail below the wavelength, and shrinks.

    Parameters, returns and errors as for :func:`smooth`.

    Examples
    --------
    >>> import numpy as np
    >>> import meshlab_specsmooth as mss
    >>> triangle = np.array([[0.0, 0, 0], [3, 0, 0], [0, 3, 0]])
    >>> mss.low_pass(triangle, [[0, 1, 2]], modes=1).vertices.round(12)  # the constant mode: the center
    array([[1., 1., 0.],
           [1., 1., 0.],
           [1., 1., 0.]])
    """
    start = time.perf_counter()
    progress = begin(progress, "assembling")
    source, report = recognize(mesh, faces), subrange(progress, 0.0, _ASSEMBLY)
    result = assemble(source.vertices, source.faces, laplacian, report, weld).low_pass(
        modes=modes,
        wavelength=wavelength,
        response=response,
        method=method,
        mode_count=mode_count,
        mask=mask,
        progress=subrange(progress, _ASSEMBLY, 1 - _ASSEMBLY),
    )
    finish(progress)
    return replace(result, source=source.kept(), seconds=time.perf_counter() - start)


@accept_meshes
def enhance(
    mesh: Mesh,
    faces: npt.ArrayLike | None = None,
    *,
    longest: float | None = None,
    shortest: float | None = None,
    gain: float = _GAIN,
    response: Response = _ENHANCING_RESPONSE,
    barycenter_weight: float = _ENHANCING_WEIGHT,
    laplacian: LaplacianKind = _LAPLACIAN,
    method: Method = _METHOD,
    boundary: Boundary = _BOUNDARY,
    mask: npt.ArrayLike | None = None,
    features: npt.ArrayLike | None = None,
    weld: bool = _WELD,
    progress: Progress | None = None,
) -> SmoothingResult:
    """Amplify a band of the surface's detail by the same three steps: delta' = delta + (gain - 1) band(L) delta.

    Parameters
    ----------
    longest, shortest : float, optional
        The longest and the shortest wave of the band, in mesh units; 30 and 6 mean edge lengths by default.
    gain : float
        What the band's differential coordinates are multiplied with: 1 changes nothing, 2 doubles, 0 removes.
    barycenter_weight : float
        w > 0: the barycenters hold waves back whose eigenvalue is below w, so it is smaller here than for smoothing.
    features : (n,) array of weights in [0, 1] or of bool, optional
        Where to enhance; everywhere by default.
    mesh, faces, response, laplacian, method, boundary, mask, weld, progress
        As for :func:`smooth`; so are returns and errors. The result's cut-off is that of the shortest wave.

    Examples
    --------
    >>> import numpy as np
    >>> import meshlab_specsmooth as mss
    >>> octahedron = np.vstack([np.eye(3), -np.eye(3)])
    >>> faces = [[0, 1, 2], [1, 3, 2], [3, 4, 2], [4, 0, 2], [1, 0, 5], [3, 1, 5], [4, 3, 5], [0, 4, 5]]
    >>> np.allclose(mss.enhance(octahedron, faces, gain=1).vertices, octahedron)
    True
    """
    start = time.perf_counter()
    progress = begin(progress, "assembling")
    source, report = recognize(mesh, faces), subrange(progress, 0.0, _ASSEMBLY)
    result = assemble(source.vertices, source.faces, laplacian, report, weld).enhance(
        longest=longest,
        shortest=shortest,
        gain=gain,
        response=response,
        barycenter_weight=barycenter_weight,
        method=method,
        boundary=boundary,
        mask=mask,
        features=features,
        progress=subrange(progress, _ASSEMBLY, 1 - _ASSEMBLY),
    )
    finish(progress)
    return replace(result, source=source.kept(), seconds=time.perf_counter() - start)


def _error_gain(weight: float) -> ErrorGain:
    """The share of an error in delta' that the reconstruction of a surface passes on."""
    return lambda eigenvalues: error_gain(eigenvalues, weight)


def _error_gain_of_a_curve(weight: float) -> ErrorGain:
    """The same along a curve, whose midpoints hold long waves half as firmly as barycenters do."""
    return _error_gain(weight / np.sqrt(2))


def _with_warning(result: SmoothingResult, *warnings: str | None) -> SmoothingResult:
    """The result with more to be said, once."""
    said = result.warning or ""
    return replace(result, warning=_joined(result.warning, *(x for x in warnings if x is not None and x not in said)))


def _joined(*warnings: str | None) -> str | None:
    return "; ".join(filter(None, warnings)) or None


def _why_nothing_moves(mask: npt.ArrayLike | None, features: npt.ArrayLike | None, gain: float) -> str | None:
    """The reason, where the caller's region, which was checked before, lets nothing move."""
    if mask is not None and not np.any(mask):
        return NOTHING_SELECTED
    return ALL_KEPT if features is not None and gain == 1 and np.all(np.asarray(features) == 1) else None


def _warning_of(low_pass: Design, vertex_count: int) -> str | None:
    if low_pass.cutoff.modes < _NEARLY_ALL * vertex_count:
        return None
    return (
        "the wavelength is so short that nearly all waves which the mesh can carry are longer, and are kept: take one "
        "of five mean edge lengths or more"
    )


def _normalized(V: Floats) -> tuple[Floats, int]:
    """``V`` centered and divided by 2^exponent, so that it lies in [-1, 1]; a power of two rounds nothing."""
    if len(V) == 0:
        return V, 0
    low, high = (blocks.reduce_rows(of, V) for of in (np.minimum, np.maximum))
    center = low / 2 + high / 2
    exponent = int(np.frexp((high - center).max())[1])
    centered = np.empty_like(V)

    def center_rows(at: slice) -> None:
        np.subtract(V[at], center, out=centered[at])
        centered[at] = _scaled(centered[at], -exponent)

    blocks.parallel_rows(center_rows, len(V))
    return centered, exponent


def _scaled(X: Floats, exponent: int) -> Floats:
    """X times 2^exponent, in place where that power is a number."""
    if abs(exponent) < np.finfo(np.float64).maxexp:
        X *= 2.0**exponent
        return X
    return np.ldexp(X, exponent)

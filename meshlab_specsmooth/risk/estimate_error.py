"""Noise, and the error of any filter, estimated from the noisy mesh alone."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from meshlab_specsmooth.adapters import Mesh, accept_meshes
from meshlab_specsmooth.arrays import Floats
from meshlab_specsmooth.describe import Described, Rows, format_length
from meshlab_specsmooth.errors import FilterFailed, InvalidParameter
from meshlab_specsmooth.geometry.surface import LARGEST_EXPONENT, check_extent
from meshlab_specsmooth.noise.estimate import estimate
from meshlab_specsmooth.noise.local import measure_local_level
from meshlab_specsmooth.noise.model import KINDS, LENGTHS, LEVELS, WHITE, Noise
from meshlab_specsmooth.noise.outliers import replace_outliers
from meshlab_specsmooth.noise.parts import estimate_surface
from meshlab_specsmooth.noise.sample import sample
from meshlab_specsmooth.noise.scales import walk
from meshlab_specsmooth.operators.assemble import Operators, as_operators, as_uniform
from meshlab_specsmooth.operators.patches import find_interior
from meshlab_specsmooth.parameters import (
    MAX_PROBES,
    MAX_SEED,
    NOISE_BOUNDS_IN_EXTENTS,
    check_choice,
    check_count,
    check_function,
    check_number,
    show,
)
from meshlab_specsmooth.risk.sure import Probe
from meshlab_specsmooth.runtime import blocks
from meshlab_specsmooth.runtime.memory import require

# The step of the probe, as a fraction of the noise: small enough for a difference quotient, large enough for filters
# that stop iterating at some tolerance.
# docs/constants.md: _STEP
_STEP = 0.05

_PROBES = 4

# Steps of the lazy random walk that the field of an error is averaged over: some 200 and some 1500 vertices.
_STEPS_OF_NOISE, _STEPS_OF_SHAPE = 30, 240

# Bounds of what a caller may change in a Noise, with room to spare: the variance of impulses is that of all vertices
# over the fraction that has noise, and the variance in one direction is at most nine times the mean.
_MIN_DENSITY, _MAX_COVARIANCE = 1e-9, 1e9

_LARGEST = float(np.finfo(np.float64).max)

# Of 2, of the largest move of a filter in extents of the mesh: beyond, squares of its error overflow.
_MAX_MOVE_EXPONENT = 400

# Bytes a vertex and probe: the realization, and a surface that is perturbed by it.
_BYTES_PER_DRAW = 32


@accept_meshes
def estimate_noise(mesh: Mesh, faces: npt.ArrayLike | None = None) -> Noise:
    """Estimate level and kind of the noise of a surface along its normals, in mesh units.

    The level is the median of the normal component of L^2 V; levels at other scales distinguish the kinds (see
    :class:`Noise`). White noise between 0.05 and 0.5 edges is found to a few per cent where the mesh resolves its
    shape; fine detail counts as noise, so a coarse model of a curved shape has some. Large meshes are represented by
    patches, which are the same for any order of vertices and faces. Of components of different scale or noise, the
    largest is measured. ``noise.local`` is the level at each vertex. Where the triangles are too uneven, too coarse or
    too few, the kind is ``"unclear"``.

    Parameters
    ----------
    mesh : (n, 3) real array, or a mesh of any kind
        Vertices, in mesh units.
    faces : (m, 3) integer array, optional
        As for :func:`meshlab_specsmooth.smooth`.

    Raises
    ------
    InvalidSurface
        The arrays do not form a triangle mesh.

    Examples
    --------
    >>> import meshlab_specsmooth as mss
    >>> corners = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]
    >>> mss.estimate_noise(corners, [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]]).kind  # too few to tell
    'unclear'
    """
    ops = as_uniform(as_operators(mesh, faces, "uniform"))
    with blocks.one_blas_thread():
        noise = estimate_noise_of(ops)
        if noise.local is None and ops.L.size > 0 and ops.mean_edge > 0:
            found = measure_local_level(ops, find_interior(ops))
            noise = replace(noise, local=found.noise * found.edge)
        if noise.local is not None:
            noise = replace(noise, local=ops.spread(noise.local))
        return noise.scaled(ops.exponent)


def estimate_noise_of(ops: Operators) -> Noise:
    """The noise of a mesh with uniform operators, in the units of its positions, after removing stray vertices."""
    if ops.L.size == 0:
        return Noise.zero(0.0)
    positions, _ = replace_outliers(ops.positions, ops.L, ops.boundary_vertices)
    return estimate_surface(replace(ops, positions=positions))


@dataclass(frozen=True, eq=False, repr=False)
class ErrorEstimate(Described):
    """The expected error of a filtered surface, along the normals.

    Attributes
    ----------
    error : float
        Root mean square, in mesh units; 0 where the estimated risk is negative, as it may be by chance.
    risk : float
        Mean square, in squared mesh units: unbiased for white noise of the assumed level.
    standard_error : float
        Of the risk, from the scatter of the probes; it does not cover an error of the noise level.
    noise : Noise
        The noise that was assumed.
    probes : int
    vertices : (n, 3) float64
        What the filter made of the surface.
    field : (n,) float64
        The expected error around each vertex, in mesh units.
    risks : tuple of float
        By each probe, NaN for a probe that was skipped. The difference of two filters with the same probes is known
        more accurately than either.
    """

    error: float
    risk: float
    standard_error: float
    noise: Noise
    probes: int
    vertices: Floats
    risks: tuple[float, ...] = ()
    field: Floats = dataclasses.field(default_factory=lambda: np.empty(0))

    @property
    def summary(self) -> str:
        """The error and the noise in a few words."""
        return f"estimated error {self.noise.format_error(self.error)} edges; {self.noise.summary}"

    def rows(self) -> Rows:
        """The error, its scatter, and the noise."""
        edge = self.noise.mean_edge
        scatter = self.standard_error / (2 * self.error) if self.error > 0 else float("nan")
        rows = [("estimated error", self.noise.describe_error(self.error))]
        if np.isfinite(scatter) and scatter < self.error:
            rows.append(("standard error", f"{format_length(scatter, edge)}, from the scatter of the probes"))
        return [
            *rows,
            ("probes", str(self.probes)),
            ("noise", self.noise.describe_level()),
            ("mean edge", f"{edge:.4g}"),
        ]


@accept_meshes
def estimate_error(
    filter: Callable[[Floats], npt.ArrayLike],  # noqa: A002 (the word for it)
    mesh: Mesh,
    faces: npt.ArrayLike | None = None,
    *,
    noise: Noise | float | None = None,
    probes: int = _PROBES,
    seed: int = 0,
) -> ErrorEstimate:
    """Estimate the error of any filter on a surface, without ground truth.

    Stein's unbiased risk estimate in its Monte-Carlo form (Ramani, Blu, Unser 2008), along the normals n of a
    smoothed guide: with realizations z of the noise of standard deviation s and a small e,

        risk = mean (n . (f(V) - V))^2 - s^2 + 2 mean z n . (f(V + e z n) - f(V)) / e.

    It takes one run of the filter, and one more for each probe. Filters that are compared should be given the same
    noise and seed, so that most of the scatter cancels. It is valid for white noise; for filters that are not linear it
    is not valid for impulses and correlated noise.

    Parameters
    ----------
    filter : callable
        From (n, 3) vertices to (n, 3) vertices; it gets a copy each time, and must be deterministic.
    mesh : (n, 3) real array, or a mesh of any kind
        Vertices, in mesh units.
    faces : (m, 3) integer array, optional
        As for :func:`meshlab_specsmooth.smooth`.
    noise : Noise or float, optional
        The noise to assume; a number is the level of white noise, in mesh units. Estimated by default.
    probes : int
        Random perturbations, 1 or more.
    seed : int

    Raises
    ------
    InvalidSurface
        The arrays do not form a triangle mesh.
    InvalidParameter
        A level that is no length, or no probes.
    FilterFailed
        The filter raised something, or what it returned is not finite or of another shape.

    Examples
    --------
    >>> import numpy as np
    >>> import meshlab_specsmooth as mss
    >>> x, y = (a.ravel() for a in np.meshgrid(np.arange(40.0), np.arange(40.0)))
    >>> at = (np.arange(39)[:, None] * 40 + np.arange(39)).ravel()
    >>> faces = np.concatenate([np.c_[at, at + 1, at + 41], np.c_[at, at + 41, at + 40]])
    >>> rough = np.c_[x, y, 0.2 * np.random.default_rng(0).standard_normal(1600)]
    >>> errors = [mss.estimate_error(f, rough, faces).error for f in (lambda V: V, lambda V: V * [1, 1, 0])]
    >>> round(errors[0], 1), errors[1] < 0.1  # left as it is, and flattened
    (0.2, True)
    """
    filter = check_function("filter", filter)  # noqa: A001
    prepared = prepare_probe(as_operators(mesh, faces, "uniform"), noise=noise, probes=probes, seed=seed)
    perturbed = prepared.perturb() if prepared.probe.draws.any() else []
    V, exponent = prepared.ops.surface.vertices, prepared.ops.exponent
    largest = float(np.ldexp(1.0, min(LARGEST_EXPONENT, _MAX_MOVE_EXPONENT + exponent)))
    result, again = _apply(filter, V, largest), [_apply(filter, X, largest) for X in perturbed]
    return replace(prepared.estimate(result, again), field=prepared.estimate_field(result, again))


@dataclass(frozen=True, eq=False)
class SurfaceProbe:
    """What the estimates of all filters on one surface share; made by :func:`prepare_probe`.

    The caller runs the filters: on the surface, and on each of :meth:`perturb`.

    Attributes
    ----------
    ops : Operators
        Uniform, of the surface.
    probe : Probe
        In the units of its positions.
    noise : Noise
        The noise that is assumed, in mesh units.
    """

    ops: Operators
    probe: Probe
    noise: Noise

    def perturb(self) -> list[Floats]:
        """(n, 3) vertices for each realization of the noise."""
        V, at, exponent = self.ops.surface.vertices, self.ops.active, self.ops.exponent
        surfaces = []
        for step in self.probe.perturb(np.zeros_like(self.probe.normals)):
            X = V.copy()
            X[at] += np.ldexp(step, exponent)
            surfaces.append(X)
        return surfaces

    def project(self, X: Floats, Y: Floats) -> Floats:
        """(k,) n . (Y - X) at the active vertices, in mesh units, for (n, 3) vertices X and Y."""
        return self.probe.project(Y[self.ops.active] - X[self.ops.active])

    def estimate(self, result: Floats, perturbed: Sequence[Floats | None]) -> ErrorEstimate:
        """The estimate for a filter.

        Parameters
        ----------
        result : (n, 3) float64
            What the filter makes of the surface.
        perturbed : sequence of (n, 3) float64
            What it makes of :meth:`perturb`, or of the first few; None for those to be skipped. An empty sequence where
            there is no noise.
        """
        displacement = self._scale(result - self.ops.surface.vertices)
        risks = []
        for i in range(max(min(len(perturbed), self.probe.draws.shape[1]), 1)):
            again = perturbed[i] if i < len(perturbed) else result
            response = None if again is None else self._scale(again - result)
            risks.append(np.nan if response is None else self.probe.estimate(displacement, response, i)[0])
        used = [risk for risk in risks if np.isfinite(risk)]
        risk, probes, unit = float(np.mean(used)) if used else float("nan"), len(used), self.ops.exponent
        scatter = float(np.std(used, ddof=1) / np.sqrt(probes)) if probes > 1 else float("nan")
        return ErrorEstimate(
            float(np.ldexp(np.sqrt(max(risk, 0.0)), unit)),
            float(np.ldexp(risk, 2 * unit)),
            float(np.ldexp(scatter, 2 * unit)),
            self.noise,
            probes,
            result,
            tuple(np.ldexp(risks, 2 * unit).tolist()),
        )

    def estimate_field(self, result: Floats, perturbed: Sequence[Floats]) -> Floats:
        """(n,) the root of the estimate for a filter, in the neighborhood of each vertex; parameters as above.

        What the filter lets through of the noise is averaged over few vertices. The rest, which is what it does to the
        shape, is a small difference of large numbers, and is averaged over many.
        """
        L, n = self.ops.L, self.probe.normals
        if L.size == 0:
            return np.zeros(len(result))
        moved = (self._scale(result - self.ops.surface.vertices) * n).sum(axis=1)
        through, rest = np.zeros(L.size), moved**2
        for z, again in zip(self.probe.draws.T, perturbed, strict=False):
            response = (self._scale(again - result) * n).sum(axis=1) / self.probe.step
            through += response**2 / len(perturbed)
            rest += (2 * z * response - z**2 - response**2) / len(perturbed)
        through, _, _ = walk(L, np.repeat(through[:, None], 3, axis=1), _STEPS_OF_NOISE).T
        rest, _, _ = walk(L, np.repeat(rest[:, None], 3, axis=1), _STEPS_OF_SHAPE).T
        error = np.sqrt(np.maximum(through + np.maximum(rest, 0.0), 0.0))
        return self.ops.spread(np.ldexp(error, self.ops.exponent))

    def _scale(self, D: Floats) -> Floats:
        """(k, 3) displacements of the active vertices in the units of the probe."""
        return np.asarray(np.ldexp(D[self.ops.active], -self.ops.exponent))


def prepare_probe(
    ops: Operators, *, noise: Noise | float | None = None, probes: int = _PROBES, seed: int = 0
) -> SurfaceProbe:
    """Prepare :func:`estimate_error` for one surface and any number of filters; parameters and errors are the same."""
    probes = check_count("probes", probes, 1, MAX_PROBES)
    seed = check_count("seed", seed, 0, MAX_SEED)
    ops = as_uniform(ops)
    check_extent(ops.exponent, LARGEST_EXPONENT, "risk, which is the square of an error")
    n = ops.L.size
    require(_BYTES_PER_DRAW * (probes + 2) * n, f"{probes} probes of {n} vertices")
    if n == 0:  # all vertices at one place
        nothing = Probe(np.empty((0, 3)), np.empty((0, probes)), 0.0, np.empty(0, dtype=np.bool_), _STEP)
        return SurfaceProbe(ops, nothing, Noise.zero(0.0))
    with blocks.one_blas_thread():
        found = estimate(ops, find_interior(ops))
        assumed = estimate_noise_of(ops) if noise is None else found.noise
        if assumed.local is not None:
            assumed = replace(assumed, local=ops.spread(assumed.local))
    if isinstance(noise, Noise):
        assumed = _check_noise(noise, ops.exponent, len(ops.surface.vertices))
    elif noise is not None:
        level = _check_level("noise", noise, ops.exponent)
        assumed = replace(
            assumed, level=level, low=level, high=level, kind=WHITE, covariance=np.eye(3), local=None, varies=False
        )
    draws = np.hstack([sample(ops.L, found.normals, assumed, seed + k) for k in range(0, probes, 3)])[:, :probes]
    if assumed.varies and assumed.local is not None and assumed.level > 0:
        draws *= (assumed.local[ops.active] / assumed.level)[:, None]
    probe = Probe(found.normals, draws, assumed.level, np.ones(n, dtype=np.bool_), _STEP)
    return SurfaceProbe(ops, probe, assumed.scaled(ops.exponent))


def _check_level(name: str, given: object, exponent: int) -> float:
    """A level of noise in mesh units, over the mesh's extent 2^exponent."""
    low, high = np.ldexp(NOISE_BOUNDS_IN_EXTENTS, exponent)
    what = f"a length from {low:.3g} to {high:.3g} in mesh units, or what estimate_noise returns"
    return float(np.ldexp(check_number(name, given, low, high, what), -exponent))


def _check_local(local: object, count: int) -> None:
    if not isinstance(local, np.ndarray) or local.dtype.kind != "f" or local.shape != (count,):
        raise InvalidParameter(f"noise.local is {show(local)}; it must have one level for each of {count} vertices")
    for i in np.flatnonzero(~((local >= 0) & np.isfinite(local)))[:1]:
        raise InvalidParameter(f"noise.local[{i}] is {local[i]}; levels are finite, and not negative")


def _check_noise(noise: Noise, exponent: int, count: int) -> Noise:
    """Noise in extents of the mesh; what a caller has changed in it must still be noise."""
    check_choice("noise.kind", noise.kind, KINDS)
    lengths = {
        name: np.ldexp(_check_level(f"noise.{name}", getattr(noise, name), exponent), exponent) for name in LENGTHS
    }
    check_number("noise.correlated_level", noise.correlated_level, 0.0, lengths["level"], "no more than the level")
    check_number("noise.impulse_density", noise.impulse_density, _MIN_DENSITY, 1.0)
    for name in ("kurtosis", "outliers"):
        check_number(f"noise.{name}", getattr(noise, name), -_LARGEST, _LARGEST)
    for name in LEVELS:
        levels = getattr(noise, name)
        if not isinstance(levels, tuple):
            raise InvalidParameter(f"noise.{name} is {show(levels)}; it must be a tuple of levels")
        for i, each in enumerate(levels):
            _check_level(f"noise.{name}[{i}]", each, exponent)
    if noise.local is not None:
        _check_local(noise.local, count)
    covariance = noise.covariance
    if not (isinstance(covariance, np.ndarray) and covariance.shape == (3, 3) and covariance.dtype.kind == "f"):
        raise InvalidParameter(f"noise.covariance is {show(covariance)}; it must be an array of floats of shape (3, 3)")
    if not (np.abs(covariance) <= _MAX_COVARIANCE).all():
        raise InvalidParameter(f"noise.covariance has an entry beyond {_MAX_COVARIANCE:g}; the level is its unit")
    return replace(noise, **lengths).scaled(-exponent)


def _apply(filter_: Callable[[Floats], npt.ArrayLike], V: Floats, largest: float) -> Floats:
    """What the filter makes of a copy of V, checked: no coordinate may move by more than the largest move."""
    try:
        given = np.asarray(filter_(V.copy()))
    except Exception as error:
        raise FilterFailed(f"the filter failed: {type(error).__name__}: {error}") from error
    if given.dtype.kind not in "fiu":
        raise FilterFailed(f"the filter returned dtype {given.dtype}; it must return real numbers")
    with np.errstate(over="ignore"):  # of long doubles
        result = np.array(given, dtype=np.float64)
    if result.shape != V.shape:
        raise FilterFailed(f"the filter returned shape {result.shape} for {V.shape}; it must move vertices only")
    if not np.isfinite(result).all():
        row = int(np.flatnonzero(~np.isfinite(result).all(axis=1))[0])
        raise FilterFailed(f"the filter returned a vertex that is not finite: row {row}, {result[row].tolist()}")
    with np.errstate(over="ignore"):
        far = np.abs(result - V) > largest
    if far.any():
        row = int(np.flatnonzero(far.any(axis=1))[0])
        raise FilterFailed(f"the filter moved a vertex by more than {largest:.0e}: row {row}, {result[row].tolist()}")
    return result

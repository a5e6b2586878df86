"""Noise, and the error of any filter, estimated from the noisy mesh alone."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from meshlab_specsmooth.adapters import Mesh, accept_meshes, recognize
from meshlab_specsmooth.arrays import Floats, Integers
from meshlab_specsmooth.describe import Described, Rows, format_length
from meshlab_specsmooth.errors import FilterFailed, InvalidParameter
from meshlab_specsmooth.geometry.surface import LARGEST_EXPONENT, Surface, check_extent
from meshlab_specsmooth.noise.estimate import (
    KINDS,
    WHITE,
    Noise,
    measure,
    nothing,
    realization,
    sheet,
)
from meshlab_specsmooth.noise.outliers import replace_outliers
from meshlab_specsmooth.noise.parts import estimate_level
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
from meshlab_specsmooth.runtime import blocks
from meshlab_specsmooth.runtime.memory import require
from meshlab_specsmooth.smoothing.api import Prepared, assemble

# How far the probe moves vertices, as a share of the noise: small enough for a difference quotient, large enough for
# filters that stop iterating at some tolerance
_SHARE = 0.05

_PROBES = 4

# A variance of impulses is that of all vertices over the share of those that have noise, and that of one direction
# nine times the mean at most; both have room to spare
_LEAST_HIT, _LARGEST_COVARIANCE = 1e-9, 1e9

_LARGEST = float(np.finfo(np.float64).max)

# Of 2, of the largest move of a filter in extents of the mesh: beyond, squares of its error are no numbers
_LARGEST_MOVE_EXPONENT = 400

# Draws of the noise take so much a vertex and probe: themselves, and a surface that is perturbed by them
_BYTES_PER_DRAW = 32


@accept_meshes
def estimate_noise(mesh: Mesh, faces: npt.ArrayLike | None = None) -> Noise:
    """How much noise a surface has along its normals, in mesh units, and of what kind.

    The median of the normal component of L^2 V, and levels at other scales to tell kinds apart (see :class:`Noise`).
    White noise between 0.05 and 0.5 edges is found to a few per cent where the mesh resolves its shape; fine detail
    counts as noise, so that a coarse model of a curved shape has some. Large meshes are judged by patches, the same for
    any order of vertices and faces. Of components of unlike scale or noise, the largest is measured. Where the
    triangles are too uneven, too coarse or too few, the kind is ``"unclear"``.

    Parameters
    ----------
    mesh : (n, 3) real array, or a mesh of any kind
        Vertices, in mesh units.
    faces : (m, 3) integer array, optional
        As for :func:`meshlab_specsmooth.smooth`.

    Raises
    ------
    InvalidSurface
        The arrays are no triangle mesh.

    Examples
    --------
    >>> import meshlab_specsmooth as mss
    >>> corners = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]
    >>> mss.estimate_noise(corners, [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]]).kind  # too few to tell
    'unclear'
    """
    source = recognize(mesh, faces)
    made = assemble(source.vertices, source.faces, "uniform")
    with blocks.one_blas_thread():
        return noise_of(made).scaled(made.exponent)


def noise_of(mesh: Prepared) -> Noise:
    """The noise of a mesh with the uniform Laplacian, in extents of the mesh: the same wherever a level is stated."""
    if mesh.L.size == 0:
        return nothing(0.0)
    rim = None if mesh.rim is None else mesh.rim.vertices
    positions, _ = replace_outliers(mesh.positions, mesh.L, rim)
    return estimate_level(positions, mesh.faces, mesh.L)


@dataclass(frozen=True, eq=False, repr=False)
class ErrorEstimate(Described):
    """What a filter is expected to have left of error, along the normals.

    Attributes
    ----------
    error : float
        Root mean square, in mesh units; 0 where the estimated risk is negative, as it may be by chance.
    risk : float
        Mean square, in squared mesh units: unbiased for white noise of the level taken.
    standard_error : float
        Of the risk, from the scatter of the probes; it does not cover an error of the noise level.
    noise : Noise
        That was taken.
    probes : int
    vertices : (n, 3) float64
        What the filter made of the surface.
    risks : tuple of float
        By each probe, NaN where one was left out. Of two filters that had the same probes, the difference is known
        better than either.
    """

    error: float
    risk: float
    standard_error: float
    noise: Noise
    probes: int
    vertices: Floats
    risks: tuple[float, ...] = ()

    @property
    def summary(self) -> str:
        """The error and the noise in a few words."""
        return f"estimated error {self.noise.format_error(self.error)} edges; {self.noise.summary}"

    def rows(self) -> Rows:
        """What was found and done, and how far vertices moved."""
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
    filter: Callable[[Floats], npt.ArrayLike],  # noqa: A002 (it is what it is)
    mesh: Mesh,
    faces: npt.ArrayLike | None = None,
    *,
    noise: Noise | float | None = None,
    probes: int = _PROBES,
    seed: int = 0,
) -> ErrorEstimate:
    """The error of any filter on a surface, without the truth to compare with.

    Stein's unbiased risk estimate in its Monte-Carlo form (Ramani, Blu, Unser 2008), along the normals n of a
    smoothed guide: with draws z of the noise and a small e,

        risk = mean (n . (f(V) - V))^2 - mean z^2 + 2 mean z n . (f(V + e z n) - f(V)) / e.

    So it takes as many runs of the filter as there are probes, and one. Filters that are compared should be given the
    same noise and seed: then most of the scatter cancels. It says which of several filters is best for white noise;
    impulses and noise that neighbors share are beyond it for filters that are not linear.

    Parameters
    ----------
    filter : callable
        From (n, 3) vertices to (n, 3) vertices; it gets a copy each time, and must be deterministic.
    mesh : (n, 3) real array, or a mesh of any kind
        Vertices, in mesh units.
    faces : (m, 3) integer array, optional
        As for :func:`meshlab_specsmooth.smooth`.
    noise : Noise or float, optional
        What to take for noise; a number is the level of white noise, in mesh units. Measured by default.
    probes : int
        Random perturbations, 1 or more.
    seed : int

    Raises
    ------
    InvalidSurface
        The arrays are no triangle mesh.
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
    source = recognize(mesh, faces)
    prepared = prepare_error(source.vertices, source.faces, noise=noise, probes=probes, seed=seed)
    perturbed = prepared.perturbed() if prepared.draws.any() else []
    V = prepared.surface.vertices
    largest = float(np.ldexp(1.0, min(LARGEST_EXPONENT, _LARGEST_MOVE_EXPONENT + prepared.exponent)))
    return prepared.estimate(_applied(filter, V, largest), [_applied(filter, X, largest) for X in perturbed])


@dataclass(frozen=True, eq=False)
class PreparedError:
    """What the estimates of all filters on one surface share: prepare once, ask for many; the caller runs the filters.

    Attributes
    ----------
    surface : Surface
        As given.
    moving : (k,) int32
        Vertices that have an edge: the others have no say.
    normals : (k, 3) float64
        Of a smoothed guide, at these.
    draws : (k, p) float64
        Of the noise along the normals, one column a probe, in units of 2^exponent of the mesh's.
    level : float
        Of the noise, in the same units.
    exponent : int
    noise : Noise
        That is taken, in mesh units.
    """

    surface: Surface
    moving: Integers
    normals: Floats
    draws: Floats
    level: float
    exponent: int
    noise: Noise

    def perturbed(self) -> list[Floats]:
        """What the filter is to be run on besides the surface itself: (n, 3) vertices for each probe."""
        surfaces = []
        for z in self.draws.T:
            X = self.surface.vertices.copy()
            X[self.moving] += np.ldexp(_SHARE * z[:, None] * self.normals, self.exponent)
            surfaces.append(X)
        return surfaces

    def along_normals(self, X: Floats, Y: Floats) -> Floats:
        """(k,) n . (Y - X) at the moving vertices, in mesh units, for (n, 3) vertices X and Y."""
        return np.asarray(((Y[self.moving] - X[self.moving]) * self.normals).sum(axis=1))

    def estimate(self, result: Floats, perturbed: Sequence[Floats | None]) -> ErrorEstimate:
        """The estimate for a filter that made ``result`` of the surface.

        Parameters
        ----------
        result : (n, 3) float64
        perturbed : sequence of (n, 3) float64
            What it made of :meth:`perturbed`, or of the first few, None for those that are to be left out; an empty
            sequence where there is no noise.
        """
        moved = float((self._scaled(self.surface.vertices, result) ** 2).mean()) if len(self.moving) else 0.0
        risks = []
        for i, z in enumerate(self.draws.T[: max(len(perturbed), 1)]):
            again = perturbed[i] if i < len(perturbed) else result
            if again is None:
                risks.append(np.nan)
                continue
            kept = float((z * self._scaled(result, again)).mean()) / _SHARE if len(z) else 0.0
            # the level is known better than that of a draw
            square = float((z**2).mean()) if len(z) else 0.0
            risks.append(moved + (self.level**2 / square if square > 0 else 0.0) * (2 * kept - square))
        used = [risk for risk in risks if np.isfinite(risk)]
        risk, probes, unit = float(np.mean(used)) if used else float("nan"), len(used), self.exponent
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

    def _scaled(self, X: Floats, Y: Floats) -> Floats:
        """N . (Y - X), in the units of the draws."""
        return np.asarray((np.ldexp(Y[self.moving] - X[self.moving], -self.exponent) * self.normals).sum(axis=1))


def prepare_error(
    vertices: npt.ArrayLike,
    faces: npt.ArrayLike,
    *,
    noise: Noise | float | None = None,
    probes: int = _PROBES,
    seed: int = 0,
) -> PreparedError:
    """What :func:`estimate_error` needs of a surface, whatever the filter; parameters and errors are the same."""
    probes = check_count("probes", probes, 1, MAX_PROBES)
    seed = check_count("seed", seed, 0, MAX_SEED)
    mesh = assemble(vertices, faces, "uniform")
    check_extent(mesh.exponent, LARGEST_EXPONENT, "risk, which is the square of an error")
    require(_BYTES_PER_DRAW * (probes + 2) * mesh.L.size, f"{probes} probes of {mesh.L.size} vertices")
    if mesh.L.size == 0:  # all vertices at one place
        nowhere = np.empty((0, 3))
        return PreparedError(
            mesh.surface, mesh.moving, nowhere, np.empty((0, probes)), 0.0, mesh.exponent, nothing(0.0)
        )
    on = sheet(mesh.positions, mesh.faces)
    with blocks.one_blas_thread():
        found = measure(on)
        measured = noise_of(mesh) if noise is None else found.noise
    taken, n = measured, found.normals
    if isinstance(noise, Noise):
        taken = _checked(noise, mesh.exponent)
    elif noise is not None:
        level = _level("noise", noise, mesh.exponent)
        taken = replace(taken, level=level, low=level, high=level, kind=WHITE, covariance=np.eye(3))
    draws = np.hstack([realization(on, n, taken, seed + k) for k in range(0, probes, 3)])[:, :probes]
    return PreparedError(mesh.surface, mesh.moving, n, draws, taken.level, mesh.exponent, taken.scaled(mesh.exponent))


def _level(name: str, given: object, exponent: int) -> float:
    """A level of noise in mesh units, over the mesh's extent 2^exponent."""
    low, high = np.ldexp(NOISE_BOUNDS_IN_EXTENTS, exponent)
    what = f"a length from {low:.3g} to {high:.3g} in mesh units, or what estimate_noise returns"
    return float(np.ldexp(check_number(name, given, low, high, what), -exponent))


def _checked(noise: Noise, exponent: int) -> Noise:
    """Noise in extents of the mesh; what a caller has changed in it must still be noise."""
    check_choice("noise.kind", noise.kind, KINDS)
    lengths = {
        name: np.ldexp(_level(f"noise.{name}", getattr(noise, name), exponent), exponent)
        for name in ("level", "low", "high", "shared", "mean_edge")
    }
    check_number("noise.shared", noise.shared, 0.0, lengths["level"], "no more than the level")
    check_number("noise.hit", noise.hit, _LEAST_HIT, 1.0)
    for name in ("kurtosis", "outliers"):
        check_number(f"noise.{name}", getattr(noise, name), -_LARGEST, _LARGEST)
    for name in ("orders", "bands"):
        levels = getattr(noise, name)
        if not isinstance(levels, tuple):
            raise InvalidParameter(f"noise.{name} is {show(levels)}; it must be a tuple of levels")
        for i, each in enumerate(levels):
            _level(f"noise.{name}[{i}]", each, exponent)
    covariance = noise.covariance
    if not (isinstance(covariance, np.ndarray) and covariance.shape == (3, 3) and covariance.dtype.kind == "f"):
        raise InvalidParameter(f"noise.covariance is {show(covariance)}; it must be an array of floats of shape (3, 3)")
    if not (np.abs(covariance) <= _LARGEST_COVARIANCE).all():
        raise InvalidParameter(f"noise.covariance has an entry beyond {_LARGEST_COVARIANCE:g}; the level is its unit")
    return replace(noise, **lengths).scaled(-exponent)


def _applied(filter_: Callable[[Floats], npt.ArrayLike], V: Floats, largest: float) -> Floats:
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

"""The setting of least estimated error: how firmly the barycenters are to be held, without the truth to compare with.

Stein's unbiased risk estimate (1981) along the normals n of a smoothed guide: for noise z along them and a linear
filter H,

    risk = mean (n . (H V - V))^2 - mean z^2 + 2 mean z . H z,

where z are seeded draws of noise of the kind that was measured, so that the last term, the trace of H times the noise's
covariance, costs one run of the filter a setting (Girard 1989; Ramani, Blu, Unser 2008). It holds for colored noise
and for noise of any distribution.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from meshlab_specsmooth.arrays import Booleans, Floats, Integers
from meshlab_specsmooth.graph.laplacian import Laplacian
from meshlab_specsmooth.noise.estimate import (
    IMPULSE,
    LEAST_WEIGHT,
    MOST_WEIGHT,
    OFF,
    Measured,
    Noise,
    Sheet,
    measure,
    normals,
    realization,
    rebuilt,
    sheet,
    weight_for,
)
from meshlab_specsmooth.operators.laplacians import Gram
from meshlab_specsmooth.operators.patches import draw_sample
from meshlab_specsmooth.operators.reconstruction import error_gain
from meshlab_specsmooth.runtime.progress import Progress, announce, subrange
from meshlab_specsmooth.spectral.design import design
from meshlab_specsmooth.spectral.response import family_of

CRITERIA = ("position", "normals")

# Normals ask for more smoothing than positions do; as if the noise were this many times as high (measured)
_NORMALS = 1.4

# Weights are looked at in steps of this factor from the first guess, downhill, until the error rises; a parabola
# through the last three has the least
_FACTOR, _STEPS = 2.0, 7

# Of the time of a choice, the share that the measuring takes, and what each weight leaves of the rest
_MEASURING, _LEFT = 0.25, 0.75

# The low-pass is computed for weights down to the first guess over this, and to this share of the displacement
_FINEST, _TOLERANCE = 4.0, 2.5e-3

# The error is flat about its least, and that of normals still falls with the weight: of all weights whose error is
# within this share of the least, the lowest is taken
_ALIKE = 0.02

# Below this share of an edge there is nothing to choose for
_NOTHING = 0.002

# Smoothing shifts vertices along the surface, too, which mends the triangles that noise has disturbed. Where noise is
# below the first level, in edges, it has not disturbed any and the shift is left out; above the second all is kept.
_STILL, _SHIFTING = 0.03, 0.1

# The least squares take a time that grows as one over the weight. Up to so many vertices it is taken as low as the
# estimate has it; beyond, not below the first guess, which leaves a fifth to a third of the noise, in a second or two.
_LARGE = 100_000

# The robust pass: vertices are drawn to within the median distance of the surface that is smoothed from them, again
# and again; impulses lie far beyond the median. The weight is what keeps edges while the iterations spread.
_ROBUST_ITERATIONS = 15
_ROBUST_WEIGHT = 0.7


@dataclass(frozen=True, eq=False)
class Choice:
    """A setting, and why.

    Attributes
    ----------
    weight : float
        w of the least estimated error.
    risk : float
        Estimated mean square error along the normals at that weight, in squared units of the positions; it may turn out
        below zero where there is hardly an error.
    noise : Noise
        In the units of the positions.
    response : str
        Name of the response, of those that there were to choose from.
    """

    weight: float
    risk: float
    noise: Noise
    response: str

    @property
    def error(self) -> float:
        """Its root, in the units of the positions."""
        return float(np.sqrt(max(self.risk, 0.0)))


@dataclass(frozen=True)
class LowPass:
    """Step 2: the shape of the response, and the shortest wave that it keeps, in mean edges."""

    name: str
    shortest: float

    def removing(self, on: Sheet, weight: float) -> Callable[[Floats], Floats]:
        """(h(L) - 1) L X of X, as well as a reconstruction with a weight of ``weight`` or more sees it."""
        if self.shortest > 2 * np.sqrt(on.L.size):  # no wave fits on the mesh: only constants are kept
            return lambda X: -(on.L @ X)
        filter_ = design(
            on.L,
            family_of(self.name),
            wavelength=self.shortest,
            method="chebyshev",
            tolerance=_TOLERANCE,
            error_gain=lambda eigenvalues: error_gain(eigenvalues, weight),
        ).filter

        def removed(X: Floats) -> Floats:
            delta = on.L @ X
            return np.asarray(filter_.apply(on.L, delta) - delta)

        return removed


def choose(
    positions: Floats,
    faces: Integers,
    L: Laplacian,
    criterion: str,
    responses: Sequence[str],
    shortest: float,
    counted: Booleans | None = None,
    progress: Progress | None = None,
) -> Choice:
    """The barycenter weight, and the response, of least estimated error.

    Parameters
    ----------
    positions : (k, 3) float64
    faces : (m, 3) int32
    L : Laplacian
        Of the mesh; its graph is walked for patches.
    criterion : {"position", "normals"}
        Whose error is to be small.
    responses : sequence of str
        To choose from; of a large mesh the first is taken.
    shortest : float
        The shortest wave that the low-pass keeps, in mean edges.
    counted : (k,) bool, optional
        Vertices that have a say, where these are enough; all by default.
    progress : callable, optional
        Called with the fraction done; how many weights will be looked at is not known before.
    """
    announce(progress, "measuring noise")
    on = part_of(positions, faces, L, counted)
    measured = measure(on)
    if progress is not None:
        progress(_MEASURING)
    announce(progress, "choosing")
    is_large = len(positions) > _LARGE
    noise = measured.noise
    if noise.is_left_alone:
        return Choice(MOST_WEIGHT, max(noise.level, noise.resolution) ** 2, noise, responses[0])
    if noise.kind == IMPULSE:
        on = sheet(robust(on.positions, on.faces, on.L, on.gram), on.faces)
        measured = measure(on)
    low_passes = [LowPass(name, shortest) for name in (responses[:1] if is_large else responses)]
    share = (1 - _MEASURING) / len(low_passes)
    choices = [
        choose_on(on, measured, criterion, low_pass, is_large, subrange(progress, _MEASURING + i * share, share))
        for i, low_pass in enumerate(low_passes)
    ]
    return replace(min(choices, key=lambda choice: choice.risk), noise=noise)


def choose_on(
    on: Sheet,
    measured: Measured,
    criterion: str,
    low_pass: LowPass,
    is_large: bool = False,
    progress: Progress | None = None,
) -> Choice:
    """The same for a sheet whose noise is known, which stands for a large mesh or not."""
    found, n = measured.noise, measured.normals
    if found.level <= _NOTHING * on.mean_edge:
        return Choice(weight_for(0.0), found.level**2, found, low_pass.name)
    z = realization(on, n, found) * (_NORMALS if criterion == "normals" else 1.0)
    inner = on.inner
    energy = float((z[inner] ** 2).mean())

    guess = weight_for(found.level / on.mean_edge)
    lowest = max(guess / _FINEST, LEAST_WEIGHT)
    least_weight = max(guess / (_NORMALS if criterion == "normals" else 1.0), lowest) if is_large else LEAST_WEIGHT
    removed = low_pass.removing(on, lowest)
    of_shape, of_noise = removed(on.positions), removed(z)
    looked_at = itertools.count(1)

    def risk(log_weight: float) -> float:
        weight = float(np.exp(log_weight))
        shape = rebuilt(on.L, on.gram, on.positions, weight, of_shape, OFF)
        noise = rebuilt(on.L, on.gram, z, weight, of_noise, OFF)
        moved = ((shape - on.positions) * n).sum(axis=1)[inner]
        if progress is not None:
            progress(1 - _LEFT ** next(looked_at))
        return float((moved**2).mean()) - energy + 2 * float((z * noise)[inner].mean())

    log_weight, least = _least(risk, float(np.log(guess)), _ALIKE if criterion == "position" else 0.0, least_weight)
    weight = float(np.clip(np.exp(log_weight), least_weight, MOST_WEIGHT))
    return Choice(weight, least, found, low_pass.name)


def _least(risk: Callable[[float], float], start: float, alike: float, lowest: float) -> tuple[float, float]:
    """The lowest argument whose root is within a share of the least, and the least, near ``start``."""
    step = float(np.log(_FACTOR))
    x = [start - step, start, start + step]
    y = [risk(at) for at in x]
    for _ in range(_STEPS):
        if y[1] <= min(y) or not np.log(lowest) < x[0] < x[2] < np.log(MOST_WEIGHT):
            break
        if y[0] < y[2]:
            x = [x[0] - step, *x[:2]]
            y = [risk(x[0]), *y[:2]]
        else:
            x = [*x[1:], x[2] + step]
            y = [*y[1:], risk(x[2])]
    curvature, slope = (y[0] - 2 * y[1] + y[2]) / 2, (y[2] - y[0]) / 2
    if y[1] > min(y) or not curvature > 0:
        at = int(np.argmin(y))
        return x[at], y[at]
    least = y[1] - slope**2 / (4 * curvature)
    lower = np.sqrt(((1 + alike) ** 2 - 1) * max(least, 0.0) / curvature)
    return x[1] + step * float(-slope / (2 * curvature) - min(lower, 0.5)), least


def robust(X: Floats, F: Integers, L: Laplacian, gram: Gram) -> Floats:
    """(k, 3) positions with impulses drawn in: Huber's estimate of the surface by half-quadratic steps.

    Each step smooths, and replaces what lies farther from the smooth surface than the median does, along the normals,
    by a point at that distance.
    """
    Y, drawn = rebuilt(L, gram, X, _ROBUST_WEIGHT), X
    for _ in range(_ROBUST_ITERATIONS):
        n = normals(Y, F)
        off = ((X - Y) * n).sum(axis=1)
        near = np.median(np.abs(off))
        drawn = Y + n * np.clip(off, -near, near)[:, None]
        Y = rebuilt(L, gram, drawn, _ROBUST_WEIGHT)
    return drawn


def across_the_rim(X: Floats, F: Integers, L: Laplacian, gram: Gram, rim: Integers, weight: float) -> Floats:
    """(k, 3) positions whose rim has moved as smoothing moves it, but across the surface only: it does not creep."""
    Y = rebuilt(L, gram, X, weight)
    n = normals(Y, F)[rim]
    moved = X.copy()
    moved[rim] += n * ((Y - X)[rim] * n).sum(axis=1)[:, None]
    return moved


def without_drift(displacement: Floats, X: Floats, F: Integers, noise: Noise) -> Floats:
    """The displacement of X, less what is along the surface where the noise is too low to ask for that."""
    n = normals(X + displacement, F)
    across = n * (displacement * n).sum(axis=1)[:, None]
    return np.asarray(across + drifting(noise) * (displacement - across))


def drifts(noise: Noise) -> bool:
    """Whether :func:`without_drift` takes anything away."""
    return drifting(noise) < 1.0


def drifting(noise: Noise) -> float:
    """The share of what is along the surface that the noise asks for."""
    level = noise.level / noise.mean_edge if noise.mean_edge else 0.0
    return float(np.clip((level - _STILL) / (_SHIFTING - _STILL), 0.0, 1.0))


def part_of(positions: Floats, faces: Integers, L: Laplacian, counted: Booleans | None = None) -> Sheet:
    """The mesh, or connected patches that stand for it where it is large; the same for any order of its vertices.

    What is not ``counted``, (k,) bool, has no say where enough is left.
    """
    sample = draw_sample(positions, faces, L, counted)
    at = sample.vertices
    return sheet(positions[at], sample.faces, None if counted is None else counted[at])

"""The choice: the setting of least estimated error (Stein 1981; by Monte Carlo: Ramani, Blu, Unser 2008).

For noise of standard deviation s along the normals n and a probe b = n z with a draw z of noise of the same kind,

    risk = mean (n . (f(V) - V))^2 - s^2 + 2 mean b . (f(V + e b) - f(V)) / e.
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field

import numpy as np

from meshlab_specsmooth.arrays import Floats
from meshlab_specsmooth.edge_aware.filtering import iterate
from meshlab_specsmooth.edge_aware.mesh import Mesh, smooth_automatically, smooth_isotropically
from meshlab_specsmooth.edge_aware.result import CLIPPED, Setting
from meshlab_specsmooth.noise.estimate import STRENGTH, Measured, Sheet, realization
from meshlab_specsmooth.runtime.progress import Progress

# A probe of half the noise's size, where every vertex has some already: the filter's response is then averaged over
# what the noise may be; an infinitesimal one sees one realization only. Where few vertices have noise it must be of the
# full size: half impulses are smoothed away where whole ones are taken for features.
_FULL, _LESS_WHERE_HIT = 1.0, 0.5
_SEED = 5
_MAX_ITERATIONS = 6
# The guide's weight suits noise alone; where the shape has short waves too, it is held more firmly.
_FIRMER = 1.4
_LEAST_WEIGHT, _MOST_WEIGHT = 0.12, 1.0
# Where the search starts: hard and soft, sharp and organic; start, strength, range sigma, weight by the guide's
_COARSE = (
    ("given", 0.4, 0.35, 1.0),
    ("given", 2.0, 0.2, 1.0),
    ("given", 2.0, 0.35, 1.0),
    ("smoothed", 0.1, 0.4, 1.0),
    ("smoothed", 0.1, 0.4, _FIRMER),
    ("smoothed", 0.4, 0.28, 1.0),
)
# How far the neighbors are that are looked at next: of strengths, of range sigmas
_RATIOS = ((2.0, 2**0.5), (2.0, 2**0.5), (2**0.5, 2**0.25))
# Where the search ends: below, a pass changes nothing; above, one pass flattens what a ring of faces spans.
_STRENGTHS = (0.02, 8.0)
# Normals of neighbors are 0.14 apart on a surface that turns by 8 degrees an edge; 1 is 60 degrees.
_RANGE_SIGMAS = (0.14, 1.0)

# The error is flat about its least: of settings whose error is within this share of it, the one that lets the least
# noise through is taken, as normals still gain.
_ALIKE = 0.01

_Key = tuple[str, float, float, float]  # start, strength, range sigma, weight


@dataclass(frozen=True)
class Row:
    """A setting, its estimated mean squared error along the normals, and the noise it lets through, the trace of it.

    Both in squared mean edges.
    """

    setting: Setting
    error: float
    through: float = 0.0


@dataclass(frozen=True)
class Fixed:
    """What the caller has set."""

    strength: float | None = None
    range_sigma: float | None = None
    iterations: int | None = None
    start: str = "auto"
    barycenter_weight: float | None = None

    def setting(self, weight: float) -> Setting | None:
        """The setting, if nothing is left to be chosen."""
        if self.strength is None or self.range_sigma is None or self.iterations is None:
            return None
        start = "given" if self.start == "auto" else self.start
        return Setting(start, self.strength, self.range_sigma, self.iterations, self.barycenter_weight or weight)

    def key(self, start: str, strength: float, range_sigma: float, weight: float) -> _Key:
        """These, but for what is given."""
        return (
            start if self.start == "auto" else self.start,
            self.strength or strength,
            self.range_sigma or range_sigma,
            self.barycenter_weight or weight,
        )


def guide_weight(level: float) -> float:
    """Barycenter weight of the isotropic guide for noise of a level in mean edges: 0.07 / level, in [0.12, 1]."""
    return float(np.clip(STRENGTH / level, _LEAST_WEIGHT, _MOST_WEIGHT)) if level > 0 else _MOST_WEIGHT


@dataclass(frozen=True, eq=False)
class Estimate:
    """What the estimate of a setting's error needs: positions and guides with and without the probe."""

    mesh: Mesh
    level: float
    normals: Floats
    given: tuple[Floats, Floats]
    probe: Floats
    size: float
    guides: dict[float, list[Floats]] = field(default_factory=dict)

    def smoothed(self, weight: float) -> list[Floats]:
        """The isotropically smoothed positions, with and without the probe; computed once for a weight."""
        if weight not in self.guides:
            self.guides[weight] = [smooth_isotropically(self.mesh, V, weight) for V in self.given]
        return self.guides[weight]

    def row(self, setting: Setting, plain: Floats, probed: Floats) -> Row:
        """Of what the setting makes of the positions without and with the probe."""
        at = self.mesh.counts
        moved = ((plain - self.mesh.V) * self.normals).sum(axis=1)[at]
        response = (self.probe * (probed - plain)).sum(axis=1)[at]
        variance = ((self.probe * self.normals).sum(axis=1) ** 2)[at].mean()
        # the drawn noise's own variance stands for the expected one: the error of doing nothing is then estimated
        # without scatter
        gain = self.level**2 / variance if variance > 0 else 0.0
        through = float(gain * response.mean() / self.size)
        return Row(setting, float((moved**2).mean()) - self.level**2 + 2 * through, through)

    def path(self, key: _Key, iterations: int | None) -> list[Row]:
        """Errors after 1, 2, ... iterations, until they rise; or of the given number of iterations alone."""
        start, strength, range_sigma, weight = key
        with ThreadPoolExecutor(2) as pool:
            walks = [
                iterate(self.mesh, given, smoothed, start, strength, range_sigma)
                for given, smoothed in zip(self.given, self.smoothed(weight), strict=True)
            ]
            found: list[Row] = []
            for count in range(1, (iterations or _MAX_ITERATIONS) + 1):
                plain, probed = pool.map(next, walks)
                if iterations is not None and count < iterations:
                    continue
                found.append(self.row(Setting(start, strength, range_sigma, count, weight), plain, probed))
                if len(found) > 2 and found[-1].error > found[-2].error > found[-3].error:
                    break
        return found


def clip_impulses_first(on: Estimate, criterion: str) -> Row:
    """The row of the isotropic filter that draws impulses in first."""
    plain, probed = (smooth_automatically(on.mesh, V, criterion) for V in on.given)
    setting = Setting(CLIPPED, 0.0, 0.0, 0, plain.barycenter_weight)
    return on.row(setting, plain.vertices, probed.vertices)


def estimate_on(mesh: Mesh, on: Sheet, measured: Measured, factor: float) -> Estimate:
    """For noise of ``factor`` times what was measured of the mesh."""
    n, noise = measured.normals, measured.noise
    probe = factor * n * realization(on, n, noise, _SEED)[:, :1]
    size = _FULL - _LESS_WHERE_HIT * noise.hit
    return Estimate(mesh, factor * noise.level, n, (mesh.V, mesh.V + size * probe), probe, size)


def searched(on: Estimate, fixed: Fixed, with_isotropic: bool, progress: Progress | None) -> list[Row]:
    """Settings and errors: coarse, then the neighbors of the best as long as they are better."""
    found: dict[_Key, list[Row]] = {}

    def look(key: _Key) -> float:
        if key not in found:
            found[key] = on.path(key, fixed.iterations)
            if progress is not None:
                progress(1 - 0.9 ** len(found))  # how many there will be is not known
        return min(row.error for row in found[key])

    weight = guide_weight(on.level)
    best = min((fixed.key(start, t, width, weight * firmer) for start, t, width, firmer in _COARSE), key=look)
    for ratios in _RATIOS:
        best = min([best, *_around(best, fixed, *ratios)], key=look)
    rows = [row for path in found.values() for row in path]
    if with_isotropic:
        weights = (weight / _FIRMER, weight, weight * _FIRMER)
        rows += [on.row(Setting("smoothed", 0.0, 0.0, 0, w), *on.smoothed(w)) for w in weights]
    return rows


def ranked(rows: list[Row], alike: bool) -> list[Row]:
    """The choice, then from the least error on; ``alike``: whether the choice may have a slightly higher one."""
    rows = sorted(rows, key=lambda row: row.error)
    least = rows[0].error
    enough = least + ((1 + _ALIKE) ** 2 - 1) * max(least, 0.0) if alike else least
    choice = min((row for row in rows if row.error <= enough), key=lambda row: row.through)
    return [choice, *(row for row in rows if row is not choice)]


def _around(key: _Key, fixed: Fixed, ratio_t: float, ratio_width: float) -> list[_Key]:
    """The neighbors of a setting, so far as they are not given."""
    start, t, width, weight = key
    around = []
    if fixed.strength is None:
        around += [(start, x, width, weight) for x in (t * ratio_t, t / ratio_t) if _within(_STRENGTHS, x)]
    if fixed.range_sigma is None:
        widths = (width * ratio_width, width / ratio_width)
        around += [(start, t, x, weight) for x in widths if _within(_RANGE_SIGMAS, x)]
    return around


def _within(bounds: tuple[float, float], x: float) -> bool:
    return bounds[0] <= x <= bounds[1]

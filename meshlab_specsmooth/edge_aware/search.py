"""The choice: the setting of least estimated error (see :mod:`meshlab_specsmooth.risk.sure`)."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field

import numpy as np

from meshlab_specsmooth.arrays import Floats
from meshlab_specsmooth.edge_aware.filter import iterate
from meshlab_specsmooth.edge_aware.operators import FaceOperators, smooth_automatically, smooth_isotropically
from meshlab_specsmooth.edge_aware.settings import CLIPPED, GIVEN, SMOOTHED, EdgeAware
from meshlab_specsmooth.graph.laplacian import Laplacian
from meshlab_specsmooth.noise.estimate import WEIGHT_TIMES_LEVEL, NoiseEstimate
from meshlab_specsmooth.noise.sample import sample
from meshlab_specsmooth.risk.sure import Probe
from meshlab_specsmooth.runtime.progress import Progress

# Step of the probe: half of the noise's size where every vertex has some already, so that the response is averaged over
# what the noise may be; an infinitesimal step sees one realization only. Where few vertices have noise it must be of
# the full size: half impulses are smoothed away where whole ones are taken for features.
# docs/constants.md: _FULL_STEP, _LESS_BY_DENSITY
_FULL_STEP, _LESS_BY_DENSITY = 1.0, 0.5
_SEED = 5
# Numbers of iterations that are evaluated.
_COUNTS, _MORE = (1, 2, 3, 4, 6, 8, 11), (15, 21, 30)

# The guide's weight suits noise alone; where the shape has short waves too, it is held more firmly.
# docs/constants.md: _FIRMER
_FIRMER = 1.4
# docs/constants.md: _MIN_GUIDE_WEIGHT, _MAX_GUIDE_WEIGHT
_MIN_GUIDE_WEIGHT, _MAX_GUIDE_WEIGHT = 0.12, 1.0

# Where the search starts: hard and soft, sharp and organic; start, strength, range sigma, weight by the guide's.
# docs/constants.md: _COARSE
_COARSE = (
    (GIVEN, 0.4, 0.35, 1.0),
    (GIVEN, 2.0, 0.2, 1.0),
    (GIVEN, 2.0, 0.35, 1.0),
    (GIVEN, 2.0, 0.08, 1.0),
    (SMOOTHED, 0.1, 0.4, 1.0),
    (SMOOTHED, 0.1, 0.4, _FIRMER),
    (SMOOTHED, 0.4, 0.28, 1.0),
)

# Distance to the neighbors that are evaluated next: of strengths, of range sigmas.
_RATIOS = ((2.0, 2**0.5), (2.0, 2**0.5), (2**0.5, 2**0.25))

# Where the search ends: below, an iteration changes nothing; above, one flattens what a ring of faces spans.
# docs/constants.md: _STRENGTHS
_STRENGTHS = (0.02, 8.0)
# Normals of neighbors are 0.14 apart on a surface that turns by 8 degrees an edge; 1 is 60 degrees.
# docs/constants.md: _RANGE_SIGMAS
_RANGE_SIGMAS = (0.05, 1.0)

# The error is flat about its minimum: of settings whose error is within this fraction of it, the one that lets the
# least noise through is taken, as normals still gain.
# docs/constants.md: _RISK_TOLERANCE
_RISK_TOLERANCE = 0.01

# Neighbors of a setting reduce the error by less than this factor.
_FAR_BETTER = 0.8

_Key = tuple[str, float, float, float]  # start, strength, range sigma, weight


@dataclass(frozen=True)
class Candidate:
    """A setting, its risk, and the divergence: the noise that it lets through. Both in squared mean edges."""

    setting: EdgeAware
    risk: float
    divergence: float = 0.0


def guide_weight(level: float) -> float:
    """Barycenter weight of the isotropic guide for noise of a level in mean edges: 0.07 / level, in [0.12, 1]."""
    if level <= 0:
        return _MAX_GUIDE_WEIGHT
    return float(np.clip(WEIGHT_TIMES_LEVEL / level, _MIN_GUIDE_WEIGHT, _MAX_GUIDE_WEIGHT))


@dataclass(frozen=True, eq=False)
class Search:
    """The mesh that is searched on, with and without the probe.

    Attributes
    ----------
    mesh : FaceOperators
    probe : Probe
    positions : tuple of two (n, 3) float64
        Without and with the probe.
    guides : dict
        Cache: for a weight the isotropically smoothed positions.
    """

    mesh: FaceOperators
    probe: Probe
    positions: tuple[Floats, Floats]
    guides: dict[float, list[Floats]] = field(default_factory=dict)

    def smooth(self, weight: float) -> list[Floats]:
        """The isotropically smoothed positions, without and with the probe."""
        if weight not in self.guides:
            self.guides[weight] = [smooth_isotropically(self.mesh, V, weight) for V in self.positions]
        return self.guides[weight]

    def evaluate(self, setting: EdgeAware, plain: Floats, probed: Floats) -> Candidate:
        """Risk and divergence by what the setting makes of the positions without and with the probe."""
        return Candidate(setting, *self.probe.estimate(plain - self.mesh.V, probed - plain))

    def follow(self, key: _Key, counts: tuple[int, ...]) -> list[Candidate]:
        """The setting with these numbers of iterations, until the risk rises."""
        start, strength, range_sigma, weight = key
        with ThreadPoolExecutor(2) as pool:
            walks = [
                iterate(self.mesh, given, smoothed, start, strength, range_sigma, self.mesh.is_exact)
                for given, smoothed in zip(self.positions, self.smooth(weight), strict=True)
            ]
            found: list[Candidate] = []
            for count in range(1, counts[-1] + 1):
                plain, probed = pool.map(next, walks)
                if count not in counts:
                    continue
                setting = EdgeAware(
                    strength=strength, range_sigma=range_sigma, iterations=count, start=start, barycenter_weight=weight
                )
                found.append(self.evaluate(setting, plain, probed))
                if len(found) > 2 and found[-1].risk > found[-2].risk > found[-3].risk:
                    break
        return found


def evaluate_clipped(search: Search) -> Candidate:
    """The isotropic filter that clips impulses first."""
    plain, probed = (smooth_automatically(search.mesh, V) for V in search.positions)
    setting = EdgeAware(iterations=0, start=CLIPPED, barycenter_weight=float(np.median(plain.barycenter_weight)))
    return search.evaluate(setting, plain.vertices, probed.vertices)


def prepare_search(mesh: FaceOperators, L: Laplacian, found: NoiseEstimate) -> Search:
    """For measured noise; ``L`` is the uniform Laplacian of the mesh."""
    n, noise = found.normals, found.noise
    draws = sample(L, n, noise, _SEED)[:, :1]
    step = _FULL_STEP - _LESS_BY_DENSITY * noise.impulse_density
    probe = Probe(n, draws, noise.level, mesh.counted, step)
    return Search(mesh, probe, (mesh.V, probe.perturb(mesh.V)[0]))


def search_settings(
    search: Search,
    given: EdgeAware,
    with_isotropic: bool,
    isotropic: Candidate | None,
    progress: Progress | None,
    is_large: bool = False,
) -> list[Candidate]:
    """Evaluate settings: coarse ones, then the neighbors of the best as long as they are better.

    ``isotropic`` is the isotropic filter's own choice; where it is better by far, the neighbors are not evaluated.
    ``is_large``: whether the mesh is so large that many iterations take too long.
    """
    found: dict[_Key, list[Candidate]] = {}

    def evaluate(key: _Key, counts: tuple[int, ...] = _COUNTS) -> float:
        if key not in found:
            found[key] = search.follow(key, counts if given.iterations is None else (given.iterations,))
            if progress is not None:
                progress(1 - 0.9 ** len(found))  # their number is not known beforehand
        return min(each.risk for each in found[key])

    def fill(start: str, strength: float, range_sigma: float, weight: float) -> _Key:
        return (
            start if given.start == "auto" else given.start,
            given.strength or strength,
            given.range_sigma or range_sigma,
            given.barycenter_weight or weight,
        )

    weight = guide_weight(search.probe.level)
    best = min((fill(start, t, sigma, weight * firmer) for start, t, sigma, firmer in _COARSE), key=evaluate)
    is_beaten = isotropic is not None and isotropic.risk < _FAR_BETTER**2 * evaluate(best)
    for ratios in () if is_beaten else _RATIOS:
        best = min([best, *_neighbors_of(best, given, *ratios)], key=evaluate)
    still_falls = given.iterations is None and found[best][-1].setting.iterations == _COUNTS[-1]
    if still_falls and not is_large:
        found[best] += search.follow(best, _MORE)
    candidates = [each for path in found.values() for each in path]
    if isotropic is not None:
        candidates.append(isotropic)
    if with_isotropic:
        for w in (weight / _FIRMER, weight, weight * _FIRMER):
            setting = EdgeAware(iterations=0, start=SMOOTHED, barycenter_weight=w)
            candidates.append(search.evaluate(setting, *search.smooth(w)))
    return candidates


def rank(candidates: list[Candidate]) -> list[Candidate]:
    """The choice, then from the least risk on; the choice may have a slightly higher one."""
    candidates = sorted(candidates, key=lambda each: each.risk)
    least = candidates[0].risk
    enough = least + ((1 + _RISK_TOLERANCE) ** 2 - 1) * max(least, 0.0)
    choice = min((each for each in candidates if each.risk <= enough), key=lambda each: each.divergence)
    return [choice, *(each for each in candidates if each is not choice)]


def _neighbors_of(key: _Key, given: EdgeAware, strength_ratio: float, sigma_ratio: float) -> list[_Key]:
    """The neighbors of a setting, except of what is given."""
    start, t, sigma, weight = key
    found = []
    if given.strength is None:
        strengths = (t * strength_ratio, t / strength_ratio)
        found += [(start, x, sigma, weight) for x in strengths if _is_within(_STRENGTHS, x)]
    if given.range_sigma is None:
        sigmas = (sigma * sigma_ratio, sigma / sigma_ratio)
        found += [(start, t, x, weight) for x in sigmas if _is_within(_RANGE_SIGMAS, x)]
    return found


def _is_within(bounds: tuple[float, float], x: float) -> bool:
    return bounds[0] <= x <= bounds[1]

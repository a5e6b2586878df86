"""The error of a filter without ground truth: Stein's unbiased risk estimate (1981) along the normals.

For noise of standard deviation s along the normals n of a smoothed guide, realizations z of it and a step e,

    risk = mean (n . (f(V) - V))^2 - s^2 + 2 mean z n . (f(V + e z n) - f(V)) / e

(Monte-Carlo form: Girard 1989; Ramani, Blu, Unser 2008). The last term is the divergence: the noise that the filter
lets through. The estimate holds for correlated noise and for noise of any distribution, as z has both.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from meshlab_specsmooth.arrays import Booleans, Floats


@dataclass(frozen=True, eq=False)
class Probe:
    """Realizations of the noise of a mesh, by which the error of any filter is estimated.

    Attributes
    ----------
    normals : (k, 3) float64
        Directions that errors are measured along.
    draws : (k, p) float64
        One realization a column, in the units of the positions.
    level : float
        Standard deviation of the noise, in the same units.
    counted : (k,) bool
        Vertices whose error counts.
    step : float
        e: the fraction of a realization that the positions are perturbed by.
    """

    normals: Floats
    draws: Floats
    level: float
    counted: Booleans
    step: float

    def perturb(self, X: Floats) -> list[Floats]:
        """The positions V + e z n for each realization z."""
        return [X + self.step * (self.normals * z[:, None]) for z in self.draws.T]

    def project(self, D: Floats) -> Floats:
        """(c,) component of the displacements D, (k, 3), along the normals, at the vertices that count."""
        return np.asarray((D * self.normals).sum(axis=1)[self.counted])

    def estimate(self, displacement: Floats, response: Floats, draw: int = 0) -> tuple[float, float]:
        """Risk and divergence by one realization.

        Parameters
        ----------
        displacement : (k, 3) float64
            f(V) - V.
        response : (k, 3) float64
            f(V + e z n) - f(V).
        draw : int
            Which realization.
        """
        z = self.draws[self.counted, draw]
        return compute_risk(self.project(displacement), z, self.project(response) / self.step, self.level)


def compute_risk(moved: Floats, z: Floats, response: Floats, level: float | None = None) -> tuple[float, float]:
    """Risk and divergence.

    Parameters
    ----------
    moved : (c,) float64
        Displacement along the normals.
    z : (c,) or (c, p) float64
        Noise.
    response : (c,) or (c, p) float64
        What the filter makes of the noise, along the normals.
    level : float, optional
        Standard deviation of the noise where it is known better than that of its realizations; the error of doing
        nothing is then estimated without scatter.
    """
    if z.size == 0:
        return 0.0, 0.0
    square = float((z**2).mean())
    divergence = float((z * response).mean())
    if level is None:
        return float((moved**2).mean()) - square + 2 * divergence, divergence
    divergence *= level**2 / square if square > 0 else 0.0
    return float((moved**2).mean()) - level**2 + 2 * divergence, divergence

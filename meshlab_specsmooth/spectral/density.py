"""How many modes lie below an eigenvalue, without computing any.

Chebyshev moments of random vectors give the density of modes (the kernel polynomial method: Weisse, Wellein, Alvermann,
Fehske, *Rev. Mod. Phys.* 78, 2006). The count at low eigenvalues is then a short series in the eigenvalue (Weyl's law:
area, boundary), fitted where the moments are well determined.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_array, eye_array
from scipy.sparse.csgraph import connected_components

from meshlab_specsmooth.spectral.cutoff import WEYL, Cutoff
from meshlab_specsmooth.surface import Floats

SEED = 2010  # any number: fixed, so that two runs agree to the bit

# The range that the counting function is fitted on reaches at least to here, however few modes are asked for
_LEAST_RANGE = 0.2


def cutoff_of_modes(S: csr_array, modes: int) -> Cutoff:
    """The cut-off below which ``modes`` modes lie, from the density of modes.

    Each connected component has one mode of eigenvalue 0, and these stay together: no fewer are kept.

    Parameters
    ----------
    S : (n, n) csr_array
        Symmetric, spectrum inside [0, 2].
    modes : int
        1 to n.
    """
    n = S.shape[0]
    if modes >= n:
        return Cutoff(2.0, n, 0.0)
    zeros = int(connected_components(S, directed=False)[0])
    guess = WEYL * modes / n
    # The number of modes below the top of the fitted range decides how well it is known: its standard deviation is
    # sqrt(2 count / probes).
    top = min(1.9, max(_LEAST_RANGE, 2 * guess))
    probes = int(np.clip(2 / (_WANTED_ERROR**2 * n * top / WEYL), 4, 24))
    moments = _moments(S, random_signs(n, probes), _DEGREE) / (n * probes)
    if guess > _LEAST_RANGE:  # well inside the spectrum the integrated density itself is accurate
        grid = np.linspace(0, 2, 4001)
        below = n * _integrated_density(moments, grid)
        misfit = 0.0
    else:
        # N(x) = zeros + a x + b sqrt(x) + c x^2: components, area, boundary, dispersion. Its variance grows with N.
        x = np.linspace(top / 12, top, 24)
        weight = 1 / np.sqrt(x)
        terms = np.stack([x, np.sqrt(x), x * x], axis=1)
        counts = n * _integrated_density(moments, x) - zeros
        solution = np.linalg.lstsq(terms * weight[:, None], counts * weight, rcond=None)[0]
        misfit = float(np.sqrt(np.mean((terms @ solution - counts) ** 2)))
        grid = np.geomspace(guess / 100, 2 * top, 4000)
        below = zeros + np.stack([grid, np.sqrt(grid), grid * grid], axis=1) @ solution
    # of the modes that are not zero at least half a one: the cut-off lies above the null space
    eigenvalue = float(np.interp(max(modes, zeros + 0.5), np.maximum.accumulate(below), grid))
    kept = max(modes, zeros)
    # of the random vectors; of the smooth law, about which eigenvalues scatter; of its fit
    variance = 2 * kept**2 / (probes * max(modes, n * top / WEYL / 2)) + kept / 2 + misfit**2
    return Cutoff(min(max(eigenvalue, guess / 100), 2.0), kept, float(np.sqrt(variance)) / kept)


def random_signs(n: int, count: int) -> Floats:
    """(n, count) seeded vectors of +1 and -1: their mean energy in a band is the number of modes in it."""
    return np.random.default_rng(SEED).choice([-1.0, 1.0], size=(n, count))


def band_energies(S: csr_array, X: Floats, angles: Floats) -> Floats:
    """Energy of X in each band of the spectrum, summed over its columns.

    Parameters
    ----------
    S : (n, n) csr_array
    X : (n, k) float64
    angles : (b + 1,) float64
        Ends of the bands as arccos(1 - eigenvalue), rising in [0, pi].

    Returns
    -------
    (b,) float64
    """
    moments = _moments(S, X, max(2 * len(angles), _LEAST_BAND_DEGREE))
    below = _integrated_density(moments / moments[0], 1 - np.cos(angles)) if moments[0] > 0 else np.zeros(len(angles))
    return np.asarray(moments[0] * np.diff(below))


PROBES = 8
_LEAST_BAND_DEGREE = 128
_WANTED_ERROR = 0.02
_DEGREE = 48  # products with S; gives twice as many moments, a resolution of pi / 96 in arccos(1 - lambda)


def _moments(S: csr_array, X: Floats, degree: int) -> Floats:
    """(2 degree + 1,) moments: the sum over the columns x of X of x^T T_k(S - I) x."""
    twice = doubled_and_shifted(S)
    before, now = X, 0.5 * (twice @ X)
    moments = np.empty(2 * degree + 1)
    first = np.vdot(X, now)
    moments[0], moments[1] = np.vdot(X, X), first
    for k in range(1, degree + 1):
        # 2 T_k T_k = T_2k + T_0 and 2 T_k T_k-1 = T_2k-1 + T_1: two moments a product
        moments[2 * k - 1] = 2 * np.vdot(now, before) - first
        moments[2 * k] = 2 * np.vdot(now, now) - moments[0]
        following = twice @ now
        following -= before
        before, now = now, following
    return moments


def _integrated_density(moments: Floats, eigenvalues: Floats) -> Floats:
    """Share of the modes below each eigenvalue, from the moments damped by Jackson's kernel."""
    count = len(moments)
    k = np.arange(count)
    q = np.pi / (count + 1)
    jackson = ((count - k + 1) * np.cos(q * k) + np.sin(q * k) / np.tan(q)) / (count + 1)
    # lambda = 1 + cos(t); modes below it have angles from t to pi, where T_k integrates to -sin(k t) / k
    t = np.arccos(np.clip(eigenvalues - 1, -1, 1))
    coefficients = 2 * jackson[1:] * moments[1:] / k[1:]
    return np.asarray((np.pi - t - np.sin(np.outer(t, k[1:])) @ coefficients) / np.pi)


def doubled_and_shifted(S: csr_array) -> csr_array:
    return (2 * (S - eye_array(S.shape[0], format="csr"))).tocsr()

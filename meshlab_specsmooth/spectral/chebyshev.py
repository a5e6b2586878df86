"""h(L) X without eigenvectors: a Chebyshev series of h, summed by the three-term recurrence.

Every term is one sweep over the mesh, so the cost is the degree of the series, whatever the number of modes (Hammond,
Vandergheynst, Gribonval, *Wavelets on graphs via spectral graph theory*, 2011).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.fft import dct

from meshlab_specsmooth.arrays import Floats
from meshlab_specsmooth.errors import InvalidParameter
from meshlab_specsmooth.graph.kernels import COLUMNS
from meshlab_specsmooth.graph.laplacian import Laplacian, in_threes
from meshlab_specsmooth.runtime import blocks
from meshlab_specsmooth.runtime.progress import Progress
from meshlab_specsmooth.spectral.response import Response

# The degree grows as 1 / sqrt(cut-off); beyond this one the wave is longer than any mesh that fits in memory is wide.
HIGHEST_DEGREE = 2**15

# A polynomial of degree d is looked at in so many times d points; between them it can rise by half a per cent.
_OVERSAMPLING = 16
_BETWEEN = 1.01

#: From eigenvalues to the share of an error there that matters.
ErrorGain = Callable[[Floats], Floats]


@dataclass(frozen=True, eq=False)
class ChebyshevSeries:
    """p(lambda) = sum_k c_k T_k(lambda - 1) on [0, 2].

    Attributes
    ----------
    coefficients : (degree + 1,) float64
    error : float
        Bound on abs(p - h) over the spectrum, weighed as it was asked for, outside of a step's transition.
    """

    coefficients: Floats
    error: float

    @property
    def degree(self) -> int:
        """Degree of the polynomial, which is the number of sweeps over the mesh."""
        return len(self.coefficients) - 1

    def __call__(self, eigenvalues: Floats) -> Floats:
        """P at ``eigenvalues``."""
        return np.asarray(np.polynomial.chebyshev.chebval(np.asarray(eigenvalues) - 1, self.coefficients))

    def apply(
        self, L: Laplacian, X: Floats, progress: Progress | None = None, spare: list[Floats] | None = None
    ) -> Floats:
        """p(L) X.

        Parameters
        ----------
        L : Laplacian
        X : (n, k) float64
        progress : callable, optional
            Called with the fraction done, in [0, 1].
        spare : list of (n, 3) float64, optional
            Memory to be used again, for X of three columns; what is left of it afterward is in it.
        """
        memory = spare if spare is not None and X.shape[1] == COLUMNS else []
        return in_threes(lambda three: self._apply(L, three, progress, memory), X)

    def _apply(self, L: Laplacian, X: Floats, progress: Progress | None, spare: list[Floats]) -> Floats:
        """Clenshaw's recurrence, from the highest term down: it keeps two blocks besides X, and sums nothing apart."""
        c = self.coefficients
        now = blocks.taken(spare, X)
        np.multiply(c[-1], X, out=now)
        before = blocks.taken(spare, X)
        before.fill(0.0)
        for k in range(self.degree - 1, 0, -1):
            L.step(X, now, before, share=c[k])
            now, before = before, now
            if progress is not None:
                progress(1 - k / self.degree)
        if self.degree > 0:
            L.step(X, now, before, factor=1.0, share=c[0])
            now, before = before, now
        spare.append(before)
        return now


def approximate(response: Response, tolerance: float, error_gain: ErrorGain | None = None) -> ChebyshevSeries:
    """A short Chebyshev series for ``response`` whose error is below ``tolerance``.

    Parameters
    ----------
    response : Response
        A step is approximated by its softened self, and its transition is not looked at.
    tolerance : float
    error_gain : callable, optional
        From eigenvalues to the share of an error there that matters, at least linear in the eigenvalue near 0. Then
        lambda h(lambda) is expanded, and the series divided by lambda: this puts the errors where they are small.

    Raises
    ------
    InvalidParameter
        The response is too steep for a polynomial of degree :data:`HIGHEST_DEGREE`.
    """
    count = 32
    while count <= 2 * HIGHEST_DEGREE:
        x = 1 + np.cos(np.pi * (np.arange(count) + 0.5) / count)
        h = response.smooth_gain(x)
        c = dct(h if error_gain is None else x * h, type=2) / count
        c[0] /= 2
        # Interpolated well when the upper half of the coefficients is next to nothing
        if np.abs(c[count // 2 :]).sum() <= tolerance * np.abs(c).sum():
            series = _short(c[: count // 2], response, tolerance, error_gain)
            if series is not None:
                return series
        count *= 2
    raise InvalidParameter(
        f"{response.label} needs a polynomial of degree above {HIGHEST_DEGREE}; raise the cut-off (a shorter "
        "wavelength, more modes)"
    )


def _short(c: Floats, response: Response, tolerance: float, error_gain: ErrorGain | None) -> ChebyshevSeries | None:
    """A head of the series that is close enough, within a twentieth of the shortest, if any is."""
    terms = 1
    while terms < len(c):
        kept = c[:terms] if error_gain is None else _divided(c[: terms + 1])
        series = ChebyshevSeries(kept, _error(kept, response, error_gain))
        if series.error <= tolerance:
            return series
        terms += 1 + terms // 20  # not by bisection: the error falls in waves
    return None


def _error(c: Floats, response: Response, error_gain: ErrorGain | None) -> float:
    """Largest error of the series, weighed, outside of the transitions."""
    points = max(64, _OVERSAMPLING * len(c))
    x = 1 + np.cos(np.pi * np.arange(points + 1) / points)
    p = _values(c, points)
    for low, high in response.transitions:
        outside = (x < low) | (x > high)
        ends = np.array([low, min(high, 2.0)])  # where it is steep, no point may be near
        at_ends = np.cos(np.outer(np.arccos(ends - 1), np.arange(len(c)))) @ c
        x, p = np.append(x[outside], ends), np.append(p[outside], at_ends)
    off = np.abs(p - response.smooth_gain(x))
    if error_gain is not None:
        off *= error_gain(x)
    return _BETWEEN * float(off.max())


def _divided(c: Floats) -> Floats:
    """The series of (q(lambda) - q(0)) / lambda, one term shorter than that of q."""
    degree = len(c) - 1
    p = np.zeros(degree + 2)
    # lambda T_k = T_k + (T_k+1 + T_k-1) / 2, solved from the highest term down
    for k in range(degree, 1, -1):
        p[k - 1] = 2 * (c[k] - p[k]) - p[k + 1]
    p[0] = c[1] - p[1] - p[2] / 2
    return p[:degree]


def _values(c: Floats, points: int) -> Floats:
    """The series at 1 + cos(pi j / points), j = 0 ... points, both ends of the spectrum included."""
    padded = np.zeros(points + 1)
    padded[: len(c)] = c / 2
    padded[0] = c[0]
    return np.asarray(dct(padded, type=1))

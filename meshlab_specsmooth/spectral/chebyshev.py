"""h(S) X without eigenvectors: a Chebyshev series of h, summed by the three-term recurrence.

Every product with S is one sweep over the mesh, so the cost is the degree of the series, whatever the number of modes
(Hammond, Vandergheynst, Gribonval, *Wavelets on graphs via spectral graph theory*, 2011).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.fft import dct
from scipy.sparse import csr_array, eye_array

from meshlab_specsmooth.errors import InvalidParameter
from meshlab_specsmooth.response import Response
from meshlab_specsmooth.spectral.progress import Progress
from meshlab_specsmooth.surface import Floats

# The degree grows as 1 / sqrt(cut-off); beyond this one the wave is longer than any mesh that fits in memory is wide.
HIGHEST_DEGREE = 2**15


@dataclass(frozen=True, eq=False)
class ChebyshevSeries:
    """p(lambda) = sum_k c_k T_k(lambda - 1) on [0, 2].

    Attributes
    ----------
    coefficients : (degree + 1,) float64
    error : float
        Bound on abs(p - h) over the spectrum, h being the response with its step softened, if it has one.
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

    def apply(self, S: csr_array, X: Floats, progress: Progress | None = None) -> Floats:
        """p(S) X.

        Parameters
        ----------
        S : (n, n) csr_array
            Symmetric, spectrum inside [0, 2].
        X : (n, k) float64
        progress : callable, optional
            Called with the fraction done, in [0, 1].
        """
        c = self.coefficients
        twice = doubled_and_shifted(S)
        before, now = X, 0.5 * (twice @ X)  # T_0 X and T_1 X
        total = c[0] * X
        if self.degree >= 1:
            total += c[1] * now
        for k in range(2, self.degree + 1):
            following = twice @ now  # T_k = 2 (S - I) T_k-1 - T_k-2
            following -= before
            before, now = now, following
            total += c[k] * now
            if progress is not None:
                progress(k / self.degree)
        return np.asarray(total)


def approximate(response: Response, tolerance: float) -> ChebyshevSeries:
    """The shortest truncation of the Chebyshev series of ``response`` whose error is below ``tolerance``.

    Interpolates at 32, 64, ... Chebyshev points until the second half of the coefficients is below the tolerance, drops
    all that may be dropped (abs(T_k) <= 1, so the dropped coefficients bound the error), and checks between the points.

    Raises
    ------
    InvalidParameter
        The response is too steep for a polynomial of degree :data:`HIGHEST_DEGREE`.
    """
    count = 32
    while count <= 2 * HIGHEST_DEGREE:
        angle = np.pi * (np.arange(count) + 0.5) / count
        c = dct(response.smooth_gain(1 + np.cos(angle)), type=2) / count
        c[0] /= 2
        # tail[k] = sum of abs(c) from k on: the price of keeping the first k coefficients
        tail = np.cumsum(np.abs(c)[::-1])[::-1]
        if tail[count // 2] <= tolerance / 2:
            kept = max(1, int(np.argmax(tail <= tolerance / 2)))
            # what the points alias onto the kept coefficients is at most as much again as what was dropped
            series = ChebyshevSeries(c[:kept], float(2 * tail[kept]))
            # between the points, and at 0 where a low-pass is 1, a steep response may have been overlooked
            between = 1 + np.cos(np.linspace(0, np.pi, 3 * count + 1))
            if np.abs(series(between) - response.smooth_gain(between)).max() <= tolerance:
                return series
        count *= 2
    raise InvalidParameter(
        f"{response.label} needs a polynomial of degree above {HIGHEST_DEGREE}; raise the cut-off (a shorter "
        "wavelength, more modes)"
    )


def doubled_and_shifted(S: csr_array) -> csr_array:
    """2 (S - I), the matrix of the recurrence, with its spectrum in [-2, 2]; for S = I - N it has no diagonal."""
    return (2 * (S - eye_array(S.shape[0], format="csr"))).tocsr()

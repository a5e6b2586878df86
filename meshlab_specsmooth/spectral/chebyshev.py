"""h(L) X without eigenvectors: a Chebyshev series of h, evaluated by the three-term recurrence.

Every term takes one product with L, so the cost is the degree of the series and does not depend on the number of modes
(Hammond, Vandergheynst, Gribonval, *Wavelets on graphs via spectral graph theory*, 2011).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.fft import dct

from meshlab_specsmooth.arrays import Floats
from meshlab_specsmooth.errors import InvalidParameter
from meshlab_specsmooth.graph.laplacian import Laplacian, by_column_blocks
from meshlab_specsmooth.runtime import blocks
from meshlab_specsmooth.runtime.progress import Progress
from meshlab_specsmooth.runtime.workspace import Workspace
from meshlab_specsmooth.spectral.response import Response

# The degree grows as 1 / sqrt(cut-off); above this degree the wave is longer than any mesh that fits in memory is wide.
MAX_DEGREE = 2**15

# The error of a polynomial of degree d is sampled at this many times d points; between them it can be half a per cent
# larger.
_OVERSAMPLING = 16
# docs/constants.md: _BETWEEN_SAMPLES
_BETWEEN_SAMPLES = 1.01

#: From eigenvalues to the factor that an error of the transfer function is weighted with.
ErrorGain = Callable[[Floats], Floats]


@dataclass(frozen=True, eq=False)
class ChebyshevSeries:
    """p(lambda) = sum_k c_k T_k(lambda - 1) on [0, 2].

    Attributes
    ----------
    coefficients : (degree + 1,) float64
    error : float
        Bound on the weighted abs(p - h) over the spectrum, outside of the transitions.
    """

    coefficients: Floats
    error: float

    @property
    def degree(self) -> int:
        """Degree of the polynomial, which is the number of products with L."""
        return len(self.coefficients) - 1

    def __call__(self, eigenvalues: Floats) -> Floats:
        """The polynomial at ``eigenvalues``."""
        return np.asarray(np.polynomial.chebyshev.chebval(np.asarray(eigenvalues) - 1, self.coefficients))

    def apply(
        self, L: Laplacian, X: Floats, progress: Progress | None = None, workspace: Workspace | None = None
    ) -> Floats:
        """p(L) X.

        Parameters
        ----------
        L : Laplacian
        X : (n, k) float64
        progress : callable, optional
            Called with the fraction done, in [0, 1].
        workspace : Workspace, optional
            Work arrays of shape (n, 3).
        """
        work = Workspace() if workspace is None else workspace
        return by_column_blocks(lambda block: evaluate_series(self.coefficients, L, block, work, progress), X)

    def divide(self) -> tuple[float, ChebyshevSeries]:
        """p(0) and the series g of p(lambda) = p(0) + lambda g(lambda)."""
        divided = _divide_by_lambda(self.coefficients) if self.degree > 0 else np.zeros(1)
        return float(self(np.zeros(1))[0]), ChebyshevSeries(divided, self.error)


def evaluate_series(
    coefficients: Floats,
    L: Laplacian,
    X: Floats,
    workspace: Workspace,
    progress: Progress | None = None,
    free: Floats | None = None,
) -> Floats:
    """sum_k c_k T_k(L - 1) X by Clenshaw's recurrence, from the highest term down.

    It needs two blocks besides X and no separate sum.

    Parameters
    ----------
    coefficients : (k,) float64
    L : Laplacian
    X : (n, 3) float64, C order
    workspace : Workspace
        The result and a work array are borrowed from it.
    progress : callable, optional
    free : (n, 1) float64, optional
        1 at the vertices that L is restricted to, 0 at all others, where X vanishes.
    """
    c = coefficients
    now = workspace.borrow(X)
    blocks.parallel_rows(lambda at: np.multiply(X[at], c[-1], out=now[at]), len(X))
    degree = len(c) - 1
    if degree == 0:
        return now
    before = workspace.borrow(X)
    blocks.parallel_rows(lambda at: before[at].fill(0.0), len(X))
    for k in range(degree - 1, -1, -1):
        L.step(X, now, before, factor=2.0 if k else 1.0, coefficient=c[k], free=free)
        now, before = before, now
        if progress is not None:
            progress(1 - k / degree)
    workspace.give_back(before)
    return now


def approximate(response: Response, tolerance: float, error_gain: ErrorGain | None = None) -> ChebyshevSeries:
    """Approximate a response by a short Chebyshev series.

    Parameters
    ----------
    response : Response
        Its ``smooth_gain`` is approximated; errors inside of its transitions are ignored.
    tolerance : float
        Maximum weighted error.
    error_gain : callable, optional
        From eigenvalues to the weight of an error there, which must vanish at least linearly at 0. Then lambda
        h(lambda) is expanded and the series divided by lambda, which moves the errors to small eigenvalues, where they
        count little.

    Raises
    ------
    InvalidParameter
        The response is too steep for a polynomial of degree :data:`MAX_DEGREE`.
    """
    count = 32
    while count <= 2 * MAX_DEGREE:
        x = 1 + np.cos(np.pi * (np.arange(count) + 0.5) / count)
        h = response.smooth_gain(x)
        c = dct(h if error_gain is None else x * h, type=2) / count
        c[0] /= 2
        # converged when the upper half of the coefficients is negligible
        if np.abs(c[count // 2 :]).sum() <= tolerance * np.abs(c).sum():
            series = _truncate(c[: count // 2], response, tolerance, error_gain)
            if series is not None:
                return series
        count *= 2
    raise InvalidParameter(
        f"{response.label} needs a polynomial of degree above {MAX_DEGREE}; raise the cut-off (a shorter "
        "wavelength, more modes)"
    )


def _truncate(c: Floats, response: Response, tolerance: float, error_gain: ErrorGain | None) -> ChebyshevSeries | None:
    """Truncate the series as far as the tolerance allows, to within a twentieth of the shortest; None if not at all."""
    terms = 1
    while terms < len(c):
        kept = c[:terms] if error_gain is None else _divide_by_lambda(c[: terms + 1])
        series = ChebyshevSeries(kept, _error(kept, response, error_gain))
        if series.error <= tolerance:
            return series
        terms += 1 + terms // 20  # not by bisection: the error is not monotone
    return None


def _error(c: Floats, response: Response, error_gain: ErrorGain | None) -> float:
    """Largest weighted error of the series outside of the transitions."""
    points = max(64, _OVERSAMPLING * len(c))
    x = 1 + np.cos(np.pi * np.arange(points + 1) / points)
    p = _evaluate(c, points)
    for low, high in response.transitions:
        outside = (x < low) | (x > high)
        ends = np.array([low, min(high, 2.0)])  # where it is steep, no sample may be close
        at_ends = np.cos(np.outer(np.arccos(ends - 1), np.arange(len(c)))) @ c
        x, p = np.append(x[outside], ends), np.append(p[outside], at_ends)
    error = np.abs(p - response.smooth_gain(x))
    if error_gain is not None:
        error *= error_gain(x)
    return _BETWEEN_SAMPLES * float(error.max())


def _divide_by_lambda(c: Floats) -> Floats:
    """The series of (q(lambda) - q(0)) / lambda, one term shorter than that of q."""
    degree = len(c) - 1
    p = np.zeros(degree + 2)
    # lambda T_k = T_k + (T_k+1 + T_k-1) / 2, solved from the highest term down
    for k in range(degree, 1, -1):
        p[k - 1] = 2 * (c[k] - p[k]) - p[k + 1]
    p[0] = c[1] - p[1] - p[2] / 2
    return p[:degree]


def _evaluate(c: Floats, points: int) -> Floats:
    """The series at 1 + cos(pi j / points), j = 0 ... points, including both ends of the spectrum."""
    padded = np.zeros(points + 1)
    padded[: len(c)] = c / 2
    padded[0] = c[0]
    return np.asarray(dct(padded, type=1))

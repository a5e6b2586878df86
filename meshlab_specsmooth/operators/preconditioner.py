"""Preconditioners of the reconstruction: approximate inverses of its normal matrix by polynomials of the Laplacian.

Where all weights are 1, the normal matrix A = L^T L + w^2 C^T C satisfies, with S = D^1/2 L D^-1/2,

    D^-1/2 A D^-1/2 = S D^-1 S + (w^2 / 9) (3 I - 2 S)

on a closed surface. With the mean 1 / d of D^-1 this is a function of S alone, a(lambda) = lambda^2 / d + w^2 (3 - 2
lambda) / 9, and so is its inverse. Of all polynomials p of a degree those are taken whose residual 1 - a p is a
combination of two neighboring Chebyshev polynomials: it is small relative to 1 over the whole spectrum, and so p is
positive. The degree for a given residual grows as 1 / sqrt(w), where the iterations with the diagonal grow as 1 / w.

On vertices that are held S is restricted to the free ones. What the polynomial does not see (the spread of the
valences, boundaries, non-manifold edges) is left to conjugate gradients.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.fft import dct

from meshlab_specsmooth.arrays import Floats
from meshlab_specsmooth.graph.laplacian import Laplacian
from meshlab_specsmooth.runtime import blocks
from meshlab_specsmooth.runtime.workspace import Workspace
from meshlab_specsmooth.spectral.chebyshev import evaluate_series

# Maximum of the residual 1 - a p over the spectrum.
# docs/constants.md: _MAX_RESIDUAL
_MAX_RESIDUAL = 0.3

# Factor by which an iteration reduces the error, at least: the relative spread of 1 / d over the vertices, within these
# bounds. Where the last iteration reduced it less, that counts.
_CONTRACTIONS = (0.2, 0.7)

# Where iterations reduce the error that fast, it is below this many times the residual over the weight.
_MAX_RESIDUAL_OVER_WEIGHT = 4.0

# From this weight on the diagonal is as good a preconditioner. Below the other one the polynomial is that of this
# weight, so that it stays short.
# docs/constants.md: MAX_WEIGHT
MAX_WEIGHT = 0.8
MIN_WEIGHT = 1e-4

# Where the weight varies over the surface, polynomials for weights this far apart are mixed, up to the weight at which
# the zeros of a become real.
_OCTAVE, _MAX_MIXED = 2.0, 1.4


@dataclass(frozen=True, eq=False)
class Diagonal:
    """z = m r, with m one over the diagonal of D^-1 A.

    Attributes
    ----------
    inverse : (n, 1) float64
    weight : float
        The lowest w.
    """

    inverse: Floats
    weight: float

    def apply(self, r: Floats, workspace: Workspace) -> Floats:
        """The approximate solution z of D^-1 A z = r; r vanishes where a vertex is held, and so does z."""
        return blocks.multiply(r, self.inverse, workspace.borrow(r))

    def estimate_error(self, step: float, contraction: float, residual: float) -> float:
        """Relative error of the displacement.

        The lowest eigenvalue of D^-1 A is w^2 / 3 below w = 1. Above, the shortest waves, which barycenters do not
        see, are held less and less firmly relative to the others.
        """
        del step, contraction
        return 3 * residual / min(self.weight**2, 1 / self.weight)


@dataclass(frozen=True, eq=False)
class Polynomials:
    """z = sum_k f_k p_k(L) f_k r, with shares f_k of the vertices in the polynomials.

    Attributes
    ----------
    L : Laplacian
    free : (n, 1) float64 or None
        1 where a vertex may move, 0 where it is held.
    weight : float
        The lowest w.
    contraction : float
        Factor by which an iteration reduces the error at least.
    series : tuple of (k,) float64
        Chebyshev coefficients of each polynomial.
    shares : tuple of (n, 1) float64
        Empty for a single polynomial.
    """

    L: Laplacian
    free: Floats | None
    weight: float
    contraction: float
    series: tuple[Floats, ...]
    shares: tuple[Floats, ...] = ()

    def apply(self, r: Floats, workspace: Workspace) -> Floats:
        """The approximate solution z of D^-1 A z = r; r vanishes where a vertex is held, and so does z."""
        if not self.shares:
            return evaluate_series(self.series[0], self.L, r, workspace, free=self.free)
        part, z = workspace.borrow(r), workspace.borrow(r)
        z.fill(0.0)
        for series, share in zip(self.series, self.shares, strict=True):
            blocks.multiply(r, share, part)
            found = evaluate_series(series, self.L, part, workspace, free=self.free)
            z += blocks.multiply(found, share, found)
            workspace.give_back(found)
        workspace.give_back(part)
        return z

    def estimate_error(self, step: float, contraction: float, residual: float) -> float:
        """Relative error of the displacement: ``step``, which was close to the error before it, times a contraction.

        At vertices where the polynomial is far from an inverse (of a hundred neighbors, or without an equation of their
        own) steps are too short to show the error, but the residual is large.
        """
        error = step * max(contraction, self.contraction)
        if self.shares:
            return error
        return max(error, residual / (_MAX_RESIDUAL_OVER_WEIGHT * self.weight))


def precondition(L: Laplacian, gram_diagonal: Floats, is_uniform: bool, free: Floats | None) -> Polynomials | None:
    """The polynomials for a normal matrix; None where the diagonal is to be preferred.

    Parameters
    ----------
    L : Laplacian
    gram_diagonal : (n, 1) float64
        Of w^2 C^T C.
    is_uniform : bool
        Whether the weight w is the same at all faces.
    free : (n, 1) float64 or None
        1 where a vertex may move, 0 where it is held; None: all may.
    """
    if L.graph.weights is not None:
        return None
    held = 9 * gram_diagonal if free is None else 9 * free * gram_diagonal
    degree = L.degree if free is None else free * L.degree
    total = float(degree.sum())
    if total == 0:
        return None
    inverse_degree = (L.size if free is None else float(free.sum())) / total
    valences = np.bincount(np.diff(L.graph.indptr))
    spread = np.sqrt(np.average((1 / np.arange(1, len(valences)) - inverse_degree) ** 2, weights=valences[1:]))
    contraction = float(np.clip(spread / inverse_degree, *_CONTRACTIONS))
    if is_uniform:
        weight = float(np.sqrt(held.sum() / total))
        if weight >= MAX_WEIGHT:
            return None
        return Polynomials(L, free, weight, contraction, (design_inverse(weight, inverse_degree),))
    local = np.sqrt(held / L.degree)
    low, high = (float(np.clip(of, MIN_WEIGHT, _MAX_MIXED)) for of in (local[degree > 0].min(), local.max()))
    if low >= MAX_WEIGHT:
        return None
    count = 1 + int(np.ceil(np.round(np.log(high / low) / np.log(_OCTAVE), 9)))  # rounding is no difference
    weights = np.geomspace(low, high, count)
    series = tuple(design_inverse(float(w), inverse_degree) for w in weights)
    if count == 1:
        return Polynomials(L, free, low, contraction, series)
    # linear in the logarithm of the weight between the two polynomials next to it
    at = (count - 1) * np.log(np.clip(local, low, high) / low) / np.log(high / low)
    # above the highest weight the inverse falls as one over the square
    scale = np.minimum(high / np.maximum(local, high), 1.0)
    shares = tuple(scale * np.sqrt(np.clip(1 - np.abs(at - k), 0.0, 1.0)) for k in range(count))
    return Polynomials(L, free, low, contraction, series, shares)


def design_inverse(weight: float, inverse_degree: float) -> Floats:
    """Chebyshev coefficients on [0, 2] of a polynomial p with abs(1 - a p) at most :data:`_MAX_RESIDUAL`.

    Parameters
    ----------
    weight : float
        w, in (0, 1].
    inverse_degree : float
        1 / d in a(lambda) = lambda^2 / d + w^2 (3 - 2 lambda) / 9, whose zeros must not be real.
    """
    w2 = max(weight, MIN_WEIGHT) ** 2
    zero = np.roots([inverse_degree, -2 * w2 / 9, w2 / 3]).astype(np.complex128)[0]
    # The residual c_0 T_m(t) + c_1 T_m-1(t), t = lambda - 1, is 1 at both zeros of a. Its bound, abs(c_0) + abs(c_1),
    # is lowest where the phase of T_m there is a multiple of pi, so the degrees are looked through.
    z = np.arccosh(zero - 1)
    turn = np.pi - abs(z.imag)
    degrees = np.arange(2, int(2 * np.pi / turn) + 8)
    first, second = np.cosh(degrees * z), np.cosh((degrees - 1) * z)
    determinant = first.real * second.imag - first.imag * second.real
    c = np.stack([second.imag, -first.imag]) / determinant
    best = int(np.argmax(np.abs(c).sum(axis=0) <= _MAX_RESIDUAL))
    m, c = int(degrees[best]), c[:, best]
    # p has degree m - 2 and is known where it is sampled
    angle = np.pi * (np.arange(m) + 0.5) / m
    x = 1 + np.cos(angle)
    residual = c[0] * np.cos(m * angle) + c[1] * np.cos((m - 1) * angle)
    p = (1 - residual) / (inverse_degree * x * x + w2 * (3 - 2 * x) / 9)
    series = dct(p, type=2)[: m - 1] / m
    series[0] /= 2
    return np.asarray(series)

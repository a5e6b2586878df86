"""Estimates of the number of modes below an eigenvalue, without computing eigenvalues.

Chebyshev moments of random vectors give the density of modes (the kernel polynomial method: Weisse, Wellein, Alvermann,
Fehske, *Rev. Mod. Phys.* 78, 2006). A few vectors are enough because of prior knowledge: the traces of S and S^2, and
the spectra of triangle meshes. At low eigenvalues these are close to that of the regular triangle lattice with the same
number of vertices, plus a term for the boundary (Weyl's law: area, boundary). The deviation of a mesh from this law and
its uncertainty follow from the moments by a regression with Gaussian priors (Rasmussen, Williams, *Gaussian Processes
for Machine Learning*, 2006, sections 2.2, 2.7 and 5.4.1).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.linalg
from scipy.sparse.csgraph import connected_components

from meshlab_specsmooth.arrays import Floats
from meshlab_specsmooth.graph.laplacian import Laplacian
from meshlab_specsmooth.graph.protocols import COLUMNS
from meshlab_specsmooth.spectral.cutoff import Cutoff, lattice_fraction

SEED = 2010  # arbitrary, fixed so that two runs agree to the bit

# Number of random vectors for band_energies, and minimum degree of its polynomials
PROBES = 9
_MIN_BAND_DEGREE = 128

# Products with L for each vector; they give twice as many moments, a resolution of pi / 64 in arccos(1 - lambda)
# docs/constants.md: _DEGREE
_DEGREE = 32
# Vertices times vectors. The variance of a count is inversely proportional to it; with this many, its error is below
# the scatter of the eigenvalues
# docs/constants.md: _WANTED_SAMPLES
_WANTED_SAMPLES = 150_000
# docs/constants.md: _MAX_PROBES
_MAX_PROBES = 24

# Prior standard deviations of the lattice's term and of its growth with lambda and lambda^2, relative to n
# docs/constants.md: _LATTICE_PRIOR
_LATTICE_PRIOR = (0.3, 0.05, 0.05)
# and of the boundary's term, relative to its length and to the square root of n
# docs/constants.md: _BOUNDARY_PRIOR
_BOUNDARY_PRIOR = (0.2, 0.1)
# Variances, to choose from, of the number of modes in a band about any smooth law: small on compact surfaces, large on
# long, thin shapes, whose spectrum is nearly one-dimensional, and on many equal components
_SCATTER = np.concatenate([[0.5], np.geomspace(2, 2e4, 14)])

# Eigenvalues scatter about any smooth law: the variance of their number below a value was measured as 1 to 2 at 20 to
# 200 modes; it grows at most as the square root of the number, on symmetric surfaces
# docs/constants.md: _MIN_SCATTER, _SCATTER_GROWTH
_MIN_SCATTER, _SCATTER_GROWTH = 1.0, 0.1

# The law is fitted in _BANDS bands up to the eigenvalue _FITTED_TO and used up to _LAW_TO; above that, counts follow
# from the moments alone
# docs/constants.md: _BANDS
_BANDS = 32
# docs/constants.md: _FITTED_TO
_FITTED_TO = 1.0
# docs/constants.md: _LAW_TO
_LAW_TO = 0.7
# docs/constants.md: _GRID
_GRID = 128  # points of the table above _LAW_TO; twice as many below it
_NODES = 256  # of the quadrature over angles; exact for products of three polynomials of the degree of the moments


@dataclass(frozen=True, eq=False)
class Density:
    """Estimated number of modes below each eigenvalue; gives the cut-off for any number of modes.

    Attributes
    ----------
    n : int
        Number of modes.
    zeros : int
        Number of modes with eigenvalue 0: connected components.
    probes : int
        Number of random vectors used.
    moments : (2 d + 1,) float64
        Estimates of the traces of T_k(S - I), from d products with L.
    eigenvalues : (g,) float64, ascending in (0, 2]
    below : (g,) float64, nondecreasing
        Number of modes below each.
    error : (g,) float64
        Standard error of ``below``, from the random vectors, the law and the scatter of eigenvalues about it.
    """

    n: int
    zeros: int
    probes: int
    moments: Floats
    eigenvalues: Floats
    below: Floats
    error: Floats

    def cutoff(self, modes: int) -> Cutoff:
        """The cut-off with ``modes`` modes below it, 1 to n.

        The modes with eigenvalue 0, one for each connected component, are always kept.
        """
        if modes >= self.n:
            return Cutoff(2.0, self.n, 0.0)
        # at least half a mode more than the null space, so that the cut-off lies above it
        eigenvalue = float(np.interp(max(modes, self.zeros + 0.5), self.below, self.eigenvalues))
        kept = max(modes, self.zeros)
        return Cutoff(eigenvalue, kept, float(np.interp(eigenvalue, self.eigenvalues, self.error)) / kept)


def cutoff_of_modes(L: Laplacian, modes: int) -> Cutoff:
    """The cut-off with ``modes`` modes below it; for several numbers, call :func:`estimate_density` once.

    Parameters
    ----------
    L : Laplacian
    modes : int
        1 to n.
    """
    return Cutoff(2.0, L.size, 0.0) if modes >= L.size else estimate_density(L).cutoff(modes)


def probes_for(n: int) -> int:
    """Number of random vectors for a mesh with n vertices, a multiple of the columns that the kernels work on."""
    return int(np.clip(COLUMNS * np.ceil(_WANTED_SAMPLES / n / COLUMNS), COLUMNS, _MAX_PROBES))


def estimate_density(L: Laplacian) -> Density:
    """Estimate the density of modes of L.

    Parameters
    ----------
    L : Laplacian
        Of a triangle mesh; the error is larger for other graphs.
    """
    n, graph = L.size, L.graph
    probes = probes_for(n)
    zeros = int(connected_components(graph.adjacency(), directed=False)[0])
    # the trace of (S - I)^2, whose entries are w_ij / sqrt(d_i d_j)
    square = float((L.sums_of_squares(1 / L.degree) / L.degree).sum())
    # Euler: a triangulated surface has 3 n - 3 chi edges minus those of its boundary; chi is at most 2 for each
    # component, so this is the length of the boundary in edges, up to a few
    boundary = max(0, 3 * n - 6 * zeros - len(graph.indices) // 2)
    moments = _moments(L, random_signs(n, probes) / np.sqrt(L.degree), _DEGREE) / probes
    sample = _sample_moments(moments, np.array([n, 0.0, 2 * square - n]), probes, zeros)

    low, high = np.geomspace(1e-3 / n, _LAW_TO, 2 * _GRID), np.linspace(_LAW_TO, 2, _GRID + 1)[1:]
    below_low, variance_low, scatter = _count_by_law(sample, low, boundary)
    below_high, variance_high = _count_by_moments(sample, high)
    below = np.clip(np.maximum.accumulate(np.concatenate([below_low, below_high])), zeros, n)
    # eigenvalues that cluster at the bottom of the spectrum cluster in the middle as well
    variance = np.concatenate([variance_low, variance_high + scatter])
    error = np.sqrt(variance + _MIN_SCATTER + _SCATTER_GROWTH * np.sqrt(below))
    return Density(n, zeros, probes, moments, np.concatenate([low, high]), below, error)


@dataclass(frozen=True, eq=False)
class _Sample:
    """Moments and what is known of them, at the nodes of a quadrature over angles, lambda = 1 - cos(angle).

    A functional of the density is a row of coefficients of the moments, or the polynomial with these coefficients,
    whose values are the row times ``polynomials``.

    Attributes
    ----------
    moments : (c,) float64
    known_errors : (3,) float64
        Errors of the first moments, whose exact values are known.
    polynomials : (c, nodes) float64
    weight : (nodes,) float64
        Approximate number of modes at each node, nonnegative; weights for the noise, not for the result.
    regression : (3, nodes) float64
        Maps a polynomial to its best approximation by the first three.
    cells : (nodes + 1,) float64
        Eigenvalues that separate the nodes.
    """

    n: float
    zeros: int
    probes: int
    moments: Floats
    known_errors: Floats
    polynomials: Floats
    weight: Floats
    regression: Floats
    cells: Floats

    def evaluate(self, functionals: Floats) -> tuple[Floats, Floats]:
        """(f,) values of (f, c) functionals, without the zero modes, and (f, nodes) factors of their covariance.

        With random signs the variance of a functional is 2 / probes times the trace of its square (Avron, Toledo,
        *J. ACM* 58, 2011), minus the part explained by the known moments, which serve as control variates.
        """
        values = functionals @ self.polynomials
        explained = values @ self.regression.T
        known = len(self.known_errors)
        spread = (values - explained @ self.polynomials[:known]) * np.sqrt(2 / self.probes * self.weight)
        # each zero mode contributes T_k(-1)
        nonzero = self.moments - self.zeros * np.where(np.arange(len(self.moments)) % 2, -1.0, 1.0)
        return functionals @ nonzero - explained @ self.known_errors, spread

    def damped(self, functionals: Floats, counts: Floats) -> Floats:
        """The functionals of densities given by their (nodes + 1, d) counts at the ends of the cells."""
        return np.asarray(functionals @ (self.polynomials @ np.diff(counts, axis=0)))


def _sample_moments(moments: Floats, known: Floats, probes: int, zeros: int) -> _Sample:
    k, n = np.arange(len(moments)), float(known[0])
    angle = (np.arange(_NODES) + 0.5) * np.pi / _NODES
    T = np.cos(np.outer(k, np.pi - angle))
    weight = np.maximum((_jackson(len(k)) * np.where(k == 0, 1, 2) * moments) @ T, 0.0)
    weight *= n / weight.sum()
    first = T[: len(known)]
    regression = np.linalg.solve((first * weight) @ first.T, first * weight)
    cells = 1 - np.cos(np.linspace(0, np.pi, _NODES + 1))
    return _Sample(n, zeros, probes, moments, moments[: len(known)] - known, T, weight, regression, cells)


def _count_by_law(sample: _Sample, eigenvalues: Floats, boundary: int) -> tuple[Floats, Floats, float]:
    """(x,) counts of modes below each eigenvalue, (x,) their variances, and the variance of a band about the law.

    The law is the sum of the lattice's and the boundary's terms, the deviations of this mesh from them, and the scatter
    of each band: y = A (expected + deviations) + F scatter + noise, all with normal priors and all observed through the
    same damped polynomials.
    """
    n = sample.n
    ends = np.linspace(0, np.arccos(1 - _FITTED_TO), _BANDS + 1)
    bands = np.diff(_steps(1 - np.cos(ends), len(sample.moments)), axis=0)
    y, spread = sample.evaluate(bands)
    A = sample.damped(bands, _law(sample.cells))
    F = sample.damped(bands, _filled(sample.cells, ends))
    # a vertex on the boundary has half the area of an inner one; Weyl's second term is the length over 4 pi, times the
    # wave number, which is sqrt(4 lambda) per edge
    expected = np.array([n - boundary / 2, 0.0, 0.0, boundary / (2 * np.pi)])
    along, across = _BOUNDARY_PRIOR
    prior = np.array([*(n * s for s in _LATTICE_PRIOR), (along * boundary + across * np.sqrt(n)) / np.pi]) ** 2
    # the last term is the rounding of the moments and keeps the matrix definite
    covariance = spread @ spread.T + (A * prior) @ A.T + 1e-9 * n * np.eye(_BANDS)

    # in the basis U, covariance + v F F^T is the diagonal 1 + v gain, so that trying every v costs nothing
    gain, U = scipy.linalg.eigh(F @ F.T, covariance)
    residual = U.T @ (y - A @ expected)
    total = 1 + np.outer(_SCATTER, np.maximum(gain, 0.0))
    best = np.argmin((residual**2 / total + np.log(total)).sum(axis=1))  # minus twice the log-likelihood
    scatter, total = float(_SCATTER[best]), total[best]

    law, filled = _law(eigenvalues), _filled(eigenvalues, ends)
    cross = ((law * prior) @ A.T + scatter * filled @ F.T) @ U  # covariance with the observations
    below = sample.zeros + law @ expected + cross @ (residual / total)
    variance = law**2 @ prior + scatter * (filled**2).sum(axis=1) - cross**2 @ (1 / total)
    return below, np.maximum(variance, 0.0), scatter


def _count_by_moments(sample: _Sample, eigenvalues: Floats) -> tuple[Floats, Floats]:
    """(x,) counts of modes below each eigenvalue and (x,) their variances, well inside the spectrum."""
    steps = _steps(eigenvalues, len(sample.moments))
    count, spread = sample.evaluate(steps)
    # the effect of the finite resolution on the lattice's density; its standard error is half of it
    blur = (sample.n - sample.zeros) * (
        lattice_fraction(eigenvalues) - sample.damped(steps, lattice_fraction(sample.cells))
    )
    return sample.zeros + count + blur, (spread**2).sum(axis=1) + (blur / 2) ** 2


def _law(eigenvalues: Floats) -> Floats:
    """(x, 4): the lattice's modes below each eigenvalue, two smooth deviations from them, and the boundary's."""
    modes = lattice_fraction(eigenvalues)
    return np.stack([modes, modes * eigenvalues, modes * eigenvalues**2, np.sqrt(np.minimum(eigenvalues, 1.0))], axis=1)


def _filled(eigenvalues: Floats, ends: Floats) -> Floats:
    """(x, b): the fraction of each band of angles that lies below each eigenvalue."""
    angle = np.arccos(1 - eigenvalues)
    return np.clip((angle[:, None] - ends[:-1]) / np.diff(ends), 0, 1)


def random_signs(n: int, count: int) -> Floats:
    """(n, count) seeded random vectors of +1 and -1; their mean energy in a band is its number of modes."""
    random_bytes = np.random.default_rng(SEED).bytes(-(-n * count // 8))
    bits = np.unpackbits(np.frombuffer(random_bytes, np.uint8), count=n * count).reshape(n, count)
    return np.asarray(2.0 * bits - 1.0, dtype=np.float64)


def band_energies(L: Laplacian, X: Floats, angles: Floats) -> Floats:
    """Energy x^T D x of X in each band of the spectrum, summed over its columns x.

    Parameters
    ----------
    L : Laplacian
    X : (n, k) float64
    angles : (b + 1,) float64
        Ends of the bands as arccos(1 - eigenvalue), ascending in [0, pi].

    Returns
    -------
    (b,) float64
    """
    moments = _moments(L, X, max(2 * len(angles), _MIN_BAND_DEGREE))
    return np.asarray(np.diff(_steps(1 - np.cos(angles), len(moments)) @ moments))


def _moments(L: Laplacian, X: Floats, degree: int) -> Floats:
    """(2 degree + 1,) moments: the sum over the columns x of X of x^T D T_k(L - I) x."""
    blocks = (X[:, i : i + COLUMNS] for i in range(0, X.shape[1], COLUMNS))
    return np.asarray(sum((_block_moments(L, block, degree) for block in blocks), np.zeros(2 * degree + 1)))


def _block_moments(L: Laplacian, X: Floats, degree: int) -> Floats:
    now = np.zeros((len(X), COLUMNS))
    now[:, : X.shape[1]] = X
    before = np.zeros_like(now)
    moments = np.empty(2 * degree + 1)
    moments[0], _ = L.inner_products(now, before)
    for k in range(1, degree + 1):
        L.step(now, now, before, factor=1.0 if k == 1 else 2.0)
        now, before = before, now
        # 2 T_k T_k = T_2k + T_0 and 2 T_k T_k-1 = T_2k-1 + T_1: two moments for each product with L
        square, product = L.inner_products(now, before)
        if k == 1:
            moments[1] = product
        moments[2 * k - 1] = 2 * product - moments[1]
        moments[2 * k] = 2 * square - moments[0]
    return moments


def _jackson(count: int) -> Floats:
    """(count,) Jackson factors, which keep a truncated Chebyshev series of a density nonnegative."""
    k = np.arange(count)
    q = np.pi / (count + 1)
    return np.asarray(((count - k + 1) * np.cos(q * k) + np.sin(q * k) / np.tan(q)) / (count + 1))


def _steps(eigenvalues: Floats, count: int) -> Floats:
    """(x, count): the counts below each eigenvalue as coefficients of the moments, damped by Jackson's kernel."""
    k = np.arange(1, count)
    # lambda = 1 + cos(t); modes below it have angles from t to pi, where T_k integrates to -sin(k t) / k
    t = np.arccos(np.clip(eigenvalues - 1, -1, 1))
    series = -2 * _jackson(count)[1:] / k * np.sin(np.outer(t, k))
    return np.concatenate([(np.pi - t)[:, None], series], axis=1) / np.pi

"""How many modes lie below an eigenvalue, without computing any.

Chebyshev moments of random vectors give the density of modes (the kernel polynomial method: Weisse, Wellein, Alvermann,
Fehske, *Rev. Mod. Phys.* 78, 2006). A few vectors are enough, as much is known beforehand: the traces of S and S^2, and
what the spectrum of a triangle mesh looks like. At low eigenvalues it is nearly that of the regular triangle lattice
with as many vertices, and a boundary adds its share (Weyl's law: area, boundary). The moments say by how much this mesh
departs from that, and how surely: a regression with Gaussian priors (Rasmussen, Williams, *Gaussian Processes for
Machine Learning*, 2006, sections 2.2, 2.7 and 5.4.1).
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

SEED = 2010  # any number: fixed, so that two runs agree to the bit

# Random vectors of band_energies
PROBES = 9
_LEAST_BAND_DEGREE = 128

# Sweeps; they give twice as many moments, a resolution of pi / 64 in arccos(1 - lambda)
_DEGREE = 32
# The variance of a count falls as vertices times vectors; with so many its error is below the scatter of eigenvalues
_WANTED_SAMPLES = 150_000
_MOST_PROBES = 24

# The prior: standard deviations of the lattice's share, and of how it grows with lambda and lambda^2, relative to n
_LATTICE_PRIOR = (0.3, 0.05, 0.05)
# and of the boundary, relative to its length and to the square root of n
_BOUNDARY_PRIOR = (0.2, 0.1)
# Modes of a band that no smooth law foresees, as variances to choose among: few on a broad surface, many on a tube,
# whose waves come in rungs, or on many equal components
_SCATTER = np.concatenate([[0.5], np.geomspace(2, 2e4, 14)])

# Eigenvalues scatter about any smooth law, however well it is known: the variance of their number below a value was
# measured as 1 to 2 at 20 to 200 modes; it grows at most as the root of the number, on symmetric surfaces
_LEAST_SCATTER, _SCATTER_GROWTH = 1.0, 0.1

# Where the law is fitted, and where the count goes over from the law to the moments alone
_BANDS = 32
_FITTED_TO = 1.0
_LAW_TO = 0.7
_GRID = 128  # points that the counting function is tabulated on from there on, and half of those below
_NODES = 256  # of the quadrature over angles; exact for products of three polynomials of the degree of the moments


@dataclass(frozen=True, eq=False)
class Density:
    """How many modes lie below each eigenvalue: measured once, asked for any number of modes.

    Attributes
    ----------
    n : int
        Modes in all.
    zeros : int
        Modes of eigenvalue 0: connected components.
    probes : int
        Random vectors that it was measured with.
    moments : (2 d + 1,) float64
        Estimates of the trace of T_k(S - I) after d sweeps.
    eigenvalues : (g,) float64, rising in (0, 2]
    below : (g,) float64, never falling
        Modes below each.
    error : (g,) float64
        Standard error of each: of the random vectors, of the law and of the scatter of eigenvalues about it.
    """

    n: int
    zeros: int
    probes: int
    moments: Floats
    eigenvalues: Floats
    below: Floats
    error: Floats

    def cutoff(self, modes: int) -> Cutoff:
        """The cut-off below which ``modes`` modes lie, 1 to n.

        Each connected component has one mode of eigenvalue 0, and these stay together: no fewer are kept.
        """
        if modes >= self.n:
            return Cutoff(2.0, self.n, 0.0)
        # of the modes that are not zero at least half a one: the cut-off lies above the null space
        eigenvalue = float(np.interp(max(modes, self.zeros + 0.5), self.below, self.eigenvalues))
        kept = max(modes, self.zeros)
        return Cutoff(eigenvalue, kept, float(np.interp(eigenvalue, self.eigenvalues, self.error)) / kept)


def cutoff_of_modes(L: Laplacian, modes: int) -> Cutoff:
    """The cut-off below which ``modes`` modes lie; to ask for several, :func:`measure` once.

    Parameters
    ----------
    L : Laplacian
    modes : int
        1 to n.
    """
    return Cutoff(2.0, L.size, 0.0) if modes >= L.size else measure(L).cutoff(modes)


def probes_for(n: int) -> int:
    """Random vectors for a mesh with n vertices, as many at a time as a sweep works on."""
    return int(np.clip(COLUMNS * np.ceil(_WANTED_SAMPLES / n / COLUMNS), COLUMNS, _MOST_PROBES))


def measure(L: Laplacian) -> Density:
    """The density of modes of L.

    Parameters
    ----------
    L : Laplacian
        Of a triangle mesh. (Of another graph too, with a larger error.)
    """
    n, graph = L.size, L.graph
    probes = probes_for(n)
    zeros = int(connected_components(graph.adjacency(), directed=False)[0])
    # the trace of (S - I)^2, whose entries are w_ij / sqrt(d_i d_j)
    square = float((L.sums_of_squares(1 / L.degree) / L.degree).sum())
    # Euler: a surface of triangles has 3 n - 3 chi edges, less as many as its boundary has; chi is at most 2 for each
    # component, so this is the length of the boundary in edges, but for a few
    boundary = max(0, 3 * n - 6 * zeros - len(graph.indices) // 2)
    moments = _moments(L, random_signs(n, probes) / np.sqrt(L.degree), _DEGREE) / probes
    sample = _sampled(moments, np.array([n, 0.0, 2 * square - n]), probes, zeros)

    low, high = np.geomspace(1e-3 / n, _LAW_TO, 2 * _GRID), np.linspace(_LAW_TO, 2, _GRID + 1)[1:]
    below_low, variance_low, scatter = _count_by_law(sample, low, boundary)
    below_high, variance_high = _count_by_moments(sample, high)
    below = np.clip(np.maximum.accumulate(np.concatenate([below_low, below_high])), zeros, n)
    # eigenvalues that crowd at the bottom of the spectrum crowd in the middle as well
    variance = np.concatenate([variance_low, variance_high + scatter])
    error = np.sqrt(variance + _LEAST_SCATTER + _SCATTER_GROWTH * np.sqrt(below))
    return Density(n, zeros, probes, moments, np.concatenate([low, high]), below, error)


@dataclass(frozen=True, eq=False)
class _Sample:
    """What was measured and what is known, at the nodes of a quadrature over angles, lambda = 1 - cos(angle).

    A functional of the density is a row of coefficients on the moments; its value at an eigenvalue is that of a
    polynomial, the row times ``polynomials``.

    Attributes
    ----------
    moments : (c,) float64
    wrong : (3,) float64
        Errors of the first moments, whose true values are known.
    polynomials : (c, nodes) float64
    weight : (nodes,) float64
        Modes at each node, roughly, never negative: they weigh the noise, not the result.
    regression : (3, nodes) float64
        Times a polynomial, its best approximation by the first three.
    cells : (nodes + 1,) float64
        Eigenvalues between the nodes.
    """

    n: float
    zeros: int
    probes: int
    moments: Floats
    wrong: Floats
    polynomials: Floats
    weight: Floats
    regression: Floats
    cells: Floats

    def of(self, functionals: Floats) -> tuple[Floats, Floats]:
        """(f,) values of (f, c) functionals for the modes that are not zero; (f, nodes) factors of their covariance.

        With random signs a functional varies by 2 / probes of the trace of its square (Avron, Toledo, *J. ACM* 58,
        2011), less what the known moments explain: they are control variates.
        """
        values = functionals @ self.polynomials
        explained = values @ self.regression.T
        known = len(self.wrong)
        spread = (values - explained @ self.polynomials[:known]) * np.sqrt(2 / self.probes * self.weight)
        # each of the zeros contributes T_k(-1)
        others = self.moments - self.zeros * np.where(np.arange(len(self.moments)) % 2, -1.0, 1.0)
        return functionals @ others - explained @ self.wrong, spread

    def damped(self, functionals: Floats, counts: Floats) -> Floats:
        """The functionals of densities that are given by their (nodes + 1, d) counts at the cells' ends."""
        return np.asarray(functionals @ (self.polynomials @ np.diff(counts, axis=0)))


def _sampled(moments: Floats, known: Floats, probes: int, zeros: int) -> _Sample:
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
    """(x,) modes below each eigenvalue, (x,) their variances, and the variance of the modes of a band about the law.

    The law is the lattice's and the boundary's share with what this mesh departs from them, and the scatter of each
    band: y = A (expected + departures) + F scatter + noise, all with normal priors, all seen through the same damped
    polynomials.
    """
    n = sample.n
    ends = np.linspace(0, np.arccos(1 - _FITTED_TO), _BANDS + 1)
    bands = np.diff(_steps(1 - np.cos(ends), len(sample.moments)), axis=0)
    y, spread = sample.of(bands)
    A = sample.damped(bands, _law(sample.cells))
    F = sample.damped(bands, _filled(sample.cells, ends))
    # a vertex on the boundary has half the area of one inside; Weyl's second term is the length over 4 pi, times the
    # wave number, which is the root of 4 lambda per edge
    expected = np.array([n - boundary / 2, 0.0, 0.0, boundary / (2 * np.pi)])
    along, across = _BOUNDARY_PRIOR
    prior = np.array([*(n * s for s in _LATTICE_PRIOR), (along * boundary + across * np.sqrt(n)) / np.pi]) ** 2
    # the rounding of the moments, so that the matrix is definite whatever was measured
    covariance = spread @ spread.T + (A * prior) @ A.T + 1e-9 * n * np.eye(_BANDS)

    # in the basis U, covariance + v F F^T is the diagonal 1 + v gain: every v is tried at no price
    gain, U = scipy.linalg.eigh(F @ F.T, covariance)
    residual = U.T @ (y - A @ expected)
    total = 1 + np.outer(_SCATTER, np.maximum(gain, 0.0))
    best = np.argmin((residual**2 / total + np.log(total)).sum(axis=1))  # minus twice the logarithm of the likelihood
    scatter, total = float(_SCATTER[best]), total[best]

    law, filled = _law(eigenvalues), _filled(eigenvalues, ends)
    shared = ((law * prior) @ A.T + scatter * filled @ F.T) @ U  # covariance of the counts with what was measured
    below = sample.zeros + law @ expected + shared @ (residual / total)
    variance = law**2 @ prior + scatter * (filled**2).sum(axis=1) - shared**2 @ (1 / total)
    return below, np.maximum(variance, 0.0), scatter


def _count_by_moments(sample: _Sample, eigenvalues: Floats) -> tuple[Floats, Floats]:
    """(x,) modes below each eigenvalue and (x,) their variances, well inside the spectrum."""
    steps = _steps(eigenvalues, len(sample.moments))
    count, spread = sample.of(steps)
    # what the finite resolution blurs of the lattice's density; it is half as sure as it is large
    blur = (sample.n - sample.zeros) * (
        lattice_fraction(eigenvalues) - sample.damped(steps, lattice_fraction(sample.cells))
    )
    return sample.zeros + count + blur, (spread**2).sum(axis=1) + (blur / 2) ** 2


def _law(eigenvalues: Floats) -> Floats:
    """(x, 4): the lattice's modes below each eigenvalue, with two slow departures from it, and a boundary's."""
    share = lattice_fraction(eigenvalues)
    return np.stack([share, share * eigenvalues, share * eigenvalues**2, np.sqrt(np.minimum(eigenvalues, 1.0))], axis=1)


def _filled(eigenvalues: Floats, ends: Floats) -> Floats:
    """(x, b): the part of each band of angles that lies below each eigenvalue."""
    angle = np.arccos(1 - eigenvalues)
    return np.clip((angle[:, None] - ends[:-1]) / np.diff(ends), 0, 1)


def random_signs(n: int, count: int) -> Floats:
    """(n, count) seeded vectors of +1 and -1: their mean energy in a band is the number of modes in it."""
    drawn = np.random.default_rng(SEED).bytes(-(-n * count // 8))
    bits = np.unpackbits(np.frombuffer(drawn, np.uint8), count=n * count).reshape(n, count)
    return np.asarray(2.0 * bits - 1.0, dtype=np.float64)


def band_energies(L: Laplacian, X: Floats, angles: Floats) -> Floats:
    """Energy x^T D x of X in each band of the spectrum, summed over its columns x.

    Parameters
    ----------
    L : Laplacian
    X : (n, k) float64
    angles : (b + 1,) float64
        Ends of the bands as arccos(1 - eigenvalue), rising in [0, pi].

    Returns
    -------
    (b,) float64
    """
    moments = _moments(L, X, max(2 * len(angles), _LEAST_BAND_DEGREE))
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
        # 2 T_k T_k = T_2k + T_0 and 2 T_k T_k-1 = T_2k-1 + T_1: two moments a sweep
        square, product = L.inner_products(now, before)
        if k == 1:
            moments[1] = product
        moments[2 * k - 1] = 2 * product - moments[1]
        moments[2 * k] = 2 * square - moments[0]
    return moments


def _jackson(count: int) -> Floats:
    """(count,) factors that keep a truncated Chebyshev series of a density from going negative."""
    k = np.arange(count)
    q = np.pi / (count + 1)
    return np.asarray(((count - k + 1) * np.cos(q * k) + np.sin(q * k) / np.tan(q)) / (count + 1))


def _steps(eigenvalues: Floats, count: int) -> Floats:
    """(x, count): the modes below each eigenvalue as coefficients on the moments, damped by Jackson's kernel."""
    k = np.arange(1, count)
    # lambda = 1 + cos(t); modes below it have angles from t to pi, where T_k integrates to -sin(k t) / k
    t = np.arccos(np.clip(eigenvalues - 1, -1, 1))
    series = -2 * _jackson(count)[1:] / k * np.sin(np.outer(t, k))
    return np.concatenate([(np.pi - t)[:, None], series], axis=1) / np.pi

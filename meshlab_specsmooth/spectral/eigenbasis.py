"""h(L) X with eigenvectors: the book way, for small meshes, for reference and for teaching."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy.linalg
from scipy.sparse import csr_array, eye_array
from scipy.sparse.csgraph import connected_components
from scipy.sparse.linalg import eigsh

from meshlab_specsmooth.errors import TooLarge
from meshlab_specsmooth.graph.laplacian import Laplacian
from meshlab_specsmooth.response import Response
from meshlab_specsmooth.spectral.cutoff import WEYL, Cutoff
from meshlab_specsmooth.spectral.progress import Progress
from meshlab_specsmooth.surface import Floats

# Bytes that the eigenvectors may take; the solver's own work space is about twice that again.
MEMORY_LIMIT = 2 * 2**30

# Eigenvalues this close, on a spectrum that is 2 wide, are equal but for rounding
SAME_EIGENVALUE = 1e-10

SEED = 2010  # any number, fixed

# Up to this many vertices the dense solver is as fast as the sparse one
DENSE_VERTICES = 1000


@dataclass(frozen=True, eq=False)
class Eigenbasis:
    """The lowest eigenpairs of S, orthonormal.

    Attributes
    ----------
    eigenvalues : (k,) float64, ascending
    vectors : (n, k) float64
    """

    eigenvalues: Floats
    vectors: Floats

    def kept(self, modes: int) -> int:
        """How many modes are kept when so many are asked for: equal eigenvalues stay together, or neither is itself.

        The null space of a surface is as large as it has components, and symmetric surfaces have pairs.
        """
        values = self.eigenvalues
        while modes < len(values) and values[modes] - values[modes - 1] <= SAME_EIGENVALUE:
            modes += 1
        return modes

    def cutoff(self, modes: int) -> Cutoff:
        """Halfway between the last eigenvalue kept and the first dropped."""
        values, kept = self.eigenvalues, self.kept(modes)
        last = 2.0 if kept == len(values) else float(values[kept - 1] + values[kept]) / 2
        return Cutoff(last, kept, 0.0)


@dataclass(frozen=True, eq=False)
class Projection:
    """A response on an eigenbasis; what lies beyond its last eigenpair is dropped.

    Attributes
    ----------
    basis : Eigenbasis
    response : Response
        Zero beyond the basis, or the basis is complete.
    """

    basis: Eigenbasis
    response: Response
    degree: int = 0
    error: float = 0.0

    def apply(self, L: Laplacian, X: Floats, progress: Progress | None = None) -> Floats:
        """D^-1/2 U h(Lambda) U^T D^1/2 X: the projection is in the D-inner product, where L is symmetric."""
        U, root = self.basis.vectors, np.sqrt(L.degree)
        return np.asarray(U @ (self.response(self.basis.eigenvalues)[:, None] * (U.T @ (X * root)))) / root


def complete(S: csr_array) -> Eigenbasis:
    """All eigenpairs of S; raises :class:`TooLarge` as :func:`lowest` does."""
    return lowest(S, S.shape[0])


def covering(S: csr_array, count: int) -> Eigenbasis:
    """The lowest eigenpairs, ``count`` of them, those equal to the last, and one beyond, or all.

    Raises :class:`TooLarge` as :func:`lowest` does.
    """
    return _enough(S, count + 1, lambda basis: basis.kept(count) < len(basis.eigenvalues))


def below(S: csr_array, cutoff: Cutoff) -> Eigenbasis:
    """The eigenpairs up to the cut-off, and at least one beyond it; raises :class:`TooLarge` as :func:`lowest` does."""
    count = int(1.25 * cutoff.modes) + 2
    return _enough(S, count, lambda basis: basis.eigenvalues[-1] > cutoff.eigenvalue)


def _enough(S: csr_array, count: int, suffices: Callable[[Eigenbasis], bool]) -> Eigenbasis:
    """The lowest ``count`` eigenpairs, or twice as many until they suffice, or all."""
    n = S.shape[0]
    while True:
        basis = lowest(S, min(count, n))
        if count >= n or suffices(basis):
            return basis
        count *= 2


def lowest(S: csr_array, count: int) -> Eigenbasis:
    """The ``count`` lowest eigenpairs of S.

    Every connected component is solved by itself: together they have a null space of many dimensions, which the
    iterative solver does not find in full.

    Parameters
    ----------
    S : (n, n) csr_array
        Symmetric, spectrum inside [0, 2].
    count : int
        1 to n.

    Raises
    ------
    TooLarge
        The eigenvectors would not fit; names the size.
    """
    n = S.shape[0]
    if n == 0:
        return Eigenbasis(np.empty(0), np.empty((0, 0)))
    number, label = connected_components(S, directed=False)
    members = np.split(np.argsort(label, kind="stable"), np.cumsum(np.bincount(label, minlength=number))[:-1])
    needed = 8 * max(n * count, *(len(m) * _columns(len(m), min(count, len(m))) for m in members))
    if needed > MEMORY_LIMIT:
        raise TooLarge(
            f"{count} eigenvectors of {n} vertices need {needed / 2**30:.1f} GiB (limit "
            f"{MEMORY_LIMIT / 2**30:.0f}); use method='chebyshev', which needs none"
        )
    parts = [_lowest_of_component(S[m][:, m].tocsr(), min(count, len(m))) for m in members]
    values = np.concatenate([values for values, _ in parts])
    order = np.argsort(values, kind="stable")[:count]
    vectors = np.zeros((n, len(order)))
    column = np.full(len(values), -1)
    column[order] = np.arange(len(order))
    start = 0
    for rows, (own, basis) in zip(members, parts, strict=True):
        wanted = column[start : start + len(own)]
        vectors[np.ix_(rows, wanted[wanted >= 0])] = basis[:, wanted >= 0]
        start += len(own)
    return Eigenbasis(values[order], vectors)


def _columns(n: int, count: int) -> int:
    """Vectors that the solver of a component with n vertices holds."""
    return n if _is_dense(n, count) else 2 * count


def _is_dense(n: int, count: int) -> bool:
    # the sparse solver cannot find more than n - 1 pairs and is no faster when asked for many
    return n <= DENSE_VERTICES or count > n // 2


def _lowest_of_component(S: csr_array, count: int) -> tuple[Floats, Floats]:
    n = S.shape[0]
    if _is_dense(n, count):
        values, vectors = scipy.linalg.eigh(S.toarray(), subset_by_index=(0, count - 1))
    else:
        # S is singular, so it is shifted to S + shift I, by the scale of the eigenvalues sought
        shift = WEYL * count / n / 4
        # a fixed start, so that two runs agree to the bit; not the constant, which is nearly an eigenvector
        start = np.random.default_rng(SEED).standard_normal(n)
        values, vectors = eigsh((S + shift * eye_array(n)).tocsc(), k=count, sigma=0, v0=start)
        order = np.argsort(values)
        values, vectors = values[order] - shift, vectors[:, order]
    # what is zero but for rounding is zero, so that no cut-off falls below it
    return np.where(values < SAME_EIGENVALUE, 0.0, values), vectors

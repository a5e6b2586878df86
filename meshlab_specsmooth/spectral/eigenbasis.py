"""h(S) X with eigenvectors: the book way, for small meshes, for reference and for teaching."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.linalg
from scipy.sparse import csr_array, eye_array
from scipy.sparse.linalg import eigsh

from meshlab_specsmooth.errors import TooLarge
from meshlab_specsmooth.response import Response
from meshlab_specsmooth.spectral.cutoff import WEYL, Cutoff
from meshlab_specsmooth.spectral.progress import Progress
from meshlab_specsmooth.surface import Floats

# Bytes that the eigenvectors may take; the solver's own work space is about twice that again.
MEMORY_LIMIT = 2 * 2**30

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

    def cutoff(self, modes: int) -> Cutoff:
        """Halfway between the last eigenvalue kept and the first dropped."""
        values = self.eigenvalues
        n = len(self.vectors)
        last = 2.0 if modes == n else float(values[modes - 1] + values[modes]) / 2
        # the lowest eigenvalue is 0 but for rounding, and a mesh of several components has several
        return Cutoff(min(max(last, np.finfo(np.float64).eps), 2.0), modes, 0.0)


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

    def apply(self, S: csr_array, X: Floats, progress: Progress | None = None) -> Floats:
        """U h(Lambda) U^T X."""
        U = self.basis.vectors
        return np.asarray(U @ (self.response(self.basis.eigenvalues)[:, None] * (U.T @ X)))


def complete(S: csr_array) -> Eigenbasis:
    """All eigenpairs of S; raises :class:`TooLarge` as :func:`lowest` does."""
    return lowest(S, S.shape[0])


def below(S: csr_array, cutoff: Cutoff) -> Eigenbasis:
    """The eigenpairs up to the cut-off, and at least one beyond it; raises :class:`TooLarge` as :func:`lowest` does."""
    n = S.shape[0]
    count = min(n, int(1.25 * cutoff.modes) + 2)
    while True:
        basis = lowest(S, count)
        if count == n or basis.eigenvalues[-1] > cutoff.eigenvalue:
            return basis
        count = min(n, 2 * count)


def lowest(S: csr_array, count: int) -> Eigenbasis:
    """The ``count`` lowest eigenpairs of S.

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
    # the sparse solver cannot find more than n - 1 pairs and is no faster when asked for many
    dense = n <= DENSE_VERTICES or count > n // 2
    needed = 8 * n * (n if dense else 2 * count)
    if needed > MEMORY_LIMIT:
        raise TooLarge(
            f"{count} eigenvectors of {n} vertices need {needed / 2**30:.1f} GiB (limit "
            f"{MEMORY_LIMIT / 2**30:.0f}); use method='chebyshev', which needs none"
        )
    if dense:
        values, vectors = scipy.linalg.eigh(S.toarray(), subset_by_index=(0, count - 1))
        return Eigenbasis(values, vectors)
    # S is singular, so it is shifted to S + shift I, by the scale of the eigenvalues sought
    shift = WEYL * count / n / 4
    # a fixed start, so that two runs agree to the bit; not the constant, which is nearly an eigenvector
    start = np.random.default_rng(SEED).standard_normal(n)
    values, vectors = eigsh((S + shift * eye_array(n)).tocsc(), k=count, sigma=0, v0=start)
    order = np.argsort(values)
    return Eigenbasis(values[order] - shift, vectors[:, order])

"""h(L) X with eigenvectors: the textbook method, for small meshes and for reference."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy.linalg
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

from meshlab_specsmooth.arrays import Floats
from meshlab_specsmooth.errors import TooLarge
from meshlab_specsmooth.graph.laplacian import Laplacian
from meshlab_specsmooth.runtime import blocks
from meshlab_specsmooth.runtime.progress import Progress, subrange
from meshlab_specsmooth.runtime.workspace import Workspace
from meshlab_specsmooth.spectral.cutoff import Cutoff
from meshlab_specsmooth.spectral.inertia import SAME_EIGENVALUE, factor_bytes
from meshlab_specsmooth.spectral.lanczos import basis_size, lowest_eigenpairs
from meshlab_specsmooth.spectral.response import Response

# Maximum size of the eigenvectors, the solver's basis and its factorization together, in bytes
MEMORY_LIMIT = 2 * 2**30

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
        """Number of modes kept when ``modes`` are asked for: equal eigenvalues are never separated.

        The eigenvectors of a multiple eigenvalue are arbitrary, but their span is not. The null space has one dimension
        for each component of the surface, and symmetric surfaces have pairs of equal eigenvalues.
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
    """A response on an eigenbasis; modes beyond its last eigenpair are dropped.

    Attributes
    ----------
    basis : Eigenbasis
    response : Response
        Zero beyond the basis, unless the basis is complete.
    """

    basis: Eigenbasis
    response: Response
    degree: int = 0
    error: float = 0.0

    def apply(
        self, L: Laplacian, X: Floats, progress: Progress | None = None, workspace: Workspace | None = None
    ) -> Floats:
        """D^-1/2 U h(Lambda) U^T D^1/2 X: a projection in the D-inner product, in which L is symmetric."""
        U, root = self.basis.vectors, np.sqrt(L.degree)
        with blocks.one_blas_thread():
            return np.asarray(U @ (self.response(self.basis.eigenvalues)[:, None] * (U.T @ (X * root)))) / root


def full(S: csr_array, progress: Progress | None = None) -> Eigenbasis:
    """Compute all eigenpairs of S; raises as :func:`lowest` does."""
    return lowest(S, S.shape[0], progress)


def lowest_with_gap(S: csr_array, count: int, progress: Progress | None = None) -> Eigenbasis:
    """Compute the ``count`` lowest eigenpairs, those equal to the last, and one beyond, or all.

    Raises as :func:`lowest` does.
    """
    return _double_until(S, count + 1, lambda basis: basis.kept(count) < len(basis.eigenvalues), progress)


def up_to(S: csr_array, cutoff: Cutoff, progress: Progress | None = None) -> Eigenbasis:
    """Compute the eigenpairs up to the cut-off, and at least one beyond it; raises as :func:`lowest` does."""
    count = int(1.25 * cutoff.modes) + 2
    return _double_until(S, count, lambda basis: basis.eigenvalues[-1] > cutoff.eigenvalue, progress)


def _double_until(
    S: csr_array, count: int, suffices: Callable[[Eigenbasis], bool], progress: Progress | None
) -> Eigenbasis:
    """Compute the lowest ``count`` eigenpairs, and twice as many until they suffice, or all."""
    n = S.shape[0]
    done = 0.0
    while True:
        # a further run takes more than twice as long as the one before
        fraction = (1 - done) / 2 if count < n else 1 - done
        basis = lowest(S, min(count, n), subrange(progress, done, fraction))
        if count >= n or suffices(basis):
            if progress is not None:
                progress(1.0)
            return basis
        count *= 2
        done += fraction


def lowest(S: csr_array, count: int, progress: Progress | None = None) -> Eigenbasis:
    """Compute the ``count`` lowest eigenpairs of S.

    Every connected component is solved separately: together they have a null space of many dimensions, which the
    iterative solver does not find completely.

    Parameters
    ----------
    S : (n, n) csr_array
        Symmetric, spectrum inside [0, 2].
    count : int
        1 to n.
    progress : callable, optional
        Called with the fraction done.

    Raises
    ------
    TooLarge
        The eigenvectors and the solver's work space would not fit in memory; the message gives the size.
    NotConverged
        Eigenpairs are missing, by count, or not accurate; the message gives the figures.
    """
    n = S.shape[0]
    if n == 0:
        return Eigenbasis(np.empty(0), np.empty((0, 0)))
    number, label = connected_components(S, directed=False)
    members = np.split(np.argsort(label, kind="stable"), np.cumsum(np.bincount(label, minlength=number))[:-1])
    needed = max(8 * n * count, *(_bytes(len(m), min(count, len(m))) for m in members))
    if needed > MEMORY_LIMIT:
        raise TooLarge(
            f"{count} eigenvectors of {n} vertices need {needed / 2**30:.1f} GiB (limit "
            f"{MEMORY_LIMIT / 2**30:.0f}); use method='chebyshev', which needs none"
        )
    parts = []
    with blocks.one_blas_thread():
        for m, start in zip(members, np.cumsum([0, *map(len, members)]), strict=False):
            own = subrange(progress, start / n, len(m) / n)
            parts.append(_lowest_of_component(S[m][:, m].tocsr(), min(count, len(m)), own))
    if number == 1:
        return Eigenbasis(*parts[0])
    values = np.concatenate([values for values, _ in parts])
    order = np.argsort(values, kind="stable")[:count]
    vectors = np.zeros((n, len(order)))
    column = np.full(len(values), -1)
    column[order] = np.arange(len(order))
    start = 0
    for rows, (own_values, basis) in zip(members, parts, strict=True):
        wanted = column[start : start + len(own_values)]
        vectors[np.ix_(rows, wanted[wanted >= 0])] = basis[:, wanted >= 0]
        start += len(own_values)
    return Eigenbasis(values[order], vectors)


def _bytes(n: int, count: int) -> float:
    """Memory that the solver takes for a component with n vertices."""
    if _is_dense(n, count):
        return 8 * n * n
    # the Lanczos basis, and the result or the vectors found earlier
    return 8 * n * (basis_size(count) + 2 * count) + factor_bytes(n)


def _is_dense(n: int, count: int) -> bool:
    # the Lanczos basis for many pairs would be the whole space
    return n <= DENSE_VERTICES or basis_size(count) + count > n


def _lowest_of_component(S: csr_array, count: int, progress: Progress | None) -> tuple[Floats, Floats]:
    if _is_dense(S.shape[0], count):
        values, vectors = scipy.linalg.eigh(S.toarray(), subset_by_index=(0, count - 1))
    else:
        values, vectors = lowest_eigenpairs(S, count, progress)
    if progress is not None:
        progress(1.0)
    # eigenvalues that are zero to rounding become zero, so that no cut-off falls below them
    return np.where(values < SAME_EIGENVALUE, 0.0, values), vectors

"""h(L) X with eigenvectors: the textbook method, for small meshes, for reference and for teaching."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy.linalg
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

from meshlab_specsmooth.arrays import Floats
from meshlab_specsmooth.errors import NotConverged, TooLarge
from meshlab_specsmooth.graph.laplacian import Laplacian
from meshlab_specsmooth.runtime import blocks
from meshlab_specsmooth.runtime.progress import Progress, part
from meshlab_specsmooth.spectral.cutoff import WEYL, Cutoff
from meshlab_specsmooth.spectral.inertia import SAME_EIGENVALUE, Factored, factor_bytes, factored
from meshlab_specsmooth.spectral.response import Response

# Bytes that the eigenvectors, the solver's basis and its factorization may take together
MEMORY_LIMIT = 2 * 2**30

SEED = 2010  # any number, fixed

# Up to this many vertices the dense solver is as fast as the sparse one
DENSE_VERTICES = 1000

# Vectors in a block of the Lanczos method. Measured on 37k vertices, 200 pairs: blocks of 4 need 380 solves, blocks of
# 8 need 440 and less time to be orthogonalized; in all they take as long, to within the noise of the machine. SuperLU
# solves four columns in half the time of four single ones; eight gain no more, and lose where BLAS has threads.
BLOCK = 8
_SOLVED_TOGETHER = 4

# The shift leaves this share of the wanted eigenvalues below it. On 37k vertices, 200 pairs in blocks of 4 take 380
# solves with a shift of a half or two thirds of the last eigenvalue, 420 with a third, 520 to 540 just below zero.
_SHARE_BELOW, _LEAST_BELOW = 0.6, 0.3
_SHIFTS = 4

# |S u - lambda u| that an eigenpair may have, u a unit vector: asked of the solver, and checked with S itself
_WANTED_RESIDUAL = 1e-9
_RESIDUAL = 1e-8

# The basis is orthogonal to rounding when a block is cleaned and loses it by a factor a block. It stays below the
# root of eps, as it must for T to be the projection of the operator to rounding (Simon, Math. Comp. 42, 1984)
_LOSS = 1e-9

# What is left of a block may be rounding below this share of the operator's norm, and is below that
_DOUBTFUL, _EXHAUSTED = 1e-6, 1e-11

# The Lanczos basis holds at most so many vectors a wanted pair (200 pairs take 2.2) and a few blocks
_BASIS, _BASIS_LEAST = 2.5, 20 * BLOCK

# Where very many eigenvalues are equal they are counted this share of themselves below, if not nearer
_REACH = 1e-5


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

    def apply(
        self, L: Laplacian, X: Floats, progress: Progress | None = None, spare: list[Floats] | None = None
    ) -> Floats:
        """D^-1/2 U h(Lambda) U^T D^1/2 X: the projection is in the D-inner product, where L is symmetric."""
        U, root = self.basis.vectors, np.sqrt(L.degree)
        with blocks.one_blas_thread():
            return np.asarray(U @ (self.response(self.basis.eigenvalues)[:, None] * (U.T @ (X * root)))) / root


def full(S: csr_array, progress: Progress | None = None) -> Eigenbasis:
    """All eigenpairs of S; raises as :func:`lowest` does."""
    return lowest(S, S.shape[0], progress)


def lowest_with_gap(S: csr_array, count: int, progress: Progress | None = None) -> Eigenbasis:
    """The lowest eigenpairs, ``count`` of them, those equal to the last, and one beyond, or all.

    Raises as :func:`lowest` does.
    """
    return _double_until(S, count + 1, lambda basis: basis.kept(count) < len(basis.eigenvalues), progress)


def up_to(S: csr_array, cutoff: Cutoff, progress: Progress | None = None) -> Eigenbasis:
    """The eigenpairs up to the cut-off, and at least one beyond it; raises as :func:`lowest` does."""
    count = int(1.25 * cutoff.modes) + 2
    return _double_until(S, count, lambda basis: basis.eigenvalues[-1] > cutoff.eigenvalue, progress)


def _double_until(
    S: csr_array, count: int, suffices: Callable[[Eigenbasis], bool], progress: Progress | None
) -> Eigenbasis:
    """The lowest ``count`` eigenpairs, or twice as many until they suffice, or all."""
    n = S.shape[0]
    done = 0.0
    while True:
        # another run takes more than twice as long as the one before
        share = (1 - done) / 2 if count < n else 1 - done
        basis = lowest(S, min(count, n), part(progress, done, share))
        if count >= n or suffices(basis):
            if progress is not None:
                progress(1.0)
            return basis
        count *= 2
        done += share


def lowest(S: csr_array, count: int, progress: Progress | None = None) -> Eigenbasis:
    """The ``count`` lowest eigenpairs of S.

    Every connected component is solved by itself: together they have a null space of many dimensions, which the
    iterative solver does not find in full.

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
        The eigenvectors and the solver's own work space would not fit; names the size.
    NotConverged
        Eigenpairs are missing, by count, or not accurate; names the figures.
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
            own = part(progress, start / n, len(m) / n)
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
    """What the solver of a component with n vertices holds."""
    if _is_dense(n, count):
        return 8 * n * n
    # the Lanczos basis, and the result or the vectors found before
    return 8 * n * (_capacity(count) + 2 * count) + factor_bytes(n)


def _capacity(count: int) -> int:
    return int(_BASIS * count) + _BASIS_LEAST


def _is_dense(n: int, count: int) -> bool:
    # the Lanczos basis for many pairs would be the whole space
    return n <= DENSE_VERTICES or _capacity(count) + count > n


def _lowest_of_component(S: csr_array, count: int, progress: Progress | None) -> tuple[Floats, Floats]:
    if _is_dense(S.shape[0], count):
        values, vectors = scipy.linalg.eigh(S.toarray(), subset_by_index=(0, count - 1))
    else:
        values, vectors = _by_lanczos(S, count, progress)
    if progress is not None:
        progress(1.0)
    # what is zero but for rounding is zero, so that no cut-off falls below it
    return np.where(values < SAME_EIGENVALUE, 0.0, values), vectors


def _by_lanczos(S: csr_array, count: int, progress: Progress | None) -> tuple[Floats, Floats]:
    """(count,) eigenvalues and (n, count) eigenvectors of a connected S, none missed.

    A Krylov space holds no more copies of an eigenvalue than its blocks have vectors. So those found are counted, and
    what is missing is looked for in the complement of the eigenvectors found, from another random block.
    """
    n = S.shape[0]
    shifted = _shifted(S, count)
    random = np.random.default_rng(SEED)  # seeded, so that two runs agree to the bit
    values, vectors = np.empty(0), np.empty((n, 0), order="F")
    low, high = shifted.below, count - shifted.below  # missing below the shift and above
    while low + high > 0:
        done = len(values) / (len(values) + low + high)
        own = part(progress, 0.95 * done, 0.95 * (1 - done))
        found, more = _lanczos(shifted, vectors, low, high, random, own)
        if len(found) == 0:
            raise NotConverged(f"of the {count} lowest eigenpairs of {n} vertices, {low + high} were not found")
        values = np.concatenate([values, found])
        vectors = np.hstack([vectors, more]) if vectors.shape[1] else more  # no copy of all, as a rule
        low = shifted.below - int((values < shifted.eigenvalue).sum())
        high = count - shifted.below - int((values > shifted.eigenvalue).sum())
        if low + high <= 0:
            # Just below the last, not beyond it: where the next eigenvalue lies need not be known, nor how many equal
            # the last. By how much is what an eigenpair is known to. What lies below the shift was counted there.
            last = np.sort(values)[count - 1] - _RESIDUAL
            if last > shifted.eigenvalue:
                check = factored(S, last, reach=-_REACH)
                # of many missing no more are needed than were asked for
                high = min(count, check.below - int((values < check.eigenvalue).sum()))
    values, residual = _rayleigh(S, vectors)
    if not residual < _RESIDUAL:
        raise NotConverged(f"the eigenpairs of {n} vertices have residuals up to {residual:.1e}, not {_RESIDUAL:.0e}")
    order = np.argsort(values, kind="stable")[:count]
    return values[order], vectors[:, order]


def _shifted(S: csr_array, count: int) -> Factored:
    """S less a shift amid the ``count`` lowest eigenvalues, from Weyl's law and by count where that does not hold."""
    shift = _SHARE_BELOW * WEYL * count / S.shape[0]
    best: Factored | None = None
    tries = 0
    # equal eigenvalues may leave no shift with a good share below it, but below the second eigenvalue there is one
    while best is None or (best.below < _LEAST_BELOW * count and tries < _SHIFTS):
        shifted = factored(S, shift)
        if shifted.below <= count and (best is None or shifted.below > best.below):
            best = shifted
        shift = min(1.9, shift * float(np.clip(_SHARE_BELOW * count / shifted.below, 0.1, 4)))
        tries += 1
    return best


def _rayleigh(S: csr_array, vectors: Floats) -> tuple[Floats, float]:
    """Rayleigh quotients of unit vectors with S itself, and the largest |S u - lambda u|."""
    values, residual = np.empty(vectors.shape[1]), 0.0
    for start in range(0, len(values), 16):  # sixteen at a time: all at once would be another basis in memory
        U = vectors[:, start : start + 16]
        product = S @ U
        own = np.einsum("ij,ij->j", U, product)
        values[start : start + 16] = own
        residual = max(residual, float(np.linalg.norm(product - U * own, axis=0).max()))
    return values, residual


def _lanczos(
    shifted: Factored, found: Floats, low: int, high: int, random: np.random.Generator, progress: Progress | None
) -> tuple[Floats, Floats]:
    """Eigenpairs of S in the complement of those found: the ``low`` below the shift and the next ``high`` above it.

    As many of them as one Krylov space holds. Block Lanczos for the inverse of S - shift I: the eigenvalues next to the
    shift are at the two ends of its spectrum. Orthogonality is lost slowly, by a factor that is known at each block, so
    several blocks are cleaned at once and in one pass, by products of large matrices.
    """
    n, count = len(found), low + high
    capacity = min(_capacity(count), n - found.shape[1])
    Q = np.empty((n, capacity + BLOCK), order="F")
    T = np.zeros((capacity + BLOCK, capacity + BLOCK))
    Q[:, :BLOCK] = _start(found, random)
    before, first, end, clean = 0, 0, BLOCK, BLOCK  # the last two blocks are before:first and first:end
    rounding = float(np.sqrt(n) * np.finfo(np.float64).eps)  # of an inner product of unit vectors
    norm, loss, check = 0.0, rounding, max(int(1.9 * count), 6 * BLOCK)
    while True:
        # 1. the operator, less its part in the last two blocks (in the others it has none but for rounding)
        W = _solve(shifted, Q[:, first:end])
        near = Q[:, before:end]
        inner = _removed(W, near)
        _removed(W, near)
        T[first:end, first:end] = (inner[first - before :] + inner[first - before :].T) / 2
        norm = max(norm, abs(T[before:end, before:end]).sum(axis=1).max())  # no less than that of T so far, in the end
        # 2. a basis of the rest. It has fewer vectors where the Krylov space is exhausted
        basis, left, size, right = _svd(W)
        if size[-1] < _DOUBTFUL * norm:  # what is left may be rounding, and lie in the basis
            for old in (found, Q[:, :end]):
                _removed(W, old)
            basis, left, size, right = _svd(W)
        rank = int((size > _EXHAUSTED * norm).sum())
        coupling = size[:rank, None] * right[:rank]
        before, first, end = first, end, end + rank
        # 3. Ritz pairs, from time to time
        full = rank == 0 or end + BLOCK > capacity
        if first >= check or full:
            theta, Y = np.linalg.eigh(T[:first, :first])
            wanted = np.unique(np.r_[: min(low, (theta < 0).sum()), first - min(high, (theta > 0).sum()) : first])
            theta, Y = theta[wanted], Y[:, wanted]
            # |S u - lambda u| = |(S - shift I) r| / |theta| for the residual r of the inverse, and |S| = 2
            good = 2 * np.linalg.norm(coupling @ Y[before:first], axis=0) < _WANTED_RESIDUAL * abs(theta)
            if full or (len(wanted) == count and good.all()):
                return shifted.eigenvalue + 1 / theta[good], _rotated(Q, Y[:, good])
            check = first + max(count // 10, BLOCK)
        np.matmul(basis, left[:, :rank], out=Q[:, first:end])
        T[first:end, before:first] = coupling
        T[before:first, first:end] = coupling.T
        # 4. orthogonality, of all blocks since it was last seen to
        growth = norm / size[rank - 1]
        loss *= growth
        if loss * growth > _LOSS:
            new = Q[:, clean:end]
            for old in (found, Q[:, :clean]):
                _removed(new, old)
            loss, clean = rounding, end
        if progress is not None:
            progress(min(1.0, end / (2.2 * count + 6 * BLOCK)))


def _start(found: Floats, random: np.random.Generator) -> Floats:
    """(n, BLOCK) a random block, orthonormal and orthogonal to the eigenvectors found."""
    block = random.standard_normal((len(found), BLOCK))
    for _ in range(2):
        block -= found @ (found.T @ block)
        block = np.linalg.qr(block)[0]
    return block


def _removed(W: Floats, basis: Floats) -> Floats:
    """``W`` becomes W - B B^T W for an orthonormal basis B, (n, b); returns B^T W."""
    n, b = basis.shape
    sums = np.empty((blocks.count(n), b, W.shape[1]))

    def inner(first: int, last: int) -> None:
        for i in range(first, last):
            at = blocks.rows(i, n)
            np.matmul(basis[at].T, W[at], out=sums[i])

    def subtract(first: int, last: int) -> None:
        for i in range(first, last):
            at = blocks.rows(i, n)
            W[at] -= basis[at] @ product

    blocks.in_threads(inner, n, b)
    product = sums.sum(axis=0)
    blocks.in_threads(subtract, n, b)
    return np.asarray(product)


def _solve(shifted: Factored, X: Floats) -> Floats:
    """(S - shift I)^-1 X, a few columns at a time, in threads."""
    solution = np.empty_like(X)

    def work(start: int) -> None:
        columns = slice(start, start + _SOLVED_TOGETHER)
        solution[:, columns] = shifted.lu.solve(X[:, columns])

    blocks.each(work, range(0, X.shape[1], _SOLVED_TOGETHER))
    return solution


def _svd(W: Floats) -> tuple[Floats, Floats, Floats, Floats]:
    """W = Q (U s V^T), for a few long columns."""
    basis, triangle = np.linalg.qr(W)
    left, size, right = np.linalg.svd(triangle)
    return basis, left, size, right


def _rotated(Q: Floats, Y: Floats) -> Floats:
    """Q Y for the first columns of Q, written over them."""
    m, k = Y.shape

    def work(first: int, last: int) -> None:
        for i in range(first, last):
            at = blocks.rows(i, len(Q))
            Q[at, :k] = Q[at, :m] @ Y

    blocks.in_threads(work, len(Q), m)
    return Q[:, :k]

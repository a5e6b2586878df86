"""The lowest eigenpairs of a large connected graph, by a shift-invert block Lanczos method with checked counts."""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_array

from meshlab_specsmooth.arrays import Floats
from meshlab_specsmooth.errors import NotConverged
from meshlab_specsmooth.runtime import blocks
from meshlab_specsmooth.runtime.progress import Progress, subrange
from meshlab_specsmooth.spectral.cutoff import WEYL
from meshlab_specsmooth.spectral.inertia import ShiftedFactor, factorize

SEED = 2010  # arbitrary, fixed so that two runs agree to the bit

# Vectors in a block. Measured on 37k vertices, 200 pairs: blocks of 4 need 380 solves, blocks of 8 need 440 but less
# time for orthogonalization; the totals are equal within the noise of the machine. SuperLU solves four columns in half
# the time of four single ones; eight gain no more, and lose where BLAS has threads.
# docs/constants.md: BLOCK
BLOCK = 8
_SOLVED_TOGETHER = 4

# Fraction of the wanted eigenvalues below the shift, as aimed at and at least. On 37k vertices, 200 pairs in blocks of
# 4 take 380 solves with a shift of a half or two thirds of the last eigenvalue, 420 with a third, 520 to 540
# just below zero.
# docs/constants.md: _FRACTION_BELOW, _MIN_FRACTION_BELOW
_FRACTION_BELOW, _MIN_FRACTION_BELOW = 0.6, 0.3
# docs/constants.md: _MAX_SHIFTS
_MAX_SHIFTS = 4

# Residual |S u - lambda u| of an eigenpair, u a unit vector: asked of the solver, and checked with S itself
# docs/constants.md: _WANTED_RESIDUAL
_WANTED_RESIDUAL = 1e-9
_MAX_RESIDUAL = 1e-8

# The basis is orthogonal to rounding after a block is reorthogonalized and loses orthogonality by a factor per block.
# The loss stays below the root of eps, as it must for T to be the projection of the operator to rounding (Simon, Math.
# Comp. 42, 1984).
# docs/constants.md: _ORTHOGONALITY_LOSS
_ORTHOGONALITY_LOSS = 1e-9

# Relative to the norm of the operator: below the first, what is left of a block may be rounding; below the second it is
# docs/constants.md: _REORTHOGONALIZE_BELOW, _BREAKDOWN_TOL
_REORTHOGONALIZE_BELOW, _BREAKDOWN_TOL = 1e-6, 1e-11

# Maximum number of vectors in the Lanczos basis: per wanted pair (200 pairs take 2.2), and in addition
# docs/constants.md: _VECTORS_PER_PAIR
_VECTORS_PER_PAIR, _EXTRA_VECTORS = 2.5, 20 * BLOCK

# The final count may be taken this fraction of the last eigenvalue below it, where many eigenvalues are equal
_COUNT_PERTURBATION = 1e-5


def basis_size(count: int) -> int:
    """Maximum number of vectors in the Lanczos basis for a number of eigenpairs."""
    return int(_VECTORS_PER_PAIR * count) + _EXTRA_VECTORS


def lowest_eigenpairs(S: csr_array, count: int, progress: Progress | None) -> tuple[Floats, Floats]:
    """Compute the lowest (count,) eigenvalues and (n, count) eigenvectors of a connected S, without missing any.

    A Krylov space holds no more copies of an eigenvalue than its blocks have vectors. So the pairs found are counted
    against the inertia, and missing ones are searched for in their complement, from another random block.

    Raises
    ------
    NotConverged
        Eigenpairs are missing, by count, or not accurate; the message gives the figures.
    """
    n = S.shape[0]
    shifted = _choose_shift(S, count)
    random = np.random.default_rng(SEED)
    values, vectors = np.empty(0), np.empty((n, 0), order="F")
    low, high = shifted.below, count - shifted.below  # number missing below the shift and above
    while low + high > 0:
        done = len(values) / (len(values) + low + high)
        own = subrange(progress, 0.95 * done, 0.95 * (1 - done))
        found, more = _lanczos(shifted, vectors, low, high, random, own)
        if len(found) == 0:
            raise NotConverged(f"of the {count} lowest eigenpairs of {n} vertices, {low + high} were not found")
        values = np.concatenate([values, found])
        vectors = np.hstack([vectors, more]) if vectors.shape[1] else more  # usually without a copy
        low = shifted.below - int((values < shifted.eigenvalue).sum())
        high = count - shifted.below - int((values > shifted.eigenvalue).sum())
        if low + high <= 0:
            # Counted just below the last eigenvalue, by the accuracy of an eigenpair: neither the next eigenvalue nor
            # the multiplicity of the last need be known. Those below the shift have been counted there.
            last = np.sort(values)[count - 1] - _MAX_RESIDUAL
            if last > shifted.eigenvalue:
                check = factorize(S, last, perturbation=-_COUNT_PERTURBATION)
                # no more are needed than were asked for
                high = min(count, check.below - int((values < check.eigenvalue).sum()))
    values, residual = _rayleigh(S, vectors)
    if not residual < _MAX_RESIDUAL:
        raise NotConverged(
            f"the eigenpairs of {n} vertices have residuals up to {residual:.1e}, not {_MAX_RESIDUAL:.0e}"
        )
    order = np.argsort(values, kind="stable")[:count]
    return values[order], vectors[:, order]


def _choose_shift(S: csr_array, count: int) -> ShiftedFactor:
    """Factorize S at a shift among the ``count`` lowest eigenvalues, from Weyl's law corrected by counts."""
    shift = _FRACTION_BELOW * WEYL * count / S.shape[0]
    best: ShiftedFactor | None = None
    tries = 0
    # equal eigenvalues may leave no shift with a good fraction below it, but there is one below the second eigenvalue
    while best is None or (best.below < _MIN_FRACTION_BELOW * count and tries < _MAX_SHIFTS):
        shifted = factorize(S, shift)
        if shifted.below <= count and (best is None or shifted.below > best.below):
            best = shifted
        shift = min(1.9, shift * float(np.clip(_FRACTION_BELOW * count / shifted.below, 0.1, 4)))
        tries += 1
    return best


def _rayleigh(S: csr_array, vectors: Floats) -> tuple[Floats, float]:
    """Rayleigh quotients of unit vectors with S, and the largest residual |S u - lambda u|."""
    values, residual = np.empty(vectors.shape[1]), 0.0
    for start in range(0, len(values), 16):  # sixteen at a time, to save the memory of another basis
        U = vectors[:, start : start + 16]
        product = S @ U
        own = np.einsum("ij,ij->j", U, product)
        values[start : start + 16] = own
        residual = max(residual, float(np.linalg.norm(product - U * own, axis=0).max()))
    return values, residual


def _lanczos(
    shifted: ShiftedFactor, found: Floats, low: int, high: int, random: np.random.Generator, progress: Progress | None
) -> tuple[Floats, Floats]:
    """Compute eigenpairs of S in the complement of those found: ``low`` below the shift and the next ``high`` above it.

    Returns as many of them as one Krylov space holds. Block Lanczos for the inverse of S - shift I: the eigenvalues
    next to the shift are at the two ends of its spectrum. Orthogonality is lost slowly, by a factor that is known for
    each block, so several blocks are reorthogonalized at once, by products of large matrices.
    """
    n, count = len(found), low + high
    capacity = min(basis_size(count), n - found.shape[1])
    Q = np.empty((n, capacity + BLOCK), order="F")
    T = np.zeros((capacity + BLOCK, capacity + BLOCK))
    Q[:, :BLOCK] = _random_block(found, random)
    before, first, end, clean = 0, 0, BLOCK, BLOCK  # the last two blocks are before:first and first:end
    rounding = float(np.sqrt(n) * np.finfo(np.float64).eps)  # of an inner product of unit vectors
    norm, loss, check = 0.0, rounding, max(int(1.9 * count), 6 * BLOCK)
    while True:
        # 1. apply the operator and orthogonalize to the last two blocks (the result is orthogonal to the others)
        W = _solve(shifted, Q[:, first:end])
        near = Q[:, before:end]
        inner = _orthogonalize(W, near)
        _orthogonalize(W, near)
        T[first:end, first:end] = (inner[first - before :] + inner[first - before :].T) / 2
        norm = max(norm, abs(T[before:end, before:end]).sum(axis=1).max())  # finally no less than the norm of T
        # 2. a basis of the rest, with fewer vectors where the Krylov space is exhausted
        basis, left, size, right = _svd(W)
        if size[-1] < _REORTHOGONALIZE_BELOW * norm:  # the rest may be rounding, not orthogonal to the basis
            for old in (found, Q[:, :end]):
                _orthogonalize(W, old)
            basis, left, size, right = _svd(W)
        rank = int((size > _BREAKDOWN_TOL * norm).sum())
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
                return shifted.eigenvalue + 1 / theta[good], _ritz_vectors(Q, Y[:, good])
            check = first + max(count // 10, BLOCK)
        np.matmul(basis, left[:, :rank], out=Q[:, first:end])
        T[first:end, before:first] = coupling
        T[before:first, first:end] = coupling.T
        # 4. restore the orthogonality of all blocks since this was done last
        growth = norm / size[rank - 1]
        loss *= growth
        if loss * growth > _ORTHOGONALITY_LOSS:
            new = Q[:, clean:end]
            for old in (found, Q[:, :clean]):
                _orthogonalize(new, old)
            loss, clean = rounding, end
        if progress is not None:
            progress(min(1.0, end / (2.2 * count + 6 * BLOCK)))


def _random_block(found: Floats, random: np.random.Generator) -> Floats:
    """(n, BLOCK) random vectors, orthonormal and orthogonal to the eigenvectors found."""
    block = random.standard_normal((len(found), BLOCK))
    for _ in range(2):
        block -= found @ (found.T @ block)
        block = np.linalg.qr(block)[0]
    return block


def _orthogonalize(W: Floats, basis: Floats) -> Floats:
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

    blocks.parallel_for(inner, n, b)
    product = sums.sum(axis=0)
    blocks.parallel_for(subtract, n, b)
    return np.asarray(product)


def _solve(shifted: ShiftedFactor, X: Floats) -> Floats:
    """(S - shift I)^-1 X, a few columns at a time, in threads."""
    solution = np.empty_like(X)

    def work(start: int) -> None:
        columns = slice(start, start + _SOLVED_TOGETHER)
        solution[:, columns] = shifted.lu.solve(X[:, columns])

    blocks.map_threads(work, range(0, X.shape[1], _SOLVED_TOGETHER))
    return solution


def _svd(W: Floats) -> tuple[Floats, Floats, Floats, Floats]:
    """W = Q (U s V^T), for a few long columns."""
    basis, triangle = np.linalg.qr(W)
    left, size, right = np.linalg.svd(triangle)
    return basis, left, size, right


def _ritz_vectors(Q: Floats, Y: Floats) -> Floats:
    """Overwrite the first columns of Q with Q Y."""
    m, k = Y.shape

    def work(first: int, last: int) -> None:
        for i in range(first, last):
            at = blocks.rows(i, len(Q))
            Q[at, :k] = Q[at, :m] @ Y

    blocks.parallel_for(work, len(Q), m)
    return Q[:, :k]

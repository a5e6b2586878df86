"""The exact number of eigenvalues below a value, by Sylvester's law of inertia.

S - x I = L D L^T has as many negative eigenvalues as D has negative entries, and one sparse factorization gives D.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_array, eye_array
from scipy.sparse.csgraph import connected_components
from scipy.sparse.linalg import SuperLU, splu

from meshlab_specsmooth.errors import NotConverged, TooLarge
from meshlab_specsmooth.runtime import blocks
from meshlab_specsmooth.spectral.cutoff import Cutoff

# Eigenvalues closer than this, on a spectrum of width 2, are equal to rounding
SAME_EIGENVALUE = 1e-10

# Maximum size of a factorization, in bytes
MEMORY_LIMIT = 2 * 2**30

# L has FILL n log2 n entries: up to 3.52 were measured, rounded up
# docs/constants.md: FILL
FILL = 4.0

# L and U, a value and an index each, and a second copy while they are read
_BYTES_PER_ENTRY = 48

# Without pivoting the factors may grow. Rounding errors are eps times the growth, so this bounds the shift of the value
# that is counted at by 1e-9. On regular tori, with multiple eigenvalues, counts were right at a growth of 3e6 and wrong
# at 3e8.
# docs/constants.md: _MAX_GROWTH
_MAX_GROWTH = 1e-9 / np.finfo(np.float64).eps

# A shift at which the factorization is unsound is moved by up to this fraction of itself, in these steps
_MAX_SHIFT_PERTURBATION = 1e-6
_PERTURBATION_STEPS = (0.0, 1e-4, 1e-3, 1e-2, 1e-1, 1.0)


@dataclass(frozen=True, eq=False)
class ShiftedFactor:
    """The factorization of S - eigenvalue I, and the number of its negative pivots.

    Attributes
    ----------
    lu : SuperLU
    eigenvalue : float
    below : int
        Number of eigenvalues of S below ``eigenvalue``.
    """

    lu: SuperLU
    eigenvalue: float
    below: int


def factor_bytes(vertex_count: int) -> float:
    """Bytes that :func:`factorize` takes at most for the mesh of a surface, as measured."""
    return float(FILL * _BYTES_PER_ENTRY * vertex_count * np.log2(max(vertex_count, 2)))


def count_below(S: csr_array, eigenvalue: float) -> int:
    """Count the eigenvalues of S below a value.

    Next to an eigenvalue the factorization is unsound: then the value is increased by at most 1e-6 of itself.

    Parameters
    ----------
    S : (n, n) csr_array
        Symmetric, spectrum inside [0, 2].
    eigenvalue : float

    Raises
    ------
    TooLarge
        The factorization would not fit in memory; the message gives its size.
    NotConverged
        There is no sound factorization near 1, where S - I has a zero diagonal, or near a highly multiple eigenvalue.
    """
    n = S.shape[0]
    if eigenvalue <= 0:
        return 0
    if eigenvalue > 2:
        return int(n)
    _check_fits(n)
    return factorize(S, eigenvalue).below


@blocks.one_blas_thread()
def factorize(S: csr_array, eigenvalue: float, perturbation: float = _MAX_SHIFT_PERTURBATION) -> ShiftedFactor:
    """S - eigenvalue I, factored at that eigenvalue or, where that is unsound, near by.

    Parameters
    ----------
    S : (n, n) csr_array
        Symmetric, spectrum inside [0, 2].
    eigenvalue : float
    perturbation : float
        Fraction of itself that the eigenvalue may be moved by; down where negative.

    Raises
    ------
    NotConverged
        There is no sound factorization within the perturbation.
    """
    for step in _PERTURBATION_STEPS:
        at = eigenvalue * (1 + step * perturbation)
        lu = _factor(S, at)
        if lu is not None:
            return ShiftedFactor(lu, at, int((lu.U.diagonal() < 0).sum()))
    raise NotConverged(
        f"eigenvalues below {eigenvalue:.6g} cannot be counted: the factorization without pivoting is unsound there"
    )


def cutoff_of_modes(S: csr_array, modes: int, guess: Cutoff) -> Cutoff:
    """Find the cut-off with exactly the given number of modes below it.

    Equal eigenvalues stay together, as in :meth:`Eigenbasis.kept`: where they would be separated, or the null space is
    larger, more modes are kept, and the result gives their number.

    Parameters
    ----------
    S : (n, n) csr_array
        Symmetric, spectrum inside [0, 2].
    modes : int
        1 to n.
    guess : Cutoff
        Initial guess, as from :func:`density.cutoff_of_modes`; a better one takes fewer factorizations.

    Raises
    ------
    TooLarge, NotConverged
        As :func:`count_below`.
    """
    n = S.shape[0]
    wanted = max(modes, int(connected_components(S, directed=False)[0]))
    if wanted >= n:
        return Cutoff(2.0, n, 0.0)
    _check_fits(n)
    (low, fewer), (high, more) = (0.0, 0), (2.0, n)
    at, step = guess.eigenvalue, 0
    while high - low > SAME_EIGENVALUE:
        shifted = factorize(S, at)
        at, count = shifted.eigenvalue, shifted.below
        if count == wanted:
            return Cutoff(at, count, 0.0)
        if at >= high:  # moved past it: no closer to equal eigenvalues can be counted
            break
        if count < wanted:
            low, fewer = at, count
        else:
            high, more = at, count
        step += 1
        if high == 2.0 or low == 0.0:
            # not bracketed yet: the count is nearly proportional, and twice the correction reaches the other side
            at = float(np.clip(at * (1 + 2 * (wanted - count) / max(count, wanted)), (low + at) / 2, (high + at) / 2))
        elif step % 3 == 0:  # the secant may stay on one side forever
            at = (low + high) / 2
        else:
            at = low + (high - low) * (wanted - fewer) / (more - fewer)
    return Cutoff(high, more, 0.0)


def _check_fits(n: int) -> None:
    needed = factor_bytes(n)
    if needed > MEMORY_LIMIT:
        raise TooLarge(
            f"counting the modes of {n} vertices needs a factorization of {needed / 2**30:.1f} GiB (limit "
            f"{MEMORY_LIMIT / 2**30:.0f}); the density of modes needs none"
        )


def _factor(S: csr_array, eigenvalue: float) -> SuperLU | None:
    """S - eigenvalue I = L U with U = D L^T, rows and columns in one order; None where it is unsound."""
    shifted = (S - eigenvalue * eye_array(S.shape[0])).tocsc()
    try:
        lu = splu(shifted, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
    except RuntimeError:  # a pivot is zero
        return None
    # rows were exchanged because of a zero pivot: U is not D L^T
    exchanged = not np.array_equal(lu.perm_r, lu.perm_c)
    return None if exchanged or abs(lu.U.data).max() > _MAX_GROWTH else lu

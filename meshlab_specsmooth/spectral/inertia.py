"""How many eigenvalues lie below a value, exactly: Sylvester's law of inertia.

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

# Eigenvalues this close, on a spectrum that is 2 wide, are equal but for rounding
SAME_EIGENVALUE = 1e-10

# Bytes that a factorization may take
MEMORY_LIMIT = 2 * 2**30

# Entries of L are FILL n log2 n: 1.6 to 2.9 on ten surfaces of 5k to 37k vertices, rounded up
FILL = 3.5

# L and U, each a value and an index, and once more while they are read
_BYTES_PER_ENTRY = 48

# Without pivoting the factors may grow. Rounding errors are eps times that, so a count is that of a value within 1e-9.
# On regular tori, whose eigenvalues are multiple, counts were right at a growth of 3e6 and wrong at 3e8.
_GROWTH = 1e-9 / np.finfo(np.float64).eps

# A value that cannot be counted at is moved by up to this share of itself, at first by 1e-4 of that
_REACH = 1e-6
_STEPS = (0.0, 1e-4, 1e-3, 1e-2, 1e-1, 1.0)


@dataclass(frozen=True, eq=False)
class Factored:
    """S - eigenvalue I, factored, and what its pivots say.

    Attributes
    ----------
    lu : SuperLU
    eigenvalue : float
    below : int
        Eigenvalues of S below this one.
    """

    lu: SuperLU
    eigenvalue: float
    below: int


def factor_bytes(vertex_count: int) -> float:
    """What :func:`factored` takes at most on the mesh of a surface, by measure."""
    return float(FILL * _BYTES_PER_ENTRY * vertex_count * np.log2(max(vertex_count, 2)))


def count_below(S: csr_array, eigenvalue: float) -> int:
    """The number of eigenvalues of S below a value.

    A value that is itself an eigenvalue, to rounding, cannot be told from its neighbors: it is moved up until the
    factorization is sound, by 1e-6 of itself at most.

    Parameters
    ----------
    S : (n, n) csr_array
        Symmetric, spectrum inside [0, 2].
    eigenvalue : float

    Raises
    ------
    TooLarge
        The factorization would not fit; names its size.
    NotConverged
        No sound factorization: next to 1, where S - I has a zero diagonal, or to an eigenvalue with very many copies.
    """
    n = S.shape[0]
    if eigenvalue <= 0:
        return 0
    if eigenvalue > 2:
        return int(n)
    _check_fits(n)
    return factored(S, eigenvalue).below


@blocks.one_blas_thread()
def factored(S: csr_array, eigenvalue: float, reach: float = _REACH) -> Factored:
    """S - eigenvalue I, factored at that eigenvalue or, where that is unsound, near by.

    Parameters
    ----------
    S : (n, n) csr_array
        Symmetric, spectrum inside [0, 2].
    eigenvalue : float
    reach : float
        How far it may be moved, as a share of itself; down where negative.

    Raises
    ------
    NotConverged
        No sound factorization within reach.
    """
    for step in _STEPS:
        at = eigenvalue * (1 + step * reach)
        lu = _factor(S, at)
        if lu is not None:
            return Factored(lu, at, int((lu.U.diagonal() < 0).sum()))
    raise NotConverged(
        f"eigenvalues below {eigenvalue:.6g} cannot be counted: the factorization without pivoting is unsound there"
    )


def cutoff_of_modes(S: csr_array, modes: int, guess: Cutoff) -> Cutoff:
    """The cut-off with exactly so many modes below it.

    Equal eigenvalues stay together, as in :meth:`Eigenbasis.kept`: if they straddle, or the null space is larger, more
    modes are kept than were asked for, and the result says how many.

    Parameters
    ----------
    S : (n, n) csr_array
        Symmetric, spectrum inside [0, 2].
    modes : int
        1 to n.
    guess : Cutoff
        Where to start, as from :func:`density.cutoff_of_modes`. A better one takes fewer factorizations.

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
        shifted = factored(S, at)
        at, count = shifted.eigenvalue, shifted.below
        if count == wanted:
            return Cutoff(at, count, 0.0)
        if at >= high:  # moved past it: as near to equal eigenvalues as can be counted
            break
        if count < wanted:
            low, fewer = at, count
        else:
            high, more = at, count
        step += 1
        if high == 2.0 or low == 0.0:
            # not enclosed yet: the count grows in proportion, and twice the correction gets to the other side
            at = float(np.clip(at * (1 + 2 * (wanted - count) / max(count, wanted)), (low + at) / 2, (high + at) / 2))
        elif step % 3 == 0:  # the secant may keep to one side for ever
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
    # rows exchanged to get around a zero pivot: U is not D L^T
    exchanged = not np.array_equal(lu.perm_r, lu.perm_c)
    return None if exchanged or abs(lu.U.data).max() > _GROWTH else lu

"""Vertices at one place: found once, so that every filter moves them as one.

Texture seams, hard shading edges, triangle soups and chunks of marching cubes repeat a vertex for each face or patch
that uses it. To the mesh graph the copies are different vertices, and a filter would tear the surface apart there.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from meshlab_specsmooth.arrays import Booleans, Floats, Integers

# Odd multipliers that spread the bits of the three coordinates over one 64-bit number
_MULTIPLIERS = np.array([0x9E3779B97F4A7C15, 0xC2B2AE3D27D4EB4F, 0x165667B19E3779F9], dtype=np.uint64)


def find_copies(V: Floats, used: Booleans) -> Integers | None:
    """For each vertex the first used vertex at its place.

    Parameters
    ----------
    V : (n, 3) float64
    used : (n,) bool
        Vertices that a face refers to; the others are their own representatives.

    Returns
    -------
    (n,) int32 or None
        None where no two used vertices have equal coordinates. Zeros of either sign are equal.

    Examples
    --------
    >>> import numpy as np
    >>> from meshlab_specsmooth.geometry.welding import find_copies
    >>> find_copies(np.array([[0.0, 0, 0], [1, 0, 0], [-0.0, 0, 0]]), np.ones(3, dtype=bool))
    array([0, 1, 0], dtype=int32)
    """
    key = _hash(V)
    if not used.all():
        key = key[used]
    # sorting tells whether there is anything to do, at a fraction of what finding out where takes
    in_order = np.sort(key)
    if not (in_order[1:] == in_order[:-1]).any():
        return None
    at = np.flatnonzero(used)
    order = np.argsort(key, kind="stable")
    is_same = key[order[1:]] == key[order[:-1]]
    repeated = np.zeros(len(order), dtype=np.bool_)
    repeated[1:] |= is_same
    repeated[:-1] |= is_same
    at = np.sort(at[order[repeated]])
    # equal hashes are a hint, equal coordinates decide
    rows = V[at] + 0.0
    order = np.lexsort((at, *rows.T))
    rows, at = rows[order], at[order]
    is_first = np.ones(len(at), dtype=np.bool_)
    is_first[1:] = (rows[1:] != rows[:-1]).any(axis=1)
    if is_first.all():
        return None
    representative = np.arange(len(V), dtype=np.int32)
    representative[at] = at[np.flatnonzero(is_first)[np.cumsum(is_first) - 1]]
    return representative


def unique_rows(X: Floats) -> tuple[Floats, npt.NDArray[np.int64]]:
    """The different rows of an array (n, 3), and the (n,) number of each row among them."""
    order = np.lexsort(X.T)
    ordered = X[order]
    is_first = np.ones(len(X), dtype=np.bool_)
    is_first[1:] = (ordered[1:] != ordered[:-1]).any(axis=1)
    which = np.empty(len(X), dtype=np.int64)
    which[order] = np.cumsum(is_first) - 1
    return ordered[is_first], which


def _hash(V: Floats) -> npt.NDArray[np.uint64]:
    """(n,) one number for each row, equal for equal rows."""
    bits = (V + 0.0).view(np.uint64)  # the sum turns -0.0 into 0.0
    bits *= _MULTIPLIERS
    key = bits[:, 0] ^ (bits[:, 1] >> np.uint64(7)) ^ (bits[:, 2] << np.uint64(3)) ^ bits[:, 1]
    return np.asarray(key)

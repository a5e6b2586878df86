"""The neighbors of every vertex by a counting sort, compiled by numba (the extra ``fast``).

A side of a face leads from one corner to the next, so as many sides leave a vertex as arrive there. Listed by the
vertex where they arrive, in the order of those that they leave, the rows are sorted without a comparison. Where two
faces meet that are oriented alike, what leaves is what arrives: the rows of a closed mesh are its graph as they stand,
and other rows are merged from both.
"""

from __future__ import annotations

import functools

import numba
import numpy as np

from meshlab_specsmooth.arrays import Integers
from meshlab_specsmooth.graph.build import Neighbors
from meshlab_specsmooth.runtime import backend, blocks

_compiled = functools.partial(numba.njit, nogil=True, cache=backend.IS_KEPT)


def neighbors(F: Integers, n: int) -> Neighbors:
    """What :func:`meshlab_specsmooth.graph.build.of_mesh` makes of the sides of faces.

    Returns
    -------
    indptr : (n + 1,) int32
    indices : (2 e,) int32
        Rising for each vertex.
    odd : (k,) int64
        Where in ``indices`` the edges stand that have not two faces.
    odd_faces : (k,) int32
        How many these have.
    leaving : (n,) int32
        Sides that leave each vertex.
    """
    start = np.zeros(n + 1, dtype=np.int32)
    _count(F, start)
    count = start[1:].copy()
    np.cumsum(start, out=start)
    # two arrays and not one in two parts, of which either would keep the other's memory
    leaving, arriving = (np.empty(start[-1], dtype=np.int32) for _ in range(2))
    _fill(F, start[:-1].copy(), leaving)
    _transpose(start, start[:-1].copy(), leaving, arriving)
    _transpose(start, start[:-1].copy(), arriving, leaving)
    differ = np.empty(blocks.count(n), dtype=np.bool_)

    def compare(first: int, last: int) -> None:
        for i in range(first, last):
            at = blocks.rows(i, n)
            differ[i] = _differ(at.start, at.stop, start, leaving, arriving)

    blocks.in_threads(compare, n)
    if not differ.any():
        return start, leaving, np.empty(0, dtype=np.int64), np.empty(0, dtype=np.int32), count
    indptr, indices, faces = _merged(start, leaving, arriving, n)
    odd = np.flatnonzero(faces != 2)
    return indptr, indices, odd, faces[odd], count


def _merged(start: Integers, leaving: Integers, arriving: Integers, n: int) -> tuple[Integers, Integers, Integers]:
    """``indptr`` and ``indices`` of both, each neighbor once, and the number of faces of each edge."""
    indptr = np.zeros(n + 1, dtype=np.int32)

    def merge(indices: Integers | None, faces: Integers | None) -> None:
        blocks.in_slices(lambda at: _merge(at.start, at.stop, start, leaving, arriving, indptr, indices, faces), n)

    merge(None, None)
    np.cumsum(indptr, out=indptr)
    indices, faces = (np.empty(indptr[-1], dtype=np.int32) for _ in range(2))
    merge(indices, faces)
    return indptr, indices, faces


@_compiled
def _count(F, start):  # type: ignore[no-untyped-def]
    """Sides that leave each vertex, one place further on."""
    for f in range(len(F)):
        for k in range(3):
            start[F[f, k] + 1] += F[f, k] != F[f, (k + 1) % 3]


@_compiled
def _fill(F, place, leaving):  # type: ignore[no-untyped-def]
    for f in range(len(F)):
        for k in range(3):
            a, b = F[f, k], F[f, (k + 1) % 3]
            if a != b:
                leaving[place[a]] = b
                place[a] += 1


@_compiled
def _transpose(start, place, rows, turned):  # type: ignore[no-untyped-def]
    """``turned`` becomes, for each vertex, those in whose rows it is, rising."""
    for i in range(len(place)):
        for k in range(start[i], start[i + 1]):
            j = rows[k]
            turned[place[j]] = i
            place[j] += 1


@_compiled
def _differ(low, high, start, leaving, arriving):  # type: ignore[no-untyped-def]
    """Whether in some row what leaves is not what arrives, or leaves twice."""
    found = False
    for i in range(low, high):
        for k in range(start[i], start[i + 1]):
            found |= leaving[k] != arriving[k] or (k > start[i] and leaving[k] == leaving[k - 1])
    return found


@_compiled
def _merge(low, high, start, leaving, arriving, indptr, indices, faces):  # type: ignore[no-untyped-def]
    """Write the merged rows; without ``indices`` and ``faces`` their lengths, one place further on."""
    for i in range(low, high):
        k = m = start[i]
        end, count = start[i + 1], 0
        while k < end or m < end:
            j = leaving[k] if m == end or (k < end and leaving[k] < arriving[m]) else arriving[m]
            times = 0
            while k < end and leaving[k] == j:
                k += 1
                times += 1
            while m < end and arriving[m] == j:
                m += 1
                times += 1
            if indices is not None:
                indices[indptr[i] + count], faces[indptr[i] + count] = j, times
            count += 1
        if indices is None:
            indptr[i + 1] = count

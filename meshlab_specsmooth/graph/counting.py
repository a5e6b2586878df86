"""The neighbours of every vertex by a counting sort, compiled by numba (the extra ``fast``)."""

from __future__ import annotations

import functools

import numba
import numpy as np

from meshlab_specsmooth.graph import blocks
from meshlab_specsmooth.surface import Integers

_compiled = functools.partial(numba.njit, nogil=True, cache=True)

# Longer rows are left to numpy's sort: that by insertion takes their length squared
_SHORT = 32


def neighbours(F: Integers, n: int) -> tuple[Integers, Integers, Integers]:
    """What :func:`meshlab_specsmooth.graph.build.of_mesh` makes of the sides of faces.

    Returns
    -------
    indptr : (n + 1,) int32
    indices : (2 e,) int32
        Rising for each vertex.
    face_count : (2 e,) int32
    """
    start = np.zeros(n + 1, dtype=np.int64)
    _count(F, start)
    np.cumsum(start, out=start)
    entries = np.empty(start[-1], dtype=np.int32)
    _fill(F, start[:-1].copy(), entries)
    faces = np.empty_like(entries)
    unique = np.zeros(n + 1, dtype=np.int32)

    def rows(first: int, last: int) -> tuple[int, int]:
        return first * blocks.ROWS, min(last * blocks.ROWS, n)

    blocks.in_threads(lambda first, last: _unite(*rows(first, last), start, entries, faces, unique), n)
    indptr = np.cumsum(unique, dtype=np.int32)
    indices, face_count = np.empty((2, indptr[-1]), dtype=np.int32)

    def gather(first: int, last: int) -> None:
        low, high = rows(first, last)
        _gather(low, high, start, entries, indptr, indices)
        _gather(low, high, start, faces, indptr, face_count)

    blocks.in_threads(gather, n)
    return indptr, indices, face_count


@_compiled
def _count(F, start):  # type: ignore[no-untyped-def]
    """Sides at each vertex, both directions of each, one place further on."""
    for f in range(len(F)):
        for k in range(3):
            a, b = F[f, k], F[f, (k + 1) % 3]
            if a != b:
                start[a + 1] += 1
                start[b + 1] += 1


@_compiled
def _fill(F, place, entries):  # type: ignore[no-untyped-def]
    for f in range(len(F)):
        for k in range(3):
            a, b = F[f, k], F[f, (k + 1) % 3]
            if a != b:
                entries[place[a]] = b
                place[a] += 1
                entries[place[b]] = a
                place[b] += 1


@_compiled
def _unite(low, high, start, entries, faces, unique):  # type: ignore[no-untyped-def]
    """Sort each row and unite what is equal, at the row's start; ``unique`` gets the rest's length, one further on."""
    for i in range(low, high):
        begin, end = start[i], start[i + 1]
        if end - begin > _SHORT:
            entries[begin:end].sort()
        else:
            for k in range(begin + 1, end):
                j = entries[k]
                m = k
                while m > begin and entries[m - 1] > j:
                    entries[m] = entries[m - 1]
                    m -= 1
                entries[m] = j
        last = begin - 1
        for k in range(begin, end):
            if last >= begin and entries[last] == entries[k]:
                faces[last] += 1
            else:
                last += 1
                entries[last] = entries[k]
                faces[last] = 1
        unique[i + 1] = last + 1 - begin


@_compiled
def _gather(low, high, start, values, indptr, gathered):  # type: ignore[no-untyped-def]
    for i in range(low, high):
        for k in range(indptr[i + 1] - indptr[i]):
            gathered[indptr[i] + k] = values[start[i] + k]

"""The neighbours of every vertex by a counting sort, compiled by numba (the extra ``fast``)."""

from __future__ import annotations

import functools

import numba
import numpy as np

from meshlab_specsmooth.graph import blocks
from meshlab_specsmooth.graph.build import Neighbours
from meshlab_specsmooth.surface import Integers

_compiled = functools.partial(numba.njit, nogil=True, cache=True)

# Longer rows are left to numpy's sort: that by insertion takes their length squared
_SHORT = 32


def neighbours(F: Integers, n: int) -> Neighbours:
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
    """
    start = np.zeros(n + 1, dtype=np.int64)
    _count(F, start)
    np.cumsum(start, out=start)
    entries = np.empty(start[-1], dtype=np.int32)
    _fill(F, start[:-1].copy(), entries)
    unique = np.zeros(n + 1, dtype=np.int32)
    odd_before = np.zeros(blocks.count(n) + 1, dtype=np.int64)

    def sort(first: int, last: int) -> None:
        for i in range(first, last):
            at = blocks.rows(i, n)
            odd_before[i + 1] = _sort(at.start, at.stop, start, entries, unique)

    blocks.in_threads(sort, n)
    indptr = np.cumsum(unique, dtype=np.int32)
    np.cumsum(odd_before, out=odd_before)
    indices = np.empty(indptr[-1], dtype=np.int32)
    odd, odd_faces = np.empty(odd_before[-1], dtype=np.int64), np.empty(odd_before[-1], dtype=np.int32)

    def unite(first: int, last: int) -> None:
        for i in range(first, last):
            at, found = blocks.rows(i, n), slice(*odd_before[i : i + 2])
            _unite(at.start, at.stop, start, entries, indptr, indices, odd[found], odd_faces[found])

    blocks.in_threads(unite, n)
    return indptr, indices, odd, odd_faces


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
def _sort(low, high, start, entries, unique):  # type: ignore[no-untyped-def]
    """Sort each row; ``unique`` gets the number of different entries, one further on. Returns how many are not twice.

    An edge stands in a row once for each of its faces.
    """
    odd = 0
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
        k = begin
        while k < end:
            first = k
            while k < end and entries[k] == entries[first]:
                k += 1
            odd += k - first != 2
            unique[i + 1] += 1
    return odd


@_compiled
def _unite(low, high, start, entries, indptr, indices, odd, odd_faces):  # type: ignore[no-untyped-def]
    """Write each different entry once, and note those that are not there twice."""
    found = 0
    for i in range(low, high):
        k, end, at = start[i], start[i + 1], indptr[i]
        while k < end:
            first = k
            while k < end and entries[k] == entries[first]:
                k += 1
            indices[at] = entries[first]
            if k - first != 2:
                odd[found], odd_faces[found] = at, k - first
                found += 1
            at += 1

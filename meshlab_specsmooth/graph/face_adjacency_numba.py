"""The graph of faces, compiled with numba (the extra ``fast``)."""

from __future__ import annotations

import functools

import numba
import numpy as np

from meshlab_specsmooth.arrays import Integers
from meshlab_specsmooth.graph.face_adjacency import MAX_FACES_OF_A_VERTEX, FaceGraph
from meshlab_specsmooth.runtime import backend, blocks

_compiled = functools.partial(numba.njit, nogil=True, cache=backend.CAN_CACHE)


def face_graph(corners: Integers, n: int) -> FaceGraph:
    """Build the graph of faces on n vertices."""
    m = len(corners)
    start = np.zeros(n + 1, dtype=np.int32)
    _count_corners(corners, start)
    np.cumsum(start, out=start)
    of_vertex = np.empty(start[-1], dtype=np.int32)
    _fill_corners(corners, start[:-1].copy(), of_vertex)
    indptr = np.zeros(m + 1, dtype=np.int32)
    nothing = np.empty(0, dtype=np.int32)
    blocks.parallel_rows(lambda at: _adjacent(at.start, at.stop, corners, start, of_vertex, indptr, nothing, False), m)
    total = int(indptr.sum(dtype=np.int64))
    if total > np.iinfo(np.int32).max:
        raise MemoryError(f"{total} pairs of neighboring faces")
    np.cumsum(indptr, out=indptr)
    indices = np.empty(total, dtype=np.int32)
    blocks.parallel_rows(lambda at: _adjacent(at.start, at.stop, corners, start, of_vertex, indptr, indices, True), m)
    return FaceGraph(corners, indptr, indices, start, of_vertex)


@_compiled
def _count_corners(corners, start):  # type: ignore[no-untyped-def]
    for f in range(len(corners)):
        a, b, c = corners[f]
        start[a + 1] += 1
        if b != a:
            start[b + 1] += 1
        if c not in (a, b):
            start[c + 1] += 1


@_compiled
def _fill_corners(corners, place, of_vertex):  # type: ignore[no-untyped-def]
    for f in range(len(corners)):
        a, b, c = corners[f]
        of_vertex[place[a]] = f
        place[a] += 1
        if b != a:
            of_vertex[place[b]] = f
            place[b] += 1
        if c not in (a, b):
            of_vertex[place[c]] = f
            place[c] += 1


@_compiled
def _adjacent(low, high, corners, start, of_vertex, indptr, indices, fill):  # type: ignore[no-untyped-def]
    """Write the neighbors of faces with ``fill``, else their number into the place after their own."""
    found = np.empty(3 * MAX_FACES_OF_A_VERTEX, dtype=np.int32)
    for f in range(low, high):
        count = 0
        for k in range(3):
            v = corners[f, k]
            if start[v + 1] - start[v] > MAX_FACES_OF_A_VERTEX:
                continue
            for s in range(start[v], start[v + 1]):
                g = of_vertex[s]
                if g == f:
                    continue
                at = count
                while at > 0 and found[at - 1] > g:
                    at -= 1
                if at > 0 and found[at - 1] == g:
                    continue
                for q in range(count, at, -1):
                    found[q] = found[q - 1]
                found[at] = g
                count += 1
        if fill:
            for q in range(count):
                indices[indptr[f] + q] = found[q]
        else:
            indptr[f + 1] = count

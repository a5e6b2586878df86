"""The neighbors of every vertex by a counting sort, compiled with numba (the extra ``fast``).

A halfedge leads from one corner of a face to the next, so as many halfedges leave a vertex as arrive at it. Listing
them by their end, in the order of their start, sorts the rows without comparisons. Where the two faces of every edge
are oriented alike, the halfedges that leave are those that arrive: the rows of a closed mesh are its graph as they are,
and other rows are merged from both lists.
"""

from __future__ import annotations

import functools

import numba
import numpy as np

from meshlab_specsmooth.arrays import Integers
from meshlab_specsmooth.graph.adjacency import Adjacency, Graph
from meshlab_specsmooth.runtime import backend, blocks

_compiled = functools.partial(numba.njit, nogil=True, cache=backend.CAN_CACHE)


def adjacency(F: Integers, n: int) -> Adjacency:
    """Find the neighbors of every vertex of a mesh with n vertices."""
    start = np.zeros(n + 1, dtype=np.int32)
    _count(F, start)
    count = start[1:].copy()
    np.cumsum(start, out=start)
    # two allocations: a view would keep the whole buffer alive
    leaving, arriving = (np.empty(start[-1], dtype=np.int32) for _ in range(2))
    _fill(F, start[:-1].copy(), leaving)
    _transpose(start, start[:-1].copy(), leaving, arriving)
    _transpose(start, start[:-1].copy(), arriving, leaving)
    differs = np.empty(blocks.count(n), dtype=np.bool_)

    def compare(first: int, last: int) -> None:
        for i in range(first, last):
            at = blocks.rows(i, n)
            differs[i] = _differ(at.start, at.stop, start, leaving, arriving)

    blocks.parallel_for(compare, n)
    if not differs.any():
        return Adjacency(start, leaving, np.empty(0, dtype=np.int64), np.empty(0, dtype=np.int32), count)
    indptr, indices, faces = _merged(start, leaving, arriving, n)
    irregular = np.flatnonzero(faces != 2)
    return Adjacency(indptr, indices, irregular, faces[irregular], count)


def label_components(graph: Graph) -> tuple[int, Integers]:
    """Number of connected components, and (n,) the component of each vertex, numbered by their first vertices."""
    labels, stack = np.full(graph.size, -1, dtype=np.int32), np.empty(graph.size, dtype=np.int32)
    return _label(graph.indptr, graph.indices, labels, stack), labels


@_compiled
def _label(indptr, indices, labels, stack):  # type: ignore[no-untyped-def]
    count = 0
    for start in range(len(labels)):
        if labels[start] >= 0:
            continue
        labels[start] = count
        stack[0], top = start, 1
        while top > 0:
            top -= 1
            i = stack[top]
            for k in range(indptr[i], indptr[i + 1]):
                j = indices[k]
                if labels[j] < 0:
                    labels[j] = count
                    stack[top] = j
                    top += 1
        count += 1
    return count


def _merged(start: Integers, leaving: Integers, arriving: Integers, n: int) -> tuple[Integers, Integers, Integers]:
    """Merge both lists: ``indptr``, ``indices`` with each neighbor once, and the number of faces of each edge."""
    indptr = np.zeros(n + 1, dtype=np.int32)

    def merge(indices: Integers | None, faces: Integers | None) -> None:
        blocks.parallel_rows(lambda at: _merge(at.start, at.stop, start, leaving, arriving, indptr, indices, faces), n)

    merge(None, None)
    np.cumsum(indptr, out=indptr)
    indices, faces = (np.empty(indptr[-1], dtype=np.int32) for _ in range(2))
    merge(indices, faces)
    return indptr, indices, faces


@_compiled
def _count(F, start):  # type: ignore[no-untyped-def]
    """Count the halfedges that leave each vertex, into the place after its own."""
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
    """``turned`` becomes, for each vertex, the vertices in whose rows it is, ascending."""
    for i in range(len(place)):
        for k in range(start[i], start[i + 1]):
            j = rows[k]
            turned[place[j]] = i
            place[j] += 1


@_compiled
def _differ(low, high, start, leaving, arriving):  # type: ignore[no-untyped-def]
    """Whether in any row a halfedge leaves that does not arrive, or leaves twice."""
    found = False
    for i in range(low, high):
        for k in range(start[i], start[i + 1]):
            found |= leaving[k] != arriving[k] or (k > start[i] and leaving[k] == leaving[k - 1])
    return found


@_compiled
def _merge(low, high, start, leaving, arriving, indptr, indices, faces):  # type: ignore[no-untyped-def]
    """Write the merged rows or, without ``indices`` and ``faces``, their lengths into the place after their own."""
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

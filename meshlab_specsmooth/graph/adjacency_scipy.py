"""The neighbors of every vertex by scipy's sparse matrices: the reference."""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from meshlab_specsmooth.arrays import Integers
from meshlab_specsmooth.graph.adjacency import Adjacency, Graph


def adjacency(F: Integers, n: int) -> Adjacency:
    """Find the neighbors of every vertex of a mesh with n vertices."""
    start, end = F.ravel(), F[:, [1, 2, 0]].ravel()
    proper = start != end
    start, end = start[proper], end[proper]
    leaving = np.bincount(start, minlength=n).astype(np.int32)
    # duplicates are summed, so the data count faces
    there = coo_array((np.ones(len(start), dtype=np.int32), (start, end)), shape=(n, n)).tocsr()
    there.sum_duplicates()  # also sorts; the sum below would take five times as long without
    both = there + there.T.tocsr()
    irregular = np.flatnonzero(both.data != 2)
    indptr, indices = (x.astype(np.int32, copy=False) for x in (both.indptr, both.indices))
    return Adjacency(indptr, indices, irregular, both.data[irregular], leaving)


def label_components(graph: Graph) -> tuple[int, Integers]:
    """Number of connected components, and (n,) the component of each vertex, numbered by their first vertices."""
    # every edge is stored in both directions, so strong connection is connection, and takes half of the time
    count, labels = connected_components(graph.adjacency(), directed=True, connection="strong")
    _, first = np.unique(labels, return_index=True)
    rank = np.empty(count, dtype=np.int32)
    rank[np.argsort(first)] = np.arange(count, dtype=np.int32)
    return int(count), rank[labels]

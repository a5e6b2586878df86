"""The graph of faces by scipy's sparse matrices: the reference."""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_array

from meshlab_specsmooth.arrays import Integers
from meshlab_specsmooth.graph.face_adjacency import MAX_FACES_OF_A_VERTEX, FaceGraph


def face_graph(corners: Integers, n: int) -> FaceGraph:
    """Build the graph of faces on n vertices."""
    m = len(corners)
    at = csr_array(
        (np.ones(3 * m, dtype=np.int32), corners.ravel(), np.arange(0, 3 * m + 1, 3, dtype=np.int32)), shape=(m, n)
    )
    of_vertex = at.T.tocsr()
    of_vertex.sum_duplicates()
    few = (np.diff(of_vertex.indptr) <= MAX_FACES_OF_A_VERTEX)[corners.ravel()].astype(np.int32)
    thin = csr_array((few, at.indices, at.indptr), shape=(m, n), copy=True)
    thin.eliminate_zeros()
    pairs = (thin @ thin.T).tocoo()
    other = pairs.row != pairs.col
    shared = csr_array((pairs.data[other], (pairs.row[other], pairs.col[other])), shape=(m, m))
    shared.sort_indices()
    return FaceGraph(
        corners,
        shared.indptr.astype(np.int32),
        shared.indices.astype(np.int32),
        of_vertex.indptr.astype(np.int32),
        of_vertex.indices.astype(np.int32),
    )

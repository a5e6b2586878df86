"""Construction of vertex graphs from faces or edges."""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_array

from meshlab_specsmooth.arrays import Floats, Integers
from meshlab_specsmooth.graph import backend
from meshlab_specsmooth.graph.adjacency import Graph, MeshGraph


def mesh_graph(F: Integers, n: int) -> MeshGraph:
    """Build the graph of a mesh's edges.

    Parameters
    ----------
    F : (m, 3) int32
        Every vertex must be an end of an edge that joins two different ones.
    n : int
        Number of vertices.
    """
    indptr, indices, irregular, face_count, corner_count = backend.select(n).adjacency(F, n)
    if corner_count.sum() < F.size:
        # a face with an edge from a vertex to itself has two corners there, which count four times, and one halfedge
        for k in range(3):
            np.add.at(corner_count, F[F[:, k] == F[:, k - 1], k], 3)
    degree = np.diff(indptr).astype(np.float64)[:, None]
    return MeshGraph(Graph(indptr, indices, None, degree), irregular, face_count, corner_count)


def from_edges(n: int, ends: Integers, weight: Floats) -> Graph:
    """Build the graph with the given edges, each once, and their positive weights; every vertex must have an edge."""
    W = coo_array((weight, (ends[:, 0], ends[:, 1])), shape=(n, n)).tocsr()
    W = (W + W.T.tocsr()).tocsr()
    W.sort_indices()
    return Graph(W.indptr, W.indices, W.data, np.asarray(W.sum(axis=1))[:, None])

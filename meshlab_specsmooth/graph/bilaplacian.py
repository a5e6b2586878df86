"""The entries of L^2: the weights with which the noise of each vertex enters L^2 V."""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_array, eye_array

from meshlab_specsmooth.arrays import Floats
from meshlab_specsmooth.graph.laplacian import Laplacian


def square_bilaplacian_entries(L: Laplacian) -> csr_array:
    """Return the (n, n) matrix of the squared entries of L^2, for a Laplacian with unit weights."""
    walk = csr_array(L.graph.adjacency(np.ones(len(L.graph.indices)))).multiply(1 / L.degree)
    matrix = csr_array(eye_array(L.size) - csr_array(walk))
    return csr_array(csr_array(matrix @ matrix).power(2))


def bilaplacian_row_norms(L: Laplacian) -> Floats:
    """Return the (n,) norms of the rows of L^2: the standard deviations of L^2 applied to white noise of variance 1."""
    return np.asarray(np.sqrt(np.asarray(square_bilaplacian_entries(L).sum(axis=1)).ravel()))

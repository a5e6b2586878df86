"""Connected components of a mesh."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy.sparse.csgraph import connected_components

from meshlab_specsmooth.graph.laplacian import Laplacian


def label_components(L: Laplacian) -> tuple[int, npt.NDArray[np.int32]]:
    """Number of connected components, and (n,) the component of each vertex."""
    # every edge is stored in both directions, so strong connection is connection, and takes half of the time
    count, labels = connected_components(L.graph.adjacency(), directed=True, connection="strong")
    return int(count), labels

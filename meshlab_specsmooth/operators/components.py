"""Connected components of a mesh."""

from __future__ import annotations

from meshlab_specsmooth.arrays import Integers
from meshlab_specsmooth.graph import backend
from meshlab_specsmooth.graph.laplacian import Laplacian


def label_components(L: Laplacian) -> tuple[int, Integers]:
    """Number of connected components, and (n,) the component of each vertex."""
    return backend.select(L.size).label_components(L.graph)

"""The choice between the implementations with scipy and with numba: the only place where graphs depend on it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from meshlab_specsmooth.arrays import Floats, Integers
from meshlab_specsmooth.graph import adjacency_scipy, extent_scipy, face_adjacency_scipy
from meshlab_specsmooth.graph.adjacency import Adjacency, Graph
from meshlab_specsmooth.graph.face_adjacency import FaceGraph
from meshlab_specsmooth.graph.face_kernels_scipy import ScipyFaceKernels
from meshlab_specsmooth.graph.protocols import FaceKernels, VertexKernels
from meshlab_specsmooth.graph.vertex_kernels_scipy import ScipyVertexKernels
from meshlab_specsmooth.runtime.backend import is_compiled
from meshlab_specsmooth.runtime.interrupts import DeferInterrupts


@dataclass(frozen=True)
class Backend:
    """An implementation of everything that loops over the edges or faces of a mesh.

    Attributes
    ----------
    adjacency : callable
        From faces (m, 3) and the number of vertices to the neighbors of each vertex.
    label_components : callable
        From a graph to the number of its connected components, and the component of each vertex.
    vertex_kernels : callable
        From a graph to its kernels.
    face_graph : callable
        From faces (m, 3) and the number of vertices to the graph of faces.
    face_kernels : callable
        From a graph of faces to its kernels.
    sum_faces : callable
        From the first and the end of a range of faces, X, F and ``sums`` (3,): ``sums`` becomes the signed volume, the
        area and the mean squared edge length of the faces, summed.
    """

    adjacency: Callable[[Integers, int], Adjacency]
    label_components: Callable[[Graph], tuple[int, Integers]]
    vertex_kernels: Callable[[Graph], VertexKernels]
    face_graph: Callable[[Integers, int], FaceGraph]
    face_kernels: Callable[[FaceGraph], FaceKernels]
    sum_faces: Callable[[int, int, Floats, Integers, Floats], None]


SCIPY = Backend(
    adjacency_scipy.adjacency,
    adjacency_scipy.label_components,
    ScipyVertexKernels,
    face_adjacency_scipy.face_graph,
    ScipyFaceKernels,
    extent_scipy.sum_faces,
)


def select(n: int) -> Backend:
    """The fastest implementation there is for a mesh with n vertices: numba's with the extra ``fast``, else scipy's.

    Warns
    -----
    Slow
        Numba is missing and the mesh is large.
    """
    if not is_compiled(n):
        return SCIPY
    # imported when first needed: numba alone takes half a second. It may crash if it is interrupted while it loads.
    with DeferInterrupts():
        from meshlab_specsmooth.graph import adjacency_numba, extent_numba, face_adjacency_numba
        from meshlab_specsmooth.graph.face_kernels_numba import NumbaFaceKernels
        from meshlab_specsmooth.graph.vertex_kernels_numba import NumbaVertexKernels

    return Backend(
        adjacency_numba.adjacency,
        adjacency_numba.label_components,
        NumbaVertexKernels,
        face_adjacency_numba.face_graph,
        NumbaFaceKernels,
        extent_numba.sum_faces,
    )


def face_graph(corners: Integers, n: int) -> FaceGraph:
    """Build the graph of faces on n vertices."""
    return select(n).face_graph(corners, n)


def face_kernels(graph: FaceGraph) -> FaceKernels:
    """The kernels on a graph of faces."""
    return select(graph.order).face_kernels(graph)

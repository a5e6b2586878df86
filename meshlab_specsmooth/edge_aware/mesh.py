"""A mesh in units of its mean edge, and the isotropic filter on it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from meshlab_specsmooth.graph.faces import FaceGraph, FaceKernels, face_graph, face_kernels
from meshlab_specsmooth.noise import normals
from meshlab_specsmooth.smoothing import Prepared, SmoothingResult, assemble
from meshlab_specsmooth.surface import Booleans, Floats, Integers, Surface


@dataclass(frozen=True, eq=False)
class Mesh:
    """A surface without stray vertices, measured in mean edges.

    ``pull`` is 1 over the number of each vertex' faces, ``rim`` the vertices at the boundary, ``counts`` those whose
    error counts, ``isotropic`` the operators of the isotropic filter, ``drifting`` the share of its displacement along
    the surface that is kept.
    """

    V: Floats
    F: Integers
    graph: FaceGraph
    kernels: FaceKernels
    pull: Floats
    rim: Booleans
    counts: Booleans
    isotropic: Prepared
    drifting: float = 1.0


def built(V: Floats, F: Integers, counts: Booleans) -> Mesh:
    """The graphs and operators of a surface in mean edges, every vertex with a face."""
    graph = face_graph(F, len(V))
    pull = 1.0 / np.maximum(np.diff(graph.vertex_indptr), 1)
    prepared = assemble(V, F, "uniform", weld=False)
    rim = np.zeros(len(V), dtype=np.bool_)
    if prepared.rim is not None:
        rim[prepared.moving[prepared.rim.vertices]] = True
    return Mesh(V, F, graph, face_kernels(graph), pull, rim, counts, prepared)


def mean_side(V: Floats, F: Integers) -> float:
    """Mean length of the faces' sides."""
    exponent = int(np.frexp(np.abs(V).max())[1])  # squares of coordinates may be no numbers
    X = np.ldexp(V, -exponent)
    sides = [np.sqrt(((X[F[:, k]] - X[F[:, k - 1]]) ** 2).sum(axis=1)).mean() for k in range(3)]
    return float(np.ldexp(np.mean(sides), exponent))


def volume_of(mesh: Mesh, V: Floats) -> float:
    """Signed, in cubed mean edges; means something of a closed surface."""
    centre, normal, area = mesh.kernels.frames(V - V.mean(axis=0))
    return float(np.einsum("ij,ij,i->", centre, normal, area) / 6)


def smooth_automatically(mesh: Mesh, V: Floats, favor: str) -> SmoothingResult:
    """What the isotropic filter makes of positions by itself: impulses are drawn in first."""
    return _moved_to(mesh, V).smooth(favor=favor)


def at_positions(mesh: Mesh, V: Floats) -> Mesh:
    """The mesh with other positions of its vertices."""
    return replace(mesh, V=V, isotropic=_moved_to(mesh, V))


def _moved_to(mesh: Mesh, V: Floats) -> Prepared:
    """The isotropic filter of other positions of the mesh's vertices."""
    prepared = mesh.isotropic
    shift = np.ldexp((V - mesh.V)[prepared.moving], -prepared.exponent)
    return replace(prepared, surface=Surface(V, mesh.F), positions=prepared.positions + shift)


def smooth_isotropically(mesh: Mesh, V: Floats, weight: float) -> Floats:
    """The paper's smoothing of other positions of the mesh's vertices; at the rim along the normals alone.

    The rest of a rim's displacement would draw it inwards.
    """
    X = _moved_to(mesh, V).smooth(barycenter_weight=weight, response="heat", boundary="free").vertices
    if mesh.drifting < 1:
        n = normals(X, mesh.F)
        across = n * ((X - V) * n).sum(axis=1)[:, None]
        X = V + across + mesh.drifting * (X - V - across)
    if mesh.rim.any():
        n = normals(X, mesh.F)[mesh.rim]
        step = (X - V)[mesh.rim]
        X[mesh.rim] = V[mesh.rim] + n * (n * step).sum(axis=1)[:, None]
    return X

"""A mesh in units of its mean edge, and the isotropic filter on it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from meshlab_specsmooth.arrays import Booleans, Floats, Integers
from meshlab_specsmooth.geometry.surface import Surface
from meshlab_specsmooth.graph.backend import face_graph, face_kernels
from meshlab_specsmooth.graph.creases import Cut, cut_along, cut_graph
from meshlab_specsmooth.graph.face_adjacency import FaceGraph
from meshlab_specsmooth.graph.protocols import FaceKernels
from meshlab_specsmooth.noise.estimate import normals
from meshlab_specsmooth.smoothing.api import Prepared, SmoothingResult, assemble

_DIGITS = 30  # binary ones of the unit of length


@dataclass(frozen=True, eq=False)
class Mesh:
    """A surface without stray vertices, measured in mean edges.

    ``pull`` is 1 over the number of each vertex' faces, 0 where the vertex follows no normals, ``rim`` the vertices at
    the boundary, ``counts`` those whose error counts, ``isotropic`` the operators of the isotropic filter, on the
    surface cut along its creases, ``drifting`` the share of its displacement along the surface that is kept.
    ``boundary`` says what happens at the rim, ``cut`` where the creases are, if there are any.
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
    boundary: str = "auto"
    cut: Cut | None = None

    @property
    def holds_rim(self) -> bool:
        """Whether vertices at the boundary follow no normals."""
        return self.boundary in ("fixed", "curve") and bool(self.rim.any())


def built(V: Floats, F: Integers, counts: Booleans, boundary: str = "auto", creases: Integers | None = None) -> Mesh:
    """The graphs and operators of a surface in mean edges, every vertex with a face."""
    graph = face_graph(F, len(V))
    pull = 1.0 / np.maximum(np.diff(graph.vertex_indptr), 1)
    prepared = assemble(V, F, "uniform", weld=False)
    rim = np.zeros(len(V), dtype=np.bool_)
    if prepared.rim is not None:
        rim[prepared.moving[prepared.rim.vertices]] = True
    mesh = Mesh(V, F, graph, face_kernels(graph), pull, rim, counts, prepared, boundary=boundary)
    if mesh.holds_rim:
        pull[rim] = 0.0
    return mesh if creases is None else with_creases(mesh, creases)


def with_creases(mesh: Mesh, creases: Integers) -> Mesh:
    """The mesh, nothing crossing these edges.

    Faces on their opposite sides exchange no normals, and the isotropic filter works on the surface cut along them,
    where it leaves the ends of the creases in place.
    """
    if len(creases) == 0:
        return mesh
    n = len(mesh.V)
    cut = cut_along(mesh.F, n, creases)
    graph = cut_graph(mesh.F, n, cut)
    isotropic = assemble(mesh.V[cut.origin], cut.corners, "uniform", weld=False)
    return replace(mesh, graph=graph, kernels=face_kernels(graph), isotropic=isotropic, cut=cut)


def mean_side(V: Floats, F: Integers) -> float:
    """Mean length of the faces' sides, to nine digits, which do not depend on the order that they are added up in."""
    exponent = int(np.frexp(np.abs(V).max())[1])  # squares of coordinates may be no numbers
    X = np.ldexp(V, -exponent)
    sides = [np.sqrt(((X[F[:, k]] - X[F[:, k - 1]]) ** 2).sum(axis=1)).mean() for k in range(3)]
    mantissa, binary = np.frexp(np.mean(sides))
    return float(np.ldexp(np.rint(np.ldexp(mantissa, _DIGITS)), int(binary) - _DIGITS + exponent))


def volume_of(mesh: Mesh, V: Floats) -> float:
    """Signed, in cubed mean edges; means something of a closed surface."""
    center, normal, area = mesh.kernels.face_geometry(V - V.mean(axis=0))
    return float(np.einsum("ij,ij,i->", center, normal, area) / 6)


def smooth_automatically(mesh: Mesh, V: Floats, criterion: str) -> SmoothingResult:
    """What the isotropic filter makes of positions by itself: impulses are clipped first."""
    return _isotropic(mesh, V, criterion=criterion, boundary=mesh.boundary)


def at_positions(mesh: Mesh, V: Floats) -> Mesh:
    """The mesh, not cut along creases, with other positions of its vertices."""
    return replace(mesh, V=V, isotropic=_moved_to(mesh.isotropic, V, mesh.F, V - mesh.V))


def _isotropic(mesh: Mesh, V: Floats, **given: Any) -> SmoothingResult:
    """The isotropic filter of other positions of the mesh's vertices."""
    if mesh.cut is None:
        return _moved_to(mesh.isotropic, V, mesh.F, V - mesh.V).smooth(**given)
    origin = mesh.cut.origin
    moved = _moved_to(mesh.isotropic, V[origin], mesh.cut.corners, (V - mesh.V)[origin])
    result = moved.smooth(mask=~mesh.cut.on[origin], **given)
    return replace(result, vertices=result.vertices[: len(V)])  # where there are several of one, they stay


def _moved_to(prepared: Prepared, V: Floats, F: Integers, step: Floats) -> Prepared:
    """The isotropic filter of vertices that are a step away."""
    shift = np.ldexp(step[prepared.moving], -prepared.exponent)
    return replace(prepared, surface=Surface(V, F), positions=prepared.positions + shift)


def smooth_isotropically(mesh: Mesh, V: Floats, weight: float) -> Floats:
    """The paper's smoothing of other positions of the mesh's vertices.

    At the rim along the normals alone, unless something else was asked for: the rest of a rim's displacement would draw
    it inward.
    """
    boundary = "free" if mesh.boundary == "auto" else mesh.boundary
    if mesh.cut is not None and not mesh.rim.any():
        boundary = "fixed"  # the only rims are those of the cut: what is one-sided there is not to be passed on
    X = _isotropic(mesh, V, barycenter_weight=weight, response="heat", boundary=boundary).vertices
    at_rim = X[mesh.rim]
    if mesh.drifting < 1:
        n = normals(X, mesh.F)
        across = n * ((X - V) * n).sum(axis=1)[:, None]
        X = V + across + mesh.drifting * (X - V - across)
    if mesh.holds_rim:
        X[mesh.rim] = at_rim
    elif mesh.boundary == "auto" and mesh.rim.any():
        n = normals(X, mesh.F)[mesh.rim]
        step = (X - V)[mesh.rim]
        X[mesh.rim] = V[mesh.rim] + n * (n * step).sum(axis=1)[:, None]
    return X

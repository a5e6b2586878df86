"""The operators of a mesh on its faces, in units of its mean edge, beside those of the isotropic filter."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from meshlab_specsmooth.arrays import Booleans, Floats, Integers
from meshlab_specsmooth.geometry.surface import Surface
from meshlab_specsmooth.geometry.triangles import compute_vertex_normals
from meshlab_specsmooth.graph.backend import face_graph, face_kernels
from meshlab_specsmooth.graph.creases import Cut, cut_along, cut_graph
from meshlab_specsmooth.graph.face_adjacency import FaceGraph
from meshlab_specsmooth.graph.laplacian import spread_highest
from meshlab_specsmooth.graph.protocols import FaceKernels
from meshlab_specsmooth.noise.voxels import Voxels
from meshlab_specsmooth.operators.assemble import Operators, assemble_surface
from meshlab_specsmooth.operators.patches import MIN_COUNTED, Patches, draw_patches
from meshlab_specsmooth.smoothing.automatic import smooth_operators
from meshlab_specsmooth.smoothing.filter import smooth_by_setting
from meshlab_specsmooth.smoothing.result import SmoothingResult
from meshlab_specsmooth.smoothing.settings import Region, Smoothing
from meshlab_specsmooth.spectral.low_pass import Heat

# Smaller weights bend the boundary of an open surface, where the Laplacian is one-sided. The weight is then this at the
# boundary, and falls to that of the rest over so many rings.
# docs/constants.md: _MIN_BENT
_MIN_BENT = 0.12
# docs/constants.md: _WEIGHT_OF_RIM, _RINGS_OF_RIM
_WEIGHT_OF_RIM, _RINGS_OF_RIM = 0.3, 12

# Tolerance of the least squares where a part of a surface is to give what the whole does: what differs by more than
# rounding in a guide may turn a face to the other side of an edge.
_EXACT = 1e-8

_DIGITS = 30  # binary digits of the unit of length


@dataclass(frozen=True, eq=False)
class FaceOperators:
    """The graph of the faces of a mesh, and the operators of the isotropic filter on it.

    Attributes
    ----------
    V : (n, 3) float64
        Positions in mean edges; every vertex has a face.
    F : (m, 3) int32
    graph : FaceGraph
    kernels : FaceKernels
    step_size : (n,) float64
        One over the number of each vertex' faces; 0 where the vertex follows no normals.
    on_boundary : (n,) bool
    counted : (n,) bool
        Vertices whose error counts.
    ops : Operators
        Of the isotropic filter, on the surface cut along its creases.
    tangential_fraction : float
        The fraction of the isotropic filter's displacement along the surface that is kept.
    boundary : {"auto", "fixed", "curve", "free"}
    cut : Cut or None
        The creases, if there are any.
    voxels : Voxels or None
        Of the mask that the surface was made from, where these are known.
    is_exact : bool
        Whether equations are solved to rounding, so that a part of a surface gives what the whole does.
    """

    V: Floats
    F: Integers
    graph: FaceGraph
    kernels: FaceKernels
    step_size: Floats
    on_boundary: Booleans
    counted: Booleans
    ops: Operators
    tangential_fraction: float = 1.0
    boundary: str = "auto"
    cut: Cut | None = None
    voxels: Voxels | None = None
    is_exact: bool = False

    @property
    def holds_boundary(self) -> bool:
        """Whether vertices on the boundary follow no normals."""
        return self.boundary in ("fixed", "curve") and bool(self.on_boundary.any())


def assemble_faces(
    V: Floats,
    F: Integers,
    counted: Booleans,
    boundary: str = "auto",
    voxels: Voxels | None = None,
    is_exact: bool = False,
) -> FaceOperators:
    """The operators of a surface in mean edges, every vertex with a face."""
    graph = face_graph(F, len(V))
    step_size = 1.0 / np.maximum(np.diff(graph.vertex_indptr), 1)
    ops = assemble_surface(Surface(V, F), weld=False)
    on_boundary = np.zeros(len(V), dtype=np.bool_)
    on_boundary[ops.active[ops.boundary_vertices]] = True
    mesh = FaceOperators(
        V,
        F,
        graph,
        face_kernels(graph),
        step_size,
        on_boundary,
        counted,
        ops,
        boundary=boundary,
        voxels=voxels,
        is_exact=is_exact,
    )
    if mesh.holds_boundary:
        step_size[on_boundary] = 0.0
    return mesh


def cut_along_creases(mesh: FaceOperators, creases: Integers) -> FaceOperators:
    """The mesh without connections across the creases, (k, 2) vertex pairs.

    Faces on opposite sides exchange no normals. The isotropic filter works on the surface cut along the creases, and
    leaves their ends in place.
    """
    if len(creases) == 0:
        return mesh
    n = len(mesh.V)
    cut = cut_along(mesh.F, n, creases)
    graph = cut_graph(mesh.F, n, cut)
    ops = assemble_surface(Surface(mesh.V[cut.origin], cut.corners), weld=False)
    return replace(mesh, graph=graph, kernels=face_kernels(graph), ops=ops, cut=cut)


def draw_sample(mesh: FaceOperators) -> tuple[FaceOperators, Patches, npt.NDArray[np.integer]]:
    """The mesh where it is small, else patches of it, for the search of a setting.

    Returns
    -------
    sample : FaceOperators
    patches : Patches
        The same for estimating noise.
    vertices : (k,) int
        Which vertices of the mesh these are.
    """
    ops, at = mesh.ops, mesh.ops.active
    patches = draw_patches(replace(ops, positions=mesh.V[at]), mesh.counted[at])
    vertices = at[patches.vertices]
    counted = mesh.counted[vertices] if len(vertices) == len(mesh.V) else patches.counted
    if counted.sum() < MIN_COUNTED:
        counted = np.ones_like(counted)
    sample = assemble_faces(patches.ops.positions, patches.ops.faces, counted, is_exact=mesh.is_exact)
    return sample, patches, vertices


def cut_sample(
    sample: FaceOperators, vertices: npt.NDArray[np.integer], creases: Integers, count: int
) -> FaceOperators:
    """The sample cut along those creases of the mesh, which has ``count`` vertices, that lie in it."""
    index = np.full(count, -1, dtype=np.int32)
    index[vertices] = np.arange(len(vertices), dtype=np.int32)
    among = index[creases]
    # patches need not have a face at every edge between two of their vertices
    sides = np.concatenate([sample.F[:, [0, 1]], sample.F[:, [1, 2]], sample.F[:, [2, 0]]])
    n = len(vertices)
    keys, wanted = (np.sort(x, axis=1).astype(np.int64) @ np.array([n, 1]) for x in (sides, among))
    return cut_along_creases(sample, among[(among >= 0).all(axis=1) & np.isin(wanted, keys)])


def compute_mean_side(V: Floats, F: Integers) -> float:
    """Mean length of the faces' sides, to nine digits, so that it does not depend on the order of summation."""
    exponent = int(np.frexp(np.abs(V).max())[1])  # squares of coordinates may overflow
    X = np.ldexp(V, -exponent)
    sides = [np.sqrt(((X[F[:, k]] - X[F[:, k - 1]]) ** 2).sum(axis=1)).mean() for k in range(3)]
    mantissa, binary = np.frexp(np.mean(sides))
    return float(np.ldexp(np.rint(np.ldexp(mantissa, _DIGITS)), int(binary) - _DIGITS + exponent))


def compute_volume(mesh: FaceOperators, V: Floats) -> float:
    """Signed volume in cubed mean edges; meaningful for a closed surface."""
    center, normal, area = mesh.kernels.face_geometry(V - V.mean(axis=0))
    return float(np.einsum("ij,ij,i->", center, normal, area) / 6)


def smooth_automatically(mesh: FaceOperators, V: Floats) -> SmoothingResult:
    """What the isotropic filter makes of positions by a choice of its own; impulses are clipped first."""
    spacing = None
    if mesh.voxels is not None:  # they are along the axes where they are given
        x, y, z = np.abs(mesh.voxels.axes.T @ mesh.voxels.spacing).tolist()
        spacing = (x, y, z)
    return _smooth(mesh, V, Smoothing(spacing=spacing), mesh.boundary)


def smooth_isotropically(mesh: FaceOperators, V: Floats, weight: float) -> Floats:
    """The paper's smoothing of other positions of the mesh's vertices.

    On the boundary along the normals alone, unless another treatment is set: the rest of its displacement would pull it
    inward.
    """
    boundary = "free" if mesh.boundary == "auto" else mesh.boundary
    if mesh.cut is not None and not mesh.on_boundary.any():
        boundary = "fixed"  # the only boundaries are those of the cut, where differential coordinates are one-sided
    held = _hold_rim(mesh, weight) if boundary == "free" else weight
    X = _smooth(mesh, V, Smoothing(low_pass=Heat(), barycenter_weight=held), boundary).vertices
    on_boundary = X[mesh.on_boundary]
    if mesh.tangential_fraction < 1:
        n = compute_vertex_normals(X, mesh.F)
        normal = n * ((X - V) * n).sum(axis=1)[:, None]
        X = V + normal + mesh.tangential_fraction * (X - V - normal)
    if mesh.holds_boundary:
        X[mesh.on_boundary] = on_boundary
    elif mesh.boundary == "auto" and mesh.on_boundary.any():
        n = compute_vertex_normals(X, mesh.F)[mesh.on_boundary]
        step = (X - V)[mesh.on_boundary]
        X[mesh.on_boundary] = V[mesh.on_boundary] + n * (n * step).sum(axis=1)[:, None]
    return X


def _hold_rim(mesh: FaceOperators, weight: float) -> float | Floats:
    """The weight, firmer toward the boundary of an open surface, where strong smoothing would bend it."""
    if weight >= _MIN_BENT or not mesh.on_boundary.any():
        return weight
    # the operators are those of the surface cut along its creases
    on_boundary = mesh.on_boundary if mesh.cut is None else mesh.on_boundary[mesh.cut.origin]
    at = mesh.ops.active
    near = on_boundary[at].astype(np.float64)
    reached = near.copy()
    for ring in range(1, _RINGS_OF_RIM):
        reached = spread_highest(mesh.ops.L, reached)
        near = np.maximum(near, (1 - ring / _RINGS_OF_RIM) * reached)
    found = np.full(len(on_boundary), weight)
    found[at] = weight * (_WEIGHT_OF_RIM / weight) ** near
    return found


def at_positions(mesh: FaceOperators, V: Floats) -> FaceOperators:
    """The mesh, not cut along creases, with other positions of its vertices."""
    return replace(mesh, V=V, ops=_move(mesh.ops, V, mesh.F, V - mesh.V))


def _smooth(mesh: FaceOperators, V: Floats, setting: Smoothing, boundary: str) -> SmoothingResult:
    """The isotropic filter of other positions of the mesh's vertices."""
    region = Region(boundary=boundary)  # type: ignore[arg-type]
    apply = smooth_operators if setting.barycenter_weight is None else smooth_by_setting
    if mesh.is_exact:
        setting = replace(setting, method="chebyshev", tolerance=_EXACT)
    if mesh.cut is None:
        return apply(_move(mesh.ops, V, mesh.F, V - mesh.V), setting, region)
    origin = mesh.cut.origin
    moved = _move(mesh.ops, V[origin], mesh.cut.corners, (V - mesh.V)[origin])
    result = apply(moved, setting, replace(region, mask=~mesh.cut.on[origin]))
    return replace(result, vertices=result.vertices[: len(V)])  # where there are several of one, they stay


def _move(ops: Operators, V: Floats, F: Integers, step: Floats) -> Operators:
    """The isotropic operators with vertices that are a step away."""
    shift = np.ldexp(step[ops.active], -ops.exponent)
    return replace(ops, surface=Surface(V, F), positions=ops.positions + shift)

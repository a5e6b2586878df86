"""The mesh with its operators: everything that does not depend on a setting, built once."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
import numpy.typing as npt

from meshlab_specsmooth.adapters import Mesh, Source, accept_meshes, recognize
from meshlab_specsmooth.arrays import Booleans, Floats, Integers
from meshlab_specsmooth.choices import LaplacianKind
from meshlab_specsmooth.geometry import order
from meshlab_specsmooth.geometry.surface import Surface
from meshlab_specsmooth.geometry.welding import find_copies
from meshlab_specsmooth.graph.build import mesh_graph
from meshlab_specsmooth.graph.laplacian import Laplacian
from meshlab_specsmooth.operators.barycenters import Gram, gram_of_barycenters
from meshlab_specsmooth.operators.boundary import BoundaryCurve, boundary_curve
from meshlab_specsmooth.operators.laplacians import LAPLACIANS, laplacian_of_kind
from meshlab_specsmooth.parameters import check_choice, check_flag, check_progress
from meshlab_specsmooth.runtime import blocks
from meshlab_specsmooth.runtime.memory import require
from meshlab_specsmooth.runtime.progress import Progress, announce
from meshlab_specsmooth.spectral import density, eigenbasis
from meshlab_specsmooth.spectral.density import Density

# Peak memory of a call beyond the arrays that it is given, a copy of the input included, with room to spare:
# scripts/benchmark_speed.py measured 308 to 367 bytes a vertex with the compiled kernels.
# docs/constants.md: BYTES_PER_VERTEX
BYTES_PER_VERTEX = 600


@dataclass(frozen=True, eq=False)
class Operators:
    """A mesh and the operators of the paper on it; made by :func:`assemble`.

    The operators act on the *active* vertices, those with an edge, scaled to [-1, 1]; vertices at one place are one.

    Attributes
    ----------
    surface : Surface
        As given.
    active : (k,) int32
        The vertices of the surface that the operators act on, in an order that keeps neighbors near each other.
    active_index : (n,) int32 or None
        Position of each vertex of the surface among these, -1 for vertices without an edge; None where all vertices
        are active, in the order given.
    positions : (k, 3) float64
        Their positions, centered, times 2^-exponent.
    exponent : int
    mean_edge : float
        Mean edge length of ``positions``.
    faces : (m, 3) int32
        The faces with an edge, as indices of active vertices.
    L : Laplacian
    gram : Gram
        C^T C of the face barycenters.
    boundary : BoundaryCurve or None
        None for a closed surface.
    laplacian : {"uniform", "cotangent"}
    mode_density : Density or None
        Density of the modes of L, which turns a number of modes into a cut-off; None where it was not measured.
    welded : int
        Number of vertices that lie where another one does.
    notes : tuple of str
        Remarks on the surface that every result repeats.
    source : Source or None
        The mesh that was given.
    """

    surface: Surface
    active: Integers
    active_index: Integers | None
    positions: Floats
    exponent: int
    mean_edge: float
    faces: Integers
    L: Laplacian
    gram: Gram
    boundary: BoundaryCurve | None
    laplacian: str
    mode_density: Density | None = None
    welded: int = 0
    notes: tuple[str, ...] = ()
    source: Source | None = field(default=None, repr=False)

    def __repr__(self) -> str:
        """One line: the arrays are long."""
        V, F = self.surface.vertices, self.surface.faces
        return f"<Operators: {len(V)} vertices, {len(F)} faces, {self.laplacian} Laplacian>"

    def spread(self, values: Floats, elsewhere: float = 0.0) -> Floats:
        """(n,) values of the active vertices, (k,), at the vertices of the surface."""
        if self.active_index is None:
            return values
        found = np.full(len(self.active_index), elsewhere)
        is_active = self.active_index >= 0
        found[is_active] = values[self.active_index[is_active]]
        return found

    @property
    def boundary_vertices(self) -> Integers:
        """(b,) int32 indices of the active vertices on the boundary."""
        return np.empty(0, dtype=np.int32) if self.boundary is None else self.boundary.vertices


def with_scale(ops: Operators, mean_edge: float, curve_edge: float) -> Operators:
    """The operators with the mean edges of a surface that theirs is a part of, and of its boundary, in mesh units."""
    if ops.boundary is None:
        return ops
    edge, of_curve = (float(np.ldexp(length, -ops.exponent)) for length in (mean_edge, curve_edge))
    return replace(ops, mean_edge=edge, boundary=replace(ops.boundary, mean_edge=of_curve))


@accept_meshes
def assemble(
    mesh: Mesh,
    faces: npt.ArrayLike | None = None,
    *,
    laplacian: LaplacianKind = "uniform",
    weld: bool = True,
) -> Operators:
    """Assemble the operators of a mesh once, to filter it many times.

    Parameters
    ----------
    mesh : (n, 3) real array, or a mesh of any kind
        Vertices, in mesh units.
    faces : (m, 3) integer array, optional
        As for :func:`meshlab_specsmooth.smooth`.
    laplacian : {"uniform", "cotangent"}
        Weights of the edges: all 1 (the paper, eq. 1), or by the cotangents of the opposite angles.
    weld : bool
        Whether vertices at one place move as one, as along texture seams and in triangle soups. Without, each copy is a
        vertex of its own, and the surface ends at its edges.

    Returns
    -------
    Operators
        Accepted by :func:`meshlab_specsmooth.smooth` and the other functions in place of a mesh.

    Raises
    ------
    InvalidSurface
        The arrays do not form a triangle mesh.
    TooLarge
        The mesh would not fit in memory.

    Examples
    --------
    >>> import meshlab_specsmooth as mss
    >>> corners = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]
    >>> ops = mss.assemble(corners, [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])
    >>> [mss.smooth(ops, modes=k).method for k in (1, 4)]
    ['exact', 'exact']
    """
    source = recognize(mesh, faces)
    ops = replace(assemble_surface(source.surface(), laplacian, weld=weld), source=source.kept())
    if ops.L.size <= eigenbasis.DENSE_VERTICES:  # there the modes are counted exactly
        return ops
    with blocks.one_blas_thread():
        return replace(ops, mode_density=density.estimate_density(ops.L))


def as_operators(
    mesh: Mesh, faces: npt.ArrayLike | None, laplacian: str, *, weld: bool = True, progress: Progress | None = None
) -> Operators:
    """The operators that are given in place of a mesh, or those of a mesh of any kind."""
    if isinstance(mesh, Operators):
        return mesh
    source = recognize(mesh, faces)
    ops = assemble_surface(source.surface(), laplacian, weld=weld, progress=progress)
    return replace(ops, source=source.kept())


def as_uniform(ops: Operators) -> Operators:
    """The operators with the uniform Laplacian, with which noise is measured."""
    return ops if ops.laplacian == "uniform" else assemble_surface(ops.surface, weld=ops.welded > 0)


def assemble_surface(
    surface: Surface, laplacian: str = "uniform", *, weld: bool = True, progress: Progress | None = None
) -> Operators:
    """The same for a checked surface, without the density of modes, which pays only over many runs."""
    weld = check_flag("weld", weld)
    report = check_progress(progress) or (lambda fraction: None)
    announce(progress, "assembling")
    laplacian = check_choice("laplacian", laplacian, LAPLACIANS)
    V, F = surface.vertices, surface.faces
    require(BYTES_PER_VERTEX * len(V), f"smoothing {len(V)} vertices")
    report(0.2)
    copies = find_copies(V, find_referenced_vertices(F, len(V))) if weld else None
    if copies is not None:
        given, F = F, copies.take(F)
    F = drop_point_faces(F)
    active = np.flatnonzero(find_referenced_vertices(F, len(V))).astype(np.int32)
    is_scattered = order.is_scattered(F, len(V))
    active_index: Integers | None = None
    if is_scattered:
        # `take` is several times as fast as brackets, here and below
        active = active.take(order.morton_order(V if len(active) == len(V) else V.take(active, axis=0)))
    if is_scattered or len(active) < len(V):
        active_index = np.full(len(V), -1, dtype=np.int32)
        active_index[active] = np.arange(len(active), dtype=np.int32)
        F = active_index.take(F)
    welded = 0
    if copies is not None and active_index is not None:
        used = find_referenced_vertices(given, len(V))
        active_index[used] = active_index[copies[used]]
        welded = int((copies[used] != np.flatnonzero(used)).sum())
    report(0.4)
    positions, exponent = _normalize(V if active_index is None else V.take(active, axis=0))
    return _assemble(surface, active, active_index, positions, exponent, F, laplacian, welded, report)


def assemble_patch(positions: Floats, faces: Integers) -> Operators:
    """The uniform operators of a part of a mesh, whose vertices all have an edge, in its own units and order."""
    active = np.arange(len(positions), dtype=np.int32)
    surface = Surface(positions, faces)
    return _assemble(surface, active, None, positions, 0, faces, "uniform", 0, lambda fraction: None)


def at_positions(ops: Operators, positions: Floats) -> Operators:
    """The same mesh with other positions, (k, 3), of the active vertices."""
    return replace(ops, positions=positions, mean_edge=ops.L.mean_edge_length(positions))


def _assemble(
    surface: Surface,
    active: Integers,
    active_index: Integers | None,
    positions: Floats,
    exponent: int,
    F: Integers,
    laplacian: str,
    welded: int,
    report: Progress,
) -> Operators:
    mesh = mesh_graph(F, len(active))
    report(0.8)
    L = laplacian_of_kind(laplacian, mesh, positions, F)
    boundary = mesh.boundary()
    report(1.0)
    return Operators(
        surface,
        active,
        active_index,
        positions,
        exponent,
        L.mean_edge_length(positions),
        F,
        L,
        gram_of_barycenters(mesh),
        boundary_curve(positions, boundary),
        laplacian,
        welded=welded,
        notes=tuple(_describe_surface(surface, len(boundary), len(mesh.graph.indices) // 2)),
    )


def find_referenced_vertices(F: Integers | npt.NDArray[np.int64], n: int) -> Booleans:
    """(n,) whether a face refers to a vertex."""
    found = np.zeros(n, dtype=np.bool_)

    def mark(at: slice) -> None:
        found[F[at]] = True

    blocks.parallel_rows(mark, len(F))
    return found


def drop_point_faces(F: Integers) -> Integers:
    """The faces without those whose three corners are one vertex: these have no edge."""
    first = F[:, 0] == F[:, 1]
    return F[~(first & (F[:, 1] == F[:, 2]))] if first.any() else F


def describe_unused(surface: Surface) -> list[str]:
    """A remark on vertices that no face uses and that are not finite, if there are any."""
    count = surface.unused_not_finite
    return [f"{count} vertices that no face uses are not finite and take no part"] if count else []


def _describe_surface(surface: Surface, boundary_edges: int, edges: int) -> list[str]:
    """Remarks that every result repeats."""
    notes = describe_unused(surface)
    if 2 * boundary_edges > edges:
        notes.append(
            f"{boundary_edges} of {edges} edges have one face only: what is not connected is not smoothed across "
            "(merge close vertices first)"
        )
    return notes


def _normalize(V: Floats) -> tuple[Floats, int]:
    """``V`` centered and divided by 2^exponent, so that it lies in [-1, 1]; a power of two rounds nothing."""
    if len(V) == 0:
        return V, 0
    low, high = (blocks.reduce_rows(of, V) for of in (np.minimum, np.maximum))
    center = low / 2 + high / 2
    exponent = int(np.frexp((high - center).max())[1])
    centered = np.empty_like(V)

    def center_rows(at: slice) -> None:
        np.subtract(V[at], center, out=centered[at])
        centered[at] = scale_by_power(centered[at], -exponent)

    blocks.parallel_rows(center_rows, len(V))
    return centered, exponent


def scale_by_power(X: Floats, exponent: int) -> Floats:
    """X times 2^exponent, in place where that power is a number."""
    if abs(exponent) < np.finfo(np.float64).maxexp:
        X *= 2.0**exponent
        return X
    return np.ldexp(X, exponent)

"""The work on one piece: gather it with its margin, smooth it, and store its own vertices."""

from __future__ import annotations

import time
from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np
import numpy.typing as npt

from meshlab_specsmooth.arrays import Booleans, Floats
from meshlab_specsmooth.batching.record import DONE, FAILED, SKIPPED, Outcome
from meshlab_specsmooth.geometry.surface import Surface, vertex_normals
from meshlab_specsmooth.geometry.triangles import number_edges
from meshlab_specsmooth.geometry.welding import find_copies
from meshlab_specsmooth.noise.shape_change import Shape, measure_shape
from meshlab_specsmooth.pieces.cut import VALENCE, read_faces
from meshlab_specsmooth.pieces.filter import smooth_piece
from meshlab_specsmooth.pieces.partition import find_owners
from meshlab_specsmooth.pieces.plan import Plan, read_plan, unpack_tree
from meshlab_specsmooth.pieces.ply import PlyFile, open_ply, stack
from meshlab_specsmooth.runtime import atomic

Indices = npt.NDArray[np.int64]

#: Begins the reason of a piece whose margin does not hold the rings that it needs.
TOO_NARROW = "the margin is too narrow"


@dataclass(frozen=True)
class PieceJob:
    """A piece; all of it plain values, for other processes and machines.

    Attributes
    ----------
    source : str
        The whole mesh.
    output : str
        Where the result of the piece goes.
    folder : str
        With the plan and the files that the cut has written.
    number : int
    """

    source: str
    output: str
    folder: str
    number: int


@dataclass(frozen=True, eq=False)
class _Gathered:
    """The faces that may belong to a piece, and their vertices.

    ``place`` is the first vertex at the place of each.
    """

    ids: Indices
    V: Floats
    F: Indices
    own: Booleans
    place: Indices

    def boundary(self, F: Indices) -> Indices:
        """(b, 2) edges of one face, of which a vertex is owned."""
        edges, number = number_edges(self.place[F[self.own[F].any(axis=1)]], len(self.V))
        is_single = np.bincount(number.ravel(), minlength=len(edges)) == 1
        return np.asarray(edges[is_single & (edges[:, 0] != edges[:, 1]) & self.own[edges].any(axis=1)])


def _gather(folder: Path, number: int, file: PlyFile, plan: Plan) -> _Gathered:
    corners = read_faces(folder, number)
    ids, local = np.unique(corners, return_inverse=True)
    V = stack(file.positions()[ids])
    own = find_owners(unpack_tree(plan.tree), V) == number
    copies = find_copies(V, np.ones(len(V), dtype=np.bool_)) if plan.weld else None
    place = np.arange(len(V)) if copies is None else copies.astype(np.int64)
    return _Gathered(ids, V, local.reshape(-1, 3).astype(np.int64), own, place)


def measure_boundary(folder: Path, number: int, file: PlyFile, plan: Plan) -> tuple[float, float]:
    """Return the length of the boundary that a piece owns, and its number of edges; those with one end count half."""
    piece = _gather(folder, number, file, plan)
    edges = piece.boundary(piece.F)
    shares = piece.own[edges].mean(axis=1)
    lengths = np.linalg.norm(piece.V[edges[:, 0]] - piece.V[edges[:, 1]], axis=1)
    return float((lengths * shares).sum()), float(shares.sum())


def run_piece(job: PieceJob) -> Outcome:
    """Smooth a piece, and store what it owns."""
    start = time.perf_counter()
    output = Path(job.output)
    if output.exists():
        return Outcome(job.source, job.output, SKIPPED)
    folder = Path(job.folder)
    plan, file = read_plan(folder), open_ply(job.source)
    piece = _gather(folder, job.number, file, plan)
    V, F, own = piece.V, piece.F, piece.own
    needed = np.memmap(folder / VALENCE, np.int32, "r", shape=(file.vertex_count,))[piece.ids]
    is_whole = np.bincount(F.ravel(), minlength=len(V)) == needed
    rings = count_rings(F, own, piece.place, plan.rings)
    if (~is_whole & (rings < plan.rings)).any():
        reached = int(rings[~is_whole].min())
        return Outcome(job.source, job.output, FAILED, f"{TOO_NARROW}: {reached} of {plan.rings} rings")
    kept = F[(rings <= plan.rings)[F].all(axis=1)]
    used, inner = np.unique(kept, return_inverse=True)
    X, G = V[used], inner.reshape(-1, 3).astype(np.int64)
    mine = own[used]
    Y = smooth_piece(plan, X, G, rings[used] == plan.rings) if len(G) else X
    corners = G.astype(np.int32)
    owned = corners[own[kept][:, 0]]
    center = np.array(plan.center)
    before, after = (measure_shape(positions - center, owned, among=mine) for positions in (X, Y))
    square = float(np.square((Y - X)[mine]).sum())
    normals = vertex_normals(Surface(Y, corners))[mine] if len(G) else np.zeros((len(X), 3))
    sums = Sums(before, after, square, len(piece.boundary(kept)))
    _store(output, PieceResult(piece.ids[used][mine], Y[mine], normals, sums))
    seconds = time.perf_counter() - start
    return Outcome(job.source, job.output, DONE, vertices=int(mine.sum()), cutoff=plan.cutoff, seconds=seconds)


def count_rings(F: Indices, own: Booleans, place: Indices, most: int) -> npt.NDArray[np.int32]:
    """Return the (n,) number of edges from each vertex to the nearest one of a set, at most ``most`` + 1.

    ``place`` is the first vertex at the place of each: vertices at one place are one.
    """
    G = place[F]
    rings = np.full(len(own), most + 1, dtype=np.int32)
    rings[place[own]] = 0
    left = G
    for ring in range(1, most + 1):
        is_reached = rings[left] < ring
        left = left[~is_reached.all(axis=1)]
        near = (rings[left] < ring).any(axis=1)
        at = left[near].ravel()
        rings[at[rings[at] > ring]] = ring
        if not near.any():
            break
    return rings[place]


@dataclass(frozen=True, eq=False)
class Sums:
    """Over what a piece owns; those of all pieces add up to those of the whole.

    Attributes
    ----------
    before, after : Shape
    square : float
        Of the squared displacements.
    boundary : int
        Edges of one face at vertices of the piece.
    """

    before: Shape
    after: Shape
    square: float
    boundary: int

    def pack(self) -> Floats:
        """All numbers in a row."""
        shapes = [np.ravel(getattr(shape, each.name)) for shape in (self.before, self.after) for each in fields(shape)]
        return np.concatenate([*shapes, [self.square, self.boundary]])

    @staticmethod
    def unpack(row: Floats) -> Sums:
        """The sums of :meth:`pack`, or of rows added up."""
        shapes = []
        for start in (0, _SHAPE):
            number, faces, *rest = row[start : start + _SHAPE]
            first, second, last = np.array(rest[:3]), np.array(rest[3:12]), [np.array([x]) for x in rest[12:]]
            shapes.append(Shape(np.array([number]), np.array([faces]), first[None], second.reshape(1, 3, 3), *last))
        return Sums(shapes[0], shapes[1], float(row[-2]), int(row[-1]))


# Numbers of a Shape of one component, and of Sums
_SHAPE = 17
_ROW = 2 * _SHAPE + 2


@dataclass(frozen=True, eq=False)
class PieceResult:
    """The vertices that a piece owns; arrays are read from the file where they are used.

    Attributes
    ----------
    ids : (k,) int64, rising
    positions, normals : (k, 3) float64
    sums : Sums
    """

    ids: Indices
    positions: Floats
    normals: Floats
    sums: Sums


def _store(output: Path, result: PieceResult) -> None:
    """Write the result of a piece, whole or not at all."""
    head = np.array([len(result.ids), *result.sums.pack()], dtype=np.float64)
    with atomic.atomic_write(output) as part, part.open("wb") as file:
        for each in (head, result.ids.astype(np.int64), result.positions, result.normals):
            np.ascontiguousarray(each).tofile(file)


def read_result(path: Path) -> PieceResult:
    """Open the result of a piece."""
    count, *row = np.fromfile(path, np.float64, 1 + _ROW).tolist()
    k, start, sums = int(count), 8 * (1 + _ROW), Sums.unpack(np.array(row))
    if k == 0:
        none = np.empty((0, 3))
        return PieceResult(np.empty(0, dtype=np.int64), none, none, sums)
    ids = np.memmap(path, np.int64, "r", start, (k,))
    positions, normals = (np.memmap(path, np.float64, "r", start + at * k, (k, 3)) for at in (8, 32))
    return PieceResult(ids, positions, normals, sums)

"""The work on one piece: gather it with its margin, smooth it, and store its own vertices."""

from __future__ import annotations

import json
import time
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from meshlab_specsmooth.arrays import Booleans, Floats
from meshlab_specsmooth.batching.record import DONE, FAILED, SKIPPED, Outcome
from meshlab_specsmooth.choices import Boundary, LaplacianKind
from meshlab_specsmooth.geometry.surface import Surface, vertex_normals
from meshlab_specsmooth.geometry.triangles import compute_face_vectors
from meshlab_specsmooth.geometry.welding import find_copies
from meshlab_specsmooth.pieces.cut import VALENCE, read_faces
from meshlab_specsmooth.pieces.partition import Node, find_owners
from meshlab_specsmooth.pieces.ply import open_ply, stack
from meshlab_specsmooth.runtime import atomic
from meshlab_specsmooth.runtime.warned import unwarned
from meshlab_specsmooth.smoothing.api import smooth
from meshlab_specsmooth.spectral.response import response

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


@dataclass(frozen=True)
class Plan:
    """What is the same for all pieces.

    Attributes
    ----------
    response : str
    cutoff : float
        Eigenvalue.
    barycenter_weight : float
    iterations : int
    boundary, laplacian : str
    weld : bool
    max_displacement : float or None
    tolerance : float
        Of the least squares.
    rings : int
        Of the margin.
    tree : list
        The partition.
    """

    response: str
    cutoff: float
    barycenter_weight: float
    iterations: int
    boundary: Boundary
    laplacian: LaplacianKind
    weld: bool
    max_displacement: float | None
    tolerance: float
    rings: int
    tree: list[Any]

    def smooth(self, V: Floats, F: Indices, cut: Booleans) -> Any:
        """Smooth a piece, which is held at its ``cut`` vertices, (n,), where a boundary would not be."""
        return smooth(
            V,
            F,
            response=response(self.response, self.cutoff),
            barycenter_weight=self.barycenter_weight,
            iterations=self.iterations,
            boundary=self.boundary,
            mask=~cut if self.boundary == "free" and cut.any() else None,
            laplacian=self.laplacian,
            weld=self.weld,
            max_displacement=self.max_displacement,
            tolerance=self.tolerance,
            method="chebyshev",
        )


def write_plan(folder: Path, plan: Plan) -> None:
    """Store a plan."""
    atomic.write_text(folder / "plan.json", json.dumps(asdict(plan)) + "\n")


def read_plan(folder: Path) -> Plan:
    """Load a plan."""
    return Plan(**json.loads((folder / "plan.json").read_text(encoding="utf-8")))


def pack_tree(node: Node) -> list[Any]:
    """A partition as nested lists."""
    if node.low is None or node.high is None:
        return [node.leaf]
    return [node.axis, node.at, pack_tree(node.low), pack_tree(node.high), node.first, node.end]


def unpack_tree(packed: list[Any]) -> Node:
    """The partition of :func:`pack_tree`."""
    if len(packed) == 1:
        return Node(leaf=packed[0], first=packed[0], end=packed[0] + 1)
    axis, at, low, high, first, end = packed
    return Node(axis, at, unpack_tree(low), unpack_tree(high), first=first, end=end)


def run_piece(job: PieceJob) -> Outcome:
    """Smooth a piece, and store what it owns."""
    start = time.perf_counter()
    output = Path(job.output)
    if output.exists():
        return Outcome(job.source, job.output, SKIPPED)
    folder = Path(job.folder)
    plan = read_plan(folder)
    corners = read_faces(folder, job.number)
    ids, local = np.unique(corners, return_inverse=True)
    F = local.reshape(-1, 3).astype(np.int64)
    file = open_ply(job.source)
    V = stack(file.positions()[ids])
    own = find_owners(unpack_tree(plan.tree), V) == job.number
    needed = np.memmap(folder / VALENCE, np.int32, "r", shape=(file.vertex_count,))[ids]
    is_whole = np.bincount(F.ravel(), minlength=len(ids)) == needed
    rings = count_rings(V, F, own, plan.rings)
    if (~is_whole & (rings < plan.rings)).any():
        reached = int(rings[~is_whole].min())
        return Outcome(job.source, job.output, FAILED, f"{TOO_NARROW}: {reached} of {plan.rings} rings")
    kept = (rings <= plan.rings)[F].all(axis=1)
    used, inner = np.unique(F[kept], return_inverse=True)
    X, G = V[used], inner.reshape(-1, 3).astype(np.int64)
    if len(G) == 0:
        _store(output, ids[own], V[own], None, (0.0, 0.0), 0.0)
        return Outcome(job.source, job.output, DONE, vertices=int(own.sum()), seconds=time.perf_counter() - start)
    with unwarned():
        result = plan.smooth(X, G, rings[used] == plan.rings)
    mine = own[used]
    normals = vertex_normals(Surface(result.vertices, G.astype(np.int32)))[mine] if file.has_normals else None
    owned = own[F[kept][:, 0]]
    volumes = (_sum_volumes(X, G[owned]), _sum_volumes(result.vertices, G[owned]))
    change = result.vertices[mine] - X[mine]
    _store(output, ids[used][mine], result.vertices[mine], normals, volumes, float(np.square(change).sum()))
    return Outcome(
        job.source,
        job.output,
        DONE,
        vertices=int(mine.sum()),
        cutoff=plan.cutoff,
        seconds=time.perf_counter() - start,
    )


def count_rings(V: Floats, F: Indices, own: Booleans, most: int) -> npt.NDArray[np.int32]:
    """Return the (n,) number of edges from each vertex to the nearest one of a set, at most ``most`` + 1.

    Vertices at one place are one.
    """
    copies = find_copies(V, np.ones(len(V), dtype=np.bool_))
    place = np.arange(len(V)) if copies is None else copies.astype(np.int64)
    G = place[F]
    rings = np.full(len(V), most + 1, dtype=np.int32)
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


def _sum_volumes(V: Floats, F: Indices) -> float:
    """The volume between the faces and the origin."""
    vectors = compute_face_vectors(V, F.astype(np.int32))
    return float(np.einsum("ij,ij->", V[F[:, 0]], vectors) / 6)


def _store(
    output: Path,
    ids: Indices,
    positions: Floats,
    normals: Floats | None,
    volumes: tuple[float, float],
    square: float,
) -> None:
    """Write the result of a piece, whole or not at all."""
    with atomic.atomic_write(output) as part, part.open("wb") as file:
        head = np.array([len(ids), normals is not None, *volumes, square], dtype=np.float64)
        for each in (head, ids.astype(np.int64), positions, *([] if normals is None else [normals])):
            np.ascontiguousarray(each).tofile(file)


@dataclass(frozen=True, eq=False)
class PieceResult:
    """The vertices that a piece owns; arrays are read from the file where they are used.

    Attributes
    ----------
    ids : (k,) int64, rising
    positions : (k, 3) float64
    normals : (k, 3) float64 or None
    volumes : (float, float)
        Of the tetrahedra between its faces and the origin, before and after.
    square : float
        Sum of the squared displacements.
    """

    ids: Indices
    positions: Floats
    normals: Floats | None
    volumes: tuple[float, float]
    square: float


def read_result(path: Path) -> PieceResult:
    """Open the result of a piece."""
    count, has_normals, before, after, square = np.fromfile(path, np.float64, 5).tolist()
    k, start = int(count), 5 * 8
    if k == 0:
        none = np.empty((0, 3))
        return PieceResult(np.empty(0, dtype=np.int64), none, none if has_normals else None, (before, after), square)
    ids = np.memmap(path, np.int64, "r", start, (k,))
    positions = np.memmap(path, np.float64, "r", start + 8 * k, (k, 3))
    normals = np.memmap(path, np.float64, "r", start + 32 * k, (k, 3)) if has_normals else None
    return PieceResult(ids, positions, normals, (before, after), square)

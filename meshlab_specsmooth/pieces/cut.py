"""Cut a mesh file into pieces: two passes over its faces, with memory for one block at a time."""

from __future__ import annotations

import contextlib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

import numpy as np
import numpy.typing as npt

from meshlab_specsmooth.arrays import Floats
from meshlab_specsmooth.errors import FileError
from meshlab_specsmooth.pieces.partition import Node, route, split_space
from meshlab_specsmooth.pieces.ply import PlyFile, sample_points, stack

Indices = npt.NDArray[np.int64]

# Vertices that the partition is made from; samples of the surface, more where the noise is treated by region, and
# vertices of each
_MAX_POINTS = 200_000
_SAMPLES, _SAMPLES_BY_REGION, _SAMPLE_VERTICES = 16, 160, 12_000

# Faces of a block whose edges are measured around their place
_MAX_MEASURED = 20_000

VALENCE = "valence.bin"
_CORNER_BYTES = 24


@dataclass(frozen=True, eq=False)
class Survey:
    """What a first look at a file found.

    Attributes
    ----------
    points : (k, 3) float64
        A sample of the vertices.
    mean_edge : float
        Mean over the edges of all faces.
    measured : (k, 4) float64
        Centers of some faces, and their mean edges.
    patches : list of ((k, 3) float64, (l, 3) int64)
        Samples of the surface from all over it.
    center : (3,) float64
        Of the bounding box.
    diagonal : float
        Of the bounding box.
    """

    points: Floats
    mean_edge: float
    measured: Floats
    patches: list[tuple[Floats, Indices]]
    center: Floats
    diagonal: float


def survey(file: PlyFile, folder: Path, report: Callable[[float], None], by_region: bool = False) -> Survey:
    """Look at all vertices and faces once; writes the number of faces at each vertex into the folder.

    ``by_region``: whether there are samples of each region.

    Raises
    ------
    FileError
        A coordinate is not finite, a face is no triangle or has a vertex that is not there, or there is no face.
    """
    if file.face_count == 0 or file.vertex_count == 0:
        raise FileError(f"{file.path}: has no faces to smooth")
    blocks = ((first, stack(block)) for first, block in file.vertices())
    points, low, high = sample_points(blocks, file.vertex_count, _MAX_POINTS, f"{file.path}: vertex")
    count = max(1, file.vertex_count // _SAMPLE_VERTICES)
    fine = split_space(points, count)
    samples = min(_SAMPLES_BY_REGION if by_region else _SAMPLES, count)
    wanted = set(np.linspace(0, count - 1, samples).round().astype(int).tolist())
    found: dict[int, list[Indices]] = {leaf: [] for leaf in wanted}
    valence = np.memmap(folder / VALENCE, np.int32, "w+", shape=(file.vertex_count,))
    records, total, edges, measured = file.positions(), 0.0, 0, []
    for first, corners in file.faces():
        np.add.at(valence, corners.ravel(), 1)
        X = stack(records[corners.ravel()]).reshape(-1, 3, 3)
        lengths = np.linalg.norm(X - np.roll(X, 1, axis=1), axis=2)
        total, edges = total + float(lengths.sum()), edges + lengths.size
        some = slice(None, None, max(1, len(X) // _MAX_MEASURED))
        measured.append(np.concatenate([X[some].mean(axis=1), lengths[some].mean(axis=1, keepdims=True)], axis=1))
        for leaf, at in route(fine, X.min(axis=1), X.max(axis=1), np.zeros(count)):
            if leaf in wanted:
                found[leaf].append(corners[at])
        report((first + len(corners)) / file.face_count)
    valence.flush()
    patches = [_gather(records, np.concatenate(parts)) for parts in found.values() if parts]
    diagonal = float(np.linalg.norm(high - low))
    return Survey(points, total / edges, np.concatenate(measured), patches, low / 2 + high / 2, diagonal)


def _gather(records: npt.NDArray[np.void], corners: Indices) -> tuple[Floats, Indices]:
    """The vertices of some faces, and the faces with their numbers among these."""
    used, local = np.unique(corners, return_inverse=True)
    return stack(records[used]), local.reshape(-1, 3).astype(np.int64)


def find_reach(found: Survey, tree: Node, rings: int) -> Floats:
    """Return the (count,) distances that hold so many rings around each box, by the edges that are there."""
    center, edge = found.measured[:, :3], found.measured[:, 3]
    reach = np.full(tree.end, found.mean_edge * rings)
    for leaf, at in route(tree, center, center, np.zeros(tree.end)):
        # longer edges than most take part in the way to the last ring
        reach[leaf] = rings * float(np.quantile(edge[at], 0.75))
    return reach


def cut(file: PlyFile, tree: Node, reach: Floats, folder: Path, report: Callable[[float], None]) -> list[int]:
    """Write the faces that each piece needs into a file of its own; returns their numbers.

    Parameters
    ----------
    file : PlyFile
    tree : Node
    reach : (count,) float64
        Distance around each box within which faces belong to its piece.
    folder : Path
    report : callable
        Called with the fraction done.
    """
    records = file.positions()
    counts = [0] * tree.end
    with contextlib.ExitStack() as stack_of_files:
        outputs: list[BinaryIO] = [
            stack_of_files.enter_context(faces_of(folder, number).open("wb")) for number in range(tree.end)
        ]
        for first, corners in file.faces():
            X = stack(records[corners.ravel()]).reshape(-1, 3, 3)
            for leaf, at in route(tree, X.min(axis=1), X.max(axis=1), reach):
                corners[at].tofile(outputs[leaf])
                counts[leaf] += len(at)
            report((first + len(corners)) / file.face_count)
    return counts


def faces_of(folder: Path, number: int) -> Path:
    """The file with the faces of a piece."""
    return folder / f"faces-{number:06}.bin"


def read_faces(folder: Path, number: int) -> Indices:
    """The faces of a piece, (m, 3)."""
    return np.fromfile(faces_of(folder, number), np.int64).reshape(-1, 3)

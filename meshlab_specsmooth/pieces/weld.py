"""Files of separate triangles, and folders of tiles, as one file in which vertices at one place are one.

The corners of all faces are sorted by place in boxes of space that fit in memory, each through a file of its own.
"""

from __future__ import annotations

import contextlib
import os
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from meshlab_specsmooth.arrays import Floats
from meshlab_specsmooth.errors import FileError
from meshlab_specsmooth.geometry.triangles import compute_face_vectors, normalize_rows
from meshlab_specsmooth.geometry.welding import unique_rows
from meshlab_specsmooth.pieces.partition import route, split_space
from meshlab_specsmooth.pieces.ply import BLOCK, PlyFile, open_ply, sample_points, stack
from meshlab_specsmooth.runtime import atomic

Indices = npt.NDArray[np.int64]

STL_FACET = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
_STL_HEADER = 84
# Points of a box, about 100 bytes each while they are sorted; points that the boxes are made from
_BOX, _MAX_POINTS = 2_000_000, 200_000
_POINT = np.dtype([("number", "<i8"), ("place", "<f8", 3)])

_HEADER = """ply
format binary_little_endian 1.0
element vertex {vertices}
property double x
property double y
property double z
element face {faces}
property list uchar uint vertex_indices
end_header
"""
_FACE = np.dtype([("count", "u1"), ("corners", "<u4", (3,))])
_MAX_VERTICES = 2**32


class Parts(Protocol):
    """A source of points and of faces that refer to them."""

    @property
    def points(self) -> int:
        """Number of points, before those at one place are joined."""

    @property
    def faces(self) -> int:
        """Number of faces."""

    @property
    def paths(self) -> Sequence[Path]:
        """The files."""

    def places(self) -> Iterator[tuple[int, Floats]]:
        """Yield the number of the first point of a block, and the points (k, 3)."""

    def corners(self) -> Iterator[Indices]:
        """Yield the faces (k, 3) of a block as numbers of points."""

    def write(self, target: Path, moved: PlyFile, ids: Indices) -> None:
        """Write the same with the positions of a welded file, given the vertex there of each point."""


@dataclass(frozen=True)
class StlFile:
    """A binary STL file."""

    path: Path
    faces: int

    @property
    def points(self) -> int:
        """Three a face."""
        return 3 * self.faces

    @property
    def paths(self) -> Sequence[Path]:
        """The file."""
        return [self.path]

    def _blocks(self) -> Iterator[tuple[int, npt.NDArray[Any]]]:
        with self.path.open("rb") as file:
            file.seek(_STL_HEADER)
            for first in range(0, self.faces, BLOCK):
                yield first, np.fromfile(file, STL_FACET, min(BLOCK, self.faces - first))

    def places(self) -> Iterator[tuple[int, Floats]]:
        """Yield the corners of a block of facets."""
        for first, block in self._blocks():
            yield 3 * first, block["corners"].reshape(-1, 3).astype(np.float64)

    def corners(self) -> Iterator[Indices]:
        """Yield three numbers a facet."""
        for first, block in self._blocks():
            yield 3 * first + np.arange(3 * len(block), dtype=np.int64).reshape(-1, 3)

    def write(self, target: Path, moved: PlyFile, ids: Indices) -> None:
        """Write an STL file with new positions and normals; header and attributes stay."""
        records = moved.positions()
        with atomic.atomic_write(target) as part, part.open("wb") as output:
            with self.path.open("rb") as head:
                output.write(head.read(_STL_HEADER))
            for first, block in self._blocks():
                own = ids[3 * first : 3 * (first + len(block))]
                X = stack(records[own])
                normals = normalize_rows(compute_face_vectors(X, np.arange(len(X), dtype=np.int32).reshape(-1, 3)))
                block["corners"], block["normal"] = X.reshape(-1, 3, 3), normals
                block.tofile(output)


@dataclass(frozen=True)
class Tiles:
    """Binary PLY files in a folder, whose vertices coincide where they touch."""

    files: tuple[PlyFile, ...]

    @property
    def points(self) -> int:
        """Vertices of all tiles."""
        return sum(file.vertex_count for file in self.files)

    @property
    def faces(self) -> int:
        """Faces of all tiles."""
        return sum(file.face_count for file in self.files)

    @property
    def paths(self) -> Sequence[Path]:
        """The tiles."""
        return [file.path for file in self.files]

    def _starts(self) -> list[int]:
        return [0, *np.cumsum([file.vertex_count for file in self.files]).tolist()]

    def places(self) -> Iterator[tuple[int, Floats]]:
        """Yield the vertices of a block of a tile."""
        for start, file in zip(self._starts(), self.files, strict=False):
            for first, block in file.vertices():
                yield start + first, stack(block)

    def corners(self) -> Iterator[Indices]:
        """Yield the faces of a block of a tile."""
        for start, file in zip(self._starts(), self.files, strict=False):
            for _, corners in file.faces():
                yield corners + start

    def write(self, target: Path, moved: PlyFile, ids: Indices) -> None:
        """Write each tile into a folder, with new positions and all other bytes as they were."""
        records = moved.positions()
        for start, file in zip(self._starts(), self.files, strict=False):

            def place(first: int, block: npt.NDArray[Any], start: int = start) -> None:
                X = stack(records[ids[start + first : start + first + len(block)]])
                for axis, column in enumerate("xyz"):
                    block[column] = X[:, axis]

            file.write_moved(target / file.path.name, place)


def open_parts(source: str | os.PathLike[str]) -> Parts | None:
    """Open a binary STL file or a folder of binary PLY files; None for other paths.

    Raises
    ------
    FileError
        It is a text, is shorter than it says, or has no tiles.
    """
    path = Path(source)
    if path.is_dir():
        tiles = tuple(open_ply(each) for each in sorted(path.glob("*.ply")))
        if not tiles:
            raise FileError(f"{source}: has no .ply files")
        return Tiles(tiles)
    if path.suffix.lower() != ".stl" or not path.is_file():
        return None
    with path.open("rb") as file:
        head = file.read(_STL_HEADER)
    count = int.from_bytes(head[80:_STL_HEADER], "little")
    size = path.stat().st_size
    if size != _STL_HEADER + count * STL_FACET.itemsize:
        raise FileError(
            f"{source}: is no binary STL file, whose size would be that of its {count} facets; convert it first"
        )
    return StlFile(path, count)


def weld(parts: Parts, folder: Path, report: Callable[[float], None]) -> tuple[PlyFile, Indices]:
    """Write the parts as one PLY file into a folder; returns it, and the vertex there of each point.

    Raises
    ------
    FileError
        A coordinate is not finite, or there are more than 2^32 places.
    """
    count = max(1, -(-parts.points // _BOX))
    tree = split_space(sample_points(parts.places(), parts.points, _MAX_POINTS, "point")[0], count)
    ids = np.lib.format.open_memmap(folder / "ids.npy", "w+", np.int64, (parts.points,))
    with contextlib.ExitStack() as stack_of_files:
        outputs = [stack_of_files.enter_context((folder / f"box-{n:06}.bin").open("wb")) for n in range(count)]
        for first, X in parts.places():
            for leaf, at in route(tree, X, X, np.zeros(count)):
                records = np.empty(len(at), _POINT)
                records["number"], records["place"] = first + at, X[at] + 0.0  # -0 is 0
                records.tofile(outputs[leaf])
            report(0.4 * (first + len(X)) / parts.points)
    total = 0
    with (folder / "vertices.bin").open("wb") as output:
        for number in range(count):
            box = folder / f"box-{number:06}.bin"
            records = np.fromfile(box, _POINT)
            places, which = unique_rows(records["place"])
            ids[records["number"]] = total + which
            total += len(places)
            places.tofile(output)
            box.unlink()
            report(0.4 + 0.3 * (number + 1) / count)
    ids.flush()
    if total >= _MAX_VERTICES:
        raise FileError(f"there are {total} vertices; at most 2^32 can be numbered")
    path = folder / "welded.ply"
    with path.open("wb") as output:
        output.write(_HEADER.format(vertices=total, faces=parts.faces).encode())
        with (folder / "vertices.bin").open("rb") as vertices:
            while block := vertices.read(2**24):
                output.write(block)
        done = 0
        for corners in parts.corners():
            faces = np.empty(len(corners), _FACE)
            faces["count"], faces["corners"] = 3, ids[corners.ravel()].reshape(-1, 3)
            faces.tofile(output)
            done += len(corners)
            report(0.7 + 0.3 * done / max(parts.faces, 1))
    (folder / "vertices.bin").unlink()
    return open_ply(path), ids

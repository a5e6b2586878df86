"""Binary PLY files of any size, read and written in blocks of vertices and faces."""

from __future__ import annotations

import os
import re
import shutil
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from meshlab_specsmooth.arrays import Floats
from meshlab_specsmooth.errors import FileError
from meshlab_specsmooth.runtime import atomic
from meshlab_specsmooth.runtime.atomic import file_errors

Indices = npt.NDArray[np.int64]

_TYPES = {
    "char": "i1",
    "uchar": "u1",
    "short": "i2",
    "ushort": "u2",
    "int": "i4",
    "uint": "u4",
    "float": "f4",
    "double": "f8",
    "int8": "i1",
    "uint8": "u1",
    "int16": "i2",
    "uint16": "u2",
    "int32": "i4",
    "uint32": "u4",
    "float32": "f4",
    "float64": "f8",
    "int64": "i8",
    "uint64": "u8",
}
_ORDERS = {"binary_little_endian": "<", "binary_big_endian": ">"}
_LISTS = ("vertex_indices", "vertex_index")
_MAX_HEADER = 2**20

#: Records that are read at once.
BLOCK = 2**19


@dataclass(frozen=True)
class PlyFile:
    """The layout of a binary PLY file of triangles.

    Attributes
    ----------
    path : Path
    vertex : dtype
        Of a vertex, as it is stored.
    vertex_start, vertex_count : int
        Offset of the first one in bytes, and their number.
    face : dtype
        Of a triangle, with the length of its list as ``count`` and its corners as ``corners``.
    face_start, face_count : int
    """

    path: Path
    vertex: np.dtype[Any]
    vertex_start: int
    vertex_count: int
    face: np.dtype[Any]
    face_start: int
    face_count: int

    @property
    def has_normals(self) -> bool:
        """Whether vertices have normals."""
        return {"nx", "ny", "nz"} <= set(self.vertex.names or ())

    def vertices(self) -> Iterator[tuple[int, npt.NDArray[Any]]]:
        """Yield the number of the first vertex of a block, and the block."""
        return self._blocks(self.vertex, self.vertex_start, self.vertex_count)

    def faces(self) -> Iterator[tuple[int, Indices]]:
        """Yield the number of the first face of a block, and its corners (k, 3).

        Raises
        ------
        FileError
            A face is no triangle, or has a vertex that is not there.
        """
        for first, block in self._blocks(self.face, self.face_start, self.face_count):
            wrong = np.flatnonzero(block["count"] != 3)
            if len(wrong):
                at = first + int(wrong[0])
                raise FileError(
                    f"{self.path}: face {at} has {int(block['count'][wrong[0]])} corners; pieces need triangles "
                    "(triangulate it first)"
                )
            corners = block["corners"].astype(np.int64)
            wrong = np.flatnonzero(((corners < 0) | (corners >= self.vertex_count)).any(axis=1))
            if len(wrong):
                raise FileError(
                    f"{self.path}: face {first + int(wrong[0])} has a vertex that is not among the {self.vertex_count}"
                )
            yield first, corners

    def write_moved(self, target: Path, change: Callable[[int, npt.NDArray[Any]], None]) -> None:
        """Write the file with other vertices, whole or not at all; all other bytes stay.

        Parameters
        ----------
        target : Path
        change : callable
            Called with the number of the first vertex of a block, and the block, which it changes.

        Raises
        ------
        FileError
        """
        with (
            atomic.atomic_write(target) as part,
            file_errors(target, "written", OSError),
            part.open("wb") as output,
            self.path.open("rb") as source,
        ):
            output.write(source.read(self.vertex_start))
            for first, block in self.vertices():
                change(first, block)
                block.tofile(output)
            source.seek(self.vertex_start + self.vertex_count * self.vertex.itemsize)
            shutil.copyfileobj(source, output, 2**24)

    def positions(self) -> npt.NDArray[Any]:
        """Return the vertices as records that are read from the file where they are used."""
        return np.memmap(self.path, self.vertex, "r", self.vertex_start, (self.vertex_count,))

    def _blocks(self, dtype: np.dtype[Any], start: int, count: int) -> Iterator[tuple[int, npt.NDArray[Any]]]:
        with self.path.open("rb") as file:
            file.seek(start)
            for first in range(0, count, BLOCK):
                yield first, np.fromfile(file, dtype, min(BLOCK, count - first))


def stack(records: npt.NDArray[Any]) -> Floats:
    """Return the positions (k, 3) of vertex records."""
    return np.stack([records[axis].astype(np.float64) for axis in "xyz"], axis=-1)


def sample_points(
    blocks: Iterable[tuple[int, Floats]], count: int, most: int, what: str
) -> tuple[Floats, Floats, Floats]:
    """Return some of the points of all blocks, evenly, and their lowest and highest coordinates.

    Parameters
    ----------
    blocks : iterable of (int, (k, 3) float64)
        The number of the first point of a block, and the block.
    count, most : int
        Number of points, and about how many of them to return.
    what : str
        Name of a point in the error message.

    Raises
    ------
    FileError
        A coordinate is not finite.
    """
    step, points = max(1, count // most), [np.empty((0, 3))]
    low, high = np.full(3, np.inf), np.full(3, -np.inf)
    for first, X in blocks:
        wrong = np.flatnonzero(~np.isfinite(X).all(axis=1))
        if len(wrong):
            raise FileError(f"{what} {first + int(wrong[0])} is not finite; remove it first")
        low, high = np.minimum(low, X.min(axis=0)), np.maximum(high, X.max(axis=0))
        points.append(X[-first % step :: step])
    return np.concatenate(points), low, high


def open_ply(path: str | os.PathLike[str]) -> PlyFile:
    """Read the header of a binary PLY file.

    Raises
    ------
    FileError
        It is not there, is no binary PLY file of vertices and triangles, or is shorter than its header says.
    """
    place = Path(path)
    with file_errors(place, "read", OSError):
        if not place.is_file():
            raise FileError(f"{path}: {'is not a regular file' if place.exists() else 'no such file'}")
        with place.open("rb") as file:
            start = file.read(_MAX_HEADER)
        size = place.stat().st_size
    end = re.search(rb"^end_header\r?\n", start, re.MULTILINE)
    if not start.startswith(b"ply") or end is None:
        raise FileError(f"{path}: is not a PLY file; pieces are cut from binary PLY files (convert it first)")
    lines = [line.split() for line in start[: end.start()].decode("latin-1").splitlines()]
    kind = next((line[1] for line in lines if line[:1] == ["format"]), "")
    if kind not in _ORDERS:
        raise FileError(
            f"{path}: is a PLY file in the format {kind or 'unknown'}; pieces need a binary one (convert it)"
        )
    return _lay_out(place, lines, _ORDERS[kind], end.end(), size)


def _lay_out(place: Path, lines: list[list[str]], order: str, start: int, size: int) -> PlyFile:
    elements: list[tuple[str, int, list[list[str]]]] = []
    for line in lines:
        if line[:1] == ["element"] and len(line) > 2 and line[2].isdigit():
            elements.append((line[1], int(line[2]), []))
        elif line[:1] == ["property"] and elements:
            elements[-1][2].append(line[1:])
    found: dict[str, tuple[np.dtype[Any], int, int]] = {}
    for name, count, properties in elements:
        dtype = _make_dtype(place, name, properties, order)
        found[name] = (dtype, start, count)
        start += count * dtype.itemsize
        if {"vertex", "face"} <= found.keys():
            break
    for name, needed in (("vertex", {"x", "y", "z"}), ("face", {"corners"})):
        if name not in found or not needed <= set(found[name][0].names or ()):
            raise FileError(f"{place}: its header has no {name} with {', '.join(sorted(needed))}")
    if start > size:
        raise FileError(f"{place}: is {size} bytes long, but its header declares at least {start}; it was cut off")
    return PlyFile(place, *found["vertex"], *found["face"])


def _make_dtype(place: Path, name: str, properties: list[list[str]], order: str) -> np.dtype[Any]:
    """The dtype of an element, whose list of corners, if it has one, has three."""
    fields: list[tuple[Any, ...]] = []
    for words in properties:
        types, label = words[:-1], words[-1]
        is_list = types[:1] == ["list"]
        if not all(each in _TYPES for each in (types[1:] if is_list else types)):
            raise FileError(f"{place}: property {label} of {name} is of the unknown type {' '.join(types)}")
        if not is_list:
            fields.append((label, order + _TYPES[types[0]]))
        elif name == "face" and label in _LISTS:
            fields += [("count", order + _TYPES[types[1]]), ("corners", order + _TYPES[types[2]], (3,))]
        else:
            raise FileError(f"{place}: {name} has the list {label}, whose length may differ; pieces cannot skip it")
    return np.dtype(fields)

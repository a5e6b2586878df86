"""Meshes of other libraries: arrays out of them, and a mesh of the same kind with new positions.

A mesh is recognized by its attributes, so no library is imported for it. Whatever it is becomes a :class:`Source`:
vertices and triangles to compute with, and how to make a mesh of the same kind. To add a kind, write a function that
returns its :class:`Source` or None, and append it to ``_RECOGNIZERS``.
"""

from __future__ import annotations

import copy
import dataclasses
import functools
import importlib
import inspect
import os
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any, ParamSpec, TypeVar

import numpy as np
import numpy.typing as npt

from meshlab_specsmooth.arrays import Floats
from meshlab_specsmooth.errors import InvalidParameter, InvalidSurface, NotAMesh, suggest
from meshlab_specsmooth.geometry.surface import Surface, check_indices, face_vectors, vertex_normals
from meshlab_specsmooth.parameters import show

Indices = npt.NDArray[np.int64]
P = ParamSpec("P")
R = TypeVar("R")

#: What the functions on arrays take as a mesh: see :func:`recognize`. It is recognized by what it has, not by its type.
Mesh = Any

# Reads files and copies pymeshlab's meshes. It is loaded by its name when one of these is given: this module comes
# before it, and everything else works where pymeshlab cannot be loaded.
_BRIDGE = "meshlab_specsmooth.meshlab.given"

KINDS = (
    "pass vertices and faces, a tuple (vertices, faces, ...), a mesh of pymeshlab, trimesh, PyVista, Open3D, meshio or "
    "vedo, or the path of a file"
)

# Rows of [3, a, b, c] are triangles of PyVista, unless they could be quads that all begin at vertex 3: more than these
# do not meet there
_MOST_QUADS_AT_A_VERTEX = 12


@dataclass(frozen=True, eq=False)
class Source:
    """A mesh as it was given.

    Attributes
    ----------
    vertices : (n, 3) array_like
    faces : (t, 3) array_like
        Triangles: the faces given, or what their polygons were split into. Neither is checked; :meth:`surface` does.
    polygons : (t,) int64 or None
        The given face that each triangle is a part of; None where the triangles are the faces given.
    given : object
        The mesh, and after :meth:`kept` a copy of it.
    duplicate : callable
        From a mesh of this kind to a copy of it.
    put : callable
        From a copy, this source and (n, 3) float64 positions to the mesh that has these.
    """

    vertices: Any
    faces: Any
    given: Any
    duplicate: Callable[[Any], Any]
    put: Callable[[Any, Source, Floats], Any]
    polygons: Indices | None = None

    def surface(self) -> Surface:
        """What is computed with, checked; raises :class:`InvalidSurface`."""
        return Surface(self.vertices, self.faces)

    def kept(self) -> Source:
        """The same with a copy of the mesh, which later changes to the mesh do not reach; of arrays the faces alone."""
        if self.put is _put_arrays:
            return replace(self, vertices=None, faces=None)
        return replace(self, given=self.duplicate(self.given))

    def moved(self, vertices: Floats) -> Mesh:
        """A new mesh of the kind given, with these positions and everything else that it had."""
        return self.put(self.duplicate(self.given), self, vertices)

    def per_face(self, flags: npt.NDArray[np.bool_]) -> npt.NDArray[np.bool_]:
        """Flags of triangles as flags of the faces given: whether any triangle of a face has it."""
        if self.polygons is None:
            return flags
        found = np.zeros(int(self.polygons.max()) + 1, dtype=np.bool_)
        found[self.polygons[flags]] = True
        return found

    def __reduce__(self) -> tuple[Any, ...]:
        """Meshes of pymeshlab cannot be pickled; what comes back is ``(vertices, faces)``."""
        if self.put in (_put_meshset, _put_pymeshlab):
            return _of_arrays, (self.vertices, self.faces)
        state = tuple(getattr(self, each.name) for each in dataclasses.fields(self))
        return Source, state


class WithMesh:
    """A result that can be had as a mesh of the kind that was given."""

    source: Source | None
    vertices: Floats

    @functools.cached_property
    def mesh(self) -> Mesh:
        """A mesh of the kind given, with the new positions and all else that it had; normals are computed anew.

        For arrays it is ``(vertices, faces)``, for a MeshSet one with its current mesh alone, for a path a MeshSet. It
        is made when it is first asked for, and kept: the mesh of a MeshSet that nobody holds is gone.
        """
        return None if self.source is None else self.source.moved(self.vertices)

    def __getstate__(self) -> dict[str, Any]:
        """All but the mesh, which is made again."""
        return {name: value for name, value in vars(self).items() if name != "mesh"}


def accept_meshes(function: Callable[P, R]) -> Callable[P, R]:
    """Make ``mesh`` of a function go by the name ``vertices`` as well, and suggest a misspelled keyword."""
    known = [*inspect.signature(function).parameters, "vertices"]

    @functools.wraps(function)
    def call(*args: P.args, **kwargs: P.kwargs) -> R:
        for name in kwargs:
            if name not in known:
                raise TypeError(f"{function.__name__}() has no parameter {name}.{suggest(name, known)}")
        if "vertices" in kwargs and "mesh" not in kwargs:
            kwargs["mesh"] = kwargs.pop("vertices")
        return function(*args, **kwargs)

    return call


def recognize(mesh: Mesh, faces: Any = None, name: str = "mesh") -> Source:
    """Vertices and triangles of a mesh of any kind, and how to make another one of that kind.

    Parameters
    ----------
    mesh : array_like or mesh
        (n, 3) vertices where ``faces`` are given. Without: a pymeshlab ``MeshSet`` (its current mesh) or ``Mesh``; a
        mesh of trimesh, PyVista (``PolyData``), Open3D (``TriangleMesh``, legacy or tensor), meshio or vedo, or any
        object with ``vertices`` and ``faces``; a tuple of vertices, faces and more, as of
        ``skimage.measure.marching_cubes`` and igl's readers; or the path of a file.
    faces : array_like, optional
        (m, 3) triangles, (m, k) polygons, rows of different lengths, or PyVista's padded ``[k, a, b, c, ..., k, ...]``.
        Quads are split along the shorter diagonal, larger polygons into fans.
    name : str
        Of the parameter, for the error.

    Raises
    ------
    NotAMesh
        It is none: both an :class:`InvalidSurface` and an :class:`InvalidParameter`.
    InvalidSurface
        It has no faces, or is not made of polygons. Arrays are checked by :class:`Surface`.
    FileError
        The file cannot be read.

    Examples
    --------
    >>> from meshlab_specsmooth.adapters import recognize
    >>> square = recognize([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 2, 0]], [[0, 1, 2, 3]])
    >>> square.faces.tolist(), square.polygons.tolist()
    ([[0, 1, 2], [0, 2, 3]], [0, 0])
    >>> recognize(5)
    Traceback (most recent call last):
    ...
    meshlab_specsmooth.errors.NotAMesh: mesh is 5; pass vertices and faces, a tuple (vertices, faces, ...), ...
    """
    if isinstance(mesh, np.ndarray) and faces is not None:
        return _of_arrays(mesh, faces)
    for each in _RECOGNIZERS:
        found = each(mesh)
        if found is not None and faces is not None:
            raise InvalidParameter("faces are given beside a mesh that has its own; give vertices and faces, or a mesh")
        if found is not None:
            return found
    if faces is not None:
        return _of_arrays(mesh, faces)
    if isinstance(mesh, np.ndarray | list | tuple):
        raise InvalidSurface("faces", "are missing", KINDS)
    raise NotAMesh(name, f"is {show(mesh)}{_why_not(mesh)}", KINDS)


def _why_not(mesh: Mesh) -> str:
    """More about an object that is close to a mesh."""
    if _has(mesh, "extract_surface") or _has(mesh, "points", "cells"):
        return ", which has cells and not faces (extract its surface first)"
    if _has(mesh, "geometry", "graph"):
        return ", a scene (take a mesh of it)"
    if _has(mesh, "vertices") or _has(mesh, "points"):
        return ", which has no faces (reconstruct a surface from the points first)"
    return ""


def _has(mesh: Mesh, *names: str) -> bool:
    return all(hasattr(mesh, name) for name in names)


# Arrays, and tuples of them


def _of_arrays(vertices: Any, faces: Any) -> Source:
    triangles, polygons = _triangles_of(vertices, faces)
    return Source(vertices, triangles, faces, _same, _put_arrays, polygons)


def _same(given: Any) -> Any:
    return given


def _put_arrays(faces: Any, source: Source, vertices: Floats) -> tuple[Floats, Any]:
    return vertices, faces


def _recognize_tuple(mesh: Mesh) -> Source | None:
    """``(vertices, faces)``, or more, as marching cubes and igl's readers return it: faces are the first integers."""
    if not isinstance(mesh, tuple | list) or len(mesh) < 2:
        return None
    vertices = _as_array(mesh[0])
    if vertices is None or vertices.ndim != 2:
        return None
    at = 1
    if len(mesh) > 2:
        tables = [i for i in range(1, len(mesh)) if _is_index_table(mesh[i])]
        # igl.read_mesh has tetrahedra first
        triangles = [i for i in tables if np.shape(mesh[i])[1] == 3]
        at = (triangles or tables or [1])[0] if len(mesh) == 3 else (tables or [1])[0]
    triangles_, polygons = _triangles_of(mesh[0], mesh[at])
    return Source(mesh[0], triangles_, (mesh, at), _same, _put_tuple, polygons)


def _is_index_table(given: Any) -> bool:
    array = _as_array(given)
    return array is not None and array.dtype.kind in "iu" and array.ndim == 2 and len(array) > 0 and array.shape[1] > 2


def _put_tuple(given: tuple[Any, int], source: Source, vertices: Floats) -> Any:
    mesh, at = given
    parts = list(mesh)
    normals = _Normals(source, vertices)
    parts[0] = vertices
    for i in range(1, len(parts)):
        array = _as_array(parts[i])
        if i != at and array is not None and _are_unit(array):
            if len(array) == len(vertices):
                parts[i] = normals.of_vertices(array)
            elif len(array) == normals.face_count:
                parts[i] = normals.of_faces(array)
    if hasattr(mesh, "_fields"):
        return type(mesh)(*parts)
    return tuple(parts) if isinstance(mesh, tuple) else parts


def _are_unit(array: npt.NDArray[Any]) -> bool:
    """Whether all rows have length 1, or none."""
    if array.ndim != 2 or array.shape[1] != 3 or array.dtype.kind != "f" or len(array) == 0:
        return False
    length = np.linalg.norm(array.astype(np.float64), axis=1)
    return bool(((np.abs(length - 1) < 1e-3) | (length == 0)).all() and length.any())


def _as_array(given: Any) -> npt.NDArray[Any] | None:
    """An array, or None of what is none, whatever its ``__array__`` raises: the gate says what is wrong with it."""
    try:
        return np.asarray(given)
    except MemoryError:
        raise
    except Exception:
        return None


# Faces


def _triangles_of(vertices: Any, faces: Any) -> tuple[Any, Indices | None]:
    """Triangles, and the face that each is of, None where they are the faces; what is no table of faces as it is."""
    array = _as_array(faces)
    if array is None:
        rows = _ragged(faces)
        return (faces, None) if rows is None else _split(vertices, *rows)
    if array.dtype.kind not in "iu" or array.size == 0 or np.ma.isMaskedArray(faces):
        return faces, None
    if array.ndim == 1:
        found = _unpadded(array)
        return (faces, None) if found is None else _split(vertices, *found)
    if array.ndim != 2 or array.shape[1] <= 3:
        return array if array.ndim == 2 else faces, None
    if array.shape[1] == 4 and (array[:, 0] == 3).all():
        corners = array[:, 1:]
        if (corners == 3).any() or len(corners) > _MOST_QUADS_AT_A_VERTEX:
            return corners, None
    size = array.shape[1]
    return _split(vertices, array.ravel(), np.arange(len(array) + 1) * size)


def _ragged(faces: Any) -> tuple[Indices, Indices] | None:
    """Corners one after the other, and where each face's begin, of rows of different lengths; None of anything else."""
    if not isinstance(faces, list | tuple | np.ndarray) or len(faces) == 0:
        return None
    rows = [_as_array(row) for row in faces]
    if any(row is None or row.ndim != 1 or row.dtype.kind not in "iu" for row in rows):
        return None
    sizes = [len(row) for row in rows if row is not None]
    return np.concatenate([row for row in rows if row is not None]), np.cumsum([0, *sizes])


def _unpadded(flat: npt.NDArray[Any]) -> tuple[Indices, Indices] | None:
    """The same of VTK's ``[k, a, b, c, ..., k, ...]``; None where that is not what it is."""
    size = int(flat[0])
    if size > 0 and len(flat) % (size + 1) == 0 and (flat[:: size + 1] == size).all():
        rows = flat.reshape(-1, size + 1)[:, 1:]
        return rows.ravel().astype(np.int64), np.arange(len(rows) + 1) * size
    sizes, numbers, at = list[int](), flat.tolist(), 0
    while at < len(numbers):
        if numbers[at] < 1:
            return None
        sizes.append(numbers[at])
        at += numbers[at] + 1
    if at != len(numbers):
        return None
    offsets = np.cumsum([0, *sizes])
    return np.delete(flat, offsets[:-1] + np.arange(len(sizes))).astype(np.int64), offsets


def _split(vertices: Any, corners: Indices, offsets: Indices) -> tuple[Any, Indices | None]:
    """Split polygons into triangles: quads along the shorter diagonal, larger ones into fans."""
    sizes = np.diff(offsets)
    if (sizes == 3).all():
        return corners.reshape(-1, 3), None
    small = np.flatnonzero(sizes < 3)
    if len(small):
        row = int(small[0])
        raise InvalidSurface("faces", f"has {int(sizes[row])} corners", "remove faces of fewer than 3 corners", row)
    of_face = np.repeat(np.arange(len(sizes)), sizes)
    first = np.zeros(len(sizes), dtype=np.int64)
    V = _as_array(vertices)
    if V is not None and V.ndim == 2 and V.dtype.kind in "fiu":  # else the gate refuses them
        check_indices(corners[:, None], len(V), of_face)
        quads = np.flatnonzero(sizes == 4)
        at = V[corners[offsets[quads, None] + np.arange(4)]].astype(np.float64)
        with np.errstate(all="ignore"):  # of coordinates that the gate refuses
            diagonals = np.linalg.norm(at[:, 2:] - at[:, :2], axis=2)
        first[quads] = diagonals[:, 1] < diagonals[:, 0]
    count = sizes - 2
    polygons = np.repeat(np.arange(len(sizes)), count)
    number = np.arange(len(polygons)) - np.repeat(np.cumsum(count) - count, count)
    start, size, begin = first[polygons], sizes[polygons], offsets[:-1][polygons]
    fan = [begin + (start + step) % size for step in (np.zeros_like(number), number + 1, number + 2)]
    return np.stack([corners[i] for i in fan], axis=1), polygons


@dataclass(frozen=True, eq=False)
class _Normals:
    """Normals of a mesh that has moved, to take the place of those that it had."""

    source: Source
    vertices: Floats
    before: Surface = field(init=False)
    after: Surface = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "before", self.source.surface())
        object.__setattr__(self, "after", Surface(self.vertices, self.before.faces))

    @property
    def face_count(self) -> int:
        """Of the faces given."""
        polygons = self.source.polygons
        return len(self.before.faces) if polygons is None else int(polygons.max()) + 1

    def of_vertices(self, old: Any) -> npt.NDArray[Any]:
        """(n, 3) in the dtype of the old ones, and on their side of the surface."""
        return _on_side_of(old, vertex_normals(self.before), vertex_normals(self.after))

    def of_faces(self, old: Any) -> npt.NDArray[Any]:
        """(m, 3) of the faces given, as :meth:`of_vertices`."""
        return _on_side_of(old, self._of_faces(self.before), self._of_faces(self.after))

    def _of_faces(self, surface: Surface) -> Floats:
        _, exponent = np.frexp(np.abs(surface.vertices).max())
        vectors = face_vectors(Surface(np.ldexp(surface.vertices, -exponent), surface.faces))
        polygons = self.source.polygons
        if polygons is not None:
            sums = [np.bincount(polygons, weights=vectors[:, i], minlength=self.face_count) for i in range(3)]
            vectors = np.stack(sums, axis=1)
        length = np.linalg.norm(vectors, axis=1, keepdims=True)
        return np.asarray(np.divide(vectors, length, out=np.zeros_like(vectors), where=length > 0))


def _on_side_of(old: Any, before: Floats, after: Floats) -> npt.NDArray[Any]:
    given = np.asarray(old)
    side = -1.0 if float((given * before).sum()) < 0 else 1.0
    return (side * after).astype(given.dtype)


# Meshes of other libraries


def _recognize_path(mesh: Mesh) -> Source | None:
    if not isinstance(mesh, str | os.PathLike):
        return None
    return _recognize_meshset(importlib.import_module(_BRIDGE).read(mesh))


def _recognize_meshset(mesh: Mesh) -> Source | None:
    if not _has(mesh, "current_mesh", "mesh_number"):
        return None
    if mesh.mesh_number() == 0:
        raise InvalidSurface("mesh", "is a MeshSet without a mesh", "load one")
    current = mesh.current_mesh()
    return Source(current.vertex_matrix(), current.face_matrix(), mesh, _copy_pymeshlab, _put_meshset)


def _recognize_pymeshlab(mesh: Mesh) -> Source | None:
    if not _has(mesh, "vertex_matrix", "face_matrix"):
        return None
    return Source(mesh.vertex_matrix(), mesh.face_matrix(), mesh, _copy_pymeshlab, _put_pymeshlab)


def _copy_pymeshlab(mesh: Mesh) -> Mesh:
    return importlib.import_module(_BRIDGE).duplicate(mesh)


def _put_meshset(ms: Mesh, source: Source, vertices: Floats) -> Mesh:
    return importlib.import_module(_BRIDGE).moved(ms, vertices)


def _put_pymeshlab(ms: Mesh, source: Source, vertices: Floats) -> Mesh:
    bridge = importlib.import_module(_BRIDGE)
    return bridge.only_mesh(bridge.moved(ms, vertices))


def _recognize_open3d(mesh: Mesh) -> Source | None:
    if not _has(mesh, "compute_vertex_normals", "vertices", "triangles"):
        return None
    return Source(np.asarray(mesh.vertices), np.asarray(mesh.triangles), mesh, copy.deepcopy, _put_open3d)


def _put_open3d(mesh: Mesh, source: Source, vertices: Floats) -> Mesh:
    had = mesh.has_vertex_normals(), mesh.has_triangle_normals()
    mesh.vertices = type(mesh.vertices)(vertices)
    if had[1]:
        mesh.compute_triangle_normals()
    if had[0]:
        mesh.compute_vertex_normals()
    return mesh


def _recognize_open3d_tensor(mesh: Mesh) -> Source | None:
    if not _has(mesh, "vertex", "triangle") or "positions" not in mesh.vertex or "indices" not in mesh.triangle:
        return None
    vertices, triangles = _numpy(mesh.vertex["positions"]), _numpy(mesh.triangle["indices"])
    return Source(vertices, triangles, mesh, _clone, _put_open3d_tensor)


def _numpy(tensor: Any) -> npt.NDArray[Any]:
    return np.asarray(tensor.cpu().numpy())


def _clone(mesh: Mesh) -> Mesh:
    return mesh.clone()


def _put_open3d_tensor(mesh: Mesh, source: Source, vertices: Floats) -> Mesh:
    old = mesh.vertex["positions"]
    wanted = np.ascontiguousarray(vertices, dtype=_numpy(old).dtype)
    mesh.vertex["positions"] = type(old).from_numpy(wanted).to(old.device)
    if "normals" in mesh.triangle:
        mesh.compute_triangle_normals()
    if "normals" in mesh.vertex:
        mesh.compute_vertex_normals()
    return mesh


def _recognize_meshio(mesh: Mesh) -> Source | None:
    if not _has(mesh, "points", "cells", "point_data", "cell_data") or _has(mesh, "n_cells"):
        return None
    blocks = [list(block.data) for block in mesh.cells if _is_polygonal(block.type)]
    rows = _ragged([row for block in blocks for row in block])
    if rows is None:
        found = ", ".join(sorted({str(block.type) for block in mesh.cells})) or "none"
        raise InvalidSurface("mesh", f"has no triangle, quad or polygon cells ({found})", "extract its surface first")
    triangles, polygons = _split(mesh.points, *rows)
    return Source(mesh.points, triangles, mesh, copy.deepcopy, _put_meshio, polygons)


def _is_polygonal(kind: str) -> bool:
    return kind in ("triangle", "quad") or (kind.startswith("polygon") and kind[7:].isdigit()) or kind == "polygon"


def _put_meshio(mesh: Mesh, source: Source, vertices: Floats) -> Mesh:
    mesh.points = vertices
    normals = _Normals(source, vertices)
    data = mesh.point_data
    for name in [name for name in data if name.lower() == "normals" and np.shape(data[name]) == vertices.shape]:
        data[name] = normals.of_vertices(data[name])
    if all(name in data for name in ("nx", "ny", "nz")):  # as its reader of PLY has them
        old = np.stack([data[name] for name in ("nx", "ny", "nz")], axis=1)
        data["nx"], data["ny"], data["nz"] = np.ascontiguousarray(normals.of_vertices(old).T)
    for name in [name for name in mesh.cell_data if "normals" in name.lower()]:
        _renew_cell_normals(mesh, name, normals)
    return mesh


def _renew_cell_normals(mesh: Mesh, name: str, normals: _Normals) -> None:
    """Those of polygons; of other cells they stay."""
    data, at = mesh.cell_data[name], 0
    polygonal = [i for i, block in enumerate(mesh.cells) if _is_polygonal(block.type)]
    renewed = normals.of_faces(np.concatenate([data[i] for i in polygonal]))
    for i in polygonal:
        data[i] = renewed[at : at + len(data[i])]
        at += len(data[i])


def _recognize_polydata(mesh: Mesh) -> Source | None:
    """PyVista's."""
    if not _has(mesh, "points", "faces", "strips", "point_data", "cell_data"):
        return None
    flat, strips = np.asarray(mesh.faces), np.asarray(mesh.strips)
    corners, offsets = (_unpadded(flat) if len(flat) else None) or (np.empty(0, np.int64), np.zeros(1, np.int64))
    triangles, polygons = _split(mesh.points, corners, offsets)
    if len(strips):
        count = len(offsets) - 1
        polygons = np.arange(count) if polygons is None else polygons
        of_strips, strip = _of_strips(strips)
        triangles, polygons = np.concatenate([triangles, of_strips]), np.concatenate([polygons, count + strip])
    return Source(np.asarray(mesh.points), triangles, mesh, _copy_deep, _put_polydata, polygons)


def _of_strips(flat: npt.NDArray[Any]) -> tuple[Indices, Indices]:
    """Triangles of VTK's padded strips, every second one turned round, and the strip that each is of."""
    corners, offsets = _unpadded(flat) or (np.empty(0, np.int64), np.zeros(1, np.int64))
    count = np.diff(offsets) - 2
    strip = np.repeat(np.arange(len(count)), count)
    number = np.arange(len(strip)) - np.repeat(np.cumsum(count) - count, count)
    begin, odd = offsets[:-1][strip] + number, number % 2
    return np.stack([corners[begin], corners[begin + 1 + odd], corners[begin + 2 - odd]], axis=1), strip


def _copy_deep(mesh: Mesh) -> Mesh:
    return mesh.copy(deep=True)


def _put_polydata(mesh: Mesh, source: Source, vertices: Floats) -> Mesh:
    normals = _Normals(source, vertices)
    mesh.points = vertices
    for name in [name for name in mesh.point_data.keys() if name == "Normals"]:  # noqa: SIM118 (they are no mappings)
        mesh.point_data[name] = normals.of_vertices(mesh.point_data[name])
    if "Normals" in mesh.cell_data.keys():  # noqa: SIM118
        old = np.asarray(mesh.cell_data["Normals"])
        others = len(old) - normals.face_count  # vertices and lines come first
        mesh.cell_data["Normals"] = np.concatenate([old[:others], normals.of_faces(old[others:])])
    return mesh


def _recognize_vedo(mesh: Mesh) -> Source | None:
    if not (_has(mesh, "clone", "dataset") or _has(mesh, "clone", "polydata")):
        return None
    cells = mesh.cells if hasattr(mesh, "cells") else mesh.faces() if hasattr(mesh, "faces") else None
    if cells is None:
        return None
    vertices = np.asarray(getattr(mesh, _vedo_points(mesh)))
    triangles, polygons = _triangles_of(vertices, cells)
    return Source(vertices, triangles, mesh, _clone, _put_vedo, polygons)


def _vedo_points(mesh: Mesh) -> str:
    """The attribute that has the positions: a method of the other name in older versions."""
    return "vertices" if callable(getattr(mesh, "points", None)) else "points"


def _put_vedo(mesh: Mesh, source: Source, vertices: Floats) -> Mesh:
    setattr(mesh, _vedo_points(mesh), vertices)
    data = mesh.pointdata
    if "Normals" in data.keys():  # noqa: SIM118
        data["Normals"] = _Normals(source, vertices).of_vertices(data["Normals"])
    if "Normals" in mesh.celldata.keys():  # noqa: SIM118
        mesh.celldata["Normals"] = _Normals(source, vertices).of_faces(mesh.celldata["Normals"])
    return mesh


def _recognize_attributes(mesh: Mesh) -> Source | None:
    """Whatever has vertices and faces: trimesh's, :class:`Surface`, and objects like these."""
    if not _has(mesh, "vertices", "faces"):
        return None
    triangles, polygons = _triangles_of(mesh.vertices, mesh.faces)
    return Source(mesh.vertices, triangles, mesh, _copy_object, _put_attributes, polygons)


def _copy_object(mesh: Mesh) -> Mesh:
    if dataclasses.is_dataclass(mesh):
        return mesh  # the new one is made of it
    if hasattr(mesh, "to_mesh"):
        return mesh.to_mesh()  # trimesh's boxes and spheres have no positions of their own
    return mesh.copy() if hasattr(mesh, "copy") else copy.deepcopy(mesh)


def _put_attributes(mesh: Mesh, source: Source, vertices: Floats) -> Mesh:
    if dataclasses.is_dataclass(mesh) and not isinstance(mesh, type):
        return replace(mesh, vertices=vertices)
    mesh.vertices = vertices
    return mesh


_RECOGNIZERS: tuple[Callable[[Mesh], Source | None], ...] = (
    _recognize_tuple,
    _recognize_path,
    _recognize_meshset,
    _recognize_pymeshlab,
    _recognize_open3d_tensor,
    _recognize_open3d,
    _recognize_polydata,
    _recognize_vedo,
    _recognize_meshio,
    _recognize_attributes,
)

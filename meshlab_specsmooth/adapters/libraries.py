"""Recognizers of the meshes of each library: functions that return a :class:`Source`, or None for other objects."""

from __future__ import annotations

import copy
import dataclasses
import importlib
import os
from operator import methodcaller
from typing import Any

import numpy as np
import numpy.typing as npt

from meshlab_specsmooth.adapters.polygons import as_array, join_rows, split_polygons, split_strips, triangulate, unpad
from meshlab_specsmooth.adapters.source import Mesh, MovedNormals, Source, has_attributes, keep
from meshlab_specsmooth.arrays import Floats
from meshlab_specsmooth.errors import InvalidSurface

# Reads files and copies pymeshlab's meshes. Imported when a mesh of pymeshlab is given, as it is in a higher layer and
# all other meshes work without pymeshlab.
_MODULE = "meshlab_specsmooth.meshlab.given"


def recognize_path(mesh: Mesh) -> Source | None:
    """Read the mesh file at a path."""
    if not isinstance(mesh, str | os.PathLike):
        return None
    return recognize_meshset(importlib.import_module(_MODULE).read(mesh))


def recognize_meshset(mesh: Mesh) -> Source | None:
    """Recognize a MeshSet, of which the current mesh is used."""
    if not has_attributes(mesh, "current_mesh", "mesh_number"):
        return None
    if mesh.mesh_number() == 0:
        raise InvalidSurface("mesh", "is a MeshSet without a mesh", "load one")
    current = mesh.current_mesh()
    return Source(current.vertex_matrix(), current.face_matrix(), mesh, _duplicate, _put_meshset, picklable=False)


def recognize_pymeshlab(mesh: Mesh) -> Source | None:
    """Recognize a mesh of pymeshlab."""
    if not has_attributes(mesh, "vertex_matrix", "face_matrix"):
        return None
    return Source(mesh.vertex_matrix(), mesh.face_matrix(), mesh, _duplicate, _put_pymeshlab, picklable=False)


def _duplicate(mesh: Mesh) -> Mesh:
    return importlib.import_module(_MODULE).duplicate(mesh)


def _put_meshset(ms: Mesh, source: Source, vertices: Floats) -> Mesh:
    return importlib.import_module(_MODULE).move(ms, vertices)


def _put_pymeshlab(ms: Mesh, source: Source, vertices: Floats) -> Mesh:
    module = importlib.import_module(_MODULE)
    return module.only_mesh(module.move(ms, vertices))


def recognize_tuple(mesh: Mesh) -> Source | None:
    """Recognize ``(vertices, faces, ...)``; the faces are the first table of integers."""
    if not isinstance(mesh, tuple | list) or len(mesh) < 2:
        return None
    vertices = as_array(mesh[0])
    if vertices is None or vertices.ndim != 2:
        return None
    at = 1
    if len(mesh) > 2:
        tables = [i for i in range(1, len(mesh)) if _is_index_table(mesh[i])]
        # igl.read_mesh returns tetrahedra first
        triangles = [i for i in tables if np.shape(mesh[i])[1] == 3]
        at = (triangles or tables or [1])[0] if len(mesh) == 3 else (tables or [1])[0]
    triangles_, polygons = triangulate(mesh[0], mesh[at])
    return Source(mesh[0], triangles_, (mesh, at), keep, _put_tuple, polygons)


def _is_index_table(given: Any) -> bool:
    array = as_array(given)
    return array is not None and array.dtype.kind in "iu" and array.ndim == 2 and len(array) > 0 and array.shape[1] > 2


def _put_tuple(given: tuple[Any, int], source: Source, vertices: Floats) -> Any:
    mesh, at = given
    parts = list(mesh)
    normals = MovedNormals(source, vertices)
    parts[0] = vertices
    for i in range(1, len(parts)):
        array = as_array(parts[i])
        if i != at and array is not None and _are_unit(array):
            if len(array) == len(vertices):
                parts[i] = normals.of_vertices(array)
            elif len(array) == normals.face_count:
                parts[i] = normals.of_faces(array)
    if hasattr(mesh, "_fields"):
        return type(mesh)(*parts)
    return tuple(parts) if isinstance(mesh, tuple) else parts


def _are_unit(array: npt.NDArray[Any]) -> bool:
    """Whether all rows have length 1 or 0, and some length 1."""
    if array.ndim != 2 or array.shape[1] != 3 or array.dtype.kind != "f" or len(array) == 0:
        return False
    length = np.linalg.norm(array.astype(np.float64), axis=1)
    return bool(((np.abs(length - 1) < 1e-3) | (length == 0)).all() and length.any())


def recognize_open3d(mesh: Mesh) -> Source | None:
    """Recognize a legacy ``TriangleMesh``."""
    if not has_attributes(mesh, "compute_vertex_normals", "vertices", "triangles"):
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


def recognize_open3d_tensor(mesh: Mesh) -> Source | None:
    """Recognize a tensor-based ``TriangleMesh``."""
    if not has_attributes(mesh, "vertex", "triangle"):
        return None
    if "positions" not in mesh.vertex or "indices" not in mesh.triangle:
        return None
    vertices, triangles = _numpy(mesh.vertex["positions"]), _numpy(mesh.triangle["indices"])
    return Source(vertices, triangles, mesh, methodcaller("clone"), _put_open3d_tensor)


def _numpy(tensor: Any) -> npt.NDArray[Any]:
    return np.asarray(tensor.cpu().numpy())


def _put_open3d_tensor(mesh: Mesh, source: Source, vertices: Floats) -> Mesh:
    old = mesh.vertex["positions"]
    wanted = np.ascontiguousarray(vertices, dtype=_numpy(old).dtype)
    mesh.vertex["positions"] = type(old).from_numpy(wanted).to(old.device)
    if "normals" in mesh.triangle:
        mesh.compute_triangle_normals()
    if "normals" in mesh.vertex:
        mesh.compute_vertex_normals()
    return mesh


def recognize_pyvista(mesh: Mesh) -> Source | None:
    """Recognize ``pyvista.PolyData``."""
    if not has_attributes(mesh, "points", "faces", "strips", "point_data", "cell_data"):
        return None
    flat, strips = np.asarray(mesh.faces), np.asarray(mesh.strips)
    corners, offsets = (unpad(flat) if len(flat) else None) or (np.empty(0, np.int64), np.zeros(1, np.int64))
    triangles, polygons = split_polygons(mesh.points, corners, offsets)
    if len(strips):
        count = len(offsets) - 1
        polygons = np.arange(count) if polygons is None else polygons
        of_strips, strip = split_strips(strips)
        triangles, polygons = np.concatenate([triangles, of_strips]), np.concatenate([polygons, count + strip])
    return Source(np.asarray(mesh.points), triangles, mesh, methodcaller("copy", deep=True), _put_pyvista, polygons)


def _put_pyvista(mesh: Mesh, source: Source, vertices: Floats) -> Mesh:
    normals = MovedNormals(source, vertices)
    mesh.points = vertices
    for name in [name for name in mesh.point_data.keys() if name == "Normals"]:  # noqa: SIM118 (not a mapping)
        mesh.point_data[name] = normals.of_vertices(mesh.point_data[name])
    if "Normals" in mesh.cell_data.keys():  # noqa: SIM118
        old = np.asarray(mesh.cell_data["Normals"])
        others = len(old) - normals.face_count  # vertices and lines come first
        mesh.cell_data["Normals"] = np.concatenate([old[:others], normals.of_faces(old[others:])])
    return mesh


def recognize_vedo(mesh: Mesh) -> Source | None:
    """Recognize ``vedo.Mesh``."""
    if not (has_attributes(mesh, "clone", "dataset") or has_attributes(mesh, "clone", "polydata")):
        return None
    cells = mesh.cells if hasattr(mesh, "cells") else mesh.faces() if hasattr(mesh, "faces") else None
    if cells is None:
        return None
    vertices = np.asarray(getattr(mesh, _vedo_points(mesh)))
    triangles, polygons = triangulate(vertices, cells)
    return Source(vertices, triangles, mesh, methodcaller("clone"), _put_vedo, polygons)


def _vedo_points(mesh: Mesh) -> str:
    """Return the name of the attribute with the positions; in older versions the other one is a method."""
    return "vertices" if callable(getattr(mesh, "points", None)) else "points"


def _put_vedo(mesh: Mesh, source: Source, vertices: Floats) -> Mesh:
    setattr(mesh, _vedo_points(mesh), vertices)
    data = mesh.pointdata
    if "Normals" in data.keys():  # noqa: SIM118
        data["Normals"] = MovedNormals(source, vertices).of_vertices(data["Normals"])
    if "Normals" in mesh.celldata.keys():  # noqa: SIM118
        mesh.celldata["Normals"] = MovedNormals(source, vertices).of_faces(mesh.celldata["Normals"])
    return mesh


def recognize_meshio(mesh: Mesh) -> Source | None:
    """Recognize a mesh of meshio."""
    if not has_attributes(mesh, "points", "cells", "point_data", "cell_data") or has_attributes(mesh, "n_cells"):
        return None
    blocks = [list(block.data) for block in mesh.cells if _is_polygonal(block.type)]
    rows = join_rows([row for block in blocks for row in block])
    if rows is None:
        found = ", ".join(sorted({str(block.type) for block in mesh.cells})) or "none"
        raise InvalidSurface("mesh", f"has no triangle, quad or polygon cells ({found})", "extract its surface first")
    triangles, polygons = split_polygons(mesh.points, *rows)
    return Source(mesh.points, triangles, mesh, copy.deepcopy, _put_meshio, polygons)


def _is_polygonal(kind: str) -> bool:
    return kind in ("triangle", "quad") or (kind.startswith("polygon") and kind[7:].isdigit()) or kind == "polygon"


def _put_meshio(mesh: Mesh, source: Source, vertices: Floats) -> Mesh:
    mesh.points = vertices
    normals = MovedNormals(source, vertices)
    data = mesh.point_data
    for name in [name for name in data if name.lower() == "normals" and np.shape(data[name]) == vertices.shape]:
        data[name] = normals.of_vertices(data[name])
    if all(name in data for name in ("nx", "ny", "nz")):  # as meshio reads them from PLY
        old = np.stack([data[name] for name in ("nx", "ny", "nz")], axis=1)
        data["nx"], data["ny"], data["nz"] = np.ascontiguousarray(normals.of_vertices(old).T)
    for name in [name for name in mesh.cell_data if "normals" in name.lower()]:
        _update_cell_normals(mesh, name, normals)
    return mesh


def _update_cell_normals(mesh: Mesh, name: str, normals: MovedNormals) -> None:
    """Recompute the normals of polygons; those of other cells stay."""
    data, at = mesh.cell_data[name], 0
    polygonal = [i for i, block in enumerate(mesh.cells) if _is_polygonal(block.type)]
    updated = normals.of_faces(np.concatenate([data[i] for i in polygonal]))
    for i in polygonal:
        data[i] = updated[at : at + len(data[i])]
        at += len(data[i])


def recognize_object(mesh: Mesh) -> Source | None:
    """Recognize any object with ``vertices`` and ``faces``."""
    if not has_attributes(mesh, "vertices", "faces"):
        return None
    triangles, polygons = triangulate(mesh.vertices, mesh.faces)
    return Source(mesh.vertices, triangles, mesh, _duplicate_object, _put_object, polygons)


def _duplicate_object(mesh: Mesh) -> Mesh:
    if dataclasses.is_dataclass(mesh):
        return mesh  # replaced, not modified
    if hasattr(mesh, "to_mesh"):
        return mesh.to_mesh()  # primitives of trimesh compute their vertices
    return mesh.copy() if hasattr(mesh, "copy") else copy.deepcopy(mesh)


def _put_object(mesh: Mesh, source: Source, vertices: Floats) -> Mesh:
    if dataclasses.is_dataclass(mesh) and not isinstance(mesh, type):
        return dataclasses.replace(mesh, vertices=vertices)
    mesh.vertices = vertices
    return mesh

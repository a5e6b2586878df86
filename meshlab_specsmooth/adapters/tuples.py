"""Tuples ``(vertices, faces, ...)``, as returned by marching cubes and igl's readers."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from meshlab_specsmooth.adapters.normals import MovedNormals
from meshlab_specsmooth.adapters.polygons import as_array, triangulate
from meshlab_specsmooth.adapters.source import Mesh, Source, keep
from meshlab_specsmooth.arrays import Floats


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

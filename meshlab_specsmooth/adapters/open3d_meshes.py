"""Triangle meshes of Open3D, legacy and tensor-based."""

from __future__ import annotations

import copy
from typing import Any

import numpy as np
import numpy.typing as npt

from meshlab_specsmooth.adapters.source import Mesh, Source, has_attributes
from meshlab_specsmooth.arrays import Floats


def recognize_mesh(mesh: Mesh) -> Source | None:
    """Recognize a legacy ``TriangleMesh``."""
    if not has_attributes(mesh, "compute_vertex_normals", "vertices", "triangles"):
        return None
    return Source(np.asarray(mesh.vertices), np.asarray(mesh.triangles), mesh, copy.deepcopy, _put_mesh)


def _put_mesh(mesh: Mesh, source: Source, vertices: Floats) -> Mesh:
    had = mesh.has_vertex_normals(), mesh.has_triangle_normals()
    mesh.vertices = type(mesh.vertices)(vertices)
    if had[1]:
        mesh.compute_triangle_normals()
    if had[0]:
        mesh.compute_vertex_normals()
    return mesh


def recognize_tensor_mesh(mesh: Mesh) -> Source | None:
    """Recognize a tensor-based ``TriangleMesh``."""
    if not has_attributes(mesh, "vertex", "triangle"):
        return None
    if "positions" not in mesh.vertex or "indices" not in mesh.triangle:
        return None
    vertices, triangles = _numpy(mesh.vertex["positions"]), _numpy(mesh.triangle["indices"])
    return Source(vertices, triangles, mesh, _clone, _put_tensor_mesh)


def _numpy(tensor: Any) -> npt.NDArray[Any]:
    return np.asarray(tensor.cpu().numpy())


def _clone(mesh: Mesh) -> Mesh:
    return mesh.clone()


def _put_tensor_mesh(mesh: Mesh, source: Source, vertices: Floats) -> Mesh:
    old = mesh.vertex["positions"]
    wanted = np.ascontiguousarray(vertices, dtype=_numpy(old).dtype)
    mesh.vertex["positions"] = type(old).from_numpy(wanted).to(old.device)
    if "normals" in mesh.triangle:
        mesh.compute_triangle_normals()
    if "normals" in mesh.vertex:
        mesh.compute_vertex_normals()
    return mesh

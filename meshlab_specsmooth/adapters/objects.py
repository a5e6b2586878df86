"""Objects with ``vertices`` and ``faces``: meshes of trimesh, :class:`Surface`, and others."""

from __future__ import annotations

import copy
import dataclasses
from dataclasses import replace

from meshlab_specsmooth.adapters.polygons import triangulate
from meshlab_specsmooth.adapters.source import Mesh, Source, has_attributes
from meshlab_specsmooth.arrays import Floats


def recognize_object(mesh: Mesh) -> Source | None:
    """Recognize any object with ``vertices`` and ``faces``."""
    if not has_attributes(mesh, "vertices", "faces"):
        return None
    triangles, polygons = triangulate(mesh.vertices, mesh.faces)
    return Source(mesh.vertices, triangles, mesh, _duplicate, _put, polygons)


def _duplicate(mesh: Mesh) -> Mesh:
    if dataclasses.is_dataclass(mesh):
        return mesh  # replaced, not modified
    if hasattr(mesh, "to_mesh"):
        return mesh.to_mesh()  # primitives of trimesh compute their vertices
    return mesh.copy() if hasattr(mesh, "copy") else copy.deepcopy(mesh)


def _put(mesh: Mesh, source: Source, vertices: Floats) -> Mesh:
    if dataclasses.is_dataclass(mesh) and not isinstance(mesh, type):
        return replace(mesh, vertices=vertices)
    mesh.vertices = vertices
    return mesh

"""MeshSets and meshes of pymeshlab, and paths of mesh files."""

from __future__ import annotations

import importlib
import os

from meshlab_specsmooth.adapters.source import Mesh, Source, has_attributes
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


def recognize_mesh(mesh: Mesh) -> Source | None:
    """Recognize a mesh of pymeshlab."""
    if not has_attributes(mesh, "vertex_matrix", "face_matrix"):
        return None
    return Source(mesh.vertex_matrix(), mesh.face_matrix(), mesh, _duplicate, _put_mesh, picklable=False)


def _duplicate(mesh: Mesh) -> Mesh:
    return importlib.import_module(_MODULE).duplicate(mesh)


def _put_meshset(ms: Mesh, source: Source, vertices: Floats) -> Mesh:
    return importlib.import_module(_MODULE).move(ms, vertices)


def _put_mesh(ms: Mesh, source: Source, vertices: Floats) -> Mesh:
    module = importlib.import_module(_MODULE)
    return module.only_mesh(module.move(ms, vertices))

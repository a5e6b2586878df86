"""Meshes of meshio with triangle, quad or polygon cells."""

from __future__ import annotations

import copy

import numpy as np

from meshlab_specsmooth.adapters.normals import MovedNormals
from meshlab_specsmooth.adapters.polygons import join_rows, split_polygons
from meshlab_specsmooth.adapters.source import Mesh, Source, has_attributes
from meshlab_specsmooth.arrays import Floats
from meshlab_specsmooth.errors import InvalidSurface


def recognize_mesh(mesh: Mesh) -> Source | None:
    """Recognize a mesh of meshio."""
    if not has_attributes(mesh, "points", "cells", "point_data", "cell_data") or has_attributes(mesh, "n_cells"):
        return None
    blocks = [list(block.data) for block in mesh.cells if _is_polygonal(block.type)]
    rows = join_rows([row for block in blocks for row in block])
    if rows is None:
        found = ", ".join(sorted({str(block.type) for block in mesh.cells})) or "none"
        raise InvalidSurface("mesh", f"has no triangle, quad or polygon cells ({found})", "extract its surface first")
    triangles, polygons = split_polygons(mesh.points, *rows)
    return Source(mesh.points, triangles, mesh, copy.deepcopy, _put, polygons)


def _is_polygonal(kind: str) -> bool:
    return kind in ("triangle", "quad") or (kind.startswith("polygon") and kind[7:].isdigit()) or kind == "polygon"


def _put(mesh: Mesh, source: Source, vertices: Floats) -> Mesh:
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

"""All that a MeshSet can be asked about itself, to compare before and after."""

from __future__ import annotations

import contextlib
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
import pymeshlab

# what follows the coordinates, as after MeshLab's own filters
FOLLOWS = {"vertices", "vertex normals", "face normals", "bounding box"}


def of_mesh(m: pymeshlab.Mesh) -> dict[str, Any]:
    """Every component and attribute of a mesh."""
    state: dict[str, Any] = {
        "id": m.id(),
        "label": m.label(),
        "visible": m.is_visible(),
        "transform": m.transform_matrix(),
        "vertices": m.vertex_matrix(),
        "faces": m.face_matrix(),
        "polygons": [list(p) for p in m.polygonal_face_list()],
        "edges": m.edge_matrix(),
        "vertex normals": m.vertex_normal_matrix(),
        "face normals": m.face_normal_matrix(),
        "vertex selection": m.vertex_selection_array(),
        "face selection": m.face_selection_array(),
        "bounding box": np.array([m.bounding_box().min(), m.bounding_box().max()]),
        "textures": sorted(m.textures()),
    }
    if m.has_vertex_color():
        state["vertex colors"] = m.vertex_color_matrix()
    if m.has_face_color():
        state["face colors"] = m.face_color_matrix()
    if m.has_vertex_scalar():
        state["vertex quality"] = m.vertex_scalar_array()
    if m.has_face_scalar():
        state["face quality"] = m.face_scalar_array()
    if m.has_vertex_tex_coord():
        state["vertex texture coordinates"] = m.vertex_tex_coord_matrix()
    if m.has_wedge_tex_coord():
        state["wedge texture coordinates"] = m.wedge_tex_coord_matrix()
    for direction in (1, 2):
        with contextlib.suppress(pymeshlab.MissingComponentException):
            matrix = getattr(m, f"vertex_curvature_principal_dir{direction}_matrix")()
            state[f"curvature direction {direction}"] = matrix
    for name in ATTRIBUTES:
        with contextlib.suppress(pymeshlab.PyMeshLabException):
            state[f"vertex attribute {name}"] = m.vertex_custom_scalar_attribute_array(name)
        with contextlib.suppress(pymeshlab.PyMeshLabException):
            state[f"face attribute {name}"] = m.face_custom_scalar_attribute_array(name)
        with contextlib.suppress(pymeshlab.PyMeshLabException):
            state[f"vertex point attribute {name}"] = m.vertex_custom_point_attribute_matrix(name)
    return state


ATTRIBUTES = ("heat", "no identifier!", "flow")


def of_meshset(ms: pymeshlab.MeshSet) -> dict[str, Any]:
    """Every mesh, which one is current, and the filter script."""
    with tempfile.TemporaryDirectory() as folder:
        script = Path(folder) / "s.mlx"
        ms.save_filter_script(str(script))
        text = script.read_text()
    return {
        "number": ms.mesh_number(),
        "current": ms.current_mesh_id() if ms.mesh_number() else None,
        "script": text,
        "meshes": [of_mesh(m) for m in ms],
        "rasters": _rasters(ms),
    }


def _rasters(ms: pymeshlab.MeshSet) -> str:
    """The raster layers with their cameras, as a project file has them; pymeshlab has no other way to tell."""
    if ms.raster_number() == 0:
        return ""
    with tempfile.TemporaryDirectory() as folder:
        project = Path(folder) / "p.mlp"
        ms.save_project(str(project))
        return project.read_text().partition("<RasterGroup>")[2].replace(folder, "")


def differences(before: Any, after: Any, path: str = "") -> list[str]:
    """Where two states differ, as paths; compared to the bit."""
    if isinstance(before, dict):
        paths = [f"{path}/{key}" for key in set(before) ^ set(after)]
        return paths + [
            d for key in set(before) & set(after) for d in differences(before[key], after[key], f"{path}/{key}")
        ]
    if isinstance(before, list) and before and isinstance(before[0], dict):
        if len(before) != len(after):
            return [path]
        return [
            d for i, (a, b) in enumerate(zip(before, after, strict=True)) for d in differences(a, b, f"{path}[{i}]")
        ]
    same = np.array_equal(np.asarray(before), np.asarray(after)) if isinstance(before, np.ndarray) else before == after
    return [] if same else [path]

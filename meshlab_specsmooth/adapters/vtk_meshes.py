"""Surface meshes of PyVista and vedo, which both wrap VTK."""

from __future__ import annotations

import numpy as np

from meshlab_specsmooth.adapters.normals import MovedNormals
from meshlab_specsmooth.adapters.polygons import split_polygons, split_strips, triangulate, unpad
from meshlab_specsmooth.adapters.source import Mesh, Source, has_attributes
from meshlab_specsmooth.arrays import Floats


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
    return Source(np.asarray(mesh.points), triangles, mesh, _copy_deep, _put_pyvista, polygons)


def _copy_deep(mesh: Mesh) -> Mesh:
    return mesh.copy(deep=True)


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
    return Source(vertices, triangles, mesh, _copy_vedo, _put_vedo, polygons)


def _copy_vedo(mesh: Mesh) -> Mesh:
    return mesh.clone()


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

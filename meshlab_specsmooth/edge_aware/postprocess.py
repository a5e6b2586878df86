"""Corrections of a result: no face is flipped, and the volume is kept."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy.sparse import csr_array

from meshlab_specsmooth.arrays import Booleans, Floats
from meshlab_specsmooth.edge_aware.operators import FaceOperators, compute_volume
from meshlab_specsmooth.geometry.triangles import compute_vertex_normals

# Attempts to repair flipped faces.
_MAX_REPAIRS = 10


def repair_flips(mesh: FaceOperators, Y: Floats, smoothed: Floats, repairs: int = _MAX_REPAIRS) -> tuple[Floats, int]:
    """The vertices, those of flipped faces moved toward their neighbors; and how many faces stay flipped."""
    if Y is smoothed:  # there is nothing to compare with
        return Y, 0
    around = mesh.graph.adjacency()
    smooth = mesh.kernels.face_geometry(smoothed)[1]
    was_opposed = _find_opposed(around, smooth)

    def find_flipped(X: Floats) -> Booleans:
        """Faces that look away from where the smoothed surface's do, or from where their neighbors do.

        Not those that look away from their neighbors on the smoothed surface as well: they were so in the input.
        """
        normals = mesh.kernels.face_geometry(X)[1]
        away = np.einsum("ij,ij->i", normals, smooth) < 0
        return np.asarray(away | (_find_opposed(around, normals) & ~was_opposed), dtype=np.bool_)

    flipped = find_flipped(Y)
    for _ in range(repairs):
        if not flipped.any():
            break
        corners = np.unique(mesh.F[flipped])
        corners = corners[~mesh.on_boundary[corners]]
        moved = Y.copy()
        moved[corners] += (_average_centroids(mesh, Y, corners) - Y[corners]) / 2
        now = find_flipped(moved)
        if now.sum() > flipped.sum():
            break
        Y, flipped = moved, now
    return Y, int(flipped.sum())


def restore_volume(mesh: FaceOperators, Y: Floats, volume: float, level: float) -> Floats:
    """``Y`` moved along its normals, all vertices by the same distance, to a volume.

    Noise does not change a volume in the mean, so that of the given surface is the best estimate. Where that takes more
    than a noise level, the volume is meaningless (faces of both orientations), and ``Y`` stays.
    """
    area = mesh.kernels.face_geometry(Y)[2].sum() / 2
    step = (volume - compute_volume(mesh, Y)) / area if area > 0 else 0.0
    return Y + step * compute_vertex_normals(Y, mesh.F) if abs(step) <= level else Y


def _average_centroids(mesh: FaceOperators, Y: Floats, vertices: npt.NDArray[np.integer]) -> Floats:
    """The mean of the centroids of the faces at each of some vertices."""
    graph = mesh.graph
    ones = np.ones(len(graph.vertex_faces))
    at = csr_array((ones, graph.vertex_faces, graph.vertex_indptr), shape=(graph.order, graph.size))
    return np.asarray((at[vertices] @ mesh.kernels.face_geometry(Y)[0]) * mesh.step_size[vertices, None])


def _find_opposed(around: csr_array, normals: Floats) -> Booleans:
    """Faces whose normals look away from those of their neighbors."""
    return np.asarray(np.einsum("ij,ij->i", normals, around @ normals) < 0, dtype=np.bool_)

"""What is held afterward: no face is turned over, and the volume stays."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy.sparse import csr_array

from meshlab_specsmooth.arrays import Booleans, Floats
from meshlab_specsmooth.edge_aware.mesh import Mesh, volume_of
from meshlab_specsmooth.noise.estimate import normals

MOST_REPAIRS = 10  # of turned faces


def without_flips(mesh: Mesh, Y: Floats, smoothed: Floats, repairs: int = MOST_REPAIRS) -> tuple[Floats, int]:
    """The vertices, those of turned faces drawn toward their neighbors; and how many faces stay turned."""
    turned = _turned(mesh, Y, smoothed)
    for _ in range(repairs):
        if not turned.any():
            break
        corners = np.unique(mesh.F[turned])
        corners = corners[~mesh.rim[corners]]
        moved = Y.copy()
        moved[corners] += (_around(mesh, Y, corners) - Y[corners]) / 2
        now = _turned(mesh, moved, smoothed)
        if now.sum() > turned.sum():
            break
        Y, turned = moved, now
    return Y, int(turned.sum())


def _around(mesh: Mesh, Y: Floats, vertices: npt.NDArray[np.integer]) -> Floats:
    """The mean of the centroids of the faces at each of some vertices."""
    graph = mesh.graph
    ones = np.ones(len(graph.vertex_faces))
    at = csr_array((ones, graph.vertex_faces, graph.vertex_indptr), shape=(graph.order, graph.size))
    return np.asarray((at[vertices] @ mesh.kernels.face_geometry(Y)[0]) * mesh.pull[vertices, None])


def with_volume(mesh: Mesh, Y: Floats, given: float, level: float) -> Floats:
    """``Y`` moved along its normals, all vertices by the same, so that its volume is that given.

    Noise does not change a volume in the mean, so that of the given surface is the best known. Where that takes more
    than a noise level, the volume means nothing (faces turned this way and that), and ``Y`` stays.
    """
    area = mesh.kernels.face_geometry(Y)[2].sum() / 2
    step = (given - volume_of(mesh, Y)) / area if area > 0 else 0.0
    return Y + step * normals(Y, mesh.F) if abs(step) <= level else Y


def _turned(mesh: Mesh, Y: Floats, smoothed: Floats) -> Booleans:
    """Faces that look away from where the smoothed surface's do, or from where their neighbors do.

    Not those that look away from their neighbors on the smoothed surface as well: they came so.
    """
    across, smooth = mesh.kernels.face_geometry(Y)[1], mesh.kernels.face_geometry(smoothed)[1]
    away = np.asarray((across * smooth).sum(axis=1) < 0)
    opposed = _opposed(mesh, across) & ~_opposed(mesh, smooth)
    return np.asarray(away | opposed, dtype=np.bool_)


def _opposed(mesh: Mesh, across: Floats) -> Booleans:
    """Faces whose normals look away from those of their neighbors."""
    graph = mesh.graph
    around = csr_array((np.ones(len(graph.indices)), graph.indices, graph.indptr), shape=(graph.size, graph.size))
    return np.asarray((across * (around @ across)).sum(axis=1) < 0, dtype=np.bool_)

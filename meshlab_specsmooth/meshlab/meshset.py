"""Arrays out of a MeshSet, and new vertices into it."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pymeshlab

from meshlab_specsmooth.arrays import Floats
from meshlab_specsmooth.meshlab.commit import Change, write


def new(vertices: npt.ArrayLike, faces: npt.ArrayLike) -> pymeshlab.MeshSet:
    """Create a MeshSet with one mesh.

    Parameters
    ----------
    vertices : (n, 3) array_like
    faces : (m, 3) array_like of int
    """
    ms = pymeshlab.MeshSet()
    ms.add_mesh(pymeshlab.Mesh(np.asarray(vertices, dtype=np.float64), np.asarray(faces)))
    return ms


def get_arrays(ms: pymeshlab.MeshSet) -> tuple[Floats, npt.NDArray[np.int32]]:
    """Return copies of the vertices and faces of the current mesh.

    Returns
    -------
    vertices : (n, 3) float64
        Untransformed coordinates, as MeshLab's filters use them.
    faces : (m, 3) int32
    """
    mesh = ms.current_mesh()
    return mesh.vertex_matrix(), mesh.face_matrix()


def set_vertices(ms: pymeshlab.MeshSet, vertices: Floats) -> None:
    """Set the vertices of the current mesh exactly; see :func:`meshlab_specsmooth.meshlab.commit.write`.

    Parameters
    ----------
    ms : pymeshlab.MeshSet
    vertices : (n, 3) float64
    """
    write(ms, Change(vertices=vertices))

"""The selected edges of a mesh, for which pymeshlab has no getter."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pymeshlab

from meshlab_specsmooth.arrays import Integers
from meshlab_specsmooth.errors import MeshSetError
from meshlab_specsmooth.runtime import temporary
from meshlab_specsmooth.runtime.interrupts import DeferInterrupts

# Flags of a face: the edge from corner k to the next is selected
_SELECTED = tuple(0x8000 << k for k in range(3))
_FACE = np.dtype([("count", "u1"), ("corners", "<i4", 3), ("flags", "<i4")])
_VERTEX_BYTES = 24
_OF_VERTICES = ["vertex_flag", "vertex_color", "vertex_quality", "vertex_normal", "vertex_coord"]
_OF_FACES = ["face_color", "face_quality", "wedge_texcoord", "wedge_normal"]
_ELEMENTS = """element vertex {vertices}
property double x
property double y
property double z
element face {faces}
property list uchar int vertex_indices
property int flags
end_header
"""


def selected_edges(ms: pymeshlab.MeshSet) -> Integers:
    """Return the selected edges of the current mesh.

    They are only accessible in a PLY file, in the flags of the faces, so one is written and read.

    Returns
    -------
    (k, 2) int32
        Vertex pairs, sorted and unique.

    Raises
    ------
    MeshSetError
        This pymeshlab writes another layout.

    Examples
    --------
    >>> import pymeshlab
    >>> from meshlab_specsmooth.meshlab.creases import selected_edges
    >>> ms = pymeshlab.MeshSet()
    >>> ms.create_cube()
    >>> ms.compute_selection_crease_per_edge(angledegneg=-45, angledegpos=45)
    >>> len(selected_edges(ms))
    12
    """
    mesh = ms.current_mesh()
    vertices, faces = mesh.vertex_number(), mesh.face_number()
    label = mesh.label()
    with DeferInterrupts(), temporary.folder() as folder:
        path = Path(folder) / "edges.ply"
        omitted = {f"save_{name}": False for name in _OF_VERTICES + _OF_FACES}
        ms.save_current_mesh(str(path), save_textures=False, binary=True, save_face_flag=True, **omitted)
        mesh.set_label(label)  # saving sets an empty label to the name of the file
        data = path.read_bytes()
    header = _ELEMENTS.format(vertices=vertices, faces=faces).encode()
    start = data.find(header) + len(header) + _VERTEX_BYTES * vertices
    if header not in data[:4096] or len(data) != start + _FACE.itemsize * faces:
        raise MeshSetError("this pymeshlab writes selected edges in an unknown layout; give an angle instead")
    written = np.frombuffer(data, dtype=_FACE, offset=start)
    selected = np.stack([written["flags"] & flag != 0 for flag in _SELECTED], axis=1)
    corners = np.asarray(written["corners"], dtype=np.int32)
    ends = np.stack([corners, np.roll(corners, -1, axis=1)], axis=2)[selected]
    ends = ends[ends[:, 0] != ends[:, 1]]
    return np.unique(np.sort(ends, axis=1), axis=0)

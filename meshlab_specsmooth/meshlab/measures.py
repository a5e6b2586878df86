"""Measurements by MeshLab's own filters."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pymeshlab

from meshlab_specsmooth.adapters import Mesh, accept_meshes, recognize
from meshlab_specsmooth.arrays import Booleans
from meshlab_specsmooth.geometry.surface import Surface
from meshlab_specsmooth.meshlab import meshset


def hausdorff(a: Surface, b: Surface) -> float:
    """Compute the Hausdorff distance by MeshLab, sampled at the vertices, the larger of both directions, in mesh units.

    Examples
    --------
    >>> import meshlab_specsmooth as mss
    >>> from meshlab_specsmooth.meshlab.measures import hausdorff
    >>> flat = mss.Surface([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    >>> round(hausdorff(flat, mss.Surface(flat.vertices + [0, 0, 0.25], flat.faces)), 6)
    0.25
    """
    ms = meshset.new(a.vertices, a.faces)
    ms.add_mesh(pymeshlab.Mesh(b.vertices, b.faces))
    # large enough for any distance: by default MeshLab ignores distances above half a diagonal
    corners = np.concatenate([a.vertices, b.vertices])
    far = pymeshlab.PureValue(float(np.linalg.norm(np.ptp(corners, axis=0))) or 1.0)
    return max(
        float(
            ms.get_hausdorff_distance(
                sampledmesh=i, targetmesh=1 - i, samplevert=True, sampleface=False, sampleedge=False,
                samplenum=len(x.vertices), maxdist=far,
            )["max"]
        )
        for i, x in enumerate((a, b))
    )  # fmt: skip


@accept_meshes
def self_intersecting_faces(mesh: Mesh, faces: npt.ArrayLike | None = None) -> Booleans:
    """Find faces that intersect other faces, by MeshLab's filter.

    Parameters
    ----------
    mesh : (n, 3) array of real numbers, or a mesh of any kind
    faces : (m, 3) array of integers, optional
        As for :func:`meshlab_specsmooth.smooth`.

    Returns
    -------
    (m,) bool
        For the faces as given, which may be polygons; the sum is their number. At 300 000 vertices this takes a third
        of the time of the edge-aware filter, so the filters do not report it.

    Raises
    ------
    InvalidSurface
        As :class:`Surface` does.

    Examples
    --------
    >>> import meshlab_specsmooth as mss
    >>> flat = [[0, 0, 0], [2, 0, 0], [0, 2, 0]]
    >>> upright, aside = ([[x, 0.2, -1], [x, 0.4, -1], [x, 0.3, 1]] for x in (0.5, 5))
    >>> mss.self_intersecting_faces([*flat, *upright, *aside], [[0, 1, 2], [3, 4, 5], [6, 7, 8]]).tolist()
    [True, True, False]
    """
    source = recognize(mesh, faces)
    surface = source.surface()
    # squares of coordinates must not overflow, and scaling by a power of two is exact
    _, exponent = np.frexp(np.abs(surface.vertices).max())
    ms = meshset.new(np.ldexp(surface.vertices, -exponent), surface.faces)
    ms.compute_selection_by_self_intersections_per_face()
    return source.per_face(np.asarray(ms.current_mesh().face_selection_array(), dtype=np.bool_))

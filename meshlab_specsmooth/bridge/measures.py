"""What MeshLab measures itself."""

from __future__ import annotations

import numpy as np
import pymeshlab

from meshlab_specsmooth.bridge import meshset
from meshlab_specsmooth.surface import Surface


def hausdorff(a: Surface, b: Surface) -> float:
    """MeshLab's Hausdorff distance, the larger of both directions, sampled at the vertices; in mesh units.

    Examples
    --------
    >>> import meshlab_specsmooth as mss
    >>> from meshlab_specsmooth.bridge.measures import hausdorff
    >>> flat = mss.Surface([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    >>> round(hausdorff(flat, mss.Surface(flat.vertices + [0, 0, 0.25], flat.faces)), 6)
    0.25
    """
    ms = meshset.new(a.vertices, a.faces)
    ms.add_mesh(pymeshlab.Mesh(b.vertices, b.faces))
    # far enough for any distance: by default MeshLab leaves out what is further off than half a diagonal
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


def self_intersections(surface: Surface) -> int:
    """The number of faces that MeshLab finds to run through others."""
    ms = meshset.new(surface.vertices, surface.faces)
    ms.compute_selection_by_self_intersections_per_face()
    return int(ms.current_mesh().selected_face_number())

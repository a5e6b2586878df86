"""Creases by an angle, under noise."""

from __future__ import annotations

from meshlab_specsmooth.arrays import Integers
from meshlab_specsmooth.edge_aware.filter import low_pass_normals
from meshlab_specsmooth.edge_aware.operators import FaceOperators, smooth_isotropically
from meshlab_specsmooth.edge_aware.search import guide_weight
from meshlab_specsmooth.graph.creases import find_creases
from meshlab_specsmooth.noise.model import NONE, Noise

# A setting for hard edges under much noise: on a cube with noise of up to 0.3 edges it finds all edges, and no others.
# The vertices do not follow, as faces that noise has flipped would stay flipped.
# docs/constants.md: _STRENGTH, _RANGE_SIGMA, _ITERATIONS
_STRENGTH, _RANGE_SIGMA, _ITERATIONS = 8.0, 0.28, 4


def find_creases_by_angle(mesh: FaceOperators, angle: float, noise: Noise, level: float) -> Integers:
    """(k, 2) edges whose faces' normals differ by more than an angle in degrees.

    Noise tilts faces by more than the angle of many edges, and isotropic smoothing rounds the edges. So under noise, of
    a ``level`` in mean edges, the normals are compared after an edge-aware low-pass.
    """
    center, N, area = mesh.kernels.face_geometry(mesh.V)
    if noise.kind != NONE:
        given, N = N, mesh.kernels.face_geometry(smooth_isotropically(mesh, mesh.V, guide_weight(level)))[1]
        for _ in range(_ITERATIONS):
            N = low_pass_normals(mesh.kernels, center, given, area, N, _STRENGTH, _RANGE_SIGMA)
    return find_creases(mesh.F, N, len(mesh.V), angle)

"""The three steps: normals of the faces, their low-pass on the graph of faces, vertices that follow them."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from meshlab_specsmooth.arrays import Floats
from meshlab_specsmooth.edge_aware.operators import FaceOperators
from meshlab_specsmooth.edge_aware.settings import GIVEN, EdgeAware
from meshlab_specsmooth.graph.protocols import FaceKernels
from meshlab_specsmooth.runtime.progress import Progress

# Spatial sigma of the weights, in mean distances of neighboring centroids: the ring of faces around one counts.
# docs/constants.md: _SPATIAL_SIGMA
_SPATIAL_SIGMA = 1.5

# Gradient steps of the vertices toward the normals, stopped early so that triangles keep their shape.
# docs/constants.md: _VERTEX_STEPS
_VERTEX_STEPS = 15

# The solve is stopped where the relative error of the normals is below a thousandth: they are filtered again in the
# next iteration. With creases the error on one side would depend on the other, and that of a part of a surface on how
# much of it there is, so these are solved further.
# docs/constants.md: _RTOL, _MAX_CG_ITERATIONS
_RTOL, _MAX_CG_ITERATIONS = 1e-3, 6
_RTOL_EXACT, _MAX_CG_ITERATIONS_EXACT = 1e-8, 200


def normalize(X: Floats) -> Floats:
    """(n, 3) rows of length one; rows of zeros stay."""
    length = np.sqrt(np.einsum("ij,ij->i", X, X))[:, None]
    return np.asarray(np.divide(X, length, out=np.zeros_like(X), where=length > 0))


def low_pass_normals(
    kernels: FaceKernels,
    center: Floats,
    N: Floats,
    area: Floats,
    guide: Floats,
    strength: float,
    range_sigma: float,
    is_exact: bool = False,
) -> Floats:
    """Unit normals (A + t L_w)^-1 A N; ``is_exact``: whether it is solved to rounding."""
    # the mean centroids of two equilateral triangles of edge 1 on an edge are 1 / sqrt(3) apart
    inv_2sigma_s2 = 1.5 / _SPATIAL_SIGMA**2
    inv_2sigma_r2 = 0.5 / range_sigma**2
    # a face of no area has no normal, but passes on those of its neighbors
    a = np.maximum(area / max(area.mean(), np.finfo(float).tiny), 1e-9)
    root = np.sqrt(a)
    weight, degree = kernels.bilateral_weights(center, guide, root, inv_2sigma_s2, inv_2sigma_r2)
    diagonal = a + strength * degree
    rtol, most = (_RTOL_EXACT, _MAX_CG_ITERATIONS_EXACT) if is_exact else (_RTOL, _MAX_CG_ITERATIONS)
    return normalize(kernels.solve(weight, diagonal, strength, a[:, None] * N, guide, rtol, most))


def iterate(
    mesh: FaceOperators,
    given: Floats,
    smoothed: Floats,
    start: str,
    strength: float,
    range_sigma: float,
    is_exact: bool = False,
) -> Iterator[Floats]:
    """The vertices after each iteration, without end; ``is_exact`` as for :func:`low_pass_normals`.

    Normals are guided by those of the isotropically smoothed surface first, then by those of the result so far.
    """
    V = given if start == GIVEN else smoothed
    if mesh.holds_boundary:
        V = np.where(mesh.on_boundary[:, None], smoothed, V)
    guide = mesh.kernels.face_geometry(smoothed)[1]
    while True:
        center, N, area = mesh.kernels.face_geometry(V)
        N = low_pass_normals(mesh.kernels, center, N, area, guide, strength, range_sigma, is_exact)
        V = mesh.kernels.update_vertices(V, N, mesh.step_size, _VERTEX_STEPS)
        yield V
        guide = mesh.kernels.face_geometry(V)[1]


def apply_setting(
    mesh: FaceOperators, given: Floats, smoothed: Floats, setting: EdgeAware, progress: Progress | None = None
) -> Floats:
    """What a complete setting makes of the given vertices."""
    if setting.strength is None or setting.range_sigma is None or not setting.iterations:
        return smoothed
    is_exact = mesh.is_exact or mesh.cut is not None  # the parts of a cut surface must not depend on each other
    path = iterate(mesh, given, smoothed, setting.start, setting.strength, setting.range_sigma, is_exact)
    for count in range(1, setting.iterations):
        next(path)
        if progress is not None:
            progress(count / setting.iterations)
    return next(path)

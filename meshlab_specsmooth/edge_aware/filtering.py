"""The three steps: normals of the faces, their low-pass on the graph of faces, vertices that follow them."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from meshlab_specsmooth.arrays import Floats
from meshlab_specsmooth.edge_aware.mesh import Mesh
from meshlab_specsmooth.edge_aware.result import Setting
from meshlab_specsmooth.graph.protocols import FaceKernels
from meshlab_specsmooth.runtime.progress import Progress

# Width of the weights in space, in mean distances of neighboring centroids: the ring of faces around one counts.
_SPATIAL_WIDTH = 1.5
_SWEEPS = 15
# The solve is cut short where the normals are off by less than a thousandth: they are re-estimated in the next pass.
_SOLVED_TO = 1e-3
_MOST_ITERATIONS = 6
# Where creases are given, what is left unsolved must not tell one side of the other.
_PARTED_TO, _MOST_ITERATIONS_PARTED = 1e-8, 200


def unit(X: Floats) -> Floats:
    """(n, 3) rows of length one; zero where they are."""
    length = np.sqrt(np.einsum("ij,ij->i", X, X))[:, None]
    return np.asarray(np.divide(X, length, out=np.zeros_like(X), where=length > 0))


def low_pass(
    kernels: FaceKernels,
    center: Floats,
    N: Floats,
    area: Floats,
    guide: Floats,
    strength: float,
    range_sigma: float,
    parted: bool = False,
) -> Floats:
    """Unit normals (A + t L_w)^-1 A N; ``parted``: whether the graph has parts that must not depend on each other."""
    # the mean centroids of two equilateral triangles of edge 1 on an edge are 1 / sqrt(3) apart
    near = 1.5 / _SPATIAL_WIDTH**2
    alike = 0.5 / range_sigma**2
    # a face of no area has no normal, but passes on those of its neighbors
    a = np.maximum(area / max(area.mean(), np.finfo(float).tiny), 1e-9)
    root = np.sqrt(a)
    weight, degree = kernels.bilateral_weights(center, guide, root, near, alike)
    diagonal = a + strength * degree
    tolerance, most = (_PARTED_TO, _MOST_ITERATIONS_PARTED) if parted else (_SOLVED_TO, _MOST_ITERATIONS)
    return unit(kernels.solve(weight, diagonal, strength, a[:, None] * N, guide, tolerance, most))


def iterate(
    mesh: Mesh,
    given: Floats,
    smoothed: Floats,
    start: str,
    strength: float,
    range_sigma: float,
    parted: bool = False,
) -> Iterator[Floats]:
    """The vertices after each pass, without end; ``parted`` as for :func:`low_pass`."""
    V = given if start == "given" else smoothed
    if mesh.holds_rim:
        V = np.where(mesh.rim[:, None], smoothed, V)
    guide = mesh.kernels.face_geometry(smoothed)[1]
    while True:
        center, N, area = mesh.kernels.face_geometry(V)
        N = low_pass(mesh.kernels, center, N, area, guide, strength, range_sigma, parted)
        V = mesh.kernels.update_vertices(V, N, mesh.pull, _SWEEPS)
        yield V
        guide = mesh.kernels.face_geometry(V)[1]


def filtered(mesh: Mesh, given: Floats, smoothed: Floats, setting: Setting, progress: Progress | None = None) -> Floats:
    """What a setting makes of the given vertices."""
    if setting.iterations == 0:
        return smoothed
    parted = mesh.cut is not None
    path = iterate(mesh, given, smoothed, setting.start, setting.strength, setting.range_sigma, parted)
    for count in range(1, setting.iterations):
        next(path)
        if progress is not None:
            progress(count / setting.iterations)
    return next(path)

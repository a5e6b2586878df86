"""The part of a mesh that the search runs on."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from meshlab_specsmooth.arrays import Integers
from meshlab_specsmooth.edge_aware.mesh import Mesh, built, with_creases
from meshlab_specsmooth.noise.estimate import Sheet, sheet
from meshlab_specsmooth.operators.patches import MIN_COUNTED, draw_sample


def sample_of(mesh: Mesh) -> tuple[Mesh, Sheet, npt.NDArray[np.integer]]:
    """The mesh where it is small, else patches of it, in an order that its own order has no part in.

    In patches, what is near their rims does not count.

    Returns
    -------
    sample : Mesh
    on : Sheet
        The same for measuring noise.
    vertices : (k,) int
        Which vertices of the mesh these are.
    """
    prepared = mesh.isotropic
    drawn = draw_sample(mesh.V[prepared.moving], prepared.faces, prepared.L, mesh.counts[prepared.moving])
    at = prepared.moving[drawn.vertices]
    on = sheet(mesh.V[at], drawn.faces, mesh.counts[at])
    counts = mesh.counts[at] if len(at) == len(mesh.V) else on.inner
    if counts.sum() < MIN_COUNTED:
        counts = np.ones_like(counts)
    return built(mesh.V[at], drawn.faces, counts), on, at


def cut_sample(sample: Mesh, vertices: npt.NDArray[np.integer], creases: Integers, count: int) -> Mesh:
    """The sample with those creases of the mesh, of ``count`` vertices, that lie in it."""
    number = np.full(count, -1, dtype=np.int32)
    number[vertices] = np.arange(len(vertices), dtype=np.int32)
    among = number[creases]
    # patches need not have a face at every edge between two of their vertices
    sides = np.concatenate([sample.F[:, [0, 1]], sample.F[:, [1, 2]], sample.F[:, [2, 0]]])
    n = len(vertices)
    keys, wanted = (np.sort(x, axis=1).astype(np.int64) @ np.array([n, 1]) for x in (sides, among))
    return with_creases(sample, among[(among >= 0).all(axis=1) & np.isin(wanted, keys)])

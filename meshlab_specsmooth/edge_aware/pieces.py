"""The part of a mesh that the search runs on."""

from __future__ import annotations

import numpy as np

from meshlab_specsmooth.edge_aware.mesh import Mesh, built
from meshlab_specsmooth.noise import Sheet, sheet
from meshlab_specsmooth.patches import WHOLE, draw_sample


def sample_of(mesh: Mesh) -> tuple[Mesh, Sheet]:
    """The mesh where it is small, else patches of it, in an order that its own order has no part in; and its sheet.

    In patches, what is near their rims does not count.
    """
    prepared = mesh.isotropic
    drawn = draw_sample(mesh.V[prepared.moving], prepared.faces, prepared.L, mesh.counts[prepared.moving])
    at = prepared.moving[drawn.vertices]
    on = sheet(mesh.V[at], drawn.faces, mesh.counts[at])
    counts = mesh.counts[at] if len(mesh.V) <= WHOLE else on.inner
    return built(mesh.V[at], drawn.faces, np.asarray(counts)), on

"""The boundary of an open surface as a curve with operators of its own, and weights that fade out inside a region."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

from meshlab_specsmooth.arrays import Booleans, Floats, Integers
from meshlab_specsmooth.graph.build import from_edges
from meshlab_specsmooth.graph.laplacian import Laplacian, laplacian, neighbors_of
from meshlab_specsmooth.operators.barycenters import Gram

#: Number of rings of edges over which a displacement rises from zero at the border of a mask to all of it.
BLENDING_RINGS = 4


@dataclass(frozen=True, eq=False)
class BoundaryCurve:
    """The boundary of a surface as a graph: its vertices, and segments in place of faces.

    Attributes
    ----------
    vertices : (k,) int32
        Indices of the boundary's vertices.
    L : Laplacian
        Uniform Laplacian of the curve: each vertex less the mean of its neighbors along the boundary.
    gram : Gram
        C^T C of the segments' midpoints.
    mean_edge : float
        Mean length of the segments, in the units of the positions.
    length : (k, 1) float64
        Length of the curve that each vertex lies on, in the units of the positions.
    """

    vertices: Integers
    L: Laplacian
    gram: Gram
    mean_edge: float
    length: Floats


def boundary_curve(positions: Floats, segments: Integers) -> BoundaryCurve | None:
    """The curve of the segments, (b, 2) each once; None for a closed surface."""
    if len(segments) == 0:
        return None
    vertices, local = np.unique(segments, return_inverse=True)
    local = local.reshape(-1, 2)
    k, m = len(vertices), len(local)
    L = laplacian(from_edges(k, local.astype(np.int32), np.ones(m)))
    # each midpoint is half of either end: a quarter at every segment, and for each segment at a vertex
    gram = Gram(L.degree / 4, 1 / 4, csr_array((k, k)))
    segment_length = np.linalg.norm(positions[segments[:, 0]] - positions[segments[:, 1]], axis=1)
    _, curve = connected_components(L.graph.adjacency(), directed=False)
    length = np.bincount(curve[local[:, 0]], weights=segment_length)[curve]
    return BoundaryCurve(vertices.astype(np.int32), L, gram, float(segment_length.mean()), length[:, None])


def extend_to_boundary(L: Laplacian, delta: Floats, boundary: Integers) -> None:
    """Replace the differential coordinates at the boundary, which are one-sided, by the means of those next to it.

    A low-pass spreads them into the interior: with the given ones it would pull the surface toward the boundary, and
    with zeros it would flatten it there.

    Parameters
    ----------
    L : Laplacian
    delta : (n, 3) float64
        Changed in place.
    boundary : (b,) int32
    """
    if len(boundary) == 0:
        return
    is_inner = np.ones(L.size, dtype=np.bool_)
    is_inner[boundary] = False
    row, neighbor = neighbors_of(L, boundary)
    row, neighbor = row[is_inner[neighbor]], neighbor[is_inner[neighbor]]
    count = np.bincount(row, minlength=len(boundary))
    sums = [np.bincount(row, weights=column, minlength=len(boundary)) for column in delta[neighbor].T]
    delta[boundary] = np.stack(sums, axis=1) / np.maximum(count, 1)[:, None]


def blend(L: Laplacian, mask: Floats) -> Floats:
    """Weights that are 0 where the mask is, and rise to 1 over :data:`BLENDING_RINGS` rings inside of it."""
    reach = L.graph.adjacency(np.ones(len(L.graph.indices)))
    return fade(mask > 0, lambda inside: inside & (reach @ (~inside).astype(np.float64) == 0))


def fade(inside: Booleans, erode: Callable[[Booleans], Booleans]) -> Floats:
    """The same, given a function that removes the vertices with a neighbor outside from a set."""
    depth = inside.astype(np.float64)
    for _ in range(BLENDING_RINGS - 1):
        inside = erode(inside)
        depth += inside
    # 1, 2, ... rings from the border; smoothstep has no kink at either end
    t = depth / BLENDING_RINGS
    return np.asarray(t * t * (3 - 2 * t))

"""Creases: edges with a large dihedral angle, and the surface and the graph of faces cut along them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from meshlab_specsmooth.arrays import Booleans, Floats, Integers
from meshlab_specsmooth.graph.backend import face_graph
from meshlab_specsmooth.graph.face_adjacency import FaceGraph


@dataclass(frozen=True, eq=False)
class Cut:
    """A surface cut along creases.

    The faces around a vertex that are connected through edges other than creases form a sector. A vertex with several
    sectors is split into one vertex for each.

    Attributes
    ----------
    edges : (k, 2) int32
        The creases.
    on : (n,) bool
        Whether each vertex is an end of a crease.
    corners : (m, 3) int32
        The faces of the cut surface; its first n vertices are those of the surface.
    origin : (n',) int32
        The vertex of the surface that each vertex of the cut surface came from.
    """

    edges: Integers
    on: Booleans
    corners: Integers
    origin: Integers


@dataclass(frozen=True, eq=False)
class Halfedges:
    """The halfedges of all faces, sorted by edge; halfedge k of face f runs from its corner k to the next.

    Attributes
    ----------
    key : (s,) int64
        The edge, as from :func:`edge_keys`, ascending.
    face, corner : (s,) int
    """

    key: npt.NDArray[np.int64]
    face: npt.NDArray[np.int64]
    corner: npt.NDArray[np.int64]


def edge_keys(pairs: npt.NDArray[np.integer], n: int) -> npt.NDArray[np.int64]:
    """(k,) a number for each edge between n vertices, independent of the order of its ends."""
    ends = np.asarray(pairs, dtype=np.int64)
    return np.asarray(ends.min(axis=1) * n + ends.max(axis=1))


def sort_halfedges(corners: Integers, n: int) -> Halfedges:
    """Sort the halfedges of faces on n vertices by edge, without those from a vertex to itself."""
    first, second = corners.ravel(), np.roll(corners, -1, axis=1).ravel()
    at = np.flatnonzero(first != second)
    key = edge_keys(np.stack([first[at], second[at]], axis=1), n)
    order = np.argsort(key, kind="stable")
    return Halfedges(key[order], at[order] // 3, at[order] % 3)


def _is_among(numbers: npt.NDArray[np.int64], few: npt.NDArray[np.int64]) -> Booleans:
    """Whether each number is in a short list; faster than sorting all of them, as ``np.isin`` does."""
    if len(few) == 0:
        return np.zeros(len(numbers), dtype=np.bool_)
    few = np.sort(few)
    at = np.searchsorted(few, numbers)
    return np.asarray(few[np.minimum(at, len(few) - 1)] == numbers)


def find_creases(corners: Integers, normal: Floats, n: int, angle: float) -> Integers:
    """Find the edges, (k, 2), at which the unit normals of the faces differ by more than an angle in degrees.

    Two faces that traverse their edge in the same direction are oriented oppositely: one of them is treated as flipped.
    A face without a normal makes no crease.
    """
    halfedges = sort_halfedges(corners, n)
    same = np.flatnonzero(halfedges.key[1:] == halfedges.key[:-1])
    f, g = halfedges.face[same], halfedges.face[same + 1]
    starts = [corners[face, halfedges.corner[at]] for face, at in ((f, same), (g, same + 1))]
    cosine = (normal[f] * normal[g]).sum(axis=1) * np.where(starts[0] == starts[1], -1.0, 1.0)
    has_normals = (normal[f] != 0).any(axis=1) & (normal[g] != 0).any(axis=1)
    found = np.unique(halfedges.key[same[has_normals & (cosine < np.cos(np.deg2rad(angle)))]])
    return np.stack([found // n, found % n], axis=1).astype(np.int32)


def cut_along(corners: Integers, n: int, edges: Integers) -> Cut:
    """Cut the surface along some of its edges."""
    on = np.zeros(n, dtype=np.bool_)
    on[edges] = True
    halfedges = sort_halfedges(corners, n)
    # a slot is a corner of a face; the slots of a vertex are linked through edges that are not creases
    here = 3 * halfedges.face + halfedges.corner
    there = 3 * halfedges.face + (halfedges.corner + 1) % 3
    vertex = corners.ravel()
    reverse = vertex[here] > vertex[there]
    low, high = np.where(reverse, there, here), np.where(reverse, here, there)
    linked = (halfedges.key[1:] == halfedges.key[:-1]) & ~_is_among(halfedges.key[1:], edge_keys(edges, n))
    at = np.flatnonzero(linked)
    # slots of one face at the same vertex
    first, second = np.arange(3 * len(corners)), np.roll(np.arange(3 * len(corners)).reshape(-1, 3), -1, axis=1).ravel()
    twice = vertex[first] == vertex[second]
    ends = [(low[at], low[at + 1]), (high[at], high[at + 1]), (first[twice], second[twice])]
    i, j = (np.concatenate(column) for column in zip(*ends, strict=True))
    links = coo_array((np.ones(len(i), dtype=np.bool_), (i, j)), shape=(len(vertex), len(vertex)))
    _, sector = connected_components(links, directed=False)

    slots = np.flatnonzero(on[vertex])
    sectors, first_slot, number = np.unique(sector[slots], return_index=True, return_inverse=True)
    owner = vertex[slots[first_slot]]
    by_owner = np.argsort(owner, kind="stable")
    is_first = np.ones(len(sectors), dtype=np.bool_)
    is_first[by_owner[1:]] = owner[by_owner[1:]] != owner[by_owner[:-1]]
    name = np.where(is_first, owner, n + np.cumsum(~is_first) - 1)
    renamed = vertex.copy()
    renamed[slots] = name[number]
    origin = np.concatenate([np.arange(n), owner[~is_first]]).astype(np.int32)
    return Cut(edges, on, renamed.reshape(-1, 3), origin)


def cut_graph(corners: Integers, n: int, cut: Cut) -> FaceGraph:
    """Build the graph of faces in which faces on opposite sides of a crease are not neighbors.

    Two faces are neighbors if they share a sector of a vertex and no crease.
    """
    whole, parted = face_graph(corners, n), face_graph(cut.corners, len(cut.origin))
    m = len(corners)
    halfedges = sort_halfedges(corners, n)
    at_crease = _is_among(halfedges.key, edge_keys(cut.edges, n))
    key, face = halfedges.key[at_crease], halfedges.face[at_crease]
    # all pairs of the faces at each crease: two faces, except at non-manifold edges
    begin = np.searchsorted(key, key)
    count = np.searchsorted(key, key, side="right") - begin
    offset = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)
    across = np.repeat(face, count) * m + face[np.repeat(begin, count) + offset]
    rows = np.repeat(np.arange(m), np.diff(parted.indptr))
    touching = np.zeros(m, dtype=np.bool_)
    touching[face] = True
    asked = np.flatnonzero(touching[rows] & touching[parted.indices])
    kept = np.ones(len(rows), dtype=np.bool_)
    kept[asked] = ~_is_among(rows[asked] * m + parted.indices[asked], across)
    indptr = np.zeros(m + 1, dtype=np.int32)
    np.cumsum(np.bincount(rows[kept], minlength=m), out=indptr[1:])
    return FaceGraph(corners, indptr, parted.indices[kept], whole.vertex_indptr, whole.vertex_faces)

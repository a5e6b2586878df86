"""Edges that nothing crosses: which they are, and the surface and the graph of faces cut along them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from meshlab_specsmooth.arrays import Booleans, Floats, Integers
from meshlab_specsmooth.graph.faces import FaceGraph, face_graph


@dataclass(frozen=True, eq=False)
class Cut:
    """A surface cut along creases.

    Around a vertex, faces that are linked through edges that are no creases form a sector; a vertex with several
    sectors becomes as many vertices.

    Attributes
    ----------
    edges : (k, 2) int32
        The creases.
    on : (n,) bool
        Vertices at the end of a crease.
    corners : (m, 3) int32
        The faces, a vertex for each sector: the first n are those of the surface.
    origin : (n',) int32
        The vertex of the surface that each vertex of ``corners`` stands for.
    """

    edges: Integers
    on: Booleans
    corners: Integers
    origin: Integers


@dataclass(frozen=True, eq=False)
class Sides:
    """The sides of all faces, sorted by edge; side k of face f runs from its corner k to the next.

    Attributes
    ----------
    key : (s,) int64
        The edge, as :func:`keys_of` has it; rising.
    face, corner : (s,) int
    """

    key: npt.NDArray[np.int64]
    face: npt.NDArray[np.int64]
    corner: npt.NDArray[np.int64]


def keys_of(pairs: npt.NDArray[np.integer], n: int) -> npt.NDArray[np.int64]:
    """(k,) one number for each edge among n vertices, whatever the order of its ends."""
    ends = np.asarray(pairs, dtype=np.int64)
    return np.asarray(ends.min(axis=1) * n + ends.max(axis=1))


def sides_of(corners: Integers, n: int) -> Sides:
    """The sides of faces on n vertices, without those between a vertex and itself."""
    first, second = corners.ravel(), np.roll(corners, -1, axis=1).ravel()
    at = np.flatnonzero(first != second)
    key = keys_of(np.stack([first[at], second[at]], axis=1), n)
    order = np.argsort(key, kind="stable")
    return Sides(key[order], at[order] // 3, at[order] % 3)


def _is_among(numbers: npt.NDArray[np.int64], few: npt.NDArray[np.int64]) -> Booleans:
    """Whether each number is one of a few; faster than sorting them all."""
    if len(few) == 0:
        return np.zeros(len(numbers), dtype=np.bool_)
    few = np.sort(few)
    at = np.searchsorted(few, numbers)
    return np.asarray(few[np.minimum(at, len(few) - 1)] == numbers)


def find_creases(corners: Integers, normal: Floats, n: int, angle: float) -> Integers:
    """(k, 2) edges whose faces' unit normals differ by more than an angle in degrees.

    Faces that run along their edge in the same direction look to opposite sides: one of them counts as turned. A face
    without a normal makes no crease.
    """
    sides = sides_of(corners, n)
    same = np.flatnonzero(sides.key[1:] == sides.key[:-1])
    f, g = sides.face[same], sides.face[same + 1]
    starts = [corners[face, sides.corner[at]] for face, at in ((f, same), (g, same + 1))]
    cosine = (normal[f] * normal[g]).sum(axis=1) * np.where(starts[0] == starts[1], -1.0, 1.0)
    has_normals = (normal[f] != 0).any(axis=1) & (normal[g] != 0).any(axis=1)
    found = np.unique(sides.key[same[has_normals & (cosine < np.cos(np.deg2rad(angle)))]])
    return np.stack([found // n, found % n], axis=1).astype(np.int32)


def cut_along(corners: Integers, n: int, edges: Integers) -> Cut:
    """The surface cut along some of its edges."""
    on = np.zeros(n, dtype=np.bool_)
    on[edges] = True
    sides = sides_of(corners, n)
    # a slot is a corner of a face; slots of one vertex are linked through edges that are no creases
    here = 3 * sides.face + sides.corner
    there = 3 * sides.face + (sides.corner + 1) % 3
    vertex = corners.ravel()
    turned = vertex[here] > vertex[there]
    low, high = np.where(turned, there, here), np.where(turned, here, there)
    linked = (sides.key[1:] == sides.key[:-1]) & ~_is_among(sides.key[1:], keys_of(edges, n))
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
    """The graph of faces in which faces on opposite sides of a crease are no neighbors.

    Faces are neighbors that share a sector of a vertex, but not those that share a crease.
    """
    whole, parted = face_graph(corners, n), face_graph(cut.corners, len(cut.origin))
    m = len(corners)
    sides = sides_of(corners, n)
    at_crease = _is_among(sides.key, keys_of(cut.edges, n))
    key, face = sides.key[at_crease], sides.face[at_crease]
    # all pairs of the faces at each crease, of which there are two but for edges of three faces and more
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

"""Exact signed distances from points to a triangle surface."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from meshlab_specsmooth.arrays import Floats, Integers
from meshlab_specsmooth.comparison.distances import nearest_faces
from meshlab_specsmooth.geometry.surface import Surface
from meshlab_specsmooth.geometry.triangles import compute_face_vectors, normalize_rows, number_edges, sum_at_corners
from meshlab_specsmooth.geometry.welding import find_copies
from meshlab_specsmooth.operators.assemble import find_referenced_vertices

_NEXT = (1, 2, 0)


def signed_distances(points: Floats, surface: Surface) -> Floats:
    """Return the distance of each point to the nearest point of a surface, positive on the side of the normals.

    The sign is that of the angle-weighted pseudonormal at the nearest point, which is exact for closed surfaces also
    where that point is on an edge or a vertex. Vertices at the same place count as one.

    Parameters
    ----------
    points : (k, 3) float64
        In mesh units.
    surface : Surface

    Returns
    -------
    (k,) float64
        In mesh units.

    References
    ----------
    J. A. Baerentzen and H. Aanaes, Signed distance computation using the angle weighted pseudonormal, 2005.

    Examples
    --------
    >>> import numpy as np
    >>> import meshlab_specsmooth as mss
    >>> from meshlab_specsmooth.comparison.signed_distances import signed_distances
    >>> triangle = mss.Surface([[0, 0, 0], [4, 0, 0], [0, 4, 0]], [[0, 1, 2]])
    >>> signed_distances(np.array([[1.0, 1, 3], [1, 1, -2], [-3, -4, 0]]), triangle).tolist()
    [3.0, -2.0, 5.0]
    """
    off, at = nearest_faces(points, surface)
    corners = surface.vertices[surface.faces[at]]
    weights = find_nearest_points(points, corners)
    nearest = np.einsum("kc,kcx->kx", weights, corners)
    normals = find_pseudonormals(surface, at, weights)
    along = np.einsum("kx,kx->k", points - nearest, normals)
    return np.asarray(np.where(along < 0, -off, off))


def find_nearest_points(points: Floats, corners: Floats) -> Floats:
    """Return the barycentric coordinates of the nearest point of each triangle, exactly zero on its border.

    Parameters
    ----------
    points : (k, 3) float64
    corners : (k, 3, 3) float64

    Returns
    -------
    (k, 3) float64
    """
    best, weights = np.full(len(points), np.inf), np.zeros((len(points), 3))
    for start, end in enumerate(_NEXT):
        along, off = corners[:, end] - corners[:, start], points - corners[:, start]
        squared = np.einsum("ij,ij->i", along, along)
        fraction = np.clip(np.einsum("ij,ij->i", off, along) / np.where(squared > 0, squared, 1), 0, 1)
        rest = off - fraction[:, None] * along
        distance = np.einsum("ij,ij->i", rest, rest)
        nearer = distance < best
        best[nearer] = distance[nearer]
        weights[nearer] = 0
        weights[nearer, start], weights[nearer, end] = 1 - fraction[nearer], fraction[nearer]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    squared = np.einsum("ij,ij->i", normal, normal)
    opposite = [
        np.einsum("ij,ij->i", np.cross(corners[:, _NEXT[k]] - corners[:, k], points - corners[:, k]), normal)
        for k in range(3)
    ]
    inside = np.stack([opposite[1], opposite[2], opposite[0]], axis=1)
    is_inside = (inside > 0).all(axis=1) & (squared > 0)
    weights[is_inside] = inside[is_inside] / inside[is_inside].sum(axis=1, keepdims=True)
    return weights


def find_pseudonormals(surface: Surface, at: npt.NDArray[np.int64], weights: Floats) -> Floats:
    """Return normals at points of faces: of the face inside, else of the edge or of the vertex, whichever it is on.

    Parameters
    ----------
    surface : Surface
    at : (k,) int
        The face of each point.
    weights : (k, 3) float64
        Its barycentric coordinates in this face.

    Returns
    -------
    (k, 3) float64
        Their lengths have no meaning.
    """
    V, F = surface.vertices, surface.faces
    copies = find_copies(V, find_referenced_vertices(F, len(V)))
    F = F if copies is None else copies[F]
    unit = normalize_rows(compute_face_vectors(V, F))
    normals = unit[at]
    on = np.count_nonzero(weights, axis=1)
    at_vertex, at_edge = np.flatnonzero(on == 1), np.flatnonzero(on == 2)
    if len(at_vertex):
        of_vertex = _sum_at_vertices(V, F, unit)
        normals[at_vertex] = of_vertex[F[at[at_vertex], weights[at_vertex].argmax(axis=1)]]
    if len(at_edge):
        opposite = (weights[at_edge] == 0).argmax(axis=1)
        normals[at_edge] = _sum_at_edges(F, unit)[at[at_edge], opposite]
    return normals


def _sum_at_vertices(V: Floats, F: Integers, unit: Floats) -> Floats:
    """(n, 3) sums of the normals of the faces around each vertex, weighted by their angles there."""
    angles = []
    for k in range(3):
        a = normalize_rows(V[F[:, _NEXT[k]]] - V[F[:, k]])
        b = normalize_rows(V[F[:, _NEXT[_NEXT[k]]]] - V[F[:, k]])
        angles.append(np.arccos(np.clip(np.einsum("ij,ij->i", a, b), -1, 1)))
    found = np.zeros((len(V), 3))
    for k, angle in enumerate(angles):
        for axis in range(3):
            found[:, axis] += np.bincount(F[:, k], angle * unit[:, axis], len(V))
    return found


def _sum_at_edges(F: Integers, unit: Floats) -> Floats:
    """(m, 3, 3) sums of the normals of the faces at the edge opposite each corner."""
    edges, edge = number_edges(F, int(F.max()) + 1)
    return sum_at_corners(unit, edge, len(edges))[edge[:, [1, 2, 0]]]

"""Measures of a surface by itself: angles, triangles, area, boundary."""

from __future__ import annotations

import numpy as np

from meshlab_specsmooth.arrays import Integers
from meshlab_specsmooth.geometry.surface import Surface, edges, face_vectors


def dihedral_deviation(surface: Surface) -> float:
    """Mean angle in degrees between the normals of faces that share an edge: 0 for a plane.

    Examples
    --------
    >>> import meshlab_specsmooth as mss
    >>> from meshlab_specsmooth.comparison.shape import dihedral_deviation
    >>> bent = mss.Surface([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], [[0, 1, 2], [1, 0, 3]])
    >>> round(dihedral_deviation(bent), 6)
    90.0
    """
    F, n = surface.faces, len(surface.vertices)
    halves = np.sort(np.concatenate([F[:, [0, 1]], F[:, [1, 2]], F[:, [2, 0]]]), axis=1)
    keys, face = halves[:, 0].astype(np.int64) * n + halves[:, 1], np.tile(np.arange(len(F)), 3)
    order = np.argsort(keys, kind="stable")
    keys, face = keys[order], face[order]
    same = np.flatnonzero(keys[1:] == keys[:-1])
    normals = face_vectors(surface)
    a, b = normals[face[same]], normals[face[same + 1]]
    proper = (np.linalg.norm(a, axis=1) > 0) & (np.linalg.norm(b, axis=1) > 0)
    if not proper.any():
        return 0.0
    a, b = a[proper], b[proper]
    return float(np.degrees(np.arctan2(np.linalg.norm(np.cross(a, b), axis=1), (a * b).sum(axis=1))).mean())


def triangle_quality(surface: Surface) -> float:
    """Mean of 2 r / R, inscribed by circumscribed radius: 1 for equilateral triangles, 0 for degenerate ones.

    Examples
    --------
    >>> import meshlab_specsmooth as mss
    >>> from meshlab_specsmooth.comparison.shape import triangle_quality
    >>> round(triangle_quality(mss.Surface([[0, 0, 0], [1, 0, 0], [0.5, 0.75**0.5, 0]], [[0, 1, 2]])), 9)
    1.0
    """
    V, F = surface.vertices, surface.faces
    a, b, c = (np.linalg.norm(V[F[:, i]] - V[F[:, j]], axis=1) for i, j in ((1, 2), (2, 0), (0, 1)))
    # 2 r / R = 8 (s - a) (s - b) (s - c) / (a b c) = (b + c - a) (c + a - b) (a + b - c) / (a b c)
    product = a * b * c
    above = (b + c - a) * (c + a - b) * (a + b - c)
    return float(np.divide(above, product, out=np.zeros_like(above), where=product > 0).mean())


def area(surface: Surface) -> float:
    """Area of all faces, in squared mesh units."""
    return float(np.linalg.norm(face_vectors(surface), axis=1).sum()) / 2


def boundary_length(surface: Surface) -> float:
    """Total length of the boundary edges, in mesh units; 0 for a closed surface."""
    a, b = surface.vertices[boundary_edges(surface)].transpose(1, 0, 2)
    return float(np.linalg.norm(a - b, axis=1).sum())


def boundary_edges(surface: Surface) -> Integers:
    """Return the (k, 2) ends of the edges that have one face only."""
    ends, face_count = edges(surface)
    return np.asarray(ends[face_count == 1])

"""Measures of a surface by itself, and errors of a result against the true surface, as the literature defines them."""

from __future__ import annotations

import numpy as np

from meshlab_specsmooth.arrays import Floats, Integers
from meshlab_specsmooth.comparison.distances import distances
from meshlab_specsmooth.geometry.surface import Surface, edges, face_vectors, is_closed, mean_edge_length, signed_volume


def normal_error(result: Surface, truth: Surface) -> float:
    """Mean angle in degrees between corresponding face normals of two surfaces with the same faces.

    Faces that are degenerate in the truth are excluded; faces that are degenerate in the result count as 90 degrees
    (Zhang et al., *Guided mesh normal filtering*, 2015).

    Examples
    --------
    >>> import meshlab_specsmooth as mss
    >>> from meshlab_specsmooth.comparison.metrics import normal_error
    >>> flat = mss.Surface([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    >>> tilted = mss.Surface([[0, 0, 0], [1, 0, 0], [0, 1, 1]], [[0, 1, 2]])
    >>> round(normal_error(tilted, flat), 6)
    45.0
    """
    a, b = face_vectors(result), face_vectors(truth)
    known = np.linalg.norm(b, axis=1) > 0
    a, b = a[known], b[known]
    # arctan2 of sine and cosine: the arc cosine of a rounded cosine is accurate to 1e-6 degrees only
    sine, cosine = np.linalg.norm(np.cross(a, b), axis=1), (a * b).sum(axis=1)
    angle = np.degrees(np.arctan2(sine, cosine))
    angle[np.linalg.norm(a, axis=1) == 0] = 90.0
    return float(angle.mean())


def vertex_error(result: Surface, truth: Surface) -> float:
    """Root mean square distance of corresponding vertices, in mean edges of the truth, tangential drift included."""
    squared = ((result.vertices - truth.vertices) ** 2).sum(axis=1)
    return float(np.sqrt(squared.mean())) / mean_edge_length(truth)


def surface_error(result: Surface, truth: Surface) -> float:
    """E_v of the literature: distance of the vertices of the result to the true surface, in mean edges of the truth.

    sqrt(sum_i A_i d_i^2 / (3 sum_f A_f)) / h, with d_i the exact distance of vertex i to the truth, A_i the area of the
    result's faces at i and h the truth's mean edge (Sun, Rosin, Martin, Langbein, *Fast and effective
    feature-preserving mesh denoising*, 2007; Zheng, Fu, Au, Tai, *Bilateral normal filtering for mesh denoising*,
    2011). Movement along the surface does not count, and the faces need not correspond.

    Examples
    --------
    >>> import meshlab_specsmooth as mss
    >>> from meshlab_specsmooth.comparison.metrics import surface_error
    >>> square, F = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]]
    >>> lifted = [[x, y, 0.1] for x, y, _ in square]
    >>> h = (4 + 2**0.5) / 5
    >>> round(surface_error(mss.Surface(lifted, F), mss.Surface(square, F)) * h, 9)
    0.1
    """
    return root_mean_square(distances(result.vertices, truth), result) / mean_edge_length(truth)


def root_mean_square(values: Floats, surface: Surface) -> float:
    """Root mean square of (n,) values, sqrt(sum_i A_i x_i^2 / (3 sum_f A_f)), with A_i the area of the faces at i."""
    areas = np.linalg.norm(face_vectors(surface), axis=1)
    at_vertex = np.bincount(surface.faces.ravel(), weights=np.repeat(areas, 3), minlength=len(surface.vertices))
    return float(np.sqrt((at_vertex * values**2).sum() / (3 * areas.sum())))


def flipped(result: Surface, truth: Surface) -> float:
    """Percentage of faces whose normal differs by more than 90 degrees from that of the same face in the truth.

    Faces that are degenerate in the truth are excluded; faces that are degenerate in the result do not count as
    flipped.

    Examples
    --------
    >>> import meshlab_specsmooth as mss
    >>> from meshlab_specsmooth.comparison.metrics import flipped
    >>> square, F = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]]
    >>> folded = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0.9, 0.1, 0]]
    >>> flipped(mss.Surface(folded, F), mss.Surface(square, F))
    50.0
    """
    a, b = face_vectors(result), face_vectors(truth)
    known = np.linalg.norm(b, axis=1) > 0
    return 100 * float(np.mean((a[known] * b[known]).sum(axis=1) < 0))


def volume_change(result: Surface, truth: Surface) -> float:
    """Change of the enclosed volume of a closed surface in per cent; negative for shrinkage."""
    before = signed_volume(truth)
    return 100 * (signed_volume(result) - before) / abs(before)


def measure_errors(result: Surface, truth: Surface) -> dict[str, float]:
    """Return all errors of a result that need no search for nearest points, by the keys of the comparison's columns.

    The change of volume is left out for open surfaces.
    """
    errors = {
        "normal_error": normal_error(result, truth),
        "vertex_error": vertex_error(result, truth),
        "flips": flipped(result, truth),
    }
    if has_volume(truth):
        errors["volume"] = volume_change(result, truth)
    return errors


def has_volume(surface: Surface) -> bool:
    """Whether a surface is closed and encloses a volume."""
    return is_closed(surface) and signed_volume(surface) != 0


def dihedral_deviation(surface: Surface) -> float:
    """Mean angle in degrees between the normals of faces that share an edge: 0 for a plane.

    Examples
    --------
    >>> import meshlab_specsmooth as mss
    >>> from meshlab_specsmooth.comparison.metrics import dihedral_deviation
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
    >>> from meshlab_specsmooth.comparison.metrics import triangle_quality
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

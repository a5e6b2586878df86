"""Errors of a result against the true surface, as the denoising literature defines them."""

from __future__ import annotations

import numpy as np

from meshlab_specsmooth.arrays import Floats
from meshlab_specsmooth.comparison.distances import distances
from meshlab_specsmooth.geometry.surface import Surface, face_vectors, is_closed, mean_edge_length, signed_volume


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

"""How far a result is from the true surface, in the definitions of the denoising literature."""

from __future__ import annotations

import numpy as np

from meshlab_specsmooth.arrays import Floats
from meshlab_specsmooth.comparison.distances import distances
from meshlab_specsmooth.geometry.surface import Surface, face_vectors, mean_edge_length, signed_volume


def normal_error(result: Surface, truth: Surface) -> float:
    """Mean angle in degrees between the face normals of both, the faces being the same.

    Faces that are degenerate in the truth are left out, those that are degenerate in the result count as 90 degrees
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
    # the angle by its tangent: the arc cosine of a rounded cosine is only good to 1e-6 degrees
    sine, cosine = np.linalg.norm(np.cross(a, b), axis=1), (a * b).sum(axis=1)
    angle = np.degrees(np.arctan2(sine, cosine))
    angle[np.linalg.norm(a, axis=1) == 0] = 90.0
    return float(angle.mean())


def vertex_error(result: Surface, truth: Surface) -> float:
    """Root mean square distance of corresponding vertices, in mean edges of the truth; tangential drift counts."""
    squared = ((result.vertices - truth.vertices) ** 2).sum(axis=1)
    return float(np.sqrt(squared.mean())) / mean_edge_length(truth)


def surface_error(result: Surface, truth: Surface) -> float:
    """The literature's E_v: distance of the result's vertices to the true surface, in mean edges of the truth.

    sqrt(sum_i A_i d_i^2 / (3 sum_f A_f)) / h, with d_i the exact distance of vertex i to the truth, A_i the area of the
    result's faces at i and h the truth's mean edge (Sun, Rosin, Martin, Langbein, *Fast and effective
    feature-preserving mesh denoising*, 2007; Zheng, Fu, Au, Tai, *Bilateral normal filtering for mesh denoising*,
    2011). Drift along the surface does not count, and the faces of both need not correspond.

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
    """Root mean square of a value a vertex, sqrt(sum_i A_i x_i^2 / (3 sum_f A_f)), A_i the area of the faces at i."""
    areas = np.linalg.norm(face_vectors(surface), axis=1)
    at_vertex = np.bincount(surface.faces.ravel(), weights=np.repeat(areas, 3), minlength=len(surface.vertices))
    return float(np.sqrt((at_vertex * values**2).sum() / (3 * areas.sum())))


def flipped(result: Surface, truth: Surface) -> float:
    """Faces turned by more than a right angle against the truth (or any other state of the same faces), in per cent.

    Faces that are degenerate in either are not counted as turned, and those of the truth not at all.

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
    """Change of the enclosed volume in per cent; negative for shrinkage. For closed surfaces."""
    before = signed_volume(truth)
    return 100 * (signed_volume(result) - before) / abs(before)


def add_noise(surface: Surface, level: float, seed: int) -> Floats:
    """The vertices with Gaussian noise on every coordinate.

    Parameters
    ----------
    surface : Surface
    level : float
        Standard deviation in mean edge lengths.
    seed : int
        The same seed gives the same noise.
    """
    noise = np.random.default_rng(seed).standard_normal(surface.vertices.shape)
    return surface.vertices + level * mean_edge_length(surface) * noise

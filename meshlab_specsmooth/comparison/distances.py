"""Exact distances from points to a triangle surface."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.spatial import cKDTree

from meshlab_specsmooth.arrays import Floats
from meshlab_specsmooth.geometry.surface import Surface

# Nearest centroids in the first query, and point-triangle pairs handled at once, about 200 bytes each
_FIRST_NEIGHBORS = 16
_BATCH = 2**19


def distances(points: Floats, surface: Surface) -> Floats:
    """Return the distance of each point to the nearest point of a surface, exact up to rounding.

    A triangle lies within its radius, the distance to its furthest corner, of its centroid. It can be excluded if its
    centroid is further away than the smallest distance found so far plus this radius. Triangles are searched in classes
    of radii that differ by a factor of two at most, nearest centroids first, until the rest of a class is excluded. So
    the result is exact for triangles of any shape.

    Parameters
    ----------
    points : (k, 3) float64
        In mesh units.
    surface : Surface
        Degenerate faces count as segments or points.

    Returns
    -------
    (k,) float64
        In mesh units.

    Examples
    --------
    >>> import numpy as np
    >>> import meshlab_specsmooth as mss
    >>> from meshlab_specsmooth.comparison.distances import distances
    >>> triangle = mss.Surface([[0, 0, 0], [4, 0, 0], [0, 4, 0]], [[0, 1, 2]])
    >>> distances(np.array([[1.0, 1, 3], [-3, -4, 0], [9, 0, 0]]), triangle).tolist()
    [3.0, 5.0, 5.0]
    """
    return nearest_faces(points, surface)[0]


def nearest_faces(points: Floats, surface: Surface) -> tuple[Floats, npt.NDArray[np.int64]]:
    """Return the distances as :func:`distances` does, and the index of a face at this distance.

    Examples
    --------
    >>> import numpy as np
    >>> import meshlab_specsmooth as mss
    >>> from meshlab_specsmooth.comparison.distances import nearest_faces
    >>> strip = mss.Surface([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    >>> off, at = nearest_faces(np.array([[0.9, 0.2, 2], [0.1, 0.8, 3]]), strip)
    >>> off.tolist(), at.tolist()
    ([2.0, 3.0], [0, 1])
    """
    points = np.ascontiguousarray(points, dtype=np.float64)
    corners = surface.vertices[surface.faces]
    centroids = corners.mean(axis=1)
    radii = np.linalg.norm(corners - centroids[:, None], axis=2).max(axis=1)
    best, at = np.full(len(points), np.inf), np.zeros(len(points), dtype=np.int64)
    _, size, count = np.unique(np.frexp(radii)[1], return_inverse=True, return_counts=True)
    # the largest class first: its distances exclude most of the others
    for number in np.argsort(-count, kind="stable"):
        members = np.flatnonzero(size.reshape(-1) == number)
        _improve(best, at, points, _Class(members, corners[members], centroids[members], radii[members]))
    return np.asarray(np.sqrt(best)), at


@dataclass(frozen=True, eq=False)
class _Class:
    """Triangles of similar size: indices (m,), corners (m, 3, 3), centroids (m, 3) and radii (m,)."""

    index: npt.NDArray[np.int64]
    corners: Floats
    centroids: Floats
    radii: Floats


def _improve(best: Floats, at: npt.NDArray[np.int64], points: Floats, triangles: _Class) -> None:
    """Reduce the squared distances ``best`` to those from a class of triangles, and set the faces ``at`` them."""
    tree, count, radius = cKDTree(triangles.centroids), len(triangles.centroids), triangles.radii.max()
    left, seen, wanted = np.arange(len(points)), 0, min(_FIRST_NEIGHBORS, count)
    if np.isfinite(best).all():
        left = left[tree.query(points)[0] - radius < np.sqrt(best)]
    while len(left):
        undecided = []
        step = max(1, _BATCH // wanted)
        for start in range(0, len(left), step):
            rows = left[start : start + step]
            off, found = tree.query(points[rows], k=np.arange(seen + 1, wanted + 1))
            first = squared_distances(points[rows], triangles.corners[found[:, 0]])
            nearer = first < best[rows]
            best[rows[nearer]], at[rows[nearer]] = first[nearer], triangles.index[found[nearer, 0]]
            row, column = np.nonzero(off[:, 1:] - triangles.radii[found[:, 1:]] < np.sqrt(best[rows])[:, None])
            pairs = squared_distances(points[rows[row]], triangles.corners[found[row, column + 1]])
            nearer = pairs < best[rows[row]]
            row, column, pairs = row[nearer], column[nearer], pairs[nearer]
            np.minimum.at(best, rows[row], pairs)
            reached = pairs == best[rows[row]]
            at[rows[row[reached]]] = triangles.index[found[row[reached], column[reached] + 1]]
            undecided.append(rows[off[:, -1] - radius < np.sqrt(best[rows])])
        if wanted == count:
            return
        left, seen, wanted = np.concatenate(undecided), wanted, min(2 * wanted, count)


def squared_distances(points: Floats, corners: Floats) -> Floats:
    """Return the squared distances of points to triangles, pair by pair.

    The nearest point is the foot of the perpendicular if that lies inside, else it is on one of the sides.

    Parameters
    ----------
    points : (..., 3) float64
    corners : (..., 3, 3) float64
        Corners of the triangle of each point; a degenerate triangle has sides but no inside.

    Returns
    -------
    (...,) float64
    """
    a, b, c = corners[..., 0, :], corners[..., 1, :], corners[..., 2, :]
    nearest = np.minimum(_to_segment(points, a, b), np.minimum(_to_segment(points, b, c), _to_segment(points, c, a)))
    normal = np.cross(b - a, c - a)
    squared = (normal * normal).sum(axis=-1)
    inside = squared > 0
    for start, end in ((a, b), (b, c), (c, a)):
        inside &= (np.cross(end - start, points - start) * normal).sum(axis=-1) >= 0
    height = ((points - a) * normal).sum(axis=-1) ** 2
    return np.where(inside, np.minimum(nearest, height / np.where(squared > 0, squared, 1)), nearest)


def _to_segment(points: Floats, start: Floats, end: Floats) -> npt.NDArray[np.float64]:
    along, off = end - start, points - start
    squared = (along * along).sum(axis=-1)
    fraction = (off * along).sum(axis=-1) / np.where(squared > 0, squared, 1)
    rest = off - np.clip(fraction, 0, 1)[..., None] * along
    return np.asarray((rest * rest).sum(axis=-1))

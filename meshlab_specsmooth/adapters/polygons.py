"""Faces of any form as triangles: tables, rows of different lengths, and VTK's padded lists."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from meshlab_specsmooth.errors import InvalidSurface
from meshlab_specsmooth.geometry.surface import check_indices

Indices = npt.NDArray[np.int64]

# Rows [3, a, b, c] are padded triangles of PyVista, unless they could be quads that all contain vertex 3: at most this
# many quads are assumed to meet at a vertex
_MAX_QUADS_AT_A_VERTEX = 12


def as_array(given: Any) -> npt.NDArray[Any] | None:
    """Convert to an array, or return None if that raises anything; the error is reported by :class:`Surface`."""
    try:
        return np.asarray(given)
    except MemoryError:
        raise
    except Exception:
        return None


def triangulate(vertices: Any, faces: Any) -> tuple[Any, Indices | None]:
    """Convert faces of any form to triangles.

    Parameters
    ----------
    vertices : (n, 3) array_like
        Used to split quads along the shorter diagonal.
    faces : array_like
        Triangles, polygons, rows of different lengths, or VTK's padded list.

    Returns
    -------
    triangles : (t, 3) array_like
        The argument itself if it is not recognized as a table of faces; :class:`Surface` reports what is wrong.
    polygons : (t,) int64 or None
        The face that each triangle is a part of; None if the triangles are the faces.
    """
    array = as_array(faces)
    if array is None:
        rows = join_rows(faces)
        return (faces, None) if rows is None else split_polygons(vertices, *rows)
    if array.dtype.kind not in "iu" or array.size == 0 or np.ma.isMaskedArray(faces):
        return faces, None
    if array.ndim == 1:
        found = unpad(array)
        return (faces, None) if found is None else split_polygons(vertices, *found)
    if array.ndim != 2 or array.shape[1] <= 3:
        return array if array.ndim == 2 else faces, None
    if array.shape[1] == 4 and (array[:, 0] == 3).all():
        corners = array[:, 1:]
        if (corners == 3).any() or len(corners) > _MAX_QUADS_AT_A_VERTEX:
            return corners, None
    size = array.shape[1]
    return split_polygons(vertices, array.ravel(), np.arange(len(array) + 1) * size)


def join_rows(faces: Any) -> tuple[Indices, Indices] | None:
    """Concatenate rows of different lengths.

    Returns
    -------
    corners : (k,) int64
    offsets : (m + 1,) int64
        Index of the first corner of each row, and the total number. None instead of both if the faces are not rows.
    """
    if not isinstance(faces, list | tuple | np.ndarray) or len(faces) == 0:
        return None
    rows = [as_array(row) for row in faces]
    if any(row is None or row.ndim != 1 or row.dtype.kind not in "iu" for row in rows):
        return None
    sizes = [len(row) for row in rows if row is not None]
    return np.concatenate([row for row in rows if row is not None]), np.cumsum([0, *sizes])


def unpad(flat: npt.NDArray[Any]) -> tuple[Indices, Indices] | None:
    """Parse VTK's ``[k, a, b, c, ..., k, ...]``; returns corners and offsets as :func:`join_rows`, or None."""
    size = int(flat[0])
    if size > 0 and len(flat) % (size + 1) == 0 and (flat[:: size + 1] == size).all():
        rows = flat.reshape(-1, size + 1)[:, 1:]
        return rows.ravel().astype(np.int64), np.arange(len(rows) + 1) * size
    sizes, numbers, at = list[int](), flat.tolist(), 0
    while at < len(numbers):
        if numbers[at] < 1:
            return None
        sizes.append(numbers[at])
        at += numbers[at] + 1
    if at != len(numbers):
        return None
    offsets = np.cumsum([0, *sizes])
    return np.delete(flat, offsets[:-1] + np.arange(len(sizes))).astype(np.int64), offsets


def split_polygons(vertices: Any, corners: Indices, offsets: Indices) -> tuple[Any, Indices | None]:
    """Split polygons into triangles: quads along the shorter diagonal, larger ones into fans."""
    sizes = np.diff(offsets)
    if (sizes == 3).all():
        return corners.reshape(-1, 3), None
    small = np.flatnonzero(sizes < 3)
    if len(small):
        row = int(small[0])
        raise InvalidSurface("faces", f"has {int(sizes[row])} corners", "remove faces of fewer than 3 corners", row)
    of_face = np.repeat(np.arange(len(sizes)), sizes)
    first = np.zeros(len(sizes), dtype=np.int64)
    V = as_array(vertices)
    if V is not None and V.ndim == 2 and V.dtype.kind in "fiu":  # otherwise Surface refuses them
        check_indices(corners[:, None], len(V), of_face)
        quads = np.flatnonzero(sizes == 4)
        at = V[corners[offsets[quads, None] + np.arange(4)]].astype(np.float64)
        with np.errstate(all="ignore"):  # coordinates that Surface refuses
            diagonals = np.linalg.norm(at[:, 2:] - at[:, :2], axis=2)
        first[quads] = diagonals[:, 1] < diagonals[:, 0]
    count = sizes - 2
    polygons = np.repeat(np.arange(len(sizes)), count)
    number = np.arange(len(polygons)) - np.repeat(np.cumsum(count) - count, count)
    start, size, begin = first[polygons], sizes[polygons], offsets[:-1][polygons]
    fan = [begin + (start + step) % size for step in (np.zeros_like(number), number + 1, number + 2)]
    return np.stack([corners[i] for i in fan], axis=1), polygons


def split_strips(flat: npt.NDArray[Any]) -> tuple[Indices, Indices]:
    """Split VTK's padded strips into triangles, reversing every second one; returns these and their strips."""
    corners, offsets = unpad(flat) or (np.empty(0, np.int64), np.zeros(1, np.int64))
    count = np.diff(offsets) - 2
    strip = np.repeat(np.arange(len(count)), count)
    number = np.arange(len(strip)) - np.repeat(np.cumsum(count) - count, count)
    begin, odd = offsets[:-1][strip] + number, number % 2
    return np.stack([corners[begin], corners[begin + 1 + odd], corners[begin + 2 - odd]], axis=1), strip

"""The triangle mesh: two frozen arrays, checked once, here."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from meshlab_specsmooth.arrays import Booleans, Floats, Integers
from meshlab_specsmooth.errors import InvalidSurface
from meshlab_specsmooth.geometry.triangles import compute_face_vectors, compute_vertex_normals

# Nearer to the end of the range of numbers, differences and wavelengths would leave it.
_LARGEST = 2.0**1000

# Of 2, of the extent of a mesh: beyond, in either direction, squares of lengths leave the range of numbers, and squares
# of areas
LARGEST_EXPONENT, LARGEST_EXPONENT_OF_AREAS = 500, 240


@dataclass(frozen=True, eq=False)
class Surface:
    """A triangle mesh; constructing one is the gate for bad input.

    Both arrays are copied, so that the caller's are never touched and later changes to them have no effect here.

    Parameters
    ----------
    vertices : (n, 3) real array
        Positions in mesh units; stored as read-only float64.
    faces : (m, 3) integer array
        Vertex indices of each triangle; stored as read-only int32. Degenerate, duplicate, inconsistently oriented and
        non-manifold faces are accepted, and so are vertices that no face refers to, which need not be finite.

    Raises
    ------
    InvalidSurface
        Names the array, the first bad row and the remedy.

    Examples
    --------
    >>> import meshlab_specsmooth as mss
    >>> mss.Surface([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]]).vertices.dtype
    dtype('float64')
    >>> mss.Surface([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 3]])
    Traceback (most recent call last):
    ...
    meshlab_specsmooth.errors.InvalidSurface: faces[0] refers to vertex 3 of a mesh with 3 vertices (0 to 2); ...
    """

    vertices: Floats
    faces: Integers

    def __post_init__(self) -> None:
        vertices = _checked_vertices(self.vertices)
        faces = _checked_faces(self.faces, len(vertices))
        _check_coordinates(vertices, faces)
        for name, array in (("vertices", vertices), ("faces", faces)):
            array.flags.writeable = False
            object.__setattr__(self, name, array)

    def __repr__(self) -> str:
        """The arrays are long."""
        return f"<Surface: {len(self.vertices)} vertices, {len(self.faces)} faces>"

    @property
    def unused_not_finite(self) -> int:
        """Number of vertices that are not finite; no face uses any of these."""
        with np.errstate(invalid="ignore"):
            is_finite = np.isfinite(self.vertices.sum())
        return 0 if is_finite else int((~np.isfinite(self.vertices)).any(axis=1).sum())


def check_extent(exponent: int, largest: int, what: str) -> None:
    """Refuse a mesh whose extent is about 2^exponent where powers of it leave the range of numbers.

    Raises
    ------
    InvalidSurface
        With ``what`` it is that takes such powers.
    """
    if abs(exponent) > largest:
        raise InvalidSurface("vertices", f"are too large or too small for {what} (about 2^{exponent})", "scale them")


def _checked_vertices(given: Any) -> Floats:
    array = _as_table(given, "vertices", "coordinates")
    if array.dtype.kind not in "fiu":
        raise InvalidSurface("vertices", f"has dtype {array.dtype}", "pass real numbers, e.g. vertices.astype(float)")
    # a copy in row order whatever the input was (pymeshlab hands out column order)
    with np.errstate(over="ignore"):  # of long doubles, which are then not finite
        vertices = np.array(array, dtype=np.float64, order="C", copy=True)
    if len(vertices) == 0:
        raise InvalidSurface("vertices", "is empty", "a surface needs vertices")
    return vertices


def _check_coordinates(vertices: Floats, faces: Integers) -> None:
    """Refuse coordinates that are not finite or too large, of vertices that a face uses."""
    if max(vertices.max(), -vertices.min()) <= _LARGEST:  # false where there is a NaN
        return
    with np.errstate(invalid="ignore"):
        bad = ~(np.abs(vertices) <= _LARGEST).all(axis=1)
    used = np.zeros(len(vertices), dtype=np.bool_)
    used[faces] = True
    rows = np.flatnonzero(bad & used)
    if len(rows) == 0:
        return
    row = int(rows[0])
    if np.isfinite(vertices[row]).all():
        problem, remedy = f"is beyond {_LARGEST:.0e}", "scale the mesh down"
    else:
        problem, remedy = "is not finite", "remove or repair that vertex first"
    raise InvalidSurface("vertices", f"{problem}: {vertices[row].tolist()}", remedy, row)


def _checked_faces(given: Any, vertex_count: int) -> Integers:
    array = _as_table(given, "faces", "vertex indices")
    if len(array) == 0:
        raise InvalidSurface(
            "faces", "is empty", "smoothing needs triangles: reconstruct a surface from the points first"
        )
    if array.dtype.kind not in "iu":
        raise InvalidSurface("faces", f"has dtype {array.dtype}", "pass integers, e.g. faces.astype(int)")
    check_indices(array, vertex_count)
    return np.array(array, dtype=np.int32, order="C", copy=True)


def check_indices(array: npt.NDArray[Any], vertex_count: int, face_of: npt.NDArray[Any] | None = None) -> None:
    """Refuse faces that refer to vertices which are not there.

    Parameters
    ----------
    array : (m, k) integers
    vertex_count : int
    face_of : (m,) integers, optional
        The face that each row is of, for the error; by default each row is one.

    Raises
    ------
    InvalidSurface
        Names the first such face.
    """
    outside = (array < 0) | (array >= vertex_count)
    if outside.any():
        row = int(np.flatnonzero(outside.any(axis=1))[0])
        bad = int(array[row][outside[row]][0])
        raise InvalidSurface(
            "faces",
            f"refers to vertex {bad} of a mesh with {vertex_count} vertices (0 to {vertex_count - 1})",
            "remove that face or correct its index (indices start at 0)",
            row if face_of is None else int(face_of[row]),
        )


def _as_table(given: Any, name: str, columns: str) -> npt.NDArray[Any]:
    """``given`` as an array of three columns; ragged or otherwise unreadable input is refused by name."""
    try:
        array = np.asarray(given)
    except MemoryError:
        raise
    except Exception as error:  # what an object's own __array__ raises may be anything
        raise InvalidSurface(name, f"is no array ({error})", f"pass rows of 3 {columns}") from error
    if np.ma.is_masked(given):
        raise InvalidSurface(name, "has masked entries", "fill them, or remove their rows")
    if array.ndim != 2 or array.shape[1] != 3:
        if array.shape == (0,):  # an empty list has lost its columns
            return array.reshape(0, 3)
        raise InvalidSurface(name, f"has shape {array.shape}", f"pass rows of 3 {columns}, shape (count, 3)")
    return array


def edges(surface: Surface) -> tuple[Integers, npt.NDArray[np.int64]]:
    """Undirected edges and the number of faces at each.

    Returns
    -------
    ends : (e, 2) int32
        Each edge once, smaller index first; the sides of degenerate faces that join a vertex to itself are left out.
    face_count : (e,) int64
        1 on the boundary, 2 inside a manifold, more where the mesh is non-manifold.
    """
    F = surface.faces
    ends = np.concatenate([F[:, [0, 1]], F[:, [1, 2]], F[:, [2, 0]]])
    ends = np.sort(ends[ends[:, 0] != ends[:, 1]], axis=1)
    # one integer an edge sorts much faster than rows do
    n = len(surface.vertices)
    keys, count = np.unique(ends[:, 0].astype(np.int64) * n + ends[:, 1], return_counts=True)
    return np.stack([keys // n, keys % n], axis=1).astype(np.int32), count


def mean_edge_length(surface: Surface) -> float:
    """Mean length of the edges, in mesh units (0 where no face has two different vertices)."""
    V, (ends, _) = surface.vertices, edges(surface)
    return float(np.linalg.norm(V[ends[:, 0]] - V[ends[:, 1]], axis=1).mean()) if len(ends) else 0.0


def boundary_vertices(surface: Surface) -> Booleans:
    """(n,) True at the ends of edges that have one face only."""
    ends, face_count = edges(surface)
    mask = np.zeros(len(surface.vertices), dtype=np.bool_)
    mask[ends[face_count == 1].ravel()] = True
    return mask


def face_vectors(surface: Surface) -> Floats:
    """(m, 3) normals whose length is twice the face's area, in squared mesh units."""
    return compute_face_vectors(surface.vertices, surface.faces)


def vertex_normals(surface: Surface) -> Floats:
    """(n, 3) unit normals, the mean over the faces at a vertex weighted by area; zero where there is none."""
    exponent = int(np.frexp(np.abs(surface.vertices).max())[1])  # squares must stay in the range of numbers
    return compute_vertex_normals(np.ldexp(surface.vertices, -exponent), surface.faces)


def signed_volume(surface: Surface) -> float:
    """Volume enclosed by a closed surface, in cubed mesh units; positive where the faces look outwards."""
    V, F = surface.vertices - surface.vertices.mean(axis=0), surface.faces
    return float(np.einsum("ij,ij->", V[F[:, 0]], np.cross(V[F[:, 1]], V[F[:, 2]])) / 6)


def is_closed(surface: Surface) -> bool:
    """Whether every edge has two faces or more, so that the volume means something."""
    _, face_count = edges(surface)
    return bool(len(face_count) > 0 and (face_count >= 2).all())

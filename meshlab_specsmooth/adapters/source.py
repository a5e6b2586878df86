"""A mesh as it was given, and results that can be converted back to a mesh of its kind."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from meshlab_specsmooth.adapters.polygons import Indices, triangulate
from meshlab_specsmooth.arrays import Floats
from meshlab_specsmooth.geometry.surface import Surface, face_vectors, vertex_normals

#: A mesh of any kind, recognized by its attributes and not by its type; see :func:`recognize`.
Mesh = Any


@dataclass(frozen=True, eq=False)
class Source:
    """A mesh as it was given, with functions that make another one of its kind.

    Attributes
    ----------
    vertices : (n, 3) array_like
    faces : (t, 3) array_like
        Triangles: the faces given, or those that their polygons were split into. Unchecked, like the vertices;
        :meth:`surface` checks both.
    given : object
        The mesh; after :meth:`kept` a copy of it.
    duplicate : callable
        Copies a mesh of this kind.
    put : callable
        Called with a copy, this source and (n, 3) float64 positions; returns the mesh with these positions.
    polygons : (t,) int64 or None
        The given face that each triangle is a part of; None if the triangles are the faces given.
    picklable : bool
        Whether the mesh can be pickled; otherwise ``(vertices, faces)`` is.
    """

    vertices: Any
    faces: Any
    given: Any
    duplicate: Callable[[Any], Any]
    put: Callable[[Any, Source, Floats], Any]
    polygons: Indices | None = None
    picklable: bool = True

    def surface(self) -> Surface:
        """Check vertices and triangles, and return them as a surface; raises :class:`InvalidSurface`."""
        return Surface(self.vertices, self.faces)

    def kept(self) -> Source:
        """Return the same with a copy of the mesh, unaffected by later changes to it; for arrays only the faces."""
        if self.put is _put_arrays:
            return replace(self, vertices=None, faces=None)
        return replace(self, given=self.duplicate(self.given))

    def moved(self, vertices: Floats) -> Mesh:
        """Return a new mesh of the kind given, with these positions and all other data of the mesh given."""
        return self.put(self.duplicate(self.given), self, vertices)

    def per_face(self, flags: npt.NDArray[np.bool_]) -> npt.NDArray[np.bool_]:
        """Convert flags of triangles to flags of the faces given: True if any triangle of a face is True."""
        if self.polygons is None:
            return flags
        found = np.zeros(int(self.polygons.max()) + 1, dtype=np.bool_)
        found[self.polygons[flags]] = True
        return found

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle meshes of pymeshlab as ``(vertices, faces)``."""
        if not self.picklable:
            return from_arrays, (self.vertices, self.faces)
        state = tuple(getattr(self, each.name) for each in dataclasses.fields(self))
        return Source, state


class WithMesh:
    """Base of results that can be converted to a mesh of the kind that was given."""

    source: Source | None
    vertices: Floats

    @functools.cached_property
    def mesh(self) -> Mesh:
        """A mesh of the kind given, with the new positions, recomputed normals, and all other data of the mesh given.

        For arrays it is ``(vertices, faces)``, for a MeshSet one with only its current mesh, for a path a MeshSet. It
        is created at the first access, and cached because pymeshlab deletes a mesh with its MeshSet.
        """
        return None if self.source is None else self.source.moved(self.vertices)

    def __getstate__(self) -> dict[str, Any]:
        """Leave out the cached mesh."""
        return {name: value for name, value in vars(self).items() if name != "mesh"}


def has_attributes(mesh: Mesh, *names: str) -> bool:
    """Whether an object has all of these attributes."""
    return all(hasattr(mesh, name) for name in names)


def from_arrays(vertices: Any, faces: Any) -> Source:
    """Make a source of vertices and faces; its meshes are ``(vertices, faces)``."""
    triangles, polygons = triangulate(vertices, faces)
    return Source(vertices, triangles, faces, keep, _put_arrays, polygons)


def keep(given: Any) -> Any:
    """Return the argument: the duplicate of data that is never modified."""
    return given


def _put_arrays(faces: Any, source: Source, vertices: Floats) -> tuple[Floats, Any]:
    return vertices, faces


@dataclass(frozen=True, eq=False)
class MovedNormals:
    """Normals of a mesh after it has moved."""

    source: Source
    vertices: Floats
    before: Surface = field(init=False)
    after: Surface = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "before", self.source.surface())
        object.__setattr__(self, "after", Surface(self.vertices, self.before.faces))

    @property
    def face_count(self) -> int:
        """Number of the faces given."""
        polygons = self.source.polygons
        return len(self.before.faces) if polygons is None else int(polygons.max()) + 1

    def of_vertices(self, old: Any) -> npt.NDArray[Any]:
        """Return vertex normals, (n, 3), with the dtype and the orientation of the old ones."""
        return _oriented_like(old, vertex_normals(self.before), vertex_normals(self.after))

    def of_faces(self, old: Any) -> npt.NDArray[Any]:
        """Return normals of the faces given, (m, 3), with the dtype and the orientation of the old ones."""
        return _oriented_like(old, self._of_faces(self.before), self._of_faces(self.after))

    def _of_faces(self, surface: Surface) -> Floats:
        _, exponent = np.frexp(np.abs(surface.vertices).max())
        vectors = face_vectors(Surface(np.ldexp(surface.vertices, -exponent), surface.faces))
        polygons = self.source.polygons
        if polygons is not None:
            sums = [np.bincount(polygons, weights=vectors[:, i], minlength=self.face_count) for i in range(3)]
            vectors = np.stack(sums, axis=1)
        length = np.linalg.norm(vectors, axis=1, keepdims=True)
        return np.asarray(np.divide(vectors, length, out=np.zeros_like(vectors), where=length > 0))


def _oriented_like(old: Any, before: Floats, after: Floats) -> npt.NDArray[Any]:
    given = np.asarray(old)
    side = -1.0 if float((given * before).sum()) < 0 else 1.0
    return (side * after).astype(given.dtype)

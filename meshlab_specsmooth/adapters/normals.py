"""Normals of a moved mesh, to replace those that it had."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from meshlab_specsmooth.adapters.source import Source
from meshlab_specsmooth.arrays import Floats
from meshlab_specsmooth.geometry.surface import Surface, face_vectors, vertex_normals


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

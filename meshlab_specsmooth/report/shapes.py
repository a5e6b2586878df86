"""The surfaces that a comparison shows, and the vertices of them that are drawn."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from meshlab_specsmooth.arrays import Floats, Integers
from meshlab_specsmooth.comparison.ranking import Ranking
from meshlab_specsmooth.comparison.rows import Row
from meshlab_specsmooth.geometry.decimate import cluster_vertices
from meshlab_specsmooth.geometry.surface import Surface
from meshlab_specsmooth.report.pictures import front

#: Names of the surfaces that are no filter's result.
GIVEN, TRUTH = "as given", "the truth"

#: Larger meshes are decimated for display.
MAX_DRAWN = 60_000


@dataclass(frozen=True, eq=False)
class Shape:
    """A surface with its name, (n,) values to color it by, and its row; None for the truth."""

    name: str
    surface: Surface
    values: Mapping[str, Floats]
    row: Row | None


def list_shapes(found: Ranking) -> list[Shape]:
    """Return the mesh as given, the truth if it has the same faces, then the results, the best first."""
    given = found.rows[0]
    shapes = [Shape(GIVEN, found.given, given.colors, given)]
    if found.truth is not None and np.array_equal(found.truth.faces, found.given.faces):
        shapes.append(Shape(TRUTH, found.truth, {"error": np.zeros(len(found.truth.vertices))}, None))
    shapes += [
        Shape(row.name, row.surface, row.colors, row)
        for row in found.ranked
        if row.surface is not None and row is not given
    ]
    return shapes


@dataclass(frozen=True, eq=False)
class Drawn:
    """The part of a mesh that is drawn: (k,) vertices, and (j, 3) faces as indices into them."""

    vertices: npt.NDArray[np.int64]
    faces: Integers

    def surface_of(self, surface: Surface) -> Surface:
        """Return what is drawn of a surface with the faces of the mesh."""
        return Surface(surface.vertices[self.vertices], self.faces)


def select_drawn(surface: Surface, max_count: int = MAX_DRAWN) -> Drawn:
    """Return all of a surface, or a decimation of one with more than ``max_count`` vertices."""
    V, F = surface.vertices, surface.faces
    return Drawn(np.arange(len(V)), F) if len(V) <= max_count else Drawn(*cluster_vertices(V, F, max_count))


def focus_point(found: Ranking) -> Floats:
    """Return the (3,) point for the close-up: on the side that faces the viewer, where the curvature is largest."""
    best = found.choice or found.best
    surface, curvature = best.surface or found.given, np.abs(best.colors["curvature"])
    V, view = surface.vertices, front(surface)
    depth = V @ (view.direction / np.linalg.norm(view.direction))
    cells = np.floor((V - V.min(axis=0)) / (0.1 * float(np.ptp(V, axis=0).max()) or 1.0)).astype(np.int64)
    _, cell = np.unique(cells, axis=0, return_inverse=True)
    cell = cell.reshape(-1)
    # the mean curvature of a cell a tenth of the extent wide, weighted by its distance to the viewer
    count = np.bincount(cell)
    mean = np.bincount(cell, np.minimum(curvature, np.quantile(curvature, 0.95))) / count
    nearness = (np.bincount(cell, depth) / count - depth.min()) / (float(np.ptp(depth)) or 1.0)
    chosen = int(np.argmax(mean * nearness**2 * np.minimum(count / count.mean(), 1.0)))
    middle = V[cell == chosen].mean(axis=0)
    return np.asarray(V[np.argmin(((V - middle) ** 2).sum(axis=1))])

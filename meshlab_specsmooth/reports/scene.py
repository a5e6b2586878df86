"""The surfaces that a comparison shows, their colors, and the same quantized for WebGL."""

from __future__ import annotations

import base64
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from meshlab_specsmooth.arrays import Floats, Integers
from meshlab_specsmooth.comparison.comparison import Comparison
from meshlab_specsmooth.comparison.rows import Row
from meshlab_specsmooth.geometry.decimate import cluster_vertices
from meshlab_specsmooth.geometry.surface import Surface
from meshlab_specsmooth.reports.pictures import front

# Blue, violet and green for this package's filters; MeshLab's have the other hues
_OURS = ("#1457b8", "#12a0c4", "#7a4fd0", "#4c8a2a", "#0d2f6b")
_MESHLAB = ("#d1495b", "#e08e0b", "#8c5a2b", "#c65bb0", "#7f7f7f", "#b0a400", "#e377c2", "#555555")
GIVEN_COLOR, TRUTH_COLOR = "#9aa5b1", "#2f2f2f"
# Color maps end at this quantile over all results that are better than the mesh as given
_QUANTILE = 0.98


@dataclass(frozen=True)
class Coloring:
    """A quantity that surfaces are colored by: its key in the colors of a row, its label, unit and color map."""

    key: str
    label: str
    unit: str
    map: str
    signed: bool


COLORINGS = (
    Coloring("error", "distance to the truth", "mean edges", "viridis", False),
    Coloring("displacement", "displacement", "mean edges", "viridis", False),
    Coloring("curvature", "curvature", "(concave to convex, per mean edge)", "coolwarm", True),
)


def row_colors(found: Comparison) -> dict[str, str]:
    """Return a color for each row, by its name."""
    ours, others, colors = iter(_OURS * 9), iter(_MESHLAB * 9), {}
    for row in reversed(found.rows):  # the automatic filters come last and get the first of the blues
        if row.ours:
            colors[row.name] = next(ours)
    for row in found.rows:
        if row.spec is None:
            colors[row.name] = GIVEN_COLOR
        elif not row.ours:
            colors[row.name] = next(others)
    return colors


def list_colorings(found: Comparison) -> list[Coloring]:
    """Return the quantities that some row has."""
    return [c for c in COLORINGS if any(c.key in row.colors for row in found.rows)]


def color_range(found: Comparison, coloring: Coloring) -> tuple[float, float]:
    """Return the ends of the color map for all surfaces, from the rows that are no worse than the mesh as given."""
    limit = 1.1 * found.rows[0].values.get("estimated_error", 0.0)
    rows = [row for row in found.rows if not row.failure and row.values.get("estimated_error", 0.0) <= limit]
    values = np.concatenate([np.abs(row.colors[coloring.key]) for row in rows if coloring.key in row.colors])
    high = float(np.quantile(values, _QUANTILE)) or 1.0
    return (-high if coloring.signed else 0.0), high


def color_ramp(coloring: Coloring) -> npt.NDArray[np.uint8]:
    """Return the color map as (256, 3) colors."""
    import matplotlib

    return np.round(255 * matplotlib.colormaps[coloring.map](np.linspace(0, 1, 256))[:, :3]).astype(np.uint8)


def diverging_colors(fraction: Floats) -> Floats:
    """Return (n, 3) colors from blue over white to red, for (n,) fractions in [0, 1]."""
    ends = np.array([[0.23, 0.30, 0.75], [0.87, 0.87, 0.87], [0.71, 0.02, 0.15]])
    x = np.clip(fraction, 0, 1)
    return np.stack([np.interp(x, [0, 0.5, 1], column) for column in ends.T], axis=1)


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


def list_shapes(found: Comparison) -> list[Shape]:
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


def focus_point(found: Comparison) -> Floats:
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


_MAX_UINT16 = 2**16 - 1
_MAX_FLOAT16 = 65000.0
# Margin of the box in which coordinates are quantized, as a fraction of the extent of the given mesh
_MARGIN = 0.05


def make_scene(found: Comparison, shapes: Sequence[Shape], drawn: Drawn) -> dict[str, Any]:
    """Return the data of the 3D views, ready for JSON; arrays are little-endian and in base64.

    Coordinates are 16-bit fractions of a box around the given mesh, to which vertices outside are clipped. The script
    works in units of the longest side of this box.
    """
    V = found.given.vertices
    low, high = V.min(axis=0), V.max(axis=0)
    margin = _MARGIN * (high - low).max()
    low, size = low - margin, np.maximum(high - low + 2 * margin, 1e-300)
    extent = float(size.max())
    unit = 1 / extent
    is_wide = len(drawn.vertices) > 2**16
    scales = {c.key: (c, *color_range(found, c)) for c in list_colorings(found)}
    meshes = []
    for shape in shapes:
        inside = np.clip((shape.surface.vertices[drawn.vertices] - low) / size, 0, 1)
        values = {
            key: encode(np.clip(shape.values[key][drawn.vertices], -_MAX_FLOAT16, _MAX_FLOAT16).astype("<f2").tobytes())
            for key in scales
            if key in shape.values
        }
        positions = np.round(_MAX_UINT16 * inside).astype("<u2")
        meshes.append({"positions": encode(positions.tobytes()), "values": values})
    focus = (focus_point(found) - (low + size / 2)) * unit
    return {
        "corners": int(drawn.faces.size),
        "wide": is_wide,
        "faces": encode(drawn.faces.astype("<u4" if is_wide else "<u2").tobytes()),
        "before": 0,
        "meshes": meshes,
        "size": (size * unit).tolist(),
        "middle": (size * unit / 2).tolist(),
        "radius": float(np.linalg.norm(size * unit)) / 2,
        "height": 1.08 * float(np.ptp(V, axis=0).max()) * unit,
        "close": focus.tolist(),
        "scales": {
            key: {"low": a, "high": b, "label": c.label, "unit": c.unit, "ramp": encode(color_ramp(c).tobytes())}
            for key, (c, a, b) in scales.items()
        },
        "extent": extent,
        "edge": found.edge,
        "whole": len(drawn.vertices) == len(V),
    }


def encode(data: bytes) -> str:
    """Return bytes as base64 text."""
    return base64.b64encode(data).decode("ascii")

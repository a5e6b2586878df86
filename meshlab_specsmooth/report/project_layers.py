"""The layers of a comparison in a MeshLab project."""

from __future__ import annotations

import numpy as np

from meshlab_specsmooth.arrays import Floats
from meshlab_specsmooth.comparison.ranking import Ranking
from meshlab_specsmooth.meshlab import projects
from meshlab_specsmooth.report.palette import color_range, diverging_colors, list_colorings
from meshlab_specsmooth.report.shapes import list_shapes

_MAX_FILE_NAME = 40


def make_layers(found: Ranking) -> list[projects.Layer]:
    """Return one layer for each surface, all but the first hidden.

    The quality of the vertices is the distance to the truth if that is known, else the displacement. The mesh as given
    keeps its own colors, if it has any; the others are colored by quality, with the range in the label.
    """
    coloring = list_colorings(found)[0]
    low, high = color_range(found, coloring)
    quantity = "from the truth" if coloring.key == "error" else "of displacement"
    layers = []
    for i, shape in enumerate(list_shapes(found)):
        quality = shape.values.get(coloring.key, np.zeros(len(shape.surface.vertices)))
        colors: Floats | None = diverging_colors((quality - low) / (high - low))
        face_colors: Floats | None = None
        label = f"{shape.name} (blue 0, red {_percent(high)} % of an edge {quantity})"
        if i == 0 and (found.vertex_colors is not None or found.face_colors is not None):
            colors, face_colors = found.vertex_colors, found.face_colors
            label = f"{shape.name} (its own colors)"
        # MeshLab displays a label up to its first dot only, as if a file name extension followed
        label = label.replace(".", ",")
        layers.append(
            projects.Layer(label, layer_file(shape.name), shape.surface, quality, colors, i == 0, face_colors)
        )
    return layers


def layer_file(name: str) -> str:
    """Return the file name of a layer."""
    return "".join(c if c.isalnum() else "_" for c in name.lower()).strip("_")[:_MAX_FILE_NAME] + ".ply"


def _percent(fraction: float) -> str:
    return f"{100 * fraction:.0f}" if fraction >= 0.1 else f"{100 * fraction:.2g}"

"""The meshes of a comparison, quantized, as the page's script draws them with WebGL."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from typing import Any

import numpy as np

from meshlab_specsmooth.comparison.ranking import Ranking
from meshlab_specsmooth.report.palette import color_ramp, color_range, list_colorings
from meshlab_specsmooth.report.shapes import Drawn, Shape, focus_point

_MAX_UINT16 = 2**16 - 1
_MAX_FLOAT16 = 65000.0
# Margin of the box in which coordinates are quantized, as a fraction of the extent of the given mesh
_MARGIN = 0.05


def make_scene(found: Ranking, shapes: Sequence[Shape], drawn: Drawn) -> dict[str, Any]:
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

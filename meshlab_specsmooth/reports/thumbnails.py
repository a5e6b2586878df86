"""A surface before and after as one small image for notebooks; none without Matplotlib."""

from __future__ import annotations

import base64
import io
from typing import Any

import numpy as np
import numpy.typing as npt

from meshlab_specsmooth.describe import Pictured
from meshlab_specsmooth.geometry.decimate import collapse_cells

_Array = npt.NDArray[np.float64]
_Faces = npt.NDArray[np.integer]

# Width of a picture in pixels, and its resolution
_PIXELS, _DPI = 260, 100
_COLORS = 24

# Another axis than the third is chosen as the direction of view if the visible area is larger by this factor
_MIN_AREA_GAIN = 1.5

# Meshes with more faces than this are decimated, on a grid with this many cells along a side
_MAX_FACES = 20_000
_CELLS = 48

# As in the pictures of comparisons: seen from the front, slightly from the right and above, lit from the upper left
_EYE, _UP = np.array([0.25, 0.15, 1.0]), np.array([0.0, 1.0, 0.0])
_LIGHT = np.array([-0.65, 0.55, 0.55])
_COLOR = np.array([216, 201, 168]) / 255


def draw(pictured: Pictured) -> str:
    """Return an ``img`` element with the surface before and after; empty without Matplotlib or without faces.

    Examples
    --------
    >>> import numpy as np
    >>> from meshlab_specsmooth.reports.thumbnails import draw
    >>> V, F = np.eye(3), np.array([[0, 1, 2]], dtype=np.int32)
    >>> draw((V, V, F)).startswith("<img ")
    True
    """
    try:
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.collections import PolyCollection
        from matplotlib.figure import Figure
        from PIL import Image
    except ImportError:
        return ""
    before, after, faces = normalize(*pictured)
    if len(faces) == 0:
        return ""
    figure = Figure(figsize=(2 * _PIXELS / _DPI, 1.1 * _PIXELS / _DPI), dpi=_DPI)
    canvas = FigureCanvasAgg(figure)
    for axes, V, title in zip(figure.subplots(1, 2), (before, after), ("before", "after"), strict=True):
        corners, colors = shade(V, faces)
        axes.add_collection(PolyCollection(corners, facecolors=colors, edgecolors="none", antialiaseds=False))
        axes.set(xlim=(-0.55, 0.55), ylim=(-0.55, 0.55), aspect="equal")
        axes.set_title(title, fontsize=8, pad=2)
        axes.axis("off")
    figure.subplots_adjust(0.0, 0.0, 1.0, 0.92, 0.0, 0.0)
    canvas.draw()
    image = io.BytesIO()
    # a palette keeps notebooks small: the colors are shades of one
    Image.fromarray(np.asarray(canvas.buffer_rgba())).convert("RGB").quantize(_COLORS).save(image, format="png")
    data = base64.b64encode(image.getvalue()).decode("ascii")
    return f'<img alt="before and after" width="{2 * _PIXELS}" src="data:image/png;base64,{data}"/>'


def normalize(before: _Array, after: _Array, faces: _Faces) -> tuple[_Array, _Array, _Faces]:
    """Return both surfaces scaled and centered as the first one, to size 1 at the origin, and decimated for drawing.

    Of the vertices in a cell of a grid the first one is kept, not their mean, so that noise remains visible.
    """
    is_used = np.zeros(len(before), dtype=np.bool_)
    is_used[faces] = True
    before, after = before[is_used], after[is_used]
    faces = (np.cumsum(is_used) - 1)[faces]
    if len(faces) == 0:
        return before, after, faces
    low, high = before.min(axis=0), before.max(axis=0)
    span = float((high / 2 - low / 2).max()) * 2
    center, unit = low / 2 + high / 2, span if 0 < span < np.inf else 1.0
    before, after = ((X - center) / unit for X in (before, after))
    turned = np.roll([0, 1, 2], 2 - _widest(before, faces))
    before, after = before[:, turned], after[:, turned]
    if len(faces) > _MAX_FACES:
        cell = np.minimum(((before + 0.5) * _CELLS).astype(np.int64), _CELLS - 1) @ np.array([_CELLS**2, _CELLS, 1])
        kept, faces = collapse_cells(cell, faces)
        before, after = before[kept], after[kept]
    return before, after, faces


def _widest(V: _Array, faces: _Faces) -> int:
    """The axis of view: the third one, unless a much larger area is visible along another."""
    seen = np.abs(np.cross(V[faces[:, 1]] - V[faces[:, 0]], V[faces[:, 2]] - V[faces[:, 0]])).sum(axis=0)
    best = int(seen.argmax())
    return best if seen[best] > _MIN_AREA_GAIN * seen[2] else 2


def shade(V: _Array, faces: _Faces) -> tuple[Any, _Array]:
    """Return (m, 3, 2) corners in the plane of the picture, the farthest first, and (m, 3) colors of the faces."""
    eye = _EYE / np.linalg.norm(_EYE)
    right = np.cross(_UP, eye)
    right /= np.linalg.norm(right)
    X = V @ np.stack([right, np.cross(eye, right), eye], axis=1)
    corners = X[faces]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    normal = np.divide(normal, length, out=np.zeros_like(normal), where=length > 0)
    normal *= np.where(normal[:, 2:] < 0, -1.0, 1.0)  # faces seen from behind
    light = np.clip(normal @ (_LIGHT / np.linalg.norm(_LIGHT)), 0.0, 1.0)
    order = np.argsort(corners[:, :, 2].mean(axis=1))
    return corners[order][:, :, :2], ((0.25 + 0.75 * light)[:, None] * _COLOR)[order]

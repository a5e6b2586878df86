"""The panels of the page: a name, a caption and pictures for each surface."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from meshlab_specsmooth.comparison.columns import MEASURES, format_value
from meshlab_specsmooth.comparison.ranking import Ranking
from meshlab_specsmooth.comparison.rows import Row, format_estimated_error
from meshlab_specsmooth.report import palette
from meshlab_specsmooth.report.pictures import HEIGHT_BY_WIDTH, Panel, View, close_up, front, render
from meshlab_specsmooth.report.plots import round_length
from meshlab_specsmooth.report.scene import encode
from meshlab_specsmooth.report.shapes import Drawn, Shape, focus_point
from meshlab_specsmooth.runtime import temporary

_PICTURED = 9  # surfaces with pictures, for print and browsers without WebGL
_SHOWN = 8  # panels that are visible at first
_CLOSE_UP = 0.28  # height of the close-up as a fraction of the whole view's


def make_panels(
    found: Ranking, shapes: Sequence[Shape], drawn: Drawn, colors: Mapping[str, str]
) -> list[dict[str, Any]]:
    """Return a dict for each surface, for the template; ``colors`` are those of the rows by name."""
    whole = front(drawn.surface_of(found.given))
    views = (whole, close_up(whole, focus_point(found), _CLOSE_UP))
    pictures = _make_pictures(views, shapes[:_PICTURED], drawn)
    bars = [_scale_bar(view, found.edge) for view in views]
    return [
        {
            "name": shape.name,
            "color": palette.TRUTH if shape.row is None else colors[shape.name],
            "caption": "" if shape.row is None else make_caption(shape.row),
            "shown": i < _SHOWN,
            "picture": pictures[i] if i < len(pictures) else "",
            "bars": bars,
        }
        for i, shape in enumerate(shapes)
    ]


def make_caption(row: Row) -> str:
    """Return the estimated and the true error of a row, as far as it has them."""
    words = []
    if "estimated_error" in row.values:
        words.append(f"error {format_estimated_error(row, with_uncertainty=False)}")
    if "true_error" in row.values:
        words.append(f"true error {format_value(MEASURES['true_error'], row.values['true_error'])}")
    return ", ".join(words)


def _scale_bar(view: View, edge: float) -> dict[str, Any]:
    """A scale bar below a picture: its length in words, and its width in per cent of that of the picture."""
    width = view.height / HEIGHT_BY_WIDTH
    length = round_length(0.25 * width)
    return {"width": round(100 * length / width, 2), "shown": f"{length:g} ({length / edge:.2g} edges)"}


def _make_pictures(views: Sequence[View], shapes: Sequence[Shape], drawn: Drawn) -> list[str]:
    """PNGs as data addresses, one for each surface, the views one below the other."""
    encoded = []
    with temporary.folder() as folder:
        path = Path(folder) / "panel.png"
        for shape in shapes:
            render(path, [Panel("", drawn.surface_of(shape.surface))], views)
            encoded.append("data:image/png;base64," + encode(path.read_bytes()))
    return encoded

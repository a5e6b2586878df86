"""A comparison as one HTML file that loads nothing else."""

from __future__ import annotations

import importlib.resources
import json
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from meshlab_specsmooth.comparison.columns import MEASURES, format_value
from meshlab_specsmooth.comparison.comparison import Comparison
from meshlab_specsmooth.comparison.rows import Row, format_estimated_error
from meshlab_specsmooth.errors import MissingExtra
from meshlab_specsmooth.noise.model import NONE, UNCLEAR
from meshlab_specsmooth.reports import page_tables, plots
from meshlab_specsmooth.reports.pictures import HEIGHT_BY_WIDTH, Panel, View, close_up, front, render
from meshlab_specsmooth.reports.plots import round_length
from meshlab_specsmooth.reports.scene import (
    MAX_DRAWN,
    TRUTH_COLOR,
    Drawn,
    Shape,
    encode,
    focus_point,
    list_colorings,
    list_shapes,
    make_scene,
    row_colors,
    select_drawn,
)
from meshlab_specsmooth.runtime import temporary


def make_page(found: Comparison, recipe: str = "", max_drawn: int = MAX_DRAWN) -> str:
    """Return the page as text; parameters and errors as for :func:`~meshlab_specsmooth.reports.export.write`."""
    try:
        import jinja2
    except ImportError as error:
        raise MissingExtra("the page", "report") from error
    here = importlib.resources.files(__package__) / "templates"
    environment = jinja2.Environment(autoescape=True, trim_blocks=True)
    safe = jinja2.utils.markupsafe.Markup
    colors = row_colors(found)
    drawn = select_drawn(found.given, max_drawn)
    shapes = list_shapes(found)
    scene = make_scene(found, shapes, drawn)
    tables, footnotes = page_tables.make_tables(found, colors)
    text: str = environment.from_string((here / "page.html").read_text(encoding="utf-8")).render(
        found=found,
        title=f"{found.name}: {found.headline()}",
        truth=found.truth is not None,
        noise_words=describe_noise(found),
        noise_details=explain_noise(found),
        bars=page_tables.make_bars(found, colors),
        bar_words=page_tables.bar_title(found),
        bar_unit=page_tables.bar_measure(found).key,
        bar_ticks=page_tables.bar_ticks(found),
        colorings=list_colorings(found),
        panels=make_panels(found, shapes, drawn, colors),
        display_note=_display_note(found, drawn),
        tables=tables,
        footnotes=footnotes,
        sweep_note=_sweep_note(found),
        curves=[_figure(plot, safe) for plot in plots.plot_curves(found)],
        tuned=page_tables.make_tuned_rows(found, colors),
        tuned_columns=page_tables.list_tuned_columns(found),
        legend=[{"name": row.name, "color": colors[row.name]} for row in found.rows if not row.failure],
        spectra=[_figure(plot, safe) for plot in plots.plot_spectra(found)],
        calls=page_tables.make_calls(found),
        recipe=recipe,
        style=safe((here / "page.css").read_text(encoding="utf-8")),
        script=safe((here / "page.js").read_text(encoding="utf-8")),
        data=safe(json.dumps(scene, separators=(",", ":")).replace("<", "\\u003c")),
    )
    return text


def describe_noise(found: Comparison) -> str:
    """Return kind and level of the noise in a few words."""
    noise, edge = found.noise, found.noise.mean_edge or 1.0  # levels are stated in edges of the given mesh
    added = "" if found.added is None else f" ({found.added:g} added on every coordinate, seed {found.seed})"
    if noise.kind == UNCLEAR:
        return f"noise cannot be separated from shape{added}"
    kind = "no measurable noise" if noise.kind == NONE else f"{noise.kind} noise"
    return f"{kind}, measured level {noise.level / edge:.3f} mean edges{added}"


def explain_noise(found: Comparison) -> str:
    """Return how the noise was measured, and what the estimated errors are based on."""
    noise = found.noise
    edge = noise.mean_edge or 1.0
    low, level, high = (x / edge for x in (noise.low, noise.level, noise.high))
    fixed = (
        "The error of a filter that chooses parameters automatically is estimated with these fixed at the values that "
        "it chose for the given mesh."
    )
    if noise.kind == UNCLEAR:
        return (
            f"Noise along the normals: at most {high:.4f} mean edges, the level if all that was measured were noise. "
            f"Without a level no error can be estimated. {fixed}"
        )
    probes = "one random perturbation" if found.probes == 1 else f"{found.probes} random perturbations"
    return (
        f"Noise along the normals: {level:.4f} mean edges (between {low:.4f} and {high:.4f}), classified as "
        f"{'none' if noise.kind == NONE else noise.kind}. The estimated errors of the table are based on {probes}, the "
        "same for every filter; the uncertainty is the standard error due to these and to the noise level. An error "
        f"below its uncertainty is given as an upper bound. {fixed}"
    )


def _figure(plot: plots.Plot, safe: Callable[[str], str]) -> dict[str, str]:
    """A plot for the template: the picture, and the tips at positions in it."""
    return {"svg": safe(plot.svg), "marks": json.dumps(plot.marks, separators=(",", ":"))}


def _sweep_note(found: Comparison) -> str:
    if found.sample is None:
        return ""
    return (
        "Because the mesh is large, this section and the next are measured on a part of it with "
        f"{len(found.sample.vertices):,} vertices, with one random perturbation."
    )


def _display_note(found: Comparison, drawn: Drawn) -> str:
    kept, n = len(drawn.vertices), len(found.given.vertices)
    if kept == n:
        return ""
    return (
        f"For display only, the {n:,} vertices are reduced to {kept:,}; all figures refer to the whole mesh, and the "
        "meshes beside this page are complete."
    )


_PICTURED = 9  # surfaces with pictures, for print and browsers without WebGL
_SHOWN = 8  # panels that are visible at first
_CLOSE_UP = 0.28  # height of the close-up as a fraction of the whole view's


def make_panels(
    found: Comparison, shapes: Sequence[Shape], drawn: Drawn, colors: Mapping[str, str]
) -> list[dict[str, Any]]:
    """Return a dict for each surface, for the template; ``colors`` are those of the rows by name."""
    whole = front(drawn.surface_of(found.given))
    views = (whole, close_up(whole, focus_point(found), _CLOSE_UP))
    pictures = _make_pictures(views, shapes[:_PICTURED], drawn)
    bars = [_scale_bar(view, found.edge) for view in views]
    return [
        {
            "name": shape.name,
            "color": TRUTH_COLOR if shape.row is None else colors[shape.name],
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

"""A comparison as one HTML file that loads nothing else."""

from __future__ import annotations

import importlib.resources
import json
from collections.abc import Callable

from meshlab_specsmooth.comparison.comparison import Comparison
from meshlab_specsmooth.comparison.ranking import Ranking
from meshlab_specsmooth.errors import MissingExtra
from meshlab_specsmooth.noise.model import NONE, UNCLEAR
from meshlab_specsmooth.report import bars, page_tables, palette, plots
from meshlab_specsmooth.report.panels import make_panels
from meshlab_specsmooth.report.scene import make_scene
from meshlab_specsmooth.report.shapes import MAX_DRAWN, Drawn, list_shapes, select_drawn


def make_page(found: Comparison, recipe: str = "", max_drawn: int = MAX_DRAWN) -> str:
    """Return the page as text; parameters and errors as for :func:`~meshlab_specsmooth.report.export.write`."""
    try:
        import jinja2
    except ImportError as error:
        raise MissingExtra("the page", "report") from error
    here = importlib.resources.files(__package__) / "templates"
    environment = jinja2.Environment(autoescape=True, trim_blocks=True)
    safe = jinja2.utils.markupsafe.Markup
    colors = palette.row_colors(found)
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
        bars=bars.make_bars(found, colors),
        bar_words=bars.bar_title(found),
        bar_unit=bars.bar_measure(found).key,
        bar_ticks=bars.bar_ticks(found),
        colorings=palette.list_colorings(found),
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


def describe_noise(found: Ranking) -> str:
    """Return kind and level of the noise in a few words."""
    noise, edge = found.noise, found.noise.mean_edge or 1.0  # levels are stated in edges of the given mesh
    added = "" if found.added is None else f" ({found.added:g} added on every coordinate, seed {found.seed})"
    if noise.kind == UNCLEAR:
        return f"noise cannot be separated from shape{added}"
    kind = "no measurable noise" if noise.kind == NONE else f"{noise.kind} noise"
    return f"{kind}, measured level {noise.level / edge:.3f} mean edges{added}"


def explain_noise(found: Ranking) -> str:
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


def _sweep_note(found: Ranking) -> str:
    if found.sample is None:
        return ""
    return (
        "Because the mesh is large, this section and the next are measured on a part of it with "
        f"{len(found.sample.vertices):,} vertices, with one random perturbation."
    )


def _display_note(found: Ranking, drawn: Drawn) -> str:
    kept, n = len(drawn.vertices), len(found.given.vertices)
    if kept == n:
        return ""
    return (
        f"For display only, the {n:,} vertices are reduced to {kept:,}; all figures refer to the whole mesh, and the "
        "meshes beside this page are complete."
    )

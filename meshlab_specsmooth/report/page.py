"""A comparison as one HTML file that needs nothing else, and as a MeshLab project."""

from __future__ import annotations

import base64
import contextlib
import importlib.resources
import json
import math
import os
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from meshlab_specsmooth.arrays import Floats, Integers
from meshlab_specsmooth.comparison.comparison import (
    MEASURES,
    Comparison,
    Measure,
    Row,
    estimate_shown,
    format_estimate,
    is_bound,
    shown,
    table,
)
from meshlab_specsmooth.errors import FileError, InvalidParameter, MissingExtra
from meshlab_specsmooth.geometry.surface import Surface
from meshlab_specsmooth.meshlab import projects
from meshlab_specsmooth.noise.model import NONE, UNCLEAR
from meshlab_specsmooth.report import plots
from meshlab_specsmooth.report.pictures import HEIGHT_BY_WIDTH, Panel, View, close_up, front, render
from meshlab_specsmooth.runtime import atomic, temporary

# More vertices than this are not drawn, but some that stand for them
_DRAWN = 60_000
_PICTURED = 9
_STEPS = 2**16 - 1  # of a drawn coordinate, over the bounding box
_SHOWN = 8  # panels at first
_GIVEN, _TRUTH = "as given", "the truth"
_FIRST_OF_SHAPE = "feature_loss"  # the measure that the second table begins with
_MOST_HALF = 65000.0  # of a number of 16 bits
# Colors end at this quantile of all results that are better than the mesh as given
_QUANTILE = 0.98


@dataclass(frozen=True)
class _Coloring:
    """What surfaces can be colored by."""

    key: str
    label: str
    unit: str
    map: str
    signed: bool


_COLOURINGS = (
    _Coloring("error", "distance to the truth", "mean edges", "viridis", False),
    _Coloring("displacement", "distance moved", "mean edges", "viridis", False),
    _Coloring("curvature", "curvature", "(hollow to ridge, by mean edge)", "coolwarm", True),
)


def write(found: Comparison, folder: str | os.PathLike[str], recipe: str = "", with_page: bool = True) -> list[Path]:
    """Write ``comparison.html``, ``comparison.mlp`` with its meshes, ``comparison.json`` and ``comparison.txt``.

    Parameters
    ----------
    found : Comparison
    folder : path
        Made where it is not there.
    recipe : str
        What to type to make the same comparison.
    with_page : bool
        Whether to write the page, too, which needs the extra ``report``.

    Returns
    -------
    list of Path
        What was written.

    Raises
    ------
    MissingExtra
        jinja2, matplotlib or PyVista is not installed, which :func:`check_extra` finds out before.
    FileError
        The folder cannot be made or written.
    """
    written = places(folder) if with_page else places(folder)[:-1]
    text = f"{found.headline()}.\n{' '.join(found.reasons())}\n\n{table(found)}\n"
    with _made(folder):
        atomic.write_text(written[0], text)
        atomic.write_text(written[1], json.dumps(data_of(found), indent=1) + "\n")
        projects.write(written[2], _layers(found))
        if with_page:
            atomic.write_text(written[3], page(found, recipe))
    return written


def places(folder: str | os.PathLike[str]) -> list[Path]:
    """The files of a comparison in a folder."""
    return [Path(folder) / f"comparison.{kind}" for kind in ("txt", "json", "mlp", "html")]


def check_extra() -> None:
    """Raise :class:`MissingExtra` where something that the page is made with is not installed."""
    try:
        import jinja2  # noqa: F401
        import matplotlib  # noqa: F401
        import pyvista  # noqa: F401
    except ImportError as error:
        raise MissingExtra("the page", "report") from error


def check_folder(folder: str | os.PathLike[str]) -> None:
    """Raise :class:`FileError` where a folder cannot be made or written; whether or not, it is left as it was."""
    with _made(folder, is_kept=False):
        pass


def check_inputs(
    folder: str | os.PathLike[str], inputs: Iterable[str | os.PathLike[str]], names: Iterable[str]
) -> None:
    """Raise :class:`InvalidParameter` where a comparison, with layers of these names, would replace an input."""
    layers = [Path(folder) / _layer_file(name) for name in (_GIVEN, _TRUTH, *names)]
    written = {place.resolve() for place in (*places(folder), *layers)}
    for each in inputs:
        if Path(each).resolve() in written:
            raise InvalidParameter(f"{each} is an input, and would be replaced by the output; --overwrite allows that")


@contextlib.contextmanager
def _made(folder: str | os.PathLike[str], is_kept: bool = True) -> Iterator[None]:
    """The folder is there inside; what was made for it and is empty in the end is removed after a failure."""
    place = Path(folder)
    new = [each for each in (place, *place.parents) if not each.exists()]
    is_done = False
    try:
        try:
            place.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise FileError(f"{place}: cannot be made: {error.strerror}") from error
        atomic.check_place(place / "comparison.html")
        yield
        is_done = True
    finally:
        for each in new if not (is_done and is_kept) else ():
            with contextlib.suppress(OSError):  # it was not made, or there is something in it
                each.rmdir()


def data_of(found: Comparison) -> dict[str, Any]:
    """All figures of a comparison, for machines."""
    return {
        "name": found.name,
        "vertices": len(found.given.vertices),
        "faces": len(found.given.faces),
        "mean_edge": found.edge,
        "noise": {
            "kind": found.noise.kind,
            "level": found.noise.level,
            "low": found.noise.low,
            "high": found.noise.high,
        },
        "added": found.added,
        "seed": found.seed,
        "headline": found.headline(),
        "trusted": found.trusted,
        "reasons": list(found.reasons()),
        "correlation": _number(found.correlation),
        "rows": [
            {
                "name": row.name,
                "call": row.call,
                "failure": row.failure,
                "chosen": dict(row.chosen),
                "sha256": row.hash,
                "uncertainty": _number(row.uncertainty),
                "behind": _number(row.behind),
                "behind_uncertainty": _number(row.behind_uncertainty),
                **{key: _number(value) for key, value in row.values.items()},
            }
            for row in found.rows
        ],
        "curves": [
            {"call": point.call, "filter": curve.competitor.name, **{k: _number(v) for k, v in point.values.items()}}
            for curve in found.curves
            for point in curve.points
        ],
        "versions": dict(found.versions),
    }


def _number(value: float) -> float | None:
    """JSON has no infinities."""
    return value if math.isfinite(value) else None


# --- the page ---


def page(found: Comparison, recipe: str = "") -> str:
    """The page as text."""
    try:
        import jinja2
    except ImportError as error:
        raise MissingExtra("the page", "report") from error
    here = importlib.resources.files(__package__) / "templates"
    environment = jinja2.Environment(autoescape=True, trim_blocks=True)
    painted = plots.colors(found)
    drawn = _drawn(found)
    safe = jinja2.utils.markupsafe.Markup
    notes: list[str] = []
    rows = [_table_row(found, row, painted, notes) for row in found.ranked]
    panels = _panels(found, painted, drawn)
    text: str = environment.from_string((here / "page.html").read_text(encoding="utf-8")).render(
        found=found,
        title=f"{found.name}: {found.headline()}",
        truth=found.truth is not None,
        noise_words=_noise_words(found),
        noise_details=_noise_details(found),
        bars=_bars(found, painted),
        bar_words=_bar_words(found),
        bar_unit=_bar_measure(found).key,
        bar_ticks=_bar_ticks(found),
        colorings=[c for c in _COLOURINGS if any(c.key in row.colors for row in found.rows)],
        panels=panels,
        display_note=_display_note(found, drawn),
        tables=_tables(found, rows),
        footnotes=notes,
        sweep_note=_sweep_note(found),
        curves=[_figure(plot, safe) for plot in plots.curves(found)],
        tuned=_tuned(found, painted),
        tuned_columns=_tuned_columns(found),
        legend=[{"name": row.name, "color": painted[row.name]} for row in found.rows if not row.failure],
        waves=[_figure(plot, safe) for plot in plots.waves(found)],
        calls=_calls(found),
        recipe=recipe,
        style=safe((here / "page.css").read_text(encoding="utf-8")),
        script=safe((here / "page.js").read_text(encoding="utf-8")),
        data=safe(json.dumps(_scene(found, drawn, panels), separators=(",", ":")).replace("<", "\\u003c")),
    )
    return text


def _figure(plot: plots.Plot, safe: Callable[[str], str]) -> dict[str, str]:
    """A plot for the template: the picture, and what stands at which place of it."""
    return {"svg": safe(plot.svg), "marks": json.dumps(plot.marks, separators=(",", ":"))}


def _tables(found: Comparison, rows: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """Columns and rows of two tables, as one of all measures is wider than a window."""
    columns = found.columns
    half = next((i for i, m in enumerate(columns) if m.key == _FIRST_OF_SHAPE), len(columns))
    parts = [("How near, how long", slice(0, half)), ("What became of the shape", slice(half, None))]
    return [
        {
            "title": title,
            "columns": columns[some],
            "rows": [{**row, "cells": row["cells"][some]} for row in rows],
        }
        for title, some in parts
        if columns[some]
    ]


def _noise_words(found: Comparison) -> str:
    noise, edge = found.noise, found.noise.mean_edge or 1.0  # as everywhere a level is stated
    added = "" if found.added is None else f" ({found.added:g} added on every coordinate, seed {found.seed})"
    if noise.kind == UNCLEAR:
        return f"noise and shape cannot be told apart{added}"
    kind = "no noise to speak of" if noise.kind == NONE else f"{noise.kind} noise"
    return f"{kind}, measured at {noise.level / edge:.3f} mean edges{added}"


def _noise_details(found: Comparison) -> str:
    noise = found.noise
    edge = noise.mean_edge or 1.0  # as everywhere a level is stated, not that of the truth
    low, level, high = (x / edge for x in (noise.low, noise.level, noise.high))
    held = "Filters that choose a setting by themselves are held at what they chose for the mesh."
    if noise.kind == UNCLEAR:
        return (
            f"Noise along the normals: at most {high:.4f} mean edges, if nothing of what was measured were shape. "
            f"Without its level no error can be estimated. {held}"
        )
    probes = "one random perturbation" if found.probes == 1 else f"{found.probes} random perturbations"
    return (
        f"Noise measured along the normals: {level:.4f} mean edges, between {low:.4f} and {high:.4f}, taken for "
        f"{'none' if noise.kind == NONE else noise.kind}. The estimated errors of the table come from {probes}, the "
        "same for every filter; the uncertainty is the standard error over them and that of the noise level. An error "
        f"below its uncertainty is given as a bound. {held}"
    )


def _bar_measure(found: Comparison) -> Measure:
    """What bars show: errors, or where none are known, how far vertices have moved."""
    keys = {key for row in found.rows for key in row.values}
    return next(
        MEASURES[key] for key in ("estimated_error", "true_error", "surface_error", "displacement") if key in keys
    )


def _bar_words(found: Comparison) -> str:
    return {
        "estimated_error": "Estimated distance from the true surface",
        "true_error": "Distance from the true surface, which is known",
        "surface_error": "Distance from the true surface, which is known",
        "displacement": "How far the vertices move, of which no part can be called noise or shape",
    }[_bar_measure(found).key]


def _upper(row: Row, key: str) -> float:
    """Where a bar ends: at the value, or at the bound where that is all that is known."""
    value = row.values.get(key, 0.0)
    return value + row.uncertainty if key == "estimated_error" and is_bound(value, row.uncertainty) else value


def _full(found: Comparison) -> float:
    """Where the axis of the bars ends: what is much worse than doing nothing leaves the picture."""
    key = _bar_measure(found).key
    given = _upper(found.rows[0], key)
    values = [_upper(row, key) for row in found.rows]
    return max([v for v in values if v <= 1.3 * given or given == 0] or [given]) * 1.08 or 1.0


def _bar_ticks(found: Comparison) -> list[dict[str, Any]]:
    """Marks of the axis of the bars, in per cent of its length."""
    full = _full(found)
    step = plots.round_length(full / 3)
    digits = max(0, -math.floor(math.log10(step)))
    return [
        {"at": round(100 * i * step / full, 2), "shown": f"{i * step:.{digits}f}"} for i in range(int(full / step) + 1)
    ]


def _bars(found: Comparison, painted: Mapping[str, str]) -> list[dict[str, Any]]:
    key, full = _bar_measure(found).key, _full(found)
    bars = []
    for row in found.ranked:
        value, upper = row.values.get(key, 0.0), _upper(row, key)
        spread = row.uncertainty if key == "estimated_error" and math.isfinite(row.uncertainty) else 0.0
        truth = row.values.get("true_error", math.inf) if key == "estimated_error" else math.inf
        shown_value = (
            estimate_shown(row) if key == "estimated_error" else shown(MEASURES[key], row.values.get(key, math.nan))
        )
        bars.append(
            {
                "name": row.name,
                "best": row is found.choice,
                "ours": row.competitor is not None and row.competitor.ours,
                "given": row.competitor is None,
                "failure": row.failure,
                "beyond": upper > full,
                "bound": upper != value,
                "width": min(100.0, round(100 * upper / full, 2)),
                "low": round(100 * max(value - spread, 0.0) / full, 2),
                "spread": round(100 * min(2 * spread, value + spread) / full, 2) if upper == value <= full else 0.0,
                "truth": round(100 * truth / full, 2) if truth <= full else None,
                "color": painted[row.name],
                "shown": shown_value,
                "tip": _bar_tip(row, key, shown_value),
            }
        )
    return bars


def _bar_tip(row: Row, key: str, value: str) -> str:
    if row.failure:
        return f"{row.name}\n{row.failure}"
    lines = [row.name, f"{MEASURES[key].label} {value} edges"]
    for other in ("true_error", "normal_error", "noise_removed", "seconds"):
        if other in row.values and other != key:
            m = MEASURES[other]
            lines.append(f"{m.label} {shown(m, row.values[other])} {m.unit}")
    return "\n".join(lines)


def _winners(rows: Sequence[Mapping[str, float]], columns: Sequence[Measure]) -> dict[str, float]:
    """The best value of each column in which some way is better."""
    ways: dict[str, Callable[[list[float]], float]] = {
        "low": min,
        "high": max,
        "zero": lambda values: min(values, key=abs),
    }
    found = {}
    for column in columns:
        values = [row[column.key] for row in rows if math.isfinite(row.get(column.key, math.nan))]
        if column.better and len(set(values)) > 1 and column.key != "seconds":
            found[column.key] = ways[column.better](values)
    return found


def _cells(
    values: Mapping[str, float], columns: Sequence[Measure], winners: Mapping[str, float]
) -> list[dict[str, Any]]:
    cells = []
    for m in columns:
        value = values.get(m.key, math.nan)
        sorted_by = abs(value) if m.better == "zero" else value
        cells.append(
            {
                "shown": shown(m, value),
                "value": f"{sorted_by:.9g}" if math.isfinite(value) else "",
                "best": math.isfinite(value) and shown(m, winners.get(m.key, math.nan)) == shown(m, value),
            }
        )
    return cells


def _table_row(found: Comparison, row: Row, painted: Mapping[str, str], notes: list[str]) -> dict[str, Any]:
    own = () if row.competitor is None else row.competitor.notes
    notes += [note for note in own if note not in notes]
    filters = [each.values for each in found.rows if each.competitor is not None]
    cells = _cells(row.values, found.columns, _winners(filters, found.columns) if row.competitor is not None else {})
    if "estimated_error" in row.values:
        is_best = row.competitor is not None and (row is found.best or row in found.level)
        cells[0] |= {"shown": estimate_shown(row), "best": is_best}
    return {
        "name": row.name,
        "best": row is found.choice,
        "color": painted[row.name],
        "failure": row.failure,
        "notes": " ".join(str(notes.index(note) + 1) for note in own),
        "cells": cells,
    }


def _tuned_columns(found: Comparison) -> list[Measure]:
    keys = {key for _, point in found.tuned for key in point.values}
    return [m for m in MEASURES.values() if m.key in keys]


def _tuned(found: Comparison, painted: Mapping[str, str]) -> list[dict[str, Any]]:
    columns = _tuned_columns(found)
    winners = _winners([point.values for _, point in found.tuned], columns)
    return [
        {
            "name": point.call,
            "color": painted[curve.competitor.name],
            "cells": [
                {**cell, "shown": format_estimate(point.values[m.key], point.uncertainty)}
                if m.key == "estimated_error"
                else cell
                for m, cell in zip(columns, _cells(point.values, columns, winners), strict=True)
            ],
        }
        for curve, point in found.tuned
    ]


def _calls(found: Comparison) -> list[dict[str, str]]:
    return [
        {
            "name": row.name,
            "call": row.call,
            "chosen": ", ".join(
                f"{k} = {v:.4g}" if isinstance(v, float) else f"{k} = {v}" for k, v in row.chosen.items()
            ),
            "hash": row.hash,
        }
        for row in found.rows
    ]


def _sweep_note(found: Comparison) -> str:
    if found.sample is None:
        return ""
    return (
        f"On a mesh of this size this, and what follows on waves, is measured on a part of it, of "
        f"{len(found.sample.vertices):,} vertices, with one random perturbation."
    )


# --- what is drawn ---


def _drawn(found: Comparison) -> tuple[npt.NDArray[np.int64], Integers]:
    """The vertices that are drawn, and the faces between them: all, or some that stand for those in their cells."""
    V, F = found.given.vertices, found.given.faces
    if len(V) <= _DRAWN:
        return np.arange(len(V)), F
    return clustered(V, F, _DRAWN)


def clustered(V: Floats, F: Integers, most: int) -> tuple[npt.NDArray[np.int64], Integers]:
    """Vertex clustering that keeps vertices: of those in one cell of a grid, the first stands for all.

    Returns
    -------
    kept : (k,) int64
        Vertices, at most about ``most``.
    faces : (j, 3) int32
        By numbers of the kept; those that collapsed or came twice are left out.
    """
    low, extent = V.min(axis=0), float(np.ptp(V, axis=0).max()) or 1.0
    # the surface fills cells as the square of their number along a side
    cells = math.sqrt(most) / 1.2
    for _ in range(30):
        at = np.floor((V - low) / extent * cells).astype(np.int64)
        key = (at[:, 0] * 2**40) + (at[:, 1] * 2**20) + at[:, 2]
        _, kept, stands = np.unique(key, return_index=True, return_inverse=True)
        if len(kept) <= most:
            break
        cells *= 0.98 * math.sqrt(most / len(kept))
    faces = stands.reshape(-1)[F].astype(np.int32)
    a, b, c = faces.T
    faces = faces[(a != b) & (b != c) & (c != a)]
    _, first = np.unique(np.sort(faces, axis=1), axis=0, return_index=True)
    return kept, faces[np.sort(first)]


def _display_note(found: Comparison, drawn: tuple[npt.NDArray[np.int64], Integers]) -> str:
    kept, n = len(drawn[0]), len(found.given.vertices)
    if kept == n:
        return ""
    return (
        f"For the display only, the {n:,} vertices are thinned out to {kept:,}; all figures are of the whole mesh, and "
        "the meshes beside this page are whole, too."
    )


@dataclass(frozen=True, eq=False)
class _Shape:
    """What a panel shows."""

    name: str
    surface: Surface
    values: Mapping[str, Floats]
    row: Row | None


def _shapes(found: Comparison) -> list[_Shape]:
    """As given, the truth if it has the same faces, then the results, best first."""
    given = found.rows[0]
    shapes = [_Shape(_GIVEN, found.given, given.colors, given)]
    if found.truth is not None and np.array_equal(found.truth.faces, found.given.faces):
        flat = np.zeros(len(found.truth.vertices))
        shapes.append(_Shape(_TRUTH, found.truth, {"error": flat}, None))
    shapes += [
        _Shape(row.name, row.surface, row.colors, row)
        for row in found.ranked
        if row.surface is not None and row is not given
    ]
    return shapes


def _panels(
    found: Comparison, painted: Mapping[str, str], drawn: tuple[npt.NDArray[np.int64], Integers]
) -> list[dict[str, Any]]:
    shapes = _shapes(found)
    views = _views(found, shapes, drawn)
    pictures = _pictures(views, shapes[:_PICTURED], drawn)
    bars = [_scale_bar(view, found.edge) for view in views]
    return [
        {
            "name": shape.name,
            "color": plots.TRUTH if shape.row is None else painted[shape.name],
            "caption": "" if shape.row is None else _caption(shape.row),
            "shown": i < _SHOWN,
            "picture": pictures[i] if i < len(pictures) else "",
            "bars": bars,
        }
        for i, shape in enumerate(shapes)
    ]


def _caption(row: Row) -> str:
    words = []
    if "estimated_error" in row.values:
        words.append(f"error {format_estimate(row.values['estimated_error'], row.uncertainty, bare=True)}")
    if "true_error" in row.values:
        words.append(f"in truth {shown(MEASURES['true_error'], row.values['true_error'])}")
    return ", ".join(words)


def _views(
    found: Comparison, shapes: Sequence[_Shape], drawn: tuple[npt.NDArray[np.int64], Integers]
) -> tuple[View, View]:
    """The whole and a close-up."""
    kept, faces = drawn
    view = front(Surface(shapes[0].surface.vertices[kept], faces))
    return view, close_up(view, _eye_catcher(found), 0.28)


def _scale_bar(view: View, edge: float) -> dict[str, Any]:
    """A bar below a picture: its length in words, and as a share of the picture's width in per cent."""
    width = view.height / HEIGHT_BY_WIDTH
    length = plots.round_length(0.25 * width)
    return {"width": round(100 * length / width, 2), "shown": f"{length:g} ({length / edge:.2g} edges)"}


def _pictures(
    views: Sequence[View], shapes: Sequence[_Shape], drawn: tuple[npt.NDArray[np.int64], Integers]
) -> list[str]:
    """PNGs: the views, one below the other."""
    kept, faces = drawn
    encoded = []
    with temporary.folder() as folder:
        path = Path(folder) / "panel.png"
        for shape in shapes:
            render(path, [Panel("", Surface(shape.surface.vertices[kept], faces))], views)
            encoded.append("data:image/png;base64," + _text(path.read_bytes()))
    return encoded


def _eye_catcher(found: Comparison) -> Floats:
    """A point on the side that is seen first, where the surface bends most."""
    best = found.choice or found.best
    surface, bent = best.surface or found.given, np.abs(best.colors["curvature"])
    V, view = surface.vertices, front(surface)
    toward = view.direction / np.linalg.norm(view.direction)
    depth = V @ toward
    cells = np.floor((V - V.min(axis=0)) / (0.1 * float(np.ptp(V, axis=0).max()) or 1.0)).astype(np.int64)
    _, which = np.unique(cells, axis=0, return_inverse=True)
    which = which.reshape(-1)
    # mean bending of a tenth-wide cell, by how near to the eye it is
    count = np.bincount(which)
    mean = np.bincount(which, np.minimum(bent, np.quantile(bent, 0.95))) / count
    near = (np.bincount(which, depth) / count - depth.min()) / (float(np.ptp(depth)) or 1.0)
    chosen = int(np.argmax(mean * near**2 * np.minimum(count / count.mean(), 1.0)))
    middle = V[which == chosen].mean(axis=0)
    return np.asarray(V[np.argmin(((V - middle) ** 2).sum(axis=1))])


def _scene(
    found: Comparison,
    drawn: tuple[npt.NDArray[np.int64], Integers],
    panels: Sequence[Mapping[str, Any]],
) -> dict[str, Any]:
    """The meshes, quantized, for the script of the page."""
    kept, faces = drawn
    shapes = _shapes(found)
    low, high = found.given.vertices.min(axis=0), found.given.vertices.max(axis=0)
    margin = 0.05 * (high - low).max()  # what leaves this box is drawn at its walls
    low, size = low - margin, np.maximum(high - low + 2 * margin, 1e-300)
    extent = float(size.max())
    unit = 1 / extent  # the script's numbers are about 1
    wide = len(kept) > 2**16
    scales = {c.key: (c, *_range(found, c)) for c in _COLOURINGS if any(c.key in row.colors for row in found.rows)}
    meshes = []
    for shape in shapes:
        inside = np.clip((shape.surface.vertices[kept] - low) / size, 0, 1)
        values = {
            key: _text(np.clip(shape.values[key][kept], -_MOST_HALF, _MOST_HALF).astype("<f2").tobytes())
            for key in scales
            if key in shape.values
        }
        positions = np.round(_STEPS * inside).astype("<u2")
        meshes.append({"positions": _text(positions.tobytes()), "values": values})
    catcher = (_eye_catcher(found) - (low + size / 2)) * unit
    return {
        "corners": int(faces.size),
        "wide": wide,
        "faces": _text(faces.astype("<u4" if wide else "<u2").tobytes()),
        "before": 0,
        "meshes": meshes,
        "size": (size * unit).tolist(),
        "middle": (size * unit / 2).tolist(),
        "radius": float(np.linalg.norm(size * unit)) / 2,
        "height": 1.08 * float(np.ptp(found.given.vertices, axis=0).max()) * unit,
        "close": catcher.tolist(),
        "scales": {
            key: {"low": a, "high": b, "label": c.label, "unit": c.unit, "ramp": _text(_ramp(c).tobytes())}
            for key, (c, a, b) in scales.items()
        },
        "extent": extent,
        "edge": found.edge,
        "whole": len(kept) == len(found.given.vertices),
    }


def _range(found: Comparison, coloring: _Coloring) -> tuple[float, float]:
    """The common scale of all panels: from the results, and the mesh as given, that are not far astray."""
    limit = 1.1 * found.rows[0].values.get("estimated_error", 0.0)
    rows = [row for row in found.rows if not row.failure and row.values.get("estimated_error", 0.0) <= limit]
    values = np.concatenate([np.abs(row.colors[coloring.key]) for row in rows if coloring.key in row.colors])
    high = float(np.quantile(values, _QUANTILE)) or 1.0
    return (-high if coloring.signed else 0.0), high


def _ramp(coloring: _Coloring) -> npt.NDArray[np.uint8]:
    """(256, 3) colors."""
    import matplotlib

    return np.round(255 * matplotlib.colormaps[coloring.map](np.linspace(0, 1, 256))[:, :3]).astype(np.uint8)


def _text(data: bytes) -> str:
    return base64.b64encode(data).decode("ascii")


# --- MeshLab's own window ---


def _layers(found: Comparison) -> list[projects.Layer]:
    """One layer a result; quality is the error where the truth is known, else the distance moved.

    The mesh as given keeps its own colors. The others have those of their quality, with the range in the label.
    """
    coloring = next(c for c in _COLOURINGS if any(c.key in row.colors for row in found.rows))
    low, high = _range(found, coloring)
    what = "off" if coloring.key == "error" else "moved"
    layers = []
    for i, shape in enumerate(_shapes(found)):
        quality = shape.values.get(coloring.key, np.zeros(len(shape.surface.vertices)))
        colors: Floats | None = _warmth((quality - low) / (high - low))
        of_faces: Floats | None = None
        label = f"{shape.name} (blue 0, red {_percent(high)} % of an edge {what})"
        if i == 0 and (found.vertex_colors is not None or found.face_colors is not None):
            colors, of_faces = found.vertex_colors, found.face_colors
            label = f"{shape.name} (its own colors)"
        # all at one place: those that are hidden are a click away
        file = _layer_file(shape.name)
        layers.append(projects.Layer(_layer_label(label), file, shape.surface, quality, colors, i == 0, of_faces))
    return layers


def _percent(share: float) -> str:
    return f"{100 * share:.0f}" if share >= 0.1 else f"{100 * share:.2g}"


def _layer_label(text: str) -> str:
    """A label of a layer: MeshLab ends what it shows at the first dot, as if an ending of a file came next."""
    return text.replace(".", ",")


def _layer_file(name: str) -> str:
    return "".join(c if c.isalnum() else "_" for c in name.lower()).strip("_")[:40] + ".ply"


def _warmth(share: Floats) -> Floats:
    """Blue over white to red, (n, 3) for n shares in [0, 1]."""
    ends = np.array([[0.23, 0.30, 0.75], [0.87, 0.87, 0.87], [0.71, 0.02, 0.15]])
    x = np.clip(share, 0, 1)
    return np.stack([np.interp(x, [0, 0.5, 1], column) for column in ends.T], axis=1)

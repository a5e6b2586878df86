"""The bar chart and the tables of the page."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from meshlab_specsmooth.comparison.columns import MEASURES, Measure, format_estimate, format_value, is_bound
from meshlab_specsmooth.comparison.comparison import Comparison
from meshlab_specsmooth.comparison.rows import Row, format_estimated_error
from meshlab_specsmooth.comparison.tables import format_cell
from meshlab_specsmooth.reports.plots import round_length

_TITLES = {
    "estimated_error": "Estimated distance from the true surface",
    "true_error": "Distance from the true surface, which is known",
    "surface_error": "Distance from the true surface, which is known",
    "displacement": "Displacement of the vertices (it cannot be separated into noise and shape)",
}
# Bars that are longer than this multiple of the given mesh's end at the edge of the chart
_MAX_LENGTH = 1.3


def bar_measure(found: Comparison) -> Measure:
    """Return what the bars show: the first of these measures that some row has."""
    keys = {key for row in found.rows for key in row.values}
    return next(MEASURES[key] for key in _TITLES if key in keys)


def bar_title(found: Comparison) -> str:
    """Return the title of the chart."""
    return _TITLES[bar_measure(found).key]


def bar_ticks(found: Comparison) -> list[dict[str, Any]]:
    """Return the ticks of the axis with their positions in per cent of its length."""
    length = _axis_length(found)
    step = round_length(length / 3)
    digits = max(0, -math.floor(math.log10(step)))
    count = int(length / step) + 1
    return [{"at": round(100 * i * step / length, 2), "shown": f"{i * step:.{digits}f}"} for i in range(count)]


def make_bars(found: Comparison, colors: Mapping[str, str]) -> list[dict[str, Any]]:
    """Return a dict for each bar, the best first; lengths are in per cent of the axis."""
    measure, length = bar_measure(found), _axis_length(found)
    return [_make_bar(found, row, measure, length) | {"color": colors[row.name]} for row in found.ranked]


def _make_bar(found: Comparison, row: Row, measure: Measure, length: float) -> dict[str, Any]:
    is_estimate = measure.key == "estimated_error"
    value, upper = row.values.get(measure.key, 0.0), _upper_end(row, measure.key)
    spread = row.uncertainty if is_estimate and math.isfinite(row.uncertainty) else 0.0
    truth = row.values.get("true_error", math.inf) if is_estimate else math.inf
    text = format_cell(row, measure)
    return {
        "name": row.name,
        "best": row is found.choice,
        "ours": row.ours,
        "given": row.spec is None,
        "failure": row.failure,
        "beyond": upper > length,
        "bound": upper != value,
        "width": min(100.0, round(100 * upper / length, 2)),
        "low": round(100 * max(value - spread, 0.0) / length, 2),
        "spread": round(100 * min(2 * spread, value + spread) / length, 2) if upper == value <= length else 0.0,
        "truth": round(100 * truth / length, 2) if truth <= length else None,
        "shown": text,
        "tip": _make_tip(row, measure, text),
    }


def _upper_end(row: Row, key: str) -> float:
    """The length of a bar: the value, or the bound if only that is known."""
    value = row.values.get(key, 0.0)
    return value + row.uncertainty if key == "estimated_error" and is_bound(value, row.uncertainty) else value


def _axis_length(found: Comparison) -> float:
    """The end of the axis: it leaves out what is much worse than the mesh as given."""
    key = bar_measure(found).key
    given = _upper_end(found.rows[0], key)
    values = [_upper_end(row, key) for row in found.rows]
    return max([v for v in values if v <= _MAX_LENGTH * given or given == 0] or [given]) * 1.08 or 1.0


def _make_tip(row: Row, measure: Measure, text: str) -> str:
    if row.failure:
        return f"{row.name}\n{row.failure}"
    lines = [row.name, f"{measure.label} {text} edges"]
    for key in ("true_error", "normal_error", "noise_removed", "seconds"):
        if key in row.values and key != measure.key:
            other = MEASURES[key]
            lines.append(f"{other.label} {format_value(other, row.values[key])} {other.unit}")
    return "\n".join(lines)


# The second table begins with this measure
_FIRST_OF_SHAPE = "feature_loss"
_BEST: dict[str, Callable[[list[float]], float]] = {
    "low": min,
    "high": max,
    "zero": lambda values: min(values, key=abs),
}


def make_tables(found: Comparison, colors: Mapping[str, str]) -> tuple[list[dict[str, Any]], list[str]]:
    """Return two tables, because one with all measures would be wider than a window, and the footnotes of both."""
    footnotes = list(dict.fromkeys(note for row in found.ranked if row.spec is not None for note in row.spec.notes))
    rows = [_make_row(found, row, footnotes) | {"color": colors[row.name]} for row in found.ranked]
    columns = found.columns
    half = next((i for i, m in enumerate(columns) if m.key == _FIRST_OF_SHAPE), len(columns))
    halves = [("Error and run time", slice(0, half)), ("Changes of the shape", slice(half, None))]
    tables = [
        {
            "title": title,
            "columns": columns[some],
            "rows": [{**row, "cells": row["cells"][some]} for row in rows],
        }
        for title, some in halves
        if columns[some]
    ]
    return tables, footnotes


def list_tuned_columns(found: Comparison) -> list[Measure]:
    """Return the measures that were taken at every strength."""
    keys = {key for _, point in found.tuned for key in point.values}
    return [m for m in MEASURES.values() if m.key in keys]


def make_tuned_rows(found: Comparison, colors: Mapping[str, str]) -> list[dict[str, Any]]:
    """Return a row for each filter at its best strength."""
    columns = list_tuned_columns(found)
    best = _find_best([point.values for _, point in found.tuned], columns)
    rows = []
    for curve, point in found.tuned:
        cells = _make_cells(point.values, columns, best)
        for measure, cell in zip(columns, cells, strict=True):
            if measure.key == "estimated_error":
                cell["shown"] = format_estimate(point.values[measure.key], point.uncertainty)
        rows.append({"name": point.call, "color": colors[curve.spec.name], "cells": cells})
    return rows


def make_calls(found: Comparison) -> list[dict[str, str]]:
    """Return the call of each row, what the filter chose automatically, and the hash of its result."""
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


def _make_row(found: Comparison, row: Row, footnotes: list[str]) -> dict[str, Any]:
    notes = () if row.spec is None else row.spec.notes
    filters = [each.values for each in found.rows if each.spec is not None]
    best = {} if row.spec is None else _find_best(filters, found.columns)
    cells = _make_cells(row.values, found.columns, best)
    if "estimated_error" in row.values:  # always the first column
        is_best = row.spec is not None and (row is found.best or row in found.tied)
        cells[0] |= {"shown": format_estimated_error(row), "best": is_best}
    return {
        "name": row.name,
        "best": row is found.choice,
        "failure": row.failure,
        "notes": " ".join(str(footnotes.index(note) + 1) for note in notes),
        "cells": cells,
    }


def _find_best(rows: Sequence[Mapping[str, float]], columns: Sequence[Measure]) -> dict[str, float]:
    """The best value of each column, except of run times and where neither direction is better."""
    found = {}
    for column in columns:
        values = [row[column.key] for row in rows if math.isfinite(row.get(column.key, math.nan))]
        if column.better and len(set(values)) > 1 and column.key != "seconds":
            found[column.key] = _BEST[column.better](values)
    return found


def _make_cells(
    values: Mapping[str, float], columns: Sequence[Measure], best: Mapping[str, float]
) -> list[dict[str, Any]]:
    cells = []
    for m in columns:
        value = values.get(m.key, math.nan)
        sort_key = abs(value) if m.better == "zero" else value
        cells.append(
            {
                "shown": format_value(m, value),
                "value": f"{sort_key:.9g}" if math.isfinite(value) else "",
                "best": math.isfinite(value) and format_value(m, best.get(m.key, math.nan)) == format_value(m, value),
            }
        )
    return cells

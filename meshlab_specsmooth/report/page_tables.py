"""The tables of the page: all measures, each filter at its best strength, and the calls."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from meshlab_specsmooth.comparison.columns import MEASURES, Measure, format_estimate, format_value
from meshlab_specsmooth.comparison.ranking import Ranking
from meshlab_specsmooth.comparison.rows import Row, format_estimated_error

# The second table begins with this measure
_FIRST_OF_SHAPE = "feature_loss"
_BEST: dict[str, Callable[[list[float]], float]] = {
    "low": min,
    "high": max,
    "zero": lambda values: min(values, key=abs),
}


def make_tables(found: Ranking, colors: Mapping[str, str]) -> tuple[list[dict[str, Any]], list[str]]:
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


def list_tuned_columns(found: Ranking) -> list[Measure]:
    """Return the measures that were taken at every strength."""
    keys = {key for _, point in found.tuned for key in point.values}
    return [m for m in MEASURES.values() if m.key in keys]


def make_tuned_rows(found: Ranking, colors: Mapping[str, str]) -> list[dict[str, Any]]:
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


def make_calls(found: Ranking) -> list[dict[str, str]]:
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


def _make_row(found: Ranking, row: Row, footnotes: list[str]) -> dict[str, Any]:
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

"""The bar chart of the page: the error of each filter, or its displacement if no error is known."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from meshlab_specsmooth.comparison.columns import MEASURES, Measure, format_value, is_bound
from meshlab_specsmooth.comparison.ranking import Ranking
from meshlab_specsmooth.comparison.rows import Row
from meshlab_specsmooth.comparison.tables import format_cell
from meshlab_specsmooth.report.plots import round_length

_TITLES = {
    "estimated_error": "Estimated distance from the true surface",
    "true_error": "Distance from the true surface, which is known",
    "surface_error": "Distance from the true surface, which is known",
    "displacement": "Displacement of the vertices (it cannot be separated into noise and shape)",
}
# Bars that are longer than this multiple of the given mesh's end at the edge of the chart
_MAX_LENGTH = 1.3


def bar_measure(found: Ranking) -> Measure:
    """Return what the bars show: the first of these measures that some row has."""
    keys = {key for row in found.rows for key in row.values}
    return next(MEASURES[key] for key in _TITLES if key in keys)


def bar_title(found: Ranking) -> str:
    """Return the title of the chart."""
    return _TITLES[bar_measure(found).key]


def bar_ticks(found: Ranking) -> list[dict[str, Any]]:
    """Return the ticks of the axis with their positions in per cent of its length."""
    length = _axis_length(found)
    step = round_length(length / 3)
    digits = max(0, -math.floor(math.log10(step)))
    count = int(length / step) + 1
    return [{"at": round(100 * i * step / length, 2), "shown": f"{i * step:.{digits}f}"} for i in range(count)]


def make_bars(found: Ranking, colors: Mapping[str, str]) -> list[dict[str, Any]]:
    """Return a dict for each bar, the best first; lengths are in per cent of the axis."""
    measure, length = bar_measure(found), _axis_length(found)
    return [_make_bar(found, row, measure, length) | {"color": colors[row.name]} for row in found.ranked]


def _make_bar(found: Ranking, row: Row, measure: Measure, length: float) -> dict[str, Any]:
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


def _axis_length(found: Ranking) -> float:
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

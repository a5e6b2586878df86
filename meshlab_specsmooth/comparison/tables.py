"""The rows of a comparison as text and as HTML."""

from __future__ import annotations

import html
import math
from collections.abc import Iterable

from meshlab_specsmooth.comparison.columns import MEASURES, Measure, format_value
from meshlab_specsmooth.comparison.ranking import Ranking
from meshlab_specsmooth.comparison.rows import Row, format_estimated_error

_PRINTED = ("estimated_error", "true_error", "normal_error", "noise_removed", "feature_loss", "volume", "seconds")
_NAME_WIDTH, _CELL_WIDTH = 32, 18


def text_table(found: Ranking) -> str:
    """Return the rows as text with the most important columns, the best row first."""
    return format_rows(found.ranked, [m for m in found.columns if m.key in _PRINTED])


def format_rows(rows: Iterable[Row], columns: Iterable[Measure]) -> str:
    """Return rows as text, one a line below two lines of headings."""
    columns = list(columns)
    headings = ([m.label for m in columns], [m.unit for m in columns])
    lines = [" " * _NAME_WIDTH + _join(texts) for texts in headings]
    for row in rows:
        cells = f"  {row.failure}" if row.failure else _join(_format_cells(row, columns))
        lines.append(f"{row.name:{_NAME_WIDTH}}{cells}")
    return "\n".join(line.rstrip() for line in lines)


def html_table(found: Ranking) -> str:
    """Return the rows as an HTML table with all columns, the best row first."""
    head = "".join(
        f'<th title="{html.escape(m.help)}">{html.escape(m.label)}<br><small>{html.escape(m.unit)}</small></th>'
        for m in found.columns
    )
    body = []
    for row in found.ranked:
        cells = "".join(f"<td>{text}</td>" for text in _format_cells(row, found.columns))
        if row.failure:
            cells = f'<td colspan="{len(found.columns)}">{html.escape(row.failure)}</td>'
        body.append(f'<tr><th title="{html.escape(row.call)}">{html.escape(row.name)}</th>{cells}</tr>')
    return f"<table><thead><tr><th></th>{head}</tr></thead><tbody>{''.join(body)}</tbody></table>"


def format_cell(row: Row, measure: Measure) -> str:
    """Return the value of a row in a column; empty if it has none."""
    if measure is MEASURES["estimated_error"]:
        return format_estimated_error(row)
    return format_value(measure, row.values.get(measure.key, math.nan))


def _format_cells(row: Row, columns: Iterable[Measure]) -> list[str]:
    return [format_cell(row, measure) for measure in columns]


def _join(cells: Iterable[str]) -> str:
    return "".join(f"{cell:>{_CELL_WIDTH}}" for cell in cells)

"""The rows of a comparison as text and as HTML."""

from __future__ import annotations

import html
import math
from collections.abc import Iterable, Sequence

from meshlab_specsmooth.comparison.columns import MEASURES, Measure, format_value
from meshlab_specsmooth.comparison.rows import Row, format_estimated_error

_PRINTED = ("estimated_error", "true_error", "normal_error", "noise_removed", "feature_loss", "volume", "seconds")
_NAME_WIDTH, _CELL_WIDTH = 32, 18


def text_table(rows: Iterable[Row], columns: Iterable[Measure]) -> str:
    """Return rows as text with the most important of the columns."""
    return format_rows(rows, [m for m in columns if m.key in _PRINTED])


def format_rows(rows: Iterable[Row], columns: Iterable[Measure]) -> str:
    """Return rows as text, one a line below two lines of headings."""
    columns = list(columns)
    headings = ([m.label for m in columns], [m.unit for m in columns])
    lines = [" " * _NAME_WIDTH + _join(texts) for texts in headings]
    for row in rows:
        cells = f"  {row.failure}" if row.failure else _join(_format_cells(row, columns))
        lines.append(f"{row.name:{_NAME_WIDTH}}{cells}")
    return "\n".join(line.rstrip() for line in lines)


def html_table(rows: Iterable[Row], columns: Sequence[Measure]) -> str:
    """Return rows as an HTML table with all of the columns."""
    head = "".join(
        f'<th title="{html.escape(m.help)}">{html.escape(m.label)}<br><small>{html.escape(m.unit)}</small></th>'
        for m in columns
    )
    body = []
    for row in rows:
        cells = "".join(f"<td>{text}</td>" for text in _format_cells(row, columns))
        if row.failure:
            cells = f'<td colspan="{len(columns)}">{html.escape(row.failure)}</td>'
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

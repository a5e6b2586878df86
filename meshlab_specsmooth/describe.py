"""Display of results: a line for ``repr``, a short block for ``print``, a table and a picture in notebooks."""

from __future__ import annotations

import html
import importlib
import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

Rows = Sequence[tuple[str, str]]

#: Data of a picture: vertices before and after, and the faces.
Pictured = tuple[npt.NDArray[np.float64], npt.NDArray[np.float64], npt.NDArray[np.int32]]

# Smallest length displayed, in mean edges; for estimates, 0 only means that they are below it
_MIN_SHOWN = 0.001

_TABLE = "border-collapse: collapse; font-variant-numeric: tabular-nums"
_CELL = "text-align: left; padding: 1px 12px 1px 0"


def _draw(pictured: Pictured) -> str:
    """Render a picture as HTML; the renderer is in a higher layer and imported at the first call."""
    return str(importlib.import_module("meshlab_specsmooth.reports.thumbnails").draw(pictured))


class Described:
    """Base of results, which are displayed by a summary, rows and a picture."""

    @property
    def summary(self) -> str:
        """Summary of the result in one sentence."""
        raise NotImplementedError

    def rows(self) -> Rows:
        """Return names and values to display below the summary."""
        return ()

    def pictured(self) -> Pictured | None:
        """Return the data of a picture, if there is one."""
        return None

    def __repr__(self) -> str:
        return f"<{type(self).__name__}: {self.summary}>"

    def __str__(self) -> str:
        return describe_block(self.summary, self.rows())

    def _repr_html_(self) -> str:
        return describe_html(self.summary, self.rows(), self.pictured())


class Sentence(Described):
    """A result that is displayed by its summary only."""

    def __init__(self, summary: str) -> None:
        self._summary = summary

    @property
    def summary(self) -> str:
        """The sentence."""
        return self._summary


class Report(dict[str, Any]):
    """The dict that a filter on a MeshSet returns, with a short display.

    Parameters
    ----------
    values : mapping
        The entries of the dict.
    described : Described
        Provides the display, except for the entries ``warning`` and ``seconds``, which may change later.
    """

    def __init__(self, values: Mapping[str, Any], described: Described) -> None:
        super().__init__(values)
        self._described = described

    @property
    def summary(self) -> str:
        """Summary of the result in one sentence."""
        return self._described.summary

    def rows(self) -> Rows:
        """Return names and values to display below the summary."""
        rows = [row for row in self._described.rows() if row[0] not in ("time", "warning")]
        if self.get("seconds") is not None:
            rows.append(("time", f"{self['seconds']:.2f} s"))
        return rows if self.get("warning") is None else [*rows, ("warning", self["warning"])]

    def __repr__(self) -> str:
        return f"<{type(self).__name__}: {self.summary}>"

    def __str__(self) -> str:
        return describe_block(self.summary, self.rows())

    def _repr_html_(self) -> str:
        return describe_html(self.summary, self.rows(), self._described.pictured())


def describe_block(summary: str, rows: Rows) -> str:
    """Format a summary with rows below it, in two columns.

    Examples
    --------
    >>> from meshlab_specsmooth.describe import describe_block
    >>> print(describe_block("white noise", [("level", "0.2 edges"), ("interval", "0.1 to 0.3 edges")]))
    white noise
      level     0.2 edges
      interval  0.1 to 0.3 edges
    """
    width = max((len(name) for name, _ in rows), default=0)
    return "\n".join([summary, *(f"  {name:{width}}  {value}" for name, value in rows)])


def describe_html(summary: str, rows: Rows, pictured: Pictured | None = None) -> str:
    """Format a summary, rows and optionally a picture as HTML for notebooks."""
    lines = "".join(
        f'<tr><th style="{_CELL}">{html.escape(name)}</th><td style="{_CELL}">{html.escape(value)}</td></tr>'
        for name, value in rows
    )
    picture = "" if pictured is None else _draw(pictured)
    return f'<div><p><b>{html.escape(summary)}</b></p><table style="{_TABLE}">{lines}</table>{picture}</div>'


def format_edges(length: float, edge: float) -> str:
    """Format a length in mean edges, without the unit; only 0 is displayed as zero.

    Examples
    --------
    >>> from meshlab_specsmooth.describe import format_edges
    >>> format_edges(0.0419, 0.5), format_edges(1e-6, 0.5), format_edges(0.0, 0.5)
    ('0.084', 'less than 0.001', '0')
    """
    edges = abs(length) / (edge or 1.0)
    if edges == 0:
        return "0"
    return f"{math.copysign(edges, length):.3f}" if edges >= _MIN_SHOWN else f"less than {_MIN_SHOWN}"


def format_bound(bound: float, edge: float) -> str:
    """Format an upper bound in mean edges, which is never displayed as zero."""
    return f"at most {max(bound / (edge or 1.0), _MIN_SHOWN):.3f}"


def format_length(length: float, edge: float) -> str:
    """Format a length in mean edges and in mesh units.

    Examples
    --------
    >>> from meshlab_specsmooth.describe import format_length
    >>> format_length(0.0419, 0.5)
    '0.084 edges (0.0419)'
    """
    return f"{format_edges(length, edge)} edges ({length:.3g})"


def count_of(number: int, name: str) -> str:
    """Format a number with a noun in singular or plural.

    Examples
    --------
    >>> from meshlab_specsmooth.describe import count_of
    >>> count_of(1, "mode"), count_of(2, "mode")
    ('1 mode', '2 modes')
    """
    return f"{number} {name}" if number == 1 else f"{number} {name}s"

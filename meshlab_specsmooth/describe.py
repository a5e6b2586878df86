"""How results read: a line for ``repr``, a short block for ``print``, a table and a picture in a notebook."""

from __future__ import annotations

import html
import importlib
import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

Rows = Sequence[tuple[str, str]]

#: Vertices before, after, and the faces of both: what a picture is made of.
Pictured = tuple[npt.NDArray[np.float64], npt.NDArray[np.float64], npt.NDArray[np.int32]]

# The least that is shown of a length in mean edges: of an estimate, zero means no more than that it is lower
_LEAST = 0.001

_TABLE = "border-collapse: collapse; font-variant-numeric: tabular-nums"
_CELL = "text-align: left; padding: 1px 12px 1px 0"


def _draw(pictured: Pictured) -> str:
    """An image for HTML; the renderer, which stands above this, is loaded for the first one."""
    return str(importlib.import_module("meshlab_specsmooth.report.thumbnails").draw(pictured))


class Described:
    """Base of results: from a summary and rows to what is shown of them."""

    @property
    def summary(self) -> str:
        """The result in a sentence."""
        raise NotImplementedError

    def rows(self) -> Rows:
        """What is shown below the summary: names and values."""
        return ()

    def pictured(self) -> Pictured | None:
        """What is shown before and after, if anything."""
        return None

    def __repr__(self) -> str:
        return f"<{type(self).__name__}: {self.summary}>"

    def __str__(self) -> str:
        return describe_block(self.summary, self.rows())

    def _repr_html_(self) -> str:
        return describe_html(self.summary, self.rows(), self.pictured())


class Sentence(Described):
    """A result of which there is no more to say than its summary."""

    def __init__(self, summary: str) -> None:
        self._summary = summary

    @property
    def summary(self) -> str:
        """The sentence."""
        return self._summary


class Report(dict[str, Any]):
    """What a filter returns on a MeshSet: a dict, which prints short.

    Parameters
    ----------
    values : mapping
        The entries of the dict.
    described : Described
        What is shown of them. The entries ``warning`` and ``seconds`` may change afterward.
    """

    def __init__(self, values: Mapping[str, Any], described: Described) -> None:
        super().__init__(values)
        self._described = described

    @property
    def summary(self) -> str:
        """The result in a sentence."""
        return self._described.summary

    def rows(self) -> Rows:
        """What is shown below the summary."""
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
    """A summary, and rows below it in two columns.

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
    """The same for a notebook, with a picture where there is something to see."""
    lines = "".join(
        f'<tr><th style="{_CELL}">{html.escape(name)}</th><td style="{_CELL}">{html.escape(value)}</td></tr>'
        for name, value in rows
    )
    picture = "" if pictured is None else _draw(pictured)
    return f'<div><p><b>{html.escape(summary)}</b></p><table style="{_TABLE}">{lines}</table>{picture}</div>'


def format_edges(length: float, edge: float) -> str:
    """A length in mean edges, without the unit; what is not zero is not shown as zero.

    Examples
    --------
    >>> from meshlab_specsmooth.describe import format_edges
    >>> format_edges(0.0419, 0.5), format_edges(1e-6, 0.5), format_edges(0.0, 0.5)
    ('0.084', 'less than 0.001', '0')
    """
    share = abs(length) / (edge or 1.0)
    if share == 0:
        return "0"
    return f"{math.copysign(share, length):.3f}" if share >= _LEAST else f"less than {_LEAST}"


def format_bound(bound: float, edge: float) -> str:
    """An upper bound in mean edges, rounded up where it would read as zero."""
    return f"at most {max(bound / (edge or 1.0), _LEAST):.3f}"


def format_length(length: float, edge: float) -> str:
    """A length in mean edges, and in mesh units.

    Examples
    --------
    >>> from meshlab_specsmooth.describe import format_length
    >>> format_length(0.0419, 0.5)
    '0.084 edges (0.0419)'
    """
    return f"{format_edges(length, edge)} edges ({length:.3g})"


def count_of(number: int, name: str) -> str:
    """A number of things.

    Examples
    --------
    >>> from meshlab_specsmooth.describe import count_of
    >>> count_of(1, "mode"), count_of(2, "mode")
    ('1 mode', '2 modes')
    """
    return f"{number} {name}" if number == 1 else f"{number} {name}s"

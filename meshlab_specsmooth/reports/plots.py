"""Plots of a comparison as SVG, for the page."""

from __future__ import annotations

import io
import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from meshlab_specsmooth.arrays import Floats
from meshlab_specsmooth.comparison.columns import MEASURES, format_estimate, format_value
from meshlab_specsmooth.comparison.comparison import Comparison
from meshlab_specsmooth.comparison.rows import Point, Row
from meshlab_specsmooth.errors import MissingExtra
from meshlab_specsmooth.reports.scene import row_colors

_STYLE = {
    "svg.fonttype": "none",
    "svg.hashsalt": "specsmooth",
    "font.family": "sans-serif",
    "font.size": 10,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.color": "#e6e9ee",
    "axes.edgecolor": "#8a94a0",
}
# Measures that are plotted against the noise removed, in the order of the page
_COSTS = ("estimated_error", "volume", "offset", "feature_loss", "displacement")


# Points in the axes of a plot, in its units, with the text of their tips
Marks = list[tuple[float, float, str]]


@dataclass(frozen=True)
class Plot:
    """A picture with tips.

    Attributes
    ----------
    svg : str
    marks : tuple of (float, float, str)
        Positions as fractions of width and height, from the upper left corner, with the text of their tips.
    """

    svg: str
    marks: tuple[tuple[float, float, str], ...]


def round_length(most: float) -> float:
    """Return the largest number up to ``most`` that is 1, 2 or 5 times a power of ten.

    Examples
    --------
    >>> from meshlab_specsmooth.reports.plots import round_length
    >>> round_length(0.7), round_length(31.0), round_length(0.2)
    (0.5, 20.0, 0.2)
    """
    power = 10.0 ** math.floor(math.log10(most) + 1e-9)
    digit = next(d for d in (5, 2, 1) if d * power <= most * (1 + 1e-9))
    return float(f"{digit * power:.1g}")


def plot_curves(found: Comparison) -> list[Plot]:
    """Plot the side effects of each filter against the noise removed, and estimated against true errors."""
    known = {key for curve in found.curves for point in curve.points for key in point.values}
    left_out = "offset" if "volume" in known else "volume"
    plots = [
        _svg((5.2, 3.7), _cost(found, key), f"{MEASURES[key].label} against noise removed")
        for key in _COSTS
        if key in known and key != left_out
    ]
    if len(found.errors()) > 1:
        plots.append(_svg((5.2, 3.7), lambda axes: _agreement(found, axes), "estimated against true error"))
    return plots


def plot_spectra(found: Comparison) -> list[Plot]:
    """Plot the transfer functions and the spectra."""
    return [
        _svg((6.6, 4.0), lambda axes: _responses(found, axes), "transfer functions"),
        _svg((6.6, 4.0), lambda axes: _spectra(found, axes), "spectra"),
    ]


def _svg(size: tuple[float, float], draw: Callable[[Any], Marks], title: str) -> Plot:
    try:
        import matplotlib
        from matplotlib.figure import Figure
    except ImportError as error:
        raise MissingExtra("a plot", "report") from error
    with matplotlib.rc_context(_STYLE):
        figure = Figure(figsize=size, layout="constrained")
        axes = figure.add_subplot()
        found = draw(axes)
        out = io.StringIO()
        figure.savefig(out, format="svg", metadata={"Date": None, "Creator": None, "Format": None, "Type": None})
    marks = _to_picture(axes, found)
    text = out.getvalue()
    # identifiers must be unique within the page
    prefix = re.sub(r"\W+", "-", title)
    text = re.sub(r'\bid="', f'id="{prefix}-', text[text.index("<svg") :])
    text = re.sub(r'(xlink:href="|url\()#', rf"\1#{prefix}-", text)
    return Plot(text.replace("<svg", f'<svg role="img" aria-label="{title}"', 1), marks)


def _to_picture(axes: Any, marks: Marks) -> tuple[tuple[float, float, str], ...]:
    """Positions of marks in the picture, without those outside of the axes."""
    if not marks:
        return ()
    box, at = axes.bbox, axes.transData.transform([mark[:2] for mark in marks])
    width, height = axes.figure.bbox.size
    return tuple(
        (round(float(x / width), 4), round(float(1 - y / height), 4), text)
        for (x, y), (_, _, text) in zip(at, marks, strict=True)
        if box.x0 - 1 <= x <= box.x1 + 1 and box.y0 - 1 <= y <= box.y1 + 1
    )


def _line(row: Row) -> dict[str, Any]:
    return {"linewidth": 2.2 if row.ours else 1.3, "zorder": 3 if row.ours else 2}


def _cost(found: Comparison, key: str) -> Callable[[Any], Marks]:
    def draw(axes: Any) -> Marks:
        marks: Marks = []
        measure, by_name = MEASURES[key], row_colors(found)
        rows = {row.name: row for row in found.rows}
        limit = _axis_limits(found, key)
        for curve in found.curves:
            row = rows[curve.spec.name]
            at = sorted(
                (_position(point, key) for point in curve.points if _removes_noise(point)), key=lambda xy: -xy[0]
            )
            color, style = by_name[row.name], _line(row)
            axes.plot(*np.transpose(at or np.empty((0, 2))), marker="o", markersize=3, color=color, **style)
            marks += [
                (*_position(point, key), _make_tip(row.name, key, point))
                for point in curve.points
                if _removes_noise(point)
            ]
        for row in found.rows:
            if row.spec is not None and key in row.values and found.sample is None:
                x, y = max(100 - row.values["noise_removed"], _MIN_LEFT), row.values[key]
                axes.plot(
                    [x], [y], marker="D", markersize=7, color=by_name[row.name], markeredgecolor="white", zorder=5
                )
                marks.append((x, y, _make_tip(f"{row.name}, at its defaults", key, row)))
        _set_noise_axis(found, axes)
        axes.set_ylim(*limit)
        if measure.better == "zero":
            axes.axhline(0, color="#8a94a0", linewidth=0.8)
        axes.set_ylabel(f"{measure.label} ({measure.unit})")
        return [mark for mark in marks if np.isfinite(mark[:2]).all()]

    return draw


def _make_tip(name: str, key: str, at: Point | Row) -> str:
    """The text of the tip of a filter."""
    measure, value = MEASURES[key], at.values.get(key, np.nan)
    figure = format_estimate(value, at.uncertainty) if key == "estimated_error" else format_value(measure, value)
    lines = [name, f"{measure.label} {figure} {measure.unit}", f"noise removed {at.values['noise_removed']:.1f} %"]
    return "\n".join([*lines, at.call])


# Lower limit of the noise left in per cent, below which shape dominates the measure; ticks
_MIN_LEFT, _TICKS = 0.5, (100, 50, 20, 10, 5, 2, 1)


def _set_noise_axis(found: Comparison, axes: Any) -> None:
    """Set the horizontal axis to noise removed, on a logarithmic scale of the noise left."""
    left = [_position(point, "")[0] for curve in found.curves for point in curve.points if _removes_noise(point)]
    low, high = min(left, default=1.0), max(left, default=100.0)
    axes.set_xscale("log")
    axes.set_xlim(min(1.25 * high, 110), 0.8 * low)
    axes.minorticks_off()
    axes.set_xticks(_TICKS, [f"{100 - mark}" for mark in _TICKS])
    axes.set_xlim(min(1.25 * high, 110), 0.8 * low)
    axes.set_xlabel("noise removed (%)")


def _position(point: Point, key: str) -> tuple[float, float]:
    return max(100 - point.values["noise_removed"], _MIN_LEFT), point.values.get(key, np.nan)


def _removes_noise(point: Point) -> bool:
    return point.values["noise_removed"] > -5


def _axis_limits(found: Comparison, key: str) -> tuple[float, float]:
    """Limits of an axis: the middle three quarters of all points and a margin, because some filters diverge."""
    values = np.array([point.values[key] for c in found.curves for point in c.points if key in point.values] or [0.0])
    if key == "estimated_error":
        return 0.0, 1.25 * found.rows[0].values["estimated_error"] or 1.0
    low, high = np.quantile(values, [0.12, 0.88])
    room = 0.35 * (high - low) or max(abs(high), 1e-6)
    return (0.0 if (values >= 0).all() else float(min(low - room, 0.0))), float(max(high + room, 0.0))


def _agreement(found: Comparison, axes: Any) -> Marks:
    marks: Marks = []
    by_name = row_colors(found)
    limit = 1.05 * found.rows[0].values["estimated_error"] or 1.0
    points: list[tuple[str, Mapping[str, float]]] = [(row.name, row.values) for row in found.rows]
    points += [(c.spec.name, p.values) for c in found.curves for p in c.points]
    for name, values in points:
        if "true_error" in values and values.get("estimated_error", np.inf) <= limit:
            x, y = values["true_error"], values["estimated_error"]
            axes.plot([x], [y], "o", markersize=4, color=by_name[name])
            marks.append((x, y, f"{name}\nestimated {y:.3f} edges\ntrue {x:.3f} edges"))
    axes.plot([0, limit], [0, limit], color="#8a94a0", linewidth=0.8)
    axes.set_xlim(0, limit)
    axes.set_ylim(0, limit)
    axes.set_xlabel("true error (edges)")
    axes.set_ylabel("estimated error (edges)")
    if np.isfinite(found.correlation):
        axes.text(0.04, 0.92, f"correlation {found.correlation:.4f}", transform=axes.transAxes)
    return marks


def _responses(found: Comparison, axes: Any) -> Marks:
    marks: Marks = []
    by_name = row_colors(found)
    limit = found.rows[0].values.get("estimated_error", np.nan)
    for row in found.rows:
        if row.response is not None and row.values["estimated_error"] <= limit:
            axes.plot(found.eigenvalues, row.response, color=by_name[row.name], **_line(row))
            marks += _along(row.name, found.eigenvalues, row.response, "transmitted", "{:.2f}")
    axes.axhline(0, color="#8a94a0", linewidth=0.8)
    axes.set_ylim(-0.15, 1.15)
    axes.set_xscale("log")
    axes.set_xlabel("eigenvalue of the Laplacian (shape left, noise right)")
    axes.set_ylabel("H: transmitted fraction")
    return marks


def _along(name: str, eigenvalues: Floats, values: Floats, what: str, form: str) -> Marks:
    """Marks of a curve over eigenvalues."""
    return [
        (float(x), float(y), f"{name}\n{form.format(y)} {what}\neigenvalue {x:.2g}")
        for x, y in zip(eigenvalues, values, strict=True)
        if np.isfinite(y)
    ]


def _spectra(found: Comparison, axes: Any) -> Marks:
    marks: Marks = []
    by_name = row_colors(found)
    least = np.inf
    for row in found.rows:
        if row.power is not None and (row.power > 0).any():
            style = _line(row) if row.spec is not None else {"linewidth": 2.2, "linestyle": "--"}
            power = np.where(row.power > 0, row.power, np.nan)
            least = min(least, float(np.nanmax(power)) * 1e-5)
            axes.plot(found.eigenvalues, power, color=by_name[row.name], **style)
            marks += _along(row.name, found.eigenvalues, power, "edges² of energy", "{:.2g}")
    axes.set_xscale("log")
    axes.set_yscale("log")
    if np.isfinite(least):
        axes.set_ylim(bottom=least)
    axes.set_xlabel("eigenvalue of the Laplacian")
    axes.set_ylabel("energy of the differential coordinates (edges²)")
    return marks

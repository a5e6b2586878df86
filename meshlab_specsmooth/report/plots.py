"""Plots of a comparison, as SVG to be put into a page."""

from __future__ import annotations

import io
import re
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from meshlab_specsmooth.compare.comparison import MEASURES, Comparison, Point, Row
from meshlab_specsmooth.errors import MissingExtra

# ours stand out; MeshLab's are told from each other
_OURS = ("#1457b8", "#12a0c4", "#7a4fd0", "#4c8a2a")
_THEIRS = ("#d1495b", "#e08e0b", "#8c5a2b", "#c65bb0", "#7f7f7f", "#b0a400", "#e377c2", "#555555")
GIVEN, TRUTH = "#9aa5b1", "#2f2f2f"

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
# against noise removed: what it costs, in the order of the page
_COSTS = ("estimated_error", "volume", "offset", "feature_loss", "displacement")


def colours(found: Comparison) -> dict[str, str]:
    """A colour for each row, by its name; ours in blue, violet and green."""
    ours, theirs, chosen = iter(_OURS * 9), iter(_THEIRS * 9), {}
    for row in reversed(found.rows):  # the last of ours, the automatic ones, get the first of the blues
        if row.competitor is not None and row.competitor.ours:
            chosen[row.name] = next(ours)
    for row in found.rows:
        if row.competitor is None:
            chosen[row.name] = GIVEN
        elif not row.competitor.ours:
            chosen[row.name] = next(theirs)
    return chosen


def curves(found: Comparison) -> list[str]:
    """What each filter costs over its strengths, against the noise removed; and estimated against true error."""
    closed = any("volume" in point.values for curve in found.curves for point in curve.points)
    plots = [
        _svg((5.2, 3.7), _cost(found, key), f"{MEASURES[key].label} against noise removed")
        for key in _COSTS
        if key != ("offset" if closed else "volume")
    ]
    if len(found.errors()) > 1:
        plots.append(_svg((5.2, 3.7), lambda axes: _agreement(found, axes), "estimated against true error"))
    return plots


def waves(found: Comparison) -> list[str]:
    """Transfer functions and spectra."""
    return [
        _svg((6.6, 4.0), lambda axes: _responses(found, axes), "transfer functions"),
        _svg((6.6, 4.0), lambda axes: _spectra(found, axes), "spectra"),
    ]


def _svg(size: tuple[float, float], draw: Callable[[Any], None], title: str) -> str:
    try:
        import matplotlib
        from matplotlib.figure import Figure
    except ImportError as error:
        raise MissingExtra("a plot", "report") from error
    with matplotlib.rc_context(_STYLE):
        figure = Figure(figsize=size, layout="constrained")
        draw(figure.add_subplot())
        out = io.StringIO()
        figure.savefig(out, format="svg", metadata={"Date": None, "Creator": None, "Format": None, "Type": None})
    text = out.getvalue()
    # identifiers are shared by all that is in one page
    prefix = re.sub(r"\W+", "-", title)
    text = re.sub(r'\bid="', f'id="{prefix}-', text[text.index("<svg") :])
    text = re.sub(r'(xlink:href="|url\()#', rf"\1#{prefix}-", text)
    return text.replace("<svg", f'<svg role="img" aria-label="{title}"', 1)


def _line(row: Row) -> dict[str, Any]:
    ours = row.competitor is not None and row.competitor.ours
    return {"linewidth": 2.2 if ours else 1.3, "zorder": 3 if ours else 2}


def _cost(found: Comparison, key: str) -> Callable[[Any], None]:
    def draw(axes: Any) -> None:
        measure, painted = MEASURES[key], colours(found)
        rows = {row.name: row for row in found.rows}
        limit = _limit(found, key)
        for curve in found.curves:
            row = rows[curve.competitor.name]
            at = sorted((_place(point, key) for point in curve.points if _useful(point)), key=lambda xy: -xy[0])
            colour, style = painted[row.name], _line(row)
            axes.plot(*np.transpose(at or np.empty((0, 2))), marker="o", markersize=3, color=colour, **style)
        for row in found.rows:
            if row.competitor is not None and key in row.values and found.sample is None:
                x, y = max(100 - row.values["noise_removed"], _LEAST_LEFT), row.values[key]
                axes.plot(
                    [x], [y], marker="D", markersize=7, color=painted[row.name], markeredgecolor="white", zorder=5
                )
        _along_noise(found, axes)
        axes.set_ylim(*limit)
        if measure.better == "zero":
            axes.axhline(0, color="#8a94a0", linewidth=0.8)
        axes.set_ylabel(f"{measure.label} ({measure.unit})")

    return draw


# per cent of noise left, and no less: what is left of all noise is shape
_LEAST_LEFT, _MARKS = 0.5, (100, 50, 20, 10, 5, 2, 1)


def _along_noise(found: Comparison, axes: Any) -> None:
    """The axis: noise removed, as the logarithm of what is left."""
    left = [_place(point, "")[0] for curve in found.curves for point in curve.points if _useful(point)]
    low, high = min(left, default=1.0), max(left, default=100.0)
    axes.set_xscale("log")
    axes.set_xlim(min(1.25 * high, 110), 0.8 * low)
    axes.minorticks_off()
    axes.set_xticks(_MARKS, [f"{100 - mark}" for mark in _MARKS])
    axes.set_xlim(min(1.25 * high, 110), 0.8 * low)
    axes.set_xlabel("noise removed (%)")


def _place(point: Point, key: str) -> tuple[float, float]:
    return max(100 - point.values["noise_removed"], _LEAST_LEFT), point.values.get(key, np.nan)


def _useful(point: Point) -> bool:
    return point.values["noise_removed"] > -5


def _limit(found: Comparison, key: str) -> tuple[float, float]:
    """What to show of an axis: three quarters of all points, and half as much again; some filters go far astray."""
    values = np.array([point.values[key] for c in found.curves for point in c.points if key in point.values] or [0.0])
    if key == "estimated_error":
        return 0.0, 1.25 * found.rows[0].values["estimated_error"] or 1.0
    low, high = np.quantile(values, [0.12, 0.88])
    room = 0.35 * (high - low) or max(abs(high), 1e-6)
    return (0.0 if (values >= 0).all() else float(min(low - room, 0.0))), float(max(high + room, 0.0))


def _agreement(found: Comparison, axes: Any) -> None:
    painted = colours(found)
    limit = 1.05 * found.rows[0].values["estimated_error"] or 1.0
    points: list[tuple[str, Mapping[str, float]]] = [(row.name, row.values) for row in found.rows]
    points += [(c.competitor.name, p.values) for c in found.curves for p in c.points]
    for name, values in points:
        if "true_error" in values and values.get("estimated_error", np.inf) <= limit:
            axes.plot([values["true_error"]], [values["estimated_error"]], "o", markersize=4, color=painted[name])
    axes.plot([0, limit], [0, limit], color="#8a94a0", linewidth=0.8)
    axes.set_xlim(0, limit)
    axes.set_ylim(0, limit)
    axes.set_xlabel("true error (edges)")
    axes.set_ylabel("estimated error (edges)")
    if np.isfinite(found.correlation):
        axes.text(0.04, 0.92, f"correlation {found.correlation:.4f}", transform=axes.transAxes)


def _responses(found: Comparison, axes: Any) -> None:
    painted = colours(found)
    limit = found.rows[0].values["estimated_error"]
    for row in found.rows:
        if row.response is not None and row.values["estimated_error"] <= limit:
            axes.plot(found.eigenvalues, row.response, color=painted[row.name], **_line(row))
    axes.axhline(0, color="#8a94a0", linewidth=0.8)
    axes.set_ylim(-0.15, 1.15)
    axes.set_xscale("log")
    axes.set_xlabel("eigenvalue of the Laplacian (long waves left, noise right)")
    axes.set_ylabel("H: what comes through")


def _spectra(found: Comparison, axes: Any) -> None:
    painted = colours(found)
    least = np.inf
    for row in found.rows:
        if row.power is not None and (row.power > 0).any():
            style = _line(row) if row.competitor is not None else {"linewidth": 2.2, "linestyle": "--"}
            power = np.where(row.power > 0, row.power, np.nan)
            least = min(least, float(np.nanmax(power)) * 1e-5)
            axes.plot(found.eigenvalues, power, color=painted[row.name], **style)
    axes.set_xscale("log")
    axes.set_yscale("log")
    if np.isfinite(least):
        axes.set_ylim(bottom=least)
    axes.set_xlabel("eigenvalue of the Laplacian")
    axes.set_ylabel("energy of the differential coordinates (edges²)")

"""Colors of a comparison: those of its rows, and the color maps of its surfaces."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from meshlab_specsmooth.arrays import Floats
from meshlab_specsmooth.comparison.ranking import Ranking

# Blue, violet and green for this package's filters; MeshLab's have the other hues
_OURS = ("#1457b8", "#12a0c4", "#7a4fd0", "#4c8a2a", "#0d2f6b")
_MESHLAB = ("#d1495b", "#e08e0b", "#8c5a2b", "#c65bb0", "#7f7f7f", "#b0a400", "#e377c2", "#555555")
GIVEN, TRUTH = "#9aa5b1", "#2f2f2f"
# Color maps end at this quantile over all results that are better than the mesh as given
_QUANTILE = 0.98


@dataclass(frozen=True)
class Coloring:
    """A quantity that surfaces are colored by: its key in the colors of a row, its label, unit and color map."""

    key: str
    label: str
    unit: str
    map: str
    signed: bool


COLORINGS = (
    Coloring("error", "distance to the truth", "mean edges", "viridis", False),
    Coloring("displacement", "displacement", "mean edges", "viridis", False),
    Coloring("curvature", "curvature", "(concave to convex, per mean edge)", "coolwarm", True),
)


def row_colors(found: Ranking) -> dict[str, str]:
    """Return a color for each row, by its name."""
    ours, others, colors = iter(_OURS * 9), iter(_MESHLAB * 9), {}
    for row in reversed(found.rows):  # the automatic filters come last and get the first of the blues
        if row.ours:
            colors[row.name] = next(ours)
    for row in found.rows:
        if row.spec is None:
            colors[row.name] = GIVEN
        elif not row.ours:
            colors[row.name] = next(others)
    return colors


def list_colorings(found: Ranking) -> list[Coloring]:
    """Return the quantities that some row has."""
    return [c for c in COLORINGS if any(c.key in row.colors for row in found.rows)]


def color_range(found: Ranking, coloring: Coloring) -> tuple[float, float]:
    """Return the ends of the color map for all surfaces, from the rows that are no worse than the mesh as given."""
    limit = 1.1 * found.rows[0].values.get("estimated_error", 0.0)
    rows = [row for row in found.rows if not row.failure and row.values.get("estimated_error", 0.0) <= limit]
    values = np.concatenate([np.abs(row.colors[coloring.key]) for row in rows if coloring.key in row.colors])
    high = float(np.quantile(values, _QUANTILE)) or 1.0
    return (-high if coloring.signed else 0.0), high


def color_ramp(coloring: Coloring) -> npt.NDArray[np.uint8]:
    """Return the color map as (256, 3) colors."""
    import matplotlib

    return np.round(255 * matplotlib.colormaps[coloring.map](np.linspace(0, 1, 256))[:, :3]).astype(np.uint8)


def diverging_colors(fraction: Floats) -> Floats:
    """Return (n, 3) colors from blue over white to red, for (n,) fractions in [0, 1]."""
    ends = np.array([[0.23, 0.30, 0.75], [0.87, 0.87, 0.87], [0.71, 0.02, 0.15]])
    x = np.clip(fraction, 0, 1)
    return np.stack([np.interp(x, [0, 0.5, 1], column) for column in ends.T], axis=1)

"""The data of a comparison, and the order of its rows."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from meshlab_specsmooth.arrays import Floats
from meshlab_specsmooth.comparison.columns import MEASURES, Measure
from meshlab_specsmooth.comparison.rows import Curve, Point, Row
from meshlab_specsmooth.geometry.surface import Surface
from meshlab_specsmooth.noise.model import CORRELATED, IMPULSE, NONE, UNCLEAR, Noise

# Two estimated errors are tied if they differ by less than this many standard errors of the difference, or by less than
# this fraction
_TIE_SIGMAS, TIE_FRACTION = 2.0, 0.03


@dataclass(frozen=True, eq=False)
class Ranking:
    """All data of a comparison; see :class:`meshlab_specsmooth.Comparison`, which also puts it into words.

    Attributes
    ----------
    name : str
        Name of the mesh.
    given : Surface
        Input of the filters, including the added noise.
    truth : Surface or None
    added : float or None
        Standard deviation of the added noise, in mean edges.
    seed : int
        Seed of the added noise.
    edge : float
        Mean edge length of the truth, or of the mesh as given: the unit of lengths.
    noise : Noise
        The measured noise, in mesh units.
    rows : tuple of Row
        The mesh as given first, then the filters in the requested order.
    curves : tuple of Curve
    sample : Surface or None
        The part of the mesh that strengths were swept on; None for the whole mesh.
    eigenvalues : (b,) float64
        Centers of the bands of power and response.
    probes : int
        Number of random perturbations behind the estimated errors of the rows.
    single_run : bool
        Whether each filter ran once only, because the mesh is large. Errors are then estimated on ``sample``, and
        self-intersections, Hausdorff distance and E_v of corresponding vertices are left out.
    versions : mapping
        Versions of the software by name.
    seconds : float
        Run time of the whole comparison.
    vertex_colors, face_colors : (n, 3) or (m, 3) float64, or None
        Colors of the input mesh in [0, 1], if it has any.
    """

    name: str
    given: Surface
    truth: Surface | None
    added: float | None
    seed: int
    edge: float
    noise: Noise
    rows: tuple[Row, ...]
    curves: tuple[Curve, ...]
    sample: Surface | None
    eigenvalues: Floats
    probes: int
    single_run: bool
    versions: Mapping[str, str]
    seconds: float
    vertex_colors: Floats | None = None
    face_colors: Floats | None = None

    @property
    def ranked(self) -> tuple[Row, ...]:
        """The rows by estimated error, failures last; by the true error if no error can be estimated."""
        if self.noise.kind == UNCLEAR:
            return tuple(sorted(self.rows, key=lambda row: (bool(row.failure), row.true_error)))
        return tuple(sorted(self.rows, key=lambda row: row.values.get("estimated_error", math.inf)))

    @property
    def best(self) -> Row:
        """The row of least estimated error; the mesh as given if it has no noise."""
        return self.rows[0] if self.noise.kind == NONE else self.ranked[0]

    @property
    def tied(self) -> tuple[Row, ...]:
        """Other rows that are as good as the best, within two standard errors or three per cent."""
        limit = TIE_FRACTION * self.best.values.get("estimated_error", math.nan)
        return tuple(
            row
            for row in self.ranked
            if row is not self.best and row.gap <= max(limit, _TIE_SIGMAS * np.nan_to_num(row.gap_uncertainty))
        )

    @property
    def tuned(self) -> tuple[tuple[Curve, Point], ...]:
        """For each filter the strength of least estimated error, the best filter first."""
        found = [
            (curve, min(points, key=lambda p: p.values["estimated_error"]))
            for curve in self.curves
            if (points := [p for p in curve.points if "estimated_error" in p.values])
        ]
        return tuple(sorted(found, key=lambda pair: pair[1].values["estimated_error"]))

    @property
    def columns(self) -> tuple[Measure, ...]:
        """The measures that at least one row has."""
        return tuple(m for m in MEASURES.values() if any(m.key in row.values for row in self.rows))

    @property
    def correlation(self) -> float:
        """Correlation of estimated and true errors, over the pairs of :meth:`errors`.

        NaN without the truth, or for fewer than three pairs.
        """
        pairs = self.errors()
        if len(pairs) < 3 or not all(np.ptp(column) > 0 for column in pairs.T):
            return math.nan
        return float(np.asarray(np.corrcoef(pairs.T))[0, 1])

    def errors(self) -> Floats:
        """Return the (k, 2) estimated and true errors of all rows and points that are no worse than the given mesh."""
        limit = self.rows[0].values.get("estimated_error", math.nan)
        # an error that was estimated on a part cannot be compared with the true error of the whole
        values = [] if self.single_run else [row.values for row in self.rows]
        values += [p.values for curve in self.curves for p in curve.points]
        pairs = [
            (v["estimated_error"], v["true_error"]) for v in values if "true_error" in v and "estimated_error" in v
        ]
        return np.array([pair for pair in pairs if pair[0] <= 1.001 * limit], dtype=np.float64).reshape(-1, 2)

    @property
    def trusted(self) -> bool:
        """Whether the error estimate is valid for this kind of noise."""
        return self.noise.kind not in {IMPULSE, CORRELATED, UNCLEAR}

    @property
    def closest(self) -> Row | None:
        """The row of least true error, if that is known."""
        return min(
            (row for row in self.rows if row.true_error < math.inf), key=lambda row: row.true_error, default=None
        )

    @property
    def choice(self) -> Row | None:
        """The recommended row: the best by the estimate, or by the truth if the estimate cannot be trusted.

        None if the estimate cannot be trusted and the truth is not known.
        """
        return self.best if self.trusted else self.closest

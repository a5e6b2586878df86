"""Estimated errors of filters in mean edges, and how far each is behind the best."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from meshlab_specsmooth.comparison.rows import Row


@dataclass(frozen=True)
class EstimatedError:
    """An estimated error in mean edges, with the parts of its uncertainty in squared mean edges (those of the risk).

    Attributes
    ----------
    error : float
    scatter : float
        Standard error of the risk over the probes; NaN for one probe.
    level_term : float
        Signed change of the risk for a change of the noise level by one standard error.
    risks : tuple of float
        Risk estimated by each probe.
    """

    error: float
    scatter: float
    level_term: float
    risks: tuple[float, ...]

    @property
    def uncertainty(self) -> float:
        """Increase of the error for one standard error of the risk; for one probe, that of the noise level alone."""
        return math.sqrt(self.error**2 + math.hypot(np.nan_to_num(self.scatter), self.level_term)) - self.error


def add_gaps(rows: Sequence[tuple[Row, EstimatedError | None]]) -> tuple[Row, ...]:
    """Return the rows with the difference of each from the best row.

    The same probes were used for all rows, so that most of their scatter cancels in the difference.
    """
    best = min((found for _, found in rows if found is not None), key=lambda found: found.error, default=None)
    return tuple(row if found is None or best is None else _with_gap(row, found, best) for row, found in rows)


def _with_gap(row: Row, found: EstimatedError, best: EstimatedError) -> Row:
    difference = np.subtract(found.risks, best.risks)
    difference = difference[np.isfinite(difference)]
    scatter = float(difference.std(ddof=1) / np.sqrt(len(difference))) if len(difference) > 1 else 0.0
    # an error of the noise level changes both in the same direction
    spread = math.hypot(scatter, found.level_term - best.level_term)
    return replace(row, gap=found.error - best.error, gap_uncertainty=spread / max(found.error + best.error, 1e-12))

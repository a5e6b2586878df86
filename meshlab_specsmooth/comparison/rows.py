"""Measured results: a filter at its defaults (row) and over the values of its strength parameter (curve)."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

from meshlab_specsmooth.arrays import Floats
from meshlab_specsmooth.comparison.columns import format_estimate
from meshlab_specsmooth.comparison.filter_specs import FilterSpec
from meshlab_specsmooth.geometry.surface import Surface


@dataclass(frozen=True, eq=False)
class Row:
    """The measured result of one filter, or the mesh as given.

    Attributes
    ----------
    spec : FilterSpec or None
        None for the mesh as given.
    surface : Surface or None
        None if the filter failed.
    failure : str
        Reason of the failure; else empty.
    values : mapping
        Measures by key (see :data:`~meshlab_specsmooth.comparison.columns.MEASURES`), those that apply.
    uncertainty : float
        Standard error of the estimated error, in mean edges: the scatter over the probes and that of the noise level.
    gap, gap_uncertainty : float
        Estimated error minus that of the best row, in mean edges, and the standard error of this difference. It is
        smaller than the uncertainty of either error, because both have the same probes and noise level.
    chosen : mapping
        Parameters that the filter chose automatically.
    colors : mapping
        (n,) float64 arrays ``"displacement"``, ``"curvature"`` and, if the truth is known, ``"error"``, in mean edges.
    power : (b,) float64
        Energy of the differential coordinates in each band, in squared mean edges.
    response : (b,) float64
        Measured transfer function in each band, NaN where a band has too few modes.
    hash : str
        SHA-256 of the vertices.
    """

    spec: FilterSpec | None
    surface: Surface | None
    failure: str = ""
    values: Mapping[str, float] = field(default_factory=dict)
    uncertainty: float = math.nan
    gap: float = math.nan
    gap_uncertainty: float = math.nan
    chosen: Mapping[str, object] = field(default_factory=dict)
    colors: Mapping[str, Floats] = field(default_factory=dict)
    power: Floats | None = None
    response: Floats | None = None
    hash: str = ""

    @property
    def name(self) -> str:
        """Display name of the filter."""
        return "as given" if self.spec is None else self.spec.name

    @property
    def ours(self) -> bool:
        """Whether the filter belongs to this package."""
        return self.spec is not None and self.spec.ours

    @property
    def call(self) -> str:
        """The call that reproduces the row on a MeshSet ``ms``; empty for the mesh as given."""
        return "" if self.spec is None else f"ms.{self.spec.call}"

    @property
    def true_error(self) -> float:
        """Error against the truth in mean edges; infinite if it is not known.

        The surface error stands in for the error along the normals if vertices do not correspond.
        """
        return self.values.get("true_error", self.values.get("surface_error", math.inf))

    @property
    def seconds(self) -> float:
        """Run time; 0 for the mesh as given, infinite if it is not known."""
        return 0.0 if self.spec is None else self.values.get("seconds", math.inf)

    def __repr__(self) -> str:
        error = self.values.get("estimated_error")
        outcome = self.failure or ("" if error is None else f"estimated error {error:.3f} edges")
        return f"<Row: {self.name}: {outcome}>"


def format_estimated_error(row: Row, *, with_uncertainty: bool = True) -> str:
    """Format the estimated error of a row; empty if it has none."""
    error = row.values.get("estimated_error", math.nan)
    return format_estimate(error, row.uncertainty, with_uncertainty=with_uncertainty)


@dataclass(frozen=True, eq=False)
class Point:
    """A filter at one strength: call, strength, measures by key, and the standard error of the estimated error."""

    call: str
    strength: object
    values: Mapping[str, float]
    uncertainty: float = math.nan


@dataclass(frozen=True, eq=False)
class Curve:
    """A filter over the values of its strength parameter, without those at which it failed."""

    spec: FilterSpec
    points: tuple[Point, ...]

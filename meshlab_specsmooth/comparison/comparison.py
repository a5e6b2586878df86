"""The result of a comparison: its data, the order of its rows, and the recommendation in words."""

from __future__ import annotations

import html
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from meshlab_specsmooth.arrays import Floats
from meshlab_specsmooth.comparison import tables
from meshlab_specsmooth.comparison.columns import MEASURES, Measure, format_estimate, format_number, is_bound
from meshlab_specsmooth.comparison.rows import Curve, Point, Row, format_estimated_error
from meshlab_specsmooth.geometry.surface import Surface
from meshlab_specsmooth.noise.model import CORRELATED, IMPULSE, NONE, STAIRCASE, UNCLEAR, Noise

# Two estimated errors are tied if they differ by less than this many standard errors of the difference, or by less than
# this fraction
_TIE_SIGMAS, _TIE_FRACTION = 2.0, 0.03
# Kinds of noise for which the error estimate is not valid
_INVALID = {
    IMPULSE: "a few vertices are outliers",
    CORRELATED: "the noise is correlated between neighboring vertices",
    UNCLEAR: "noise cannot be separated from shape on these triangles",
    STAIRCASE: "the steps of a mask are not random; denoise smooths them as far as the voxels allow",
}
# A run time is called shorter from this ratio on
_MIN_SPEEDUP = 1.5
# True errors that differ by less than this fraction are called equal
_EQUAL_FRACTION = 0.01


@dataclass(frozen=True, eq=False, repr=False)
class Comparison:
    """Filters side by side on one mesh; a notebook shows it as a table.

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
        limit = _TIE_FRACTION * self.best.values.get("estimated_error", math.nan)
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
        return self.noise.kind not in _INVALID

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

    def headline(self) -> str:
        """Return the recommended filter in one line, and whether the truth, if known, agrees."""
        return _headline(self)

    def reasons(self) -> tuple[str, ...]:
        """Return the reasons for the recommendation, in sentences."""
        return tuple(_list_reasons(self))

    def __repr__(self) -> str:
        return f"<Comparison: {len(self.rows) - 1} filters on {self.name}: {self.headline()}>"

    def __str__(self) -> str:
        return tables.text_table(self.ranked, self.columns)

    def _repr_html_(self) -> str:
        reasons = html.escape(" ".join(self.reasons()))
        return f"<p><b>{html.escape(self.headline())}.</b> {reasons}</p>{tables.html_table(self.ranked, self.columns)}"


def _headline(found: Comparison) -> str:
    """Return the recommended filter in one line, and whether the truth, if known, agrees."""
    choice, noise = found.choice, found.noise
    if choice is None:
        return f"No recommendation: {_INVALID[noise.kind]}"
    is_given = choice is found.rows[0]
    advice = "Leave the mesh as it is" if is_given else f"Take {choice.name}"
    if not found.trusted:
        where = "on these triangles" if noise.kind == UNCLEAR else "for this noise"
        return f"{advice}: it is the closest to the truth (no valid error estimate {where})"
    if noise.kind == NONE:
        advice += ": it has no measurable noise"
    elif is_given:
        advice += ": no filter is significantly better" if found.tied else ": every filter increases the error"
    elif found.tied:
        advice = f"Take {_format_alternatives(choice, found.tied)}: they are tied"
    if found.closest is None:
        return advice
    if choice.true_error > (1 + _EQUAL_FRACTION) * found.closest.true_error:
        return f"{advice}; {found.closest.name} is closer to the truth"
    return advice if noise.kind == NONE else f"{advice}; the truth agrees"


def _list_reasons(found: Comparison) -> Iterable[str]:
    """Yield the reasons for the recommendation, sentence by sentence."""
    if found.noise.kind == NONE:
        yield f"The measured noise is {found.noise.level_in_edges:.3f} mean edges, less than a fiftieth."
        yield from _compare_with_truth(found, found.best)
    elif found.noise.kind == UNCLEAR and found.closest is None:
        yield f"{_explain_unclear(found.noise)} Look at the surfaces."
    elif found.trusted:
        yield from _explain_estimates(found)
    else:
        yield from _explain_without_estimates(found)
    if found.single_run and found.sample is not None:
        yield (
            f"Because the mesh is large, errors were estimated and strengths were swept on a part of "
            f"{len(found.sample.vertices):,} vertices. Left out: {', '.join(_list_left_out(found))}."
        )
    failed = [row.name for row in found.rows if row.failure]
    if failed:
        yield f"Failed on this mesh: {', '.join(failed)}."
    if found.noise.kind != NONE and math.isfinite(found.correlation):
        yield (
            f"The correlation of estimated and true errors is {found.correlation:.4f} over {len(found.errors())} "
            "settings."
        )


def _format_alternatives(best: Row, tied: Sequence[Row]) -> str:
    """Return tied rows with their run times: the best, the fastest, and the number of others.

    Examples
    --------
    >>> from meshlab_specsmooth.comparison.filter_specs import FILTER_SPECS
    >>> from meshlab_specsmooth.comparison.rows import Row
    >>> from meshlab_specsmooth.comparison.comparison import _format_alternatives
    >>> rows = [Row(FILTER_SPECS[k], None, values={"seconds": s}) for k, s in (("denoise", 2.0), ("taubin", 0.05))]
    >>> _format_alternatives(rows[0], rows[1:])
    'specsmooth denoise (2.00 s) or MeshLab Taubin (0.05 s, 40 times faster)'
    """
    fastest = min(tied, key=lambda row: row.seconds)
    words = [_with_seconds(best, fastest), _with_seconds(fastest, best)]
    if len(tied) > 1:
        words.append(f"{len(tied) - 1} other{'s' if len(tied) > 2 else ''}")
    return f"{', '.join(words[:-1])} or {words[-1]}"


def _with_seconds(row: Row, other: Row) -> str:
    if row.spec is None:
        return "the mesh as it is"
    if not math.isfinite(row.seconds):
        return row.name
    return f"{row.name} ({format_number(row.seconds, 2)} s{_format_speedup(row.seconds, other)})"


def _format_speedup(seconds: float, other: Row) -> str:
    """Return by which factor a run time is shorter than that of another row; empty if it is not clearly shorter."""
    factor = other.seconds / seconds if seconds > 0 else math.nan
    if not (math.isfinite(factor) and factor >= _MIN_SPEEDUP):
        return ""
    return f", {format_number(factor, 0 if factor >= 9.5 else 1)} times faster"


def _explain_unclear(noise: Noise) -> str:
    reason = noise.reason or "noise cannot be separated from shape on this mesh"
    return f"{reason[0].upper()}{reason[1:]}, so no error can be estimated."


def _list_left_out(found: Comparison) -> list[str]:
    """Return the labels of columns that a smaller mesh would have."""
    wanted = ("surface_error", "hausdorff", "intersections") if found.truth is not None else ("intersections",)
    return [MEASURES[key].label for key in wanted if MEASURES[key] not in found.columns]


def _explain_estimates(found: Comparison) -> Iterable[str]:
    before, best = found.rows[0].values["estimated_error"], found.best
    if best.spec is None:
        yield from _compare_with_truth(found, best)
        return
    rank = "among the closest to the true surface" if found.tied else "the closest to the true surface"
    yield (
        f"Its result is {rank}: the estimated error is {format_estimated_error(best)} mean edges, and that of the mesh "
        f"as given is {before:.3f}."
    )
    yield from _compare_with_truth(found, best)
    yield from _compare_with_others(found)
    if found.tied:
        names = ", ".join(_with_seconds(row, best) for row in found.tied)
        yield f"As good within the uncertainty: {names}; {best.name} takes {best.seconds:.2f} s."
    yield _describe_side_effects(best, found)
    worse = [row.name for row in found.rows[1:] if row.values.get("estimated_error", 0) > before]
    if worse:
        yield f"Worse than no smoothing on this mesh: {', '.join(worse)}."


def _compare_with_others(found: Comparison) -> Iterable[str]:
    """The best of the other side, MeshLab's or this package's, at its defaults and with its strength tuned."""
    best = found.best
    rivals = (row for row in found.ranked if row.spec is not None and row.ours != best.ours)
    rival = next((row for row in rivals if "estimated_error" in row.values), None)
    if rival is not None:
        whose = "MeshLab's best filter" if best.ours else "The best filter of this package"
        difference = " (tied)" if rival in found.tied else _format_excess(found, rival)
        error = format_estimated_error(rival, with_uncertainty=False)
        yield f"{whose} at its defaults, {rival.name}, has an estimated error of {error}{difference}."
    tuned = next((pair for pair in found.tuned if not pair[0].spec.ours), None)
    if tuned is not None and best.ours:
        point = tuned[1]
        difference = _format_excess(found, point)
        if point.values["estimated_error"] <= (1 + _TIE_FRACTION) * best.values["estimated_error"]:
            seconds = point.values.get("seconds", math.nan)
            difference = f" (tied{_format_speedup(seconds, best) if found.sample is None else ''})"
        error = format_estimate(point.values["estimated_error"], point.uncertainty, with_uncertainty=False)
        yield f"MeshLab's best with its strength tuned has an estimated error of {error}{difference}: {point.call}."


def _compare_with_truth(found: Comparison, best: Row) -> Iterable[str]:
    if found.closest is None:
        return
    least = found.closest.true_error
    if found.closest is best:
        yield f"The known truth agrees: its true error is {best.true_error:.3f} mean edges, the smallest of all."
    else:
        yield (
            f"Measured against the known truth, {found.closest.name} is the closest: {least:.3f} mean edges; "
            f"{best.name} has {best.true_error:.3f} ({_format_ratio(best.true_error, least)})."
        )


def _explain_without_estimates(found: Comparison) -> Iterable[str]:
    """Yield what can be said if the error estimate is not valid for this noise."""
    first, given, closest = found.ranked[0], found.rows[0], found.closest
    if closest is None:
        yield (
            "Without a truth, errors are estimated on the assumption that noise is independent from vertex to vertex. "
            "That does not hold here, so the order of the filters is a hint at most. Look at the surfaces, and take "
            "the filter that preserves the features you know to be real."
        )
    elif closest.spec is not None:
        yield (
            f"Its result is the closest to the known truth: {closest.true_error:.3f} mean edges; the mesh as given has "
            f"{given.true_error:.3f}."
        )
        yield _describe_side_effects(closest, found)
    if found.noise.kind == UNCLEAR:
        yield _explain_unclear(found.noise)
        return
    errors = [format_estimated_error(row, with_uncertainty=False) for row in (first, given)]
    yield (
        f"The error estimate is not valid for this noise ({_INVALID[found.noise.kind]}). It ranks {first.name} first: "
        f"{errors[0]} mean edges, and the mesh as given {errors[1]}."
    )
    if closest is not None and first is not closest:
        ratio = _format_ratio(first.true_error, closest.true_error)
        yield f"The true error of {first.name} is {first.true_error:.3f} ({ratio})."


def _format_excess(found: Comparison, other: Row | Point) -> str:
    """Return by how much an estimate exceeds that of the best, in brackets; empty if one of them is only a bound."""
    error, best = other.values["estimated_error"], found.best
    least = best.values["estimated_error"]
    if is_bound(error, other.uncertainty) or is_bound(least, best.uncertainty):
        return ""
    return f" ({_format_ratio(error, least)})"


def _format_ratio(error: float, reference: float) -> str:
    if reference <= 0:
        return "not comparable"
    change = 100 * (error / reference - 1)
    return f"{abs(change):.0f} % {'more' if change >= 0 else 'less'}"


def _describe_side_effects(row: Row, found: Comparison) -> str:
    values: Mapping[str, float] = row.values
    words = [f"it removes {values['noise_removed']:.0f} % of the noise"]
    if "volume" in values:
        words.append(f"changes the volume by {format_number(values['volume'], 3, signed=True)} %")
    else:
        words.append(f"shifts the surface by {format_number(values['offset'], 4, signed=True)} mean edges on average")
    if found.truth is not None:  # relative to a noisy mesh smoothing flips faces back, which is no fault
        words.append(f"flips {values['flips']:.2f} % of the faces")
    text = f"{', '.join(words[:-1])} and {words[-1]}."
    return text[0].upper() + text[1:]

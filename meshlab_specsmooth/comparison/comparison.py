"""What a comparison found: rows at defaults, curves at swept strength, and what they say."""

from __future__ import annotations

import html
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from meshlab_specsmooth.arrays import Floats
from meshlab_specsmooth.comparison.competitors import Competitor
from meshlab_specsmooth.geometry.surface import Surface
from meshlab_specsmooth.noise.model import CORRELATED, IMPULSE, NONE, UNCLEAR, Noise

# Kinds of noise that the estimate is not made for, in words
_BEYOND = {
    IMPULSE: "a few vertices are far off",
    CORRELATED: "neighboring vertices share this noise",
    UNCLEAR: "noise cannot be told from shape on these triangles",
}
# A filter that is so many times faster than another is called so
_FASTER = 1.5

# Two estimates that differ by less than so many standard errors, or by less than this share, are level; and true errors
# that differ by less than that share are alike
_SURELY, _LEVEL, _ALIKE = 2.0, 0.03, 0.01


@dataclass(frozen=True)
class Measure:
    """A column: what is measured, in which unit, by which formula, and which way is better.

    Attributes
    ----------
    key, label, unit, help : str
    better : {"low", "high", "zero", ""}
        ``""`` where neither way is.
    digits : int
        After the point.
    """

    key: str
    label: str
    unit: str
    help: str
    better: str = "low"
    digits: int = 3


MEASURES = {
    measure.key: measure
    for measure in (
        Measure(
            "estimated_error",
            "estimated error",
            "edges",
            "Distance from the unknown true surface along its normals, root mean square, estimated from the noisy mesh "
            "alone: Stein's unbiased risk estimate in its Monte-Carlo form (Ramani, Blu, Unser 2008). "
            "The uncertainty is its standard error, by the random perturbations and the noise level.",
        ),
        Measure(
            "true_error",
            "true error",
            "edges",
            "The same against the truth: root mean square of n . (v - truth) over the vertices, n the normals of a "
            "smoothed guide.",
        ),
        Measure(
            "normal_error",
            "normals off",
            "degrees",
            "Mean angle between the face normals of result and truth (Zhang et al. 2015).",
            digits=2,
        ),
        Measure(
            "seconds",
            "time",
            "s",
            "Of the filter alone, in a process where it has run on a small mesh before, so that nothing is loaded or "
            "compiled on the way; as busy as this machine was at that moment.",
            digits=2,
        ),
        Measure(
            "surface_error",
            "E_v",
            "edges",
            "Vertex-to-surface error sqrt(sum A_i d_i^2 / (3 sum A_f)), d_i the exact distance of vertex i to the "
            "truth (Sun et al. 2007; Zheng et al. 2011).",
        ),
        Measure(
            "vertex_error",
            "vertex RMS",
            "edges",
            "Root mean square distance of corresponding vertices; drift along the surface counts.",
        ),
        Measure("hausdorff", "Hausdorff", "edges", "MeshLab's Hausdorff distance to the truth, both ways."),
        Measure(
            "noise_removed",
            "noise removed",
            "%",
            "By how much the median of |n . L^2 V|, which sees noise and next to nothing of shape, has fallen.",
            "high",
            1,
        ),
        Measure(
            "feature_loss",
            "feature loss",
            "edges",
            "How far the surface, averaged over some three edges, has moved along its normals at the tenth of the "
            "vertices where it curves the most; root mean square.",
        ),
        Measure(
            "volume",
            "volume",
            "%",
            "Change of the enclosed volume against the truth, or the mesh as given; closed meshes.",
            "zero",
        ),
        Measure(
            "offset",
            "mean offset",
            "edges",
            "Volume swept per area: mean move along the normals against the truth, or the mesh as given; negative "
            "inward. Open meshes have it, too.",
            "zero",
        ),
        Measure("area", "area", "%", "Change of the area against the mesh as given; noise itself adds area.", "", 2),
        Measure("boundary", "boundary", "%", "Change of the boundary's length against the mesh as given.", "", 2),
        Measure(
            "displacement", "moved", "edges", "Root mean square distance of the vertices from where they were.", ""
        ),
        Measure("dihedral", "dihedral", "degrees", "Mean angle between the normals of neighboring faces.", "", 2),
        Measure(
            "quality",
            "triangles",
            "",
            "Mean of 2 r / R, inscribed by circumscribed radius of the faces: 1 of equilateral triangles.",
            "high",
        ),
        Measure(
            "flips",
            "turned faces",
            "%",
            "Faces that look away by more than 90 degrees from where the truth's do, or those of the mesh as given.",
            digits=2,
        ),
        Measure("intersections", "self-intersecting", "%", "Faces that MeshLab finds to run through others.", digits=2),
    )
}


@dataclass(frozen=True, eq=False)
class Row:
    """A filter at its defaults.

    Attributes
    ----------
    competitor : Competitor or None
        None of the mesh as given.
    surface : Surface or None
        None where the filter failed.
    failure : str
        Why it failed; empty where it did not.
    values : mapping
        Measures by key (see ``MEASURES``), those that apply.
    uncertainty : float
        Standard error of the estimated error, in mean edges, from the scatter of the probes and from that of the noise
        level.
    behind, behind_uncertainty : float
        By how much the estimated error is larger than that of the best row, in mean edges, and the standard error of
        that difference: it is smaller than that of either, as both had the same probes and noise level.
    chosen : mapping
        Parameters that the filter chose by itself.
    colors : mapping
        (n,) arrays: ``"displacement"``, ``"curvature"`` and, with the truth, ``"error"``; in mean edges.
    power : (b,) float64
        Power of a mode in each band, relative to the mesh as given where that is not 0.
    response : (b,) float64
        Measured transfer function in each band, NaN where there are too few modes.
    hash : str
        SHA-256 of the vertices.
    """

    competitor: Competitor | None
    surface: Surface | None
    failure: str = ""
    values: Mapping[str, float] = field(default_factory=dict)
    uncertainty: float = math.nan
    behind: float = math.nan
    behind_uncertainty: float = math.nan
    chosen: Mapping[str, object] = field(default_factory=dict)
    colors: Mapping[str, Floats] = field(default_factory=dict)
    power: Floats | None = None
    response: Floats | None = None
    hash: str = ""

    @property
    def name(self) -> str:
        """The filter's, for people."""
        return "as given" if self.competitor is None else self.competitor.name

    def __repr__(self) -> str:
        error = self.values.get("estimated_error")
        what = self.failure or ("" if error is None else f"estimated error {error:.3f} edges")
        return f"<Row: {self.name}: {what}>"

    @property
    def call(self) -> str:
        """The call that reproduces the row, on a MeshSet ``ms``."""
        return "" if self.competitor is None else f"ms.{self.competitor.call}"


@dataclass(frozen=True, eq=False)
class Point:
    """A filter at one strength: the call, the strength, measures by key, and the estimated error's standard error."""

    call: str
    strength: object
    values: Mapping[str, float]
    uncertainty: float = math.nan


@dataclass(frozen=True, eq=False)
class Curve:
    """A filter over its strengths; those at which it failed are left out."""

    competitor: Competitor
    points: tuple[Point, ...]


@dataclass(frozen=True, eq=False)
class Comparison:
    """Filters side by side on one mesh.

    Attributes
    ----------
    name : str
        Of the mesh.
    given : Surface
        As the filters got it, with the noise that was added.
    truth : Surface or None
    added : float or None
        Standard deviation of the noise that was added, in mean edges.
    seed : int
    edge : float
        Mean edge of the truth, or of the mesh as given: the unit of lengths.
    noise : Noise
        As measured, in mesh units.
    rows : tuple of Row
        The mesh as given first, then the filters in the order asked for.
    curves : tuple of Curve
    sample : Surface or None
        The part of the mesh that strengths were swept on; None where it was the whole.
    eigenvalues : (b,) float64
        Middle of the bands of power and response.
    probes : int
        Random perturbations that the estimated errors of the rows come from.
    once : bool
        Whether the mesh is so large that filters ran on it once: errors are then estimated on the part, and
        self-intersections, Hausdorff distance and E_v of vertices that correspond are left out.
    versions : mapping
    seconds : float
        All of it.
    vertex_colors, face_colors : (n, 3) or (m, 3) float64, or None
        Of the mesh as it was read, in [0, 1], where it has some.
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
    once: bool
    versions: Mapping[str, str]
    seconds: float
    vertex_colors: Floats | None = None
    face_colors: Floats | None = None

    @property
    def ranked(self) -> tuple[Row, ...]:
        """The rows by estimated error, those that failed last; by the truth where no error can be estimated."""
        if self.noise.kind == UNCLEAR:
            return tuple(sorted(self.rows, key=lambda row: (bool(row.failure), _by_truth(row))))
        return tuple(sorted(self.rows, key=lambda row: row.values.get("estimated_error", math.inf)))

    @property
    def best(self) -> Row:
        """The row of least estimated error; the mesh as given where there is no noise, or nothing is better."""
        return self.rows[0] if self.noise.kind == NONE else self.ranked[0]

    @property
    def level(self) -> tuple[Row, ...]:
        """Other rows that are as good as the best: no further behind than chance explains, or than three per cent."""
        limit = _LEVEL * self.best.values.get("estimated_error", math.nan)
        return tuple(
            row
            for row in self.ranked
            if row is not self.best and row.behind <= max(limit, _SURELY * np.nan_to_num(row.behind_uncertainty))
        )

    @property
    def tuned(self) -> tuple[tuple[Curve, Point], ...]:
        """Each filter's strength of least estimated error, best first."""
        found = [
            (curve, min(points, key=lambda p: p.values["estimated_error"]))
            for curve in self.curves
            if (points := [p for p in curve.points if "estimated_error" in p.values])
        ]
        return tuple(sorted(found, key=lambda pair: pair[1].values["estimated_error"]))

    @property
    def columns(self) -> tuple[Measure, ...]:
        """The measures that some row has."""
        return tuple(m for m in MEASURES.values() if any(m.key in row.values for row in self.rows))

    @property
    def correlation(self) -> float:
        """Of estimated and true error, over rows and swept strengths that are no worse than the mesh as given.

        NaN without the truth, or where fewer than three are.
        """
        pairs = self.errors()
        if len(pairs) < 3 or not all(np.ptp(column) > 0 for column in pairs.T):
            return math.nan
        return float(np.asarray(np.corrcoef(pairs.T))[0, 1])

    def errors(self) -> Floats:
        """(k, 2) estimated and true errors that :attr:`correlation` is of."""
        limit = self.rows[0].values.get("estimated_error", math.nan)
        # what is estimated on a part does not belong to the true error of the whole
        values = [] if self.once else [row.values for row in self.rows]
        values += [p.values for curve in self.curves for p in curve.points]
        pairs = [
            (v["estimated_error"], v["true_error"]) for v in values if "true_error" in v and "estimated_error" in v
        ]
        return np.array([pair for pair in pairs if pair[0] <= 1.001 * limit], dtype=np.float64).reshape(-1, 2)

    @property
    def trusted(self) -> bool:
        """Whether the noise is of a kind that the estimate is made for."""
        return self.noise.kind not in _BEYOND

    @property
    def closest(self) -> Row | None:
        """The row nearest to the truth, where that is known."""
        return min((row for row in self.rows if _by_truth(row) < math.inf), key=_by_truth, default=None)

    @property
    def choice(self) -> Row | None:
        """What to take: the best by the estimate, or by the truth where the estimate is not to be trusted.

        None where it is not, and there is no truth.
        """
        return self.best if self.trusted else self.closest

    def headline(self) -> str:
        """Which filter to take, or that nothing says so; and whether the truth agrees, where it is known."""
        if self.choice is None:
            return f"No winner by numbers: {_BEYOND[self.noise.kind]}"
        leave = self.choice is self.rows[0]
        advice = "Leave it as it is" if leave else f"Take {self.choice.name}"
        if not self.trusted:
            where = "on these triangles" if self.noise.kind == UNCLEAR else "on this noise"
            return f"{advice}: so says the truth ({where} no estimate could)"
        if self.noise.kind == NONE:
            advice += ": there is no noise to speak of"
        elif leave:
            advice += ": no filter is surely better" if self.level else ": every filter makes it worse"
        elif self.level:
            advice = f"Take {_alternatives(self.choice, self.level)}: they are level"
        if self.closest is None:
            return advice
        if _by_truth(self.choice) > (1 + _ALIKE) * _by_truth(self.closest):
            return f"{advice}; by the truth {self.closest.name} is closer"
        return advice if self.noise.kind == NONE else f"{advice}; the truth agrees"

    def reasons(self) -> tuple[str, ...]:
        """Why, in sentences."""
        return tuple(_reasons(self))

    def __repr__(self) -> str:
        return f"<Comparison: {len(self.rows) - 1} filters on {self.name}: {self.headline()}>"

    def __str__(self) -> str:
        return table(self)

    def _repr_html_(self) -> str:
        return (
            f"<p><b>{html.escape(self.headline())}.</b> {html.escape(' '.join(self.reasons()))}</p>{html_table(self)}"
        )


def _by_truth(row: Row) -> float:
    """The error by the truth; of the surface where vertices do not correspond."""
    return row.values.get("true_error", row.values.get("surface_error", math.inf))


def _alternatives(best: Row, level: Sequence[Row]) -> str:
    """Rows that are level, with their price: the best, the fastest, and how many there are besides.

    Examples
    --------
    >>> from meshlab_specsmooth.comparison.comparison import Row, _alternatives
    >>> from meshlab_specsmooth.comparison.competitors import COMPETITORS
    >>> rows = [Row(COMPETITORS[k], None, values={"seconds": s}) for k, s in (("denoise", 2.0), ("taubin", 0.05))]
    >>> _alternatives(rows[0], rows[1:])
    'specsmooth denoise (2.00 s) or MeshLab Taubin (0.05 s, 40 times faster)'
    """
    fastest = min(level, key=_seconds)
    words = [_priced(best, fastest), _priced(fastest, best)]
    if len(level) > 1:
        words.append(f"{len(level) - 1} other{'s' if len(level) > 2 else ''}")
    return f"{', '.join(words[:-1])} or {words[-1]}"


def _seconds(row: Row) -> float:
    """What a row takes: nothing at all where the mesh is left as it is."""
    return 0.0 if row.competitor is None else row.values.get("seconds", math.inf)


def _priced(row: Row, other: Row) -> str:
    if row.competitor is None:
        return "the mesh as it is"
    own = _seconds(row)
    return f"{row.name} ({format_number(own, 2)} s{_faster(own, other)})" if math.isfinite(own) else row.name


def _faster(seconds: float, than: Row) -> str:
    """By how much something is faster than a row; nothing where it is not, or hardly."""
    times = _seconds(than) / seconds if seconds > 0 else math.nan
    if not (math.isfinite(times) and times >= _FASTER):
        return ""
    return f", {format_number(times, 0 if times >= 9.5 else 1)} times faster"


def _reasons(found: Comparison) -> Iterable[str]:
    if found.noise.kind == NONE:
        yield f"The noise measured is {found.noise.level_in_edges:.3f} mean edges, less than a fiftieth."
        yield from _truth_says(found, found.best)
    elif found.noise.kind == UNCLEAR and found.closest is None:
        yield f"{_why_unclear(found.noise)} Look at the surfaces."
    elif found.trusted:
        yield from _by_estimate(found)
    else:
        yield from _without_estimate(found)
    if found.once and found.sample is not None:
        yield (
            f"On a mesh of this size errors are estimated, and strengths tried, on a part of "
            f"{len(found.sample.vertices):,} vertices. Left out: {', '.join(_left_out(found))}."
        )
    failed = [row.name for row in found.rows if row.failure]
    if failed:
        yield f"Failed on this mesh: {', '.join(failed)}."
    if found.noise.kind != NONE and math.isfinite(found.correlation):
        yield f"Estimated and true errors correlate by {found.correlation:.4f} over {len(found.errors())} settings."


def _why_unclear(noise: Noise) -> str:
    """Why there are no estimates, as a sentence."""
    reason = noise.reason or "noise and shape cannot be told apart here"
    return f"{reason[0].upper()}{reason[1:]}, so no error can be estimated."


def _left_out(found: Comparison) -> list[str]:
    """Columns that a smaller mesh would have."""
    wanted = ("surface_error", "hausdorff", "intersections") if found.truth is not None else ("intersections",)
    return [MEASURES[key].label for key in wanted if MEASURES[key] not in found.columns]


def _by_estimate(found: Comparison) -> Iterable[str]:
    before, best = found.rows[0].values["estimated_error"], found.best
    if best.competitor is not None:
        ours = best.competitor.ours
        how_close = "as close to the true surface as any" if found.level else "the closest to the true surface"
        yield (
            f"Its result is {how_close}: {estimate_shown(best)} mean edges off by the estimate, "
            f"where the mesh as given is {before:.3f} off."
        )
        yield from _truth_says(found, best)
        others = [row for row in found.ranked if row.competitor is not None and row.competitor.ours != ours]
        rival = next((row for row in others if "estimated_error" in row.values), None)
        if rival is not None:
            whose = "MeshLab's best filter" if ours else "The best of this package's"
            more = " (level)" if rival in found.level else _more_than_best(found, rival.values, rival.uncertainty)
            yield f"{whose} at its defaults, {rival.name}, is {_estimate(rival.values, rival.uncertainty)} off{more}."
        tuned = next((pair for pair in found.tuned if not pair[0].competitor.ours), None)
        if tuned is not None and ours:
            point = tuned[1]
            more = _more_than_best(found, point.values, point.uncertainty)
            if point.values["estimated_error"] <= (1 + _LEVEL) * best.values["estimated_error"]:
                more = f" (level{_faster(point.values.get('seconds', math.nan), best) if found.sample is None else ''})"
            error = _estimate(point.values, point.uncertainty)
            yield f"With its strength tuned, the best that MeshLab gets is {error}{more}: {point.call}."
        if found.level:
            names = ", ".join(_priced(row, best) for row in found.level)
            yield f"As good within the uncertainty: {names}; {best.name} takes {_seconds(best):.2f} s."
        yield _cost(best, found)
    else:
        yield from _truth_says(found, best)
    worse = [row.name for row in found.rows[1:] if row.values.get("estimated_error", 0) > before]
    if worse and best.competitor is not None:
        yield f"Worse than doing nothing here: {', '.join(worse)}."


def _truth_says(found: Comparison, best: Row) -> Iterable[str]:
    if found.closest is None:
        return
    least, own = _by_truth(found.closest), _by_truth(best)
    if found.closest is best:
        yield f"The truth, which is known here, agrees: {own:.3f} mean edges off, and no other is closer."
    else:
        yield (
            f"By the truth, which is known here, {found.closest.name} is the closest: {least:.3f} mean edges off, "
            f"where {best.name} is {own:.3f} off ({_more(own, least)})."
        )


def _without_estimate(found: Comparison) -> Iterable[str]:
    """Where noise is of a kind that the estimate is not made for."""
    first, given, closest = found.ranked[0], found.rows[0], found.closest
    if closest is None:
        yield (
            "Errors without a truth are estimated as if noise were independent from vertex to vertex. Here it is not, "
            "and the order of the filters is a hint at most. Look at the surfaces, and take the one that keeps what "
            "you know to be there."
        )
    elif closest.competitor is not None:
        least = _by_truth(closest)
        yield (
            f"Its result is the closest to the truth, which is known here: {least:.3f} mean edges off, where the mesh "
            f"as given is {_by_truth(given):.3f} off."
        )
        yield _cost(closest, found)
    if found.noise.kind == UNCLEAR:
        yield _why_unclear(found.noise)
        return
    errors = [_estimate(row.values, row.uncertainty) for row in (first, given)]
    yield (
        f"The estimate is not made for this noise ({_BEYOND[found.noise.kind]}). It has {first.name} first: "
        f"{errors[0]} mean edges off, and the mesh as given {errors[1]}."
    )
    if closest is not None and first is not closest:
        own, least = _by_truth(first), _by_truth(closest)
        yield f"In truth {first.name} is {own:.3f} off ({_more(own, least)})."


def _estimate(values: Mapping[str, float], uncertainty: float) -> str:
    """The estimated error without its uncertainty, or its bound."""
    return format_estimate(values.get("estimated_error", math.nan), uncertainty, bare=True)


def _more_than_best(found: Comparison, values: Mapping[str, float], uncertainty: float) -> str:
    """By how much an estimate is more than the best, in brackets; nothing where one of them is but a bound."""
    error, best = values["estimated_error"], found.best
    least = best.values["estimated_error"]
    if is_bound(error, uncertainty) or is_bound(least, best.uncertainty):
        return ""
    return f" ({_more(error, least)})"


def _more(error: float, than: float) -> str:
    if than <= 0:
        return "not comparable"
    change = 100 * (error / than - 1)
    return f"{abs(change):.0f} % {'more' if change >= 0 else 'less'}"


def _cost(row: Row, found: Comparison) -> str:
    values = row.values
    words = [f"it removes {values['noise_removed']:.0f} % of the noise"]
    if "volume" in values:
        words.append(f"changes the volume by {format_number(values['volume'], 3, signed=True)} %")
    else:
        words.append(f"shifts the surface by {format_number(values['offset'], 4, signed=True)} mean edges on average")
    if found.truth is not None:  # of a noisy mesh, faces are turned over already, and smoothing turns them back
        words.append(f"turns {values['flips']:.2f} % of the faces over")
    text = f"{', '.join(words[:-1])} and {words[-1]}."
    return text[0].upper() + text[1:]


def format_number(value: float, digits: int, signed: bool = False) -> str:
    """A number with so many digits after the point; one that rounds to zero has no sign.

    Examples
    --------
    >>> from meshlab_specsmooth.comparison.comparison import format_number
    >>> format_number(-0.0004, 3), format_number(0.0126, 3, signed=True), format_number(-0.0126, 2)
    ('0.000', '+0.013', '-0.01')
    """
    text = f"{value:{'+' if signed else ''}.{digits}f}"
    return text if float(text) else f"{0:.{digits}f}"


def is_bound(error: float, uncertainty: float) -> bool:
    """Whether an estimated error cannot be told from none, so that only a bound on it is known."""
    return error < uncertainty


def format_estimate(error: float, uncertainty: float, bare: bool = False) -> str:
    """An estimated error with its uncertainty, or without; a bound where it cannot be told from none.

    Examples
    --------
    >>> from meshlab_specsmooth.comparison.comparison import format_estimate
    >>> format_estimate(0.072, 0.007), format_estimate(0.0, 0.038), format_estimate(0.072, 0.007, bare=True)
    ('0.072 ± 0.007', 'at most 0.038', '0.072')
    """
    if not math.isfinite(error):
        return ""
    if is_bound(error, uncertainty) or error < 0.0005:
        return f"at most {format_number(max(error + np.nan_to_num(uncertainty), 0.001), 3)}"
    value = shown(MEASURES["estimated_error"], error)
    return value if bare or not math.isfinite(uncertainty) else f"{value} ± {format_number(uncertainty, 3)}"


def shown(measure: Measure, value: float) -> str:
    """A value as it is printed in its column.

    Examples
    --------
    >>> from meshlab_specsmooth.comparison.comparison import MEASURES, shown
    >>> shown(MEASURES["volume"], -0.0123), shown(MEASURES["normal_error"], 4.189), shown(MEASURES["area"], 12345.6)
    ('-0.012', '4.19', '1e+04')
    """
    if not math.isfinite(value):
        return ""
    if abs(value) >= 9999:
        return f"{value:.0e}"
    return format_number(value, measure.digits, signed=measure.better == "zero")


def estimate_shown(row: Row) -> str:
    """The estimated error of a row with its uncertainty, or a bound on it."""
    return format_estimate(row.values.get("estimated_error", math.nan), row.uncertainty)


def table(found: Comparison) -> str:
    """The rows as text, best first."""
    columns = [m for m in found.columns if m.key in _PRINTED]
    lines = ["".join([f"{'':32}", *(f"{text(m):>18}" for m in columns)]) for text in (_label, _unit)]
    for row in found.ranked:
        cells = [
            estimate_shown(row) if m.key == "estimated_error" else shown(m, row.values.get(m.key, math.nan))
            for m in columns
        ]
        lines.append(f"{row.name:32}" + (f"  {row.failure}" if row.failure else "".join(f"{c:>18}" for c in cells)))
    return "\n".join(line.rstrip() for line in lines)


_PRINTED = ("estimated_error", "true_error", "normal_error", "noise_removed", "feature_loss", "volume", "seconds")


def _label(measure: Measure) -> str:
    return measure.label


def _unit(measure: Measure) -> str:
    return measure.unit


def html_table(found: Comparison) -> str:
    """The rows as an HTML table, best first; a page of its own has more."""
    head = "".join(
        f'<th title="{html.escape(m.help)}">{html.escape(m.label)}<br><small>{html.escape(m.unit)}</small></th>'
        for m in found.columns
    )
    body = []
    for row in found.ranked:
        figures = (
            estimate_shown(row) if m.key == "estimated_error" else shown(m, row.values.get(m.key, math.nan))
            for m in found.columns
        )
        cells = "".join(f"<td>{figure}</td>" for figure in figures)
        if row.failure:
            cells = f'<td colspan="{len(found.columns)}">{html.escape(row.failure)}</td>'
        name = html.escape(row.name)
        body.append(f'<tr><th title="{html.escape(row.call)}">{name}</th>{cells}</tr>')
    return f"<table><thead><tr><th></th>{head}</tr></thead><tbody>{''.join(body)}</tbody></table>"

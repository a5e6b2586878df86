"""What a comparison means, in words: the recommendation and its reasons."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence

from meshlab_specsmooth.comparison.columns import MEASURES, format_estimate, format_number, is_bound
from meshlab_specsmooth.comparison.ranking import TIE_FRACTION, Ranking
from meshlab_specsmooth.comparison.rows import Point, Row, format_estimated_error
from meshlab_specsmooth.noise.model import CORRELATED, IMPULSE, NONE, UNCLEAR, Noise

# Kinds of noise for which the error estimate is not valid
_INVALID = {
    IMPULSE: "a few vertices are outliers",
    CORRELATED: "the noise is correlated between neighboring vertices",
    UNCLEAR: "noise cannot be separated from shape on these triangles",
}
# A run time is called shorter from this ratio on
_MIN_SPEEDUP = 1.5
# True errors that differ by less than this fraction are called equal
_EQUAL_FRACTION = 0.01


def headline(found: Ranking) -> str:
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


def list_reasons(found: Ranking) -> Iterable[str]:
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


def explain_paper_setting(given: Row, laplacian: Row, paper: Row, automatic: Row) -> str:
    """Return what the demo shows about the paper's literal setting, in words.

    Parameters
    ----------
    given, laplacian, paper, automatic : Row
        The noisy mesh and three results, with normal errors and changes of volume.
    """
    errors = [row.values["normal_error"] for row in (given, laplacian, paper, automatic)]
    volumes = [abs(row.values["volume"]) for row in (given, laplacian, paper, automatic)]
    less = errors[2] > errors[1]
    return (
        f"The paper's setting (200 modes, weight 1, one pass) reduces the normal error from {errors[0]:.1f} to "
        f"{errors[2]:.1f} degrees. It changes the volume by {volumes[2]:.3f} %, but smooths "
        f"{'less than' if less else 'at least as well as'} MeshLab's Laplacian ({errors[1]:.1f} degrees). On a mesh of "
        "this size 200 modes are so few that the barycenter constraints do nearly all of the work, and their weight "
        f"determines the strength. With the weight chosen from the measured noise, {errors[3]:.1f} degrees remain and "
        f"the volume changes by {volumes[3]:.3f} %. (The noise itself changed it by {volumes[0]:.3f} %.)"
    )


def _format_alternatives(best: Row, tied: Sequence[Row]) -> str:
    """Return tied rows with their run times: the best, the fastest, and the number of others.

    Examples
    --------
    >>> from meshlab_specsmooth.comparison.filter_specs import FILTER_SPECS
    >>> from meshlab_specsmooth.comparison.rows import Row
    >>> from meshlab_specsmooth.comparison.summary import _format_alternatives
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


def _list_left_out(found: Ranking) -> list[str]:
    """Return the labels of columns that a smaller mesh would have."""
    wanted = ("surface_error", "hausdorff", "intersections") if found.truth is not None else ("intersections",)
    return [MEASURES[key].label for key in wanted if MEASURES[key] not in found.columns]


def _explain_estimates(found: Ranking) -> Iterable[str]:
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


def _compare_with_others(found: Ranking) -> Iterable[str]:
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
        if point.values["estimated_error"] <= (1 + TIE_FRACTION) * best.values["estimated_error"]:
            seconds = point.values.get("seconds", math.nan)
            difference = f" (tied{_format_speedup(seconds, best) if found.sample is None else ''})"
        error = format_estimate(point.values["estimated_error"], point.uncertainty, with_uncertainty=False)
        yield f"MeshLab's best with its strength tuned has an estimated error of {error}{difference}: {point.call}."


def _compare_with_truth(found: Ranking, best: Row) -> Iterable[str]:
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


def _explain_without_estimates(found: Ranking) -> Iterable[str]:
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


def _format_excess(found: Ranking, other: Row | Point) -> str:
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


def _describe_side_effects(row: Row, found: Ranking) -> str:
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

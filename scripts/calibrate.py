#!/usr/bin/env python3
"""Measure anew the constants that were chosen by trial, and write docs/constants.md, where every constant is listed.

python3 scripts/calibrate.py                         everything; a quarter of an hour on two cores
python3 scripts/calibrate.py --only noise.estimate   constants whose names contain this; the other rows stay
python3 scripts/calibrate.py --list                  names, and whether they are measured

A constant that separates two cases is varied, in steps, until a case comes out wrong: the margin is the factor by which
it may fall and rise. One that trades is varied, too: the change of the error says what another value would gain. What
is bounded is measured, and the margin is the bound over the largest measured value. The surfaces are those of
calibration_shapes.py; none of them is one of the quality benchmark's.
"""

import argparse
import ast
import fnmatch
import functools
import importlib
import multiprocessing
import os
import re
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import bootstrap

if __name__ == "__main__":
    bootstrap.enter("test")
    os.environ.update(dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS"), "1"))

import calibration_cases as cases
import numpy as np

PACKAGE = "meshlab_specsmooth"
PAGE = bootstrap.ROOT / "docs" / "constants.md"

# --- the constants of the package ---


def constants() -> dict[str, object]:
    """Every module-level constant of numbers, by its name without the package's."""
    root = bootstrap.ROOT / PACKAGE
    found = {}
    for path in sorted(root.rglob("*.py")):
        tree = ast.parse(path.read_text(encoding="utf-8"))
        assigned = [name for statement in tree.body for name in _assigned(statement)]
        if not assigned:
            continue
        module = ".".join(path.relative_to(root).with_suffix("").parts)
        value_of = vars(importlib.import_module(f"{PACKAGE}.{module}".removesuffix(".__init__")))
        found.update(
            {
                f"{module}.{name}".replace("__init__.", ""): value_of[name]
                for name in assigned
                if _is_numeric(value_of[name])
            }
        )
    return found


def _assigned(statement: ast.stmt) -> list[str]:
    """Names that a statement assigns to, if there is a number in it."""
    if isinstance(statement, ast.Assign):
        targets, value = statement.targets, statement.value
    elif isinstance(statement, ast.AnnAssign) and statement.value is not None:
        targets, value = [statement.target], statement.value
    else:
        return []
    if not any(isinstance(node, ast.Constant) and type(node.value) in (int, float) for node in ast.walk(value)):
        return []
    return [node.id for target in targets for node in ast.walk(target) if isinstance(node, ast.Name)]


def _is_numeric(value: object) -> bool:
    leaves = list(_leaves(value))
    return any(isinstance(leaf, (int, float, np.number)) and not isinstance(leaf, bool) for leaf in leaves) and all(
        isinstance(leaf, (int, float, str, bytes, np.number)) for leaf in leaves
    )


def _leaves(value: object) -> Iterator[object]:
    if isinstance(value, dict):
        value = list(value.values())
    if isinstance(value, np.ndarray):
        value = value.ravel().tolist() if value.dtype.names is None else [None]
    if isinstance(value, (tuple, list, frozenset)):
        for each in value:
            yield from _leaves(each)
    else:
        yield value


def show(value: object) -> str:
    """A value as it is written in the page, to six digits, long ones cut."""
    if isinstance(value, np.ndarray):
        value = tuple(value.ravel().tolist())
    if isinstance(value, dict):
        text = ", ".join(f"{key}: {show(each)}" for key, each in value.items())
    elif isinstance(value, (tuple, list, frozenset)):
        text = ", ".join(map(show, sorted(value) if isinstance(value, frozenset) else value))
        text = f"({text})"
    elif isinstance(value, (int, np.integer)):
        text = str(value)
    else:
        text = f"{value:.6g}" if isinstance(value, float) else str(value)
    return text if len(text) <= 90 else f"{text[:87]}..."


@dataclass(frozen=True)
class Place:
    """Where a number stands: a module's name, and what to look up in its value, if that is more than one number."""

    dotted: str

    @property
    def name(self) -> str:
        return self.dotted.partition("[")[0]

    @property
    def key(self) -> "tuple[str | int, ...]":
        return tuple(int(k) if k.isdigit() else k for k in re.findall(r"\[(\w+)\]", self.dotted))

    def value(self) -> float:
        module, _, name = self.name.rpartition(".")
        value = getattr(importlib.import_module(f"{PACKAGE}.{module}"), name)
        for key in self.key:
            value = value[key]
        return value

    @contextmanager
    def set_to(self, number: float) -> Iterator[None]:
        """Another number there, and in all modules that have imported it."""
        module, _, name = self.name.rpartition(".")
        old = getattr(importlib.import_module(f"{PACKAGE}.{module}"), name)
        new = _replaced(old, self.key, number)
        own = f"{PACKAGE}.{module}"
        holders = [
            m
            for key, m in list(sys.modules.items())
            if key == own or (key.startswith(PACKAGE) and _imports(m, own, name))
        ]
        for m in holders:
            setattr(m, name, new)
        try:
            yield
        finally:
            for m in holders:
                setattr(m, name, old)


@functools.cache
def _imports(module: object, own: str, name: str) -> bool:
    if name not in vars(module) or not getattr(module, "__file__", None):
        return False
    tree = ast.parse(Path(module.__file__).read_text(encoding="utf-8"))
    return any(
        isinstance(node, ast.ImportFrom) and node.module == own and any(alias.name == name for alias in node.names)
        for node in ast.walk(tree)
    )


def _replaced(value: object, key: "tuple[str | int, ...]", number: float) -> object:
    if not key:
        return number
    inner = _replaced(value[key[0]], key[1:], number)
    if isinstance(value, dict):
        return value | {key[0]: inner}
    return type(value)(inner if i == key[0] else each for i, each in enumerate(value))


# --- ways of measuring ---


@dataclass(frozen=True)
class Finding:
    """What was measured, in the words of the page, and whether it defends the value."""

    measured: str
    margin: str
    on: str
    is_defended: bool = True


STEPS = (1.05, 1.1, 1.2, 1.5, 2.0, 4.0)
DECADES = (3.0, 10.0, 100.0, 1e3, 1e4)  # for tolerances: that nothing depends on them is what they are to show
TRADED = (0.5, 0.8, 1.25, 2.0)
TWO_TRADED = (0.6, 1.6)  # where a call takes long
MARGIN = 1.05


def _values(place: Place, factors: "tuple[float, ...]", origin: float = 0.0) -> "list[tuple[float, float]]":
    """Factors and values, of an integer each once and at least by one."""
    value, found = place.value(), []
    for factor in factors:
        new = origin + (value - origin) * factor
        if isinstance(value, int):
            new = max(round(new), value + 1) if factor > 1 else min(round(new), value - 1)
            if new < 0 or (found and found[-1][1] == new):
                continue
        found.append((factor if not isinstance(value, int) else new / value, new))
    return found


def separates(
    of: Callable[[], "list[cases.Case]"], on: str, origin: float = 0.0, steps: "tuple[float, ...]" = STEPS
) -> Callable[[Place], Finding]:
    """Measure by which factor it, less the ``origin``, may fall and rise with all cases right."""

    def measure(place: Place) -> Finding:
        good, count = _good(of)
        good = list(good)
        sides, ends = [], []
        for factors in (tuple(1 / s for s in steps), steps):
            reached, wrong = 1.0, ""
            # from the outermost on: a case that comes out wrong there is looked at first, and mostly alone, further in
            for factor, value in reversed(_values(place, factors, origin)):
                with place.set_to(value):
                    failed = next((name for name, run in good if not _passes(run)), None)
                if failed is None:
                    reached = factor
                    break
                wrong = f"at {show(float(value))}: {failed}"
                good.sort(key=lambda case, failed=failed: case[0] != failed)
            ends += [wrong] if wrong else []
            sides.append((max(reached, 1 / reached), not wrong))
        known = [factor for factor, is_open in sides if not is_open]
        text = " / ".join(f"{'> ' if is_open else ''}{factor:.3g}" for factor, is_open in sides)
        is_defended = min(known) >= MARGIN if known else steps is DECADES
        measured = "; ".join(ends) or "no case depends on it"
        return Finding(measured, text, f"{on} ({len(good)} of {count} as they should be)", is_defended)

    return measure


@functools.cache
def _good(made_by: Callable[[], "list[cases.Case]"]) -> "tuple[list[cases.Case], int]":
    made = made_by()
    return [case for case in made if _passes(case[1])], len(made)


def _passes(run: Callable[[], bool]) -> bool:
    try:
        return bool(run())
    except Exception:
        return False


def trades(
    errors: Callable[[], "dict[str, float]"],
    on: str,
    factors: "tuple[float, ...]" = TRADED,
    worth: float = 0.02,
    may_be_flat: bool = False,
) -> Callable[[Place], Finding]:
    """Measure how errors change at other values; defended where none gains more than ``worth``, and surely.

    Surely: by more than two standard errors over the cases. ``may_be_flat``: that errors hardly depend on it is what is
    wanted, as of a weak prior.
    """

    def measure(place: Place) -> Finding:
        found = [(value, *_change(errors, place, value)) for _, value in _values(place, factors)]
        text, least = _listed(found), min(change for _, change, _ in found)
        if all(abs(change) < 5e-4 for _, change, _ in found):
            return Finding(text, "no effect", _counted(errors, on), may_be_flat)
        is_defended = all(change > -worth or change > -2 * error for _, change, error in found)
        return Finding(text, f"best elsewhere {100 * least:+.1f} %", _counted(errors, on), is_defended)

    return measure


def converged(errors: Callable[[], "dict[str, float]"], on: str, finer: float) -> Callable[[Place], Finding]:
    """Measure how errors change where it is made finer and coarser; defended where finer gains no more than 1 %."""

    def measure(place: Place) -> Finding:
        values = _values(place, (finer, 1 / finer, finer**-2))
        found = [(value, *_change(errors, place, value)) for _, value in values]
        at = next(i for i, (factor, _) in enumerate(values) if (factor > 1) == (finer > 1))
        _, gain, error = found[at]
        is_defended = gain > -0.01 or gain > -2 * error
        return Finding(_listed(found), f"finer: {100 * gain:+.1f} %", _counted(errors, on), is_defended)

    return measure


def _change(errors: Callable[[], "dict[str, float]"], place: Place, value: float) -> "tuple[float, float]":
    """Of the geometric mean of the errors, relative, at another value; and its standard error over the cases."""
    base = _base(errors)
    with place.set_to(value):
        new = errors()
    logs = [np.log(max(new[k], 1e-300) / max(base[k], 1e-300)) for k in base]
    return float(np.exp(np.mean(logs))) - 1, float(np.std(logs) / np.sqrt(len(logs)))


def _listed(found: "list[tuple[float, float, float]]") -> str:
    return ", ".join(f"{show(float(value))}: {100 * change:+.1f} %" for value, change, _ in found)


def _counted(errors: Callable[[], "dict[str, float]"], on: str) -> str:
    return f"{on}, {len(_base(errors))} cases"


@functools.cache
def _base(errors: Callable[[], "dict[str, float]"]) -> "dict[str, float]":
    return errors()


def bounds(what: Callable[[], "dict[str, float]"], on: str) -> Callable[[Place], Finding]:
    """The bound over the largest value measured."""

    def measure(place: Place) -> Finding:
        found, value = list(what().values()), place.value()
        margin = value / max(found)
        return Finding(f"{min(found):.3g} to {max(found):.3g}", f"{margin:.3g}", on, margin >= 1)

    return measure


def about(what: Callable[[], "dict[str, float]"], on: str, within: float = 1.5) -> Callable[[Place], Finding]:
    """Measure what the constant is a measure of: its factor to the geometric mean."""

    def measure(place: Place) -> Finding:
        found, value = np.array(list(what().values())), place.value()
        factor = value / float(np.exp(np.log(found).mean()))
        text = f"{found.min():.3g} to {found.max():.3g}"
        return Finding(text, f"{factor:.2f} of the mean", on, 1 / within < factor < within)

    return measure


# --- the table: what is measured, and how ---


@dataclass(frozen=True)
class Row:
    """A constant, or a number in one, what it is for, and how it is measured."""

    place: str
    purpose: str
    measure: Callable[[Place], Finding]


def rows(module: str, measure: Callable[[Place], Finding], **purposes: str) -> "list[Row]":
    """Rows of constants of a module that are measured alike; NAME__0 is NAME[0]."""
    places = [name.rpartition("__") for name in purposes]
    names = [f"{module}.{name}[{key}]" if name else f"{module}.{key}" for name, _, key in places]
    return [Row(name, purpose, measure) for name, purpose in zip(names, purposes.values(), strict=True)]


KIND = separates(cases.kinds, cases.KINDS)
KIND_ABOVE_ONE = separates(cases.kinds, cases.KINDS, origin=1.0)
EDGE_AWARE = trades(cases.edge_aware_errors, cases.EDGE_AWARE, factors=TWO_TRADED)
EDGE_AWARE_FLAT = trades(cases.edge_aware_errors, cases.EDGE_AWARE, factors=TWO_TRADED, may_be_flat=True)

ROWS: "list[Row]" = [
    *rows("noise.model", KIND, NEGLIGIBLE="edges of noise below which there is none"),
    *rows("noise.estimate", KIND, _MIN_OF_ROUNDING="level over the error of rounding"),
    *rows(
        "noise.local",
        separates(cases.varying, cases.VARYING),
        _MIN_RATIO="high over low level where noise varies",
        _SHARE="fraction of the vertices that is higher, or lower",
        _MIN_FRACTION="fraction of the level that is noise, where it is high",
    ),
    *rows(
        "noise.local",
        trades(cases.varying_errors, cases.VARYING_ERRORS, may_be_flat=True),
        _STEPS="steps of the walk over a neighborhood",
        _STEPS_OF_GROWTH="steps for the growth",
        _RINGS="rings in which the highest level counts",
    ),
    *rows(
        "noise.local",
        trades(cases.varying_denoised, cases.VARYING_DENOISED, factors=TWO_TRADED, may_be_flat=True),
        _MAX_STEP="highest over lowest level where something is measured",
        _MIN_SHARE_OF_BAND="smallest fraction of the vertices in a band",
    ),
    *rows(
        "edge_aware.denoising",
        trades(cases.varying_denoised, cases.VARYING_DENOISED, factors=(0.9, 1.2), may_be_flat=True),
        _AS_GOOD="error of the isotropic filter that is as good, over the least",
    ),
    *rows(
        "noise.voxels",
        separates(cases.masks, cases.MASKS),
        _MIN_TURNS="edges that are not flat",
        _MIN_OTHER_TURNS="those that turn the rarer way, over the others",
    ),
    *rows(
        "noise.voxels",
        separates(cases.masks, cases.MASKS, steps=DECADES),
        _EXACT="difference of edges that are equal, in mean edges",
        _TOLERANCE="off a lattice, and off right angles",
    ),
    *rows(
        "risk.choose_weight",
        trades(cases.mask_errors, cases.MASK_ERRORS, factors=(0.8, 0.9, 1.1, 1.25)),
        _MAX_HALVES="halves of a voxel that vertices move by",
        _MAX_HALVES_OF_CORNERS="the same for corners of voxels",
        STAIRCASE_WAVELENGTH="shortest wave of the low-pass for masks, in edges",
        STAIRCASE_ITERATIONS="passes for masks",
    ),
    *rows("noise.scales", KIND, CORRELATION_STEPS="steps of the walk of correlated noise"),
    *rows(
        "noise.classify",
        KIND,
        _OUTLIER_SIGMAS="standard deviations beyond which residuals are excluded",
        _STANDARD_ERRORS="standard errors that levels of impulses rise by besides",
        _SHAPE_BAND_DECAY__0="decay of a shape's level from the third band to the second",
        _SHAPE_BAND_DECAY__1="and from the fourth to the third",
        _GROWTH_OF_SHAPE="growth of a shape's amplitude per octave",
        _MIN_LATTICE_STEPS="values on a lattice of rounded coordinates",
        _MIN_VERTICES_PER_STEP="vertices per value",
        _MAX_ASPECT="median aspect of triangles that still show noise",
        _GROWTH_OF_COARSE__0="growth of coarse detail from the second band to the third",
        _GROWTH_OF_COARSE__1="and from the third to the fourth",
        _MIN_LEVEL_RATIO="level in L^4 over L^2 of coarse detail",
        _MAX_OUTLIERS="fraction of outliers of coarse detail",
        _MAX_FLAT="fraction of flat edges under noise",
        _MAX_ASPECT_OF_FLAT="median aspect above which flat edges are those of a CAD model",
        _GROWTH_OF_FLAT="growth of a shape with flat faces from the third band to the fourth",
        _EXACT_FRACTIONS__0="lowest fraction of exactly flat edges of a CAD model",
        _EXACT_FRACTIONS__1="highest; above is a mask",
        _LARGEST="quantile of the deviations whose repeats are counted",
        _MAX_REPEATS__impulse="fraction of repeats among impulses",
        _MAX_REPEATS__quantized="fraction of repeats under rounding",
        _MAX_LEVEL="edges of noise above which it is a coarse shape",
        _MIN_ANISOTROPY="largest eigenvalue of the covariance over the mean, of directional noise",
    ),
    *rows(
        "noise.classify",
        separates(cases.kinds, cases.KINDS, steps=DECADES),
        _FLAT_HEIGHT="height of flat corners, in noise levels",
        _EXACT_HEIGHT="height of exactly flat corners, in edges",
        _REPEATED="difference of deviations that repeat, in edges",
    ),
    *rows(
        "noise.classify",
        KIND,
        _MIN_KURTOSIS_OF_IMPULSES="kurtosis of impulses amid white noise",
        _MIN_LEVEL_OF_TAILS="edges of noise from which on kurtosis counts",
    ),
    *rows(
        "noise.classify",
        KIND_ABOVE_ONE,
        _MIN_RISE_OF_IMPULSES="rise of the level of impulses from L^2 to L^4 (less 1)",
        _MIN_OVER_FIRST_BAND="variance of correlated noise in the second band over the first (less 1)",
        _MIN_OVER_SECOND_BAND="and in the third over the second (less 1)",
        _GROWTH_OF_DETAIL="growth of detail from the first band to the second (less 1)",
        _SCATTER="scatter of noise there (less 1)",
        _MAX_RMS_OVER_MAD="root mean square over median of isotropic noise (less 1)",
    ),
    *rows(
        "noise.classify",
        trades(cases.level_errors, cases.LEVELS),
        _RIDGE="regularization of the covariance",
    ),
    *rows(
        "noise.estimate",
        trades(cases.level_errors, cases.LEVELS),
        WEIGHT_TIMES_LEVEL="initial weight times the level in edges",
    ),
    *rows(
        "noise.estimate",
        converged(cases.level_errors, cases.LEVELS, 1 / 3),
        GUIDE_RTOL="relative error of a guide",
    ),
    *rows(
        "noise.estimate",
        about(cases.level_scatter, "levels of white noise over 30 seeds, 4 shapes", 1.35),
        _STANDARD_ERROR="standard error of a level times the root of the number of vertices",
    ),
    *rows(
        "noise.estimate",
        bounds(cases.level_bias, "mean levels of white noise over 12 seeds, 5 shapes"),
        _BIAS="what guide and shape add to the error of a level",
    ),
    *rows(
        "noise.outliers",
        separates(cases.strays, cases.STRAYS),
        _MIN_OVER_MEDIAN="distance of a stray over the median",
        _MIN_OVER_EDGE="over the edges around it",
        _MIN_OVER_NEIGHBORS="over that of its neighbors",
        _MIN_OUT_OF_PLANE="height over the plane of its neighbors, as a fraction of the distance",
        _MIN_OUT_OF_REACH="or edges to the nearest of them",
        _MAX_NEIGHBORS="neighbors of a tip that is part of the shape",
        MAX_FRACTION="fraction of strays, above which it is impulse noise",
        _MIN_OVER_MEAN_EDGE="edges, of candidates",
        _MAX_SEARCHES="searches",
    ),
    *rows(
        "noise.parts",
        separates(cases.components, cases.COMPONENTS),
        _STANDARD_ERROR="standard error of a level times the root of the number of vertices",
    ),
    *rows(
        "noise.parts",
        separates(cases.components, cases.COMPONENTS, origin=1.0),
        _MAX_EDGE_RATIO_OF_SMALL="ratio of edges of a small component that joins a group (less 1)",
        _MAX_EDGE_RATIO="ratio of edges in a group (less 1)",
        _MAX_LEVEL_RATIO="ratio of levels in a group (less 1)",
    ),
    *rows(
        "noise.shape_change",
        separates(cases.harm, cases.HARM),
        _MAX_VOLUME="change of the volume that no noise explains",
        _MAX_VOLUME_OF_MASK="and no rounding",
        _SIGMAS="standard errors of noise that are allowed for",
    ),
    *rows(
        "noise.shape_change",
        bounds(cases.shared_by, "variance of the mean of correlated noise over 60 seeds, 3 shapes"),
        _CORRELATED_OVER="vertices that count as one under correlated noise",
    ),
    *rows(
        "noise.thin_triangles",
        separates(cases.thin, cases.THIN),
        _MAX_ASPECT="aspect of a face that still shows noise",
    ),
    *rows(
        "risk.choose_weight",
        trades(cases.smooth_errors, cases.SMOOTH),
        _STEP="step of the search",
        _RISK_TOLERANCE="risk over the least that is as good",
    ),
    *rows(
        "risk.choose_weight",
        converged(cases.smooth_errors, cases.SMOOTH, 2.0),
        _MAX_STEPS="steps of the search",
    ),
    *rows(
        "risk.choose_weight",
        converged(cases.smooth_errors, cases.SMOOTH, 1 / 4),
        _TOLERANCE="relative error of the low-pass in the search",
    ),
    *rows(
        "risk.impulses",
        trades(cases.impulse_errors, cases.ROBUST),
        _ITERATIONS="iterations of the clipping",
        _WEIGHT="its weight",
    ),
    *rows(
        "risk.estimate_error",
        trades(cases.probe_errors, cases.PROBES, worth=0.1),
        _STEP="size of a probe, in levels",
    ),
    *rows(
        "smoothing.tangential",
        trades(cases.smooth_errors, cases.SMOOTH, may_be_flat=True),
        _TANGENTIAL_RAMP__0="edges of noise below which nothing moves along the surface",
        _TANGENTIAL_RAMP__1="edges of noise above which all of that is kept",
    ),
    *rows(
        "edge_aware.filter",
        EDGE_AWARE,
        _SPATIAL_SIGMA="spatial sigma, in distances of centroids",
        _VERTEX_STEPS="gradient steps of the vertices",
    ),
    *rows(
        "edge_aware.filter",
        converged(cases.edge_aware_errors, cases.EDGE_AWARE, 1 / 4),
        _RTOL="relative error of the normals",
    ),
    *rows(
        "edge_aware.filter",
        converged(cases.edge_aware_errors, cases.EDGE_AWARE, 2.0),
        _MAX_CG_ITERATIONS="iterations for the normals",
    ),
    *rows(
        "edge_aware.search",
        EDGE_AWARE,
        _MAX_GUIDE_WEIGHT="highest weight of the guide",
        _RISK_TOLERANCE="risk over the least that is as good",
        _FULL_STEP="size of a probe, in levels, less what follows",
    ),
    *rows(
        "edge_aware.search",
        trades(cases.edge_aware_correlated, cases.EDGE_AWARE_CORRELATED),
        _MIN_GUIDE_WEIGHT="lowest weight of the guide",
    ),
    *rows(
        "edge_aware.search",
        EDGE_AWARE_FLAT,
        _STRENGTHS__0="lowest strength of the search",
        _STRENGTHS__1="highest",
        _RANGE_SIGMAS__0="lowest range sigma",
        _RANGE_SIGMAS__1="highest",
    ),
    *rows(
        "edge_aware.search",
        trades(cases.denoise_errors, cases.DENOISE, factors=TWO_TRADED),
        _FIRMER="factor of further weights that are evaluated",
    ),
    *rows(
        "edge_aware.search",
        trades(cases.edge_aware_hit, cases.EDGE_AWARE_HIT, factors=TWO_TRADED),
        _LESS_BY_DENSITY="less, times the fraction of vertices with noise",
    ),
    *(
        Row(f"edge_aware.search._COARSE[{i}][{j}]", f"{what} of starting point {i + 1} of the search", EDGE_AWARE_FLAT)
        for i in range(7)
        for j, what in ((1, "strength"), (2, "range sigma"))
    ),
    *rows(
        "edge_aware.operators",
        trades(cases.open_denoised, cases.OPEN_DENOISED, factors=TWO_TRADED, may_be_flat=True),
        _MIN_BENT="weight from which on a boundary is not bent",
        _WEIGHT_OF_RIM="weight at a boundary, for smaller ones",
        _RINGS_OF_RIM="rings over which it falls",
    ),
    *rows(
        "edge_aware.creases",
        separates(cases.creases, cases.CREASES, steps=DECADES),
        _STRENGTH="strength at which creases are found",
    ),
    *rows(
        "edge_aware.creases",
        separates(cases.creases, cases.CREASES),
        _RANGE_SIGMA="range sigma for that",
        _ITERATIONS="iterations",
    ),
    *rows(
        "operators.patches",
        trades(cases.sampled_levels, cases.SAMPLED, worth=0.5),
        _COUNT="patches of a large mesh",
        _SIZE="vertices of a patch",
    ),
    *rows(
        "operators.patches",
        trades(cases.open_level_errors, cases.OPEN_LEVELS),
        _MARGIN="rings at a boundary that are not counted",
    ),
    *rows(
        "operators.reconstruction",
        bounds(cases.displacement_off, "displacements at weights 0.03 to 1, 4 shapes, against eigenvectors"),
        TOLERANCE="relative error of a displacement",
    ),
    *rows(
        "operators.preconditioner",
        trades(cases.sweeps, "sweeps of the least squares, weights 0.03 to 0.7, 4 shapes", may_be_flat=True),
        _MAX_RESIDUAL="largest residual of the polynomial",
        MAX_WEIGHT="weight from which on the diagonal is used",
    ),
    *rows(
        "spectral.chebyshev",
        bounds(cases.polynomial_between, "the cosine's fall over half a step"),
        _BETWEEN_SAMPLES="rise of a polynomial between samples",
    ),
    *rows(
        "spectral.density",
        trades(cases.count_errors, f"{cases.COUNTS}; more probes take longer", worth=0.5),
        _MAX_PROBES="random vectors",
    ),
    *rows(
        "spectral.density",
        trades(cases.large_count_errors, cases.LARGE_COUNTS, worth=0.5),
        _WANTED_SAMPLES="vertices times random vectors",
    ),
    *rows(
        "spectral.density",
        trades(cases.count_errors, cases.COUNTS, worth=0.05),
        _DEGREE="degree of the moments",
        _BANDS="bands that the law is fitted in",
        _FITTED_TO="eigenvalue up to which it is fitted",
        _LAW_TO="eigenvalue above which the moments alone count",
    ),
    *rows("spectral.density", converged(cases.count_errors, cases.COUNTS, 2.0), _GRID="points of the table"),
    *rows(
        "spectral.density",
        trades(cases.score_loss, cases.SCORES, worth=0.05, may_be_flat=True),
        _LATTICE_PRIOR__0="prior of the lattice's fraction",
        _LATTICE_PRIOR__1="of its linear growth",
        _LATTICE_PRIOR__2="of its quadratic growth",
        _BOUNDARY_PRIOR__0="prior of the boundary's modes, by its length",
        _BOUNDARY_PRIOR__1="by the root of n",
        _MIN_SCATTER="variance of a count about any law",
        _SCATTER_GROWTH="its growth with the root of the count",
    ),
    *rows(
        "spectral.inertia",
        bounds(cases.fill, "9 shapes of 1.2 to 25 thousand vertices"),
        FILL="entries of L over n log2 n",
    ),
    *rows(
        "spectral.inertia",
        separates(cases.inertia_counts, cases.INERTIA, steps=DECADES),
        _MAX_GROWTH="growth of factors that are sound",
    ),
    *rows(
        "spectral.lanczos",
        trades(cases.solves, cases.SOLVES, worth=0.25, may_be_flat=True),
        BLOCK="vectors in a block; small ones take fewer solves, large ones less time for each",
        _MIN_FRACTION_BELOW="lowest fraction that is accepted",
        _MAX_SHIFTS="shifts that are tried",
        _WANTED_RESIDUAL="residual of an eigenpair",
    ),
    *rows(
        "spectral.lanczos",
        trades(cases.solves, cases.SOLVES, factors=(0.5, 0.8, 1.25, 1.5), worth=0.25),  # 1 is too much
        _FRACTION_BELOW="fraction of the wanted eigenvalues below the shift",
    ),
    *rows(
        "spectral.lanczos",
        separates(cases.eigenpairs, cases.EIGENPAIRS),
        _VECTORS_PER_PAIR="vectors of the basis per wanted pair",
    ),
    *rows(
        "spectral.lanczos",
        separates(cases.eigenpairs, cases.EIGENPAIRS, steps=DECADES),
        _ORTHOGONALITY_LOSS="loss of orthogonality before vectors are orthogonalized again",
        _REORTHOGONALIZE_BELOW="remainder of a block that may be rounding",
        _BREAKDOWN_TOL="remainder that is rounding",
    ),
    *rows(
        "operators.assemble",
        bounds(
            cases.peak_bytes("mss.smooth(V, F)", "V"),
            "smooth of 0.9 million vertices, in order, shuffled, and without numba",
        ),
        BYTES_PER_VERTEX="memory of a call, per vertex",
    ),
    *rows(
        "edge_aware.denoising",
        bounds(
            cases.peak_bytes("mss.smooth_edge_aware(V, F)", "F"),
            "smooth_edge_aware of 1.8 million faces, in order, shuffled, and without numba",
        ),
        _BYTES_PER_FACE="memory of a call, per face",
    ),
]

# --- constants that are not chosen by trial: the first pattern that fits says why ---

OTHERS: "dict[str, tuple[str, ...]]" = {
    "mathematics": (
        "*MAD_OF_UNIT_NORMAL",
        "*._ASPECT_OF_EQUILATERAL",
        "*.WEYL",
        "*._INVERSE_ERFC",
        "*._EPSILON",
        "operators.patches._INTERLEAVED",
        "operators.laplacians._SHARPEST_COTANGENT",
        "operators.laplacians._LEAST_WEIGHT",
        "spectral.density._NODES",
        "geometry.welding._MULTIPLIERS",
        "*.COLUMNS",
        "noise.local._MEAN_OF_LOG",
        "noise.classify._FINER_BAND",
        "noise.classify._COARSER_BAND",
    ),
    "a seed: any number": ("*SEED",),
    "file format or system": (
        "meshlab.gltf.*",
        "meshlab.headers.*",
        "meshlab.textures.*",
        "meshlab.texture_output.*",
        "meshlab.images.*",
        "meshlab.creases.*",
        "meshlab.losses.*",
        "meshlab.xmltree.*",
        "meshlab.descriptors.*",
        "meshlab.mesh_files.*",
        "pieces.ply.*",
        "isolation.*",
        "cli.DONE",
        "cli.FAILED",
        "cli.USAGE",
        "cli.deviation.EXCEEDED",
        "adapters.*",
        "batching.inputs.*",
        "meshlab.commit.*",
    ),
    "range of numbers": (
        "geometry.surface.*",
        "parameters.*",
        "*_EXPONENT",
        "meshlab.precision.*DRAWN",
        "smoothing.*._WAVELENGTH_LIMITS",
        "risk.estimate_error._MIN_DENSITY",
        "risk.estimate_error._MAX_COVARIANCE",
        "noise.estimate.MIN_WEIGHT",
        "operators.preconditioner.MIN_WEIGHT",
        "operators.preconditioner._MAX_MIXED",
        "noise.estimate.MAX_WEIGHT",
        "operators.patches.MIN_VERTICES",
        "noise.classify._CANCELED",
        "noise.outliers._MIN_NEIGHBORS",
        "*._DIGITS",
        "*.SAME_EIGENVALUE",
        "*._MIN_RESIDUAL",
        "*.MAX_DEGREE",
        "*.MIN_COUNTED",
        "noise.parts._MIN_MEASURED",
        "noise.local._LOWEST",
        "noise.local._MIN_VARIANCE",
        "risk.choose_weight._MAX_PROFILE",
        "risk.choose_weight._MAX_WEIGHT_OF_STAIRCASE",
    ),
    "pictures and texts": (
        "reports.*",
        "cli.*",
        "describe.*",
        "*._SHOWN",
        "*._MAX_SHOWN",
        "comparison.tables.*",
        "meshlab.filters._MAX_PICTURED",
        "noise.shape_change._WORTH_SAYING",
        "noise.shape_change._LARGE",
        "smoothing.*._WORTH_A_WARNING",
        "smoothing.*._MAX_KEPT_FRACTION",
        "meshlab.precision.*",
    ),
    "fraction of a progress bar": (
        "edge_aware.denoising._ASSEMBLED",
        "edge_aware.denoising._CHOSEN",
        "*._ASSEMBLY",
        "*.ASSEMBLY",
        "*._CHOICE",
        "*.WRITING",
        "*._MEASURING",
        "*._REMAINING",
        "*.ASSEMBLING",
    ),
    "size of the work, not the result": (
        "runtime.*",
        "comparison.distances.*",
        "comparison.parts.*",
        "comparison.*PROBES",
        "graph.*",
        "geometry.order*",
        "geometry.decimate.*",
        "operators.patches.*",
        "batching.*",
        "spectral.*.MEMORY_LIMIT",
        "spectral.eigenbasis.DENSE_VERTICES",
        "spectral.lanczos._SOLVED_TOGETHER",
        "spectral.lanczos._EXTRA_VECTORS",
        "spectral.inertia._BYTES_PER_ENTRY",
        "spectral.density.PROBES",
        "spectral.density._MIN_BAND_DEGREE",
        "spectral.chebyshev._OVERSAMPLING",
        "*.MAX_ITERATIONS",
        "*._MAX_CG_ITERATIONS_EXACT",
        "*._MAX_REPAIRS",
        "noise.parts._MAX_MEASURED",
        "noise.outliers._FILL_ITERATIONS",
        "meshlab.*._WRITING_BYTES_PER_VERTEX",
        "risk.estimate_error._BYTES_PER_DRAW",
        "risk.estimate_error._PROBES",
        "risk.choose_weight.LARGE",
        "risk.choose_weight._ACCURACY",
        "noise.local._MAX_MEASURED",
        "noise.voxels._MAX_DIFFERENT",
        "noise.voxels._MAX_LOOKED_AT",
        "noise.voxels._MAX_CANDIDATES",
        "error_field._PROBES",
        "edge_aware.search._COUNTS",
        "edge_aware.search._MORE",
        "smoothing.limit._MAX_ITERATIONS",
        "pieces.bands.*",
        "pieces.cut.*",
        "pieces.piece.*",
        "pieces.weld.*",
        "pieces.whole.*",
        "smoothing.limit._POWER_STEPS",
    ),
    "what is done by definition": (
        "smoothing.*.*_IN_EDGES",
        "smoothing.settings.*",
        "edge_aware.settings.*",
        "operators.boundary.BLENDING_RINGS",
        "smoothing.boundary.*",
        "smoothing.labels.BACKGROUND",
        "operators.curves.*",
        "power_spectrum.*",
        "comparison.*",
        "spectral.response.*",
        "noise.shape_change._SMALL_*",
        "noise.model.POWER_COUNT",
        "noise.model.BAND_COUNT",
        "risk.choose_weight._WITHIN",
        "risk.estimate_error._STEPS_OF_NOISE",
        "risk.estimate_error._STEPS_OF_SHAPE",
    ),
    "tolerance, relative to rounding or to what follows": (
        "spectral.lanczos._MAX_RESIDUAL",
        "spectral.lanczos._COUNT_PERTURBATION",
        "spectral.inertia._MAX_SHIFT_PERTURBATION",
        "spectral.inertia._PERTURBATION_STEPS",
        "smoothing.*.POSITION_TOLERANCE",
        "edge_aware.filter._RTOL_EXACT",
        "edge_aware.operators._EXACT",
        "risk.choose_weight._MIN_LEVEL",
        "smoothing.limit._TOLERANCE",
        "pieces.margin.*",
        "smoothing.limit._MARGIN",
    ),
    "grid or fallback of a search that is measured elsewhere": (
        "edge_aware.search._RATIOS",
        "noise.local._GUIDE_WEIGHT",
        "spectral.density._SCATTER",
        "noise.thin_triangles._MAX_LEVELS",
        "operators.preconditioner._CONTRACTIONS",
        "operators.preconditioner._MAX_RESIDUAL_OVER_WEIGHT",
        "operators.preconditioner._OCTAVE",
        "operators.patches._MARGIN_OF_WIDE",
        "risk.choose_weight._NARROW",
        "edge_aware.search._FAR_BETTER",
        "smoothing.automatic._RETRY_FACTOR",
        "smoothing.limit._WEIGHT",
        "smoothing.automatic._MAX_RETRIES",
    ),
}


def why(name: str) -> "str | None":
    """Why a constant is not measured."""
    return next((kind for kind, globs in OTHERS.items() if any(fnmatch.fnmatch(name, g) for g in globs)), None)


# --- the page ---

HEAD = """# The constants

Made by `python3 scripts/calibrate.py`, which measures the constants that were chosen by trial on surfaces made in code
(`scripts/calibration_shapes.py`); none of these is in the quality benchmark. The cases were not fixed beforehand:
noise that is correlated at 0.3 edges was dropped, terraces were exchanged, and the decimated shapes were varied until
they came out as none or unclear, so the rows that depend on these (`_EXACT_FRACTIONS[1]` above all) defend less than
they seem to. Cases that are wrong at the present values are left out of the margins, and counted. All other constants
are in the last table, with the reason why there is nothing to measure.

**Measured.** Of a constant that separates two cases: the values at which the first case comes out wrong, and that case;
the margin is the factor by which the constant may fall and rise with all cases right (`>`: as far as was tried). Of one
that trades: the change of the error at other values, in the geometric mean over the cases; the margin is what the best
of these would gain (negative) or lose. Of a bound: what was measured, and the bound over the largest of it. "Less 1"
means that the factors are of the excess over 1. A row marked **open** is not defended by this measurement: a case is
wrong within 5 % of the value, or nothing depends on it here, or another value is better by more than two standard
errors over the cases (and by 2 %, or as much as the time that it takes is worth).
"""

# Above the constants in the package; the rows have the names of the constants, after those of their modules.
ROW_COMMENT = "# docs/constants.md:"

COLUMNS = "| constant | value | what it is for | measured | margin | on |\n|---|---|---|---|---|---|"
OPEN = """Not defended by these measurements: another value would do as well or better here, or a case is wrong close
to the value. They stay until a change of results is wanted and measured on real surfaces.

"""
OTHER_COLUMNS = "| constant | value | why it is not measured |\n|---|---|---|"


def line_of(row: Row, finding: Finding) -> str:
    margin = finding.margin if finding.is_defended else f"{finding.margin}, **open**"
    cells = (f"`{row.place}`", show(Place(row.place).value()), row.purpose, finding.measured, margin, finding.on)
    return f"| {' | '.join(cells)} |"


def page(lines: "dict[str, str]") -> str:
    """The page, of lines by place."""
    everything = constants()
    measured = {Place(row.place).name for row in ROWS}
    parts = [HEAD.rstrip()]
    packages = dict.fromkeys(row.place.split(".")[0] for row in ROWS)
    for package in sorted(packages):
        own = [lines[row.place] for row in ROWS if row.place.split(".")[0] == package and row.place in lines]
        parts.append(f"## {package}\n\n{COLUMNS}\n" + "\n".join(own))
    others = [
        f"| `{name}` | {show(value)} | {why(name)} |" for name, value in everything.items() if name not in measured
    ]
    is_open = [name for row in ROWS if "**open**" in lines.get(name := row.place, "")]
    parts.append("## Open\n\n" + OPEN + "\n".join(f"- `{name}`" for name in is_open))
    parts.append(f"## Not measured\n\n{OTHER_COLUMNS}\n" + "\n".join(others))
    return "\n\n".join(parts) + "\n"


def read(path: Path) -> "dict[str, list[str]]":
    """The cells of the lines of a page, by constant."""
    if not path.exists():
        return {}
    found = {}
    for line in path.read_text(encoding="utf-8").splitlines():
        if line.startswith("| `"):
            cells = [cell.strip() for cell in line.strip("|").split(" | ")]
            found[cells[0].strip("` ")] = cells
    return found


def unaccounted(path: Path = PAGE) -> "list[str]":
    """Constants that the page has not, or with another value, and lines that are of none."""
    shown, everything = read(path), constants()
    places = {row.place: row for row in ROWS}
    measured = {Place(place).name for place in places}
    wanted = {name: value for name, value in everything.items() if name not in measured}
    wanted |= {place: Place(place).value() for place in places if Place(place).name in everything}
    wrong = [name for name, value in wanted.items() if name not in shown or shown[name][1] != show(value)]
    unexplained = [name for name in everything if name not in measured and why(name) is None]
    return [*wrong, *unexplained, *(name for name in shown if name not in wanted)]


def row_comments(text: str, module: str) -> str:
    """The text of a module with a comment above each assignment of measured constants, which names their rows."""
    measured = {Place(row.place).name for row in ROWS}
    lines = [line for line in text.split("\n") if not line.startswith(ROW_COMMENT)]
    for statement in reversed(ast.parse("\n".join(lines)).body):
        names = [name for name in _assigned(statement) if f"{module}.{name}" in measured]
        if names:
            lines.insert(statement.lineno - 1, f"{ROW_COMMENT} {', '.join(names)}")
    return "\n".join(lines)


def modules() -> "Iterator[tuple[str, Path]]":
    """Modules with measured constants, and their files."""
    for module in sorted({Place(row.place).name.rpartition(".")[0] for row in ROWS}):
        yield module, (bootstrap.ROOT / PACKAGE / Path(*module.split("."))).with_suffix(".py")


def _measured(index: int) -> "tuple[int, Finding, float]":
    begin = time.perf_counter()
    return index, ROWS[index].measure(Place(ROWS[index].place)), time.perf_counter() - begin


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument(
        "--only", action="append", metavar="NAME", help="constants whose names contain this; repeatable"
    )
    parser.add_argument("--out", metavar="FILE", default=str(PAGE), help="the page (default: docs/constants.md)")
    parser.add_argument("--list", action="store_true", help="names, and whether they are measured")
    parser.add_argument("--workers", type=int, default=len(os.sched_getaffinity(0)) if sys.platform == "linux" else 1)
    parser.add_argument("--comments", action="store_true", help="write the names of the rows above the constants")
    given = parser.parse_args()
    if given.comments:
        for module, path in modules():
            path.write_text(row_comments(path.read_text(encoding="utf-8"), module), encoding="utf-8")
        return
    if given.list:
        measured = {Place(row.place).name for row in ROWS}
        for name in constants():
            print(f"{name:60} {'measured' if name in measured else why(name)}")
        return
    out = Path(given.out)
    lines = {name: f"| {' | '.join(cells)} |" for name, cells in read(out).items()} if given.only else {}
    at = [i for i, row in enumerate(ROWS) if given.only is None or any(part in row.place for part in given.only)]
    begin = time.perf_counter()
    with multiprocessing.get_context("fork" if sys.platform == "linux" else "spawn").Pool(given.workers) as pool:
        for done, (i, finding, seconds) in enumerate(pool.imap(_measured, at), 1):
            row = ROWS[i]
            lines[row.place] = line_of(row, finding)
            mark = "" if finding.is_defended else "  OPEN"
            print(
                f"[{done}/{len(at)}] {row.place} = {show(Place(row.place).value())}: {finding.margin}{mark}", flush=True
            )
            print(f"      {finding.measured} ({seconds:.0f} s)", flush=True)
    out.write_text(page(lines), encoding="utf-8")
    print(f"{out}: {len(at)} rows in {time.perf_counter() - begin:.0f} s")


if __name__ == "__main__":
    main()

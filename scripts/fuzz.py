#!/usr/bin/env python3
"""Random public functions on random meshes with random parameters: each call ends finite, or with a typed error.

Meshes are valid, degenerate, non-manifold or open, with hostile values and in hostile containers; parameters are at
the ends of their range, of the wrong kind, or sane. A share of the calls is on MeshSets, which must be unchanged after
an error. Calls run in another process: one that crashes or never ends is counted, and the next call has a new process.
Every call depends on the seed and its number alone.

python3 scripts/fuzz.py                          100 000 calls
python3 scripts/fuzz.py --calls 2000 --seed 7
python3 scripts/fuzz.py --seconds 60             as many calls as fit
python3 scripts/fuzz.py --only 4711              one call again, with its traceback
"""

import argparse
import collections
import dataclasses
import itertools
import pathlib
import sys
import time
import traceback
import warnings
from collections.abc import Callable, Iterator
from decimal import Decimal
from fractions import Fraction
from typing import Any, NamedTuple

import bootstrap

if __name__ == "__main__":
    bootstrap.enter("test")

import numpy as np
import pymeshlab

import meshlab_specsmooth as mss
from meshlab_specsmooth.isolation.worker import Worker, WorkerFailed, serve
from meshlab_specsmooth.meshlab import descriptors, filters
from meshlab_specsmooth.noise.estimate import KINDS

TYPED = (mss.SpecsmoothError, pymeshlab.PyMeshLabException, pymeshlab.InvalidEnumException)
MESHSETS = 0.12  # the share of calls
TIMEOUT = 60.0  # seconds for a call
# What may be no number in a result: of an open surface, of one probe, of a setting that was given
MAY_BE_NAN = {"modes_error", "volume_change", "error", "standard_error", "risks", "considered"}

Rng = np.random.Generator


class Call(NamedTuple):
    """What is called, in words, and the function that does it."""

    text: str
    run: Callable[[], object]


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--calls", metavar="N", type=int, default=100_000, help="how many at most (default: 100000)")
    parser.add_argument("--seconds", metavar="S", type=float, default=float("inf"), help="how long at most")
    parser.add_argument("--seed", metavar="N", type=int, default=0, help="(default: 0)")
    parser.add_argument("--only", metavar="N", type=int, help="the number of one call, done in this process")
    parser.add_argument("--worker", action="store_true", help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.only is not None:
        call = make(given.seed, given.only)
        print(call.text)
        outcome = outcome_of(call, show=True)
        print(outcome)
        return int(is_failure(outcome))
    if given.worker:
        serve(lambda number: outcome_of(make(given.seed, number)))
        return 0
    start = time.perf_counter()
    counts: collections.Counter[str] = collections.Counter()
    for number, outcome in outcomes(given.seed, given.calls, start + given.seconds):
        counts[outcome] += 1
        if is_failure(outcome):
            print(f"{outcome}\n  {make(given.seed, number).text}\n  --seed {given.seed} --only {number}", flush=True)
    print(f"{counts.total()} calls in {time.perf_counter() - start:.0f} s, seed {given.seed}")
    for outcome, count in counts.most_common():
        print(f"{count:8}  {outcome}")
    failed = sum(count for outcome, count in counts.items() if is_failure(outcome))
    print(f"{failed} failures")
    return int(failed > 0)


def is_failure(outcome: str) -> bool:
    """Whether it is none of those promised."""
    return outcome.startswith("FAILURE")


def outcomes(seed: int, calls: int, until: float) -> Iterator[tuple[int, str]]:
    """The outcome of each call, done in processes that may die."""
    with Worker([sys.executable, __file__, "--worker", "--seed", str(seed)]) as worker:
        for number in itertools.takewhile(lambda _: time.perf_counter() < until, range(calls)):
            try:
                outcome = worker.ask(number, TIMEOUT)
            except WorkerFailed as error:
                outcome = f"FAILURE: the process {error}"
            yield number, outcome


def outcome_of(call: Call, show: bool = False) -> str:
    """How a call ends, in a few words without a line break or tab."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            result = call.run()
        except ChangedError as error:
            return f"FAILURE: {error}"
        except TYPED as error:
            if show:
                print(error)
            return type(error).__name__ if str(error) and "\n" not in str(error) else "FAILURE: no one-line message"
        except Exception as error:
            if show:
                traceback.print_exc()
            return f"FAILURE: {type(error).__name__}: {' '.join(str(error).split())[:120]}"
    bad = not_finite(result)
    return f"FAILURE: not finite: {bad}" if bad else "finite"


class ChangedError(Exception):
    """What must stay has not."""


def not_finite(result: object, name: str = "result") -> str:
    """Where in a result a number is none."""
    short = name.rpartition(".")[2]
    if dataclasses.is_dataclass(result) and not isinstance(result, mss.Prepared):
        parts = {f"{name}.{field.name}": getattr(result, field.name) for field in dataclasses.fields(result)}
        if isinstance(result, mss.Surface) or "that no face uses are not finite" in str(getattr(result, "warning", "")):
            parts.pop(f"{name}.vertices")  # such vertices stay as they are
    elif isinstance(result, dict):
        parts = {f"{name}.{key}": value for key, value in result.items()}
    elif isinstance(result, tuple | list):
        parts = {f"{name}[{i}]": value for i, value in enumerate(result)}
    else:
        if short.partition("[")[0] in MAY_BE_NAN:
            return ""
        if isinstance(result, float | np.ndarray) and np.asarray(result).dtype.kind == "f":
            # of the constant mode the wave is infinite
            wrong = np.isnan(result) if short == "wavelength" else ~np.isfinite(result)
            return name if np.any(wrong) else ""
        return ""
    if short.partition("[")[0] in MAY_BE_NAN:
        return ""
    return next(filter(None, (not_finite(value, key) for key, value in parts.items())), "")


# ---------------------------------------------------------------------------------------------------------------------
# Meshes
# ---------------------------------------------------------------------------------------------------------------------


def torus(rng: Rng) -> tuple[np.ndarray, np.ndarray]:
    nx, ny = (int(x) for x in rng.integers(3, 8, 2))
    i, j = (x.ravel() for x in np.meshgrid(np.arange(nx), np.arange(ny), indexing="ij"))
    t, p = 2 * np.pi * i / nx, 2 * np.pi * j / ny
    V = np.stack([(3 + np.cos(p)) * np.cos(t), (3 + np.cos(p)) * np.sin(t), np.sin(p)], axis=1)
    a, b, c, d = (((i + x) % nx) * ny + (j + y) % ny for x, y in ((0, 0), (1, 0), (1, 1), (0, 1)))
    return V, np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])


def sheet(rng: Rng) -> tuple[np.ndarray, np.ndarray]:
    nx, ny = (int(x) for x in rng.integers(2, 7, 2))
    i, j = (x.ravel() for x in np.meshgrid(np.arange(nx), np.arange(ny), indexing="ij"))
    a = (np.arange(nx - 1)[:, None] * ny + np.arange(ny - 1)).ravel()
    V = np.stack([i, j, 0.1 * i * j], axis=1).astype(float)
    return V, np.concatenate([np.stack([a, a + ny, a + ny + 1], axis=1), np.stack([a, a + ny + 1, a + 1], axis=1)])


def soup(rng: Rng) -> tuple[np.ndarray, np.ndarray]:
    n = int(rng.integers(1, 20))
    return rng.normal(size=(n, 3)), rng.integers(0, n, (int(rng.integers(1, 24)), 3))


def fan(rng: Rng) -> tuple[np.ndarray, np.ndarray]:
    n = int(rng.integers(4, 20))
    return rng.random((n, 3)), np.array([[0, 1, k] for k in range(2, n)])


def triangles(rng: Rng) -> tuple[np.ndarray, np.ndarray]:
    n = int(rng.integers(1, 8))
    return rng.random((3 * n, 3)), np.arange(3 * n).reshape(n, 3)


def tetrahedron(rng: Rng) -> tuple[np.ndarray, np.ndarray]:
    return np.vstack([np.zeros(3), np.eye(3)]), np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])


SHAPES = (torus, torus, sheet, sheet, soup, soup, fan, triangles, tetrahedron)


def damage_faces(F: np.ndarray, n: int, rng: Rng) -> np.ndarray:
    """Faces with what real files have: doubles, degenerate ones, more than two at an edge."""
    what = int(rng.integers(0, 8))
    if what == 0:
        return np.concatenate([F, F[: len(F) // 2]])
    if what == 1:
        return np.concatenate([F, np.repeat(rng.integers(0, n, (2, 1)), 3, axis=1)])
    if what == 2:
        return np.concatenate([F, rng.integers(0, n, (3, 3))])
    if what == 3:
        return F[rng.permutation(len(F))][: max(1, len(F) // 2)]
    return F


def place(V: np.ndarray, rng: Rng) -> np.ndarray:
    """Coordinates where numbers end, and shapes that have no extent in some direction."""
    V = V + rng.choice([0.0, 0.05, 0.3]) * rng.normal(size=V.shape)
    what = int(rng.integers(0, 24))
    if what == 0:
        return V * 10.0 ** rng.integers(-300, 300)
    if what == 1:
        return np.ldexp(V, int(rng.integers(-1080, 998)))
    if what == 2:
        return V * 10.0 ** rng.integers(-150, 150, V.shape)
    if what == 3:
        return V * 10.0 ** rng.integers(-300, 300, (len(V), 1))
    if what == 4:
        V = V * 10.0 ** rng.choice([-300, -157, -10, 0, 10, 100, 153, 154, 157, 200])
        V[rng.integers(len(V))] = rng.choice([1e300, -1e300, 1e157, 1e10, 1e-300])
        return V
    if what == 5:
        return V * rng.choice([0.0, 1.0, 1e-8, 1e-160, 1e-315], 3)
    if what == 6:
        return V + rng.choice([1e6, 1e12, 1e16, 1e100, 1e300])
    if what == 7:
        return np.repeat(V[:1], len(V), axis=0)
    if what == 8:
        V[: len(V) // 2] = V[0]
        return V
    if what == 9:
        V[rng.integers(len(V))] *= 5e-324
        return V
    if what == 10:
        return np.round(V * 4) / 4
    if what == 11:
        V[::2] *= rng.choice([1e-200, 1e-20, 1e20, 1e200])
        return V
    return V


class Odd:
    """An object whose conversion to an array fails as it likes."""

    def __array__(self, dtype: object = None, copy: object = None) -> np.ndarray:
        raise ZeroDivisionError("no array")

    def __repr__(self) -> str:
        raise RuntimeError("no text")

    def __eq__(self, other: object) -> bool:
        raise RuntimeError("not to be compared")

    __hash__ = None  # type: ignore[assignment]


def hostile_vertices(V: np.ndarray, rng: Rng) -> Any:
    W = V.copy()
    W[rng.integers(len(W)), rng.integers(3)] = rng.choice([np.nan, np.inf, -np.inf, 1e308])
    choices = (
        *(W, W, V[:, :2], V.ravel(), V[None], V[:0], [], None, "surface", b"surface", 3.0, object(), Odd(), {}, {1, 2}),
        *(V.astype(complex), V > 0, V.astype(str), V.astype(object), [[1, 2, 3], [4]], [[10**400, 0, 0]] * len(V)),
        *([[None, None, None]] * len(V), np.ma.masked_greater(V, 0.5), np.full(V.shape, 3, "m8[s]"), iter(V.tolist())),
        *(np.full(V.shape, np.longdouble("1e4000")), np.array(V.tolist(), dtype=np.longdouble), V.T),
    )
    return choices[rng.integers(len(choices))]


def hostile_faces(F: np.ndarray, n: int, rng: Rng) -> Any:
    G = F.astype(np.int64)
    G[rng.integers(len(G)), rng.integers(3)] = rng.choice([-1, n, 2**31, 2**62, -(2**63)])
    choices = (
        *(G, G, G, F[:, :2], F.ravel(), F[None], F[:0], [], None, "faces", 3, object(), Odd(), {}, F > 0),
        *(F.astype(float), F.astype(complex), F.astype(str), F.astype(object), [[0, 1, 2], [0]], [[10**400, 0, 0]]),
        *([[None, None, None]], np.array([[2**64 - 1, 0, 0]], dtype=np.uint64), F.astype("m8[s]"), iter(F.tolist())),
    )
    return choices[rng.integers(len(choices))]


def contained(V: np.ndarray, F: np.ndarray, rng: Rng) -> tuple[Any, Any]:
    """The same in what people hand over."""
    what = int(rng.integers(0, 12))
    if what == 0:
        return V.tolist(), F.tolist()
    if what == 1:
        return np.asfortranarray(V), np.asfortranarray(F)
    if what == 2 and np.abs(V).max() < 1e38:
        return V.astype(np.float32), F.astype(np.uint64)
    if what == 3:
        return V.astype(np.longdouble), F.astype(np.uint8)
    if what == 4 and np.abs(V).max() < 6e4:
        return V.astype(np.float16), F.astype(np.int16)
    if what == 5:
        V.flags.writeable = F.flags.writeable = False
    if what == 6:
        return V[::-1][::-1], tuple(map(tuple, F.tolist()))
    return V, F


def mesh_of(rng: Rng) -> tuple[np.ndarray, np.ndarray]:
    """Any arrays that the gate accepts."""
    V, F = SHAPES[rng.integers(len(SHAPES))](rng)
    if rng.random() < 0.2:
        V = np.concatenate([V, rng.normal(size=(2, 3))])  # without faces
    F = damage_faces(F, len(V), rng)
    return place(V, rng), F


# ---------------------------------------------------------------------------------------------------------------------
# Parameters
# ---------------------------------------------------------------------------------------------------------------------

ENDS = (0, 0.0, -0.0, 1, 1e-300, 5e-324, 1e-30, 1e-9, 1e-8, 1e8, 1e30, 1e300, 1.7976931348623157e308, -1, -1e-300)
# built anew for every call, as some of them can be used up
WRONG: tuple[Callable[[], Any], ...] = (
    *(lambda: "0.5", lambda: "", lambda: "a\nb" * 99, lambda: b"1", lambda: 1j, lambda: None, list, lambda: [0.5]),
    *(dict, lambda: {"a": 1}, lambda: {1}, lambda: (), lambda: object(), Odd, lambda: True, lambda: False),
    *(lambda: float("nan"), lambda: float("inf"), lambda: -float("inf"), lambda: 10**400, lambda: -(10**5000)),
    *(lambda: np.nan * np.float32(1), lambda: np.array(0.5), lambda: np.array(2), lambda: np.array([0.5])),
    *(lambda: np.ones(5), lambda: np.ones((2, 2)), lambda: np.array(None, dtype=object), lambda: np.array("x")),
    *(lambda: np.float16(0.5), lambda: np.float32(0.3), lambda: np.longdouble(0.3), lambda: np.longdouble("1e4000")),
    *(lambda: np.int8(2), lambda: np.uint64(2**63), lambda: np.int32(1), lambda: np.bool_(True), lambda: 2**31),
    *(lambda: np.complex128(1), lambda: np.timedelta64(3), lambda: np.datetime64("2020"), lambda: np.str_("auto")),
    *(lambda: Decimal("0.5"), lambda: Decimal("NaN"), lambda: Fraction(1, 3), lambda: Fraction(10**999, 3)),
    *(lambda: len, lambda: int, lambda: mss, lambda: iter([1]), lambda: slice(2), lambda: memoryview(b"1")),
)


def wrong(rng: Rng, name: str = "") -> Any:
    """A value at the ends of numbers, or of a wrong kind."""
    if rng.random() < 0.4:
        return ENDS[rng.integers(len(ENDS))]
    value = WRONG[rng.integers(len(WRONG))]()
    return 1 if name == "progress" and callable(value) else value  # what a callback raises is the caller's


def number(low: float, high: float) -> Callable[[Rng], Any]:
    """Numbers of any size between two."""
    return lambda rng: float(low * (high / low) ** rng.random())


def choice(*values: Any) -> Callable[[Rng], Any]:
    return lambda rng: values[rng.integers(len(values))]


def weights(rng: Rng) -> Any:
    """Marks a function that needs the number of vertices; see :func:`filled`."""
    return weights


def filled(n: int, rng: Rng) -> Any:
    """Weights of n vertices, some of them none."""
    w = rng.random(n)
    u = w.copy()
    u[rng.integers(n)] = rng.choice([np.nan, -0.1, 1.1, np.inf, 1e300])
    choices = (
        *(w, w, w > 0.5, np.zeros(n), np.ones(n), w.astype(np.float32), (w > 0.3).tolist(), (w > 0.5).astype(int)),
        *(u, w[:-1], w[:, None], np.ones(n, complex), np.full(n, "1"), [None] * n, np.ones(n, dtype=object)),
    )
    return choices[rng.integers(len(choices))]


LAPLACIAN = choice("uniform", "cotangent")
METHOD = choice("auto", "exact", "chebyshev")
BOUNDARY = choice("auto", "fixed", "curve", "free")
RESPONSE = choice("ideal", "butterworth", "gaussian", "heat")
LENGTH = number(1e-3, 1e3)
PROGRESS = choice(None, lambda fraction: None)
WEIGHT = number(1e-3, 1e3)

SMOOTH = {
    "modes": choice(1, 2, 3, 4, 9),
    "wavelength": LENGTH,
    "response": choice("auto", "ideal", "butterworth", "gaussian", "heat"),
    "barycenter_weight": WEIGHT,
    "criterion": choice("position", "normals"),
    "iterations": choice(1, 2, 3),
    "method": METHOD,
    "mode_count": choice("estimate", "exact"),
    "boundary": BOUNDARY,
    "mask": weights,
    "features": weights,
    "feature_gain": number(1e-2, 1e2),
    "progress": PROGRESS,
}
LOW_PASS = {
    "modes": choice(1, 2, 3, 4, 9),
    "wavelength": LENGTH,
    "response": RESPONSE,
    "method": METHOD,
    "mode_count": choice("estimate", "exact"),
    "mask": weights,
    "progress": PROGRESS,
}
ENHANCE = {
    "longest": number(1, 1e3),
    "shortest": number(1e-3, 1),
    "gain": number(1e-2, 1e2),
    "response": RESPONSE,
    "barycenter_weight": WEIGHT,
    "method": METHOD,
    "boundary": BOUNDARY,
    "mask": weights,
    "features": weights,
    "progress": PROGRESS,
}
EDGE_AWARE = {
    "criterion": choice("position", "normals"),
    "strength": number(1e-2, 1e2),
    "range_sigma": number(0.1, 2),
    "iterations": choice(1, 2, 3),
    "start": choice("auto", "given", "smoothed"),
    "barycenter_weight": WEIGHT,
    "progress": PROGRESS,
}
ALL = {"laplacian": LAPLACIAN}


def a_noise(rng: Rng) -> mss.Noise:
    values: dict[str, Any] = {"level": 0.1, "low": 0.09, "high": 0.11, "kind": KINDS[rng.integers(len(KINDS))]}
    values |= {"mean_edge": 1.0, "orders": (0.1,) * 4, "bands": (0.1,) * 6, "kurtosis": 0.0, "outliers": 0.0}
    values |= {"shared": 0.05, "covariance": np.eye(3), "hit": 0.5}
    if rng.random() < 0.5:
        values[list(values)[rng.integers(len(values))]] = wrong(rng)
    return mss.Noise(**values)


ERROR = {
    "noise": lambda rng: (a_noise if rng.random() < 0.5 else number(1e-3, 1))(rng),
    "probes": choice(1, 2, 3, 4),
    "seed": choice(0, 1, 2**40),
}
FILTERS = choice(
    *(lambda V: V, lambda V: 0.9 * V, lambda V: V * 1e200, lambda V: V[:-1], lambda V: V + 1j, lambda V: "surface"),
    *(lambda V: V * np.nan, lambda V: None, lambda V: V.tolist(), lambda V: Odd(), lambda V: V.astype(np.float32)),
    *(lambda V: 1 / 0, lambda V: V > 0, lambda V: V.astype(np.longdouble) * np.longdouble("1e4000")),
)


def parameters(known: dict[str, Callable[[Rng], Any]], n: int, rng: Rng) -> dict[str, Any]:
    """Some of the parameters, each sane or not."""
    given = {}
    for name, make_value in known.items():
        if rng.random() < 0.25:
            value = wrong(rng, name) if rng.random() < 0.3 else make_value(rng)
            given[name] = filled(n, rng) if value is weights else value
    return given


# ---------------------------------------------------------------------------------------------------------------------
# Calls
# ---------------------------------------------------------------------------------------------------------------------


def make(seed: int, number: int) -> Call:
    """The call of that number."""
    rng = np.random.default_rng([seed, number])
    if rng.random() < MESHSETS:
        return on_meshset(rng)
    if rng.random() < 0.02:
        return without_mesh(rng)
    return on_arrays(rng)


def _text(name: str, V: Any, F: Any, given: dict[str, Any]) -> str:
    def shown(value: Any) -> str:
        try:
            text = (
                f"{type(value).__name__} {np.array2string(value, threshold=200)}"
                if isinstance(value, np.ndarray)
                else repr(value)
            )
        except Exception:
            return f"<{type(value).__name__}>"
        return " ".join(text.split())[:1500]

    words = [shown(V), shown(F), *(f"{key}={shown(value)}" for key, value in given.items())]
    return f"{name}({', '.join(words)})"


def on_arrays(rng: Rng) -> Call:
    """A function of arrays."""
    V, F = mesh_of(rng)
    n = len(V)
    vertices, faces = contained(V, F, rng)
    if rng.random() < 0.06:
        vertices = hostile_vertices(V, rng)
    elif rng.random() < 0.06:
        faces = hostile_faces(F, n, rng)
    name, known = FUNCTIONS[rng.integers(len(FUNCTIONS))]
    given = parameters(known, n, rng)
    positional: list[Any] = [vertices, faces]
    if name == "estimate_error":
        positional.insert(0, wrong(rng) if rng.random() < 0.1 else FILTERS(rng))
    if name == "smooth" and "barycenter_weight" not in given and rng.random() < 0.5:
        given["barycenter_weight"] = WEIGHT(rng)  # without it, a call takes longer
    before = _bytes(vertices), _bytes(faces)

    def run() -> object:
        try:
            if name.startswith("Prepared."):
                own = {key: value for key, value in given.items() if key != "laplacian"}
                prepared = mss.prepare(*positional, **{k: given[k] for k in given if k == "laplacian"})
                method = getattr(prepared, name.partition(".")[2])
                first = method(**own)
                if name == "Prepared.smooth":
                    return [first, method(**own, start=first)]
                return first
            return getattr(mss, name)(*positional, **given)
        finally:
            if before != (_bytes(vertices), _bytes(faces)):
                raise ChangedError("the input was changed")

    return Call(_text(name, vertices, faces, given), run)


FUNCTIONS: list[tuple[str, dict[str, Callable[[Rng], Any]]]] = [
    *[("smooth", ALL | SMOOTH)] * 4,
    *[("Prepared.smooth", ALL | SMOOTH)] * 2,
    *[("low_pass", ALL | LOW_PASS)] * 2,
    ("Prepared.low_pass", ALL | LOW_PASS),
    *[("enhance", ALL | ENHANCE)] * 2,
    ("Prepared.enhance", ALL | ENHANCE),
    *[("smooth_edge_aware", EDGE_AWARE)] * 3,
    ("denoise", {"criterion": EDGE_AWARE["criterion"], "progress": PROGRESS}),
    ("estimate_noise", {}),
    *[("estimate_error", ERROR)] * 2,
    ("spectrum", ALL | {"bands": choice(2, 3, 64)}),
    ("self_intersecting_faces", {}),
    ("prepare", ALL),
    ("Surface", {}),
]


def _bytes(array: Any) -> bytes | None:
    return array.tobytes() if type(array) is np.ndarray and array.dtype != object else None


def on_meshset(rng: Rng) -> Call:
    """A filter on a MeshSet, by one of the ways to call it."""
    V, F = mesh_of(rng)
    V, F = np.array(V, dtype=np.float64), np.array(F, dtype=np.int32)
    name = list(filters.FILTERS)[rng.integers(len(filters.FILTERS))]
    given = {}
    for parameter in descriptors.load(name).parameters:
        if rng.random() < 0.25:
            given[parameter.name] = wrong(rng) if rng.random() < 0.3 else _value(parameter, rng)
    if rng.random() < 0.03:
        given["unknown"] = 1
    if rng.random() < 0.05:
        given["progress"] = wrong(rng, "progress")
    how = int(rng.integers(0, 12))
    marks = rng.random(len(V)) < 0.5 if rng.random() < 0.3 else None
    quality = rng.random(len(V)) if rng.random() < 0.3 else None

    def run() -> object:
        ms = mss.MeshSet()
        if how != 0:
            more = {} if quality is None else {"v_scalar_array": quality}
            ms.add_mesh(pymeshlab.Mesh(V, F if how != 1 else np.empty((0, 3), dtype=np.int32), **more))
        if marks is not None and how > 1:
            ms.set_selection_all()
        if how == 2:
            return getattr(mss, name)(wrong(np.random.default_rng(len(V))), **given)
        before = _state(ms)
        try:
            if how == 3:
                result = ms.apply_filter(name, **given)
            elif how == 4:
                result = ms.filter_parameter_values(name, **given)
            elif how == 5:
                result = getattr(ms, name)(**given)
            else:
                result = getattr(mss, name)(ms, **given)
        except TYPED as error:
            if not _same(before, _state(ms)):
                raise ChangedError(
                    f"the MeshSet was changed by a call that ended with {type(error).__name__}"
                ) from error
            raise
        after = _state(ms)
        if not np.array_equal(before["faces"], after["faces"]) or before["number"] != after["number"]:
            raise ChangedError("more than the vertices of the MeshSet was changed")
        return [result, after["vertices"], after["quality"]]

    words = {0: "empty", 1: "no faces", 2: "not a MeshSet", 3: "apply_filter", 4: "filter_parameter_values"}
    note = f"{words.get(how, 'direct')}, {'all' if marks is not None else 'nothing'} selected"
    return Call(f"MeshSet ({note}): {_text(name, V, F, given)}", run)


def _value(parameter: descriptors.Parameter, rng: Rng) -> Any:
    """A value that the filter takes."""
    if parameter.type == "enum":
        return parameter.values[rng.integers(len(parameter.values))]
    if parameter.type == "bool":
        return bool(rng.integers(2))
    if parameter.type == "int":
        return int(rng.integers(max(parameter.minimum, 0), min(parameter.maximum, 5) + 1))
    if parameter.type == "length" and rng.random() < 0.5:
        if rng.random() < 0.5:
            return pymeshlab.PercentageValue(choice(0.0, 1e-30, 1.0, 10.0, 100.0)(rng))
        return pymeshlab.PureValue(choice(0.0, 1.0, 1e300, 1e-300, -1.0, float("nan"), float("inf"))(rng))
    return float(rng.choice([parameter.minimum, 0.01, 0.1, 1.0, 2.0, min(parameter.maximum, 1e300)]))


def _state(ms: pymeshlab.MeshSet) -> dict[str, Any]:
    if ms.mesh_number() == 0:
        return {"number": 0, "vertices": np.empty(0), "faces": np.empty(0), "quality": None}
    mesh = ms.current_mesh()
    return {
        "number": ms.mesh_number(),
        "current": ms.current_mesh_id(),
        "vertices": mesh.vertex_matrix(),
        "faces": mesh.face_matrix(),
        "selected vertices": mesh.vertex_selection_array(),
        "selected faces": mesh.face_selection_array(),
        "quality": mesh.vertex_scalar_array() if mesh.has_vertex_scalar() else None,
    }


def _same(before: dict[str, Any], after: dict[str, Any]) -> bool:
    return all(np.array_equal(before[name], after[name]) for name in before)


def without_mesh(rng: Rng) -> Call:
    """Functions that start processes or write files, with one parameter that each must refuse."""
    bad = (None, 3.5, 10**400, b"x", 1j, float("nan"), object(), Odd(), np.ones(3), -1, {}, "a\0b", -(10**5000))
    value = bad[rng.integers(len(bad))]
    mesh = (np.vstack([np.zeros(3), np.eye(3)]), [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])
    which = int(rng.integers(3))
    if which == 0:
        names = ["mesh", "seed", "ground_truth", "noise", "filters", "out", "progress", "name"]
        name = names[rng.integers(len(names))]
        optional = {"ground_truth", "noise", "filters", "out", "progress", "name"}
        if (value is None and name in optional) or (name == "noise" and value is bad[1]) or isinstance(value, str):
            value = Odd()
        given: dict[str, Any] = {"mesh": mesh, name: value}
        return Call(_text("compare", mesh, None, given), lambda: mss.compare(given.pop("mesh"), **given))
    if which == 1:
        names = ["paths", "out", "filter_name", "scheduler", "workers", "time_limit", "resume", "ending", "pictures"]
        names += ["progress", "each", "iterations", "barycenter_weight", "unknown"]
        name = names[rng.integers(len(names))]
        if value is None or (name == "time_limit" and isinstance(value, int | float)) or isinstance(value, str):
            value = Odd()
        if name == "barycenter_weight" and value is bad[1]:
            value = -1
        given = {"paths": "nothing.ply", "out": pathlib.Path("/proc/nowhere"), name: value}
        return Call(
            _text("batch", "nothing.ply", None, given), lambda: mss.batch(given.pop("paths"), given.pop("out"), **given)
        )
    fields = ["name", "filter", "parameters", "times", "strength", "holds", "notes", "key"]
    given = {"name": "a", "filter": "apply_coord_taubin_smoothing", fields[rng.integers(len(fields))]: value}
    return Call(_text("FilterSpec", None, None, given), lambda: mss.FilterSpec(**given).call)


if __name__ == "__main__":
    sys.exit(main())

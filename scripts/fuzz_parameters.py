"""Random parameters for fuzz.py: valid, extreme, or of a wrong type."""

from collections.abc import Callable
from decimal import Decimal
from fractions import Fraction
from typing import Any

import numpy as np
from fuzz_meshes import Odd, Rng

import meshlab_specsmooth as mss
from meshlab_specsmooth.noise.model import KINDS

ENDS = (0, 0.0, -0.0, 1, 1e-300, 5e-324, 1e-30, 1e-9, 1e-8, 1e8, 1e30, 1e300, 1.7976931348623157e308, -1, -1e-300)
# Factories, as some of the values can only be used once
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
    """Choose an extreme number, or a value of a wrong type."""
    if rng.random() < 0.4:
        return ENDS[rng.integers(len(ENDS))]
    value = WRONG[rng.integers(len(WRONG))]()
    return 1 if name == "progress" and callable(value) else value  # errors of a callback are passed on


def number(low: float, high: float) -> Callable[[Rng], Any]:
    """Return a generator of log-uniform numbers between two bounds."""
    return lambda rng: float(low * (high / low) ** rng.random())


def choice(*values: Any) -> Callable[[Rng], Any]:
    return lambda rng: values[rng.integers(len(values))]


def weights(rng: Rng) -> Any:
    """Return a marker for weights, which need the number of vertices; see :func:`make_weights`."""
    return weights


def make_weights(n: int, rng: Rng) -> Any:
    """Make weights of n vertices, valid or not."""
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
    "spacing": choice(None, 0.3, (1.0, 1.0, 3.0)),
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
    values |= {
        "mean_edge": 1.0,
        "levels_by_power": (0.1,) * 4,
        "levels_by_band": (0.1,) * 6,
        "kurtosis": 0.0,
        "outliers": 0.0,
    }
    values |= {"correlated_level": 0.05, "covariance": np.eye(3), "impulse_density": 0.5}
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
    """Choose some of the parameters, each valid or not."""
    given = {}
    for name, make_value in known.items():
        if rng.random() < 0.25:
            value = wrong(rng, name) if rng.random() < 0.3 else make_value(rng)
            given[name] = make_weights(n, rng) if value is weights else value
    return given

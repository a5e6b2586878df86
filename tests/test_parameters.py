"""Every public function refuses invalid values of its parameters, and the message names the parameter."""

import inspect
from dataclasses import replace
from decimal import Decimal
from fractions import Fraction

import numpy as np
import pytest

import meshlab_specsmooth as mss
from meshlab_specsmooth import parameters
from tests.meshes import rough, torus

V, F = rough(torus(6, 5))
OPS = mss.assemble(V, F)


class Odd:
    """Cannot be converted to an array or to text, nor compared."""

    __hash__ = None

    def __array__(self, dtype=None, copy=None):
        raise ZeroDivisionError("no array")

    def __repr__(self):
        raise RuntimeError("no text")

    def __eq__(self, other):
        raise RuntimeError("not to be compared")


# Invalid for every parameter
INVALID = (1j, b"x", object(), Odd(), [0.5], {"a": 1}, np.ones(3), np.ones((2, 2)), Decimal("0.5"), -(10**5000))
FUNCTIONS = {
    **{
        f.__name__: (f, (V, F)) for f in (mss.smooth, mss.low_pass, mss.enhance, mss.assemble, mss.choose, mss.spectrum)
    },
    **{f.__name__: (f, (V, F)) for f in (mss.smooth_edge_aware, mss.denoise)},
    **{f"{f.__name__} of operators": (f, (OPS, None)) for f in (mss.smooth, mss.low_pass, mss.enhance)},
    "estimate_error": (mss.estimate_error, (lambda x: x, V, F)),
    "compare": (mss.compare, ((V, F),)),
    "batch": (mss.batch, ("nothing.ply", "/proc/nowhere")),
    "FilterSpec": (mss.FilterSpec, ("a", "apply_coord_taubin_smoothing")),
}


def settable(function, given):
    names = [name for name, p in inspect.signature(function).parameters.items() if p.kind is not p.VAR_KEYWORD]
    return names[len(given) :]


@pytest.mark.parametrize("name", FUNCTIONS)
def test_invalid_values_are_refused_and_the_parameter_is_named(name):
    function, given = FUNCTIONS[name]
    names = settable(function, given)
    assert names
    for parameter in names:
        for value in INVALID:
            if parameter == "parameters" and isinstance(value, dict):
                continue
            if parameter == "spacing" and isinstance(value, np.ndarray) and value.shape == (3,):
                continue
            if parameter == "ground_truth" and isinstance(value, np.ndarray | list):
                continue  # vertices without faces are a wrong surface
            with pytest.raises(mss.InvalidParameter, match=parameter) as caught:
                function(*given, **{parameter: value})
            assert "\n" not in str(caught.value)
            assert len(str(caught.value)) < 400


@pytest.mark.parametrize(
    ("function", "given", "words"),
    [
        (
            mss.smooth,
            {"barycenter_weight": np.ones((30, 2))},
            r"is an array of shape \(30, 2\); pass one number",
        ),
        (mss.smooth, {"barycenter_weight": np.ones(3)}, "has 3 entries; this mesh has 30 vertices"),
        (mss.smooth, {"barycenter_weight": np.zeros(30)}, r"barycenter_weight\[0\] is 0.0"),
        (mss.enhance, {"barycenter_weight": np.ones(30)}, r"is an array of shape \(30,\); it must be one number"),
        (mss.smooth, {"barycenter_weight": 1e300}, r"barycenter_weight is 1e\+300; it must be one number from 1.5e-08"),
        (mss.smooth, {"barycenter_weight": 1e-300}, "barycenter_weight is 1e-300"),
        (mss.smooth, {"iterations": 10**6}, "iterations is 1000000; it must be an integer from 1 to 1000"),
        (mss.smooth, {"iterations": True}, "iterations is True"),
        (mss.smooth, {"feature_gain": 1e300}, "feature_gain is 1e"),
        (mss.smooth, {"wavelength": True}, "wavelength is True"),
        (mss.smooth, {"response": None}, "response is None; it must be one of"),
        (mss.smooth, {"mask": np.full(30, "1")}, "mask has dtype <U1"),
        (mss.smooth, {"mask": np.ones(30, dtype=complex)}, "mask has dtype complex128"),
        (mss.smooth, {"progress": 1}, "progress is 1; it must be a function"),
        (mss.enhance, {"gain": 1e300}, "gain is 1e"),
        (mss.enhance, {"barycenter_weight": None}, "barycenter_weight is None"),
        (mss.smooth_edge_aware, {"strength": 1e-300}, "strength is 1e-300; it must be one number from 2.22e-16"),
        (mss.smooth_edge_aware, {"strength": 1e300}, "strength is 1e"),
        (mss.smooth_edge_aware, {"range_sigma": 1e-300}, "range_sigma is 1e-300"),
        (mss.smooth_edge_aware, {"iterations": 101}, "iterations is 101; it must be an integer from 0 to 100"),
        (mss.spectrum, {"bands": 10**9}, "bands is 1000000000"),
        (mss.spectrum, {"bands": 8.0}, "bands is 8.0"),
    ],
)
def test_the_message_states_the_bounds(function, given, words):
    with pytest.raises(mss.InvalidParameter, match=words):
        function(V, F, **given)


def test_numbers_of_every_kind_are_accepted():
    for weight in (np.float32(0.5), np.float16(0.5), np.longdouble(0.5), np.array(0.5), Fraction(1, 2)):
        assert np.array_equal(
            mss.smooth(V, F, barycenter_weight=weight, wavelength=np.float32(4)).vertices,
            mss.smooth(V, F, barycenter_weight=0.5, wavelength=4).vertices,
        )
    for iterations in (np.int8(2), np.uint64(2), np.array(2)):
        assert mss.smooth(V, F, barycenter_weight=np.int64(1), iterations=iterations).iterations == 2


@pytest.mark.parametrize(("low", "name"), [(0, "weight"), (1, "weight"), (0, "strength"), (1, "range_sigma")])
def test_results_are_finite_at_the_bounds(low, name):
    bounds = {"weight": parameters.BARYCENTER_WEIGHT_BOUNDS, "strength": parameters.STRENGTH_BOUNDS}
    value = (bounds | {"range_sigma": parameters.RANGE_SIGMA_BOUNDS})[name][low]
    if name == "weight":
        results = [mss.smooth(V, F, barycenter_weight=value), mss.enhance(V, F, barycenter_weight=value, gain=2.0**26)]
    else:
        results = [mss.smooth_edge_aware(V, F, iterations=2, **({"strength": 1.0, "range_sigma": 0.3} | {name: value}))]
    assert all(np.isfinite(result.vertices).all() for result in results)


def test_overflow_of_the_result_is_an_error():
    with pytest.raises(mss.InvalidParameter, match="leaves the range of numbers"):
        mss.enhance(np.ldexp(V, 997), F, gain=2.0**26, barycenter_weight=2.0**-26)


def test_a_start_of_another_mesh_is_refused():
    result = mss.smooth(OPS, barycenter_weight=1.0)
    other = mss.smooth(V * 1e300, F, barycenter_weight=1.0)
    tiny = mss.assemble(V * 1e-300, F)
    with pytest.raises(mss.InvalidParameter, match="start is too far from this mesh"):
        mss.smooth(tiny, barycenter_weight=1.0, start=other)
    with pytest.raises(mss.InvalidParameter, match="start is an array"):
        mss.smooth(OPS, barycenter_weight=1.0, start=result.vertices)


def test_anything_but_a_meshset_is_refused():
    for ms in (None, "mesh", (V, F), Odd()):
        with pytest.raises(mss.InvalidParameter, match="ms is .*; it must be a pymeshlab.MeshSet"):
            mss.apply_coord_spectral_smoothing(ms)


def test_a_modified_noise_must_be_consistent():
    noise = mss.estimate_noise(V, F)
    for wrong in (
        {"level": np.nan},
        {"kind": "loud"},
        {"covariance": np.full((3, 3), np.nan)},
        {"covariance": np.eye(2)},
        {"levels_by_power": "four"},
        {"impulse_density": 0.0},
        {"correlated_level": 1.0, "level": 0.5},
    ):
        with pytest.raises(mss.InvalidParameter, match="noise.(" + "|".join(wrong) + ")"):
            mss.estimate_error(lambda x: x, V, F, noise=replace(noise, **wrong))

"""Settings are values: they check themselves, compare, print, are stored, and do what the keywords do."""

import inspect
import json
import pickle
from dataclasses import fields

import numpy as np
import pytest

import meshlab_specsmooth as mss
from meshlab_specsmooth.operators.barycenters import barycenters
from meshlab_specsmooth.smoothing.calls import get_documentation, get_parameters
from meshlab_specsmooth.spectral.response import RESPONSES, butterworth, from_gain, heat, ideal
from tests.meshes import rough, sheet, torus

CLOSED, OPEN = rough(torus(40, 30)), rough(sheet(40, 30))

SETTINGS = [
    mss.Smoothing(),
    mss.Smoothing(low_pass=mss.Ideal(modes=20), barycenter_weight=1),
    mss.Smoothing(low_pass=mss.Heat(wavelength=3.0), barycenter_weight=np.linspace(0.1, 1, 1200), iterations=2),
    mss.LowPass(low_pass=mss.Butterworth(modes=30), method="chebyshev"),
    mss.Enhancement(gain=3, response="gaussian"),
    mss.EdgeAware(strength=0.5, range_sigma=0.3, iterations=2, start="given"),
    mss.Denoising(spacing=(1, 1, 3)),
    mss.Region(boundary="fixed", mask=np.arange(1200) < 600),
    mss.EdgeAwareRegion(creases=60.0),
]
EVERY_SETTING = pytest.mark.parametrize("setting", SETTINGS, ids=lambda s: type(s).__name__)


@EVERY_SETTING
def test_a_setting_is_stored_and_given_back(setting):
    stored = json.loads(json.dumps(setting.to_dict()))
    again = type(setting).from_dict(stored)
    assert again == setting
    assert hash(again) == hash(setting)
    assert pickle.loads(pickle.dumps(setting)) == setting  # noqa: S301
    assert setting != "a setting"
    assert setting != mss.Smoothing(spacing=2, iterations=7)


@EVERY_SETTING
def test_a_setting_prints_what_it_was_made_from(setting):
    text = repr(setting)
    assert text.startswith(type(setting).__name__)
    if "array" not in text:
        names = {name: getattr(mss, name) for name in mss.__all__}
        assert eval(text, names) == setting  # noqa: S307


def test_every_public_setting_documents_and_checks_its_fields():
    for kind in (mss.Smoothing, mss.LowPass, mss.Enhancement, mss.EdgeAware, mss.Denoising, mss.Region):
        documented = get_documentation(kind)
        for each in fields(kind):
            assert each.name in documented
            if each.name not in ("mask", "features"):  # which are arrays of a mesh
                with pytest.raises(mss.InvalidParameter, match="response" if each.name == "response" else each.name):
                    kind(**{each.name: object()})


def test_a_signature_is_that_of_its_setting():
    for function, kind in ((mss.smooth, mss.Smoothing), (mss.enhance, mss.Enhancement), (mss.denoise, mss.Denoising)):
        signature = inspect.signature(function).parameters
        for name, parameter in get_parameters(kind).items():
            assert signature[name].default == parameter.default
            assert f"\n    {name}" in function.__doc__ or f", {name} :" in function.__doc__


@pytest.mark.parametrize(
    ("function", "setting", "given"),
    [
        (
            mss.smooth,
            mss.Smoothing(low_pass=mss.Ideal(modes=40), barycenter_weight=1.0),
            {"modes": 40, "barycenter_weight": 1.0},
        ),
        (mss.smooth, mss.Smoothing(low_pass=mss.Heat(wavelength=2.0)), {"wavelength": 2.0, "response": "heat"}),
        (mss.low_pass, mss.LowPass(low_pass=mss.Gaussian(wavelength=2.0)), {"wavelength": 2.0, "response": "gaussian"}),
        (mss.enhance, mss.Enhancement(gain=3.0), {"gain": 3.0}),
        (
            mss.smooth_edge_aware,
            mss.EdgeAware(strength=1.0, range_sigma=0.3, iterations=2),
            {"strength": 1.0, "range_sigma": 0.3, "iterations": 2},
        ),
    ],
)
def test_a_setting_does_what_the_keywords_do(function, setting, given):
    V, F = CLOSED
    expected = function(V, F, **given).vertices
    ops = mss.assemble(V, F)
    for result in (function(V, F, setting), function((V, F), setting), function(ops, setting)):
        assert np.array_equal(result.vertices, expected)
    again = type(setting).from_dict(setting.to_dict())
    assert np.array_equal(function(ops, setting=again).vertices, expected)


def test_a_region_does_what_the_keywords_do():
    mask = np.arange(1200) < 600
    result = mss.smooth(*OPEN, barycenter_weight=0.4, boundary="curve", mask=mask)
    region = mss.Region(boundary="curve", mask=mask)
    assert np.array_equal(mss.smooth(*OPEN, barycenter_weight=0.4, region=region).vertices, result.vertices)
    edges = mss.EdgeAwareRegion(mask=mask)
    given = {"strength": 1.0, "range_sigma": 0.3, "iterations": 1}
    by_value, by_keyword = (
        mss.smooth_edge_aware(*OPEN, **given, **where) for where in ({"region": edges}, {"mask": mask})
    )
    assert np.array_equal(by_value.vertices, by_keyword.vertices)


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: mss.smooth(*CLOSED, mss.LowPass()), "setting is of type LowPass; it must be Smoothing"),
        (
            lambda: mss.smooth(*CLOSED, mss.Smoothing(), iterations=2),
            "iterations is given beside a setting",
        ),
        (lambda: mss.smooth(*CLOSED, region=mss.Region(), boundary="free"), "boundary is given beside a region"),
        (lambda: mss.smooth(mss.assemble(*CLOSED), laplacian="uniform"), "laplacian is given beside operators"),
        (lambda: mss.smooth(mss.assemble(*CLOSED), CLOSED[1]), "faces are given beside operators"),
        (lambda: mss.Smoothing.from_dict({"setting": "LowPass"}), "setting is 'LowPass'; it must be 'Smoothing'"),
        (lambda: mss.Smoothing.from_dict({"strength": 1.0}), "Smoothing has no strength"),
        (lambda: mss.Smoothing(low_pass=ideal(0.1)).to_dict(), "low_pass is a function of your own"),
        (lambda: mss.Ideal(modes=3, wavelength=1.0), "modes and wavelength both set the cut-off"),
        (lambda: mss.smooth(*CLOSED, response=heat(0.1), modes=3), "response has a cut-off of its own"),
        (lambda: mss.smooth(*CLOSED, response=lambda cutoff: cutoff), "response is"),
        (lambda: mss.choose(*CLOSED, barycenter_weight=1.0), "barycenter_weight is given; there is nothing to choose"),
    ],
)
def test_what_does_not_fit_is_refused_by_name(call, words):
    with pytest.raises(mss.InvalidParameter, match=words):
        call()


@pytest.mark.parametrize("name", RESPONSES)
@pytest.mark.parametrize("method", ["exact", "chebyshev"])
def test_a_family_or_a_response_of_ones_own_goes_in_as_it_is(name, method):
    given = {"barycenter_weight": 0.5, "method": method}
    named = mss.smooth(*CLOSED, response=name, wavelength=2.0, **given)
    by_family = mss.smooth(*CLOSED, response=RESPONSES[name], wavelength=2.0, **given)
    assert np.array_equal(by_family.vertices, named.vertices)
    response = RESPONSES[name](named.cutoff)
    own = mss.smooth(*CLOSED, response=response, **given)
    assert own.vertices == pytest.approx(named.vertices, abs=1e-9)
    assert own.response == response.label
    assert own.cutoff == pytest.approx(named.cutoff, rel=1e-6)


def test_a_response_that_is_none_of_ours_acts_on_every_mode():
    """The result of a gain g is that of its parts: the filter is linear in the response."""
    halved = from_gain(lambda x: 0.5 * heat(0.2)(x), "half of heat")
    given = {"barycenter_weight": 0.5, "method": "exact"}
    none = from_gain(np.zeros_like, "none")
    whole, half, nothing = (mss.smooth(*CLOSED, response=h, **given).vertices for h in (heat(0.2), halved, none))
    assert half == pytest.approx((whole + nothing) / 2, abs=1e-4 * np.abs(whole).max())


def test_a_response_follows_the_boundary_curve():
    given = {"barycenter_weight": 0.5, "boundary": "curve"}
    named = mss.smooth(*OPEN, response="butterworth", wavelength=6.0, **given)
    own = mss.smooth(*OPEN, response=butterworth(named.cutoff), **given)
    assert own.vertices == pytest.approx(named.vertices, abs=1e-6)


def test_a_weight_may_be_a_field():
    V, F = CLOSED
    even = mss.smooth(V, F, barycenter_weight=np.full(len(V), 0.4), tolerance=1e-6)
    one = mss.smooth(V, F, barycenter_weight=0.4, tolerance=1e-6)
    assert even.vertices == pytest.approx(one.vertices, abs=1e-4 * one.displacement)
    # the least squares of eq. 5-6 with a weight of each face, by a direct solve
    field = np.where(V[:, 0] > 0, 0.1, 2.0)
    result = mss.smooth(V, F, barycenter_weight=field, response=from_gain(np.zeros_like, "none"), tolerance=1e-5)
    ops = mss.assemble(V, F)
    L = ops.L @ np.eye(len(V))
    C = np.diag(field[F].mean(axis=1)) @ barycenters(np.asarray(F, dtype=np.int32), len(V)).toarray()
    expected, *_ = np.linalg.lstsq(np.vstack([L, C]), np.vstack([np.zeros_like(V), C @ V]), rcond=None)
    assert result.vertices == pytest.approx(expected, abs=1e-3 * result.displacement)
    moved = np.linalg.norm(result.vertices - V, axis=1)
    assert np.median(moved[V[:, 0] > 0.5]) > 1.5 * np.median(moved[V[:, 0] < -0.5])
    assert "0.1 to 2" in result.summary


def test_the_choice_is_a_setting_with_the_table_of_what_was_considered():
    ops = mss.assemble(*CLOSED)
    choice = mss.choose(ops)
    errors = [each.error for each in choice.considered]
    assert len(errors) > 3
    assert errors == sorted(errors)
    assert choice.estimated_error <= 1.05 * errors[0]
    assert choice.setting.barycenter_weight == mss.smooth(ops).barycenter_weight
    assert choice.setting == mss.smooth(ops).setting
    assert {type(each.setting.low_pass) for each in choice.considered} == {mss.Heat, mss.Ideal}
    assert str(choice.setting) in str(choice)


def test_the_choice_for_a_mesh_without_noise_says_so():
    choice = mss.choose(*torus(40, 30))
    assert choice.considered == ()
    assert choice.summary.startswith("nothing to choose: no noise")

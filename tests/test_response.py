import hypothesis.strategies as st
import numpy as np
import pytest
from hypothesis import given

import meshlab_specsmooth as mss
from meshlab_specsmooth.spectral.response import RESPONSES, TRANSITION, TRANSITION_ERROR, band, heat, ideal, response

SPECTRUM = np.linspace(0, 2, 2001)
EVERY_RESPONSE = pytest.mark.parametrize("name", RESPONSES)


@EVERY_RESPONSE
@given(cutoff=st.floats(1e-3, 2))
def test_every_response_is_a_low_pass(name, cutoff):
    h = response(name, cutoff)
    gains = h(SPECTRUM)
    assert h([0.0]) == 1
    assert (np.diff(gains) <= 0).all()
    assert (gains >= 0).all()
    if name != "ideal":
        assert h([cutoff]) == pytest.approx(0.5)


def test_the_ideal_response_is_the_paper_s_step():
    assert ideal(0.5)([0.0, 0.5, np.nextafter(0.5, 1), 2.0]).tolist() == [1, 1, 0, 0]


@given(cutoff=st.floats(1e-3, 1.99))
def test_what_stands_for_the_step_differs_from_it_only_about_the_cutoff(cutoff):
    h = ideal(cutoff)
    outside = abs(SPECTRUM / cutoff - 1) > TRANSITION
    assert abs(h.smooth_gain(SPECTRUM) - h(SPECTRUM))[outside].max(initial=0) < 1.01 * TRANSITION_ERROR


def test_a_step_at_the_end_of_the_spectrum_keeps_everything():
    assert (ideal(2.0).smooth_gain(SPECTRUM) == 1).all()


@EVERY_RESPONSE
def test_responses_combine(name):
    a, b = response(name, 0.3), response("heat", 0.7)
    assert (a * b)(SPECTRUM) == pytest.approx(a(SPECTRUM) * b(SPECTRUM))
    assert (~a)(SPECTRUM) + a(SPECTRUM) == pytest.approx(1)
    assert (~~a)(SPECTRUM) == pytest.approx(a(SPECTRUM))
    assert band(a, b)(SPECTRUM) == pytest.approx(b(SPECTRUM) * (1 - a(SPECTRUM)))
    smooth = (~(a * b)).smooth_gain(SPECTRUM)
    assert smooth == pytest.approx(1 - a.smooth_gain(SPECTRUM) * b.smooth_gain(SPECTRUM))
    assert band(a, b).label == f"{b.label} x 1 - {a.label}"


def test_unknown_names_and_cutoffs_are_refused():
    with pytest.raises(mss.InvalidParameter, match="'box'; it must be one of 'ideal', 'butterworth'"):
        response("box", 0.1)
    for cutoff in (0.0, -1.0, 2.1, np.nan):
        with pytest.raises(mss.InvalidParameter, match="an eigenvalue, in"):
            response("ideal", cutoff)


@EVERY_RESPONSE
@pytest.mark.parametrize("cutoff", [1e-6, 0.01, 0.3, 1.7])
def test_the_cutoff_is_where_the_gain_falls_to_a_half(name, cutoff):
    assert response(name, cutoff).cutoff == pytest.approx(cutoff)
    assert band(heat(1e-9), response(name, cutoff)).cutoff == pytest.approx(cutoff)
    assert (~response(name, cutoff)).cutoff == 2


def test_nothing_is_kept_beyond_the_support():
    for h in (ideal(0.3), ideal(0.3) * heat(1.0), heat(1.0) * ideal(0.3), band(heat(0.1), ideal(0.3))):
        assert h.support == 0.3
        assert not h(SPECTRUM[SPECTRUM > h.support]).any()
    for h in (heat(0.3), ~ideal(0.3), ideal(2.0)):
        assert h.support == 2

"""Every constant of the package is accounted for in docs/constants.md, and what it says can be measured again."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

SCRIPTS = Path(__file__).resolve().parent.parent / "scripts"


@pytest.fixture
def calibrate(monkeypatch):
    monkeypatch.syspath_prepend(str(SCRIPTS))
    import calibrate

    yield calibrate
    for name in ("calibrate", "calibration_cases", "calibration_shapes", "bootstrap"):
        sys.modules.pop(name, None)


def test_every_constant_is_accounted_for_with_the_value_that_it_has(calibrate):
    wrong = calibrate.unaccounted()
    assert not wrong, (
        f"docs/constants.md lacks or misstates {', '.join(wrong[:9])}; give a new constant a row or a reason in "
        f"scripts/calibrate.py, then: python3 scripts/calibrate.py --only {wrong[0]}"
    )


def test_the_comment_at_a_measured_constant_names_its_row(calibrate):
    for module, path in calibrate.modules():
        text = path.read_text(encoding="utf-8")
        assert calibrate.row_comments(text, module) == text, "run: python3 scripts/calibrate.py --comments"


def test_a_constant_that_is_new_or_changed_or_gone_is_noticed(calibrate, tmp_path):
    page = tmp_path / "constants.md"
    lines = calibrate.PAGE.read_text(encoding="utf-8").splitlines(keepends=True)
    at = next(i for i, line in enumerate(lines) if line.startswith("| `spectral.chebyshev._BETWEEN_SAMPLES` | 1.01 |"))
    page.write_text("".join(lines[:at] + lines[at + 1 :]), encoding="utf-8")
    assert calibrate.unaccounted(page) == ["spectral.chebyshev._BETWEEN_SAMPLES"]
    page.write_text(
        "".join(lines).replace("_BETWEEN_SAMPLES` | 1.01 |", "_BETWEEN_SAMPLES` | 1.02 |"), encoding="utf-8"
    )
    assert calibrate.unaccounted(page) == ["spectral.chebyshev._BETWEEN_SAMPLES"]
    page.write_text("".join([*lines, "| `noise._FORGOTTEN` | 1 | mathematics |\n"]), encoding="utf-8")
    assert calibrate.unaccounted(page) == ["noise._FORGOTTEN"]


@pytest.mark.parametrize("place", ["spectral.chebyshev._BETWEEN_SAMPLES", "noise.thin_triangles._MAX_ASPECT"])
def test_a_row_that_is_measured_again_is_the_same(calibrate, place):
    row = next(row for row in calibrate.ROWS if row.place == place)
    cells = calibrate.read(calibrate.PAGE)[place]
    assert calibrate.line_of(row, row.measure(calibrate.Place(place))) == f"| {' | '.join(cells)} |"


def test_a_number_is_set_wherever_it_was_imported_and_set_back(calibrate):
    from meshlab_specsmooth.edge_aware import search
    from meshlab_specsmooth.noise import classify, estimate

    place = calibrate.Place("noise.estimate.WEIGHT_TIMES_LEVEL")
    with place.set_to(0.5):
        assert estimate.WEIGHT_TIMES_LEVEL == search.WEIGHT_TIMES_LEVEL == 0.5
    assert estimate.WEIGHT_TIMES_LEVEL == search.WEIGHT_TIMES_LEVEL == place.value() == 0.07
    falls = calibrate.Place("noise.classify._SHAPE_BAND_DECAY[1]")
    with falls.set_to(9.0):
        assert classify._SHAPE_BAND_DECAY == (6.0, 9.0)
    assert classify._SHAPE_BAND_DECAY == (6.0, 3.0)
    repeats = calibrate.Place("noise.classify._MAX_REPEATS[impulse]")
    with repeats.set_to(0.5):
        assert classify._MAX_REPEATS == {"impulse": 0.5, "quantized": 0.95}
    assert repeats.value() == 0.25


def test_a_margin_is_where_the_first_case_comes_out_wrong(calibrate):
    place = calibrate.Place("noise.model.NEGLIGIBLE")
    cases = [
        ("below", lambda: place.value() > 0.011),
        ("above", lambda: place.value() < 0.039),
        ("never", lambda: False),
    ]
    found = calibrate.separates(lambda: cases, "two cases")(place)
    assert found.margin == "1.5 / 1.5"
    assert found.measured == "at 0.01: below; at 0.04: above"
    assert found.on == "two cases (2 of 3 as they should be)"
    assert found.is_defended
    assert not calibrate.separates(lambda: cases[2:], "none")(place).is_defended
    tight = [("below", lambda: place.value() > 0.0195)]
    assert not calibrate.separates(lambda: tight, "one")(place).is_defended


def test_a_trade_says_what_another_value_would_gain(calibrate):
    place = calibrate.Place("noise.model.NEGLIGIBLE")

    def errors():
        return {"a": abs(place.value() - 0.02) + 1, "b": abs(place.value() - 0.02) + 1}

    found = calibrate.trades(errors, "two")(place)
    assert found.is_defended
    assert found.measured == "0.01: +1.0 %, 0.016: +0.4 %, 0.025: +0.5 %, 0.04: +2.0 %"
    assert not calibrate.trades(lambda: {"a": 1 / place.value()}, "one")(place).is_defended
    assert not calibrate.trades(lambda: {"a": 1.0}, "none")(place).is_defended


def test_shapes_of_calibration_are_none_of_the_benchmark_s(calibrate):
    import calibration_shapes
    import pairs

    own = [*calibration_shapes.SMOOTH, *calibration_shapes.SHARP, *calibration_shapes.OPEN, *calibration_shapes.EXACT]
    assert not {shape.__name__ for shape in own} & set(pairs.SHAPES)
    for shape in own:
        surface = shape()
        assert 1000 < len(surface.vertices) < 8000
        assert (surface.vertices == shape().vertices).all()

"""How results read, in a line, a block and a notebook; and one level of noise, whoever states it."""

import copy
import io
import json
import math
import pickle
import sys
import warnings
from types import SimpleNamespace

import numpy as np
import pytest

import meshlab_specsmooth as mss
from meshlab_specsmooth.batching.work import Outcome
from meshlab_specsmooth.cli import main
from meshlab_specsmooth.describe import Report, Sentence, describe_html, format_edges
from meshlab_specsmooth.meshlab import filters, mesh_files, meshset
from meshlab_specsmooth.reports import thumbnails
from meshlab_specsmooth.runtime import bars
from meshlab_specsmooth.runtime.progress import announce, monotone, subrange
from tests.meshes import box, noisy, together, torus

ROUGH = noisy(torus(20, 12), 0.2)
FLAT = np.zeros((4, 3)), [[0, 1, 2], [0, 2, 3]]


@pytest.fixture(scope="module")
def results():
    ms = meshset.new(*ROUGH)
    return {
        "smooth": mss.smooth(*ROUGH),
        "given": mss.smooth(*ROUGH, barycenter_weight=0.3),
        "low_pass": mss.low_pass(*ROUGH),
        "denoise": mss.denoise(*ROUGH),
        "edge_aware": mss.smooth_edge_aware(*ROUGH, strength=1.0, range_sigma=0.3, iterations=3),
        "noise": mss.estimate_noise(*ROUGH),
        "error": mss.estimate_error(lambda V: V, *ROUGH, probes=2),
        "spectrum": mss.spectrum(*ROUGH),
        "of a MeshSet": mss.apply_coord_spectral_denoising(meshset.new(*ROUGH)),
        "spectrum of a MeshSet": mss.get_spectrum(ms),
        "quality": mss.compute_scalar_by_spectral_displacement(ms),
        "batch": mss.BatchSummary(
            (*(Outcome("in.ply", f"{i}.ply", "done") for i in range(40)), Outcome("bad.ply", "", "failed", "no faces")),
            2.0,
        ),
        "untouched": mss.denoise(*torus(20, 12)),
        "degenerate": mss.smooth(*FLAT),
    }


NAMES = [
    "smooth",
    "given",
    "low_pass",
    "denoise",
    "edge_aware",
    "noise",
    "error",
    "spectrum",
    "untouched",
    "degenerate",
    "quality",
    "batch",
]
NAMES += ["of a MeshSet", "spectrum of a MeshSet"]
PICTURED = {"smooth", "given", "low_pass", "denoise", "edge_aware", "untouched", "degenerate", "of a MeshSet"}


@pytest.mark.parametrize("name", NAMES)
def test_a_result_is_a_line_a_short_block_and_a_table(results, name):
    result = results[name]
    line, block, page = repr(result), str(result), result._repr_html_()
    assert "\n" not in line
    assert result.summary in line
    assert len(line) < 300
    assert block.startswith(result.summary)
    assert len(block) < 2500
    assert len(block.splitlines()) <= 25
    assert "array(" not in line + block
    assert "Considered(" not in line + block
    assert page.startswith("<div>")
    assert "<table" in page
    assert ("<img " in page) == (name in PICTURED)
    assert len(page) < 80_000


def test_surfaces_print_short():
    assert repr(mss.Surface(*ROUGH)) == "<Surface: 240 vertices, 480 faces>"


def test_a_report_is_a_dict(results):
    report = results["of a MeshSet"]
    assert isinstance(report, dict)
    assert "vertices" not in report
    again = pickle.loads(pickle.dumps(report))  # noqa: S301
    assert again.summary == copy.copy(report).summary == report.summary
    assert dict(report) == report


def test_a_warning_that_comes_later_is_shown():
    report = Report({"warning": None}, Sentence("done"))
    report["warning"] = "82 of 100 faces are selected"
    assert str(report).splitlines()[-1] == "  warning  82 of 100 faces are selected"


def test_the_sentence_says_what_was_taken_and_why(results):
    noise = results["noise"]
    level = f"noise white {noise.level / noise.mean_edge:.3f} edges ({noise.level:.3g})"
    assert noise.summary == level
    smooth, denoise = results["smooth"], results["denoise"]
    error = noise.format_error(smooth.estimated_error)
    weight = smooth.barycenter_weight
    assert smooth.summary == f"isotropic, barycenter weight {weight:.3g} by estimated error {error} edges; {level}"
    taken = denoise.considered[0]
    others = [
        row.error for row in denoise.considered if (row.setting.iterations == 0) != (taken.setting.iterations == 0)
    ]
    assert denoise.summary.startswith("took ")
    assert f"estimated error {noise.format_error(taken.error)} edges" in denoise.summary
    other = noise.format_error(min(others))
    other = "as well" if other == noise.format_error(taken.error) else other
    assert f"; {'isotropic' if taken.setting.iterations else 'edge-aware'} {other}; " in denoise.summary
    assert denoise.summary.endswith(level)
    assert results["of a MeshSet"].summary == denoise.summary
    assert results["edge_aware"].summary.startswith("edge-aware smoothing, 3 iterations as given; moved by ")
    assert results["given"].summary.startswith("isotropic, barycenter weight 0.3 as given; moved by ")


def test_what_is_left_alone_reads_as_such(results):
    none = "left as it is: no noise (below 2 % of an edge)"
    assert results["untouched"].summary == none
    assert mss.smooth(*torus(20, 12)).summary == none
    for call in (mss.smooth, mss.denoise):
        assert call(*torus(8, 5)).summary == (
            "left as it is: noise cannot be separated from shape: there are fewer than 50 vertices"
        )


def test_an_estimate_is_never_zero():
    noise = mss.estimate_noise(*ROUGH)
    assert noise.format_error(0.0) == f"at most {noise.resolution / noise.mean_edge:.3f}"
    nothing = mss.smooth(*FLAT).noise
    assert nothing.format_error(0.0) == "at most 0.001"
    assert format_edges(1e-9, 1.0) == "less than 0.001"


REGIONS = {"mask": np.zeros(240), "features": np.ones(240)}


@pytest.mark.parametrize(
    ("name", "words"), [("mask", "nothing is selected"), ("features", "all vertices are features")]
)
def test_a_region_that_lets_nothing_move_is_said_once(name, words):
    given = {name: REGIONS[name]}
    calls = [mss.smooth(*ROUGH, **given), mss.smooth(*ROUGH, barycenter_weight=0.3, **given)]
    if name == "mask":
        calls += [mss.low_pass(*ROUGH, **given), mss.enhance(*ROUGH, **given)]
    for result in calls:
        assert np.array_equal(result.vertices, ROUGH[0])
        assert result.warning.count(words) == 1
        assert result.summary.startswith(f"left as it is: {words}")
    assert "no vertex is a feature" in mss.enhance(*ROUGH, features=np.zeros(240)).warning


# one level


def strayed():
    V, F = noisy(torus(40, 24), 0.1)
    V[[50, 7]] += [[2.0, 0.0, 0.0], [0.0, -2.0, 0.0]]
    return V, F


def unlike():
    (V, F), (W, G) = noisy(torus(20, 12), 0.2), noisy(torus(30, 12), 0.05)
    return together((V, F), (3 * W + 100, G))


@pytest.mark.parametrize(
    "mesh", [ROUGH, strayed(), unlike(), noisy(torus(120, 72), 0.2)], ids=["plain", "strays", "two", "large"]
)
def test_one_level_on_arrays(mesh):
    expected = mss.estimate_noise(*mesh)
    stated = [
        mss.smooth(*mesh).noise,
        mss.spectrum(*mesh, bands=8).noise,
        mss.spectrum(*mesh, bands=8, laplacian="cotangent").noise,
        mss.estimate_error(lambda V: V, *mesh, probes=1).noise,  # and so of compare
    ]
    for noise in stated:
        assert noise.level == pytest.approx(expected.level, rel=1e-6)
        assert noise.mean_edge == pytest.approx(expected.mean_edge, rel=1e-6)
        assert noise.summary == expected.summary


def test_one_level_by_every_road(tmp_path, capsys):
    path = tmp_path / "scan.ply"
    mesh_files.write(meshset.new(*ROUGH), path)
    mesh = meshset.get_arrays(mesh_files.read(path))
    expected = mss.estimate_noise(*mesh)
    stated = [
        mss.denoise(*mesh).noise,
        mss.smooth_edge_aware(*mesh, strength=1.0, range_sigma=0.3, iterations=1).noise,
        mss.apply_coord_spectral_smoothing(meshset.new(*mesh))["noise"],
        mss.apply_coord_spectral_denoising(meshset.new(*mesh))["noise"],
        mss.get_spectrum(meshset.new(*mesh))["noise"],
        mss.compare(mesh, filters=["taubin"]).noise,
    ]
    for noise in stated:
        assert noise.level == pytest.approx(expected.level, rel=1e-6)
        assert noise.level_in_edges == pytest.approx(expected.level_in_edges, rel=1e-6)
    for command in (
        ["smooth", path, tmp_path / "a.ply"],
        ["denoise", path, tmp_path / "b.ply"],
        ["spectrum", path, "--out", tmp_path],
    ):
        assert main([str(word) for word in command]) == 0
        assert expected.summary in capsys.readouterr().out
    written = json.loads((tmp_path / "spectrum.json").read_text(encoding="utf-8"))
    assert written["noise"]["level"] == pytest.approx(expected.level, rel=1e-6)


# pictures


def test_without_matplotlib_there_is_a_table_alone(monkeypatch, results):
    monkeypatch.setitem(sys.modules, "matplotlib.figure", None)
    page = results["smooth"]._repr_html_()
    assert "<table" in page
    assert "<img" not in page


@pytest.mark.parametrize(
    "V",
    [
        np.zeros((4, 3)),
        np.eye(4)[:, :3] * 1e300,
        np.eye(4)[:, :3] * 1e-300,
        np.full((4, 3), 1e300),
        np.eye(4)[:, [0, 0, 0]],
    ],
)
def test_any_extent_can_be_drawn(V):
    F = np.array([[0, 1, 2], [0, 2, 3]], dtype=np.int32)
    unused = np.vstack([V, np.full((1, 3), np.nan)])
    assert thumbnails.draw((unused, unused, F)).startswith("<img ")
    assert thumbnails.draw((V, V, F[:0])) == ""


def test_large_meshes_are_thinned():
    V, F = torus(140, 100)
    before, after, faces = thumbnails.normalize(V, V, F.astype(np.int32))
    assert len(faces) < len(F)
    assert faces.max() < len(before) == len(after)
    assert np.abs(before).max() <= 0.5 + 1e-9


def test_words_are_escaped():
    assert "<script>" not in describe_html("<script>", [("<script>", "<script>")])


# bars


def in_notebook(monkeypatch, stream):
    shell = SimpleNamespace(config={"IPKernelApp": {}})
    monkeypatch.setitem(sys.modules, "IPython", SimpleNamespace(get_ipython=lambda: shell))
    monkeypatch.setattr(sys, "stderr", stream)
    import tqdm

    monkeypatch.setitem(sys.modules, "tqdm.auto", SimpleNamespace(tqdm=tqdm.tqdm))


def test_a_notebook_has_bars_without_a_callback_and_scripts_have_none(monkeypatch):
    shown, calls = io.StringIO(), [mss.smooth, mss.low_pass, mss.enhance, mss.denoise]
    monkeypatch.setattr(sys, "stderr", shown)
    mss.smooth(*ROUGH)
    assert shown.getvalue() == ""
    for call in calls:
        shown = io.StringIO()
        in_notebook(monkeypatch, shown)
        call(*ROUGH)
        assert "assembling |" in shown.getvalue()
        assert "smoothing |" in shown.getvalue()
    shown = io.StringIO()
    monkeypatch.setattr(sys, "stderr", shown)
    mss.apply_coord_spectral_smoothing(meshset.new(*ROUGH))
    assert all(f"{stage} |" in shown.getvalue() for stage in ("measuring noise", "choosing", "smoothing", "writing"))
    shown = io.StringIO()
    monkeypatch.setattr(sys, "stderr", shown)
    mss.smooth(*ROUGH, progress=lambda fraction: None)
    mss.show_progress(False)
    try:
        mss.smooth(*ROUGH)
    finally:
        mss.show_progress(None)
    monkeypatch.setitem(sys.modules, "tqdm.auto", None)
    mss.smooth(*ROUGH)
    assert shown.getvalue() == ""
    with pytest.raises(mss.InvalidParameter, match="shown is 2"):
        mss.show_progress(2)


@pytest.mark.parametrize("call", [mss.smooth, mss.denoise, mss.smooth_edge_aware])
@pytest.mark.parametrize("mesh", [torus(20, 12), torus(8, 5), FLAT], ids=["clean", "few", "flat"])
def test_the_fraction_rises_to_one_where_nothing_is_done(call, mesh):
    fractions = []
    call(*mesh, progress=fractions.append)
    assert fractions == sorted(fractions)
    assert fractions[-1] == 1.0


def test_a_bar_goes_when_a_call_fails(monkeypatch):
    shown = io.StringIO()
    in_notebook(monkeypatch, shown)
    with pytest.raises(mss.InvalidParameter):
        mss.smooth(*ROUGH, modes=3, wavelength=1.0)
    from tqdm import tqdm

    assert not list(tqdm._instances)


@pytest.mark.parametrize("command", ["smooth", "denoise"])
def test_a_terminal_is_told_what_is_done_and_how_long_it_takes(tmp_path, monkeypatch, command):
    class Terminal(io.StringIO):
        def isatty(self):
            return True

    path = tmp_path / "scan.ply"
    mesh_files.write(meshset.new(*ROUGH), path)
    shown = Terminal()
    monkeypatch.setattr(sys, "stderr", shown)
    assert main([command, str(path), str(tmp_path / "out.ply")]) == 0
    stages = ["reading", "assembling", "measuring noise", "choosing", "smoothing", "writing"]
    at = [shown.getvalue().find(f"{stage} |") for stage in stages]
    assert at == sorted(at)
    assert at[0] >= 0
    assert "<00:0" in shown.getvalue()  # what remains


def test_callbacks_get_fractions_and_may_ask_for_stages():
    class Listener:
        def __init__(self):
            self.fractions, self.stages = [], []

        def __call__(self, fraction):
            self.fractions.append(fraction)

        def stage(self, name):
            self.stages.append(name)

    listener = Listener()
    mss.denoise(*ROUGH, progress=listener)
    assert list(dict.fromkeys(listener.stages)) == ["assembling", "measuring noise", "choosing", "smoothing"]
    assert listener.fractions == sorted(listener.fractions)
    assert listener.fractions[-1] == 1.0
    announce(monotone(subrange(listener, 0.0, 0.5)), "within")
    assert listener.stages[-1] == "within"
    announce(None, "nobody")
    announce(listener.fractions.append, "a function")
    assert bars.begin(None, "in a script") is None


def test_an_estimate_that_is_not_a_number_is_not_shown(results):
    assert math.isnan(results["edge_aware"].error)
    assert "estimated error" not in str(results["edge_aware"])


def test_a_box_is_taken_by_its_edges():
    assert mss.denoise(*noisy(box(8), 0.2)).summary.startswith("took ")


def test_a_report_of_a_large_mesh_keeps_no_surfaces():
    report = filters.make_report(mss.smooth(*ROUGH), max_pictured=100)
    assert "<img" not in report._repr_html_()
    assert report.summary.startswith("isotropic, barycenter weight")


def test_a_warning_is_issued_once_a_call_where_the_call_stands():
    unused = np.vstack([ROUGH[0], [[np.nan] * 3]]), ROUGH[1]
    for function in (mss.smooth, mss.denoise, mss.smooth_edge_aware):
        with pytest.warns(mss.SmoothingWarning) as caught:
            result = function(*unused)
        assert [(str(each.message), each.filename) for each in caught] == [(result.warning, __file__)]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warnings.simplefilter("ignore", mss.SmoothingWarning)
        mss.denoise(*unused)
        warnings.simplefilter("error", mss.SmoothingWarning)
        assert mss.denoise(*ROUGH).warning is None
        with pytest.raises(mss.SmoothingWarning):
            mss.denoise(*unused)

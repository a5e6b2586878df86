"""``specsmooth tune``: the window is drawn without a display, and its buttons do what they say."""

import sys
from types import SimpleNamespace

import numpy as np
import pytest

import meshlab_specsmooth as mss
from meshlab_specsmooth.cli import main
from meshlab_specsmooth.cli import tune as command
from meshlab_specsmooth.meshlab import mesh_files, meshset, scripts
from meshlab_specsmooth.reports import window
from meshlab_specsmooth.reports.window import Sliders
from tests.meshes import rough, torus


@pytest.fixture
def scan(tmp_path):
    path = tmp_path / "scan.ply"
    mesh_files.write(meshset.new(*rough(torus(30, 20))), path)
    return path


def hands(**moved):
    """What imgui would answer if some of the sliders were moved."""

    def slider(label, value, *_):
        return label in moved, moved.get(label, value)

    return SimpleNamespace(SliderFloat=slider, Combo=slider, ImGuiSliderFlags_Logarithmic=0)


def test_sliders_return_their_positions():
    setting = Sliders(20.0, 0.3, "heat", 1.0)
    assert window.draw_sliders(hands(), setting, with_gain=True) is setting
    moved = hands(**{"wavelengths kept (edges)": 1e9, "barycenter weight": 0.0, "response": 0, "feature gain": -1.0})
    # numbers that are typed in may be out of range
    assert window.draw_sliders(moved, setting, with_gain=True) == Sliders(200.0, 0.02, "ideal", 0.0)
    assert window.draw_sliders(moved, setting, with_gain=False).gain == 1.0


def test_a_further_setting_starts_from_the_last():
    prepared = mss.assemble(*rough(torus(60, 40)))
    first = window.smooth_at(prepared, Sliders(20.0, 0.3, "heat"))
    near = Sliders(20.0, 0.31, "heat")
    again, anew = window.smooth_at(prepared, near, start=first), window.smooth_at(prepared, near)
    assert sum(again.cg_iterations) < sum(anew.cg_iterations)
    assert again.vertices == pytest.approx(anew.vertices, abs=0.02 * anew.displacement)
    assert f"{again.modes:.0f} modes kept" in window.describe_result(again)


def test_the_window_is_drawn_without_a_display(scan, tmp_path, capsys):
    picture = tmp_path / "window.png"
    assert main(["tune", str(scan), "--screenshot", str(picture)]) == 0
    assert picture.read_bytes().startswith(b"\x89PNG")
    assert str(picture) in capsys.readouterr().out


def test_without_a_display_or_the_extra_it_says_so(scan, monkeypatch, capsys):
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    if sys.platform == "linux":
        assert main(["tune", str(scan)]) == 1
        assert "--screenshot" in capsys.readouterr().err
    monkeypatch.setitem(sys.modules, "polyscope", None)
    assert main(["tune", str(scan)]) == 1
    assert "view" in capsys.readouterr().err


@pytest.mark.parametrize("features", ["none", "vertex_quality"])
def test_buttons_save_the_mesh_and_the_script_and_print_the_call(scan, tmp_path, monkeypatch, capsys, features):
    V, F = meshset.get_arrays(mesh_files.read(scan))
    weights = (V[:, 2] > 0).astype(float)
    ms = meshset.new(V, F)
    ms.compute_scalar_by_function_per_vertex(q="z > 0 ? 1 : 0", normalize=False)
    mesh_files.write(ms, scan)
    setting = Sliders(8.0, 0.4, "butterworth", 0.5)
    said = []

    def press_all(ops, first, actions, *, features, screenshot):
        assert screenshot is None
        assert (features is None) == (first.gain == 0)
        result = window.smooth_at(ops, setting, features)
        said.extend(action(setting, result) for action in actions.values())

    monkeypatch.setattr(command, "tune", press_all)
    out, script = tmp_path / "out.ply", tmp_path / "out.mlx"
    command_line = ["tune", str(scan), "--out", str(out), "--script", str(script), "--features", features]
    assert main(command_line) == 0
    marked = {} if features == "none" else {"features": weights, "feature_gain": 0.5}
    edge = mss.smooth(V, F, barycenter_weight=1.0).mean_edge
    given = {"wavelength": 8.0 * edge, "barycenter_weight": 0.4, "response": "butterworth"}
    expected = mss.smooth(V, F, **given, **marked).vertices
    written, _ = meshset.get_arrays(mesh_files.read(out))
    assert written == pytest.approx(expected, abs=1e-5)
    ms = mesh_files.read(scan)
    from meshlab_specsmooth.meshlab.filters import FILTERS

    scripts.run(ms, scripts.read(script), FILTERS)
    assert ms.current_mesh().vertex_matrix() == pytest.approx(expected, abs=1e-5)
    assert said[:2] == [f"saved {out}", f"saved {script}"]
    assert said[2] in capsys.readouterr().out
    assert "barycenter_weight=0.4" in said[2]
    assert ("vertex_quality" in said[2]) == (features != "none")
    assert np.isfinite(written).all()

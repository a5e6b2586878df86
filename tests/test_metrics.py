import numpy as np
import pytest

import meshlab_specsmooth as mss
from meshlab_specsmooth.bridge import meshset
from meshlab_specsmooth.compare import side_by_side
from meshlab_specsmooth.compare.metrics import add_noise, normal_error, vertex_error, volume_change
from meshlab_specsmooth.compare.side_by_side import Competitor
from tests.meshes import rough, sheet, torus

CLEAN = mss.Surface(*torus())
FLAT = mss.Surface([[0, 0, 0], [2, 0, 0], [2, 2, 0], [0, 2, 0]], [[0, 1, 2], [0, 2, 3]])


def changed(surface, vertices):
    return mss.Surface(vertices, surface.faces)


def test_a_surface_has_no_error_against_itself():
    assert normal_error(CLEAN, CLEAN) == vertex_error(CLEAN, CLEAN) == volume_change(CLEAN, CLEAN) == 0


@pytest.mark.parametrize("degrees", [1e-5, 10.0, 90.0, 180.0])
def test_the_normal_error_of_a_turned_plane_is_the_angle(degrees):
    t = np.radians(degrees)
    turn = np.array([[1, 0, 0], [0, np.cos(t), np.sin(t)], [0, -np.sin(t), np.cos(t)]])
    assert normal_error(changed(FLAT, FLAT.vertices @ turn), FLAT) == pytest.approx(degrees, rel=1e-6)


def test_degenerate_faces_count_as_the_literature_has_it():
    collapsed = FLAT.vertices.copy()
    collapsed[3] = collapsed[0]  # the second face is gone: 90 degrees, the first is right: 0
    assert normal_error(changed(FLAT, collapsed), FLAT) == 45
    assert normal_error(FLAT, changed(FLAT, collapsed)) == 0  # degenerate in the truth: left out


def test_the_vertex_error_is_in_edges_and_counts_drift():
    moved = CLEAN.vertices + [0.0, 0.3, 0.4]
    edge = np.linalg.norm(CLEAN.vertices[CLEAN.faces] - CLEAN.vertices[CLEAN.faces[:, [1, 2, 0]]], axis=2).mean()
    assert vertex_error(changed(CLEAN, moved), CLEAN) == pytest.approx(0.5 / edge)


def test_the_volume_change_is_that_of_meshlab_s_measure():
    grown = changed(CLEAN, CLEAN.vertices * 1.1)
    assert volume_change(grown, CLEAN) == pytest.approx(33.1)
    inside_out = mss.Surface(CLEAN.vertices, CLEAN.faces[:, ::-1])
    assert volume_change(mss.Surface(grown.vertices, inside_out.faces), inside_out) == pytest.approx(-33.1)
    volumes = [meshset.new(s.vertices, s.faces).get_geometric_measures()["mesh_volume"] for s in (CLEAN, grown)]
    assert 100 * (volumes[1] / volumes[0] - 1) == pytest.approx(volume_change(grown, CLEAN), rel=1e-5)


def test_noise_has_its_level_and_its_seed():
    noisy = changed(CLEAN, add_noise(CLEAN, 0.3, seed=4))
    assert vertex_error(noisy, CLEAN) == pytest.approx(0.3 * np.sqrt(3), rel=0.05)
    assert np.array_equal(add_noise(CLEAN, 0.3, seed=4), noisy.vertices)
    assert not np.array_equal(add_noise(CLEAN, 0.3, seed=5), noisy.vertices)


def test_side_by_side_runs_ours_and_meshlab_s_on_the_same_input():
    V, _ = rough(torus())
    competitors = [
        Competitor("Taubin", "apply_coord_taubin_smoothing", {"stepsmoothnum": 2}),
        Competitor("ours", "apply_coord_spectral_smoothing", {"barycenter_weight": 0.3}),
    ]
    rows = list(side_by_side.side_by_side(CLEAN, V, competitors))
    ms = meshset.new(V, CLEAN.faces)
    ms.apply_coord_taubin_smoothing(stepsmoothnum=2)
    assert np.array_equal(rows[0].surface.vertices, ms.current_mesh().vertex_matrix())
    ours = mss.smooth(V, CLEAN.faces, barycenter_weight=0.3).vertices
    assert np.array_equal(rows[1].surface.vertices, ours)
    assert rows[1].call == "apply_coord_spectral_smoothing(barycenter_weight=0.3)"
    for row in rows:
        assert row.normal_error == normal_error(row.surface, CLEAN)
        assert row.vertex_error == vertex_error(row.surface, CLEAN)
        assert row.seconds > 0
    lines = side_by_side.table(rows).splitlines()
    assert len(lines) == 4
    assert lines[3].startswith("ours ")
    assert f"{rows[1].normal_error:.2f}" in lines[3]


def test_on_a_sheet_the_metrics_need_no_closedness():
    clean = mss.Surface(*sheet())
    noisy = changed(clean, rough(sheet())[0])
    assert normal_error(noisy, clean) > 5
    assert vertex_error(noisy, clean) > 0.1

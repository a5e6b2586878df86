"""Deviation of one surface from another: signed distances, tolerance, report, command and exit codes."""

import json

import hypothesis.strategies as st
import numpy as np
import pymeshlab
import pytest
from hypothesis import given

import meshlab_specsmooth as mss
from meshlab_specsmooth.cli import main
from meshlab_specsmooth.cli.deviation import EXCEEDED
from meshlab_specsmooth.comparison.signed_distances import signed_distances
from meshlab_specsmooth.geometry.surface import vertex_normals
from tests.meshes import box, noisy, sheet, torus


def test_offset_along_normals_is_the_distance_with_its_sign():
    V, F = torus()
    n = vertex_normals(mss.Surface(V, F))
    for offset in (0.01, -0.02):
        found = mss.deviation((V, F), V + offset * n, tolerance=0.015)
        np.testing.assert_allclose(found.distances, offset, rtol=1e-12)
        assert found.is_within == (offset < 0.015 and offset > -0.015)
        assert found.share_within == float(found.is_within)
        assert found.largest_displacement == pytest.approx(abs(offset))


def test_displacement_within_the_surface_is_no_deviation():
    V, F = sheet()
    V[:, 2] = 0
    found = mss.deviation((V, F), V + [0.1, 0.2, 0.0])
    assert found.largest == 0.0
    assert found.largest_displacement == pytest.approx(np.hypot(0.1, 0.2))


@given(st.integers(0, 2**32 - 1))
def test_signed_distance_to_a_box_is_that_of_the_formula(seed):
    """Nearest points inside faces, on edges and on corners; the sign is that of the pseudonormal there."""
    V, F = box(2)
    low, high = V.min(axis=0), V.max(axis=0)
    points = np.random.default_rng(seed).uniform(low - 1, high + 1, (50, 3))
    q = np.abs(points - (low + high) / 2) - (high - low) / 2
    exact = np.linalg.norm(np.maximum(q, 0), axis=1) + np.minimum(q.max(axis=1), 0)
    np.testing.assert_allclose(signed_distances(points, mss.Surface(V, F)), exact, atol=1e-12)


def test_other_triangulations_of_the_same_surface_do_not_deviate_and_a_missing_part_is_reported():
    V, F = box(4)
    finer, faces = box(8)
    scaled = finer * np.ptp(V, axis=0) / np.ptp(finer, axis=0)
    scaled += V.min(axis=0) - scaled.min(axis=0)
    found = mss.deviation((V, F), (scaled, faces), tolerance="0.1%")
    assert not found.corresponds
    assert found.largest < 1e-12
    assert found.largest_uncovered < 1e-12
    part = faces[(scaled[faces].mean(axis=1)[:, 0] < scaled[:, 0].mean())]
    cut = mss.deviation((V, F), (scaled, part), tolerance="0.1%")
    assert cut.is_within
    assert cut.largest_uncovered == pytest.approx(2 * np.sqrt(2))  # of the middle of the missing side
    assert cut.count < len(scaled)  # vertices without a face are not measured


def test_the_worst_places_are_apart_and_in_order():
    V, F = torus()
    moved = V.copy()
    moved[[3, 4, 500]] += np.array([[0.3], [0.29], [0.2]]) * vertex_normals(mss.Surface(V, F))[[3, 4, 500]]
    found = mss.deviation((V, F), moved, tolerance=1e-6)
    places = found.worst()
    assert [p.vertex for p in places] == [3, 500]
    assert places[0].position == tuple(moved[3])
    assert found.outside == 3
    assert sum(found.histogram()[0]) == len(V)
    assert json.loads(json.dumps(found.to_dict(), allow_nan=False))["outside"] == 3


def test_a_result_and_its_limit():
    V, F = noisy(torus(), 0.3)
    result = mss.smooth(V, F, max_displacement=0.02)
    found = mss.deviation((V, F), result, tolerance=0.02)
    assert found.is_within
    assert found.largest_displacement == pytest.approx(0.02)
    free = mss.deviation((V, F), mss.smooth(V, F), tolerance=0.02)
    assert not free.is_within
    assert "<table" in free._repr_html_()
    assert "beyond the tolerance of 0.02" in str(free)


def test_seams_do_not_break_the_normals():
    """Along a seam the vertices are double, and each copy has faces on one side only."""
    V, F = box(4)
    soup, faces = V[F].reshape(-1, 3), np.arange(3 * len(F)).reshape(-1, 3)
    whole = mss.deviation((V, F), V * 1.1)
    split = mss.deviation((soup, faces), soup * 1.1)
    np.testing.assert_allclose(split.distances, whole.distances[F].ravel(), rtol=1e-9)


@pytest.mark.parametrize("tolerance", [0, -1.0, "5", "-1%", np.nan, True])
def test_a_tolerance_is_a_length_or_a_percentage(tolerance):
    with pytest.raises(mss.InvalidParameter, match="tolerance is"):
        mss.deviation(*[torus()] * 2, tolerance=tolerance)


def test_the_command_writes_colors_picture_and_numbers_and_its_exit_code_stops_a_pipeline(tmp_path, capsys):
    V, F = torus()
    moved = V.copy()
    moved[7] += [0, 0, 0.2]
    for name, vertices in (("before", V), ("after", moved)):
        ms = pymeshlab.MeshSet()
        ms.add_mesh(pymeshlab.Mesh(vertices, F))
        ms.save_current_mesh(str(tmp_path / f"{name}.ply"))
    files = [str(tmp_path / "before.ply"), str(tmp_path / "after.ply")]
    written = {name: str(tmp_path / name) for name in ("colored.ply", "report.png", "report.json")}
    options = ["--out", written["colored.ply"], "--picture", written["report.png"], "--json", written["report.json"]]
    assert main(["deviation", *files, "--tolerance", "0.05", *options]) == EXCEEDED
    assert "1 of 960 vertices beyond the tolerance of 0.05" in capsys.readouterr().out
    assert json.loads((tmp_path / "report.json").read_text())["worst"][0]["vertex"] == 7
    assert (tmp_path / "report.png").read_bytes()[:4] == b"\x89PNG"
    ms = pymeshlab.MeshSet()
    ms.load_new_mesh(written["colored.ply"])
    colors = np.round(255 * ms.current_mesh().vertex_color_matrix()[:, :3])
    assert colors[7].tolist() in ([255, 149, 0], [0, 165, 165])
    assert (np.delete(colors, 7, axis=0) == 255).all()
    assert abs(ms.current_mesh().vertex_scalar_array()[7]) > 0.05
    assert main(["deviation", *files, "--tolerance", "50%"]) == 0
    assert main(["deviation", *files]) == 0
    assert main(["deviation", files[0], str(tmp_path / "none.ply")]) == 1

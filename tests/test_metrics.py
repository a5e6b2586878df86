import numpy as np
import pymeshlab
import pytest

import meshlab_specsmooth as mss
from meshlab_specsmooth.comparison import noise, side_by_side, tables
from meshlab_specsmooth.comparison.distances import distances
from meshlab_specsmooth.comparison.filter_specs import FilterSpec
from meshlab_specsmooth.comparison.metrics import (
    flipped,
    measure_errors,
    normal_error,
    surface_error,
    vertex_error,
    volume_change,
)
from meshlab_specsmooth.geometry.surface import edges, mean_edge_length, vertex_normals
from meshlab_specsmooth.meshlab import meshset
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
    noisy = changed(CLEAN, noise.gaussian(CLEAN, 0.3, seed=4))
    assert vertex_error(noisy, CLEAN) == pytest.approx(0.3 * np.sqrt(3), rel=0.05)
    assert np.array_equal(noise.gaussian(CLEAN, 0.3, seed=4), noisy.vertices)
    assert not np.array_equal(noise.gaussian(CLEAN, 0.3, seed=5), noisy.vertices)


def test_filters_of_both_sides_run_on_the_same_input():
    V, _ = rough(torus())
    specs = [
        FilterSpec("Taubin", "apply_coord_taubin_smoothing", {"stepsmoothnum": 2}),
        FilterSpec("ours", "apply_coord_spectral_smoothing", {"barycenter_weight": 0.3}),
    ]
    rows = list(side_by_side.run_side_by_side(CLEAN, V, specs))
    assert [row.name for row in rows] == ["as given", "Taubin", "ours"]
    assert np.array_equal(rows[0].surface.vertices, V)
    ms = meshset.new(V, CLEAN.faces)
    ms.apply_coord_taubin_smoothing(stepsmoothnum=2)
    assert np.array_equal(rows[1].surface.vertices, ms.current_mesh().vertex_matrix())
    ours = mss.smooth(V, CLEAN.faces, barycenter_weight=0.3).vertices
    assert np.array_equal(rows[2].surface.vertices, ours)
    assert rows[2].call == "ms.apply_coord_spectral_smoothing(barycenter_weight=0.3)"
    for row in rows:
        assert list(row.values) == [column.key for column in side_by_side.COLUMNS]
        assert row.values["normal_error"] == normal_error(row.surface, CLEAN)
        assert row.values["vertex_error"] == vertex_error(row.surface, CLEAN)
        assert row.values["volume"] == volume_change(row.surface, CLEAN)
        assert (row.values["seconds"] > 0) == (row.spec is not None)
    lines = tables.format_rows(rows, side_by_side.COLUMNS).splitlines()
    assert len(lines) == 5
    assert lines[4].startswith("ours ")
    assert f"{rows[2].values['normal_error']:.2f}" in lines[4]


def test_on_a_sheet_the_metrics_need_no_closedness():
    clean = mss.Surface(*sheet())
    noisy = changed(clean, rough(sheet())[0])
    errors = measure_errors(noisy, clean)
    assert errors["normal_error"] > 5
    assert errors["vertex_error"] > 0.1
    assert "volume" not in errors


def nearest_by_brute_force(points, surface):
    """All triangles for each point, each sampled by a solver of its own: least squares over the triangle's simplex."""
    best = np.full(len(points), np.inf)
    for corners in surface.vertices[surface.faces]:
        origin, sides = corners[0], (corners[1:] - corners[0]).T
        share = np.linalg.lstsq(sides, (points - origin).T, rcond=None)[0].T
        inside = (share >= 0).all(axis=1) & (share.sum(axis=1) <= 1) & (np.linalg.matrix_rank(sides) == 2)
        flat = np.linalg.norm(points - origin - share @ sides.T, axis=1)
        best = np.where(inside, np.minimum(best, flat), best)
        for a, b in zip(corners, np.roll(corners, 1, axis=0), strict=True):
            length = max((b - a) @ (b - a), np.finfo(float).tiny)
            t = np.clip((points - a) @ (b - a) / length, 0, 1)
            best = np.minimum(best, np.linalg.norm(points - a - t[:, None] * (b - a), axis=1))
    return best


@pytest.mark.no_cover
@pytest.mark.parametrize("scale", [1e-6, 1, 1e6])
@pytest.mark.parametrize("name", ["closed", "open", "slivers", "degenerate"])
def test_distances_are_those_of_all_triangles_one_by_one(name, scale):
    V, F = {"closed": torus(12, 8), "open": sheet(), "slivers": torus(12, 8), "degenerate": sheet()}[name]
    if name == "slivers":  # triangles of very different sizes: the nearest centroid is seldom the nearest triangle's
        V = V * [1, 1, 30]
        V[::7] += [0, 40, 0]
    if name == "degenerate":
        F = np.concatenate([F, [[0, 0, 0], [1, 1, 2], [0, 5, 5]], F[:2]])
    surface = mss.Surface(V * scale, F)
    spread = V.max(axis=0) - V.min(axis=0)
    points = (V.mean(axis=0) + np.random.default_rng(3).uniform(-1, 1, (200, 3)) * spread) * scale
    found = distances(points, surface)
    assert np.abs(found - nearest_by_brute_force(points, surface)).max() < 1e-12 * scale * spread.max()


def test_distances_are_those_of_meshlab():
    V, F = rough(torus(), 0.5)
    ms = meshset.new(V, F)
    ms.add_mesh(pymeshlab.Mesh(*torus()))
    ms.compute_scalar_by_distance_from_another_mesh_per_vertex(
        measuremesh=0, refmesh=1, signeddist=False, maxdist=pymeshlab.PercentageValue(100)
    )
    ms.set_current_mesh(0)
    theirs = np.abs(ms.current_mesh().vertex_scalar_array())
    assert np.abs(distances(V, CLEAN) - theirs).max() < 1e-5 * np.ptp(V)  # they search in single precision


def test_far_points_and_a_face_they_all_look_at():
    """All triangles of a plane seen from afar are nearly as far as the nearest: no shortcut may leave it out."""
    V, F = sheet(30, 30)
    flat = mss.Surface(V * [1, 1, 0], F)
    points = np.array([[7.3, 5.2, 1e4], [1e5, 3.0, 0.0], [-300.0, -400.0, 0.0]])
    assert distances(points, flat) == pytest.approx([1e4, 1e5 - 29, 500], rel=1e-14)


def test_the_surface_error_forgives_drift_and_nothing_else():
    flat = mss.Surface(*sheet(20, 20))
    flat = changed(flat, flat.vertices * [1, 1, 0])
    inside = (flat.vertices[:, :2] > 0).all(axis=1) & (flat.vertices[:, :2] < 19).all(axis=1)
    drifted = changed(flat, flat.vertices + 0.3 * inside[:, None] * [1, 0.5, 0])
    assert surface_error(drifted, flat) < 1e-15
    assert vertex_error(drifted, flat) > 0.1
    # in mean edges, each edge counted once
    ends, _ = edges(flat)
    h = np.linalg.norm(flat.vertices[ends[:, 0]] - flat.vertices[ends[:, 1]], axis=1).mean()
    assert surface_error(changed(flat, flat.vertices + [0, 0, 0.3]), flat) == pytest.approx(0.3 / h)


def test_the_surface_error_weighs_each_vertex_by_the_area_at_it():
    """One vertex of many is off: its share is a third of the area of its faces."""
    V, F = sheet(6, 6)
    flat = mss.Surface(V * [1, 1, 0], F)
    lifted = flat.vertices.copy()
    lifted[14, 2] = 1e-4  # so little that the areas stay
    ends, _ = edges(flat)
    h = np.linalg.norm(flat.vertices[ends[:, 0]] - flat.vertices[ends[:, 1]], axis=1).mean()
    share = 6 * 0.5 / (3 * 25)  # six faces of half a square, 25 squares
    assert surface_error(changed(flat, lifted), flat) == pytest.approx(1e-4 * np.sqrt(share) / h, rel=1e-6)


def test_turned_faces_are_counted_as_shares_of_those_with_a_direction():
    turned = FLAT.faces.copy()
    turned[0] = turned[0, ::-1]
    assert flipped(mss.Surface(FLAT.vertices, turned), FLAT) == 50
    assert flipped(CLEAN, CLEAN) == 0
    assert flipped(mss.Surface(CLEAN.vertices, CLEAN.faces[:, ::-1]), CLEAN) == 100
    collapsed = FLAT.vertices.copy()
    collapsed[3] = collapsed[0]
    assert flipped(mss.Surface(FLAT.vertices, turned), changed(FLAT, collapsed)) == 100
    assert flipped(changed(FLAT, collapsed), FLAT) == 0


@pytest.mark.parametrize("name", noise.KINDS)
def test_noise_of_every_kind_scales_with_the_mesh_and_has_its_seed(name):
    add = noise.KINDS[name]
    moved = add(CLEAN, 0.3, 1)
    assert np.array_equal(moved, add(CLEAN, 0.3, 1))
    assert not np.array_equal(moved, add(CLEAN, 0.3, 2))
    larger = add(changed(CLEAN, 1e6 * CLEAN.vertices), 0.3, 1)
    assert np.abs(larger - 1e6 * moved).max() < 1e-6 * np.ptp(CLEAN.vertices)


def test_noise_is_of_its_kind():
    surface = mss.Surface(*torus(120, 72))
    normals, h = vertex_normals(surface), mean_edge_length(surface)
    move = {name: (add(surface, 0.3, 1) - surface.vertices) / h for name, add in noise.KINDS.items()}
    for name in ("gaussian", "correlated"):
        assert move[name].std(axis=0) == pytest.approx([0.3] * 3, rel=0.1)
    for name in ("along_normals", "impulses"):
        assert np.abs(np.cross(move[name], normals)).max() < 1e-12
    assert (move["along_normals"] * normals).sum(axis=1).std() == pytest.approx(0.3, rel=0.05)
    hit = np.linalg.norm(move["impulses"], axis=1) > 1e-9
    assert hit.mean() == pytest.approx(0.1, rel=0.15)
    assert np.linalg.norm(move["impulses"][hit], axis=1).std() > 0.1
    for name in ("along_view", "quantized"):
        assert np.linalg.matrix_rank(move[name], tol=1e-9) == 1
    # neighbors share what is correlated, and nothing of what is white
    a, b = edges(surface)[0].T
    alike = {name: np.corrcoef(of[a].ravel(), of[b].ravel())[0, 1] for name, of in move.items()}
    assert abs(alike["gaussian"]) < 0.05
    assert alike["correlated"] > 0.5
    depths = (surface.vertices + h * move["quantized"]) @ (np.array([0.3, 0.2, 1]) / np.linalg.norm([0.3, 0.2, 1]))
    steps = depths / (0.3 * h)
    assert np.abs(steps - np.round(steps)).max() < 1e-8

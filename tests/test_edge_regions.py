"""Where the edge-aware filter acts: selections, features, boundaries, and creases given by hand."""

import re

import numpy as np
import pymeshlab
import pytest
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

import meshlab_specsmooth as mss
from meshlab_specsmooth.cli import main
from meshlab_specsmooth.comparison.metrics import normal_error
from meshlab_specsmooth.edge_aware.filter import low_pass_normals
from meshlab_specsmooth.edge_aware.operators import assemble_faces, cut_along_creases, draw_sample, smooth_isotropically
from meshlab_specsmooth.edge_aware.region import FaceRegion
from meshlab_specsmooth.geometry.surface import boundary_vertices, face_vectors
from meshlab_specsmooth.graph.creases import cut_along, cut_graph, find_creases
from meshlab_specsmooth.graph.face_adjacency_scipy import face_graph
from meshlab_specsmooth.meshlab import creases, filters, mesh_files, meshset, parameters
from meshlab_specsmooth.meshlab.creases import selected_edges
from tests import state
from tests.meshes import rough, sheet, torus
from tests.test_edge_aware import box

# a setting, so that nothing is searched
SETTING = {"strength": 0.5, "range_sigma": 0.35, "iterations": 2, "barycenter_weight": 0.35}
# from 1000 vertices on no eigenvectors are computed, which is faster
RING = rough(torus(50, 24), 0.2)
HALF = np.arange(1200) < 600
OPEN = rough(sheet(40, 27), 0.2)
RIM = boundary_vertices(mss.Surface(*OPEN))
BOX = box(6)
PAIRS = find_creases(*(lambda s: (s.faces, face_vectors(s)))(mss.Surface(*BOX)), len(BOX[0]), 45)


def smoothed(mesh, **given):
    return mss.smooth_edge_aware(*mesh, **SETTING | given)


def moved(result, mesh):
    return (result.vertices != mesh[0]).any(axis=1)


def test_a_mask_of_all_changes_nothing_and_one_of_none_leaves_all():
    free = smoothed(RING)
    assert np.array_equal(smoothed(RING, mask=np.ones(1200)).vertices, free.vertices)
    assert free.warning is None
    for function in (mss.denoise, mss.smooth_edge_aware):
        none = function(*RING, mask=np.zeros(1200))
        assert np.array_equal(none.vertices, RING[0])
        assert "nothing is selected" in none.warning
        assert none.noise.level > 0  # it is measured all the same


def test_what_is_not_selected_stays_to_the_bit_and_the_displacement_fades_out():
    free, part = smoothed(RING), smoothed(RING, mask=HALF)
    assert not moved(part, RING)[~HALF].any()
    assert moved(part, RING)[HALF].all()
    step, whole = (np.linalg.norm(r.vertices - RING[0], axis=1) for r in (part, free))
    ring = np.minimum(np.arange(600) // 24, 24 - np.arange(600) // 24)  # from the rim of the selection
    share = step[HALF] / whole[HALF]
    assert share[ring == 0] == pytest.approx(0.15625)
    assert share[ring == 1] == pytest.approx(0.5)
    assert share[ring >= 3] == pytest.approx(1.0)


def test_noise_and_setting_are_those_of_the_selected_part():
    V, F = torus(50, 24)
    noisy = HALF
    V = np.where(noisy[:, None], rough((V, F), 0.2)[0], V)
    whole, part, clean = (smoothed((V, F), mask=mask) for mask in (None, noisy, ~noisy))
    assert part.noise.level > 1.2 * whole.noise.level
    assert clean.noise.kind == "none"
    # too small a part to tell
    assert smoothed((V, F), mask=np.arange(1200) < 100).noise.level == whole.noise.level
    # pieces of a large mesh are taken where it is selected
    V, F = torus(150, 100)
    mesh = assemble_faces(V, F.astype(np.int32), np.arange(len(V)) < 6000)
    sample, _, _ = draw_sample(mesh)
    found = {tuple(p) for p in sample.V[sample.counted]}
    assert len(found) >= 200
    assert found <= {tuple(p) for p in mesh.V[:6000]}


def test_features_are_smoothed_as_the_rest_kept_or_enhanced():
    free = smoothed(RING)
    assert np.array_equal(smoothed(RING, features=np.ones(1200), feature_gain=0).vertices, free.vertices)
    kept = smoothed(RING, features=np.ones(1200))
    assert np.array_equal(kept.vertices, RING[0])
    assert "features" in kept.warning
    result = smoothed(RING, features=0.5 * HALF, feature_gain=3)
    step, whole = result.vertices - RING[0], free.vertices - RING[0]
    assert step[HALF] == pytest.approx(-0.5 * whole[HALF])
    assert np.array_equal(result.vertices[~HALF], free.vertices[~HALF])


@pytest.mark.parametrize("function", [mss.denoise, mss.smooth_edge_aware])
def test_a_fixed_boundary_stays_to_the_bit_so_that_tiles_fit(function):
    V = sheet(12, 31)[0]
    V = V + 0.15 * np.random.default_rng(2).standard_normal(V.shape)
    grid = V.reshape(12, 31, 3)
    tile = sheet(12, 16)[1]
    left, right = (
        function(np.ascontiguousarray(part).reshape(-1, 3), tile, boundary="fixed").vertices.reshape(12, 16, 3)
        for part in (grid[:, :16], grid[:, 15:])
    )
    assert np.array_equal(left[:, -1], right[:, 0])
    assert np.array_equal(left[:, -1], grid[:, 15])
    assert (left[1:-1, 1:-1] != grid[1:-1, 1:15]).any(axis=2).all()


def test_a_boundary_is_fixed_or_a_curve_by_itself_or_follows_the_faces():
    isotropic = mss.smooth(*OPEN, barycenter_weight=0.35, response="heat", boundary="curve").vertices
    results = {name: smoothed(OPEN, boundary=name) for name in ("auto", "fixed", "curve", "free")}
    assert np.array_equal(results["auto"].vertices, smoothed(OPEN).vertices)
    assert np.array_equal(results["fixed"].vertices[RIM], OPEN[0][RIM])
    assert results["curve"].vertices[RIM] == pytest.approx(isotropic[RIM], abs=1e-9)
    assert moved(results["curve"], OPEN)[RIM].any()
    assert all(moved(result, OPEN)[~RIM].all() for result in results.values())
    inward = [np.linalg.norm((results[name].vertices - OPEN[0])[RIM]) for name in ("auto", "free")]
    assert inward[0] < inward[1]
    closed = [smoothed(RING, boundary=name).vertices for name in ("auto", "fixed", "curve", "free")]
    assert all(np.array_equal(V, closed[0]) for V in closed)


def brute_force(F, n, creases):
    """Pairs of faces linked in the fan of a common vertex without a crease between, less those on one crease."""
    creases = {frozenset(pair) for pair in creases.tolist()}
    sides = [[frozenset((f[k], f[k - 1])) for k in range(3)] for f in F.tolist()]
    pairs = set()
    for v in range(n):
        fan = np.flatnonzero((v == F).any(axis=1))
        if len(fan) == 0:
            continue
        linked = [[any(v in s and s not in creases for s in set(sides[i]) & set(sides[j])) for j in fan] for i in fan]
        _, part = connected_components(csr_array(np.array(linked, dtype=float)), directed=False)
        pairs |= {(i, j) for i, p in zip(fan, part, strict=True) for j, q in zip(fan, part, strict=True) if p == q}
    return {(i, j) for i, j in pairs if i != j and not creases & set(sides[i]) & set(sides[j])}


@pytest.mark.parametrize("share", [0.0, 0.02, 0.2, 0.7])
def test_faces_are_neighbors_where_no_crease_lies_between_them(share):
    fan = np.array([[0, k, k + 1] for k in range(1, 6)] + [[0, 2, 9], [0, 1, 1]])  # open, three on an edge, a sliver
    flat = sheet(6, 5)[1]
    for F, n in ((flat, 30), (fan, 10)):
        F = F.astype(np.int32)
        ends = np.unique(np.sort(np.concatenate([F[:, [0, 1]], F[:, [1, 2]], F[:, [0, 2]]]), axis=1), axis=0)
        ends = ends[ends[:, 0] != ends[:, 1]]
        creases = ends[np.random.default_rng(3).random(len(ends)) < share].astype(np.int32)
        graph = cut_graph(F, n, cut_along(F, n, creases))
        rows = np.repeat(np.arange(len(F)), np.diff(graph.indptr))
        assert set(zip(rows.tolist(), graph.indices.tolist(), strict=True)) == {
            (int(i), int(j)) for i, j in brute_force(F, n, creases)
        }
        if share == 0:
            assert np.array_equal(graph.indices, face_graph(F, n).indices)


def test_nothing_flows_across_creases():
    V, F = rough(BOX, 0.15, seed=2)
    F = F.astype(np.int32)
    mesh = cut_along_creases(assemble_faces(V, F, np.ones(len(V), dtype=bool)), PAIRS)
    top = np.flatnonzero((BOX[0][:, 2] == 6) & ((BOX[0][:, :2] % 6 > 1) & (BOX[0][:, :2] % 6 < 5)).all(axis=1))
    other = V.copy()
    other[top] += 0.3 * np.random.default_rng(5).standard_normal((len(top), 3))
    elsewhere = (BOX[0][F][:, :, 2] < 6).any(axis=1)
    area = np.ones(len(F))
    N = []
    for X in (V, other):
        guide = mesh.kernels.face_geometry(smooth_isotropically(mesh, X, 0.3))[1]
        center, given, _ = mesh.kernels.face_geometry(X)
        N.append((guide, low_pass_normals(mesh.kernels, center, given, area, guide, 2.0, 0.35, is_exact=True)))
    for first, second, scale in zip(*N, (2e-3, 5e-5), strict=True):  # the least squares are solved to 3e-3
        far = np.abs(first - second).max(axis=1)
        assert far[~elsewhere].max() > 0.05
        assert far[elsewhere].max() < scale * far[~elsewhere].max()


def test_creases_by_hand_and_by_angle_are_the_same_and_stay_sharp():
    clean, noisy = mss.Surface(*BOX), rough(box(10), 0.2, seed=3)
    by_pairs = smoothed(BOX, creases=PAIRS)
    assert by_pairs.creases == len(PAIRS) == 72
    assert np.array_equal(smoothed(BOX, creases=60).vertices, by_pairs.vertices)
    assert np.array_equal(smoothed(BOX, creases=PAIRS[::-1, ::-1]).vertices, by_pairs.vertices)
    assert smoothed(BOX, creases=100).creases == 0
    assert normal_error(mss.Surface(by_pairs.vertices, BOX[1]), clean) < 1e-6
    # under noise, when most edges of the given surface are steeper
    large = mss.Surface(*box(10))
    normal = face_vectors(large)
    hand = find_creases(large.faces, normal, len(large.vertices), 45)
    results = [mss.denoise(*noisy, creases=creases) for creases in (hand, 50.0)]
    assert results[0].creases == results[1].creases == 120
    assert np.array_equal(results[0].vertices, results[1].vertices)
    assert all(row.setting.iterations > 0 for row in results[0].considered)  # the isotropic filter would round them
    assert moved(results[0], noisy)[np.unique(hand)].all()
    assert normal_error(mss.Surface(results[0].vertices, large.faces), large) < 2.0


def test_soft_settings_do_not_round_what_is_a_crease():
    soft = {"strength": 4.0, "range_sigma": 1.5, "start": "given"}
    noisy = rough(BOX, 0.05, seed=1)
    rounded, sharp = (smoothed(noisy, creases=creases, **soft) for creases in (None, PAIRS))
    errors = [normal_error(mss.Surface(r.vertices, BOX[1]), mss.Surface(*BOX)) for r in (rounded, sharp)]
    assert errors[1] < errors[0] / 3


@pytest.mark.parametrize(
    ("edges", "words"),
    [
        ([[0, 1], [0, 217]], r"creases\[1\] is \(0, 217\), which is no edge"),
        ([[0, 1], [0, 218]], r"creases\[1\] is \(0, 218\); vertices are numbered from 0 to 217"),
        ([[0, 1], [-1, 2]], r"creases\[1\] is \(-1, 2\)"),
        ([[3, 3]], r"creases\[0\] is \(3, 3\), which is no edge"),
        ([0, 1], r"creases has shape \(2,\); pass \(k, 2\)"),
        ([[0, 1, 2]], "shape"),
        ([[0.0, 1.0]], "vertex pairs are integers"),
        ([[True, False]], "vertex pairs are integers"),
        ([[0, 1], [2]], "no array of vertex pairs"),
        (0, "angle"),
        (180, "angle"),
        (np.nan, "angle"),
        (-30.0, "angle"),
        ("30", "angle"),
        (True, "angle"),
        (1j, "angle"),
    ],
)
def test_creases_that_are_none_are_refused_with_the_first_bad_row(edges, words):
    for function in (mss.denoise, mss.smooth_edge_aware):
        with pytest.raises(mss.InvalidParameter, match=words):
            function(*BOX, creases=edges)


@pytest.mark.parametrize(
    "given",
    [
        {"mask": np.ones(3)},
        {"mask": np.full(218, 2)},
        {"features": np.full(218, np.nan)},
        {"feature_gain": -1},
        {"feature_gain": np.inf},
        {"feature_gain": "1"},
        {"feature_gain": np.ones(2)},
        {"boundary": "open"},
    ],
)
def test_other_restrictions_are_refused_by_name(given):
    with pytest.raises(mss.InvalidParameter, match=next(iter(given))):
        mss.denoise(*BOX, **given)


def test_vertices_that_become_one_keep_the_largest_fraction():
    region = FaceRegion(
        "auto", np.array([True, True, False, True]), np.array([0.0, 1, 0, 0]), np.array([[0, 1], [0, 2], [1, 3]])
    )
    after = region.renumbered(np.array([0, 1, 0, -1]), 2)
    assert after.inside.tolist() == [False, True]
    assert after.kept.tolist() == [0, 1]
    assert FaceRegion("auto", None, None, np.array([[0, 1], [0, 2]])).renumbered(
        np.array([0, 1, 0]), 2
    ).creases.tolist() == [[0, 1]]


# on MeshSets

EACH = pytest.mark.parametrize("name", ["apply_coord_edge_aware_smoothing", "apply_coord_spectral_denoising"])
MOVERS = [name for name in filters.FILTERS if name.startswith("apply_coord_")]


@EACH
def test_a_selection_restricts_the_filters_on_meshsets(name):
    function, given = (mss.denoise, {}) if "denoising" in name else (mss.smooth_edge_aware, SETTING)
    mesh = rough(sheet(9, 8), 0.2)
    ms = meshset.new(*mesh)
    ms.compute_selection_by_condition_per_face(condselect="fi < 80")
    mask = np.isin(np.arange(72), mesh[1][:80])
    expected = function(*mesh, mask=mask, boundary="fixed", **given)
    report = filters.FILTERS[name](ms, boundary="fixed", **given)
    assert np.array_equal(ms.current_mesh().vertex_matrix(), expected.vertices)
    assert set(report) == set(vars(expected)) - {"vertices", "source", "given"}
    marking = meshset.new(*mesh)
    marking.compute_selection_by_condition_per_face(condselect="fi < 80")
    filters.FILTERS[name](marking, features="face_selection", feature_gain=0.0, **given)
    assert np.array_equal(marking.current_mesh().vertex_matrix(), function(*mesh, **given).vertices)


@pytest.mark.parametrize("name", MOVERS)
def test_a_left_over_selection_is_reported_in_one_line(name):
    ms = meshset.new(*rough(sheet(8, 6)))
    assert "selected" not in (filters.FILTERS[name](ms)["warning"] or "")
    ms.compute_selection_by_condition_per_face(condselect="fi < 5")
    line = "5 of 70 faces are selected: only these are smoothed; selected=False for all"
    with pytest.warns(mss.SmoothingWarning, match=re.escape(line)) as caught:
        assert line in filters.FILTERS[name](ms)["warning"]
    assert len(caught) == 1
    # what is asked for is not reported, nor is a selection of all
    ms.compute_selection_by_condition_per_face(condselect="fi < 5")
    for given in ({"selected": True}, {"selected": False}):
        assert "selected" not in (filters.FILTERS[name](ms, **given)["warning"] or "")
    ms.set_selection_all()
    assert "selected" not in (filters.FILTERS[name](ms)["warning"] or "")
    ms.set_selection_none()
    with pytest.warns(mss.SmoothingWarning, match="nothing is selected"):
        assert filters.FILTERS[name](ms, selected=True)["warning"].count("nothing is selected") == 1


@pytest.mark.parametrize(
    "name", [n for n in MOVERS if not any(w in n for w in ("low_pass", "enhancement", "boundary"))]
)
def test_features_everywhere_are_reported(name):
    ms = meshset.new(*rough(sheet(8, 6)))
    ms.set_selection_all()
    before = ms.current_mesh().vertex_matrix()
    with pytest.warns(mss.SmoothingWarning, match="all vertices are features"):
        report = filters.FILTERS[name](ms, features="vertex_selection")
    assert np.array_equal(ms.current_mesh().vertex_matrix(), before)
    assert report["warning"].count("all vertices are features") == 1


@EACH
def test_selected_edges_are_creases(name):
    noisy = rough(BOX, 0.1, seed=4)
    selected = meshset.new(*BOX)
    selected.compute_selection_crease_per_edge(angledegneg=-45, angledegpos=45)
    assert np.array_equal(selected_edges(selected), np.unique(np.sort(PAIRS, axis=1), axis=0))
    meshset.set_vertices(selected, noisy[0])
    before = state.of_meshset(selected)
    assert len(selected_edges(selected)) == len(PAIRS)
    assert state.differences(before, state.of_meshset(selected)) == []
    given = SETTING if "edge_aware" in name else {}
    expected = mss.smooth_edge_aware(*noisy, creases=PAIRS, **given) if given else mss.denoise(*noisy, creases=PAIRS)
    report = filters.FILTERS[name](selected, creases="edge_selection", **given)
    assert report["creases"] == len(PAIRS)
    assert selected.current_mesh().vertex_matrix() == pytest.approx(expected.vertices, abs=1e-12)
    by_angle = meshset.new(*noisy)
    assert filters.FILTERS[name](by_angle, crease_angle=60, **given)["creases"] == len(PAIRS)
    for wrong in ({"creases": "edge_selection", "crease_angle": 30}, {"crease_angle": 180}):
        with pytest.raises(mss.InvalidParameter, match="angle"):
            filters.FILTERS[name](selected, **wrong)
    with pytest.raises(mss.InvalidParameter, match="no edge is selected"):
        filters.FILTERS[name](by_angle, creases="edge_selection")
    assert issubclass(parameters.RefusedParameter, pymeshlab.PyMeshLabException)


def test_edges_that_are_written_in_another_way_are_an_error_with_a_remedy(monkeypatch):
    monkeypatch.setattr(creases, "_ELEMENTS", "element vertex {vertices}\nproperty float x\n")
    with pytest.raises(mss.MeshSetError, match="give an angle"):
        selected_edges(meshset.new(*BOX))


def test_the_command_takes_them_and_says_it_once(tmp_path, capsys):
    ms = meshset.new(*OPEN)
    ms.compute_selection_by_condition_per_vertex(condselect="vi < 700")
    path, out = tmp_path / "tile.ply", tmp_path / "out.ply"
    ms.save_current_mesh(str(path), save_vertex_flag=True)
    for command, line in (("smooth", "700 of 1 080 vertices"), ("denoise", "700 of 1 080 vertices")):
        assert main([command, str(path), str(out), "--boundary", "fixed"]) == 0
        assert capsys.readouterr().err.count(line) == 1
    selected = np.arange(1080) < 700
    V, _ = meshset.get_arrays(mesh_files.read(path))
    written, _ = meshset.get_arrays(mesh_files.read(out))
    still = ~selected | RIM
    assert np.array_equal(written[still], V[still])
    assert (written[~still] != V[~still]).any(axis=1).all()
    assert main(["denoise", str(path), str(out), "--no-selected", "--crease-angle", "60"]) == 0
    assert capsys.readouterr().err == ""
    assert main(["denoise", str(path), str(out), "--crease-angle", "200"]) == 2

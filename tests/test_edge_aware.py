import json
from pathlib import Path

import numpy as np
import pymeshlab
import pytest
from hypothesis import given, settings
from scipy.sparse import csr_array

import meshlab_specsmooth as mss
from meshlab_specsmooth.comparison.metrics import normal_error, vertex_error, volume_change
from meshlab_specsmooth.edge_aware import operators
from meshlab_specsmooth.edge_aware import operators as edge_aware_operators
from meshlab_specsmooth.geometry import surface as surfaces
from meshlab_specsmooth.graph import backend, face_adjacency_numba, face_adjacency_scipy
from meshlab_specsmooth.graph.face_adjacency import MAX_FACES_OF_A_VERTEX
from meshlab_specsmooth.graph.face_kernels_numba import NumbaFaceKernels
from meshlab_specsmooth.graph.face_kernels_scipy import ScipyFaceKernels
from meshlab_specsmooth.meshlab import mesh_files, meshset
from tests.meshes import box, flaws, meshes, rough, sheet, torus

BOX = box()
NOISY = rough(BOX, 0.2, seed=1)
# where it is no matter how well the search does
SMALL = rough(box(6), 0.2, seed=1)


@pytest.fixture(scope="module")
def smoothed():
    return mss.smooth_edge_aware(*NOISY)


def apart(a, b):
    return np.abs(a - b).max()


def test_box_is_closed_and_looks_outwards():
    surface = mss.Surface(*BOX)
    assert surfaces.is_closed(surface)
    assert surfaces.signed_volume(surface) == pytest.approx(12**3)


@pytest.mark.no_cover
def test_normals_of_a_cube_come_back_better_than_from_any_isotropic_filter(smoothed):
    truth = mss.Surface(*BOX)
    best = min(
        normal_error(mss.Surface(mss.smooth(*NOISY, barycenter_weight=w).vertices, BOX[1]), truth)
        for w in (1, 0.5, 0.35, 0.25, 0.18, 0.12)
    )
    result = mss.Surface(smoothed.vertices, BOX[1])
    assert normal_error(result, truth) < best / 2
    assert vertex_error(result, truth) < vertex_error(mss.Surface(*NOISY), truth)


def test_nothing_flips_and_the_volume_stays(smoothed):
    assert smoothed.flips == 0
    assert abs(smoothed.volume_change) < 0.5
    change = volume_change(mss.Surface(smoothed.vertices, BOX[1]), mss.Surface(*NOISY))
    assert smoothed.volume_change == pytest.approx(change)


def test_the_choice_is_the_best_of_what_was_considered(smoothed):
    errors = [row.error for row in smoothed.considered]
    assert errors[1:] == sorted(errors[1:])
    assert smoothed.error == errors[0] <= 1.01 * min(errors)
    first = smoothed.considered[0].setting
    assert (first.start, first.strength, first.range_sigma, first.iterations) == (
        smoothed.start,
        smoothed.strength,
        smoothed.range_sigma,
        smoothed.iterations,
    )


def test_the_error_is_estimated_well(smoothed):
    V, F = BOX
    normals = surfaces.vertex_normals(mss.Surface(V, F))
    errors = []
    for row in smoothed.considered[::-19]:
        off = mss.smooth_edge_aware(*NOISY, **vars(row.setting)).vertices - V
        errors.append((row.error, np.sqrt(((off * normals).sum(axis=1) ** 2).mean())))
    estimated, true = np.square(errors).T
    # mean squares are what is estimated, and they cannot be told apart by less than the resolution
    close = 2 * smoothed.noise.resolution**2
    assert estimated == pytest.approx(true, abs=close)
    assert true.max() > 2 * close
    assert true.min() < 0.2 * close
    assert smoothed.noise.level == pytest.approx(0.2 * surfaces.mean_edge_length(mss.Surface(V, F)), rel=0.15)


@pytest.mark.no_cover
def test_denoise_considers_the_isotropic_filter_and_is_no_worse_by_its_own_estimate(smoothed):
    result = mss.denoise(*NOISY)
    assert 0 in {row.setting.iterations for row in result.considered}
    assert result.error <= 1.01 * smoothed.error


def test_what_is_given_is_not_chosen():
    result = mss.smooth_edge_aware(*NOISY, strength=0.7, range_sigma=0.3, iterations=2)
    assert (result.strength, result.range_sigma, result.iterations) == (0.7, 0.3, 2)
    assert np.isnan(result.error)
    free = mss.smooth_edge_aware(*NOISY, strength=0.7, iterations=2, start="smoothed", barycenter_weight=0.4)
    tried = {(x.start, x.strength, x.iterations, x.barycenter_weight) for x in (row.setting for row in free.considered)}
    assert tried == {("smoothed", 0.7, 2, 0.4)}


def test_what_was_chosen_does_the_same_when_it_is_given(smoothed):
    """All of a setting can be given, so that a result needs no search to be made again."""
    assert apart(mss.smooth_edge_aware(*NOISY, smoothed.setting).vertices, smoothed.vertices) == 0
    stored = json.loads(json.dumps(smoothed.setting.to_dict()))
    assert mss.EdgeAware.from_dict(stored) == smoothed.setting


def test_deterministic_and_its_input_is_not_changed():
    V, F = SMALL[0].copy(), SMALL[1].copy()
    assert np.array_equal(mss.smooth_edge_aware(V, F).vertices, mss.smooth_edge_aware(V, F).vertices)
    assert np.array_equal(V, SMALL[0])
    assert np.array_equal(F, SMALL[1])


# what the guide's least squares are solved to, column by column
SOLVED = 1e-5
FIXED = {"strength": 1.0, "range_sigma": 0.3, "iterations": 3}


@pytest.mark.no_cover
def test_follows_rigid_motions_and_scale():
    V, F = NOISY
    result = mss.smooth_edge_aware(V, F, **FIXED).vertices
    Q, _ = np.linalg.qr(np.random.default_rng(0).standard_normal((3, 3)))
    Q *= np.sign(np.linalg.det(Q))
    moved = mss.smooth_edge_aware(V @ Q.T + [5, -3, 2], F, **FIXED).vertices
    assert apart(moved, result @ Q.T + [5, -3, 2]) < SOLVED * np.ptp(V)
    for scale in (1e-6, 1e6):
        assert apart(mss.smooth_edge_aware(V * scale, F, **FIXED).vertices, result * scale) < 1e-9 * np.ptp(V) * scale


def test_follows_the_choice_at_any_scale():
    one, scaled = (mss.smooth_edge_aware(SMALL[0] * scale, SMALL[1]) for scale in (1, 1e6))
    assert apart(scaled.vertices, one.vertices * 1e6) < 1e-7 * np.ptp(SMALL[0]) * 1e6


@pytest.mark.no_cover
def test_follows_permutations():
    V, F = NOISY
    rng = np.random.default_rng(4)
    order, faces_order = rng.permutation(len(V)), rng.permutation(len(F))
    place = np.argsort(order)
    result = mss.smooth_edge_aware(V, F, **FIXED).vertices
    other = mss.smooth_edge_aware(V[order], place[F][faces_order], **FIXED).vertices
    assert apart(other, result[order]) < SOLVED * np.ptp(V)


def test_flat_stays_flat():
    V, F = sheet(15, 12)
    V[:, 2] = 0
    assert apart(mss.smooth_edge_aware(V, F).vertices, V) < 1e-9 * np.ptp(V)
    slanted = V @ np.linalg.qr(np.random.default_rng(0).standard_normal((3, 3)))[0]
    assert apart(mss.denoise(slanted, F).vertices, slanted) < 1e-6 * np.ptp(V)


@pytest.mark.no_cover
def test_rims_do_not_creep():
    V, F = sheet(30, 25)
    V[:, 2] = 0
    noisy = V.copy()
    noisy[:, 2] += 0.2 * np.random.default_rng(0).standard_normal(len(V))
    rim = surfaces.boundary_vertices(mss.Surface(V, F))
    for result in (mss.smooth_edge_aware(noisy, F), mss.denoise(noisy, F)):
        off = (result.vertices - V)[rim]
        assert np.sqrt((off[:, :2] ** 2).mean()) < 0.1  # of an edge
        assert np.abs(off[:, :2].mean(axis=0)).max() < 0.02
        assert np.sqrt((off[:, 2] ** 2).mean()) < 0.15


def test_a_smooth_surface_is_no_worse_than_from_the_isotropic_filter():
    mesh = torus(60, 40)
    truth = mss.Surface(*mesh)
    V, F = rough(mesh, 0.2, seed=3)
    result = mss.denoise(V, F)
    isotropic = mss.smooth(V, F, barycenter_weight=result.barycenter_weight).vertices
    assert vertex_error(mss.Surface(result.vertices, F), truth) < 1.05 * vertex_error(mss.Surface(isotropic, F), truth)


@pytest.mark.no_cover
def test_impulses_are_recognized():
    V, F = box(20)
    rng = np.random.default_rng(0)
    noisy = V + (rng.random(len(V)) < 0.3)[:, None] * 0.5 * rng.standard_normal(V.shape)
    result = mss.smooth_edge_aware(noisy, F)
    assert result.noise.kind == "impulse"
    assert normal_error(mss.Surface(result.vertices, F), mss.Surface(V, F)) < 6


@pytest.mark.no_cover
@pytest.mark.parametrize("name", flaws(rough(sheet())))
def test_flawed_meshes(name):
    V, F = flaws(rough(sheet()))[name]
    result = mss.denoise(V, F)
    assert np.isfinite(result.vertices).all()
    stray = np.setdiff1d(np.arange(len(V)), F)
    assert np.array_equal(result.vertices[stray], V[stray])


@pytest.mark.no_cover
@settings(deadline=None, max_examples=40)
@given(meshes())
def test_any_soup_gives_a_finite_result(mesh):
    V, F = mesh
    result = mss.smooth_edge_aware(V, F)
    assert np.isfinite(result.vertices).all()
    assert np.isfinite(mss.denoise(V, F).vertices).all()


@pytest.mark.no_cover
def test_the_search_runs_on_patches_of_a_large_mesh():
    clean = mss.Surface(*box(42))  # more than 10 000 vertices
    V, F = rough(box(42), 0.2, seed=2)
    result = mss.smooth_edge_aware(V, F)
    assert result.noise.level == pytest.approx(0.2 * surfaces.mean_edge_length(clean), rel=0.15)
    assert normal_error(mss.Surface(result.vertices, F), clean) < 4


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"strength": 0}, "strength"),
        ({"range_sigma": np.inf}, "range_sigma"),
        ({"iterations": -1}, "iterations"),
        ({"iterations": 2.0}, "iterations"),
    ],
)
def test_wrong_parameters_are_refused_by_name(wrong, message):
    with pytest.raises(mss.InvalidParameter, match=message):
        mss.smooth_edge_aware(*NOISY, **wrong)


def test_progress_rises_to_one():
    seen = []
    mss.smooth_edge_aware(*SMALL, progress=seen.append)
    assert seen == sorted(seen)
    assert seen[-1] == 1
    with pytest.raises(KeyboardInterrupt):
        mss.smooth_edge_aware(*SMALL, progress=interrupt)


def interrupt(_):
    raise KeyboardInterrupt


def test_filter_is_the_function_and_crosses_itself_nowhere(smoothed):
    ms = pymeshlab.MeshSet()
    ms.add_mesh(pymeshlab.Mesh(*SMALL))
    output, expected = mss.apply_coord_edge_aware_smoothing(ms), mss.smooth_edge_aware(*SMALL)
    assert apart(ms.current_mesh().vertex_matrix(), expected.vertices) < 1e-12
    assert output["strength"] == expected.strength
    assert not mss.self_intersecting_faces(smoothed.vertices, BOX[1]).any()


def test_the_denoising_filter_is_the_function():
    ms = pymeshlab.MeshSet()
    ms.add_mesh(pymeshlab.Mesh(*SMALL))
    output = mss.apply_coord_spectral_denoising(ms)
    expected = mss.denoise(*SMALL)
    assert apart(ms.current_mesh().vertex_matrix(), expected.vertices) < 1e-12
    assert output["error"] == expected.error


def test_strong_smoothing_does_not_bend_the_boundary(monkeypatch):
    V, F = sheet(50, 40)
    V[:, 2] = 3 * np.sin(V[:, 0] / 9) * np.cos(V[:, 1] / 11)
    rim = (V[:, 0] % 49 == 0) | (V[:, 1] % 39 == 0)
    noisy, _ = rough((V, F), 0.2)

    def off():
        result = mss.smooth_edge_aware(noisy, F, iterations=0, barycenter_weight=0.03)
        return np.sqrt(((result.vertices - V)[rim, 2] ** 2).mean())

    held = off()
    monkeypatch.setattr(edge_aware_operators, "_hold_rim", lambda mesh, weight: weight)
    assert held < 0.75 * off()
    assert held < 0.2


def test_strong_smoothing_of_an_open_surface_takes_creases():
    V, F = rough(sheet(30, 20), 0.1)
    at = np.arange(19) + 15 * 20
    result = mss.smooth_edge_aware(V, F, iterations=0, barycenter_weight=0.05, creases=np.stack([at, at + 1], axis=1))
    assert result.creases == 19
    assert result.displacement > 0


# the graph of faces


@pytest.mark.parametrize("mesh", [NOISY, rough(sheet()), *flaws(sheet(6, 5)).values()])
def test_compiled_graph_is_the_reference(mesh):
    V, F = mesh
    F = np.ascontiguousarray(F, dtype=np.int32)
    one, other = face_adjacency_scipy.face_graph(F, len(V)), face_adjacency_numba.face_graph(F, len(V))
    for name in ("indptr", "indices", "vertex_indptr", "vertex_faces"):
        a, b = getattr(one, name), getattr(other, name)
        assert a.dtype == b.dtype == np.int32
        assert np.array_equal(a, b), name


def test_faces_of_a_hub_are_neighbors_through_the_rim_alone():
    k = MAX_FACES_OF_A_VERTEX + 10
    rim = np.arange(1, k + 1)
    F = np.stack([np.zeros(k, dtype=int), rim, np.roll(rim, -1)], axis=1).astype(np.int32)
    for graph in (face_adjacency_scipy.face_graph(F, k + 1), face_adjacency_numba.face_graph(F, k + 1)):
        assert (np.diff(graph.indptr) == 2).all()


def test_compiled_sweeps_are_the_reference():
    V, F = rough(torus(), 0.3)
    graph = face_adjacency_scipy.face_graph(np.ascontiguousarray(F, dtype=np.int32), len(V))
    one, other = ScipyFaceKernels(graph), NumbaFaceKernels(graph)
    rng = np.random.default_rng(0)
    frames = [kernels.face_geometry(V) for kernels in (one, other)]
    for a, b in zip(*frames, strict=True):
        assert apart(a, b) < 1e-12 * np.abs(a).max()
    center, N, area = frames[0]
    root = np.sqrt(area / area.mean())
    weights = [kernels.bilateral_weights(center, N, root, 0.7, 5.0) for kernels in (one, other)]
    for a, b in zip(*weights, strict=True):
        assert apart(a, b) < 1e-12 * a.max()
    weight, degree = weights[0]
    diagonal = root**2 + 2 * degree
    solved = [k.solve(weight, diagonal, 2.0, root[:, None] ** 2 * N, N, 1e-6, 12) for k in (one, other)]
    assert apart(*solved) < 1e-12 * np.abs(solved[0]).max()
    pull = rng.random(len(V)) / 6
    fitted = [kernels.update_vertices(V, N, pull, 15) for kernels in (one, other)]
    assert apart(*fitted) < 1e-12 * np.abs(V).max()


def test_the_solve_solves():
    V, F = rough(torus(), 0.3)
    graph = backend.face_graph(np.ascontiguousarray(F, dtype=np.int32), len(V))
    reference = ScipyFaceKernels(graph)
    center, N, area = reference.face_geometry(V)
    root = np.sqrt(area / area.mean())
    weight, degree = reference.bilateral_weights(center, N, root, 0.7, 5.0)
    diagonal = root**2 + 2 * degree
    X = backend.face_kernels(graph).solve(weight, diagonal, 2.0, N, np.zeros_like(N), 1e-9, 500)
    W = csr_array((weight, graph.indices, graph.indptr), shape=(graph.size, graph.size))
    assert apart(diagonal[:, None] * X - 2.0 * (W @ X), N) < 1e-6


def test_without_the_extra_the_result_is_the_same(monkeypatch):
    with_it = mss.smooth_edge_aware(*NOISY, **FIXED)
    monkeypatch.setattr(operators, "face_graph", face_adjacency_scipy.face_graph)
    monkeypatch.setattr(operators, "face_kernels", ScipyFaceKernels)
    without = mss.smooth_edge_aware(*NOISY, **FIXED)
    assert without.kernels == "scipy"
    assert apart(with_it.vertices, without.vertices) < 1e-9 * np.ptp(NOISY[0])


@pytest.mark.no_cover
def test_far_impulses_are_clipped_where_they_would_mislead():
    V, F = torus(60, 40)
    edge = surfaces.mean_edge_length(mss.Surface(V, F))
    random = np.random.default_rng(3)
    hit = random.random(len(V)) < 0.1
    noisy = V + hit[:, None] * edge * random.standard_normal(V.shape)
    result = mss.denoise(noisy, F)
    assert result.noise.kind == "impulse"
    off = np.sqrt(((result.vertices - V) ** 2).sum(axis=1).mean())
    before = np.sqrt(((noisy - V) ** 2).sum(axis=1).mean())
    assert off < 0.35 * before
    assert result.considered[0].setting.iterations == result.iterations


@pytest.mark.no_cover
def test_far_impulses_on_a_box_do_not_cost_its_edges():
    V, F = box(20)
    random = np.random.default_rng(3)
    noisy = V + (random.random(len(V)) < 0.1)[:, None] * random.standard_normal(V.shape)
    truth, result = mss.Surface(V, F), mss.denoise(noisy, F)
    clipped = next(row for row in result.considered if row.setting.start == "clipped")
    assert result.error < clipped.error
    isotropic = mss.Surface(mss.smooth(noisy, F).vertices, F)
    assert normal_error(mss.Surface(result.vertices, F), truth) < normal_error(isotropic, truth) / 2


def test_a_clean_coarse_model_is_left_alone():
    cow = Path(pymeshlab.__file__).parent / "tests" / "sample_meshes" / "cow.obj"
    V, F = meshset.get_arrays(mesh_files.read(cow))
    result = mss.denoise(V, F)
    assert result.noise.kind == "none"
    assert result.displacement < 0.02 * result.noise.mean_edge


def test_faces_that_were_turned_before_are_not_counted_as_turned():
    V, F = rough(torus(40, 24), 0.1)
    usual = mss.denoise(V, F)
    turned = F.copy()
    turned[::50] = turned[::50, ::-1]
    result = mss.denoise(V, turned)
    assert result.flips <= usual.flips + 1
    assert result.displacement < 1.2 * usual.displacement

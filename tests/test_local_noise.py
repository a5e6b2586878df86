"""Noise that is not the same everywhere: found as a field, removed where it is, and nothing moves where it is not."""

from dataclasses import replace

import numpy as np
import pymeshlab
import pytest

import meshlab_specsmooth as mss
from meshlab_specsmooth.errors import InvalidParameter
from meshlab_specsmooth.geometry.surface import face_vectors
from meshlab_specsmooth.meshlab import mesh_files, meshset
from meshlab_specsmooth.noise.local import find_varying_noise, split_by_level
from meshlab_specsmooth.operators.assemble import assemble
from tests.meshes import edge_of, noisy, remeshed_box, sheet, together, torus

TORUS, BOX = torus(110, 50), remeshed_box(32)
BUNNY = meshset.get_arrays(mesh_files.read(mesh_files.sample("bunny.obj")))
RUNS = pytest.mark.parametrize("run", [mss.smooth, mss.denoise])


def with_levels(mesh, levels, seed=1):
    V, F = mesh
    white = np.random.default_rng(seed).standard_normal(V.shape)
    return V + edge_of(V, F) * levels[:, None] * white, F


def half(mesh, level=0.3):
    x = mesh[0][:, 0]
    return level * (x > np.median(x))


def graded(mesh, level=0.5):
    x = mesh[0][:, 0]
    return level * (x - x.min()) / np.ptp(x)


def turned(V, clean, at=slice(None)):
    """Mean angle between face normals and the true ones, in degrees."""
    a, b = (face_vectors(mss.Surface(X, clean[1][at])) for X in (V, clean[0]))
    cosine = (a * b).sum(axis=1) / np.linalg.norm(a, axis=1) / np.linalg.norm(b, axis=1)
    return np.degrees(np.arccos(np.clip(cosine, -1, 1))).mean()


def far_from(levels, mesh, rings=14):
    """Vertices without noise that are so far from those with noise."""
    _, F = mesh
    reached = levels > 0
    for _ in range(rings):
        reached[F[reached[F].any(axis=1)]] = True
    return ~reached


@RUNS
@pytest.mark.parametrize(("mesh", "at_most"), [(TORUS, 1.6), (BUNNY, 3.0), (BOX, 6.0)], ids=["torus", "bunny", "box"])
def test_noise_on_one_half_goes_and_the_other_stays(run, mesh, at_most):
    levels = half(mesh)
    V, F = with_levels(mesh, levels)
    result = run(V, F)
    assert turned(V, mesh) > 15
    assert turned(result.vertices, mesh) < at_most
    still = far_from(levels, mesh)
    assert still.mean() > 0.1
    # the bunny, a real scan, has noise of 2 % of an edge in places
    assert (result.vertices[still] == V[still]).all(axis=1).mean() > (0.95 if mesh is BUNNY else 0.9999)
    assert np.abs(result.vertices[still] - V[still]).max() < 0.1 * edge_of(*mesh)
    assert result.noise.varies
    assert "the noise varies over the surface" in result.warning
    assert "without noise, are left alone" in result.warning
    assert np.median(result.noise.local[levels > 0]) == pytest.approx(0.3 * edge_of(*mesh), rel=0.15)
    assert np.median(result.noise.local[still]) == 0


def test_edges_are_kept_where_noise_is():
    V, F = with_levels(BOX, half(BOX, 0.2))
    assert turned(mss.denoise(V, F).vertices, BOX) < 0.4 * turned(mss.smooth(V, F).vertices, BOX)


@RUNS
def test_noise_that_grows_across_a_mesh_is_removed_everywhere(run):
    levels = graded(BUNNY)
    V, F = with_levels(BUNNY, levels)
    result = run(V, F)
    assert turned(V, BUNNY) > 20
    assert turned(result.vertices, BUNNY) < 4.2
    # by its strength: a weight that is the same everywhere leaves noise, or takes the shape
    uniform = [turned(mss.smooth(V, F, barycenter_weight=w).vertices, BUNNY) for w in (0.5, 0.25, 0.12, 0.06)]
    assert turned(result.vertices, BUNNY) < 0.95 * min(uniform)


def test_the_field_is_that_of_the_noise():
    levels = graded(BUNNY)
    noise = mss.estimate_noise(*with_levels(BUNNY, levels))
    assert noise.varies
    assert np.corrcoef(noise.local, levels)[0, 1] > 0.95
    assert "over the surface" in str(noise)


@pytest.mark.parametrize("mesh", [TORUS, BUNNY, BOX], ids=["torus", "bunny", "box"])
@pytest.mark.parametrize("level", [0.0, 0.1, 0.4])
def test_noise_that_is_the_same_everywhere_does_not_vary(mesh, level):
    V, F = noisy(mesh, level)
    assert find_varying_noise(assemble(V, F)) is None
    noise = mss.estimate_noise(V, F)
    assert not noise.varies
    assert noise.local.shape == (len(V),)
    if level:
        assert np.median(noise.local) == pytest.approx(noise.level, rel=0.15)


@pytest.mark.parametrize("kind", ["impulses", "spikes", "small", "correlated"])
def test_other_noise_does_not_vary(kind):
    mesh, rng = (torus(20, 20) if kind == "small" else TORUS), np.random.default_rng(3)
    V, F = noisy(mesh, 0.1)
    if kind == "impulses":
        V = V + edge_of(*mesh) * (rng.random(len(V)) < 0.1)[:, None] * rng.standard_normal(V.shape)
    elif kind == "spikes":
        V[rng.choice(len(V), 5)] += 10 * edge_of(*mesh)
    elif kind == "correlated":
        for _ in range(4):
            mean = np.zeros_like(V)
            np.add.at(mean, F.ravel(), np.repeat((V - mesh[0])[F].mean(axis=1), 3, axis=0))
            V = mesh[0] + mean / np.bincount(F.ravel(), minlength=len(V))[:, None]
    assert find_varying_noise(assemble(V, F)) is None


def test_a_large_mesh_is_looked_at_in_spots_first():
    mesh = torus(260, 120)
    V, F = with_levels(mesh, half(mesh))
    result = mss.smooth(V, F)
    assert result.noise.varies
    assert turned(result.vertices, mesh) < 1.0
    assert not mss.smooth(*noisy(mesh, 0.2)).noise.varies


@RUNS
def test_the_order_of_vertices_and_faces_does_not_matter(run):
    V, F = with_levels(TORUS, half(TORUS))
    found = []
    for seed in range(2):
        rng = np.random.default_rng(seed)
        at = rng.permutation(len(V))
        faces = np.argsort(at)[F][rng.permutation(len(F))]
        result = run(V[at], faces)
        found.append(turned(result.vertices[np.argsort(at)], TORUS))
        assert result.noise.varies
    assert max(found) < 1.03 * min(found)


@RUNS
def test_a_mask_restricts_it(run):
    V, F = with_levels(TORUS, half(TORUS))
    mask = V[:, 1] > 0
    result = run(V, F, mask=mask)
    assert np.array_equal(result.vertices[~mask], V[~mask])
    moved = (result.vertices != V).any(axis=1)
    assert 0.1 < moved.mean() < 0.5


def test_bands_share_all_vertices_with_noise():
    varying = find_varying_noise(assemble(*with_levels(BUNNY, graded(BUNNY))))
    bands = split_by_level(varying)
    assert len(bands) > 1
    assert sum(share for _, share in bands) == pytest.approx(varying.is_noisy.astype(float))
    assert all((share[members] > 0).all() for members, share in bands)
    assert max(sum(members.astype(int) for members, _ in bands)) == 1


def test_noise_on_a_narrow_strip_is_a_band_of_its_own():
    x = BUNNY[0][:, 0]
    levels = 0.4 * (np.abs(x - np.median(x)) < 0.07 * np.ptp(x))
    V, F = with_levels(BUNNY, levels)
    assert turned(mss.denoise(V, F).vertices, BUNNY) < 0.5 * turned(V, BUNNY)
    nowhere = replace(find_varying_noise(assemble(V, F)), is_steady=np.zeros(len(V), dtype=bool))
    assert all(members.any() for members, _ in split_by_level(nowhere))


def test_parts_of_different_noise_have_a_field():
    one, other = noisy(TORUS, 0.1), noisy((TORUS[0] + [20, 0, 0], TORUS[1]), 0.4)
    result = mss.smooth(*together(one, other))
    n = len(one[0])
    low, high = (np.median(part) / edge_of(*TORUS) for part in (result.noise.local[:n], result.noise.local[n:]))
    assert low == pytest.approx(0.1, rel=0.15)
    assert high == pytest.approx(0.35, rel=0.25)


# the expected error as a field


@RUNS
def test_the_expected_error_is_high_where_the_error_is(run):
    levels = graded(BUNNY)
    result = run(*with_levels(BUNNY, levels))
    field = result.error_field
    assert field is result.error_field
    error = np.linalg.norm(result.vertices - BUNNY[0], axis=1) / edge_of(*BUNNY)
    by_field = np.array_split(np.argsort(field), 4)
    true = [np.sqrt((error[at] ** 2).mean()) for at in by_field]
    assert true == sorted(true)
    assert true[-1] > 2 * true[0]
    scale = np.sqrt((field**2).mean()) / result.noise.mean_edge
    assert 0.4 < scale / np.sqrt((error**2).mean() / 3) < 2


def test_the_estimate_for_any_filter_has_a_field():
    V, F = with_levels(TORUS, half(TORUS, 0.2))
    left = mss.estimate_error(lambda X: X, V, F)
    assert np.median(left.field[half(TORUS) > 0]) == pytest.approx(0.2 * edge_of(*TORUS), rel=0.2)
    assert np.quantile(left.field[far_from(half(TORUS), TORUS, 18)], 0.9) < 0.1 * edge_of(*TORUS)


def test_results_without_noise_have_a_field_too():
    for result in (mss.smooth(*TORUS), mss.denoise(*TORUS), mss.low_pass(*noisy(TORUS, 0.2), modes=400)):
        assert result.error_field.shape == (len(TORUS[0]),)
        assert np.isfinite(result.error_field).all()
    with pytest.raises(InvalidParameter, match="removes noise"):
        mss.estimate_error_field(mss.enhance(*TORUS))


@pytest.mark.parametrize("local", [np.zeros(3), "none", np.full(len(TORUS[0]), -1.0), np.full(len(TORUS[0]), np.nan)])
def test_a_field_that_is_none_is_refused(local):
    noise = replace(mss.estimate_noise(*noisy(TORUS, 0.2)), local=local)
    with pytest.raises(InvalidParameter, match=r"noise\.local"):
        mss.estimate_error(lambda X: X, *noisy(TORUS, 0.2), noise=noise)


# on MeshSets, and as pictures


def test_the_filters_set_the_quality():
    V, F = with_levels(TORUS, half(TORUS))
    ms = pymeshlab.MeshSet(verbose=False)
    ms.add_mesh(pymeshlab.Mesh(V, F))
    report = mss.compute_scalar_by_noise_level(ms)
    assert report["varies"]
    noise = mss.estimate_noise(V, F)
    assert ms.current_mesh().vertex_scalar_array() == pytest.approx(noise.local, rel=1e-6)
    for after, run in (("denoising", mss.denoise), ("smoothing", mss.smooth)):
        report = mss.compute_scalar_by_estimated_error(ms, after=after)
        quality = ms.current_mesh().vertex_scalar_array()
        assert quality == pytest.approx(run(V, F).error_field, rel=1e-4, abs=1e-9)
        assert report["max"] == quality.max()
    assert np.array_equal(ms.current_mesh().vertex_matrix(), V)


def test_a_field_is_drawn(tmp_path):
    pytest.importorskip("pyvista")
    image = pytest.importorskip("PIL.Image")
    V, F = with_levels(TORUS, half(TORUS))
    path = tmp_path / "noise.png"
    mss.draw_field(path, (V, F), mss.estimate_noise(V, F).local, label="noise")
    with image.open(path) as drawn:
        colors = np.asarray(drawn.convert("RGB")).reshape(-1, 3)
    assert len(np.unique(colors, axis=0)) > 100
    for wrong in (np.zeros(3), np.full(len(V), np.nan)):
        with pytest.raises(InvalidParameter, match="values is"):
            mss.draw_field(path, V, wrong, faces=F)


def test_an_open_surface_has_a_field():
    mesh = sheet(60, 60)
    noise = mss.estimate_noise(*with_levels(mesh, half(mesh)))
    assert noise.varies
    assert np.isfinite(noise.local).all()

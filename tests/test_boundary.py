"""Smoothing of the boundary alone."""

import numpy as np
import pymeshlab
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial import Delaunay

import meshlab_specsmooth as mss
from meshlab_specsmooth.cli import main
from meshlab_specsmooth.geometry.surface import boundary_vertices
from meshlab_specsmooth.meshlab import meshset
from meshlab_specsmooth.operators.curves import _find_trend, low_pass_curve, trace_curves
from tests.meshes import noisy, sheet, torus


def disc(n=60, radius=0.45, hole=0.0, seed=0):
    """A flat disc whose rim is as jagged as the triangles are; its ideal rim is a circle."""
    rng = np.random.default_rng(seed)
    X = np.stack(np.meshgrid(*[np.linspace(-0.5, 0.5, n)] * 2, indexing="ij"), axis=-1).reshape(-1, 2)
    X += 0.25 / n * rng.standard_normal(X.shape)
    F = Delaunay(X).simplices
    distance = np.linalg.norm(X[F].mean(axis=1), axis=1)
    F = F[(distance < radius) & (distance > hole)]
    return np.c_[X, 0.2 * X[:, 0] ** 2], F.astype(np.int64)


def bent_sheet():
    V, F = sheet(40, 30)
    return V * [1, 1, 0] + np.c_[0 * V[:, :2], 0.01 * (V[:, 0] + V[:, 1]) ** 2], F


def rim_of(V, F):
    on_rim = boundary_vertices(mss.Surface(V, F))
    return on_rim, np.linalg.norm(V[on_rim, :2], axis=1)


def test_a_jagged_rim_comes_close_to_the_circle_that_it_was_cut_along():
    V, F = disc()
    result = mss.smooth_boundary(V, F)
    on_rim, before = rim_of(V, F)
    _, after = rim_of(result.vertices, F)
    assert after.std() < 0.25 * before.std()
    assert abs(after.mean() - before.mean()) < 0.02 * before.std()  # it does not shrink
    assert (result.smoothed, result.curves, result.corners) == (1, 1, 0)
    moved = (result.vertices != V).any(axis=1)
    followers = moved & ~on_rim
    assert 2 * on_rim.sum() < followers.sum() < 4 * on_rim.sum()  # three rings
    largest = np.linalg.norm(result.vertices - V, axis=1)
    assert largest[followers].max() <= largest[on_rim].max()
    assert "1 of 1 boundary curve smoothed" in result.summary
    assert "<table" in result._repr_html_()


def test_inner_vertices_stay_to_the_bit_with_no_rings_and_far_from_the_boundary():
    V, F = disc()
    result = mss.smooth_boundary(V, F, rings=0)
    on_rim, _ = rim_of(V, F)
    assert np.array_equal((result.vertices != V).any(axis=1), on_rim & (result.vertices != V).any(axis=1))


def test_faces_that_the_rim_turns_over_are_counted_and_following_helps():
    V, F = sheet(60, 20)
    V[:, 2] = 0
    V[:, 1] -= 4 * np.exp(-(((V[:, 0] - 30) / 4) ** 2) - V[:, 1] / 3)  # a bump whose inside is behind the rim
    stay, follow = (mss.smooth_boundary(V, F, wavelength=60.0, rings=rings, corner_angle=180) for rings in (0, 8))
    assert stay.flips > follow.flips == 0
    assert f"{stay.flips} faces at the boundary turned over; raise rings" in stay.warning


def test_two_rims_are_smoothed_each_by_itself():
    V, F = disc(hole=0.2)
    result = mss.smooth_boundary(V, F)
    assert (result.smoothed, result.curves) == (2, 2)
    _, before = rim_of(V, F)
    _, after = rim_of(result.vertices, F)
    for ideal in (0.2, 0.45):
        close = np.abs(before - ideal) < 0.1
        assert np.abs(after[close] - after[close].mean()).std() < 0.5 * before[close].std()


@pytest.mark.parametrize("mesh", [bent_sheet(), torus()], ids=["a clean sheet", "closed"])
def test_a_boundary_without_jags_and_a_closed_surface_stay_to_the_bit(mesh):
    result = mss.smooth_boundary(*mesh)
    assert np.array_equal(result.vertices, mesh[0])
    assert result.smoothed == 0
    assert result.warning
    assert "left as it is" in result.summary


def test_corners_stay_where_a_noisy_sheet_has_them():
    V, F = sheet(40, 30)
    V[:, 2] = 0
    on_rim = boundary_vertices(mss.Surface(V, F))
    V[on_rim, :2] += 0.3 * np.random.default_rng(0).standard_normal((on_rim.sum(), 2))
    result = mss.smooth_boundary(V, F)
    assert result.corners == 4
    sides = on_rim & (np.abs(V[:, 0]) < 0.9) & (V[:, 1] > 3) & (V[:, 1] < 26)
    assert np.abs(result.vertices[sides, 0]).max() < 0.4 * np.abs(V[sides, 0]).max()
    rounded = mss.smooth_boundary(V, F, corner_angle=180)
    assert rounded.corners == 0


def test_the_limit_is_kept_and_counted():
    V, F = disc()
    free = mss.smooth_boundary(V, F)
    result = mss.smooth_boundary(V, F, max_displacement=0.004)
    largest = np.linalg.norm(result.vertices - V, axis=1).max()
    assert largest == pytest.approx(0.004, rel=1e-3)
    assert np.linalg.norm(free.vertices - V, axis=1).max() > 0.006
    assert result.limited > 0
    assert f"{result.limited} of the boundary's vertices" in result.warning


def test_a_mask_keeps_vertices_and_seams_are_no_boundary():
    V, F = disc()
    mask = V[:, 0] > 0
    result = mss.smooth_boundary(V, F, mask=mask, rings=0)
    assert np.array_equal(result.vertices[~mask], V[~mask])
    assert not np.array_equal(result.vertices[mask], V[mask])
    soup, faces = V[F].reshape(-1, 3), np.arange(3 * len(F)).reshape(-1, 3)
    split = mss.smooth_boundary(soup, faces)
    np.testing.assert_allclose(split.vertices, mss.smooth_boundary(V, F).vertices[F].reshape(-1, 3), atol=1e-9)


@pytest.mark.parametrize(
    "given_", [{"wavelength": 0}, {"wavelength": 1e-5}, {"rings": -1}, {"rings": 1.5}, {"corner_angle": 200}]
)
def test_parameters_are_checked(given_):
    with pytest.raises(mss.InvalidParameter, match=next(iter(given_))):
        mss.smooth_boundary(*disc(), **given_)


@given(st.integers(8, 60), st.booleans(), st.floats(3, 40), st.integers(0, 2**32 - 1))
def test_a_curve_is_what_the_least_squares_of_the_paper_give(k, is_closed, wavelength, seed):
    """The product in the spectrum is the solution with the uniform Laplacian and the midpoints of the segments."""
    X = np.random.default_rng(seed).standard_normal((k, 3)).cumsum(axis=0)
    shift = np.roll(np.eye(k), 1, axis=1)
    L, C = np.eye(k) - (shift + shift.T) / 2, (np.eye(k) + shift) / 2
    cut = 1 - np.cos(2 * np.pi / wavelength)
    w2 = cut**2 / (1 - cut / 2)
    if is_closed:
        exact = np.linalg.solve(L.T @ L + w2 * C.T @ C, w2 * C.T @ C @ X)
        kept = np.fft.rfft(X, axis=0)
        kept[2:] = np.fft.rfft(exact, axis=0)[2:]  # the closest ellipse stays
        np.testing.assert_allclose(low_pass_curve(X, True, wavelength), np.fft.irfft(kept, k, axis=0), atol=1e-9)
        return
    # what is odd about both ends is periodic
    trend = _find_trend(X, wavelength)
    odd = X - trend
    whole = np.concatenate([odd, -odd[-2:0:-1]])
    n = len(whole)
    shift = np.roll(np.eye(n), 1, axis=1)
    L, C = np.eye(n) - (shift + shift.T) / 2, (np.eye(n) + shift) / 2
    exact = np.linalg.solve(L.T @ L + w2 * C.T @ C, w2 * C.T @ C @ whole)[:k] + trend
    np.testing.assert_allclose(low_pass_curve(X, False, wavelength), exact, atol=1e-8)


def test_curves_end_where_three_meet_and_a_figure_of_eight_is_two():
    star = trace_curves(np.array([[0, 1], [1, 2], [0, 3], [0, 4]]))
    assert sorted(len(c.vertices) for c in star) == [2, 2, 3]
    eight = trace_curves(np.array([[0, 1], [1, 2], [2, 0], [0, 3], [3, 4], [4, 0]]))
    assert [(c.vertices[0], c.vertices[-1], c.segments) for c in eight] == [(0, 0, 3), (0, 0, 3)]


def test_the_filter_and_the_command_do_the_same(tmp_path, capsys):
    V, F = noisy(disc(), 0.0)
    expected = mss.smooth_boundary(V, F).vertices
    ms = meshset.new(V, F)
    report = mss.apply_coord_boundary_smoothing(ms)
    np.testing.assert_allclose(ms.current_mesh().vertex_matrix(), expected, atol=1e-12)
    assert report["smoothed"] == 1
    meshset.new(V, F).save_current_mesh(str(tmp_path / "disc.ply"))
    assert main(["boundary", str(tmp_path / "disc.ply"), str(tmp_path / "out.ply")]) == 0
    assert "1 of 1 boundary curve smoothed" in capsys.readouterr().out
    read = pymeshlab.MeshSet()
    read.load_new_mesh(str(tmp_path / "out.ply"))
    np.testing.assert_allclose(read.current_mesh().vertex_matrix(), expected, atol=1e-6)

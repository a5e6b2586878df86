"""What is not noise stays, what cannot be told is said, and no result is out of proportion to the noise."""

import itertools
import warnings
from dataclasses import replace

import numpy as np
import pymeshlab
import pytest

import meshlab_specsmooth as mss
from meshlab_specsmooth.geometry import surface as surfaces
from meshlab_specsmooth.geometry.surface import Surface, is_closed, signed_volume
from meshlab_specsmooth.geometry.triangles import compute_aspects, compute_heights
from meshlab_specsmooth.geometry.welding import find_copies
from meshlab_specsmooth.noise.model import Noise
from meshlab_specsmooth.noise.outliers import replace_outliers
from meshlab_specsmooth.noise.shape_change import compare_shapes
from meshlab_specsmooth.operators.assemble import assemble
from meshlab_specsmooth.risk.choose_weight import choose_weight
from tests.meshes import box, rough, sheet, together, torus

BOTH = pytest.mark.parametrize("function", [mss.smooth, mss.denoise], ids=["smooth", "denoise"])


def circle(count, radius=10.0):
    angle = 2 * np.pi * np.arange(count) / count
    return radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)


def prism(outline, height, rows=1):
    """An outline extruded, its two faces fans about their first vertex: as a CAD program has it."""
    n = len(outline)
    V = np.concatenate([np.c_[outline, np.full(n, height * row / rows)] for row in range(rows + 1)])
    i, j, k = np.arange(n), (np.arange(n) + 1) % n, np.arange(1, n - 1)
    sides = [np.r_[np.c_[a + i, a + j, a + n + j], np.c_[a + i, a + n + j, a + n + i]] for a in range(0, rows * n, n)]
    return V, np.concatenate([*sides, np.c_[0 * k, k + 1, k], rows * n + np.c_[0 * k, k, k + 1]])


def cone(count, height=30.0):
    V, F = prism(circle(count), height)
    i = np.arange(count)
    base = F[(F < count).all(axis=1)]
    return np.r_[V[:count], [[0, 0, height]]], np.r_[np.c_[i, (i + 1) % count, np.full(count, count)], base]


def disc(count):
    k = np.arange(1, count - 1)
    return np.c_[circle(count), np.zeros(count)], np.c_[0 * k, k, k + 1]


def gear(teeth):
    angle = np.linspace(0, 2 * np.pi, 4 * teeth, endpoint=False)
    radius = np.tile([10.0, 10, 12, 12], teeth)[:, None]
    return prism(radius * np.stack([np.cos(angle), np.sin(angle)], axis=1), 5.0)


def soup(V, F):
    """Triangles that share no vertices, in single precision: what an STL file holds."""
    return V[F].reshape(-1, 3).astype(np.float32).astype(float), np.arange(F.size).reshape(-1, 3)


def coarse(V, F, faces):
    ms = pymeshlab.MeshSet(verbose=False)
    ms.add_mesh(pymeshlab.Mesh(V, F))
    ms.meshing_decimation_quadric_edge_collapse(targetfacenum=faces)
    return ms.current_mesh().vertex_matrix(), ms.current_mesh().face_matrix()


def turned(count, profile):
    """A profile of (radius, height) about the axis, open at both ends."""
    V = np.concatenate([np.c_[circle(count, radius), np.full(count, height)] for radius, height in profile])
    i, j = np.arange(count), (np.arange(count) + 1) % count
    sides = [
        np.r_[np.c_[a + i, a + j, a + count + j], np.c_[a + i, a + count + j, a + count + i]]
        for a in range(0, count * (len(profile) - 1), count)
    ]
    return V, np.concatenate(sides)


def bent(*corners, steps):
    """Points along a polyline, so many to each side."""
    sides = itertools.pairwise(corners)
    return [*(np.array(p) + (np.array(q) - p) * k / steps for p, q in sides for k in range(steps)), corners[-1]]


CAD = {
    "cylinder": prism(circle(100), 60.0),
    "slender cylinder": prism(circle(32), 400.0),
    "cylinder of five rows": prism(circle(100), 60.0, rows=5),
    "cone": cone(100),
    "disc": disc(100),
    "gear": gear(20),
    "gear of many teeth": gear(60),
    "torus of few sections": torus(200, 6),
    "soup": soup(*prism(circle(100), 60.0)),
    "soup of a gear": soup(*gear(40)),
    "turned part": turned(63, bent((8, 3), (6, 8), (8, 9), (5, 11), steps=3)),
    "turned part of even steps": turned(47, bent((9, 0), (3, 6), (5, 9), steps=6)),
    "box": box(2),
    "box of few cells": box(5),
    "cylinder and box": together(prism(circle(64), 60.0), (box(12)[0] + 100.0, box(12)[1])),
}


@BOTH
@pytest.mark.parametrize("name", CAD)
def test_a_cad_model_comes_back_as_it_was_or_is_said_to_be_unclear(function, name):
    V, F = CAD[name]
    result = function(V, F)
    assert np.array_equal(result.vertices, V)
    assert result.noise.kind in ("none", "unclear")
    if result.noise.kind == "unclear":
        assert "noise cannot be separated from shape" in result.warning
        assert result.noise.level == 0 < result.noise.high == result.noise.resolution
        assert "at most" in result.noise.format_error(0.0)


@BOTH
def test_a_coarse_model_comes_back_as_it_was(function):
    ms = pymeshlab.MeshSet(verbose=False)
    ms.create_sphere(subdiv=5)
    S, F = ms.current_mesh().vertex_matrix(), ms.current_mesh().face_matrix()
    lumps = S * (1 + 0.1 * np.sin(5 * S[:, :1]) * np.cos(4 * S[:, 1:2]) + 0.05 * np.sin(11 * S[:, 2:]))
    for faces in (500, 1500):
        V, G = coarse(lumps, F, faces)
        result = function(V, G)
        assert np.array_equal(result.vertices, V), (faces, result.noise.kind)


def test_a_cad_model_with_noise_is_not_made_worse():
    clean, F = prism(circle(60), 40.0, rows=26)
    noisy = rough((clean, F), 0.1)[0]
    result = mss.denoise(noisy, F)
    off = np.linalg.norm(result.vertices - clean, axis=1)
    before = np.linalg.norm(noisy - clean, axis=1)
    assert np.sqrt((off**2).mean()) < np.sqrt((before**2).mean())
    assert off.max() < 3 * before.max()
    assert signed_volume(Surface(result.vertices, F)) == pytest.approx(signed_volume(Surface(clean, F)), rel=0.01)


def test_aspects_and_heights_of_triangles_are_known():
    V = np.array([[0.0, 0, 0], [1, 0, 0], [0.5, np.sqrt(0.75), 0], [10, 1, 0], [0.5, -1, 0.25]])
    F = np.array([[0, 1, 2], [0, 1, 3], [1, 0, 4], [0, 0, 1]])
    aspects = compute_aspects(V, F[[0, 3]])
    assert aspects[0] == pytest.approx(1)
    assert aspects[1] == np.inf
    assert compute_heights(V, F[[0, 2]]) == pytest.approx([0.25])
    assert compute_heights(V, F[[0, 1]]) == pytest.approx([0])


@BOTH
def test_the_verdict_and_the_result_do_not_depend_on_the_order(function):
    V, F = rough(torus(150, 80), 0.1)
    noise = 0.3 * np.random.default_rng(0).standard_normal(V.shape)
    V[:3000] += 0.1 * noise[:3000]  # not the same everywhere, so that it counts where the patches are
    rng = np.random.default_rng(1)
    first = function(V, F)
    for _ in range(2):
        order = rng.permutation(len(V))
        G = np.argsort(order)[F][rng.permutation(len(F))]
        G = np.take_along_axis(G, (rng.integers(3, size=len(F))[:, None] + np.arange(3)) % 3, axis=1)
        result = function(V[order], G)
        assert result.noise.kind == first.noise.kind
        assert result.noise.level == pytest.approx(first.noise.level, rel=1e-9)
        weight = np.broadcast_to(first.barycenter_weight, len(V))[order]
        assert np.broadcast_to(result.barycenter_weight, len(V)) == pytest.approx(weight, rel=1e-6)
        assert result.vertices == pytest.approx(V[order] + (first.vertices - V)[order], abs=2e-3 * first.displacement)


@BOTH
def test_parts_of_unlike_scale_and_noise_have_a_level_each(function):
    large, F = rough(torus(48, 30), 0.2)
    small, faces = rough(torus(48, 30), 0.1, seed=2)
    clean = torus(40, 24)
    V, G = together((large, F), (0.01 * small + 9.0, faces), (clean[0] - 20.0, clean[1]))
    result = function(V, G)
    assert "parts of different scale or noise" in result.warning
    n = len(large)
    for truth, given, at in (
        (torus(48, 30)[0], large, slice(0, n)),
        (0.01 * torus(48, 30)[0] + 9.0, V[n : 2 * n], slice(n, 2 * n)),
    ):
        assert np.linalg.norm(result.vertices[at] - truth) < 0.6 * np.linalg.norm(given - truth)
    assert np.array_equal(result.vertices[2 * n :], V[2 * n :])
    assert result.noise.level / result.noise.mean_edge == pytest.approx(0.2, rel=0.15)
    assert mss.estimate_noise(V, G).level == pytest.approx(result.noise.level, rel=1e-6)


def test_components_that_are_alike_are_one_part():
    one = rough(torus(24, 20), 0.2)
    other = rough(torus(24, 20), 0.2, seed=3)
    V, F = together(one, (other[0] + 9.0, other[1]))
    assert "parts of unlike" not in (mss.smooth(V, F).warning or "")


def seam(n=40, m=24):
    """A noisy torus that is cut open: the vertices along two circles stand twice, at one place."""
    V, _ = rough(torus(n, m), 0.1)
    i, j = np.meshgrid(np.arange(n + 1), np.arange(m + 1), indexing="ij")
    first = ((i % n) * m + j % m).ravel()
    at = (np.arange(n)[:, None] * (m + 1) + np.arange(m)).ravel()
    G = np.r_[np.c_[at, at + m + 1, at + m + 2], np.c_[at, at + m + 2, at + 1]]
    return V, V[first], G, first


@pytest.mark.parametrize(
    "function",
    [mss.smooth, mss.denoise, lambda V, F, **k: mss.smooth(V, F, modes=60, barycenter_weight=0.5, **k), mss.enhance],
    ids=["smooth", "denoise", "given weight", "enhance"],
)
def test_vertices_at_one_place_move_as_one(function):
    _, V, F, first = seam()
    result = function(V, F)
    same = result.vertices[np.unique(first, return_index=True)[1]][np.unique(first, return_inverse=True)[1]]
    assert np.array_equal(result.vertices, same)
    assert result.welded == len(V) - len(np.unique(first))
    if function is mss.smooth:
        torn = function(V, F, weld=False)
        assert torn.welded == 0
        assert not np.array_equal(torn.vertices, result.vertices)


def test_a_seam_is_as_if_it_were_not_there_on_arrays_and_meshsets():
    whole, V, F, first = seam()
    expected = mss.smooth(whole, first[F], barycenter_weight=0.3)
    assert mss.smooth(V, F, barycenter_weight=0.3).vertices == pytest.approx(expected.vertices[first], abs=1e-9)
    ms = pymeshlab.MeshSet(verbose=False)
    ms.add_mesh(pymeshlab.Mesh(V, F))
    assert mss.apply_coord_spectral_smoothing(ms, barycenter_weight=0.3)["welded"] == len(V) - len(whole)
    assert ms.current_mesh().vertex_matrix() == pytest.approx(expected.vertices[first], abs=1e-9)


def test_copies_are_found_by_place_alone_and_of_used_vertices():
    V = np.array([[0.0, 1, 2], [1, 1, 1], [-0.0, 1, 2], [1, 1, 1], [1, 1, 1], [5, 5, 5]])
    used = np.array([True, True, True, False, True, True])
    assert find_copies(V, used).tolist() == [0, 1, 0, 3, 1, 5]
    assert find_copies(V[[0, 1, 5]], np.ones(3, dtype=bool)) is None


def test_a_soup_that_cannot_be_joined_is_warned_of():
    V, F = rough(torus(12, 10))
    triangles, G = V[F].reshape(-1, 3), np.arange(F.size).reshape(-1, 3)
    apart = triangles + 1e-9 * np.random.default_rng(0).standard_normal(triangles.shape)
    assert "edges have one face only" in mss.smooth(apart, G).warning
    assert "edges have one face only" not in (mss.smooth(triangles, G, barycenter_weight=1.0).warning or "")


def spiky(height, count=5, noise=0.1):
    ms = pymeshlab.MeshSet(verbose=False)
    ms.create_sphere(subdiv=4)
    S, F = ms.current_mesh().vertex_matrix(), ms.current_mesh().face_matrix()
    S /= np.linalg.norm(S, axis=1)[:, None]
    edge = surfaces.mean_edge_length(Surface(S, F))
    rng = np.random.default_rng(4)
    V = S * (1 + noise * edge * rng.standard_normal(len(S)))[:, None]
    at = np.sort(rng.choice(len(S), count, replace=False))
    direction = S[at] + 0.5 * rng.standard_normal((count, 3))
    V[at] += height * edge * direction
    return V, F, at, edge


@BOTH
@pytest.mark.parametrize("height", [4.0, 20.0, 1e4])
def test_single_stray_vertices_are_put_back_and_the_rest_is_smoothed_as_ever(function, height):
    V, F, at, edge = spiky(height)
    result, plain = function(V, F), function(*spiky(0.0)[:2])
    off = np.abs(np.linalg.norm(result.vertices, axis=1) - 1) / edge
    assert result.outliers.tolist() == at.tolist()
    assert off[at].max() < 0.3
    usual = np.abs(np.linalg.norm(plain.vertices, axis=1) - 1) / edge
    assert np.median(off) < 1.3 * np.median(usual)
    assert "5 stray vertices" in result.warning
    assert len(plain.outliers) == 0


def test_strays_next_to_each_other_and_on_a_clean_surface_are_found_and_corners_are_none():
    V, F, _, edge = spiky(0.0, noise=0.0)
    neighbor = F[(F == 7).any(axis=1)][0]
    W = V.copy()
    W[neighbor[neighbor != 7][0]] *= 1 + 10 * edge
    W[7] *= 1 + 12 * edge
    result = mss.smooth(W, F)
    assert len(result.outliers) == 2
    assert np.abs(np.linalg.norm(result.vertices, axis=1) - 1).max() < 0.2 * edge
    others = np.setdiff1d(np.arange(len(V)), result.outliers)
    assert np.array_equal(result.vertices[others], W[others])
    for shape in (box(10), cone(60), prism(circle(60), 40.0, rows=26)):
        assert len(replace_outliers(*(lambda p: (p.positions, p.L))(assemble(*shape)))[1]) == 0


def test_a_mask_keeps_strays_where_they_are():
    V, F, at, _ = spiky(20.0)
    mask = np.ones(len(V))
    mask[at[:2]] = 0
    for function in (mss.smooth, mss.denoise):
        result = function(V, F, mask=mask)
        assert np.array_equal(result.vertices[at[:2]], V[at[:2]])
        assert result.outliers.tolist() == at[2:].tolist()


def test_the_change_of_a_shape_is_measured_for_each_component():
    V, F = together(torus(30, 20), (torus(30, 20)[0] + 9.0, torus(30, 20)[1]), sheet(10, 8))
    V = (V - V.mean(axis=0)) / 20
    labels = np.repeat([0, 1, 2], [600, 600, len(V) - 1200]).astype(np.int32)
    W = V.copy()
    center = V[:600].mean(axis=0)
    W[:600] = center + 0.9 * (V[:600] - center)
    change = compare_shapes(V, W, F, np.array([True, True, False]), labels, Noise.zero(1.0))
    assert change.excessive.tolist() == [True, False, False]
    assert change.volume[:2] == pytest.approx([0.9**3 - 1, 0])
    assert np.isnan(change.volume[2])
    assert change.size == pytest.approx([-0.1, 0, 0], abs=1e-9)
    assert change.edge == pytest.approx([-0.1, 0, 0], abs=1e-9)
    # one component by the compiled sums, the same
    alone = compare_shapes(V[:600], W[:600], F[:1200], np.array([True]), None, Noise.zero(1.0))
    assert alone.volume[0] == pytest.approx(change.volume[0])
    assert alone.offset[0] == pytest.approx(change.offset[0])


def test_smoothing_that_would_shrink_a_thin_shape_holds_its_volume():
    a, b = (x.ravel() for x in np.meshgrid(np.arange(200) * np.pi / 100, np.arange(10) * np.pi / 5, indexing="ij"))
    ring = 30 + 0.8 * np.cos(b)
    thin = np.stack([ring * np.cos(a), ring * np.sin(a), 0.8 * np.sin(b)], axis=1)
    V, F = rough((thin, torus(200, 10)[1]), 0.2)
    truth = signed_volume(Surface(V, F))
    result = mss.smooth(V, F)
    assert signed_volume(Surface(result.vertices, F)) == pytest.approx(truth, rel=0.015)
    assert result.displacement > 0
    strong = mss.smooth(V, F, barycenter_weight=0.05)
    assert signed_volume(Surface(strong.vertices, F)) < 0.9 * truth
    assert "this weight changes the shape: the volume by -" in strong.warning
    assert mss.smooth(V, F, barycenter_weight=20.0).warning is None


def test_a_level_that_is_taken_too_high_does_no_harm(monkeypatch):
    """The shape is held against the noise whatever was estimated."""
    V, F = rough(torus(30, 16), 0.1)
    truth = signed_volume(Surface(V, F))

    def choose(*given, **more):
        return replace(choose_weight(*given, **more), weight=1e-3)

    monkeypatch.setattr("meshlab_specsmooth.smoothing.automatic.choose_weight", choose)
    result = mss.smooth(V, F)
    assert signed_volume(Surface(result.vertices, F)) == pytest.approx(truth, rel=0.03)
    assert "is returned" in result.warning or "the volume was held" in result.warning


def test_vertices_that_no_face_uses_need_not_be_finite():
    V, F = rough(torus(24, 20), 0.1)
    W = np.r_[V, [[np.nan, 0, 0], [np.inf, -np.inf, 1]]]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warnings.simplefilter("ignore", mss.SmoothingWarning)
        for function in (mss.smooth, mss.denoise):
            result = function(W, F)
            assert np.array_equal(result.vertices[: len(V)], function(V, F).vertices)
            assert np.array_equal(result.vertices[len(V) :], W[len(V) :], equal_nan=True)
            assert "2 vertices that no face uses are not finite" in result.warning
    with pytest.raises(mss.InvalidSurface, match=r"vertices\[480\] is not finite"):
        mss.smooth(W, np.r_[F, [[0, 1, 480]]])


def test_meshes_of_these_tests_are_what_they_are_meant_to_be():
    assert all(is_closed(Surface(*CAD[name])) for name in ("cylinder", "cone", "gear"))
    assert not is_closed(Surface(*CAD["soup"]))


def test_on_a_meshset_such_vertices_stay_or_are_refused_by_number():
    V, F = rough(torus(24, 20), 0.1)
    for name in ("apply_coord_spectral_smoothing", "apply_coord_spectral_denoising"):
        ms = pymeshlab.MeshSet(verbose=False)
        ms.add_mesh(pymeshlab.Mesh(np.r_[V, [[np.nan, 0, 0]]], F))
        report = getattr(mss, name)(ms)
        assert "1 vertices that no face uses are not finite" in report["warning"]
        assert np.isfinite(ms.current_mesh().vertex_matrix()[:480]).all()
        assert (ms.current_mesh().vertex_matrix()[:480] != V).any()
    for name, bad in (("apply_coord_spectral_smoothing", np.inf), ("compute_scalar_by_spectral_displacement", np.nan)):
        ms = pymeshlab.MeshSet(verbose=False)
        ms.add_mesh(pymeshlab.Mesh(np.r_[V, [[bad, 0, 0]]], F))
        with pytest.raises(mss.MeshSetError, match=r"vertex 480 is not finite.*remove vertices that no face uses"):
            getattr(mss, name)(ms)
        assert np.array_equal(ms.current_mesh().vertex_matrix()[:480], V)

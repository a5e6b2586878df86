"""The weight of least estimated error, where none is given."""

import numpy as np
import pytest

import meshlab_specsmooth as mss
from meshlab_specsmooth.geometry.surface import face_vectors, vertex_normals
from meshlab_specsmooth.noise.estimate import estimate
from meshlab_specsmooth.operators.assemble import assemble_surface
from meshlab_specsmooth.operators.patches import draw_patches, find_interior
from meshlab_specsmooth.risk.choose_weight import CandidateLowPass, search_weight
from meshlab_specsmooth.spectral.response import heat
from tests.meshes import edge_of, impulses, kinds_of_noise, noisy, remeshed_box, sheet, torus

TORUS, BOX = torus(80, 40), remeshed_box()
NORMALS = vertex_normals(mss.Surface(*TORUS))
WEIGHTS = (3.0, 1.5, 1.0, 0.7, 0.5, 0.35, 0.25, 0.18, 0.12, 0.08, 0.05, 0.03)
BOTH = pytest.mark.parametrize("clean", [TORUS, BOX], ids=["torus", "box"])


def across(vertices, clean):
    """Root mean square error along the true normals, in edges."""
    n = vertex_normals(mss.Surface(*clean))
    return np.sqrt((((vertices - clean[0]) * n).sum(axis=1) ** 2).mean()) / edge_of(*clean)


def turned(vertices, clean):
    """Mean angle between normals of faces, in degrees."""
    a, b = (face_vectors(mss.Surface(V, clean[1])) for V in (vertices, clean[0]))
    cosine = (a * b).sum(axis=1) / np.linalg.norm(a, axis=1) / np.linalg.norm(b, axis=1)
    return np.degrees(np.arccos(np.clip(cosine, -1, 1))).mean()


@pytest.mark.no_cover
@BOTH
@pytest.mark.parametrize("level", [0.05, 0.2, 0.5])
def test_the_choice_is_nearly_the_best(clean, level):
    V, F = noisy(clean, level)
    ops = mss.assemble(V, F)
    best = [mss.smooth(ops, barycenter_weight=w).vertices for w in WEIGHTS]
    result = mss.smooth(ops)
    assert across(result.vertices, clean) < 1.15 * min(across(X, clean) for X in best)
    # the difference of two numbers of the noise's size
    estimated = result.estimated_error / edge_of(*clean)
    assert estimated == pytest.approx(across(result.vertices, clean), rel=0.35, abs=0.11 * level)


@BOTH
def test_a_clean_mesh_is_left_almost_alone(clean):
    result = mss.smooth(*clean)
    assert result.displacement < 0.02 * edge_of(*clean)
    assert result.noise.kind == "none"
    assert result.warning is None


def test_impulses_are_drawn_in_first():
    V, F = TORUS
    edge = edge_of(V, F)
    rough = V + NORMALS * (edge * impulses(np.random.default_rng(3), len(V)))[:, None]
    result = mss.smooth(rough, F)
    best = min(across(mss.smooth(rough, F, barycenter_weight=w).vertices, TORUS) for w in WEIGHTS)
    assert result.noise.kind == "impulse"
    assert across(result.vertices, TORUS) < best
    assert result.displacement == pytest.approx(np.sqrt(((result.vertices - rough) ** 2).sum(axis=1).mean()))


@pytest.mark.no_cover
def test_what_cannot_be_told_is_said():
    for kind, V in kinds_of_noise(TORUS):
        result = mss.smooth(V, TORUS[1])
        assert (result.warning is not None) == (kind == "correlated")
        assert across(result.vertices, TORUS) < 0.8 * across(V, TORUS)


def correlated_sheet():
    V, F = sheet(60, 50)
    V = V * [1, 1, 0]
    L = mss.assemble(V, F).L
    field = np.random.default_rng(7).standard_normal((len(V), 3))
    for _ in range(3):
        field -= 6 / 7 * (L @ field)
    return V + [0, 0, 0.3] * (field[:, :1] / field[:, :1].std()), F, V


@pytest.mark.no_cover
def test_a_rim_moves_across_the_surface_where_neighbors_share_the_noise():
    V, F, clean = correlated_sheet()
    result, held = mss.smooth(V, F), mss.smooth(V, F, boundary="fixed")
    rim = mss.assemble(V, F).boundary_vertices
    assert result.noise.kind == "correlated"
    assert np.array_equal(held.vertices[rim], V[rim])
    moved = result.vertices[rim] - V[rim]
    assert np.abs(moved[:, 2]).mean() > 2 * np.linalg.norm(moved[:, :2], axis=1).mean()
    assert np.abs(result.vertices[rim, 2] - clean[rim, 2]).mean() < np.abs(V[rim, 2] - clean[rim, 2]).mean()
    # with a given weight it is held
    given = mss.smooth(V, F, barycenter_weight=0.3).vertices
    assert np.array_equal(given, mss.smooth(V, F, barycenter_weight=0.3, boundary="fixed").vertices)


def test_large_meshes_are_represented_by_patches():
    clean = remeshed_box(52)
    V, F = noisy(clean, 0.2)
    ops = assemble_surface(mss.Surface(V, F))
    patches = draw_patches(ops)
    assert len(patches.vertices) < 0.8 * len(V)
    by_patches, whole = estimate(patches.ops, patches.counted), estimate(ops, find_interior(ops))
    assert by_patches.noise.level == pytest.approx(whole.noise.level, rel=0.1)
    weight, *_ = search_weight(ops, find_interior(ops), whole, CandidateLowPass(heat, 20.0))
    by_whole = mss.smooth(ops, barycenter_weight=weight, response="heat")
    assert across(mss.smooth(ops).vertices, clean) < 1.1 * across(by_whole.vertices, clean)


@pytest.mark.no_cover
def bumpy(nx, ny):
    """A torus with bumps, irregular: a random diagonal in each square."""
    V, F = torus(nx, ny)
    t, p = np.arctan2(V[:, 1], V[:, 0]), np.arctan2(V[:, 2], np.hypot(V[:, 0], V[:, 1]) - 3)
    r = 1 + 0.05 * np.cos(9 * t) * np.cos(3 * p)
    half = len(F) // 2
    (a, b, c), d = F[:half].T, F[half:, 2]
    other = (np.random.default_rng(3).random(half) < 0.5)[:, None]
    one = np.where(other, np.stack([a, b, d], axis=1), F[:half])
    two = np.where(other, np.stack([b, c, d], axis=1), F[half:])
    ring = 3 + r * np.cos(p)
    return np.stack([ring * np.cos(t), ring * np.sin(t), r * np.sin(p)], axis=1), np.concatenate([one, two])


@pytest.mark.parametrize("make", [torus, bumpy])
def test_what_is_sampled_more_densely_comes_out_better(make):
    angles, errors = [], []
    for n in (1, 2, 4):
        clean = make(80 * n, 50 * n)
        result = mss.smooth(*noisy(clean, 0.2)).vertices
        angles.append(turned(result, clean))
        errors.append(across(result, clean) * edge_of(*clean))
    assert errors[2] < 0.6 * errors[1] < 0.6 * 0.6 * errors[0]
    if make is bumpy:
        assert angles[2] < 0.6 * angles[1] < 0.6 * 0.6 * angles[0]
    else:  # nothing is left but the noise in waves of more than 20 edges, which are kept at any density
        assert max(angles) < 0.4


def test_at_any_size_the_weight_is_that_of_the_least_error():
    clean = bumpy(440, 275)  # more than are searched thoroughly
    ops = mss.assemble(*noisy(clean, 0.2))
    result = mss.smooth(ops)
    assert result.barycenter_weight < 0.2  # a first guess is 0.35
    weights = (0.5, 0.35, 0.25, 0.18, 0.12, 0.09, 0.06, 0.045, 0.03, 0.02)
    best = [mss.smooth(ops, barycenter_weight=w).vertices for w in weights]
    assert across(result.vertices, clean) < 1.05 * min(across(X, clean) for X in best)


def test_the_choice_scales_and_repeats_to_the_bit():
    V, F = noisy(TORUS, 0.2)
    one, again, scaled = mss.smooth(V, F), mss.smooth(V, F), mss.smooth(V * 2.0**20, F)
    assert np.array_equal(one.vertices, again.vertices)
    assert np.array_equal(scaled.vertices, one.vertices * 2.0**20)
    assert scaled.noise.level == one.noise.level * 2.0**20
    assert scaled.estimated_error == one.estimated_error * 2.0**20


def test_a_given_weight_is_taken_and_nothing_is_measured():
    V, F = noisy(torus(), 0.2)
    result = mss.smooth(V, F, barycenter_weight=0.5)
    assert (result.barycenter_weight, result.noise, result.estimated_error, result.warning) == (0.5, None, None, None)

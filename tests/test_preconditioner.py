"""The polynomials that stand for the inverse of the normal matrix."""

import numpy as np
import pytest

import meshlab_specsmooth as mss
from meshlab_specsmooth.graph import adjacency_numba, adjacency_scipy
from meshlab_specsmooth.operators.boundary import extend_to_boundary
from meshlab_specsmooth.operators.preconditioner import MAX_WEIGHT, design_inverse, precondition
from meshlab_specsmooth.runtime.workspace import Workspace
from meshlab_specsmooth.spectral.chebyshev import ChebyshevSeries, approximate
from meshlab_specsmooth.spectral.response import RESPONSES, response
from tests.meshes import TETRAHEDRON, box, rough, sheet, together, torus

IRREGULAR = rough(torus(24, 15))


@pytest.mark.parametrize("valence", [4.0, 6.0, 9.0])
@pytest.mark.parametrize("weight", [1e-4, 0.003, 0.02, 0.1, 0.4, 1.0])
def test_the_polynomial_is_positive_and_inverts_to_a_third(weight, valence):
    series = ChebyshevSeries(design_inverse(weight, 1 / valence), 0.0)
    x = 1 - np.cos(np.linspace(0, np.pi, 20_001))
    a = x**2 / valence + weight**2 * (3 - 2 * x) / 9
    assert np.abs(1 - a * series(x)).max() < 0.31
    assert series(x).min() > 0
    assert series.degree < 4 * max(1.0, (valence / 6) ** 0.25) / np.sqrt(weight) + 3


@pytest.mark.parametrize("free", [None, (np.arange(24 * 15) % 5 > 0).astype(float)[:, None]], ids=["free", "held"])
@pytest.mark.parametrize("highest", [0.05, 0.6, 20.0])
def test_a_weight_that_differs_leaves_it_symmetric_and_positive(highest, free):
    L = mss.assemble(*IRREGULAR).L
    weight = np.geomspace(0.05, highest, L.size)[:, None]
    M = precondition(L, weight**2 * L.degree / 9, is_uniform=False, free=free)
    moving = np.ones((L.size, 1)) if free is None else free
    assert len(M.series) == (1 if highest == 0.05 else 1 + int(np.ceil(np.log2(min(highest, 1.4) / 0.05))))
    work = Workspace()
    columns = [np.repeat(column[:, None], 3, axis=1) for column in (np.eye(L.size) * moving).T]
    matrix = L.degree * np.stack([M.apply(column, work)[:, 0] for column in columns], axis=1)
    assert matrix == pytest.approx(matrix.T, abs=1e-12 * np.abs(matrix).max())
    assert not matrix[moving[:, 0] == 0].any()
    inside = matrix[moving[:, 0] > 0][:, moving[:, 0] > 0]
    assert np.linalg.eigvalsh(inside).min() > 0


def test_where_it_does_not_suit_the_diagonal_is_used():
    for kind, weight, suits in (
        ("uniform", 0.3, True),
        ("uniform", 1.01 * MAX_WEIGHT, False),
        ("cotangent", 0.3, False),
    ):
        ops = mss.assemble(*IRREGULAR, laplacian=kind)
        found = precondition(ops.L, weight**2 * ops.gram.diagonal, is_uniform=True, free=None)
        assert (found is not None) == suits


@pytest.mark.parametrize("weight", [1.0, 0.3, 0.05, 0.02, 0.01])
@pytest.mark.parametrize("mesh", [IRREGULAR, rough(sheet(30, 25))], ids=["closed", "open"])
def test_any_weight_takes_a_few_iterations(mesh, weight):
    result = mss.smooth(*mesh, barycenter_weight=weight, method="chebyshev")
    assert sum(result.cg_iterations) <= 5
    assert 0 < result.displacement_error <= mss.Smoothing().tolerance
    exact = mss.smooth(*mesh, barycenter_weight=weight, method="chebyshev", tolerance=1e-8)
    assert exact.displacement_error <= 1e-8
    apart = np.sqrt(((result.vertices - exact.vertices) ** 2).sum(axis=1).mean())
    assert 0 < apart < 3 * mss.Smoothing().tolerance * exact.displacement


@pytest.mark.parametrize(("highest", "most"), [(0.5, 5), (10.0, 30)])
def test_a_weight_that_differs_over_the_surface_takes_a_few_more(highest, most):
    V, F = rough(torus(60, 40))
    share = (V[:, 0] - V[:, 0].min()) / np.ptp(V[:, 0])
    result = mss.smooth(V, F, barycenter_weight=0.05 * (highest / 0.05) ** share)
    assert sum(result.cg_iterations) <= most


def test_with_and_without_a_weight_the_response_is_the_same_unless_a_cutoff_is_given():
    given = {"barycenter_weight": 0.3}
    assert mss.smooth(*IRREGULAR, **given).response.startswith("heat")
    assert mss.smooth(*IRREGULAR, **given, modes=20).response.startswith("ideal")
    assert mss.smooth(*IRREGULAR, **given, response="ideal").response.startswith("ideal")


@pytest.mark.parametrize("name", RESPONSES)
def test_a_series_is_its_value_at_zero_and_lambda_times_another(name):
    series = approximate(response(name, 0.2), 1e-3)
    constant, divided = series.divide()
    x = np.linspace(0, 2, 101)
    assert constant + x * divided(x) == pytest.approx(series(x), abs=1e-12)
    assert divided.degree == series.degree - 1
    constant, divided = ChebyshevSeries(np.array([0.7]), 0.0).divide()
    assert (constant, divided(np.ones(1))[0]) == (0.7, 0.0)


def test_at_a_boundary_differential_coordinates_are_those_next_to_it():
    ops = mss.assemble(*sheet(9, 7))
    L, at = ops.L, ops.boundary_vertices
    delta = np.random.default_rng(2).standard_normal((L.size, 3))
    expected = delta.copy()
    neighbors = L.graph.adjacency().toarray() > 0
    for i in at:
        inner = [j for j in np.flatnonzero(neighbors[i]) if j not in at]
        expected[i] = delta[inner].mean(axis=0) if inner else 0.0
    extend_to_boundary(L, delta, at)
    assert delta == pytest.approx(expected)


@pytest.mark.parametrize("weight", [0.3, 0.03])
def test_a_curved_surface_is_not_flattened_at_a_boundary_that_is_held(weight):
    angle, along = np.meshgrid(np.linspace(0, 2, 60), np.linspace(0, 2, 60), indexing="ij")
    V = np.stack([np.cos(angle), np.sin(angle), along], axis=-1).reshape(-1, 3)
    _, F = sheet(60, 60)
    result = mss.smooth(V, F, barycenter_weight=weight)
    off = np.hypot(result.vertices[:, 0], result.vertices[:, 1]) - 1
    assert np.abs(off).max() < 0.15 * result.mean_edge


@pytest.mark.parametrize("mesh", [IRREGULAR, TETRAHEDRON, together(rough(sheet()), TETRAHEDRON, box(3), TETRAHEDRON)])
def test_components_are_the_same_compiled(mesh):
    graph = mss.assemble(*mesh).L.graph
    (count, labels), (expected, reference) = (
        module.label_components(graph) for module in (adjacency_numba, adjacency_scipy)
    )
    assert count == expected == labels.max() + 1
    assert np.array_equal(labels, reference)
    assert labels[0] == 0


def test_where_there_are_no_edges_denoising_takes_the_isotropic_road():
    V, F = rough(torus(160, 100))
    smooth = mss.denoise(V, F)
    assert smooth.iterations == 0
    assert 0 < smooth.barycenter_weight < 0.12  # less than the least of a guide
    assert mss.denoise(*rough(box(20))).iterations > 0

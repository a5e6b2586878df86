import numpy as np
import pytest

import meshlab_specsmooth as mss
from meshlab_specsmooth.graph.build import mesh_graph
from meshlab_specsmooth.operators.barycenters import (
    barycenters,
    gram_of_barycenters,
    weighted_gram_of_barycenters,
)
from meshlab_specsmooth.operators.laplacians import laplacian_of_kind
from tests.meshes import TETRAHEDRON, TRIANGLE, flaws, rough, sheet, torus, torus_eigenvalue, torus_graph, wave


def build(mesh, kind="uniform"):
    surface = mss.Surface(*mesh)
    graph = mesh_graph(surface.faces, len(surface.vertices))
    return laplacian_of_kind(kind, graph, surface.vertices, surface.faces)


def dense(L):
    return L @ np.eye(L.size)


MESHES = {"triangle": TRIANGLE, "tetrahedron": TETRAHEDRON, "sheet": rough(sheet()), "torus": rough(torus(12, 8), 0.4)}
MESHES |= {
    f"sheet with {name}": mesh for name, mesh in flaws(sheet(5, 4)).items() if not name.startswith(("un", "a v"))
}
EVERY_MESH = pytest.mark.parametrize("mesh", MESHES.values(), ids=MESHES)
EVERY_KIND = pytest.mark.parametrize("kind", ["uniform", "cotangent"])


def test_the_uniform_laplacian_of_a_sheet_by_hand():
    L = dense(build(sheet(2, 2)))  # two triangles: 0 and 3 have three neighbors, 1 and 2 have two
    assert L == pytest.approx(
        np.array(
            [[1, -1 / 3, -1 / 3, -1 / 3], [-1 / 2, 1, 0, -1 / 2], [-1 / 2, 0, 1, -1 / 2], [-1 / 3, -1 / 3, -1 / 3, 1]]
        )
    )


def test_the_cotangent_weights_of_a_triangle_are_the_cotangents_of_its_angles():
    L = dense(build(TRIANGLE, "cotangent"))  # legs 3 and 4: cot of the acute angles are 3/4 and 4/3, of the right one 0
    facing_0_1, facing_0_2, facing_1_2 = 4 / 3 / 1, 3 / 4, np.tan(np.radians(1))
    at_2 = 4 / 3  # angle at vertex 2 has opposite side 3 and adjacent 4
    assert facing_0_1 == at_2
    assert L[0, 1] / L[0, 2] == pytest.approx(facing_0_1 / facing_0_2)
    assert L[1, 2] / L[1, 0] == pytest.approx(facing_1_2 / facing_0_1)


@pytest.mark.parametrize(
    ("degrees", "counts_as"), [(0.0, 1.0), (1e-9, 1.0), (0.01, 1.0), (0.99, 1.0), (1.01, 1.01), (3.0, 3.0)]
)
def test_no_angle_of_a_sliver_counts_as_sharper_than_one_degree(degrees, counts_as):
    height = np.tan(np.radians(degrees)) / 2
    sliver = (np.array([[0.0, 0, 0], [1, 0, 0], [0.5, height, 0]]), np.array([[0, 1, 2]]))
    L = dense(build(sliver, "cotangent"))
    long, short = np.tan(np.radians(1)), 1 / np.tan(np.radians(counts_as))  # the obtuse angle faces the long edge
    assert L[0, 1] / L[0, 2] == pytest.approx(long / short)
    assert L[2] == pytest.approx(np.array([-0.5, -0.5, 1]))


@pytest.mark.no_cover
@EVERY_MESH
@EVERY_KIND
def test_l_takes_constants_to_zero_and_its_twin_is_symmetric_with_spectrum_in_0_2(mesh, kind):
    L = build(mesh, kind)
    assert abs(L @ np.ones((L.size, 2))).max() < 1e-14
    S = L.graph.symmetric_laplacian().toarray()
    assert np.array_equal(S, S.T)
    values = np.linalg.eigvalsh(S)
    assert values[0] > -1e-14
    assert values[-1] < 2 + 1e-14
    assert values == pytest.approx(np.sort(np.linalg.eigvals(dense(L)).real), abs=1e-7)


def test_the_spectrum_of_a_regular_torus_is_known():
    nx, ny = 9, 7
    mesh = (np.random.default_rng(0).standard_normal((nx * ny, 3)), torus_graph(nx, ny))
    L = build(mesh)
    known = sorted(torus_eigenvalue(p, q, nx, ny) for p in range(nx) for q in range(ny))
    assert np.linalg.eigvalsh(L.graph.symmetric_laplacian().toarray()) == pytest.approx(known, abs=1e-12)
    x = wave(2, 1, nx, ny)[:, None]
    assert L @ x == pytest.approx(torus_eigenvalue(2, 1, nx, ny) * x)


def test_cotangent_weights_see_through_a_stretched_grid_where_uniform_ones_do_not():
    V, F = sheet(9, 7)
    i, j = V[:, 0].copy(), V[:, 1].copy()
    y = 0.5 * j + 0.08 * j**2
    V = np.stack([i - 0.4 * y, y, np.zeros(len(V))], axis=1)  # flat, with acute triangles of many sizes
    inside = (i > 0) & (i < 8) & (j > 0) & (j < 6)
    drift = {kind: abs((build((V, F), kind) @ V)[inside]).max() for kind in ("uniform", "cotangent")}
    assert drift["cotangent"] < 1e-12 < 0.01 < drift["uniform"]


def test_barycenters_are_the_means_of_the_corners():
    V, F = rough(torus(8, 6))
    C = barycenters(F, len(V))
    assert C @ V == pytest.approx(V[F].mean(axis=1))
    assert C.nnz == 3 * len(F)


@EVERY_MESH
def test_the_gram_matrix_of_the_barycenters_needs_no_matrix(mesh):
    V, F = mesh
    graph = mesh_graph(F.astype(np.int32), len(V))
    gram = gram_of_barycenters(graph)
    C = barycenters(F, len(V))
    whole = (
        np.diag(gram.diagonal[:, 0]) + gram.regular_edge * graph.graph.adjacency().toarray() + gram.irregular.toarray()
    )
    assert whole == pytest.approx((C.T @ C).toarray())


@pytest.mark.parametrize("mesh", MESHES.values(), ids=MESHES)
def test_barycenters_may_weigh_differently_from_face_to_face(mesh):
    V, F = mesh
    weights = np.random.default_rng(1).uniform(0.1, 10, len(F))
    gram = weighted_gram_of_barycenters(np.asarray(F, dtype=np.int32), len(V), weights)
    assert gram.regular_edge == 0
    C = np.diag(weights) @ barycenters(F, len(V)).toarray()
    assert np.diag(gram.diagonal[:, 0]) + gram.irregular.toarray() == pytest.approx(C.T @ C)

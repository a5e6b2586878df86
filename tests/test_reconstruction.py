import numpy as np
import pytest

import meshlab_specsmooth as mss
from meshlab_specsmooth.graph.build import mesh_graph
from meshlab_specsmooth.operators import reconstruction
from meshlab_specsmooth.operators.barycenters import barycenters, gram_of_barycenters
from meshlab_specsmooth.operators.laplacians import laplacian_of_kind
from meshlab_specsmooth.operators.reconstruction import Constraints
from meshlab_specsmooth.runtime.workspace import Workspace
from tests.meshes import TETRAHEDRON, rough, sheet, together, torus

MESHES = {
    "open": rough(sheet(9, 7)),
    "closed": rough(torus(9, 8)),
    "components": together(rough(sheet(5, 4)), TETRAHEDRON),
}


EVERY_MESH = pytest.mark.parametrize("mesh", MESHES.values(), ids=MESHES)
EVERY_WEIGHT = pytest.mark.parametrize("weight", [0.03, 1.0, 30.0])


def system(mesh, kind="uniform"):
    V, F = mesh[0], mesh[1].astype(np.int32)
    graph = mesh_graph(F, len(V))
    return laplacian_of_kind(kind, graph, V, F), gram_of_barycenters(graph), barycenters(F, len(V)).toarray()


def random(n, seed=3):
    return np.random.default_rng(seed).standard_normal((n, 3))


def least_squares(L, C, weight, change, constraints):
    """Dense reference: the displacement, and the normal equations A x = b of the free vertices."""
    free, rows = constraints.free[:, 0] == 1, constraints.rows[:, 0] == 1
    stacked = np.vstack([(L @ np.eye(len(free)))[rows], weight * C])
    wanted = np.vstack([change[rows], np.zeros((len(C), 3))]) - stacked[:, ~free] @ constraints.prescribed[~free]
    displacement = constraints.prescribed.copy()
    A, b = stacked[:, free].T @ stacked[:, free], stacked[:, free].T @ wanted
    displacement[free] = np.linalg.solve(A, b)
    return displacement, A, b


def some_held(n):
    """Every third vertex has a displacement prescribed, and every other row of these is left out."""
    free, rows = np.ones((n, 1)), np.ones((n, 1))
    free[::3], rows[::6] = 0, 0
    return Constraints(free, rows, np.where(free, 0, random(n, seed=5)))


def held_boundary(n):
    """The first tenth of the vertices stays, without equations of their own."""
    free = (np.arange(n) >= n // 10).astype(float)[:, None]
    return Constraints(free, free.copy(), np.zeros((n, 3)))


def nothing_held(n):
    return Constraints(np.ones((n, 1)), np.ones((n, 1)), np.zeros((n, 3)))


@pytest.mark.no_cover
@EVERY_MESH
@EVERY_WEIGHT
@pytest.mark.parametrize("kind", ["uniform", "cotangent"])
@pytest.mark.parametrize("held", [None, nothing_held, some_held], ids=["unconstrained", "nothing held", "some held"])
@pytest.mark.parametrize("rtol", [3e-3, 1e-8])
def test_the_displacement_is_the_least_squares_solution_and_the_residual_is_its_own(mesh, weight, kind, held, rtol):
    L, gram, C = system(mesh, kind)
    n = L.size
    change = random(n)
    constraints = held and held(n)
    solution = reconstruction.solve(L, gram, weight, change, constraints=constraints, rtol=rtol)
    reference = constraints or nothing_held(n)
    expected, A, b = least_squares(L, C, weight, change, reference)
    free = reference.free[:, 0] == 1
    # the error is an estimate: within a factor of five
    assert distance(L, solution.displacement, expected, free) < 5 * rtol
    assert solution.error <= rtol
    left, size = (np.sqrt((x**2 / L.degree[free]).sum()) for x in (A @ solution.displacement[free] - b, b))
    assert solution.residual == pytest.approx(left / size, rel=1e-2, abs=1e-13)
    assert solution.iterations > 0


def distance(L, x, expected, free):
    """Of the displacements of free vertices, relative, in the norm of D."""
    weights = L.degree[free]
    return np.sqrt((weights * (x - expected)[free] ** 2).sum() / (weights * expected[free] ** 2).sum())


def uneven(n, sides):
    """A noisy cylinder with lids that are fans, whose centers have many neighbors."""
    angle = 2 * np.pi * np.arange(sides) / sides
    V = [[np.cos(t), np.sin(t), 0.3 * z] for z in range(n) for t in angle] + [[0, 0, 0], [0, 0, 0.3 * (n - 1)]]
    F = []
    for z in range(n - 1):
        for i in range(sides):
            a, b = z * sides + i, z * sides + (i + 1) % sides
            F += [[a, b, b + sides], [a, b + sides, a + sides]]
    last = (n - 1) * sides
    for i in range(sides):
        F += [[i, n * sides, (i + 1) % sides], [last + i, last + (i + 1) % sides, n * sides + 1]]
    return rough((np.array(V), np.array(F)))


def subdivided(mesh):
    """Every face in three at its center: valences 3 and 12."""
    V, F = mesh
    centers = len(V) + np.arange(len(F))
    parts = [np.stack([F[:, k], F[:, (k + 1) % 3], centers], axis=1) for k in range(3)]
    return rough((np.concatenate([V, V[F].mean(axis=1)]), np.concatenate(parts)))


def non_manifold(mesh):
    """Edges with three and more faces."""
    V, F = mesh
    return V, np.concatenate([F, np.stack([F[:40, 0], F[:40, 1], F[40:80, 2]], axis=1), F[:5], F[:5]])


HARD = {
    "irregular": rough(torus(20, 16)),
    "open": rough(sheet(18, 17)),
    "fans of 60": uneven(5, 60),
    "valences 3 and 12": subdivided(torus(12, 10)),
    "not manifold": non_manifold(rough(torus(18, 16))),
    "components": together(rough(sheet(12, 11)), rough(torus(14, 12))),
}


@pytest.mark.parametrize("mesh", HARD.values(), ids=HARD)
@pytest.mark.parametrize("weight", [0.35, 0.1, 0.03, 0.01])
@pytest.mark.parametrize("held", [None, some_held, held_boundary], ids=["free", "some held", "boundary held"])
def test_the_error_that_is_stated_is_that_of_a_direct_solve(mesh, weight, held):
    L, gram, C = system(mesh)
    constraints = held and held(L.size)
    reference = constraints or nothing_held(L.size)
    change = L @ mesh[0]
    expected, *_ = least_squares(L, C, weight, -change, reference)
    solution = reconstruction.solve(L, gram, weight, -change, constraints=constraints)
    error = distance(L, solution.displacement, expected, reference.free[:, 0] == 1)
    assert error < 4 * reconstruction.TOLERANCE
    assert solution.error <= reconstruction.TOLERANCE


@pytest.mark.parametrize("held", [None, some_held])
def test_from_a_displacement_nearby_fewer_iterations_lead_to_the_same(held):
    L, gram, _ = system(MESHES["open"])
    change = random(L.size)
    constraints = held and held(L.size)
    first = reconstruction.solve(L, gram, 0.5, change, constraints=constraints)
    start = first.displacement + 1e-3 * abs(first.displacement).max() * random(L.size, seed=7)
    kept = start.copy()
    again = reconstruction.solve(L, gram, 0.5, change, constraints=constraints, start=start)
    assert 0 < again.iterations < first.iterations
    assert again.error <= reconstruction.TOLERANCE
    assert again.displacement == pytest.approx(first.displacement, abs=5e-3 * abs(first.displacement).max())
    assert np.array_equal(start, kept)


def test_the_content_of_a_workspace_does_not_matter():
    L, gram, _ = system(MESHES["open"])
    expected = reconstruction.solve(L, gram, 0.5, random(L.size)).displacement
    for count in range(8):
        workspace = Workspace()
        workspace.give_back(*(np.full((L.size, 3), np.nan) for _ in range(count)))
        change = random(L.size)
        solution = reconstruction.solve(L, gram, 0.5, change, workspace=workspace, overwrite_input=True)
        assert np.array_equal(solution.displacement, expected)
        assert not any(workspace.borrow(change) is solution.displacement for _ in range(len(workspace)))


def test_the_change_is_kept_unless_it_may_be_overwritten():
    L, gram, _ = system(MESHES["open"])
    change = random(L.size)
    reconstruction.solve(L, gram, 0.5, change, workspace=Workspace())
    assert np.array_equal(change, random(L.size))


def test_prescribed_displacements_are_kept_to_the_bit():
    L, gram, _ = system(MESHES["open"])
    n = L.size
    some = some_held(n)
    held = some.free[:, 0] == 0
    assert np.array_equal(
        reconstruction.solve(L, gram, 0.3, random(n), constraints=some).displacement[held], some.prescribed[held]
    )
    every = Constraints(np.zeros((n, 1)), np.ones((n, 1)), random(n, seed=5))
    solution = reconstruction.solve(L, gram, 0.3, random(n), constraints=every)
    assert np.array_equal(solution.displacement, every.prescribed)
    assert (solution.iterations, solution.residual) == (0, 0.0)


def test_columns_that_need_nothing_are_left_alone():
    L, gram, _ = system(MESHES["open"])
    change = np.zeros((L.size, 3))
    nothing = reconstruction.solve(L, gram, 1.0, change)
    assert not nothing.displacement.any()
    assert (nothing.iterations, nothing.residual) == (0, 0.0)
    change[:, 1] = random(len(change))[:, 0]
    one = reconstruction.solve(L, gram, 1.0, change).displacement
    assert one[:, 1].any()
    assert not one[:, [0, 2]].any()


def test_progress_is_reported_each_iteration_and_rises_to_the_end():
    L, gram, _ = system(MESHES["closed"])
    seen = []
    # a change as smooth as the surface, at a small weight: the residual grows before it falls
    solution = reconstruction.solve(L, gram, 0.01, MESHES["closed"][0], seen.append, rtol=1e-9)
    assert len(seen) == solution.iterations - 1
    quarters = [float(np.mean(part)) for part in np.array_split(seen, 4)]
    assert quarters == sorted(set(quarters))
    assert seen[0] == 0
    assert seen[-1] > 0.6
    assert min(seen) == 0


def test_an_iteration_that_does_not_converge_reports_its_residual(monkeypatch):
    monkeypatch.setattr(reconstruction, "MAX_ITERATIONS", 2)
    L, gram, _ = system(MESHES["closed"])
    with pytest.raises(mss.NotConverged, match=r"error of \d\.\de.* after 2 iterations .* raise barycenter_weight"):
        reconstruction.solve(L, gram, 0.01, np.random.default_rng(0).standard_normal((L.size, 3)))

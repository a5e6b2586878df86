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
    displacement[free], *_ = np.linalg.lstsq(stacked[:, free], wanted, rcond=None)
    return displacement, stacked[:, free].T @ stacked[:, free], stacked[:, free].T @ wanted


def some_held(n):
    """Every third vertex has a displacement prescribed, and every fourth row is left out."""
    free, rows = np.ones((n, 1)), np.ones((n, 1))
    free[::3], rows[1::4] = 0, 0
    return Constraints(free, rows, np.where(free, 0, random(n, seed=5)))


def nothing_held(n):
    return Constraints(np.ones((n, 1)), np.ones((n, 1)), np.zeros((n, 3)))


@pytest.mark.no_cover
@EVERY_MESH
@EVERY_WEIGHT
@pytest.mark.parametrize("kind", ["uniform", "cotangent"])
@pytest.mark.parametrize("held", [None, nothing_held, some_held], ids=["unconstrained", "nothing held", "some held"])
def test_the_displacement_is_the_least_squares_solution_and_the_residual_is_its_own(mesh, weight, kind, held):
    L, gram, C = system(mesh, kind)
    n = L.size
    change = random(n)
    constraints = held and held(n)
    solution = reconstruction.solve(L, gram, weight, change, constraints=constraints)
    reference = constraints or nothing_held(n)
    expected, A, b = least_squares(L, C, weight, change, reference)
    # what a residual of TOLERANCE leaves of an error, with the normal equations' condition
    close = 2 * reconstruction.tolerance(weight) * np.linalg.cond(A) * np.linalg.norm(expected, axis=0).max()
    assert solution.displacement == pytest.approx(expected, abs=close)
    free = reference.free[:, 0] == 1
    left = np.linalg.norm(A @ solution.displacement[free] - b, axis=0) / np.linalg.norm(b, axis=0)
    assert left.max() < 2 * reconstruction.tolerance(weight)
    assert solution.residual == pytest.approx(left.max(), rel=1e-3)
    assert solution.iterations > 0


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
    assert again.residual < 2 * reconstruction.tolerance(0.5)
    assert again.displacement == pytest.approx(first.displacement, abs=1e-3 * abs(first.displacement).max())
    assert np.array_equal(start, kept)


def test_the_content_of_a_workspace_does_not_matter():
    L, gram, _ = system(MESHES["open"])
    expected = reconstruction.solve(L, gram, 0.5, random(L.size)).displacement
    for count in range(8):
        workspace = Workspace()
        workspace.give_back(*(np.full((L.size, 3), np.nan) for _ in range(count)))
        change = random(L.size)
        solution = reconstruction.solve(L, gram, 0.5, change, workspace=workspace, overwrite_change=True)
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
    change[:, 2] = 1e-20 * random(len(change))[:, 1]  # rounding, beside the column before
    one = reconstruction.solve(L, gram, 1.0, change).displacement
    assert one[:, 1].any()
    assert not one[:, [0, 2]].any()


def test_progress_is_reported_each_iteration_and_rises_to_the_end():
    L, gram, _ = system(MESHES["closed"])
    seen = []
    # a change as smooth as the surface, at a small weight: the residual grows before it falls
    solution = reconstruction.solve(L, gram, 0.01, MESHES["closed"][0], seen.append)
    assert len(seen) == solution.iterations
    quarters = [float(np.mean(part)) for part in np.array_split(seen, 4)]
    assert quarters == sorted(set(quarters))
    assert seen[0] == 0
    assert seen[-1] > 0.6
    assert min(seen) == 0


def test_an_iteration_that_does_not_converge_reports_its_residual(monkeypatch):
    monkeypatch.setattr(reconstruction, "MAX_ITERATIONS", 3)
    L, gram, _ = system(MESHES["closed"])
    with pytest.raises(mss.NotConverged, match=r"residual of \d\.\de.* after 3 iterations .* raise barycenter_weight"):
        reconstruction.solve(L, gram, 0.01, np.random.default_rng(0).standard_normal((L.size, 3)))

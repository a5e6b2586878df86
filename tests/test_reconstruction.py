import numpy as np
import pytest

import meshlab_specsmooth as mss
from meshlab_specsmooth import reconstruction
from meshlab_specsmooth.operators import barycenters, laplacian
from meshlab_specsmooth.surface import edges
from tests.meshes import TETRAHEDRON, rough, sheet, together, torus

MESHES = {
    "open": rough(sheet()),
    "closed": rough(torus(12, 9)),
    "components": together(rough(sheet(5, 4)), TETRAHEDRON),
}


def system(mesh):
    surface = mss.Surface(*mesh)
    C = barycenters(surface)
    return laplacian(surface, edges(surface)[0]), (C.T @ C).tocsr(), C.toarray()


@pytest.mark.parametrize("mesh", MESHES.values(), ids=MESHES)
@pytest.mark.parametrize("weight", [0.03, 0.3, 1.0, 30.0])
def test_the_displacement_is_the_least_squares_solution(mesh, weight):
    L, gram, C = system(mesh)
    n = len(L.root_degree)
    change = np.random.default_rng(3).standard_normal((n, 3))
    solution = reconstruction.solve(L, gram, weight, change)
    stacked = np.vstack([L @ np.eye(n), weight * C])
    expected, *_ = np.linalg.lstsq(stacked, np.vstack([change, np.zeros((len(C), 3))]), rcond=None)
    assert solution.displacement == pytest.approx(expected, abs=1e-6 * abs(expected).max() / min(weight, 1) ** 2)
    assert solution.residual < 2 * reconstruction.TOLERANCE
    assert solution.iterations > 0


def test_columns_that_need_nothing_are_left_alone():
    L, gram, _ = system(MESHES["open"])
    change = np.zeros((len(L.root_degree), 3))
    nothing = reconstruction.solve(L, gram, 1.0, change)
    assert not nothing.displacement.any()
    assert (nothing.iterations, nothing.residual) == (0, 0.0)
    change[:, 1] = np.random.default_rng(0).standard_normal(len(change))
    one = reconstruction.solve(L, gram, 1.0, change).displacement
    assert one[:, 1].any()
    assert not one[:, [0, 2]].any()


def test_progress_rises_to_the_end():
    L, gram, _ = system(MESHES["closed"])
    seen = []
    reconstruction.solve(L, gram, 0.1, np.random.default_rng(0).standard_normal((len(L.root_degree), 3)), seen.append)
    assert seen[0] == 0
    assert seen[-1] > 0.8
    assert max(seen) <= 1


def test_an_iteration_that_does_not_end_says_where_it_stands(monkeypatch):
    monkeypatch.setattr(reconstruction, "MOST_ITERATIONS", 3)
    L, gram, _ = system(MESHES["closed"])
    with pytest.raises(mss.NotConverged, match=r"residual of \d\.\de.* after 3 iterations .* raise barycenter_weight"):
        reconstruction.solve(L, gram, 0.01, np.random.default_rng(0).standard_normal((len(L.root_degree), 3)))

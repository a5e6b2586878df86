import numpy as np
import pytest
from scipy.sparse import csr_array, eye_array

import meshlab_specsmooth as mss
from meshlab_specsmooth.spectral import density, inertia
from meshlab_specsmooth.spectral.cutoff import WEYL, Cutoff, from_wavelength
from tests.meshes import TETRAHEDRON, rough, sheet, together, torus, torus_graph, torus_spectrum, twin, uniform


def flat_torus(nx, ny):
    return twin((np.zeros((nx * ny, 3)), torus_graph(nx, ny))), torus_spectrum(nx, ny)


MESHES = [rough(sheet(24, 17)), together(torus(24, 12), TETRAHEDRON, sheet(5, 4)), TETRAHEDRON]


@pytest.mark.parametrize("mesh", MESHES)
def test_the_count_is_that_of_the_dense_eigenvalues_in_every_gap(mesh):
    S = twin(mesh)
    known = np.linalg.eigvalsh(S.toarray())
    gaps = np.flatnonzero(np.diff(known) > 1e-6)
    for i in gaps[:: max(1, len(gaps) // 60)]:
        assert inertia.count_below(S, (known[i] + known[i + 1]) / 2) == i + 1


def test_the_count_jumps_by_the_multiplicity():
    S, known = flat_torus(40, 40)
    i = 97  # the first of twelve
    assert known[i + 11] - known[i] < 1e-12
    for near in (1e-9, 1e-7):
        assert inertia.count_below(S, known[i] - near) == i
        assert inertia.count_below(S, known[i] + near) == i + 12


def test_a_value_that_is_an_eigenvalue_counts_as_just_below_or_just_above():
    S = csr_array(np.diag([0.0, 0.25, 0.25, 1.0, 2.0]))  # pivots of exactly zero
    assert inertia.count_below(S, 0.25) == 3
    assert inertia.count_below(S, 1.0) == 4
    S, known = flat_torus(12, 12)
    assert inertia.count_below(S, known[20]) in range(
        (known < known[20] - 1e-9).sum(), (known < known[20] + 1e-9).sum() + 1
    )


def test_beyond_the_spectrum():
    S, _ = flat_torus(5, 4)
    assert [inertia.count_below(S, x) for x in (-1.0, 0.0, 2.5)] == [0, 0, 20]


def test_where_no_factorization_is_sound_it_says_so(monkeypatch):
    monkeypatch.setattr(inertia, "_MAX_GROWTH", 1e-3)
    with pytest.raises(mss.NotConverged, match=r"below 0\.3 cannot be counted"):
        inertia.count_below(flat_torus(5, 4)[0], 0.3)


def test_rows_exchanged_around_a_zero_pivot_are_not_counted():
    S = csr_array(np.array([[1.0, -1.0], [-1.0, 1.0]]))  # S - I has a zero diagonal: eigenvalues 0 and 2
    assert inertia.count_below(S, 1.0) == 1


@pytest.fixture(scope="module")
def known():
    """A matrix, its eigenvalues, and the estimate of their density."""
    mesh = rough(sheet(40, 30))
    S = twin(mesh)
    return S, np.linalg.eigvalsh(S.toarray()), density.estimate_density(uniform(mesh))


@pytest.mark.no_cover
@pytest.mark.parametrize("off", [1.0, 0.3, 2.5])
@pytest.mark.parametrize("modes", [1, 7, 60, 300, 1000])
def test_the_cutoff_has_exactly_so_many_modes_below_it_whatever_the_guess(known, modes, off):
    S, eigenvalues, density_of_modes = known
    guess = density_of_modes.cutoff(modes)
    cutoff = inertia.cutoff_of_modes(S, modes, Cutoff(min(1.99, off * guess.eigenvalue), modes, guess.error))
    assert (cutoff.modes, cutoff.error) == (modes, 0)
    assert eigenvalues[modes - 1] < cutoff.eigenvalue < eigenvalues[modes]


def test_equal_eigenvalues_stay_together():
    S, known = flat_torus(40, 30)
    for modes, kept in ((35, 35), (36, 39), (37, 39), (39, 39)):
        cutoff = inertia.cutoff_of_modes(S, modes, from_wavelength(np.pi / np.sqrt(WEYL * modes / 1200), 1200))
        assert cutoff.modes == kept
        assert known[kept - 1] <= cutoff.eigenvalue < known[kept]


def test_the_null_space_stays_together():
    L = uniform(together(torus(20, 12), torus(16, 12), TETRAHEDRON))
    S = L.graph.symmetric_laplacian()
    known = np.linalg.eigvalsh(S.toarray())
    cutoff = inertia.cutoff_of_modes(S, 1, density.cutoff_of_modes(L, 1))
    assert cutoff.modes == 3
    assert known[2] < cutoff.eigenvalue < known[3]


def test_all_modes_are_below_the_end_of_the_spectrum():
    S, _ = flat_torus(9, 7)
    assert inertia.cutoff_of_modes(S, 63, Cutoff(0.5, 63, 0.1)) == Cutoff(2.0, 63, 0.0)


def test_a_factorization_that_does_not_fit_is_refused_with_its_size(monkeypatch):
    S, _ = flat_torus(40, 30)
    monkeypatch.setattr(inertia, "MEMORY_LIMIT", 1000)
    for work in (lambda: inertia.count_below(S, 0.1), lambda: inertia.cutoff_of_modes(S, 9, Cutoff(0.02, 9, 0.1))):
        with pytest.raises(mss.TooLarge, match=r"1200 vertices needs a factorization of 0\.0 GiB"):
            work()


def test_the_estimate_of_memory_is_above_what_a_surface_takes_and_not_far():
    S = twin(rough(torus(200, 100)))
    lu = inertia.factorize(S, 0.01).lu
    entries = inertia.FILL * 20000 * np.log2(20000)
    assert entries / 4 < lu.L.nnz < entries
    assert (lu.U - eye_array(20000)).nnz < 1.1 * entries

import functools
import sys

import numpy as np
import pytest
import threadpoolctl

import meshlab_specsmooth as mss
from meshlab_specsmooth.runtime import blocks
from meshlab_specsmooth.spectral import eigenbasis, inertia, lanczos
from meshlab_specsmooth.spectral.cutoff import Cutoff
from tests import meshes
from tests.meshes import (
    TETRAHEDRON,
    TETRAHEDRON_SPECTRUM,
    rough,
    sheet,
    together,
    torus,
    torus_graph,
    torus_spectrum,
)


def fan(count):
    """Triangles that share one vertex: a few eigenvalues, most of them equal."""
    return np.zeros((2 * count + 1, 3)), np.array([[0, 2 * i + 1, 2 * i + 2] for i in range(count)])


def book(count):
    """Triangles that share one edge."""
    return np.zeros((count + 2, 3)), np.array([[0, 1, i + 2] for i in range(count)])


MESHES = {
    "rough": lambda: rough(sheet(38, 30)),
    "multiplicity twelve": lambda: (np.zeros((1600, 3)), torus_graph(40, 40)),
    "components": lambda: together(torus(40, 30), torus(40, 30), TETRAHEDRON),
    "long and narrow": lambda: sheet(280, 4),
    "fan": lambda: fan(700),
    "book": lambda: book(1400),
}


@functools.cache
def twin(name):
    return meshes.twin(MESHES[name]())


# in closed form, of graphs regular enough; of the others by the dense solver
SPECTRA = {
    "multiplicity twelve": lambda: torus_spectrum(40, 40),
    "components": lambda: np.sort(np.concatenate([*[torus_spectrum(40, 30)] * 2, TETRAHEDRON_SPECTRUM])),
    "fan": lambda: np.array([0, *[1 / 2] * 699, *[3 / 2] * 701]),
    "book": lambda: np.array([0, *[1] * 1399, 1 + 1 / 1401, 2 - 1 / 1401]),
}


@functools.cache
def known(name):
    return SPECTRA[name]() if name in SPECTRA else np.linalg.eigvalsh(twin(name).toarray())


@pytest.mark.no_cover
@pytest.mark.parametrize("name", MESHES)
@pytest.mark.parametrize("count", [1, 2, 39, 240])
def test_the_basis_is_that_of_the_dense_solver_with_no_eigenvalue_missed(name, count):
    S = twin(name)
    assert S.shape[0] > eigenbasis.DENSE_VERTICES
    basis = eigenbasis.lowest(S, count)
    U = basis.vectors
    assert U.shape == (S.shape[0], count)
    assert basis.eigenvalues == pytest.approx(known(name)[:count], abs=1e-11)
    assert np.linalg.norm(S @ U - U * basis.eigenvalues, axis=0).max() < 1e-8
    assert abs(U.T @ U - np.eye(count)).max() < 1e-9


def test_the_null_vector_of_a_surface_is_exactly_zero():
    assert eigenbasis.lowest(twin("rough"), 5).eigenvalues[0] == 0


def test_two_runs_agree_to_the_bit():
    one, two = (eigenbasis.lowest(twin("multiplicity twelve"), 60) for _ in range(2))
    assert (one.eigenvalues == two.eigenvalues).all()
    assert (one.vectors == two.vectors).all()


@pytest.mark.parametrize("name", ["components", "long and narrow"])
def test_how_many_threads_there_are_does_not_show(name, monkeypatch):
    several = eigenbasis.lowest(twin(name), 60)
    monkeypatch.setattr(blocks, "threads", lambda: 1)
    alone = eigenbasis.lowest(twin(name), 60)
    assert np.array_equal(several.eigenvalues, alone.eigenvalues)
    assert np.array_equal(several.vectors, alone.vectors)


def test_blas_has_one_thread_meanwhile_and_without_the_extra_those_it_has(monkeypatch):
    def blas():
        return [pool["num_threads"] for pool in threadpoolctl.threadpool_info() if pool["user_api"] == "blas"]

    before = blas()
    with blocks.one_blas_thread():
        assert set(blas()) == {1}
    assert blas() == before
    # of calls in several threads, the first to begin is not the last to end
    first, second = blocks.one_blas_thread(), blocks.one_blas_thread()
    first.__enter__()
    second.__enter__()
    first.__exit__(None, None, None)
    assert set(blas()) == {1}
    second.__exit__(None, None, None)
    assert blas() == before
    monkeypatch.setitem(sys.modules, "threadpoolctl", None)
    with blocks.one_blas_thread():
        assert blas() == before


def test_what_one_krylov_space_misses_is_found_by_another(monkeypatch):
    spaces, one_space = [], lanczos._lanczos

    def spy(*arguments):
        spaces.append(arguments)
        return one_space(*arguments)

    monkeypatch.setattr(lanczos, "_lanczos", spy)
    # seven hundred equal eigenvalues, and a Krylov space has no more of them than a block has vectors
    assert eigenbasis.lowest(twin("fan"), 60).eigenvalues == pytest.approx(known("fan")[:60], abs=1e-11)
    assert len(spaces) > 1


def test_a_space_too_small_for_any_eigenpair_is_reported(monkeypatch):
    monkeypatch.setattr(lanczos, "_VECTORS_PER_PAIR", 0)
    monkeypatch.setattr(lanczos, "_EXTRA_VECTORS", 16)
    with pytest.raises(mss.NotConverged, match="of the 20 lowest eigenpairs of 1140 vertices, 20 were not found"):
        eigenbasis.lowest(twin("rough"), 20)


def test_eigenpairs_that_are_not_accurate_are_reported(monkeypatch):
    monkeypatch.setattr(lanczos, "_WANTED_RESIDUAL", 1e-3)
    with pytest.raises(mss.NotConverged, match=r"residuals up to .*e-.*, not 1e-08"):
        eigenbasis.lowest(twin("rough"), 20)


@pytest.mark.parametrize(("name", "work"), [
    ("rough", lambda S, p: eigenbasis.lowest(S, 40, p)),
    ("components", lambda S, p: eigenbasis.lowest(S, 40, p)),
    ("components", lambda S, p: eigenbasis.lowest_with_gap(S, 40, p)),
    ("components", lambda S, p: eigenbasis.up_to(S, Cutoff(0.2, 3.0, 0.0), p)),
    ("rough", eigenbasis.full),
])  # fmt: skip
def test_progress_rises_to_one(name, work):
    reported = []
    work(twin(name), reported.append)
    assert reported == sorted(reported)
    assert 0 <= reported[0] <= reported[-1] == pytest.approx(1, abs=1e-12)


def test_progress_is_reported_often_and_an_interrupt_ends_the_work():
    reported = []
    eigenbasis.lowest(twin("rough"), 100, reported.append)
    assert max(np.diff([0, *reported])) < 0.5
    assert len(reported) > 10

    def interrupt(fraction):
        if fraction > 0.2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        eigenbasis.lowest(twin("rough"), 100, interrupt)


def test_the_memory_counted_is_the_work_space_and_the_factorization_too(monkeypatch):
    S = twin("rough")
    vectors = 8 * 1140 * 100
    monkeypatch.setattr(eigenbasis, "MEMORY_LIMIT", 3 * vectors + inertia.factor_bytes(1140))
    with pytest.raises(mss.TooLarge, match=r"100 eigenvectors of 1140 vertices need .* use method='chebyshev'"):
        eigenbasis.lowest(S, 100)
    monkeypatch.setattr(eigenbasis, "MEMORY_LIMIT", 8 * vectors + inertia.factor_bytes(1140))
    assert len(eigenbasis.lowest(S, 100).eigenvalues) == 100

"""The graph of a mesh, and its sweeps: compiled and by scipy, which must agree."""

import subprocess
import sys
import threading
from dataclasses import replace
from unittest import mock

import numpy as np
import pytest
from hypothesis import given, settings

import meshlab_specsmooth as mss
from meshlab_specsmooth.geometry import order
from meshlab_specsmooth.geometry.surface import Surface, edges
from meshlab_specsmooth.graph import adjacency_numba, adjacency_scipy, protocols, vertex_loops_numba
from meshlab_specsmooth.graph import backend as graph_backend
from meshlab_specsmooth.graph.build import from_edges, mesh_graph
from meshlab_specsmooth.graph.laplacian import Laplacian, laplacian
from meshlab_specsmooth.graph.vertex_kernels_numba import NumbaVertexKernels
from meshlab_specsmooth.graph.vertex_kernels_scipy import ScipyVertexKernels
from meshlab_specsmooth.operators.laplacians import laplacian_of_kind
from meshlab_specsmooth.runtime import backend, blocks
from tests.meshes import TETRAHEDRON, flaws, meshes, rough, sheet, together, torus

MESHES = {"closed": rough(torus(12, 9)), "open": rough(sheet()), "flawed": flaws(sheet(5, 4))["duplicate faces"]}
LARGE = rough(torus(300, 290))  # more rows than one thread is given
BOTH = [ScipyVertexKernels, NumbaVertexKernels]


def graph_of(mesh, kind="uniform"):
    V, F = mesh[0], mesh[1].astype(np.int32)
    return laplacian_of_kind(kind, mesh_graph(F, len(V)), V, F).graph


@pytest.mark.parametrize("implementation", [adjacency_scipy.adjacency, adjacency_numba.adjacency])
@settings(deadline=None)
@given(mesh=meshes())
def test_the_graph_has_the_edges_of_the_mesh_and_counts_their_faces(implementation, mesh):
    V, F = mesh
    surface = Surface(V, F)
    ends, face_count = edges(surface)
    used = np.unique(ends)
    if len(used) == 0:
        return
    number = np.cumsum(np.isin(np.arange(len(V)), used)) - 1
    has_side = (F != F[:, [1, 2, 0]]).any(axis=1)
    chosen = replace(graph_backend.SCIPY, adjacency=implementation)
    with mock.patch.object(graph_backend, "select", return_value=chosen):
        graph = mesh_graph(number[F[has_side]].astype(np.int32), len(used))
    assert np.array_equal(graph.ends(), number[ends])
    assert np.array_equal(graph.boundary(), number[ends[face_count == 1]])
    faces_at = np.full(len(graph.graph.indices), 2)
    faces_at[graph.irregular] = graph.irregular_face_count
    assert (graph.irregular_face_count != 2).all()
    counts = graph.graph.adjacency(faces_at).toarray()
    assert np.array_equal(counts, counts.T)
    assert np.array_equal(counts[tuple(number[ends].T)], face_count)
    incidence = np.zeros((has_side.sum(), len(used)))
    np.add.at(incidence, (np.repeat(np.arange(has_side.sum()), 3), number[F[has_side]].ravel()), 1)
    assert np.array_equal(np.diag(incidence.T @ incidence), graph.corner_count)
    assert np.array_equal(graph.graph.degree[:, 0], (counts > 0).sum(axis=1))


def some_flipped(mesh, seed=3):
    """A mesh whose faces have lost their common orientation, and their order."""
    V, F = mesh
    rng = np.random.default_rng(seed)
    flipped = np.where(rng.random(len(F))[:, None] < 0.5, F, F[:, ::-1])
    return V, rng.permutation(flipped)


@pytest.mark.parametrize(
    "mesh", [*MESHES.values(), LARGE, *flaws(sheet(5, 4)).values(), some_flipped(LARGE), (LARGE[0], LARGE[1][:-7])]
)
def test_the_counting_sort_gives_the_adjacency_of_the_reference(mesh):
    V, F = mesh
    for ours, reference in zip(
        *(f(F.astype(np.int32), len(V)) for f in (adjacency_numba.adjacency, adjacency_scipy.adjacency)), strict=True
    ):
        assert np.array_equal(ours, reference)
        assert ours.dtype == reference.dtype


def test_a_hub_of_very_many_faces_is_sorted_in_time():
    # by insertion this would take a minute
    rim = np.arange(1, 300_001)
    F = np.stack([np.zeros_like(rim), np.roll(rim, 1), rim], axis=1)[np.random.default_rng(0).permutation(len(rim))]
    indptr, indices, irregular, *_ = adjacency_numba.adjacency(F.astype(np.int32), len(rim) + 1)
    assert np.array_equal(indices[: indptr[1]], rim)
    assert (np.diff(indptr)[1:] == 3).all()
    assert len(irregular) == 2 * len(rim)  # the rim, both ways
    assert irregular[0] >= indptr[1]


def test_a_weighted_graph_is_symmetric_whichever_way_its_edges_are_given():
    one = from_edges(3, np.array([[0, 1], [1, 2]], dtype=np.int32), np.array([2.0, 5.0]))
    other = from_edges(3, np.array([[2, 1], [1, 0]], dtype=np.int32), np.array([5.0, 2.0]))
    for graph in (one, other):
        assert graph.adjacency().toarray() == pytest.approx(np.array([[0, 2, 0], [2, 0, 5], [0, 5, 0.0]]))
        assert graph.degree.ravel() == pytest.approx([2, 7, 5])


def outcomes(graph, make, n):
    """Every operation of the kernels on the same numbers."""
    rng = np.random.default_rng(7)
    X, now, before, r, x, p = rng.standard_normal((6, n, 3))
    rows, free = (rng.random((2, n, 1)) > 0.2).astype(float)
    m, gram = rng.random((2, n, 1)) + 0.5
    work, count, squares, restricted = make(graph), blocks.count(n), np.empty((n, 1)), before.copy()
    z, q, sums, lengths = np.empty((n, 3)), np.empty((n, 3)), np.empty(count), np.empty((count, 1))
    both, inner = np.empty((2, count, 2))
    work.chebyshev_step(0, count, X, now, before, 2.0, 0.3, None)
    work.chebyshev_step(0, count, X, now, restricted, 2.0, 0.3, free)
    work.normal_matvec_1(0, count, p, rows, 0.2, z)
    work.normal_matvec_2(0, count, p, z, free, 0.2, gram, q, sums)
    everywhere = *(np.empty((n, 3)) for _ in range(2)), np.empty(count)  # without rows or free
    work.normal_matvec_1(0, count, p, None, 0.2, everywhere[0])
    work.normal_matvec_2(0, count, p, everywhere[0], None, 0.2, gram, *everywhere[1:])
    work.update_solution(0, count, 0.7, p, q, x, r, both)
    work.update_direction(0, count, 0.4, r, p)
    work.edge_lengths(0, count, X, lengths)
    work.inner_products(0, count, X, now, inner)
    work.sum_squared_weights(0, count, m, squares)
    return before, restricted, q, sums, *everywhere, r, both, x, p, lengths, inner, squares


@pytest.mark.parametrize("kind", ["uniform", "cotangent"])
@pytest.mark.parametrize("mesh", [*MESHES.values(), LARGE], ids=[*MESHES, "large"])
def test_the_compiled_kernels_do_what_the_reference_does_to_1e_12(mesh, kind):
    graph = graph_of(mesh, kind)
    for compiled, reference in zip(*(outcomes(graph, make, graph.size) for make in BOTH), strict=True):
        assert np.abs(compiled - reference).max() <= 1e-12 * np.abs(reference).max()


@pytest.mark.parametrize("make", BOTH)
def test_a_step_is_one_of_chebyshevs_recurrence(make):
    graph = graph_of(MESHES["open"], "cotangent")
    X, now, before = np.random.default_rng(0).standard_normal((3, graph.size, 3))
    walk = graph.adjacency().toarray() / graph.degree
    expected = 0.3 * X - 2 * walk @ now - before
    L = Laplacian(graph, make(graph))
    L.step(X, now, before, coefficient=0.3)
    assert before == pytest.approx(expected)
    assert L @ X[:, :2] == pytest.approx(X[:, :2] - walk @ X[:, :2])
    free = (np.arange(graph.size) % 3 > 0).astype(float)[:, None]
    before = np.zeros_like(X)
    L.step(free * X, free * now, before, coefficient=0.3, free=free)
    assert before == pytest.approx(free * (0.3 * X - 2 * walk @ (free * now)))


@pytest.mark.parametrize("make", BOTH)
def test_how_many_threads_there_are_does_not_show(make, monkeypatch):
    graph = graph_of(LARGE)
    L = Laplacian(graph, make(graph))
    for work in (lambda: L @ LARGE[0], lambda: L.mean_edge_length(LARGE[0])):
        several = work()
        with monkeypatch.context() as alone:
            alone.setattr(blocks, "threads", lambda: 1)
            assert np.array_equal(several, work())


def test_the_whole_filter_is_the_same_without_the_extra(monkeypatch):
    given_ = {"modes": 30, "boundary": "curve", "method": "chebyshev"}
    mesh = rough(sheet(40, 30))
    compiled = mss.smooth(*mesh, **given_)
    monkeypatch.setitem(sys.modules, "numba", None)  # as if it were not installed
    reference = mss.smooth(*mesh, **given_)
    assert (compiled.kernels, reference.kernels) == ("numba", "scipy")
    assert np.abs(compiled.vertices - reference.vertices).max() < 1e-12 * np.abs(mesh[0]).max()


@pytest.fixture
def warned(monkeypatch):
    """As if no warning had been given yet, and meshes of some hundred vertices were large."""
    monkeypatch.setattr(backend, "_has_warned", threading.Event())
    monkeypatch.setattr(backend, "LARGE", 300)
    backend._failure.cache_clear()
    yield
    backend._failure.cache_clear()


def test_without_numba_scipy_is_used_and_for_large_meshes_one_line_says_so(monkeypatch, warned):
    monkeypatch.setitem(sys.modules, "numba", None)  # as if it were not installed
    assert mss.smooth(*rough(sheet(6, 5)), modes=9).kernels == "scipy"
    mesh = rough(torus(20, 16))
    with pytest.warns(mss.Slow) as caught:
        _ = mss.smooth(*mesh, modes=9), mss.smooth_edge_aware(*mesh, strength=1.0, range_sigma=0.3, iterations=1)
    (warning,) = (each for each in caught if each.category is mss.Slow)
    assert str(warning.message) == (
        "numba is not installed (pip install numba threadpoolctl); without numba this takes two to five times as long"
    )
    assert warning.filename == __file__  # where the package was called


@pytest.mark.parametrize("error", [ImportError, OSError])
def test_a_numba_that_cannot_be_loaded_is_reported_and_not_used(monkeypatch, warned, error):
    def fail(name):
        raise error(f"{name} is too old")

    slow = mss.Slow  # names of the package are imported when they are first used
    mss.smooth(*rough(torus(5, 4)), modes=9)
    monkeypatch.setattr(backend.importlib, "import_module", fail)
    backend._failure.cache_clear()
    with pytest.warns(slow, match=r"numba cannot be loaded: numba is too old \(pip install --upgrade numba\);"):
        assert mss.smooth(*rough(torus(20, 16)), modes=9).kernels == "scipy"


def test_errors_inside_of_compiled_modules_are_errors(monkeypatch):
    monkeypatch.setitem(sys.modules, "meshlab_specsmooth.graph.vertex_kernels_numba", None)
    with pytest.raises(ImportError, match="vertex_kernels_numba"):
        mss.smooth(*rough(sheet(5, 5)), modes=3)


def test_compiled_code_is_cached_on_disk():
    graph = graph_of(TETRAHEDRON)
    outcomes(graph, NumbaVertexKernels, graph.size)
    kernels = ("chebyshev_step", "normal_matvec_1", "normal_matvec_2", "update_solution", "update_direction")
    for kernel in (getattr(vertex_loops_numba, name) for name in kernels):
        assert kernel.stats.cache_path
        assert kernel.stats.cache_hits or kernel.stats.cache_misses


def shuffled(mesh, seed=0):
    V, F = mesh
    at = np.random.default_rng(seed).permutation(len(V))
    return V[at], np.argsort(at)[F], at


def test_a_badly_ordered_mesh_is_put_in_order_inside_and_the_result_put_back():
    V, F, at = shuffled(LARGE)
    assert order.is_scattered(F.astype(np.int32), len(V))
    assert not order.is_scattered(LARGE[1].astype(np.int32), len(V))
    ops = mss.assemble(V, F)
    assert np.array_equal(np.sort(ops.active), np.arange(len(V)))
    indices = ops.L.graph.indices.astype(np.int64)
    row = np.repeat(np.arange(len(V)), np.diff(ops.L.graph.indptr))
    assert np.median(abs(indices - row)) < order.NEAR / 10 < np.median(abs(F[:, 0] - F[:, 1]))
    given = {"barycenter_weight": 1.0}  # a chosen one depends on draws of noise, which go by the order of vertices
    straight = mss.smooth(*LARGE, **given).vertices[at]
    assert mss.smooth(ops, **given).vertices == pytest.approx(straight, abs=1e-4 * ops.mean_edge)
    weights = np.random.default_rng(3).random(len(V))
    some = {"mask": weights[at] > 0.5, "features": weights[at], "feature_gain": 1.0, **given}
    expected = mss.smooth(*LARGE, mask=weights > 0.5, features=weights, feature_gain=1.0, **given).vertices[at]
    assert mss.smooth(ops, **some).vertices == pytest.approx(expected, abs=1e-4 * ops.mean_edge)


def test_places_near_each_other_are_near_on_the_curve():
    V = np.random.default_rng(5).random((20_000, 3))
    at = order.morton_order(V)
    assert np.array_equal(np.sort(at), np.arange(len(V)))
    along, anyhow = (np.linalg.norm(np.diff(W, axis=0), axis=1).mean() for W in (V[at], V))
    assert along < 0.1 * anyhow
    # eight corners of a cube, in the order of their bits
    corners = np.array([[x, y, z] for z in (0, 1) for y in (0, 1) for x in (0, 1)], dtype=float)
    mixed = np.array([3, 1, 7, 0, 2, 6, 5, 4])
    assert np.array_equal(mixed[order.morton_order(corners[mixed])], np.arange(8))
    assert len(order.morton_order(np.zeros((4, 3)))) == 4


def test_an_error_in_a_thread_is_not_lost():
    def fail(first, last):
        if first > 0:
            raise ArithmeticError("in a thread")

    n = 100 * blocks.ROWS
    if blocks.threads() == 1:
        pytest.skip("one processor")
    with pytest.raises(ArithmeticError, match="in a thread"):
        blocks.parallel_for(fail, n)


def test_every_block_is_worked_on_once():
    for n in (1, blocks.ROWS, blocks.ROWS + 1, 50 * blocks.ROWS + 3):
        seen = np.zeros(blocks.count(n))

        def work(first, last, seen=seen):
            seen[first:last] += 1

        blocks.parallel_for(work, n)
        assert (seen == 1).all()


@pytest.mark.skipif(not hasattr(__import__("os"), "fork"), reason="no fork")
def test_a_forked_child_has_threads_of_its_own():
    code = """
import os, warnings
warnings.simplefilter("ignore", DeprecationWarning)  # of fork in a process with threads, which is the point
from meshlab_specsmooth.runtime import blocks
n = 100 * blocks.ROWS
blocks.parallel_for(lambda first, last: None, n)
child = os.fork()
if child == 0:
    blocks.parallel_for(lambda first, last: None, n)
    os._exit(7)
print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]))
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=True)
    assert done.stdout == "7\n"


def test_sums_of_several_columns_are_by_threes():
    L = laplacian(graph_of(MESHES["closed"]))
    X = np.random.default_rng(2).standard_normal((L.size, 7))
    assert np.hstack([L @ X[:, i : i + 1] for i in range(7)]) == pytest.approx(L @ X, abs=1e-14)
    assert (L @ X[:, :0]).shape == (L.size, 0)
    assert protocols.COLUMNS == 3


def test_components_do_not_meet():
    mesh = together(TETRAHEDRON, TETRAHEDRON)
    assert graph_of(mesh).adjacency().toarray()[:4, 4:].sum() == 0

"""The laws of the whole method."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from hypothesis import given, settings

import meshlab_specsmooth as mss
from meshlab_specsmooth.geometry.surface import signed_volume
from meshlab_specsmooth.operators import reconstruction
from meshlab_specsmooth.runtime import memory
from meshlab_specsmooth.spectral.response import RESPONSES, response
from tests.meshes import (
    TETRAHEDRON,
    TRIANGLE,
    flaws,
    meshes,
    rough,
    sheet,
    together,
    torus,
    torus_eigenvalue,
    torus_graph,
    twin,
    wave,
)

OPEN, CLOSED = rough(sheet()), rough(torus(20, 12))
SEVERAL = together(OPEN, (CLOSED[0] + 20, CLOSED[1]), TETRAHEDRON)
BOTH_METHODS = pytest.mark.parametrize("method", ["exact", "chebyshev"])


def of_weight_1(V, F, **given):
    """The steps themselves. A chosen weight depends on seeded draws, which go by the order of vertices, and laws hold
    for it as well as it is looked for: see test_automatic.py."""
    return mss.smooth(V, F, **{"barycenter_weight": 1.0} | given)


SMOOTHERS = pytest.mark.parametrize("smoother", [of_weight_1, mss.low_pass], ids=["smooth", "low_pass"])
EVERY_RESPONSE = pytest.mark.parametrize("name", RESPONSES)


def moved(result, mesh):
    return np.linalg.norm(result.vertices - mesh[0])


def rotation(seed):
    q, r = np.linalg.qr(np.random.default_rng(seed).standard_normal((3, 3)))
    return q * np.sign(np.diag(r))


@pytest.mark.no_cover
@SMOOTHERS
@BOTH_METHODS
@pytest.mark.parametrize("mesh", [OPEN, CLOSED, SEVERAL])
def test_rigid_motions_and_reflections_carry_over(smoother, method, mesh):
    V, F = mesh
    Q, shift = rotation(1), np.array([3.0, -2.0, 7.0])
    still = smoother(V, F, modes=20, method=method)
    turned = smoother(V @ Q + shift, F, modes=20, method=method)
    # the solver stops at a residual of 1e-5, and sees other columns
    assert turned.vertices == pytest.approx(still.vertices @ Q + shift, abs=1e-4 * still.displacement)


@pytest.mark.no_cover
@SMOOTHERS
@BOTH_METHODS
@pytest.mark.parametrize("scale", [1e-6, 1e6, 2.0**-400, 1e200])
def test_the_result_scales_with_the_mesh(smoother, method, scale):
    V, F = CLOSED
    one = smoother(V, F, wavelength=2.0, method=method)
    scaled = smoother(V * scale, F, wavelength=2.0 * scale, method=method)
    assert scaled.vertices / scale == pytest.approx(one.vertices, rel=1e-9, abs=1e-9)
    for length in ("wavelength", "mean_edge", "displacement"):
        assert getattr(scaled, length) / scale == pytest.approx(getattr(one, length), rel=1e-9)
    for number in ("cutoff", "degree", "cg_iterations"):
        assert getattr(scaled, number) == pytest.approx(getattr(one, number))


def test_a_power_of_two_scales_to_the_bit():
    V, F = OPEN
    assert np.array_equal(mss.smooth(V * 2.0**30, F).vertices, mss.smooth(V, F).vertices * 2.0**30)


@SMOOTHERS
@BOTH_METHODS
def test_the_order_of_vertices_and_faces_does_not_matter(smoother, method):
    V, F = SEVERAL
    rng = np.random.default_rng(2)
    order, face_order = rng.permutation(len(V)), rng.permutation(len(F))
    number = np.argsort(order)
    straight = smoother(V, F, modes=30, method=method)
    mixed = smoother(V[order], number[F][face_order][:, [1, 2, 0]], modes=30, method=method)
    assert mixed.vertices == pytest.approx(straight.vertices[order], abs=1e-6 * straight.displacement)


@SMOOTHERS
@EVERY_RESPONSE
def test_a_mesh_that_is_one_point_stays(smoother, name):
    V, F = CLOSED
    point = np.full_like(V, 0.1)
    assert np.array_equal(smoother(point, F, modes=9, response=name).vertices, point)


@pytest.mark.no_cover
@pytest.mark.parametrize("mesh", [OPEN, CLOSED, SEVERAL], ids=["open", "closed", "several components"])
@pytest.mark.parametrize("name", ["butterworth", "gaussian", "heat"])
@pytest.mark.parametrize("laplacian", ["uniform", "cotangent"])
@pytest.mark.parametrize("weight", [1.0, 0.2])
def test_the_polynomial_does_what_the_eigenvectors_do(mesh, name, laplacian, weight):
    given = {"modes": 15, "response": name, "laplacian": laplacian}
    exact = mss.smooth(*mesh, **given, barycenter_weight=weight, method="exact")
    series = mss.smooth(*mesh, **given, barycenter_weight=weight, method="chebyshev")
    # the stated error is that of a regular mesh with equal weights
    share = 6e-3 if laplacian == "uniform" else 2e-2
    assert np.linalg.norm(exact.vertices - series.vertices) < share * moved(exact, mesh)
    exact, series = mss.low_pass(*mesh, **given, method="exact"), mss.low_pass(*mesh, **given, method="chebyshev")
    assert np.linalg.norm(exact.vertices - series.vertices) < 1e-3 * moved(exact, mesh)


@EVERY_RESPONSE
@pytest.mark.parametrize("mesh", [rough(sheet(8, 6)), rough(torus(9, 7))], ids=["open", "closed"])
def test_a_vanishing_weight_gives_the_plain_low_pass(name, mesh):
    V, F = mesh
    limit = mss.low_pass(V, F, modes=6, response=name).vertices
    apart = []
    for weight in (0.1, 0.01, 0.001):
        result = mss.smooth(V, F, modes=6, response=name, barycenter_weight=weight, boundary="free")
        difference = result.vertices - limit
        if len(V) == 48:  # at a rim a vertex has fewer faces than edges, so the two keep different means
            difference -= difference.mean(axis=0)
        apart.append(np.linalg.norm(difference))
    assert apart[2] < 1e-2 * apart[0]
    assert apart[2] < 1e-3 * np.linalg.norm(limit - V)


@EVERY_RESPONSE
def test_a_large_weight_gives_the_surface_back(name):
    V, F = rough(sheet(8, 6))
    free = moved(mss.smooth(V, F, modes=6, response=name, barycenter_weight=1.0), (V, F))
    held = [moved(mss.smooth(V, F, modes=6, response=name, barycenter_weight=w), (V, F)) for w in (10.0, 1000.0)]
    # an open sheet's corners have one or two faces, so the barycenters alone do not hold every vertex
    assert held[1] <= held[0] < free


def test_a_large_weight_holds_the_barycenters():
    V, F = CLOSED
    result = mss.smooth(V, F, modes=6, barycenter_weight=300.0)
    assert result.vertices[F].mean(axis=1) == pytest.approx(V[F].mean(axis=1), abs=1e-4 * result.mean_edge)


@pytest.mark.no_cover
@EVERY_RESPONSE
@BOTH_METHODS
@pytest.mark.parametrize("weight", [0.1, 0.5, 1.0, 3.0])
def test_the_transfer_function_on_a_regular_torus_is_the_one_in_the_book(name, method, weight):
    """Equation (5-6) on a circulant mesh: H = (l^2 h + w^2 b) / (l^2 + w^2 b), b = 2 - 4 l / 3."""
    nx, ny = 18, 12
    modes = [(1, 0), (0, 2), (4, 3), (9, 6), (2, 0), (7, 1)]
    cutoff = 0.2  # no eigenvalue of these modes is within the transition of the step
    wavelength_in_edges = np.pi / np.sqrt(cutoff)
    h = response(name, cutoff)
    for start in range(0, len(modes), 3):
        three = modes[start : start + 3]
        V = np.stack([wave(p, q, nx, ny) for p, q in three], axis=1)
        F = torus_graph(nx, ny)
        ops = mss.assemble(V, F, weld=False)  # waves are no surface: some vertices coincide
        edge = np.ldexp(ops.mean_edge, ops.exponent)
        result = mss.smooth(
            ops, wavelength=wavelength_in_edges * edge, response=name, barycenter_weight=weight, method=method
        )
        for column, (p, q) in enumerate(three):
            eigenvalue = torus_eigenvalue(p, q, nx, ny)
            gain, b = float(h([eigenvalue])[0]), 2 - 4 * eigenvalue / 3
            expected = (eigenvalue**2 * gain + weight**2 * b) / (eigenvalue**2 + weight**2 * b)
            tolerance = 1e-3 if method == "exact" else 6e-3 if name == "ideal" else 3e-3
            assert result.vertices[:, column] == pytest.approx(expected * V[:, column], abs=tolerance)


def test_the_low_pass_on_a_regular_torus_is_the_response():
    nx, ny = 18, 12
    V = np.stack([wave(1, 0, nx, ny), wave(3, 2, nx, ny), wave(9, 6, nx, ny)], axis=1)
    ops = mss.assemble(V, torus_graph(nx, ny), weld=False)
    edge = np.ldexp(ops.mean_edge, ops.exponent)
    result = mss.low_pass(ops, wavelength=np.pi / np.sqrt(0.3) * edge, response="heat", method="chebyshev")
    gains = response("heat", 0.3)([torus_eigenvalue(p, q, nx, ny) for p, q in ((1, 0), (3, 2), (9, 6))])
    assert result.vertices == pytest.approx(gains * V, abs=1e-6)


@SMOOTHERS
def test_the_input_is_never_changed_and_two_runs_give_the_same_bits(smoother):
    V, F = rough(torus(60, 30))
    before = V.copy(), F.copy()
    V.flags.writeable = F.flags.writeable = False
    first, second = (smoother(V, F, modes=100).vertices for _ in range(2))
    assert np.array_equal(V, before[0])
    assert np.array_equal(F, before[1])
    assert np.array_equal(first, second)
    assert not np.shares_memory(first, V)


@pytest.mark.no_cover
@pytest.mark.parametrize("name", flaws(OPEN))
@BOTH_METHODS
def test_flawed_meshes_give_finite_results(name, method):
    V, F = flaws(OPEN)[name]
    result = mss.smooth(V, F, modes=10, method=method)
    assert result.vertices.shape == V.shape
    assert np.isfinite(result.vertices).all()
    assert 0 < moved(result, (V, F)) < np.linalg.norm(V - V.mean(axis=0))
    assert result.residual < 2 * reconstruction.TOLERANCE


@SMOOTHERS
def test_vertices_without_an_edge_do_not_move_nor_matter(smoother):
    V, F = CLOSED
    W = np.concatenate([[[1e9, 0, 0]], V, [[0.1, 0.2, 0.3]]])
    more = np.concatenate([F + 1, [[0, 0, 0]]])
    result = smoother(W, more, modes=10)
    assert np.array_equal(result.vertices[[0, -1]], W[[0, -1]])
    assert np.array_equal(result.vertices[1:-1], smoother(V, F, modes=10).vertices)


def test_unreferenced_and_doubled_faces_change_nothing_they_should_not():
    V, F = OPEN
    once = mss.smooth(V, F, modes=10, barycenter_weight=1.0, boundary="free")
    plain = once.vertices
    backward = mss.smooth(V, F[:, ::-1], modes=10, barycenter_weight=1.0, boundary="free").vertices
    assert backward == pytest.approx(plain, abs=1e-7)
    # a mesh whose faces all count twice holds its barycenters with root 2 times the weight
    twice = mss.smooth(V, np.concatenate([F, F]), modes=10, barycenter_weight=1 / np.sqrt(2), boundary="free")
    assert twice.vertices == pytest.approx(plain, abs=1e-3 * once.displacement)


def test_components_do_not_feel_each_other():
    V, F = SEVERAL
    n = len(OPEN[0])
    given_ = {"response": "heat", "boundary": "free", "barycenter_weight": 1.0, "tolerance": 1e-6}
    alone, among = mss.smooth(*OPEN, wavelength=6.0, **given_), mss.smooth(V, F, wavelength=6.0, **given_)
    # the wavelength is counted in mean edges, which differ; so compare at the same eigenvalue
    scaled = mss.smooth(*OPEN, wavelength=6.0 * alone.mean_edge / among.mean_edge, **given_)
    assert among.vertices[:n] == pytest.approx(scaled.vertices, abs=1e-4)


def test_detail_far_from_the_origin_survives():
    """Coordinates around 1e6 with detail of 1e-3, as in surveyed scans."""
    V, F = rough(sheet())
    near, offset = V * 1e-3, np.array([1e6, -2e6, 5e5])
    far = mss.smooth(near + offset, F, modes=12)
    expected = mss.smooth((near + offset) - offset, F, modes=12).vertices
    assert far.vertices - offset == pytest.approx(expected, abs=4 * np.spacing(2e6))
    assert far.displacement > 100 * np.spacing(2e6)


def test_a_single_triangle_keeps_its_barycenter():
    V, F = TRIANGLE
    result = mss.smooth(V, F, modes=1)
    assert result.vertices.mean(axis=0) == pytest.approx(V.mean(axis=0))
    assert mss.smooth(V, F, modes=3).vertices == pytest.approx(V)


def test_a_mesh_without_edges_stays_as_it_is():
    V = np.array([[1.0, 2, 3], [4, 5, 6]])
    result = mss.smooth(V, [[0, 0, 0], [1, 1, 1]])
    assert np.array_equal(result.vertices, V)
    assert (result.displacement, result.mean_edge) == (0, 0)


@pytest.mark.no_cover
@settings(deadline=None, max_examples=60)
@given(mesh=meshes())
def test_any_triangle_soup_gives_a_finite_result(mesh):
    V, F = mesh
    for smoother in (mss.smooth, mss.low_pass):
        result = smoother(V, F)
        assert result.vertices.shape == V.shape
        assert np.isfinite(result.vertices).all()


def test_noise_goes_and_the_volume_stays():
    """The paper's claim: no shrinkage."""
    clean = torus(60, 36)
    V, F = rough(clean, 0.2)
    for name, change in (("ideal", 1e-3), ("heat", 2e-3)):
        result = mss.smooth(V, F, barycenter_weight=0.3, response=name)
        assert np.linalg.norm(result.vertices - clean[0]) < 0.35 * np.linalg.norm(V - clean[0])
        before, after = (signed_volume(mss.Surface(W, F)) for W in (V, result.vertices))
        assert after == pytest.approx(before, rel=change)


def test_modes_of_equal_eigenvalue_stay_together():
    """A regular torus has pairs of waves; half a pair would depend on how the vertices are numbered."""
    V, F = CLOSED
    for modes in (12, 13):
        result = mss.smooth(V, F, modes=modes)
        assert (result.modes, result.modes_error) == (13, 0)
    order = np.random.default_rng(4).permutation(len(V))
    mixed = mss.low_pass(V[order], np.argsort(order)[F], modes=12).vertices
    assert mixed == pytest.approx(mss.low_pass(V, F, modes=12).vertices[order], abs=1e-9)


@BOTH_METHODS
def test_no_component_loses_its_place_however_few_modes_are_kept(method):
    islands = together(*((V + 10.0 * i, F) for i, (V, F) in enumerate([rough(sheet(5, 4), seed=i) for i in range(12)])))
    result = mss.low_pass(*islands, modes=10, method=method)
    assert result.modes == 12
    degree = np.zeros(len(islands[0]))
    ends = np.unique(
        np.sort(np.concatenate([islands[1][:, [0, 1]], islands[1][:, [1, 2]], islands[1][:, [2, 0]]])), axis=0
    )
    np.add.at(degree, ends.ravel(), 1)
    for i in range(12):
        part = slice(20 * i, 20 * i + 20)
        center = [np.average(W[part], axis=0, weights=degree[part]) for W in (islands[0], result.vertices)]
        assert center[1] == pytest.approx(center[0], abs=1e-4)


@pytest.mark.no_cover
@BOTH_METHODS
def test_a_mesh_of_many_components_is_solved_in_full_and_twice_the_same(method):
    mesh = together(rough(torus(36, 24)), *((TETRAHEDRON[0] + 10.0 * i, TETRAHEDRON[1]) for i in range(1, 101)))
    first, second = (mss.smooth(*mesh, modes=120, method=method) for _ in range(2))
    assert np.array_equal(first.vertices, second.vertices)
    assert mss.low_pass(*mesh, modes=50, method=method).modes == 101


@pytest.mark.parametrize("wavelength", [1e-300, 1e-9, 1e9, 1e300])
def test_waves_of_any_length_may_be_asked_for(wavelength):
    V, F = OPEN
    result = mss.smooth(V, F, wavelength=wavelength, boundary="free")
    extreme = mss.smooth(V, F, modes=len(V) if wavelength < 1 else 1, boundary="free")
    assert result.vertices == pytest.approx(extreme.vertices, abs=1e-6)
    center = mss.low_pass(V, F, wavelength=1e9, response="heat", method="exact").vertices
    assert center.std(axis=0) == pytest.approx(0, abs=1e-9)


def test_passes_repeat_the_filter():
    V, F = OPEN
    once = mss.smooth(V, F, modes=10, barycenter_weight=1.0, iterations=1)
    again = mss.smooth(once.vertices, F, modes=10, barycenter_weight=1.0)
    twice = mss.smooth(V, F, modes=10, barycenter_weight=1.0, iterations=2)
    assert twice.vertices == pytest.approx(again.vertices, abs=1e-7)
    assert len(twice.cg_iterations) == twice.iterations == 2


def test_operators_assembled_once_give_the_bits_of_each_call():
    ops = mss.assemble(*CLOSED, laplacian="cotangent")
    for given_ in ({"modes": 10}, {"wavelength": 1.5, "response": "heat"}, {"barycenter_weight": 0.2}):
        direct = mss.smooth(*CLOSED, laplacian="cotangent", **given_)
        assert np.array_equal(mss.smooth(ops, **given_).vertices, direct.vertices)
    assert np.array_equal(
        mss.low_pass(ops, modes=5).vertices, mss.low_pass(*CLOSED, laplacian="cotangent", modes=5).vertices
    )


@pytest.mark.parametrize("mesh", [CLOSED, together(OPEN, (np.zeros((3, 3)), np.empty((0, 3), dtype=int)))])
def test_a_further_result_may_start_from_an_earlier_one(mesh):
    ops = mss.assemble(*mesh)
    given_ = {"modes": 10, "response": "gaussian", "method": "chebyshev", "tolerance": 1e-5}
    earlier = mss.smooth(ops, **given_, barycenter_weight=0.52)
    direct = mss.smooth(ops, **given_, barycenter_weight=0.5)
    begun = mss.smooth(ops, **given_, barycenter_weight=0.5, start=earlier)
    assert begun.cg_iterations[0] < direct.cg_iterations[0]
    assert begun.vertices == pytest.approx(direct.vertices, abs=1e-4 * direct.displacement)
    with pytest.raises(mss.InvalidParameter, match=r"start is a result for 4 vertices; this mesh has \d+"):
        mss.smooth(ops, start=mss.smooth(*TETRAHEDRON))


def test_a_wavelength_that_keeps_everything_is_warned_of():
    V, F = rough(torus(40, 30))
    edge = mss.smooth(V, F).mean_edge
    for weight in (None, 1.0):
        short, longer = (mss.smooth(V, F, wavelength=x * edge, barycenter_weight=weight) for x in (2.0, 6.0))
        assert "the wavelength is so short that" in (short.warning or "")
        assert short.modes == len(V)
        assert longer.warning is None
        assert longer.displacement > 10 * short.displacement


def test_a_wavelength_that_is_no_number_is_refused():
    with pytest.raises(mss.InvalidParameter, match="wavelength is '5%'; it must be a positive length"):
        mss.smooth(*CLOSED, wavelength="5%")


def test_operators_are_printed_in_a_line():
    assert repr(mss.assemble(*TETRAHEDRON)) == "<Operators: 4 vertices, 4 faces, uniform Laplacian>"


@BOTH_METHODS
def test_runs_that_share_a_workspace_give_the_same_bits(method):
    weights = [0.5, 1.0, 2.0, 0.5, 1.0, 2.0]
    alone = [
        mss.smooth(mss.assemble(*OPEN), method=method, barycenter_weight=w, iterations=2).vertices for w in weights
    ]
    ops, workspace = mss.assemble(*OPEN), mss.Workspace()

    def run(weight):
        given_ = {"method": method, "barycenter_weight": weight, "iterations": 2}
        return mss.smooth(ops, workspace=workspace, **given_).vertices

    with ThreadPoolExecutor(3) as pool:
        for together_ in (map(run, weights), pool.map(run, weights)):
            assert all(np.array_equal(*pair) for pair in zip(together_, alone, strict=True))
    kept = [workspace.borrow(OPEN[0]) for _ in range(len(workspace))]
    assert 0 < len(kept) <= 18  # six of each thread, if all three ran at once
    assert {array.shape for array in kept} == {OPEN[0].shape}
    assert len({id(array) for array in kept}) == len(kept)


def test_a_run_has_its_memory_for_itself_while_others_run():
    """A run inside of another, at many of the places where threads could take turns as well."""

    ops, workspace = mss.assemble(*OPEN), mss.Workspace()

    def run(weight, progress=None):
        given_ = {"method": "chebyshev", "barycenter_weight": weight, "iterations": 2}
        return mss.smooth(ops, workspace=workspace, progress=progress, **given_).vertices

    alone, between = run(0.5).copy(), run(2.0).copy()
    others = []

    def another(fraction):
        others.append(run(2.0))

    assert np.array_equal(run(0.5, another), alone)
    assert others
    assert all(np.array_equal(other, between) for other in others)


def test_the_evidence_is_true():
    V, F = CLOSED
    result = mss.smooth(V, F, modes=13, method="chebyshev", response="butterworth", barycenter_weight=0.5, iterations=2)
    edge = np.linalg.norm(V[F] - V[F[:, [1, 2, 0]]], axis=2).mean()  # every edge of a closed mesh twice
    assert result.mean_edge == pytest.approx(edge)
    assert result.displacement == pytest.approx(np.sqrt(((result.vertices - V) ** 2).sum(axis=1).mean()))
    assert result.wavelength == pytest.approx(np.pi / np.sqrt(result.cutoff) * edge)
    assert (result.modes, result.modes_error, result.iterations, result.laplacian) == (13, 0, 2, "uniform")
    assert (result.method, result.barycenter_weight) == ("chebyshev", 0.5)
    assert result.response == response("butterworth", result.cutoff).label
    assert result.degree > 10
    assert 0 < result.response_error < reconstruction.TOLERANCE
    assert 0 < result.displacement_error <= reconstruction.TOLERANCE
    assert 0 < result.residual < reconstruction.TOLERANCE
    assert result.seconds > 0
    plain = mss.low_pass(V, F, modes=12)
    assert (plain.barycenter_weight, plain.cg_iterations, plain.residual, plain.iterations) == (0, (), 0, 1)


def test_by_default_waves_longer_than_20_edges_are_kept():
    result = mss.smooth(*CLOSED)
    assert result.wavelength == pytest.approx(20 * result.mean_edge)
    assert np.isnan(result.modes_error)  # the number of modes is Weyl's law, not a count


@pytest.mark.parametrize(
    ("parameters", "words"),
    [
        ({"modes": 0}, "modes is 0; it must be a positive integer"),
        ({"modes": 2.5}, "modes is 2.5"),
        ({"modes": True}, "modes is True"),
        ({"modes": 109}, "modes is 109; .*; this mesh has 108"),
        ({"modes": 3, "wavelength": 1.0}, "give one of them"),
        ({"wavelength": 0.0}, "positive length"),
        ({"wavelength": np.inf}, "positive length"),
        ({"wavelength": np.nan}, "positive length"),
        ({"barycenter_weight": 0.0}, "for the limit 0, low_pass"),
        ({"barycenter_weight": np.nan}, "one number from 1.5e-08 to 6.7e\\+07"),
        ({"iterations": 0}, "iterations is 0"),
        ({"response": "box"}, "response is 'box'"),
        ({"laplacian": "graph"}, "laplacian is 'graph'; it must be one of 'uniform', 'cotangent'"),
        ({"method": "qr"}, "method is 'qr'"),
        ({"boundary": "open"}, "boundary is 'open'; it must be one of 'auto', 'fixed', 'curve', 'free'"),
        ({"mask": np.ones(5)}, r"mask has shape \(5,\); pass one weight for each of the 108 vertices"),
        ({"mask": ["a"] * 108}, "mask has dtype <U1; pass weights"),
        ({"features": np.full(108, 2.0)}, r"features\[0\] is 2.0; weights lie in \[0, 1\]"),
        ({"features": np.full(108, np.nan)}, r"features\[0\] is nan"),
        ({"features": np.ones(108), "feature_gain": -1.0}, "feature_gain is -1.0"),
        ({"feature_gain": np.inf}, "feature_gain is inf"),
    ],
)
def test_parameters_out_of_range_are_refused_by_name(parameters, words):
    with pytest.raises(mss.InvalidParameter, match=words):
        mss.smooth(*OPEN, **parameters)


def test_a_wavelength_needs_edges_of_some_length():
    with pytest.raises(mss.InvalidParameter, match="no edge of this mesh has a length"):
        mss.smooth(np.zeros((3, 3)), [[0, 1, 2]], wavelength=1.0)


def test_a_basis_too_large_for_memory_is_refused_before_it_is_computed():
    V, F = torus(200, 100)
    with pytest.raises(mss.TooLarge, match="20000 eigenvectors of 20000 vertices need 3.0 GiB"):
        mss.smooth(V, F, modes=200, response="heat", method="exact")


@pytest.mark.parametrize("iterations", [1, 3])
def test_progress_rises_to_one(iterations):
    seen = []
    mss.smooth(*CLOSED, modes=10, method="chebyshev", iterations=iterations, progress=seen.append)
    assert seen == sorted(seen)
    assert seen[-1] == 1
    assert len(seen) > 10 * iterations


@pytest.mark.no_cover
@pytest.mark.parametrize("method", ["exact", "chebyshev"])
@pytest.mark.parametrize("call", [mss.smooth, mss.low_pass])
def test_progress_has_many_steps_that_are_no_leaps(call, method):
    """Honest fractions: no part of the work counts for more than a third of the whole at once."""
    seen = [0.0]
    call(*rough(torus(60, 40)), modes=40, method=method, progress=seen.append)
    assert seen == sorted(seen)
    assert max(np.diff([*seen, 1.0])) < 1 / 3
    assert len(seen) > 8


@pytest.mark.no_cover
def test_counting_exactly_is_exact():
    mesh = rough(sheet(38, 30))  # on which no eigenvalues are equal
    estimated = mss.smooth(*mesh, modes=100)
    exact = mss.smooth(*mesh, modes=100, mode_count="exact")
    known = np.linalg.eigvalsh(twin(mesh).toarray())
    assert (exact.modes_error, exact.modes) == (0, np.searchsorted(known, exact.cutoff)) == (0, 100)
    assert abs(np.searchsorted(known, estimated.cutoff) - 100) < 4 * estimated.modes_error * 100 + 1
    with pytest.raises(mss.InvalidParameter, match="mode_count is 'by hand'; it must be one of 'estimate', 'exact'"):
        mss.smooth(*mesh, modes=100, mode_count="by hand")


def test_what_does_not_fit_in_memory_is_refused_beforehand(monkeypatch):
    monkeypatch.setattr(memory, "available", lambda: 50_000)
    with pytest.raises(mss.TooLarge, match=r"smoothing 240 vertices needs 0\.0 GiB of memory, and 0\.0 GiB are"):
        mss.smooth(*CLOSED)
    monkeypatch.setattr(memory, "available", lambda: 10**9)
    assert mss.smooth(*CLOSED).residual < reconstruction.TOLERANCE


def test_progress_may_stop_the_work():
    def stop(fraction):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        mss.smooth(*CLOSED, progress=stop)

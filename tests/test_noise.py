"""What is noise: level, interval and kind, and the error of any filter."""

import numpy as np
import pymeshlab
import pytest

import meshlab_specsmooth as mss
from meshlab_specsmooth.geometry.surface import vertex_normals
from meshlab_specsmooth.noise.sample import sample
from tests.meshes import TETRAHEDRON, edge_of, flaws, kinds_of_noise, noisy, remeshed_box, sheet, torus

TORUS, BOX = torus(80, 40), remeshed_box()
NORMALS = vertex_normals(mss.Surface(*TORUS))


def true_level(mesh, clean):
    n = vertex_normals(mss.Surface(*clean))
    return np.sqrt((((mesh[0] - clean[0]) * n).sum(axis=1) ** 2).mean())


# of the box's vertices half are within two rings of an edge, and count for 0.03 edges of noise
@pytest.mark.parametrize(
    ("clean", "level"), [*((TORUS, s) for s in (0.05, 0.1, 0.2, 0.35, 0.5)), *((BOX, s) for s in (0.1, 0.2, 0.35, 0.5))]
)
def test_white_noise_is_found_within_fifteen_percent(clean, level):
    rough = noisy(clean, level)
    noise = mss.estimate_noise(*rough)
    assert noise.kind == "white"
    assert noise.level == pytest.approx(true_level(rough, clean), rel=0.15)
    assert noise.mean_edge == pytest.approx(edge_of(*rough))


@pytest.mark.parametrize("level", [0.5, 1.0])
def test_impulses_amid_white_noise_are_seen_and_removed(level):
    V, F = noisy(TORUS, 0.15 * level)
    rng = np.random.default_rng(4)
    hit = rng.random(len(V)) < 0.1
    V = V + NORMALS * (edge_of(*TORUS) * level * hit * rng.standard_normal(len(V)))[:, None]
    assert mss.estimate_noise(V, F).kind == "impulse"
    off = np.abs(((mss.denoise(V, F).vertices - TORUS[0]) * NORMALS).sum(axis=1)) / edge_of(*TORUS)
    assert np.sqrt((off**2).mean()) < 0.12 * level


@pytest.mark.no_cover
def test_the_interval_holds_the_level_nearly_always():
    held = []
    for seed in range(30):
        rough = noisy(TORUS, 0.2, seed)
        noise = mss.estimate_noise(*rough)
        held.append(noise.low <= 0.2 * edge_of(*TORUS) <= noise.high)
        assert noise.high < 1.15 * noise.low  # and says something
    assert np.mean(held) >= 0.9


@pytest.mark.parametrize("clean", [TORUS, BOX], ids=["torus", "box"])
def test_a_clean_shape_has_next_to_none(clean):
    noise = mss.estimate_noise(*clean)
    assert noise.kind == "none"
    assert noise.level < 0.01 * noise.mean_edge


@pytest.mark.parametrize(("kind", "V"), [*kinds_of_noise(TORUS)])
def test_kinds_are_distinguished(kind, V):
    noise = mss.estimate_noise(V, TORUS[1])
    assert noise.kind == kind
    # all but the long waves of correlated noise are found
    off = 0.5 if kind == "correlated" else 0.15
    assert noise.level == pytest.approx(true_level((V, TORUS[1]), TORUS), rel=off)
    assert noise.low <= noise.level <= noise.high


def test_impulses_are_sampled_as_impulses_and_correlated_noise_as_correlated():
    found = {kind: mss.estimate_noise(V, TORUS[1]) for kind, V in kinds_of_noise(TORUS)}
    L = mss.assemble(*TORUS).L
    assert found["impulse"].impulse_density == pytest.approx(0.2, rel=0.5)
    drawn = sample(L, NORMALS, found["impulse"], 0)
    assert (drawn != 0).mean() == pytest.approx(found["impulse"].impulse_density, rel=0.1)
    assert drawn.std() == pytest.approx(found["impulse"].level, rel=0.1)
    assert 0 < found["correlated"].correlated_level <= found["correlated"].level
    drawn = sample(L, NORMALS, found["correlated"], 0)
    assert drawn.std() == pytest.approx(found["correlated"].level, rel=0.1)
    beside = np.corrcoef((drawn - L @ drawn)[:, 0], drawn[:, 0])[0, 1]  # mean of the neighbors
    assert beside > 0.9
    assert all(
        found[kind].correlated_level == 0 and found[kind].impulse_density == 1 for kind in ("directional", "quantized")
    )


def test_the_evidence_of_white_noise_agrees_with_itself():
    noise = mss.estimate_noise(*noisy(TORUS, 0.3))
    assert noise.levels_by_power == pytest.approx([noise.level] * 4, rel=0.06)
    assert noise.levels_by_band[:3] == pytest.approx([noise.level] * 3, rel=0.1)
    assert noise.covariance == pytest.approx(np.eye(3), abs=0.2)
    assert abs(noise.kurtosis) < 0.4
    assert noise.outliers < 0.01


@pytest.mark.parametrize("scale", [1e-6, 1e6])
def test_it_scales_with_the_mesh(scale):
    V, F = noisy(TORUS, 0.2)
    one, scaled = mss.estimate_noise(V, F), mss.estimate_noise(V * scale, F)
    for name in ("level", "low", "high", "mean_edge", "levels_by_power", "levels_by_band"):
        assert np.array(getattr(scaled, name)) / scale == pytest.approx(np.array(getattr(one, name)), rel=1e-3)
    assert scaled.kind == one.kind


def test_it_is_the_same_each_time_and_leaves_its_input_alone():
    V, F = noisy(TORUS, 0.2)
    before = V.copy()
    assert mss.estimate_noise(V, F).level == mss.estimate_noise(V, F).level
    assert np.array_equal(V, before)


@pytest.mark.no_cover
@pytest.mark.parametrize("mesh", [TETRAHEDRON, *flaws(noisy(sheet(30, 30), 0.1)).values()])
def test_any_mesh_has_a_finite_level(mesh):
    noise = mss.estimate_noise(*mesh)
    assert np.isfinite([noise.level, noise.low, noise.high, noise.kurtosis]).all()
    assert np.isfinite(noise.covariance).all()


def filters(F):
    """Ours and MeshLab's, weak to strong."""
    last = {}

    def ours(weight):
        def smooth(V):
            last["result"] = mss.smooth(V, F, barycenter_weight=weight)
            return last["result"].vertices

        return smooth

    def native(name, **parameters):
        def smooth(V):
            ms = pymeshlab.MeshSet()
            ms.add_mesh(pymeshlab.Mesh(V, F))
            ms.apply_filter(name, **parameters)
            return ms.current_mesh().vertex_matrix()

        return smooth

    yield lambda V: V
    yield from (ours(w) for w in (1.0, 0.3, 0.1, 0.03))
    yield from (native("apply_coord_taubin_smoothing", stepsmoothnum=k) for k in (3, 10, 40))
    yield from (native("apply_coord_laplacian_smoothing", stepsmoothnum=k) for k in (1, 3, 10))


@pytest.mark.no_cover
@pytest.mark.parametrize("clean", [TORUS, BOX], ids=["torus", "box"])
def test_the_estimated_error_goes_with_the_true_one(clean):
    rough = noisy(clean, 0.25)
    n = vertex_normals(mss.Surface(*clean))
    estimated, true = [], []
    for smooth in filters(clean[1]):
        estimate = mss.estimate_error(smooth, *rough, probes=2)
        estimated.append(estimate.error)
        true.append(np.sqrt((((estimate.vertices - clean[0]) * n).sum(axis=1) ** 2).mean()))
    assert np.corrcoef(estimated, true)[0, 1] > 0.98
    assert true[int(np.argmin(estimated))] < 1.1 * min(true)


def test_the_error_of_doing_nothing_is_the_noise_and_of_a_known_filter_what_it_must_be():
    V, F = noisy(TORUS, 0.2)
    level = mss.estimate_noise(V, F).level
    nothing = mss.estimate_error(lambda V: V, V, F)
    assert nothing.error == pytest.approx(level, rel=1e-6)
    assert nothing.noise.level == pytest.approx(level)
    assert np.array_equal(nothing.vertices, V)
    # a shift along x by c: (c n_x)^2 on top, in the mean
    shifted = mss.estimate_error(lambda V: V + [0.1, 0, 0], V, F, noise=0.0)
    assert shifted.risk == pytest.approx(0.01 * (NORMALS[:, 0] ** 2).mean(), rel=0.02)
    assert shifted.error == pytest.approx(np.sqrt(shifted.risk))


def test_more_probes_scatter_less_and_a_level_can_be_given():
    V, F = noisy(TORUS, 0.2)
    ops = mss.assemble(*TORUS)

    def smooth(X):
        return X - 0.5 * (ops.L @ X)

    few, many = (mss.estimate_error(smooth, V, F, probes=k) for k in (2, 16))
    assert np.isnan(mss.estimate_error(smooth, V, F, probes=1).standard_error)
    assert 0 < many.standard_error < 0.1 * many.risk
    assert many.risk == pytest.approx(few.risk, abs=4 * (few.standard_error + many.standard_error))
    given = mss.estimate_error(smooth, V, F, noise=many.noise.level)
    assert given.risk == pytest.approx(mss.estimate_error(smooth, V, F, noise=many.noise).risk)
    assert given.noise.kind == "white"


@pytest.mark.parametrize("scale", [1e-6, 1e6])
def test_the_error_scales_with_the_mesh(scale):
    V, F = noisy(TORUS, 0.2)
    one, scaled = (mss.estimate_error(lambda X: 0.9 * X, V * k, F) for k in (1.0, scale))
    assert scaled.error / scale == pytest.approx(one.error, rel=1e-3)


def raising(V):
    raise ZeroDivisionError("by nothing")


@pytest.mark.parametrize(
    ("smooth", "message"),
    [
        (raising, "ZeroDivisionError: by nothing"),
        (lambda V: V[:-1], "returned shape"),
        (lambda V: V * np.nan, "not finite: row 0"),
        (lambda V: "surface", "returned dtype <U7"),
    ],
)
def test_filters_that_fail_are_named(smooth, message):
    with pytest.raises(mss.FilterFailed, match=message):
        mss.estimate_error(smooth, *TORUS)


@pytest.mark.parametrize("given", [{"noise": -1.0}, {"noise": np.nan}, {"probes": 0}, {"probes": True}])
def test_bad_parameters_are_refused(given):
    with pytest.raises(mss.InvalidParameter, match=next(iter(given))):
        mss.estimate_error(lambda V: V, *TORUS, **given)


def test_bad_surfaces_are_refused():
    with pytest.raises(mss.InvalidSurface):
        mss.estimate_noise([[0, 0, np.nan]], [[0, 0, 0]])


def test_an_error_that_cannot_be_distinguished_from_zero_is_not_called_zero():
    noise = mss.estimate_noise(*noisy(TORUS, 0.2))
    least, edge = noise.resolution, noise.mean_edge
    assert 0 < least < 0.5 * noise.level
    assert noise.format_error(0.0) == noise.format_error(0.9 * least) == f"at most {least / edge:.3f}"
    assert noise.format_error(2 * least) == f"{2 * least / edge:.3f}"

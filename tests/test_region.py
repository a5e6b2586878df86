"""Where the filters act: boundaries, selections, features, bands."""

import numpy as np
import pytest

import meshlab_specsmooth as mss
from meshlab_specsmooth.comparison.noise import gaussian
from meshlab_specsmooth.geometry.surface import boundary_vertices, edges, face_vectors
from meshlab_specsmooth.operators.boundary import BLENDING_RINGS
from meshlab_specsmooth.spectral.response import response
from tests.meshes import rough, sheet, torus, torus_eigenvalue, torus_graph, wave


def open_scan(nx=100, ny=40):
    """A torus with a third cut out: two closed rims, and its faces."""
    V, F = torus(nx, ny)
    at = F // ny
    F = F[(at.max(axis=1) < 0.6 * nx) & (at.min(axis=1) >= 0)]
    used = np.unique(F)
    return V[used], np.searchsorted(used, F)


def rim_length(surface):
    ends, count = edges(surface)
    rim = surface.vertices[ends[count == 1]]
    return np.linalg.norm(rim[:, 0] - rim[:, 1], axis=1).sum()


def enclosed_area(surface):
    """Length of the surface's vector area, which depends on its rim alone."""
    return np.linalg.norm(face_vectors(surface).sum(axis=0)) / 2


CLEAN = mss.Surface(*open_scan())
NOISY = gaussian(CLEAN, 0.2, seed=1)
RIM = boundary_vertices(CLEAN)


def smoothed(**given):
    return mss.Surface(mss.smooth(NOISY, CLEAN.faces, **given).vertices, CLEAN.faces)


def error(surface, where):
    return np.sqrt(((surface.vertices - CLEAN.vertices)[where] ** 2).sum(axis=1).mean())


@pytest.mark.parametrize("weight", [1.0, 0.3])
@pytest.mark.parametrize("scan", [(NOISY, CLEAN.faces), rough(sheet(30, 20))], ids=["torus", "sheet"])
def test_at_the_default_the_rim_of_a_scan_keeps_its_length_and_area(scan, weight):
    before = mss.Surface(*scan)
    result = mss.Surface(mss.smooth(*scan, barycenter_weight=weight).vertices, before.faces)
    assert rim_length(result) == pytest.approx(rim_length(before), rel=0.01)
    assert enclosed_area(result) == pytest.approx(enclosed_area(before), rel=0.01)
    assert (result.vertices != before.vertices).any()


@pytest.mark.parametrize("weight", [1.0, 0.3])
def test_as_a_curve_a_noisy_rim_takes_the_length_that_it_had_without_noise(weight):
    result = smoothed(boundary="curve", barycenter_weight=weight)
    noisy = mss.Surface(NOISY, CLEAN.faces)
    assert rim_length(noisy) > 1.1 * rim_length(CLEAN)  # noise makes a curve longer
    assert rim_length(result) == pytest.approx(rim_length(CLEAN), rel=0.02)
    assert enclosed_area(result) == pytest.approx(enclosed_area(noisy), rel=0.01)


def test_as_a_curve_the_rim_of_a_clean_scan_stays_within_a_percent():
    V, F = open_scan()
    result = mss.Surface(mss.smooth(V, F, boundary="curve", barycenter_weight=0.3).vertices, F)
    assert rim_length(result) == pytest.approx(rim_length(CLEAN), rel=0.01)
    assert enclosed_area(result) == pytest.approx(enclosed_area(CLEAN), rel=0.01)


def test_small_holes_are_not_closed():
    V, F = rough(torus(60, 30))
    F = F[~(F == 500).any(axis=1)]  # a hole of six edges
    rim = boundary_vertices(mss.Surface(V, F))
    assert rim.sum() == 6
    result = mss.smooth(V, F, boundary="curve", barycenter_weight=0.1)
    assert np.array_equal(result.vertices[rim], V[rim])
    # and where waves are short enough to go round, it is smoothed
    short = mss.smooth(V, F, boundary="curve", wavelength=3.5 * result.mean_edge)
    assert (short.vertices[rim] != V[rim]).all(axis=1).any()


def test_the_curve_is_the_best_of_the_three_and_free_draws_the_rim_inward():
    results = {name: smoothed(boundary=name, barycenter_weight=0.3) for name in ("free", "fixed", "curve")}
    at_rim = {name: error(result, RIM) for name, result in results.items()}
    everywhere = {name: error(result, slice(None)) for name, result in results.items()}
    assert at_rim["curve"] < 0.6 * min(at_rim["fixed"], at_rim["free"])
    assert everywhere["curve"] < min(everywhere["fixed"], everywhere["free"])


def test_a_fixed_boundary_stays_to_the_bit_and_a_curve_moves_by_itself():
    fixed = mss.smooth(NOISY, CLEAN.faces, boundary="fixed")
    assert np.array_equal(fixed.vertices[RIM], NOISY[RIM])
    assert (fixed.vertices[~RIM] != NOISY[~RIM]).any(axis=1).all()
    # the curve does not feel the surface: other coordinates inside leave it as it is
    inside = np.where(RIM[:, None], NOISY, 0.9 * NOISY)
    result = mss.smooth(NOISY, CLEAN.faces, wavelength=2.0, barycenter_weight=0.1, boundary="curve")
    other = mss.smooth(inside, CLEAN.faces, wavelength=2.0, barycenter_weight=0.1, boundary="curve")
    scale = np.linalg.norm(result.vertices[RIM] - NOISY[RIM])
    moved, moved_too = (r.vertices[RIM] - NOISY[RIM] for r in (result, other))
    assert np.linalg.norm(moved - moved_too) < 0.02 * scale


def test_a_closed_surface_has_no_boundary_to_treat():
    V, F = rough(torus())
    free = mss.smooth(V, F, boundary="free").vertices
    for boundary in ("fixed", "curve"):
        assert np.array_equal(mss.smooth(V, F, boundary=boundary).vertices, free)


def test_a_rim_of_no_length_is_left_alone():
    V, F = sheet(6, 5)
    V[boundary_vertices(mss.Surface(V, F))] = V[0]
    result = mss.smooth(V, F, boundary="curve", modes=4)
    assert np.isfinite(result.vertices).all()


def selection():
    return NOISY[:, 0] > 1.0


@pytest.mark.parametrize("smoother", [mss.smooth, mss.low_pass, mss.enhance])
def test_unselected_vertices_stay_to_the_bit(smoother):
    mask = selection()
    V = NOISY.copy()
    V[~mask & (np.arange(len(V)) % 2 == 0), 2] = -0.0  # the sign of a zero is a bit too
    result = smoother(V, CLEAN.faces, mask=mask)
    assert result.vertices[~mask].tobytes() == V[~mask].tobytes()
    assert (result.vertices[mask] != V[mask]).any(axis=1).mean() > 0.9


@pytest.mark.parametrize("smoother", [mss.smooth, mss.low_pass])
def test_there_is_no_seam_at_the_rim_of_a_selection(smoother):
    """Across the rim the displacement grows slowly: its steps along edges are smaller there than inside."""
    V, F = torus(60, 30)
    V = V * (1 + 0.05 * np.sin(9 * V[:, :1]))  # waves that the low-pass removes: a smooth displacement
    mask = V[:, 0] > 0
    displacement = (
        smoother(
            V, F, mask=mask, wavelength=3.0, **({"barycenter_weight": 0.1} if smoother is mss.smooth else {})
        ).vertices
        - V
    )
    ends, _ = edges(mss.Surface(V, F))
    step = np.linalg.norm(displacement[ends[:, 0]] - displacement[ends[:, 1]], axis=1)
    across = mask[ends[:, 0]] != mask[ends[:, 1]]
    within = mask[ends].all(axis=1)
    assert 0 < step[across].max() < 0.5 * step[within].max()


def test_a_selection_of_all_or_nothing():
    n = len(NOISY)
    everything = mss.smooth(NOISY, CLEAN.faces, mask=np.ones(n, dtype=bool)).vertices
    assert everything == pytest.approx(mss.smooth(NOISY, CLEAN.faces).vertices, abs=1e-7)
    assert np.array_equal(mss.smooth(NOISY, CLEAN.faces, mask=np.zeros(n)).vertices, NOISY)
    deep = mss.low_pass(NOISY, CLEAN.faces, mask=np.ones(n, dtype=bool)).vertices
    assert deep == pytest.approx(mss.low_pass(NOISY, CLEAN.faces).vertices, abs=1e-12)


def test_the_plain_low_pass_is_whole_a_few_rings_inside_a_selection():
    V, F = rough(torus(60, 30))
    mask = (np.arange(60) < 20).repeat(30)
    whole, part = mss.low_pass(V, F, modes=40).vertices, mss.low_pass(V, F, modes=40, mask=mask).vertices
    deep = ((np.arange(60) >= BLENDING_RINGS) & (np.arange(60) < 20 - BLENDING_RINGS)).repeat(30)
    assert part[deep] == pytest.approx(whole[deep], abs=1e-12)
    assert np.linalg.norm(part[mask] - whole[mask]) > 1e-6


def carved(level=0.15):
    """A sheet with letters' strokes carved into a part of it, noisy; and where they are."""
    nx, ny = 90, 60
    V, F = sheet(nx, ny)
    V[:, 2] = 0
    i, j = V[:, 0], V[:, 1]
    region = (abs(i - 45) < 25) & (abs(j - 30) < 16)
    V[:, 2] -= region * (0.8 * (np.sin(i * 0.9) > 0.4))
    return *rough((V, F), level, seed=3), region


def normals(V, F):
    vectors = face_vectors(mss.Surface(V, F))
    return vectors / np.linalg.norm(vectors, axis=1)[:, None]


def angles(V, W, F):
    return np.degrees(np.arccos(np.clip((normals(V, F) * normals(W, F)).sum(axis=1), -1, 1)))


def test_marked_detail_is_kept_while_the_rest_is_smoothed():
    V, F, region = carved()
    result = mss.smooth(V, F, features=region, feature_gain=1.0, barycenter_weight=0.3)
    turned = angles(V, result.vertices, F)
    i, j = V[F, 0].mean(axis=1), V[F, 1].mean(axis=1)
    well_inside = (abs(i - 45) < 19) & (abs(j - 30) < 10)
    well_outside = (abs(i - 45) > 31) | (abs(j - 30) > 22)
    assert turned[well_inside].max() < 2
    flat = normals(result.vertices, F)[well_outside, 2]
    noisy = normals(V, F)[well_outside, 2]
    assert np.degrees(np.arccos(flat)).mean() < 0.4 * np.degrees(np.arccos(noisy)).mean()


def test_feature_gain_goes_from_smoothed_over_kept_to_enhanced():
    V, F, region = carved()
    plain = mss.smooth(V, F, barycenter_weight=0.3).vertices
    by_gain = {g: mss.smooth(V, F, features=region, feature_gain=g, barycenter_weight=0.3).vertices for g in (0, 1, 2)}
    assert np.array_equal(by_gain[0], plain)

    def roughness(W):
        deep = (abs(V[:, 0] - 45) < 19) & (abs(V[:, 1] - 30) < 10)
        return W[deep, 2].std()

    assert roughness(by_gain[0]) < roughness(by_gain[1]) < roughness(by_gain[2])
    assert roughness(by_gain[1]) == pytest.approx(roughness(V), rel=0.02)
    halfway = mss.smooth(V, F, features=0.5 * region, barycenter_weight=0.3).vertices
    assert roughness(by_gain[0]) < roughness(halfway) < roughness(by_gain[1])


@pytest.mark.parametrize("method", ["exact", "chebyshev"])
@pytest.mark.parametrize("gain", [0.0, 1.0, 3.0])
def test_enhancement_has_the_transfer_function_of_the_book(method, gain):
    nx, ny = 18, 12
    three = [(1, 0), (3, 2), (9, 6)]  # below, inside and above the band
    V = np.stack([wave(p, q, nx, ny) for p, q in three], axis=1)
    ops = mss.assemble(V, torus_graph(nx, ny), weld=False)
    edge = np.ldexp(ops.mean_edge, ops.exponent)
    low, high, weight = 0.1, 0.9, 0.2
    result = mss.enhance(
        ops,
        longest=np.pi / np.sqrt(low) * edge,
        shortest=np.pi / np.sqrt(high) * edge,
        gain=gain,
        response="gaussian",
        barycenter_weight=weight,
        method=method,
    )
    values = np.array([torus_eigenvalue(p, q, nx, ny) for p, q in three])
    band = response("gaussian", high)(values) * (1 - response("gaussian", low)(values))
    b = 2 - 4 * values / 3
    expected = (values**2 * (1 + (gain - 1) * band) + weight**2 * b) / (values**2 + weight**2 * b)
    assert result.vertices == pytest.approx(expected * V, abs=2e-3)
    assert result.cutoff == pytest.approx(high)
    if gain == 3:
        assert expected[1] > 1.5


def test_enhancement_acts_on_features_alone_where_there_are_some():
    V, F, region = carved(0.02)
    everywhere, there = mss.enhance(V, F, gain=3).vertices, mss.enhance(V, F, gain=3, features=region).vertices
    deep = (abs(V[:, 0] - 45) < 15) & (abs(V[:, 1] - 30) < 8)
    assert V[deep, 2].std() * 1.2 < there[deep, 2].std()
    assert there[deep, 2].std() == pytest.approx(everywhere[deep, 2].std(), rel=0.1)
    far = (abs(V[:, 0] - 45) > 38) | (abs(V[:, 1] - 30) > 27)
    edge = 1.0
    assert abs(there - V)[far].max() < 0.02 * edge


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"gain": -1.0}, "gain is -1.0"),
        ({"longest": 2.0, "shortest": 3.0}, "the first must be the smaller one"),
        ({"longest": -2.0}, "longest is -2.0; it must be a positive length"),
        ({"method": "qr"}, "method is 'qr'"),
        ({"barycenter_weight": 0.0}, "barycenter_weight is 0.0"),
    ],
)
def test_enhancement_out_of_range_is_refused(given, words):
    with pytest.raises(mss.InvalidParameter, match=words):
        mss.enhance(*rough(sheet()), **given)

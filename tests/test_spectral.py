import functools

import numpy as np
import pytest

import meshlab_specsmooth as mss
from meshlab_specsmooth.graph.protocols import COLUMNS
from meshlab_specsmooth.operators.reconstruction import error_gain
from meshlab_specsmooth.spectral import chebyshev, density, eigenbasis
from meshlab_specsmooth.spectral.cutoff import WEYL, Cutoff, from_wavelength, lattice_fraction, wavelength_in_edges
from meshlab_specsmooth.spectral.design import design
from meshlab_specsmooth.spectral.response import RESPONSES, band, from_gain, heat, ideal, response
from tests.meshes import (
    TETRAHEDRON,
    TETRAHEDRON_SPECTRUM,
    rough,
    sheet,
    together,
    torus,
    torus_eigenvalue,
    torus_graph,
    torus_spectrum,
    twin,
    uniform,
)

SPECTRUM = np.linspace(0, 2, 4001)


def flat(nx, ny):
    return uniform((np.zeros((nx * ny, 3)), torus_graph(nx, ny)))


def flat_torus(nx, ny):
    return flat(nx, ny).graph.symmetric_laplacian()


@pytest.mark.no_cover
@pytest.mark.parametrize("name", RESPONSES)
@pytest.mark.parametrize("cutoff", [1e-4, 0.005, 0.1, 1.3])
@pytest.mark.parametrize("tolerance", [1e-2, 1e-7])
def test_the_series_is_as_close_as_it_says_and_it_says_within_the_tolerance(name, cutoff, tolerance):
    h = response(name, cutoff)
    series = chebyshev.approximate(h, tolerance)
    off = abs(series(SPECTRUM) - h.smooth_gain(SPECTRUM))
    assert off[looked_at(h)].max() <= series.error <= tolerance


def looked_at(h):
    """Where a response is not in the middle of a step."""
    return np.all([(SPECTRUM <= low) | (SPECTRUM >= high) for low, high in h.transitions] or [SPECTRUM >= 0], axis=0)


@pytest.mark.parametrize("name", RESPONSES)
@pytest.mark.parametrize("weight", [0.02, 0.3, 1.0])
def test_an_error_may_be_large_where_little_of_it_is_passed_on(name, weight):
    h = response(name, 0.025)
    series = chebyshev.approximate(h, 1e-3, lambda x: error_gain(x, weight))
    off = abs(series(SPECTRUM) - h.smooth_gain(SPECTRUM))
    seen = (off * error_gain(SPECTRUM, weight))[looked_at(h)].max()
    assert 0.1e-3 < seen <= series.error <= 1e-3
    if weight == 1:
        assert series.degree < 0.75 * chebyshev.approximate(h, 1e-3).degree


def test_the_degree_is_about_the_least_that_reaches_the_tolerance():
    h = heat(0.1)
    series = chebyshev.approximate(h, 1e-4)
    shorter = chebyshev.ChebyshevSeries(series.coefficients[: -series.degree // 10 - 1], 0.0)
    assert abs(shorter(SPECTRUM) - h(SPECTRUM)).max() > 1e-4 >= series.error > 0.1e-4


def test_the_degree_grows_as_one_over_the_root_of_the_cutoff():
    degrees = [chebyshev.approximate(ideal(c), 1e-3).degree for c in (0.04, 0.01, 0.0025)]
    assert degrees[1] / degrees[0] == pytest.approx(2, rel=0.1)
    assert degrees[2] / degrees[1] == pytest.approx(2, rel=0.1)


def test_a_cutoff_that_no_polynomial_can_follow_is_refused():
    with pytest.raises(mss.InvalidParameter, match="raise the cut-off"):
        chebyshev.approximate(ideal(1e-9), 1e-3)


@pytest.mark.parametrize("h", [heat(0.2), ideal(0.5), band(heat(0.1), heat(1.0)), ~heat(2.0) * ~heat(2.0)])
def test_applying_the_series_is_applying_it_to_the_eigenvalues(h):
    L = uniform(rough(sheet(7, 6)))
    values, U = np.linalg.eigh(L.graph.symmetric_laplacian().toarray())
    root = np.sqrt(L.degree)
    X = np.random.default_rng(1).standard_normal((len(values), 2))
    series = chebyshev.approximate(h, 1e-5)
    expected = U @ (series(values)[:, None] * (U.T @ (X * root))) / root
    assert series.apply(L, X) == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize("degree", [0, 1, 2])
def test_the_shortest_series(degree):
    L = flat(5, 4)
    series = chebyshev.ChebyshevSeries(np.ones(degree + 1), 0.0)
    X = np.random.default_rng(1).standard_normal((20, 1))
    T = L @ np.eye(20) - np.eye(20)
    powers = [np.eye(20), T, 2 * T @ T - np.eye(20)]
    assert series.apply(L, X) == pytest.approx(sum(powers[: degree + 1]) @ X)


def test_the_basis_reaches_just_beyond_the_cutoff():
    S = flat_torus(30, 20)
    known = torus_spectrum(30, 20)
    for eigenvalue in (0.05, 0.4, 1.2, 1.9):
        # a guess of one mode is far too few, and must not be trusted
        basis = eigenbasis.up_to(S, Cutoff(eigenvalue, 1.0, 0.0))
        wanted = known[known <= eigenvalue]
        assert len(basis.eigenvalues) >= min(len(wanted) + 1, len(known))
        assert basis.eigenvalues[: len(wanted)] == pytest.approx(wanted, abs=1e-10)


def test_a_basis_that_does_not_fit_is_refused_with_its_size(monkeypatch):
    monkeypatch.setattr(eigenbasis, "MEMORY_LIMIT", 10**6)
    with pytest.raises(mss.TooLarge, match=r"400 eigenvectors of 1200 vertices need 0.0 GiB .* use method='chebyshev'"):
        eigenbasis.lowest(flat_torus(40, 30), 400)


def test_the_cutoff_of_a_basis_lies_between_the_eigenvalues_kept_and_dropped():
    basis = eigenbasis.full(flat_torus(9, 7))
    known = torus_spectrum(9, 7)
    cutoff = basis.cutoff(7)
    assert (known <= cutoff.eigenvalue).sum() == 7
    assert basis.cutoff(63).eigenvalue == 2
    two = eigenbasis.full(twin(together(TETRAHEDRON, TETRAHEDRON)))
    assert two.kept(1) == two.cutoff(1).modes == 2  # both lowest eigenvalues are zero
    assert two.kept(3) == 8  # and all others are 4/3


def irregular_torus(nx, ny):
    """Every second diagonal turned at random: valences 3 to 9."""
    F, turned = torus_graph(nx, ny), np.random.default_rng(5).random(nx * ny) < 0.5
    (a, b, c), d = F[: nx * ny].T, F[nx * ny :, 2]
    other = np.concatenate([np.stack([a, b, d], axis=1)[turned], np.stack([b, c, d], axis=1)[turned]])
    return torus(nx, ny)[0], np.concatenate([F[np.tile(~turned, 2)], other])


MANY_MODES = {
    "closed": lambda: uniform((np.zeros((120 * 90, 3)), torus_graph(120, 90))),
    "irregular": lambda: uniform(irregular_torus(40, 28)),
    "open": lambda: uniform(sheet(40, 28)),
    "long and narrow": lambda: uniform(sheet(180, 6)),
    "many components": lambda: uniform(together(torus(60, 40), *[TETRAHEDRON] * 200)),
    "loose": lambda: uniform(together(*[TETRAHEDRON] * 300)),
}
SHARES = [0.004, 0.02, 0.1, 0.4, 0.9]
# where all but the zeros are one eigenvalue there is no cut-off between them
APART = [name for name in MANY_MODES if name != "loose"]
# surfaces as broad as long; on others the waves come in rungs, or are the same on every component
BROAD = ["closed", "irregular", "open"]


# in closed form, of graphs regular enough; of the others by the dense solver
SPECTRA = {
    "closed": lambda: torus_spectrum(120, 90),
    "many components": lambda: np.sort(np.concatenate([torus_spectrum(60, 40), *[TETRAHEDRON_SPECTRUM] * 200])),
    "loose": lambda: np.sort(np.tile(TETRAHEDRON_SPECTRUM, 300)),
}


@functools.cache
def eigenvalues(name):
    if name in SPECTRA:
        return SPECTRA[name]()
    return np.linalg.eigvalsh(MANY_MODES[name]().graph.symmetric_laplacian().toarray())


@functools.cache
def measured(name):
    return density.estimate_density(MANY_MODES[name]())


def miscount(name, share, found=None):
    """Modes below the cut-off for this share of all, less those asked for; and the cut-off."""
    known = eigenvalues(name)
    cutoff = (found or measured(name)).cutoff(max(1, int(share * len(known))))
    return np.searchsorted(known, cutoff.eigenvalue) - cutoff.modes, cutoff


@pytest.mark.no_cover
@pytest.mark.parametrize("name", APART)
@pytest.mark.parametrize("share", SHARES)
def test_modes_are_counted_within_the_stated_error_without_eigenvectors(name, share):
    error, cutoff = miscount(name, share)
    assert abs(error) < 3.5 * cutoff.error * cutoff.modes + 1


@pytest.mark.no_cover
@pytest.mark.parametrize("name", BROAD)
@pytest.mark.parametrize("share", SHARES)
def test_modes_are_counted_within_two_per_cent_and_the_scatter_of_eigenvalues(name, share):
    error, cutoff = miscount(name, share)
    # no smooth law comes nearer: on these surfaces eigenvalues scatter by 1 to 2 modes about it, rarely twice that
    assert abs(error) < 0.02 * cutoff.modes + 4


@pytest.mark.no_cover
def test_the_stated_error_is_as_large_as_the_errors_are(monkeypatch):
    ratios = []
    for seed in range(3):
        monkeypatch.setattr(density, "SEED", 100 + seed)
        for name in APART:
            found = density.estimate_density(MANY_MODES[name]())
            for share in SHARES:
                error, cutoff = miscount(name, share, found)
                ratios.append(error / (cutoff.error * cutoff.modes))
    assert 0.5 < np.sqrt(np.mean(np.square(ratios))) < 1.5


@pytest.mark.parametrize("name", MANY_MODES)
def test_zeros_stay_together(name):
    known, found = eigenvalues(name), measured(name)
    zeros = (known < 1e-9).sum()
    assert found.zeros == zeros
    for modes in (1, zeros, zeros + 1):
        cutoff = found.cutoff(modes)
        assert cutoff.modes == max(modes, zeros)
        assert cutoff.eigenvalue > 0
        assert np.searchsorted(known, cutoff.eigenvalue) >= zeros


@pytest.mark.parametrize("name", MANY_MODES)
def test_more_modes_have_a_higher_cutoff(name):
    found = measured(name)
    cutoffs = [found.cutoff(modes).eigenvalue for modes in range(1, found.n + 1, 97)]
    assert (np.diff(cutoffs) >= 0).all()
    assert found.cutoff(found.n).eigenvalue == 2


def test_all_modes_of_a_large_mesh_are_everything():
    L = MANY_MODES["open"]()
    cutoff = density.cutoff_of_modes(L, L.size)
    assert (cutoff.eigenvalue, cutoff.modes, cutoff.error) == (2, L.size, 0)


@pytest.mark.parametrize("name", BROAD)
def test_the_stated_error_is_small_where_modes_are_many(name):
    assert measured(name).cutoff(1000).error < 0.01


@pytest.mark.no_cover
def test_a_large_mesh_needs_few_random_vectors():
    # 134 thousand vertices, one block: the regular torus, whose eigenvalues are known
    nx, ny = 402, 333
    known, found = torus_spectrum(nx, ny), density.estimate_density(flat(nx, ny))
    assert found.probes == COLUMNS
    for modes in (300, 1000, 10_000, 60_000):
        cutoff = found.cutoff(modes)
        assert np.searchsorted(known, cutoff.eigenvalue) == pytest.approx(modes, rel=0.02)
        assert cutoff.error < 0.01


@pytest.mark.parametrize("n", [10, 1001, 5000, 28_000, 37_000, 134_000, 10**6, 10**8])
def test_random_vectors_come_in_whole_blocks_and_are_fewer_on_larger_meshes(n):
    assert density.probes_for(n) % COLUMNS == 0
    assert COLUMNS <= density.probes_for(2 * n) <= density.probes_for(n)


def test_the_lattice_has_the_modes_of_a_large_regular_torus():
    known = torus_spectrum(400, 401)
    x = np.array([0.01, 0.1, 0.5, 1.0, 1.3, 1.45])
    assert lattice_fraction(x) == pytest.approx(np.searchsorted(known, x) / len(known), rel=2e-3, abs=1e-4)
    # and Weyl's law below any eigenvalue that a mesh could have
    assert lattice_fraction(np.array([1e-12])) == pytest.approx(1e-12 / WEYL, rel=1e-3)


def test_counting_is_seeded():
    L = flat(40, 30)
    assert density.cutoff_of_modes(L, 50) == density.cutoff_of_modes(L, 50)


def test_measuring_once_serves_any_number_of_modes():
    L = flat(40, 30)
    found = density.estimate_density(L)
    for modes in (1, 50, 700, 1200):
        assert found.cutoff(modes) == density.cutoff_of_modes(L, modes)


@pytest.mark.parametrize("columns", [1, 3, 7])
def test_energies_in_bands_do_not_depend_on_blocks(columns):
    L = flat(12, 9)
    X = np.random.default_rng(1).standard_normal((108, columns))
    angles = np.linspace(0, np.pi, 5)
    one_by_one = sum(density.band_energies(L, X[:, [i]], angles) for i in range(columns))
    assert density.band_energies(L, X, angles) == pytest.approx(one_by_one)
    assert density.band_energies(L, X, angles).sum() == pytest.approx((L.degree * X**2).sum())


def test_wavelength_and_eigenvalue_agree_with_a_long_wave_on_the_regular_torus():
    # a wave along one lattice direction of a regular triangulation: spacing between its crests is n sqrt(3)/2 edges
    n = 60
    eigenvalue = torus_eigenvalue(1, 0, n, n)
    assert wavelength_in_edges(eigenvalue) == pytest.approx(n * np.sqrt(3) / 2, rel=1e-2)
    assert from_wavelength(n * np.sqrt(3) / 2, n * n).eigenvalue == pytest.approx(eigenvalue, rel=1e-2)


def test_waves_shorter_than_the_mesh_can_carry_keep_everything():
    assert from_wavelength(0.1, 500).eigenvalue == 2
    assert from_wavelength(0.1, 500).modes == pytest.approx(500)
    assert from_wavelength(1e6, 500).modes == 1


@pytest.mark.parametrize(("by", "size"), [("modes", 40), ("wavelength", 6.0)])
@pytest.mark.parametrize("name", RESPONSES)
def test_both_methods_cut_off_at_the_same_place(by, size, name):
    L = uniform(rough(torus(20, 12)))
    exact, series = (design(L, RESPONSES[name], **{by: size}, method=m, tolerance=1e-4) for m in ("exact", "chebyshev"))
    assert exact.cutoff.eigenvalue == pytest.approx(series.cutoff.eigenvalue, rel=1e-9)
    assert (exact.method, exact.filter.degree, exact.filter.error) == ("exact", 0, 0)
    assert series.method == "chebyshev"
    assert 0 < series.filter.error < 1e-4
    assert series.filter.degree > 2


def test_the_automatic_method_is_exact_for_small_meshes_only():
    small, large = flat(10, 10), flat(40, 30)
    for L, method in ((small, "exact"), (large, "chebyshev")):
        assert design(L, ideal, modes=20, method="auto", tolerance=1e-3).method == method


def test_an_exact_step_keeps_as_many_modes_as_were_asked_for_and_those_equal_to_the_last():
    L = flat(40, 30)
    # 37, which splits four equal eigenvalues, becomes 39
    for asked, kept in ((35, 35), (37, 39), (39, 39)):
        filter_ = design(L, ideal, modes=asked, method="exact", tolerance=1e-3).filter
        assert np.trace(filter_.apply(L, np.eye(1200))) == pytest.approx(kept, abs=1e-8)


def test_all_modes_are_everything():
    L = flat(10, 10)
    X = np.random.default_rng(0).standard_normal((100, 1))
    for method in ("exact", "chebyshev"):
        filter_ = design(L, ideal, modes=100, method=method, tolerance=1e-3).filter
        assert filter_.apply(L, X) == pytest.approx(X)


def test_an_unknown_method_is_refused():
    with pytest.raises(mss.InvalidParameter, match="method is 'magic'"):
        design(flat(5, 5), ideal, modes=3, method="magic", tolerance=1e-3)


@pytest.mark.parametrize("name", RESPONSES)
@pytest.mark.parametrize("method", ["exact", "chebyshev"])
def test_a_response_that_is_given_is_that_of_its_family_at_the_cutoff(name, method):
    L = uniform(rough(torus(20, 12)))
    family = design(L, RESPONSES[name], wavelength=6.0, method=method, tolerance=1e-4)
    alone = design(L, response(name, family.cutoff.eigenvalue), method=method, tolerance=1e-4)
    assert alone.response.label == family.response.label
    assert (alone.cutoff.eigenvalue, alone.cutoff.modes) == pytest.approx(
        (family.cutoff.eigenvalue, family.cutoff.modes), rel=1e-9
    )
    X = np.random.default_rng(0).standard_normal((240, 3))
    assert np.array_equal(alone.filter.apply(L, X), family.filter.apply(L, X))


@pytest.mark.parametrize("method", ["exact", "chebyshev"])
@pytest.mark.parametrize("size", [{"modes": 40}, {"wavelength": 6.0}])
def test_a_family_of_ones_own_does_what_its_gain_says(method, size):
    L = uniform(rough(torus(20, 12)))
    values, U = np.linalg.eigh(L.graph.symmetric_laplacian().toarray())
    made = design(L, lambda c: from_gain(lambda x: 1 / (1 + x / c)), **size, method=method, tolerance=1e-6)
    assert made.response.cutoff == pytest.approx(made.cutoff.eigenvalue)
    X, root = np.random.default_rng(0).standard_normal((240, 3)), np.sqrt(L.degree)
    expected = U @ (made.response(values)[:, None] * (U.T @ (X * root))) / root
    assert made.filter.apply(L, X) == pytest.approx(expected, abs=1e-5)


def test_only_the_modes_that_a_response_keeps_are_computed():
    L = flat(40, 30)
    S, known = L.graph.symmetric_laplacian(), torus_spectrum(40, 30)
    for h in (ideal(0.05), ideal(0.05) * heat(0.02), heat(0.02) * ideal(0.05)):
        basis = design(L, h, method="exact", tolerance=1e-3).filter.basis
        assert (known <= 0.05).sum() < len(basis.eigenvalues) < S.shape[0]
    for family in (ideal, lambda c: heat(c) * ideal(c)):
        basis = design(L, family, modes=20, method="exact", tolerance=1e-3).filter.basis
        assert 20 < len(basis.eigenvalues) < S.shape[0]


def test_a_family_that_vanishes_above_some_cutoffs_only_is_given_all_modes():
    L = flat(12, 9)
    made = design(L, lambda c: ideal(c) if c > 0.5 else heat(c), modes=5, method="exact", tolerance=1e-3)
    assert made.response.label.startswith("heat")
    assert len(made.filter.basis.eigenvalues) == 108


@pytest.mark.parametrize("size", [{}, {"modes": 3, "wavelength": 5.0}])
def test_a_family_needs_one_cutoff(size):
    with pytest.raises(mss.InvalidParameter, match="either modes or wavelength"):
        design(flat(5, 5), ideal, **size, method="auto", tolerance=1e-3)


def test_a_response_takes_no_cutoff():
    with pytest.raises(mss.InvalidParameter, match="takes neither"):
        design(flat(5, 5), heat(0.1), modes=3, method="auto", tolerance=1e-3)


@pytest.mark.parametrize("method", ["exact", "chebyshev"])
@pytest.mark.parametrize(
    ("family", "message"),
    [
        (lambda c: c, "must be a Response, or a function from a cut-off to one"),
        (lambda c: from_gain(lambda x: np.full_like(x, np.nan), "mine"), "response mine must have one finite gain"),
        (lambda c: from_gain(lambda x: 1.0, "mine"), "response mine must have one finite gain"),
    ],
)
def test_a_family_that_gives_no_usable_response_is_refused(family, message, method):
    with pytest.raises(mss.InvalidParameter, match=message):
        design(flat(5, 5), family, modes=3, method=method, tolerance=1e-3)

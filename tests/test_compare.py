import dataclasses
import json
import math

import numpy as np
import pymeshlab
import pytest

import meshlab_specsmooth as mss
from meshlab_specsmooth.cli import main
from meshlab_specsmooth.comparison import metrics, noise, runs
from meshlab_specsmooth.comparison.columns import MEASURES, format_value
from meshlab_specsmooth.comparison.distances import distances
from meshlab_specsmooth.comparison.experiment import SizeLimits, experiment
from meshlab_specsmooth.comparison.filter_specs import FILTER_SPECS, select_filters
from meshlab_specsmooth.comparison.measure_context import MeasureContext
from meshlab_specsmooth.errors import FilterFailed
from meshlab_specsmooth.meshlab import isolated_filter, meshset, projects
from meshlab_specsmooth.meshlab.descriptors import Length
from meshlab_specsmooth.meshlab.filters import FILTERS
from meshlab_specsmooth.meshlab.isolated_filter import FilterProcess, FilterRun
from meshlab_specsmooth.meshlab.measures import hausdorff, self_intersecting_faces
from meshlab_specsmooth.operators.assemble import assemble_surface
from meshlab_specsmooth.reports import compared as report
from meshlab_specsmooth.reports import export, page, page_tables, plots, scene
from tests.meshes import rough, sheet, together, torus

CLEAN = mss.Surface(*torus(60, 40))
QUICK = ["umbrella", "taubin", "hc", "low-pass", "automatic"]


@pytest.fixture(scope="module")
def found():
    return mss.compare(CLEAN, noise=0.2, filters=[*QUICK, "compute_mls_projection_apss"])


def with_row(found, row, values, **others):
    """The comparison with one of its rows changed."""
    changed = dataclasses.replace(row, values={**row.values, **values}, **others)
    return dataclasses.replace(found, rows=tuple(changed if each is row else each for each in found.rows))


# --- measures ---


def test_hausdorff_and_volume_agree_with_meshlab_and_with_exact_distances():
    rough_one = mss.Surface(*rough(torus(60, 40), 0.3))
    exact = max(distances(rough_one.vertices, CLEAN).max(), distances(CLEAN.vertices, rough_one).max())
    assert hausdorff(rough_one, CLEAN) == pytest.approx(exact, rel=1e-5)
    volumes = []
    for surface in (CLEAN, rough_one):
        ms = meshset.new(surface.vertices, surface.faces)
        volumes.append(ms.get_geometric_measures()["mesh_volume"])
    assert metrics.volume_change(rough_one, CLEAN) == pytest.approx(100 * (volumes[1] / volumes[0] - 1), rel=1e-4)


def test_area_agrees_with_meshlab():
    ms = meshset.new(CLEAN.vertices, CLEAN.faces)
    assert metrics.area(CLEAN) == pytest.approx(ms.get_geometric_measures()["surface_area"], rel=1e-5)


def test_boundary_length_is_that_of_the_rim():
    V, F = sheet(5, 4)
    V[:, 2] = 0
    assert metrics.boundary_length(mss.Surface(V, F)) == pytest.approx(2 * (4 + 3))
    assert metrics.boundary_length(CLEAN) == 0


def test_faces_that_run_through_others_are_counted():
    V = np.array([[0.0, 0, 0], [2, 0, 0], [0, 2, 0], [0.5, 0.5, -1], [0.5, 0.5, 1], [0.6, 0.4, 1]])
    assert self_intersecting_faces(V, [[0, 1, 2], [3, 4, 5]]).all()
    assert not self_intersecting_faces(CLEAN.vertices, CLEAN.faces).any()


def context_of(reference, given=None):
    given = reference if given is None else given
    return MeasureContext.of(reference, given, assemble_surface(given))


@pytest.mark.parametrize("level", [0.1, 0.3])
def test_white_noise_is_measured_at_its_level_and_shape_is_not(level):
    fine = mss.Surface(*torus(160, 100))
    context = context_of(fine)
    assert context.noise_left(fine) < 0.01
    for kind in (noise.gaussian, noise.along_normals):
        noisy = mss.Surface(kind(fine, level, 1), fine.faces)
        assert context.noise_left(noisy) == pytest.approx(level, rel=0.03)
        without_truth = context_of(noisy)  # noise makes edges longer
        measured = without_truth.noise_left(noisy) * without_truth.edge
        assert measured == pytest.approx(level * context.edge, rel=0.05)


def test_displacement_of_shape_is_measured_and_noise_is_averaged_out():
    context = context_of(CLEAN)
    grown = mss.Surface(CLEAN.vertices + 0.5 * context.edge * context.normals, CLEAN.faces)
    assert context.offset(grown) == pytest.approx(0.5, rel=1e-3)
    assert context.displacement(grown) == pytest.approx(0.5, rel=1e-9)
    assert context.feature_loss(grown) == pytest.approx(0.5, rel=0.1)
    assert context.feature_loss(mss.Surface(*rough(torus(60, 40), 0.5))) < 0.15
    assert context.noise_left(grown) < 0.02 + context.noise_left(CLEAN)


def test_vertices_without_an_edge_do_not_change_measures():
    V, F = rough(torus(20, 12))
    alone = np.concatenate([[[50.0, 0, 0]], V])
    values = []
    for X, faces in ((V, F), (alone, F + 1)):
        surface = mss.Surface(X, faces)
        context, result = context_of(surface), mss.Surface(X + 0.1 * np.sin(X), faces)
        names = ("noise_left", "feature_loss", "offset", "displacement")
        values.append([*(getattr(context, name)(result) for name in names), *context.curvature(result)[-len(V) :]])
    assert values[1] == pytest.approx(values[0], rel=1e-9)


@pytest.mark.parametrize("factor", [1e-6, 1e6])
def test_measures_do_not_depend_on_the_unit(factor):
    V, F = rough(torus(20, 12))
    plain, scaled = (mss.Surface(f * V, F) for f in (1.0, factor))
    clean = [mss.Surface(f * torus(20, 12)[0], F) for f in (1.0, factor)]
    for name in ("noise_left", "feature_loss", "offset", "displacement"):
        a, b = (getattr(context_of(c), name)(s) for c, s in zip(clean, (plain, scaled), strict=True))
        assert b == pytest.approx(a, rel=1e-8, abs=1e-12)
    assert metrics.triangle_quality(scaled) == pytest.approx(metrics.triangle_quality(plain))
    assert metrics.dihedral_deviation(scaled) == pytest.approx(metrics.dihedral_deviation(plain))


# --- filters in a process of their own ---


def test_a_filter_gives_the_same_in_another_process_which_survives_one_that_crashes():
    V, F = rough(torus(20, 12))
    with FilterProcess(F) as process:
        expected = isolated_filter.run(V, F, "apply_coord_taubin_smoothing", {"stepsmoothnum": 3})
        got = process.run(V, "apply_coord_taubin_smoothing", {"stepsmoothnum": 3})
        assert np.array_equal(got.vertices, expected.vertices)
        with pytest.raises(FilterFailed, match=r"crashed \(SIG[A-Z]+\)"):
            process.run(V, "compute_mls_projection_apss", {})
        with pytest.raises(FilterFailed, match="Parameter x not found"):
            process.run(V, "apply_coord_taubin_smoothing", {"x": 1})
        twice = process.run(V, "apply_coord_hc_laplacian_smoothing", {}, times=2)
        once = isolated_filter.run(V, F, "apply_coord_hc_laplacian_smoothing", {})
        again = isolated_filter.run(once.vertices, F, "apply_coord_hc_laplacian_smoothing", {})
        assert twice.vertices == pytest.approx(again.vertices, abs=1e-12)
        assert process.run(V, "apply_coord_spectral_smoothing", {}).output["barycenter_weight"] > 0


def test_a_first_run_comes_after_one_on_a_sphere_which_is_no_part_of_it(monkeypatch):
    V, F = rough(torus(20, 12))
    asked = []
    ask = FilterProcess._run
    monkeypatch.setattr(FilterProcess, "_run", lambda self, V, *rest: asked.append(V is None) or ask(self, V, *rest))
    with FilterProcess(F) as process:
        for kind in ("taubin", "taubin", "hc_laplacian"):
            process.run(V, f"apply_coord_{kind}_smoothing", {})
        assert asked == [True, False, False, True, False]
        process.end()  # a new process has run nothing
        process.run(V, "apply_coord_taubin_smoothing", {})
        assert asked[-2:] == [True, False]


def test_a_filter_that_takes_too_long_or_changes_the_faces_fails():
    V, F = rough(torus(20, 12))
    with FilterProcess(F, timeout=0.01) as process, pytest.raises(FilterFailed, match=r"took more than 0\.01 s"):
        process.run(V, "apply_coord_taubin_smoothing", {})
    with pytest.raises(FilterFailed, match="made .* vertices and .* faces"):
        isolated_filter.run(V, F, "meshing_surface_subdivision_midpoint", {"iterations": 1})


def test_shares_of_the_diagonal_are_meshlab_s_percentages():
    V, F = rough(torus(20, 12))
    ms = meshset.new(V, F)
    ms.apply_coord_laplacian_smoothing_scale_dependent(delta=pymeshlab.PercentageValue(0.3))
    ran = isolated_filter.run(V, F, "apply_coord_laplacian_smoothing_scale_dependent", {"delta": Length(0.003)})
    assert np.array_equal(ran.vertices, ms.current_mesh().vertex_matrix())


# --- the catalog of filters ---


def test_every_short_name_is_a_filter_and_its_strengths_are_its_parameters():
    V, F = rough(torus(20, 12))
    known = {*pymeshlab.filter_list(), *FILTERS}
    for key, spec in FILTER_SPECS.items():
        assert spec.key == key
        assert spec.filter in known
        gentle = spec.with_strength(spec.strength.values[0], len(V)) if spec.strength else spec
        ran = isolated_filter.run(V, F, gentle.filter, gentle.parameters, gentle.times)
        assert ran.vertices.shape == V.shape


@pytest.mark.parametrize(
    "wrong", ["taubn", "f(", "apply_coord_taubin_smoothing(3)", "apply_coord_x(a=open('x'))", "a.b(c=1)"]
)
def test_unknown_filters_are_refused(wrong):
    with pytest.raises(mss.InvalidParameter, match="it must be one of denoise, laplacian"):
        select_filters([wrong])


def test_denoise_comes_first_and_its_choice_becomes_its_parameters():
    first = select_filters()[0]
    assert (first.key, first.name, first.filter) == ("denoise", "specsmooth denoise", "apply_coord_spectral_denoising")
    chosen = {"start": "given", "strength": 2.0, "range_sigma": 0.3, "iterations": 5, "barycenter_weight": 0.4}
    fixed = runs.with_chosen(first, FilterRun(CLEAN.vertices, chosen, 0.1))
    assert (fixed.filter, fixed.parameters) == ("apply_coord_edge_aware_smoothing", chosen)
    # no setting of that filter is the isotropic one
    assert runs.with_chosen(first, FilterRun(CLEAN.vertices, chosen | {"iterations": 0}, 0.1)) is first


def test_filters_are_named_once_and_at_least_one():
    with pytest.raises(mss.InvalidParameter, match="twice"):
        select_filters(["taubin", "taubin"])
    with pytest.raises(mss.InvalidParameter, match="empty"):
        select_filters([])


# --- the comparison ---


def test_rows_are_what_the_filters_give(found):
    V = found.given.vertices
    rows = {row.name: row for row in found.rows}
    for key in ("taubin", "automatic"):
        spec = FILTER_SPECS[key]
        expected = isolated_filter.run(V, CLEAN.faces, spec.filter, spec.parameters)
        row = rows[spec.name]
        # ours sums over threads
        assert row.surface.vertices == pytest.approx(expected.vertices, abs=1e-9)
        assert row.values["normal_error"] == pytest.approx(metrics.normal_error(row.surface, CLEAN))
        assert row.values["surface_error"] == pytest.approx(metrics.surface_error(row.surface, CLEAN))
        assert row.values["volume"] == pytest.approx(metrics.volume_change(row.surface, CLEAN))
    given = rows["as given"].values
    assert given["estimated_error"] == pytest.approx(found.noise.level / found.edge)
    assert given["noise_removed"] == 0
    assert given["displacement"] == 0


def test_a_filter_that_crashes_is_a_row_that_says_so(found):
    row = found.rows[-1]
    assert row.failure.startswith("crashed")
    assert row.surface is None
    assert row is found.ranked[-1]
    assert any("Failed on this mesh: compute_mls_projection_apss" in reason for reason in found.reasons())
    assert "crashed" in str(found)
    assert "crashed" in found._repr_html_()


def test_estimated_errors_are_near_the_true_ones_and_rank_alike(found):
    rows = [row for row in found.rows if not row.failure]
    for row in rows:
        assert row.values["estimated_error"] == pytest.approx(row.values["true_error"], rel=0.1, abs=0.03)
    assert found.correlation > 0.99
    assert found.trusted
    assert found.closest is min(rows, key=lambda row: row.values["true_error"])
    assert found.choice is found.best
    assert found.closest in (found.best, *found.tied)
    assert found.best.gap == 0
    assert found.tied[0] is found.ranked[1]


@pytest.mark.no_cover
def test_for_correlated_noise_there_is_no_choice_without_the_truth():
    V, F = torus(120, 80)
    context = context_of(mss.Surface(V, F))
    shared = context.average(np.random.default_rng(3).standard_normal(V.shape), 4)[:, :1]
    X = V + 0.3 * context.edge / shared.std() * shared * context.normals
    blind = mss.compare((X, F), filters=["umbrella", "taubin"])
    assert (blind.noise.kind, blind.trusted) == ("correlated", False)
    assert (blind.choice, blind.closest) == (None, None)
    known = mss.compare((X, F), ground_truth=(V, F), filters=["umbrella", "taubin"])
    assert not known.trusted
    assert known.choice is known.closest is min(known.rows, key=lambda row: row.values["true_error"])


def test_rows_within_their_uncertainty_are_tied(found):
    slow = with_row(found, found.best, {"seconds": 2.0})
    tied = with_row(slow, slow.ranked[1], {"seconds": 0.05}, gap=0.001, gap_uncertainty=0.01)
    assert tied.ranked[1] in tied.tied
    tables, _ = page_tables.make_tables(tied, scene.row_colors(tied))
    assert [row["cells"][0]["best"] for row in tables[0]["rows"][:3]] == [True, True, False]
    apart = with_row(tied, tied.ranked[1], {}, gap=1.0)
    assert apart.ranked[1] not in apart.tied


def test_an_estimate_below_its_uncertainty_is_a_bound(found):
    bound = with_row(found, found.best, {"estimated_error": 0.0}, uncertainty=0.038)
    texts = [bound.headline(), *bound.reasons(), str(bound), bound._repr_html_()]
    colors = scene.row_colors(bound)
    cells = page_tables.make_tables(bound, colors)[0][0]["rows"][0]["cells"]
    bar = page_tables.make_bars(bound, colors)[0]
    assert (cells[0]["shown"], bar["shown"], bar["bound"]) == ("at most 0.038",) * 2 + (True,)
    assert 0 < bar["width"] < 100
    assert page.make_caption(bound.best).startswith("error at most 0.038")
    assert sum("at most 0.038" in text for text in texts) == 3
    assert not any("0.000 ±" in text or "not comparable" in text for text in texts)


def test_without_a_noise_level_there_are_no_estimates():
    compared = mss.compare(torus(6, 5), filters=["taubin"])
    assert (compared.noise.kind, compared.trusted, compared.choice) == ("unclear", False, None)
    assert all("estimated_error" not in row.values for row in compared.rows)
    assert "estimated" not in str(compared)
    assert "at most" in page.explain_noise(compared)
    assert page_tables.bar_measure(compared).key == "displacement"
    assert page_tables.make_bars(compared, scene.row_colors(compared))[0]["shown"] == "0.000"
    assert all(math.isfinite(x) for x in scene.color_range(compared, scene.COLORINGS[1]))
    assert len(plots.plot_curves(compared)) == 3
    true = dataclasses.replace(compared.rows[1], values={**compared.rows[1].values, "true_error": 0.1})
    known = dataclasses.replace(compared, rows=(compared.rows[0], true))
    assert known.choice is true


def test_the_words_of_a_comparison(found):
    """Headlines and reasons; other tests check the data behind them."""
    names = [row.name for row in found.ranked]
    slow = with_row(found, found.best, {"seconds": 2.0})
    tied = with_row(slow, slow.ranked[1], {"seconds": 0.05}, gap=0.001, gap_uncertainty=0.01)
    assert tied.headline() == (
        f"Take {names[0]} (2.00 s) or {names[1]} (0.05 s, 40 times faster): they are tied; the truth agrees"
    )
    assert any(f"{names[1]} (0.05 s, 40 times faster); {names[0]} takes 2.00 s" in text for text in tied.reasons())
    three = with_row(tied, tied.rows[0], {}, gap=0.002, gap_uncertainty=0.01)
    assert f"{names[0]} (2.00 s), the mesh as it is or 1 other: they are tied" in three.headline()
    curve, point = next(pair for pair in tied.tuned if not pair[0].spec.ours)
    near = {"estimated_error": 1.02 * tied.best.values["estimated_error"], "seconds": 0.1}
    changed = dataclasses.replace(curve, points=(dataclasses.replace(point, values={**point.values, **near}),))
    tuned = dataclasses.replace(tied, curves=tuple(changed if each is curve else each for each in tied.curves))
    assert any("(tied, 20 times faster): ms.apply_coord_" in text for text in tuned.reasons())

    other = found.ranked[2]
    doubted = with_row(found, other, {"true_error": 0.0})
    for row in doubted.tied:
        doubted = with_row(doubted, row, {}, gap=1.0)
    assert doubted.headline() == f"Take {names[0]}; {other.name} is closer to the truth"
    assert any(f"{other.name} is the closest: 0.000" in reason for reason in doubted.reasons())
    alone = dataclasses.replace(doubted, truth=None, rows=tuple(map(without_truth, doubted.rows)))
    assert alone.headline() == f"Take {names[0]}"

    failed = found.rows[-1].name
    assert any(reason == f"Failed on this mesh: {failed}." for reason in found.reasons())
    quiet = dataclasses.replace(alone, noise=dataclasses.replace(found.noise, kind="none"))
    assert quiet.headline() == "Leave the mesh as it is: it has no measurable noise"
    shared = dataclasses.replace(alone, noise=dataclasses.replace(found.noise, kind="correlated"))
    assert shared.headline() == "No recommendation: the noise is correlated between neighboring vertices"
    assert "a hint at most" in shared.reasons()[0]
    seen = dataclasses.replace(found, noise=shared.noise)
    assert seen.headline().endswith("it is the closest to the truth (no valid error estimate for this noise)")
    unclear = dataclasses.replace(alone, noise=dataclasses.replace(found.noise, kind="unclear", reason="it is small"))
    assert unclear.headline() == "No recommendation: noise cannot be separated from shape on these triangles"
    assert unclear.reasons()[0] == "It is small, so no error can be estimated. Look at the surfaces."
    assert page.describe_noise(unclear).startswith("noise cannot be separated from shape")
    assert repr(found) == f"<Comparison: 6 filters on mesh: {found.headline()}>"


def without_truth(row):
    known = {"true_error", "surface_error"}
    return dataclasses.replace(row, values={key: value for key, value in row.values.items() if key not in known})


def test_numbers_that_round_to_zero_have_no_sign(found):
    assert format_value(MEASURES["volume"], -0.0004) == format_value(MEASURES["volume"], 0.0004) == "0.000"
    best = with_row(found, found.best, {"volume": -0.0001})
    assert "-0.000" not in " ".join([*best.reasons(), str(best)])


def test_a_wrong_noise_level_is_part_of_the_uncertainty(found):
    """Of the mesh as given, the error is the noise level: and so is its uncertainty."""
    given, level = found.rows[0], found.noise
    deviation = (level.high - level.low) / 4 / found.edge
    assert given.uncertainty == pytest.approx(deviation, rel=0.05)
    assert given.gap > 2 * given.gap_uncertainty > 0


@pytest.mark.no_cover
def test_automatic_parameters_are_fixed_at_every_strength():
    compared = mss.compare(rough(torus(16, 10)), filters=["edge-aware"])
    (curve,) = compared.curves
    assert all("estimated_error" in point.values for point in curve.points)


def test_strengths_remove_more_and_more_noise(found):
    for curve in found.curves:
        removed = [point.values["noise_removed"] for point in curve.points]
        assert len(removed) > 2
        assert (np.diff(removed) > -0.1).all()  # percent; what is left when nearly all is gone scatters
        assert 0 < removed[0] < 95 < removed[-1] <= 100
    curve, point = found.tuned[0]
    assert point in curve.points


def test_transfer_functions_are_those_of_the_filters(found):
    """Ten of Taubin's steps are ((1 - 0.5 l) (1 + 0.53 l))^10.

    MeshLab's umbrella counts each neighbor twice and the vertex itself once: at valence 6 a step is 1 - 12/13 l.
    """
    measured = {row.spec.key: row.response for row in found.rows[1:-1]}
    x = found.eigenvalues
    inner = (x > 0.1) & np.isfinite(measured["taubin"])  # where there are more than a few waves a band
    assert inner.sum() > 15
    assert measured["umbrella"][inner] == pytest.approx((1 - 12 / 13 * x[inner]) ** 3, abs=0.04)
    taubin = ((1 - 0.5 * x) * (1 + 0.53 * x)) ** 10
    assert measured["taubin"][inner] == pytest.approx(taubin[inner], abs=0.08)
    assert np.nanmax(np.abs(measured["low-pass"][x > 0.5])) < 0.05
    passed = measured["automatic"][np.isfinite(measured["automatic"])]
    assert np.abs(passed).max() < 0.15  # all of these waves are noise on a regular torus


def test_the_input_is_as_it_was(found):
    ms = meshset.new(*rough(torus(20, 12)))
    ms.compute_selection_by_condition_per_face(condselect="fi < 20")
    before = ms.current_mesh().vertex_matrix()
    compared = mss.compare(ms, filters=["taubin"])
    assert np.array_equal(ms.current_mesh().vertex_matrix(), before)
    assert ms.current_mesh().selected_face_number() == 20
    # all of the mesh is smoothed, not what is selected alone
    assert (compared.rows[1].colors["displacement"] > 0).all()


def test_an_open_mesh_of_several_components_without_the_truth():
    V, F = together(rough(sheet(40, 30), 0.2), (torus(20, 12)[0] + 60, torus(20, 12)[1]))
    compared = mss.compare((V, F), filters=["taubin", "automatic"])
    values = compared.rows[1].values
    assert "boundary" in values
    assert not {"volume", "true_error", "surface_error"} & set(values)
    assert np.isnan(compared.correlation)


def test_a_truth_with_other_faces_gives_what_needs_no_correspondence():
    V, F = rough(torus(40, 24))
    compared = mss.compare((V, F), ground_truth=torus(80, 48), filters=["taubin"])
    assert {"surface_error", "hausdorff"} <= set(compared.rows[1].values)
    assert not {"vertex_error", "true_error"} & set(compared.rows[1].values)


def test_a_clean_mesh_is_to_be_left_alone():
    compared = mss.compare(mss.Surface(*torus(120, 80)), filters=["laplacian"])
    assert compared.choice is compared.best is compared.rows[0]


def test_large_meshes_are_swept_on_a_part():
    limits = SizeLimits(whole=1000, part=700)
    compared = experiment(CLEAN, added=0.2, filters=["taubin", "scale-dependent"], limits=limits)
    assert len(compared.sample.vertices) == 700
    assert compared.rows[1].surface.vertices.shape == CLEAN.vertices.shape
    assert compared.rows[1].response is not None
    assert compared.rows[1].uncertainty > 0  # of the noise level, as one probe has no scatter
    assert len(compared.curves[0].points) > 2


def test_filters_run_once_on_larger_meshes_and_the_reasons_tell_what_is_left_out():
    clean = mss.Surface(*torus(90, 60))
    limits = SizeLimits(whole=1000, repeated=2000, part=4000)
    compared = experiment(clean, added=0.2, filters=["taubin", "automatic"], limits=limits)
    assert compared.single_run
    assert compared.probes == 1
    for row in compared.rows:
        assert row.surface.vertices.shape == clean.vertices.shape
        # the error on the part is that of the whole
        assert row.values["estimated_error"] == pytest.approx(row.values["true_error"], rel=0.25, abs=0.03)
        assert not {"intersections", "hausdorff", "surface_error"} & set(row.values)
        assert row.colors["error"].shape == (len(clean.vertices),)
    assert any("Left out: E_v, Hausdorff, self-intersecting." in reason for reason in compared.reasons())


def test_wrong_arguments_are_refused():
    with pytest.raises(mss.InvalidParameter, match="noise and ground_truth are both given"):
        mss.compare(CLEAN, ground_truth=CLEAN, noise=0.1)
    with pytest.raises(mss.InvalidParameter, match="noise is -1"):
        mss.compare(CLEAN, noise=-1)
    with pytest.raises(mss.InvalidParameter, match="seed is -1"):
        mss.compare(CLEAN, seed=-1)
    with pytest.raises(mss.InvalidSurface, match="vertices are too large or too small for squares of areas"):
        mss.compare((np.eye(3) * 1e200, [[0, 1, 2]]))
    with pytest.raises(mss.InvalidParameter, match="mesh is 3; pass vertices and faces"):
        mss.compare(3)
    with pytest.raises(mss.InvalidSurface, match="no edge of any length"):
        mss.compare((np.zeros((3, 3)), [[0, 1, 2]]))


def test_progress_rises_to_one_and_what_it_raises_ends_the_run():
    fractions = []
    mss.compare(rough(torus(20, 12)), filters=["taubin"], progress=fractions.append)
    assert fractions == sorted(fractions)
    assert fractions[-1] == 1

    def stop(fraction):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        mss.compare(rough(torus(20, 12)), filters=["taubin"], progress=stop)


# --- for MeshLab's own window ---


def test_a_project_opens_with_its_layers(tmp_path):
    V, F = torus(20, 12)
    quality, colors = np.linspace(0, 1, len(V)), np.random.default_rng(0).random((len(V), 3))
    layers = [
        projects.Layer(name, f"{i}.ply", mss.Surface(V, F), quality, colors) for i, name in enumerate(('a <"b">', "c"))
    ]
    projects.write(tmp_path / "p.mlp", layers)
    ms = pymeshlab.MeshSet()
    ms.load_project(str(tmp_path / "p.mlp"))
    assert [mesh.label() for mesh in ms] == ['a <"b">', "c"]
    assert not ms.mesh(1).has_face_color()
    assert ms.mesh(0).vertex_matrix() == pytest.approx(V, abs=1e-12)
    assert ms.mesh(1).vertex_scalar_array() == pytest.approx(quality, abs=1e-6)
    assert ms.mesh(1).vertex_color_matrix()[:, :3] == pytest.approx(colors, abs=1 / 255)


def test_the_mesh_as_given_keeps_its_own_colors(found, tmp_path):
    faces = np.random.default_rng(1).random((len(CLEAN.faces), 3))
    ms = pymeshlab.MeshSet()
    opaque = np.c_[faces, np.ones(len(faces))]
    ms.add_mesh(pymeshlab.Mesh(CLEAN.vertices, CLEAN.faces, f_color_matrix=opaque))
    read = report.with_colors(found, ms)
    assert read.vertex_colors is None  # pymeshlab colors all vertices white
    layers = export.make_layers(read)
    projects.write(tmp_path / "p.mlp", layers[:2])
    ms = pymeshlab.MeshSet()
    ms.load_project(str(tmp_path / "p.mlp"))
    assert ms.mesh(0).face_color_matrix()[:, :3] == pytest.approx(faces, abs=1 / 255)
    assert [mesh.has_face_color() for mesh in ms] == [True, False]
    assert layers[0].label == "as given (its own colors)"
    assert not np.ptp(layers[1].colors, axis=0).any()  # the distance of the truth is 0
    assert report.with_colors(found, CLEAN) is found


def test_labels_of_layers_have_no_dots_and_state_the_range(found):
    labels = [layer.label for layer in export.make_layers(found)]
    assert all(label.endswith("% of an edge from the truth)") and "." not in label for label in labels)
    moved = dataclasses.replace(found.rows[1].spec, name="f(lambda_=0.5)")
    (label,) = [
        each.label for each in export.make_layers(with_row(found, found.rows[1], {}, spec=moved)) if "f(" in each.label
    ]
    assert label.startswith("f(lambda_=0,5) (blue 0, red ")


# --- the command line ---


@pytest.fixture
def scan(tmp_path):
    path = tmp_path / "scan.ply"
    meshset.new(*rough(torus(30, 20))).save_current_mesh(str(path))
    return path


@pytest.mark.parametrize(
    ("arguments", "code", "words"),
    [
        (["SCAN"], 2, "required: --out"),
        (["SCAN", "--out", "OUT", "--filters", "nope"], 2, "filters has 'nope'"),
        (["SCAN", "--out", "OUT", "--noise", "0.1", "--ground-truth", "SCAN"], 2, "both given"),
        (["NONE", "--out", "OUT"], 1, "no such file"),
        (["FOLDER", "--out", "OUT"], 1, "is a folder; give one of the mesh files in it"),
        (["SCAN", "--out", "SCAN"], 1, "cannot be created"),
        (["FOLDER/as_given.ply", "--out", "FOLDER"], 2, "would be replaced by the output; --overwrite allows that"),
        (["SCAN", "--ground-truth", "FOLDER/the_truth.ply", "--out", "FOLDER"], 2, "--overwrite allows that"),
    ],
)
def test_errors_are_one_line(scan, tmp_path, capsys, arguments, code, words):
    places = {"SCAN": str(scan), "OUT": str(tmp_path / "out"), "NONE": str(tmp_path / "none.ply")}
    places |= {each: str(tmp_path) + each[6:] for each in arguments if each.startswith("FOLDER")}
    try:
        got = main(["compare", *(places.get(a, a) for a in arguments)])
    except SystemExit as error:
        got = error.code
    said = capsys.readouterr().err.splitlines()
    assert (got, words in said[-1]) == (code, True)
    assert list(tmp_path.iterdir()) == [scan]


def test_a_failure_leaves_no_empty_folder(found, tmp_path, monkeypatch):
    export.check_folder(tmp_path / "a" / "b")
    assert not (tmp_path / "a").exists()

    def full(*_):
        raise mss.FileError("no space left")

    monkeypatch.setattr(export.atomic, "write_text", full)
    with pytest.raises(mss.FileError, match="no space left"):
        export.write(found, tmp_path / "a" / "b")
    assert not (tmp_path / "a").exists()


def test_the_extra_is_asked_for_before_the_work(tmp_path, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "pyvista", None)
    monkeypatch.setattr(report, "experiment", None)  # there is no work
    with pytest.raises(mss.MissingExtra, match=r"the page needs .* pip install 'meshlab-specsmooth\[report\]'"):
        mss.compare(CLEAN, out=tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_without_the_extra_the_figures_are_there_and_the_message_names_it(scan, tmp_path, monkeypatch, capsys):
    monkeypatch.setitem(__import__("sys").modules, "jinja2", None)
    out = tmp_path / "out"
    assert main(["compare", str(scan), "--out", str(out), "--filters", "taubin", "automatic"]) == 0
    printed = capsys.readouterr()
    assert "pip install 'meshlab-specsmooth[report]'" in printed.err
    assert "MeshLab Taubin" in printed.out
    assert not (out / "comparison.html").exists()
    data = json.loads((out / "comparison.json").read_text())
    assert [row["name"] for row in data["rows"]] == ["as given", "MeshLab Taubin", "specsmooth automatic"]
    assert (out / "comparison.mlp").exists()
    assert "MeshLab Taubin" in (out / "comparison.txt").read_text()

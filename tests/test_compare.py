import dataclasses
import json
import math
import re

import numpy as np
import pymeshlab
import pytest

import meshlab_specsmooth as mss
from meshlab_specsmooth.cli import main
from meshlab_specsmooth.comparison import experiment, metrics, noise, shape
from meshlab_specsmooth.comparison.comparison import MEASURES, shown
from meshlab_specsmooth.comparison.competitors import COMPETITORS, competitors
from meshlab_specsmooth.comparison.distances import distances
from meshlab_specsmooth.comparison.shape import Ruler
from meshlab_specsmooth.errors import FilterFailed
from meshlab_specsmooth.meshlab import isolated_filter, meshset, projects
from meshlab_specsmooth.meshlab.descriptors import Length
from meshlab_specsmooth.meshlab.filters import FILTERS
from meshlab_specsmooth.meshlab.isolated_filter import FilterProcess, FilterRun
from meshlab_specsmooth.meshlab.measures import hausdorff, self_intersecting_faces
from meshlab_specsmooth.report import compared as report
from meshlab_specsmooth.report import page, plots
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
    assert shape.area(CLEAN) == pytest.approx(ms.get_geometric_measures()["surface_area"], rel=1e-5)


def test_boundary_length_is_that_of_the_rim():
    V, F = sheet(5, 4)
    V[:, 2] = 0
    assert shape.boundary_length(mss.Surface(V, F)) == pytest.approx(2 * (4 + 3))
    assert shape.boundary_length(CLEAN) == 0


def test_faces_that_run_through_others_are_counted():
    V = np.array([[0.0, 0, 0], [2, 0, 0], [0, 2, 0], [0.5, 0.5, -1], [0.5, 0.5, 1], [0.6, 0.4, 1]])
    assert self_intersecting_faces(V, [[0, 1, 2], [3, 4, 5]]).all()
    assert not self_intersecting_faces(CLEAN.vertices, CLEAN.faces).any()


@pytest.mark.parametrize("level", [0.1, 0.3])
def test_the_ruler_sees_white_noise_at_its_level_and_hardly_any_shape(level):
    fine = mss.Surface(*torus(160, 100))
    ruler = Ruler.of(fine, fine)
    assert ruler.noise_left(fine) < 0.01
    for kind in (noise.gaussian, noise.along_normals):
        noisy = mss.Surface(kind(fine, level, 1), fine.faces)
        assert ruler.noise_left(noisy) == pytest.approx(level, rel=0.03)
        unknown = Ruler.of(noisy, noisy)  # noise makes edges longer
        assert unknown.noise_left(noisy) * unknown.edge == pytest.approx(level * ruler.edge, rel=0.05)


def test_the_ruler_sees_what_moves_and_not_what_is_noise():
    edge = Ruler.of(CLEAN, CLEAN).edge
    grown = mss.Surface(CLEAN.vertices + 0.5 * edge * Ruler.of(CLEAN, CLEAN).normals, CLEAN.faces)
    ruler = Ruler.of(CLEAN, CLEAN)
    assert ruler.offset(grown) == pytest.approx(0.5, rel=1e-3)
    assert ruler.displacement(grown) == pytest.approx(0.5, rel=1e-9)
    assert ruler.feature_loss(grown) == pytest.approx(0.5, rel=0.1)
    assert ruler.feature_loss(mss.Surface(*rough(torus(60, 40), 0.5))) < 0.15
    assert ruler.noise_left(grown) < 0.02 + ruler.noise_left(CLEAN)


@pytest.mark.parametrize("factor", [1e-6, 1e6])
def test_measures_do_not_depend_on_the_unit(factor):
    V, F = rough(torus(20, 12))
    plain, scaled = (mss.Surface(f * V, F) for f in (1.0, factor))
    # not a clean torus: there all vertices of a ring curve alike, and rounding says which are the features
    clean = [mss.Surface(f * rough(torus(20, 12), 0.1, seed=3)[0], F) for f in (1.0, factor)]
    for name in ("noise_left", "feature_loss", "offset", "displacement"):
        a, b = (getattr(Ruler.of(c, c), name)(s) for c, s in zip(clean, (plain, scaled), strict=True))
        assert b == pytest.approx(a, rel=1e-8, abs=1e-12)
    assert shape.triangle_quality(scaled) == pytest.approx(shape.triangle_quality(plain))
    assert shape.dihedral_deviation(scaled) == pytest.approx(shape.dihedral_deviation(plain))


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


# --- who is compared ---


def test_every_short_name_is_a_filter_and_its_strengths_are_its_parameters():
    V, F = rough(torus(20, 12))
    known = {*pymeshlab.filter_list(), *FILTERS}
    for key, competitor in COMPETITORS.items():
        assert competitor.key == key
        assert competitor.filter in known
        gentle = competitor.at(competitor.strength.values[0], len(V)) if competitor.strength else competitor
        ran = isolated_filter.run(V, F, gentle.filter, gentle.parameters, gentle.times)
        assert ran.vertices.shape == V.shape


@pytest.mark.parametrize(
    "wrong", ["taubn", "f(", "apply_coord_taubin_smoothing(3)", "apply_coord_x(a=open('x'))", "a.b(c=1)"]
)
def test_what_is_no_filter_is_refused(wrong):
    with pytest.raises(mss.InvalidParameter, match="it must be one of denoise, laplacian"):
        competitors([wrong])


def test_denoise_comes_first_and_is_held_at_what_it_chose():
    first = competitors()[0]
    assert (first.key, first.name, first.filter) == ("denoise", "specsmooth denoise", "apply_coord_spectral_denoising")
    chosen = {"start": "given", "strength": 2.0, "range_sigma": 0.3, "iterations": 5, "barycenter_weight": 0.4}
    held = experiment._held(first, FilterRun(CLEAN.vertices, chosen, 0.1))
    assert (held.filter, held.parameters) == ("apply_coord_edge_aware_smoothing", chosen)
    # no setting of that filter is the isotropic one
    assert experiment._held(first, FilterRun(CLEAN.vertices, chosen | {"iterations": 0}, 0.1)) is first


def test_filters_are_named_once_and_at_least_one():
    with pytest.raises(mss.InvalidParameter, match="twice"):
        competitors(["taubin", "taubin"])
    with pytest.raises(mss.InvalidParameter, match="empty"):
        competitors([])


# --- the comparison ---


def test_rows_are_what_the_filters_give(found):
    V = found.given.vertices
    rows = {row.name: row for row in found.rows}
    for key in ("taubin", "automatic"):
        competitor = COMPETITORS[key]
        expected = isolated_filter.run(V, CLEAN.faces, competitor.filter, competitor.parameters)
        row = rows[competitor.name]
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
    assert found.best is min(rows, key=lambda row: row.values["true_error"])
    names = [row.name for row in (found.best, *found.level)]
    assert re.fullmatch(rf"Take {names[0]} .* or {names[1]} .*: they are level; the truth agrees", found.headline())
    assert found.best.behind == 0


@pytest.mark.no_cover
def test_noise_that_no_estimate_is_made_for_has_no_winner_but_by_the_truth():
    V, F = torus(120, 80)
    ruler = Ruler.of(mss.Surface(V, F), mss.Surface(V, F))
    shared = np.random.default_rng(3).standard_normal(len(V))
    for _ in range(4):
        shared = ruler.walk @ shared
    X = V + 0.3 * ruler.edge / shared.std() * shared[:, None] * ruler.normals
    blind = mss.compare((X, F), filters=["umbrella", "taubin"])
    assert blind.noise.kind == "correlated"
    assert (blind.choice, blind.closest) == (None, None)
    assert blind.headline() == "No winner by numbers: neighboring vertices share this noise"
    assert "a hint at most" in blind.reasons()[0]
    seen = mss.compare((X, F), ground_truth=(V, F), filters=["umbrella", "taubin"])
    assert seen.choice is min(seen.rows, key=lambda row: row.values["true_error"])
    assert seen.headline() == f"Take {seen.choice.name}: so says the truth (on this noise no estimate could)"


def test_a_headline_says_when_the_truth_has_another_first(found):
    other = next(row for row in found.ranked[1:] if not row.failure)
    nearer = dataclasses.replace(other, values={**other.values, "true_error": 0.0})
    doubted = dataclasses.replace(found, rows=tuple(nearer if row is other else row for row in found.rows))
    assert doubted.headline().startswith(f"Take {found.best.name}")
    assert doubted.headline().endswith(f"; by the truth {other.name} is closer")
    alone = doubted
    for row in doubted.level:
        alone = with_row(alone, row, {}, behind=1.0)
    assert alone.headline() == f"Take {found.best.name}; by the truth {other.name} is closer"
    assert any(f"{other.name} is the closest: 0.000" in reason for reason in doubted.reasons())


def test_rows_that_are_level_are_in_the_headline_with_their_price(found):
    slow = with_row(found, found.best, {"seconds": 2.0})
    tied = with_row(slow, slow.ranked[1], {"seconds": 0.05}, behind=0.001, behind_uncertainty=0.01)
    names = [row.name for row in tied.ranked]
    assert tied.headline() == (
        f"Take {names[0]} (2.00 s) or {names[1]} (0.05 s, 40 times faster): they are level; the truth agrees"
    )
    assert any(f"{names[1]} (0.05 s, 40 times faster); {names[0]} takes 2.00 s" in text for text in tied.reasons())
    curve, point = next(pair for pair in tied.tuned if not pair[0].competitor.ours)
    near = {"estimated_error": 1.02 * tied.best.values["estimated_error"], "seconds": 0.1}
    changed = dataclasses.replace(curve, points=(dataclasses.replace(point, values={**point.values, **near}),))
    tuned = dataclasses.replace(tied, curves=tuple(changed if each is curve else each for each in tied.curves))
    assert any("(level, 20 times faster): ms.apply_coord_" in text for text in tuned.reasons())
    rows = page._tables(tied, page_rows(tied))[0]["rows"]
    assert [row["cells"][0]["best"] for row in rows[:3]] == [True, True, False]
    untouched = with_row(tied, tied.rows[0], {}, behind=0.002, behind_uncertainty=0.01)
    assert f"{names[0]} (2.00 s), the mesh as it is or 1 other: they are level" in untouched.headline()


def page_rows(found):
    painted = plots.colors(found)
    return [page._table_row(found, row, painted, []) for row in found.ranked]


def test_an_estimate_that_cannot_be_told_from_zero_is_a_bound(found):
    bound = with_row(found, found.best, {"estimated_error": 0.0}, uncertainty=0.038)
    texts = [bound.headline(), *bound.reasons(), str(bound), bound._repr_html_()]
    cells = page_rows(bound)[0]["cells"]
    bar = page._bars(bound, plots.colors(bound))[0]
    assert (cells[0]["shown"], bar["shown"], bar["bound"]) == ("at most 0.038",) * 2 + (True,)
    assert 0 < bar["width"] < 100
    assert page._caption(bound.best).startswith("error at most 0.038")
    assert sum("at most 0.038" in text for text in texts) == 3
    assert not any("0.000 ±" in text or "not comparable" in text for text in texts)


def test_where_noise_cannot_be_told_from_shape_there_are_no_estimates():
    compared = mss.compare(torus(6, 5), filters=["taubin"])
    assert compared.noise.kind == "unclear"
    assert compared.headline() == "No winner by numbers: noise cannot be told from shape on these triangles"
    assert compared.reasons() == (
        "There are fewer than 50 vertices, so no error can be estimated. Look at the surfaces.",
    )
    assert all("estimated_error" not in row.values for row in compared.rows)
    assert "estimated" not in str(compared)
    assert page._noise_words(compared) == "noise and shape cannot be told apart"
    assert "at most" in page._noise_details(compared)
    assert page._bars(compared, plots.colors(compared))[0]["shown"] == "0.000"
    assert "move" in page._bar_words(compared)
    assert all(math.isfinite(x) for x in page._range(compared, page._COLOURINGS[1]))
    assert len(plots.curves(compared)) == 3
    blind = dataclasses.replace(compared.noise, reason=None)
    true = dataclasses.replace(compared.rows[1], values={**compared.rows[1].values, "true_error": 0.1})
    known = dataclasses.replace(compared, noise=blind, rows=(compared.rows[0], true))
    assert known.headline() == "Take MeshLab Taubin: so says the truth (on these triangles no estimate could)"


def test_numbers_that_round_to_zero_have_no_sign(found):
    assert shown(MEASURES["volume"], -0.0004) == shown(MEASURES["volume"], 0.0004) == "0.000"
    best = with_row(found, found.best, {"volume": -0.0001})
    assert "-0.000" not in " ".join([*best.reasons(), str(best)])


def test_a_wrong_noise_level_is_part_of_the_uncertainty(found):
    """Of the mesh as given, the error is the noise level: and so is its uncertainty."""
    given, level = found.rows[0], found.noise
    deviation = (level.high - level.low) / 4 / found.edge
    assert given.uncertainty == pytest.approx(deviation, rel=0.05)
    tight = {key: getattr(given, key) for key in ("behind", "behind_uncertainty")}
    assert tight["behind"] > 2 * tight["behind_uncertainty"] > 0


@pytest.mark.no_cover
def test_filters_that_choose_are_held_at_every_strength():
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
    measured = {row.competitor.key: row.response for row in found.rows[1:-1]}
    x = found.eigenvalues
    inner = (x > 0.1) & np.isfinite(measured["taubin"])  # where there are more than a few waves a band
    assert inner.sum() > 15
    assert measured["umbrella"][inner] == pytest.approx((1 - 12 / 13 * x[inner]) ** 3, abs=0.04)
    taubin = ((1 - 0.5 * x) * (1 + 0.53 * x)) ** 10
    assert measured["taubin"][inner] == pytest.approx(taubin[inner], abs=0.08)
    assert np.nanmax(np.abs(measured["low-pass"][x > 0.5])) < 0.05
    passed = measured["automatic"][np.isfinite(measured["automatic"])]
    assert passed[0] > 0.1 > 0.05 > passed[-1]


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
    assert compared.best is compared.rows[0]
    assert compared.headline().startswith("Leave it as it is")


def test_large_meshes_are_swept_on_a_part(monkeypatch):
    monkeypatch.setattr(experiment, "_WHOLE", 1000)
    monkeypatch.setattr(experiment, "_SAMPLE", 700)
    compared = experiment.experiment(CLEAN, added=0.2, filters=["taubin", "scale-dependent"])
    assert len(compared.sample.vertices) == 700
    assert compared.rows[1].surface.vertices.shape == CLEAN.vertices.shape
    assert compared.rows[1].response is not None
    assert compared.rows[1].uncertainty > 0  # of the noise level: one probe says nothing of its scatter
    assert len(compared.curves[0].points) > 2


def test_larger_ones_run_once_and_say_what_is_left_out(monkeypatch):
    for name, limit in (("_WHOLE", 1000), ("_ONCE", 2000), ("_SAMPLE", 4000)):
        monkeypatch.setattr(experiment, name, limit)
    clean = mss.Surface(*torus(90, 60))
    compared = experiment.experiment(clean, added=0.2, filters=["taubin", "automatic"])
    assert compared.once
    assert compared.probes == 1
    for row in compared.rows:
        assert row.surface.vertices.shape == clean.vertices.shape
        # on the part, the error of the whole
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
    assert read.vertex_colors is None  # pymeshlab's white is nobody's color
    layers = page._layers(read)
    projects.write(tmp_path / "p.mlp", layers[:2])
    ms = pymeshlab.MeshSet()
    ms.load_project(str(tmp_path / "p.mlp"))
    assert ms.mesh(0).face_color_matrix()[:, :3] == pytest.approx(faces, abs=1 / 255)
    assert [mesh.has_face_color() for mesh in ms] == [True, False]
    assert layers[0].label == "as given (its own colors)"
    assert not np.ptp(layers[1].colors, axis=0).any()  # the truth is off by nothing
    assert report.with_colors(found, CLEAN) is found


def test_labels_of_layers_have_no_dots_and_tell_the_range(found):
    labels = [layer.label for layer in page._layers(found)]
    assert all(label.endswith("% of an edge off)") and "." not in label for label in labels)
    moved = dataclasses.replace(found.rows[1].competitor, name="f(lambda_=0.5)")
    (label,) = [
        each.label for each in page._layers(with_row(found, found.rows[1], {}, competitor=moved)) if "f(" in each.label
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
        (["SCAN", "--out", "SCAN"], 1, "cannot be made"),
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
    page.check_folder(tmp_path / "a" / "b")
    assert not (tmp_path / "a").exists()

    def full(*_):
        raise mss.FileError("no space left")

    monkeypatch.setattr(page.files, "write_text", full)
    with pytest.raises(mss.FileError, match="no space left"):
        page.write(found, tmp_path / "a" / "b")
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

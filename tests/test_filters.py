"""Our filters, called on MeshSets as MeshLab's are."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pymeshlab
import pytest

import meshlab_specsmooth as mss
from meshlab_specsmooth.geometry.surface import vertex_normals
from meshlab_specsmooth.meshlab import descriptors, filters, mesh_files, meshset
from meshlab_specsmooth.meshlab.parameters import resolve
from tests import state
from tests.meshes import rough, sheet, torus

MESH = rough(torus(20, 12))
MOVERS = {
    mss.apply_coord_spectral_smoothing: mss.smooth,
    mss.apply_coord_spectral_low_pass: mss.low_pass,
    mss.apply_coord_spectral_enhancement: mss.enhance,
}
EACH_MOVER = pytest.mark.parametrize(("in_place", "on_arrays"), MOVERS.items(), ids=[f.__name__ for f in MOVERS])
EACH_FILTER = pytest.mark.parametrize("name", filters.FILTERS)


@pytest.fixture
def ms():
    return meshset.new(*MESH)


def enum_of(name):
    """A parameter of a filter that has two names to choose from."""
    return next((p for p in descriptors.load(name).parameters if len(p.values) == 2), None)


def words_of(error, native, ours):
    """What a filter of pymeshlab's says, as ours would have to say it."""
    return str(error.value).replace(native, ours)


@EACH_MOVER
@pytest.mark.parametrize("given", [{}, {"response": "heat", "laplacian": "cotangent"}])
def test_a_filter_and_its_function_on_arrays_have_the_same_result(ms, in_place, on_arrays, given):
    expected = on_arrays(*MESH, **given)
    evidence = in_place(ms, **given)
    assert np.array_equal(ms.current_mesh().vertex_matrix(), expected.vertices)
    assert set(evidence) == set(vars(expected)) - {"vertices", "source", "given"}
    for name in set(evidence) - {"seconds", "noise"}:
        assert pytest.approx(getattr(expected, name), nan_ok=name == "modes_error") == evidence[name]
    if expected.noise is not None:
        assert evidence["noise"].level == pytest.approx(expected.noise.level)


@EACH_MOVER
def test_lengths_are_in_mesh_units_or_percent_of_the_diagonal(in_place, on_arrays):
    name = "shortest" if on_arrays is mss.enhance else "wavelength"
    diagonal = meshset.new(*MESH).current_mesh().bounding_box().diagonal()
    for value in (pymeshlab.PercentageValue(25), pymeshlab.PureValue(diagonal / 4), diagonal / 4):
        assert in_place(meshset.new(*MESH), **{name: value})["wavelength"] == pytest.approx(diagonal / 4)


def test_enums_are_given_by_name_or_number(ms):
    other = meshset.new(*MESH)
    mss.apply_coord_spectral_smoothing(ms, response=4)
    mss.apply_coord_spectral_smoothing(other, response="heat")
    assert np.array_equal(ms.current_mesh().vertex_matrix(), other.current_mesh().vertex_matrix())


@pytest.mark.no_cover
@pytest.mark.parametrize("name", [name for name in filters.FILTERS if enum_of(name) is not None])
@pytest.mark.parametrize(
    ("given", "error", "words"),
    [
        ({"nodez": 3}, pymeshlab.PyMeshLabException, r"Parameter nodez not found for filter NAME\. Please check"),
        ({"ENUM_": 3}, pymeshlab.PyMeshLabException, r"check the documentation\. Did you mean ENUM\?"),
        (
            {"ENUM": "graph"},
            pymeshlab.InvalidEnumException,
            "Enum 'graph' not found. Possible values are 'FIRST'",
        ),
        ({"ENUM": 2}, pymeshlab.InvalidEnumException, "Enum 2 not valid. Must be a value between 0 and 2"),
        ({"ENUM": 1.5}, RuntimeError, "Unable to cast Python instance of type <class 'float'>"),
        ({"ENUM": 1.5}, pymeshlab.PyMeshLabException, "ENUM"),
    ],
)
def test_bad_parameters_are_refused_in_meshlab_s_words_and_the_meshset_stays(ms, name, given, error, words):
    before = state.of_meshset(ms)
    enum = enum_of(name)
    given = {parameter.replace("ENUM", enum.name): value for parameter, value in given.items()}
    for place, word in (("NAME", name), ("ENUM", enum.name), ("FIRST", enum.values[0])):
        words = words.replace(place, word)
    with pytest.raises(error, match=words):
        filters.apply(ms, name, **given)
    assert state.differences(before, state.of_meshset(ms)) == []


@pytest.mark.parametrize(
    ("given", "error", "words"),
    [
        ({"modes": 2.0}, RuntimeError, "modes: Unable to cast Python instance of type <class 'float'> to int"),
        ({"modes": "2"}, RuntimeError, "modes: Unable to cast Python instance of type <class 'str'>"),
        ({"modes": -1}, pymeshlab.PyMeshLabException, "Parameter modes: int value -1 out of bounds .min: 0;"),
        ({"wavelength": "2"}, RuntimeError, "wavelength: Unable to cast"),
        ({"wavelength": float("nan")}, pymeshlab.PyMeshLabException, "wavelength: length value nan out of bounds"),
        ({"wavelength": float("inf")}, pymeshlab.PyMeshLabException, "wavelength: length value inf out of bounds"),
        ({"wavelength": pymeshlab.PureValue(-1)}, pymeshlab.PyMeshLabException, "length value -1.0 out of bounds"),
        (
            {"iterations": 0},
            pymeshlab.PyMeshLabException,
            "Parameter iterations: int value 0 out of bounds .min: 1; max: 1000",
        ),
        ({"selected": "yes"}, RuntimeError, "selected: Unable to cast"),
        ({"modes": 3, "wavelength": 1.0}, mss.InvalidParameter, "give one of them"),
        ({"modes": 3, "wavelength": 1.0}, pymeshlab.PyMeshLabException, "give one of them"),
        ({"modes": 10**6}, pymeshlab.PyMeshLabException, "this mesh has 240"),
        ({"features": "face_selection"}, pymeshlab.PyMeshLabException, "nothing is selected"),
    ],
)
def test_values_of_the_wrong_type_or_out_of_bounds_are_refused(ms, given, error, words):
    before = state.of_meshset(ms)
    with pytest.raises(error, match=words):
        mss.apply_coord_spectral_smoothing(ms, **given)
    assert state.differences(before, state.of_meshset(ms)) == []


def test_python_and_numpy_numbers_are_accepted_as_by_pymeshlab(ms):
    ms.apply_coord_laplacian_smoothing(stepsmoothnum=np.int64(1), boundary=1)
    evidence = mss.apply_coord_spectral_smoothing(
        ms, modes=np.int64(20), barycenter_weight=1, iterations=True, selected=np.bool_(False), wavelength=np.float64(0)
    )
    assert evidence["modes"] >= 20


@EACH_FILTER
def test_positional_arguments_are_refused(ms, name):
    with pytest.raises(TypeError, match="positional argument"):
        ms.apply_coord_laplacian_smoothing(3)
    with pytest.raises(TypeError, match="positional argument"):
        filters.FILTERS[name](ms, 3)


@pytest.mark.no_cover
@EACH_FILTER
def test_meshsets_without_mesh_or_faces_are_refused_with_pymeshlabs_message(name):
    empty, cloud, nothing = pymeshlab.MeshSet(), pymeshlab.MeshSet(), meshset.new(*MESH)
    cloud.add_mesh(pymeshlab.Mesh(MESH[0]))
    nothing.set_selection_all()
    nothing.meshing_remove_selected_vertices()
    assert nothing.current_mesh().vertex_number() == 0
    for ms in (empty, cloud, nothing):
        before = state.of_meshset(ms)
        with pytest.raises(pymeshlab.PyMeshLabException) as native:
            ms.apply_coord_laplacian_smoothing()
        with pytest.raises(pymeshlab.PyMeshLabException) as ours:
            filters.apply(ms, name)
        assert str(ours.value) == words_of(native, "apply_coord_laplacian_smoothing", name)
        assert state.differences(before, state.of_meshset(ms)) == []


def test_an_unknown_parameter_is_refused_with_pymeshlabs_message(ms):
    with pytest.raises(pymeshlab.PyMeshLabException) as native:
        ms.apply_coord_laplacian_smoothing(xyz=3)
    with pytest.raises(pymeshlab.PyMeshLabException) as ours:
        mss.apply_coord_spectral_smoothing(ms, xyz=3)
    assert str(ours.value) == words_of(native, "laplacian", "spectral")


@pytest.mark.parametrize("full", [False, True])
@pytest.mark.parametrize("parameters", [False, True])
def test_both_kinds_of_verbosity_are_unchanged(full, parameters, capfd):
    ms, native = pymeshlab.MeshSet(), pymeshlab.MeshSet()
    for m in (ms, native):
        m.create_sphere()
        m.set_verbosity(full)
        m.set_parameter_verbosity(parameters)
    mss.apply_coord_spectral_smoothing(ms)
    printed = capfd.readouterr().out
    assert ("apply_coord_spectral_smoothing" in printed) == (full or parameters)
    assert "morphing" not in printed
    outputs = []
    for m in (ms, native):
        for _ in range(2):  # with everything off, what is left is the parameters
            m.apply_coord_taubin_smoothing()
            m.set_verbosity(False)
        outputs.append(capfd.readouterr().out)
    assert outputs[0] == outputs[1]


THREADS = """
import os, sys, threading
import meshlab_specsmooth as mss
from meshlab_specsmooth.meshlab import meshset
from tests.meshes import rough, torus
mesh = rough(torus(20, 12))
before = os.fstat(1), os.fstat(2), sys.stdout, sys.stderr
results = []
def work():
    for _ in range(4):
        ms = meshset.new(*mesh)
        mss.apply_coord_spectral_smoothing(ms, method="chebyshev")
        results.append(ms.current_mesh().vertex_matrix())
threads = [threading.Thread(target=work) for _ in range(5)]
for thread in threads: thread.start()
for thread in threads: thread.join()
assert (os.fstat(1), os.fstat(2), sys.stdout, sys.stderr) == before
assert len(results) == 20 and all((result == results[0]).all() for result in results)
"""


@pytest.mark.no_cover
def test_threads_may_filter_at_once_and_leave_the_standard_streams_alone():
    """In a process of its own: pymeshlab's C++ streams may stay silent after threads have run its filters at once."""
    command = [sys.executable, "-c", THREADS]
    done = subprocess.run(command, cwd=Path(__file__).parent.parent, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


@EACH_FILTER
def test_a_verbose_meshset_reports_our_filters_like_its_own(name, capfd):
    ms = pymeshlab.MeshSet(verbose=True)
    ms.create_sphere()
    capfd.readouterr()
    filters.apply(ms, name)
    printed = capfd.readouterr()
    assert printed.out.startswith(f"\nApplying filter {name} with the following parameters:\n{{")
    flag = next(p for p in descriptors.load(name).parameters if p.type in ("enum", "bool") and p.name != "selected")
    assert f"{flag.name!r}: {flag.default!r}" in printed.out
    assert printed.out.count("Applying filter") == 1
    assert printed.err == ""
    ms.set_verbosity(False)
    filters.apply(ms, name)
    assert capfd.readouterr() == ("", "")


def test_an_interrupted_filter_leaves_the_meshset_unchanged(ms):
    before = state.of_meshset(ms)

    def stop(fraction):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        mss.apply_coord_spectral_smoothing(ms, modes=9, method="chebyshev", progress=stop)
    assert state.differences(before, state.of_meshset(ms)) == []


def moved(ms):
    return (ms.current_mesh().vertex_matrix() != MESH[0]).any(axis=1)


@EACH_MOVER
def test_by_default_a_selection_restricts_the_filter(in_place, on_arrays):
    ms = meshset.new(*MESH)
    ms.compute_selection_by_condition_per_vertex(condselect="x > 0.5")
    mask = MESH[0][:, 0] > 0.5
    in_place(ms)
    assert np.array_equal(ms.current_mesh().vertex_matrix(), on_arrays(*MESH, mask=mask).vertices)
    assert not moved(ms)[~mask].any()
    assert moved(ms)[mask].mean() > 0.9
    ms = meshset.new(*MESH)
    ms.compute_selection_by_condition_per_face(condselect="fi < 100")
    in_place(ms)
    of_faces = np.isin(np.arange(len(MESH[0])), MESH[1][:100])
    assert not moved(ms)[~of_faces].any()
    assert moved(ms)[of_faces].mean() > 0.9


def test_a_selection_can_be_ignored_and_a_missing_one_is_reported(ms):
    ms.compute_selection_by_condition_per_vertex(condselect="x > 0.5")
    mss.apply_coord_spectral_smoothing(ms, selected=False)
    assert moved(ms).all()
    ms = meshset.new(*MESH)
    mss.apply_coord_spectral_smoothing(ms, selected=True)
    assert not moved(ms).any()


@pytest.mark.parametrize("source", ["vertex_selection", "face_selection", "vertex_quality"])
def test_features_come_from_selections_or_quality(source):
    ms = meshset.new(*MESH)
    if source == "vertex_selection":
        ms.compute_selection_by_condition_per_vertex(condselect="x > 0.5")
        weights = MESH[0][:, 0] > 0.5
    elif source == "face_selection":
        ms.compute_selection_by_condition_per_face(condselect="fi < 100")
        weights = np.isin(np.arange(len(MESH[0])), MESH[1][:100])
    else:
        ms.compute_scalar_by_function_per_vertex(q="vi / 240", normalize=False)
        weights = ms.current_mesh().vertex_scalar_array()
    mss.apply_coord_spectral_smoothing(ms, features=source, feature_gain=1.5)
    expected = mss.smooth(*MESH, features=weights, feature_gain=1.5).vertices
    assert np.array_equal(ms.current_mesh().vertex_matrix(), expected)  # the selection marks, it does not restrict


def test_features_by_quality_need_quality():
    ms = pymeshlab.MeshSet()
    ms.create_sphere()
    assert not ms.current_mesh().has_vertex_scalar()
    with pytest.raises(mss.InvalidParameter, match="has no vertex quality"):
        mss.apply_coord_spectral_smoothing(ms, features="vertex_quality")


def test_quality_outside_0_1_is_refused_with_its_index(ms):
    ms.compute_scalar_by_function_per_vertex(q="vi > 6 ? 2 : 1", normalize=False)
    before = state.of_meshset(ms)
    with pytest.raises(mss.InvalidParameter, match=r"features\[7\] is 2.0; weights lie in \[0, 1\]"):
        mss.apply_coord_spectral_smoothing(ms, features="vertex_quality")
    assert state.differences(before, state.of_meshset(ms)) == []


def test_the_boundary_is_treated_as_given():
    V, F = rough(sheet())
    for boundary in ("free", "fixed", "curve"):
        ms = meshset.new(V, F)
        mss.apply_coord_spectral_smoothing(ms, boundary=boundary)
        assert np.array_equal(ms.current_mesh().vertex_matrix(), mss.smooth(V, F, boundary=boundary).vertices)


def test_the_displacement_is_along_the_normals_and_moves_nothing(ms):
    before = state.of_meshset(ms)
    report = mss.compute_scalar_by_spectral_displacement(ms, barycenter_weight=0.3)
    smoothed = mss.smooth(*MESH, barycenter_weight=0.3).vertices
    expected = ((smoothed - MESH[0]) * vertex_normals(mss.Surface(smoothed, MESH[1]))).sum(axis=1)
    written = ms.current_mesh().vertex_scalar_array()
    assert written == pytest.approx(expected)
    assert report == pytest.approx({"rms": np.sqrt((expected**2).mean()), "min": expected.min(), "max": expected.max()})
    changed = state.differences(before, state.of_meshset(ms))
    assert sorted(changed) == ["/meshes[0]/vertex quality", "/script"]


def test_the_displacement_points_outwards_where_it_is_positive():
    V, F = torus(30, 20)
    V = V.copy()
    dent = 100
    outwards = vertex_normals(mss.Surface(V, F))[dent]
    V[dent] -= 0.1 * outwards
    ms = meshset.new(V, F)
    mss.compute_scalar_by_spectral_displacement(ms, barycenter_weight=0.3)
    assert ms.current_mesh().vertex_scalar_array()[dent] > 0.03


def test_the_spectrum_of_a_meshset_is_that_of_the_arrays(ms):
    measured, expected = mss.get_spectrum(ms), mss.spectrum(*MESH)
    assert measured["noise"].level == expected.noise.level
    for name in set(vars(expected)) - {"noise"}:
        assert np.array_equal(measured[name], vars(expected)[name])


@EACH_FILTER
def test_every_filter_changes_nothing_else(laden, name):
    held = laden.current_mesh()
    before = state.of_meshset(laden)
    # a mesh without noise would stay as it is, were nothing given
    given = {"strength": 1.0, "range_sigma": 0.3, "iterations": 2} if "edge_aware" in name else {}
    if "boundary" in name:
        given = {"wavelength": 1e3}
    filters.apply(laden, name, **({"barycenter_weight": 1.0} if "smoothing" in name and not given else given))
    assert laden.current_mesh().id() == held.id() == 1
    follows = {f"/meshes[1]/{part}" for part in state.FOLLOWS} if name.startswith("apply_coord") else set()
    follows |= {"/meshes[1]/vertex quality"} if name.startswith("compute_scalar") else set()
    follows = set() if "denoising" in name or "boundary" in name else follows  # without noise, or jags, it stays
    changed = set(state.differences(before, state.of_meshset(laden)))
    assert changed <= follows | {"/script"}
    assert changed >= (follows | {"/script"}) - {"/meshes[1]/bounding box"}  # the rim is fixed, so the box may stay


@pytest.mark.no_cover
@EACH_FILTER
def test_textures_and_raster_cameras_stay(name):
    ms = pymeshlab.MeshSet()
    ms.load_new_mesh(str(mesh_files.sample("bunny10k_textured.obj")))
    ms.load_new_raster(str(mesh_files.sample("TextureDouble_A.png")))
    before = state.of_meshset(ms)
    assert "FocalMm" in before["rasters"]
    assert before["meshes"][0]["textures"]
    filters.apply(ms, name)
    changed = {path.split("/")[-1] for path in state.differences(before, state.of_meshset(ms))}
    assert changed <= state.FOLLOWS | {"script", "vertex quality"}


def test_filters_and_descriptors_name_each_other():
    assert tuple(sorted(filters.FILTERS)) == descriptors.names()
    for name, function in filters.FILTERS.items():
        assert function is getattr(mss, name)
        assert name in mss.__all__
        assert descriptors.load(name).help.split()[0] in function.__doc__
        for parameter in descriptors.load(name).parameters:
            assert f"\n{parameter.name} : " in function.__doc__


def test_a_default_in_percent_of_the_diagonal_is_one_of_this_mesh(ms):
    described = descriptors.load("apply_coord_spectral_smoothing")
    length = next(p for p in described.parameters if p.type == "length")
    percent = descriptors.Parameter(**(vars(length) | {"default": descriptors.Length(0.01)}))
    assert percent.shown_default == "1%"
    invented = descriptors.Descriptor("f", "F", "Smoothing", "", (percent,), needs_faces=True)
    assert resolve(invented, {}, ms) == {"wavelength": 0.01 * ms.current_mesh().bounding_box().diagonal()}


@pytest.mark.parametrize("name", ["apply_coord_spectral_smoothing", "apply_coord_spectral_low_pass"])
def test_progress_rises_to_one_when_the_mesh_has_its_new_coordinates(name):
    ms = meshset.new(*rough(torus(60, 40)))
    seen = []
    mss_filter = filters.FILTERS[name]
    mss_filter(ms, progress=seen.append)
    assert seen == sorted(seen)
    assert seen[-1] == 1
    assert 0.5 < seen[-2] < 0.9  # writing takes time too

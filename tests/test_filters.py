"""Our filters, called on MeshSets as MeshLab's are."""

import numpy as np
import pymeshlab
import pytest

import meshlab_specsmooth as mss
from meshlab_specsmooth import descriptors
from meshlab_specsmooth.bridge import filters, meshset
from tests import state
from tests.meshes import rough, torus

MESH = rough(torus(20, 12))
OURS = pytest.mark.parametrize(
    ("in_place", "on_arrays"),
    [(mss.apply_coord_spectral_smoothing, mss.smooth), (mss.apply_coord_spectral_low_pass, mss.low_pass)],
)


@pytest.fixture
def ms():
    return meshset.new(*MESH)


@OURS
@pytest.mark.parametrize("given", [{}, {"modes": 20}, {"modes": 20, "response": "heat", "laplacian": "cotangent"}])
def test_a_filter_gives_what_the_arrays_do_and_returns_the_evidence(ms, in_place, on_arrays, given):
    expected = on_arrays(*MESH, **given)
    evidence = in_place(ms, **given)
    assert np.array_equal(ms.current_mesh().vertex_matrix(), expected.vertices)
    for name, value in evidence.items():
        if name != "seconds":
            assert value == getattr(expected, name) or np.isnan(value)
    assert "vertices" not in evidence


@OURS
def test_lengths_are_in_mesh_units_or_percent_of_the_diagonal(ms, in_place, on_arrays):
    diagonal = ms.current_mesh().bounding_box().diagonal()
    for value in (pymeshlab.PercentageValue(25), pymeshlab.PureValue(diagonal / 4), diagonal / 4):
        assert in_place(meshset.new(*MESH), wavelength=value)["wavelength"] == pytest.approx(diagonal / 4)


@OURS
def test_zero_modes_and_wavelength_are_not_given(ms, in_place, on_arrays):
    assert in_place(ms, modes=0, wavelength=0.0)["wavelength"] == on_arrays(*MESH).wavelength


@OURS
@pytest.mark.parametrize(
    ("given", "words"),
    [
        (
            {"nodes": 3},
            r"Parameter nodes not found for filter apply_coord_spectral_\w+\. Please check the documentation\.",
        ),
        ({"modes": 2.0}, "Parameter modes: float value 2.0 where int is expected"),
        ({"modes": True}, "Parameter modes: bool value True where int is expected"),
        ({"modes": -1}, "Parameter modes: int value -1 out of bounds"),
        ({"wavelength": "2"}, "Parameter wavelength: str value '2' where length is expected"),
        ({"wavelength": float("nan")}, "Parameter wavelength: length value nan out of bounds"),
        ({"wavelength": float("inf")}, "Parameter wavelength: length value inf out of bounds"),
        ({"wavelength": pymeshlab.PureValue(-1)}, "Parameter wavelength: length value -1.0 out of bounds"),
        ({"response": "box"}, "Enum 'box' not found. Possible values are 'ideal'; 'butterworth'; 'gaussian'; 'heat'; "),
    ],
)
def test_bad_parameters_are_refused_in_meshlab_s_words_and_the_meshset_stays(ms, in_place, on_arrays, given, words):
    before = state.of_meshset(ms)
    with pytest.raises(pymeshlab.PyMeshLabException, match=words):
        in_place(ms, **given)
    assert state.differences(before, state.of_meshset(ms)) == []


def test_an_unknown_parameter_is_refused_in_the_very_words_of_pymeshlab(ms):
    with pytest.raises(pymeshlab.PyMeshLabException) as native:
        ms.apply_coord_laplacian_smoothing(nodes=3)
    with pytest.raises(pymeshlab.PyMeshLabException) as ours:
        mss.apply_coord_spectral_smoothing(ms, nodes=3)
    assert str(ours.value) == str(native.value).replace("laplacian", "spectral")


def test_an_empty_meshset_is_refused_in_the_very_words_of_pymeshlab():
    empty = pymeshlab.MeshSet()
    with pytest.raises(pymeshlab.PyMeshLabException) as native:
        empty.apply_coord_laplacian_smoothing()
    with pytest.raises(pymeshlab.PyMeshLabException) as ours:
        mss.apply_coord_spectral_smoothing(empty)
    assert str(ours.value) == str(native.value).replace("laplacian", "spectral")


def test_a_point_cloud_is_refused_and_left_alone():
    ms = pymeshlab.MeshSet()
    ms.add_mesh(pymeshlab.Mesh(MESH[0]))
    before = state.of_meshset(ms)
    with pytest.raises(mss.InvalidSurface, match="faces is empty; smoothing needs triangles"):
        mss.apply_coord_spectral_smoothing(ms)
    assert state.differences(before, state.of_meshset(ms)) == []


def test_work_that_is_stopped_leaves_the_meshset_as_it_was(ms):
    before = state.of_meshset(ms)

    def stop(fraction):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        mss.apply_coord_spectral_smoothing(ms, modes=9, method="chebyshev", progress=stop)
    assert state.differences(before, state.of_meshset(ms)) == []


def test_filters_and_descriptors_name_each_other():
    assert tuple(sorted(filters.FILTERS)) == descriptors.names()
    for name, function in filters.FILTERS.items():
        assert function is getattr(mss, name)
        assert name in mss.__all__


def test_a_default_in_percent_of_the_diagonal_is_one_of_this_mesh(ms):
    described = descriptors.load("apply_coord_spectral_smoothing")
    length = next(p for p in described.parameters if p.type == "length")
    percent = descriptors.Parameter(**(vars(length) | {"default": descriptors.Length(0.01)}))
    switch = descriptors.Parameter("on", "bool", True, "On", "On.", -np.inf, np.inf, (), False)
    invented = descriptors.Descriptor("f", "F", "Smoothing", "", (percent, switch))
    values = filters.resolve(invented, {"on": False}, ms)
    assert values == {"wavelength": 0.01 * ms.current_mesh().bounding_box().diagonal(), "on": False}
    with pytest.raises(pymeshlab.PyMeshLabException, match="int value 1 where bool is expected"):
        filters.resolve(invented, {"on": 1}, ms)

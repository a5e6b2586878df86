"""The namespace of PyVista's PolyData."""

import importlib.metadata
import inspect
import json

import numpy as np
import pytest
import pyvista as pv

import meshlab_specsmooth as mss
from meshlab_specsmooth.geometry.surface import vertex_normals
from tests.meshes import noisy, torus


@pytest.fixture(scope="module")
def mesh():
    mesh = pv.PolyData.from_regular_faces(*noisy(torus(), 0.3))
    mesh.point_data["heat"] = np.arange(mesh.n_points)
    mesh.point_data["other"] = np.ones((mesh.n_points, 3))
    mesh.cell_data["part"] = np.arange(mesh.n_cells) % 3
    mesh.field_data["scanner"] = ["A"]
    mesh.point_data.active_scalars_name = "heat"
    return mesh


def test_pyvista_finds_it_by_the_entry_point():
    (entry,) = (e for e in importlib.metadata.entry_points(group="pyvista.accessors") if e.name == "specsmooth")
    assert entry.load().SpecsmoothAccessor is type(pv.PolyData().specsmooth)


@pytest.mark.parametrize("name", ["denoise", "low_pass"])
def test_a_filter_returns_a_new_mesh_with_all_arrays_and_the_evidence(mesh, name):
    before = mesh.copy()
    moved = getattr(mesh.specsmooth, name)()
    assert mesh == before
    assert moved is not mesh
    result = getattr(mss, name)(mesh)
    np.testing.assert_array_equal(moved.points, result.vertices)
    assert moved.active_scalars_name == "heat"
    for data in ("point_data", "cell_data", "field_data"):
        for key in getattr(mesh, data).keys():  # noqa: SIM118 (not a mapping)
            np.testing.assert_array_equal(getattr(moved, data)[key], getattr(mesh, data)[key])
    normals = vertex_normals(mss.Surface(mesh.points, mesh.regular_faces))
    along = np.einsum("ij,ij->i", result.vertices - mesh.points, normals)
    np.testing.assert_allclose(moved.point_data["specsmooth_displacement"], along, atol=1e-12)
    assert moved.specsmooth.result.summary == moved.specsmooth.summary == result.summary
    assert isinstance(json.loads(moved.field_data["specsmooth_setting"][0]), dict)


def test_the_evidence_is_kept_in_files(mesh, tmp_path):
    moved = mesh.specsmooth.smooth()
    moved.save(tmp_path / "smooth.vtp")
    read = pv.read(tmp_path / "smooth.vtp")
    assert read.specsmooth.summary == moved.specsmooth.summary
    assert read.specsmooth.result is None
    assert mesh.specsmooth.summary == "not smoothed"
    assert "not smoothed" in mesh.specsmooth._repr_html_()
    assert "<table" in moved.specsmooth._repr_html_()


def test_quads_and_strips_are_kept():
    quads = pv.Plane(i_resolution=20, j_resolution=20)
    quads.points[:, 2] += 0.02 * np.random.default_rng(0).standard_normal(quads.n_points)
    strips = quads.triangulate().strip()
    for each in (quads, strips):
        moved = each.specsmooth.smooth()
        np.testing.assert_array_equal(moved.faces, each.faces)
        np.testing.assert_array_equal(moved.strips, each.strips)
        assert np.abs(moved.points - each.points).max() > 0


@pytest.mark.parametrize("name", ["smooth_edge_aware", "enhance", "smooth_boundary"])
def test_all_filters_are_there(mesh, name):
    assert getattr(mesh.specsmooth, name)().specsmooth.result is not None


def test_measurements_are_those_of_the_functions(mesh):
    assert mesh.specsmooth.estimate_noise().level == mss.estimate_noise(mesh).level
    found = mesh.specsmooth.deviation(mesh.specsmooth.smooth(), tolerance="1%")
    assert found.corresponds
    compared = mesh.specsmooth.compare(filters=["laplacian"])
    assert type(compared) is mss.Comparison


def test_parameters_are_shown_and_checked(mesh):
    assert "max_displacement" in inspect.signature(mesh.specsmooth.denoise).parameters
    assert "faces" not in inspect.signature(mesh.specsmooth.smooth).parameters
    with pytest.raises(TypeError, match="Did you mean barycenter_weight"):
        mesh.specsmooth.smooth(baricenter_weight=1)


def test_a_response_of_one_s_own_is_no_data_and_stored_as_nothing(mesh):
    own = mesh.specsmooth.low_pass(response=lambda cutoff: mss.Response("own", np.exp, np.exp), wavelength=0.5)
    assert own.field_data["specsmooth_setting"][0] == ""


def test_a_mesh_without_faces_is_refused():
    with pytest.raises(mss.InvalidSurface):
        pv.PolyData(np.eye(3)).specsmooth.denoise()

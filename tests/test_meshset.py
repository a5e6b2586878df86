"""Writing into a MeshSet: coordinates arrive exactly, and nothing else changes."""

import functools
import os
import subprocess
import sys

import numpy as np
import pymeshlab
import pytest

import meshlab_specsmooth as mss
from meshlab_specsmooth.meshlab import (
    commit,
    descriptors,
    filter_script,
    mesh_files,
    meshset,
    native_output,
    scripts,
)
from tests import state
from tests.meshes import torus


def set_quality(ms, quality):
    written = commit.average_coincident(ms.current_mesh().vertex_matrix(), quality)
    commit.write(ms, commit.Change(quality=written))
    return written


def test_only_coordinates_normals_and_bounding_box_change(laden):
    held = laden.current_mesh()
    before = state.of_meshset(laden)
    assert {
        "vertex colors",
        "wedge texture coordinates",
        "vertex attribute no identifier!",
        "vertex point attribute flow",
    } <= set(before["meshes"][1])
    V = laden.current_mesh().vertex_matrix()
    W = V + np.random.default_rng(0).standard_normal(V.shape)
    meshset.set_vertices(laden, W)
    assert np.array_equal(held.vertex_matrix(), W)
    assert np.array_equal(laden.mesh(1).vertex_matrix(), W)
    changed = state.differences(before, state.of_meshset(laden))
    assert set(changed) == {f"/meshes[1]/{part}" for part in state.FOLLOWS}


def test_normals_and_bounding_box_are_those_of_the_new_coordinates(laden):
    laden.compute_matrix_from_translation_rotation_scale(freeze=False)
    V, F = meshset.get_arrays(laden)
    W = V[:, [1, 2, 0]] * 2.0
    meshset.set_vertices(laden, W)
    mesh = laden.current_mesh()
    assert np.array_equal(mesh.bounding_box().max(), W.max(axis=0))
    normals = np.cross(W[F[:, 1]] - W[F[:, 0]], W[F[:, 2]] - W[F[:, 0]])
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    assert mesh.face_normal_matrix() == pytest.approx(normals)


@pytest.mark.parametrize("factor", [1e-300, 1e-9, 1.0, 1e12, 1e300])
def test_large_moves_arrive_exactly(factor):
    V, F = torus(8, 6)
    ms = meshset.new(V, F)
    W = factor * np.random.default_rng(1).standard_normal(V.shape)
    meshset.set_vertices(ms, W)
    assert np.array_equal(ms.current_mesh().vertex_matrix(), W)


def test_quads_and_polygons_survive():
    ms = pymeshlab.MeshSet()
    ms.load_new_mesh(str(mesh_files.sample("cube.obj")))
    ms.meshing_tri_to_quad_by_smart_triangle_pairing()
    polygons = ms.current_mesh().polygonal_face_list()
    assert {len(p) for p in polygons} == {4}
    mss.apply_coord_spectral_smoothing(ms, modes=5)
    assert [list(p) for p in ms.current_mesh().polygonal_face_list()] == [list(p) for p in polygons]


def test_the_filter_script_is_unchanged(laden):
    before = state.of_meshset(laden)["script"]
    assert before.count("<filter ") == 5
    meshset.set_vertices(laden, laden.current_mesh().vertex_matrix() + 1)
    assert state.of_meshset(laden)["script"] == before
    empty = meshset.new(*torus(5, 5))
    meshset.set_vertices(empty, empty.current_mesh().vertex_matrix() + 1)
    assert "<filter" not in state.of_meshset(empty)["script"]


VERBOSE_OR_NOT = """
import sys, pymeshlab
from meshlab_specsmooth.meshlab import meshset
ms = pymeshlab.MeshSet(verbose=sys.argv[1] == "verbose")
ms.create_sphere()
ms.apply_coord_taubin_smoothing()
meshset.set_vertices(ms, ms.current_mesh().vertex_matrix() * 1.5)
ms.apply_coord_laplacian_smoothing()
"""


@pytest.mark.parametrize("verbosity", ["verbose", "silent"])
def test_nothing_is_printed_and_the_verbosity_stays(verbosity):
    """In a process of its own, so that everything that C++ has buffered is out in the end."""
    done = subprocess.run([sys.executable, "-c", VERBOSE_OR_NOT, verbosity], capture_output=True, text=True, check=True)
    printed = done.stdout + done.stderr
    if verbosity == "silent":
        assert printed == ""
    else:
        assert "Applying filter apply_coord_laplacian_smoothing" in printed
        for helper in ("morphing", "delete", "Reading filter"):
            assert helper not in printed


def test_a_call_takes_as_long_after_many_others(monkeypatch):
    """The script is neither saved nor loaded, and the standard streams are left alone: until somebody looks at it."""
    ms = meshset.new(*torus(6, 5))
    call = functools.partial(mss.compute_scalar_by_spectral_displacement, ms, modes=5, barycenter_weight=1.0)
    call()  # asks once what is printed

    def fail(*_):
        raise AssertionError("not at every call")

    with monkeypatch.context() as during:
        during.setattr(native_output, "capture", fail)
        for name in ("_NATIVE_SAVE", "_NATIVE_LOAD"):
            during.setattr(filter_script, name, fail)
        for _ in range(2):
            ms.apply_coord_taubin_smoothing(stepsmoothnum=1)
            call()
            mss.apply_coord_spectral_smoothing(ms, modes=5, barycenter_weight=1.0)
    ms.apply_coord_laplacian_smoothing()
    names = [
        "Spectral Displacement",
        *2 * ["Taubin Smooth", "Spectral Displacement", "Spectral Smooth"],
        "Laplacian Smooth",
    ]
    assert [step.name for step in scripts.script_of(ms).steps] == [
        descriptors.load("compute_scalar_by_spectral_displacement").name if name == "Spectral Displacement" else name
        for name in names
    ]


@pytest.mark.parametrize("looks", ["save", "clear", "delete everything"])
def test_the_script_is_right_whoever_looks_at_it(looks, tmp_path, capfd):
    ms = meshset.new(*torus(6, 5))
    for _ in range(2):
        mss.apply_coord_spectral_smoothing(ms, modes=5, barycenter_weight=1.0)
    if looks == "clear":
        ms.clear_filter_script()
    elif looks == "delete everything":  # ids come again
        ms.clear()
        ms.add_mesh(pymeshlab.Mesh(*torus(6, 5)))
        ms.add_mesh(pymeshlab.Mesh(*torus(6, 5)))
        ms.compute_coord_linear_morphing(targetmesh=0)
        mss.apply_coord_spectral_smoothing(ms, modes=5, barycenter_weight=1.0)
    ms.save_filter_script(str(tmp_path / "a.mlx"))
    text = (tmp_path / "a.mlx").read_text()
    assert text.count("Spectral Smooth") == {"save": 2, "clear": 0, "delete everything": 3}[looks]
    assert text.count("<filter ") == {"save": 2, "clear": 0, "delete everything": 4}[looks]
    ms.print_filter_script()
    assert f"Filter Script Size : {text.count('<filter ')}" in capfd.readouterr().out


def test_what_is_printed_may_change_after_a_call(capfd):
    ms = meshset.new(*torus(6, 5))
    call = functools.partial(mss.apply_coord_spectral_smoothing, ms, modes=5, barycenter_weight=1.0)
    call()
    assert capfd.readouterr() == ("", "")
    ms.set_verbosity(True)
    call()
    printed = capfd.readouterr().out
    assert printed.startswith("\nApplying filter apply_coord_spectral_smoothing with")
    assert printed.count("Applying filter") == 1
    ms.set_verbosity(False)
    call()
    assert capfd.readouterr() == ("", "")


def test_coordinates_of_another_mesh_are_refused(laden):
    before = state.of_meshset(laden)
    with pytest.raises(mss.MeshSetError, match="5 coordinates for a mesh of 42 vertices"):
        meshset.set_vertices(laden, np.zeros((5, 3)))
    assert state.differences(before, state.of_meshset(laden)) == []


class Interrupted(BaseException):
    pass


def test_an_interrupted_write_leaves_the_meshset_unchanged(laden, monkeypatch):
    before = state.of_meshset(laden)
    real = pymeshlab.MeshSet.compute_coord_linear_morphing
    calls = []

    def half_then_stop(ms, **given):
        calls.append(given)
        if len(calls) == 1:
            real(ms, targetmesh=given["targetmesh"], percentmorph=50.0)
            raise Interrupted
        real(ms, **given)

    monkeypatch.setattr(pymeshlab.MeshSet, "compute_coord_linear_morphing", half_then_stop)
    with pytest.raises(Interrupted):
        meshset.set_vertices(laden, laden.current_mesh().vertex_matrix() + 1)
    assert len(calls) > 1
    assert state.differences(before, state.of_meshset(laden)) == []


def test_a_failed_morph_is_undone_and_reported(laden, monkeypatch):
    before = state.of_meshset(laden)
    real = pymeshlab.MeshSet.compute_coord_linear_morphing
    calls = []

    def lazy_at_first(ms, **given):
        calls.append(given)
        real(ms, targetmesh=given["targetmesh"], percentmorph=50.0 if len(calls) <= 3 else 100.0)

    monkeypatch.setattr(pymeshlab.MeshSet, "compute_coord_linear_morphing", lazy_at_first)
    with pytest.raises(mss.MeshSetError, match="in 3 morphing passes"):
        meshset.set_vertices(laden, laden.current_mesh().vertex_matrix() + 1)
    assert state.differences(before, state.of_meshset(laden)) == []


def test_quality_arrives_exactly_and_nothing_else_changes(laden):
    before = state.of_meshset(laden)
    quality = np.random.default_rng(7).standard_normal(laden.current_mesh().vertex_number())
    assert np.array_equal(set_quality(laden, quality), quality)
    assert np.array_equal(laden.current_mesh().vertex_scalar_array(), quality)
    assert state.differences(before, state.of_meshset(laden)) == ["/meshes[1]/vertex quality"]


def test_coincident_vertices_get_their_mean_quality():
    V = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 0]])
    ms = meshset.new(V, [[0, 1, 2], [3, 2, 1]])
    written = set_quality(ms, np.array([1.0, 5.0, 7.0, 3.0]))
    assert written.tolist() == ms.current_mesh().vertex_scalar_array().tolist() == [2, 5, 7, 2]


def test_quality_that_does_not_arrive_is_reported(laden, monkeypatch):
    monkeypatch.setattr(pymeshlab.MeshSet, "transfer_attributes_per_vertex", lambda *_, **__: None)
    monkeypatch.setattr(commit, "_takes_quality", lambda mesh, quality: True)  # as tried on a copy
    n = laden.current_mesh().vertex_number()
    number = laden.mesh_number()
    with pytest.raises(mss.MeshSetError, match="did not take its new vertex quality"):
        set_quality(laden, np.full(n, 7.5))
    assert laden.mesh_number() == number


def test_a_quality_that_would_not_arrive_is_refused_before_the_mesh_is_changed():
    """Its squared distances are lost in rounding, so that pymeshlab takes other vertices for the nearest."""
    corners = 1e16 + 2.0 * np.array([[0, 0, 0], [0, 1, 0], [1, 0, 1], [0, 0, 0], [0, 1, 0], [0, 0, 1], [0, 0, 0]])
    ms = meshset.new(corners, [[0, 1, 2], [0, 1, 3], [0, 1, 4], [0, 1, 5], [0, 1, 6], [0, 1, 2], [0, 1, 3]])
    before = state.of_meshset(ms)
    with pytest.raises(mss.MeshSetError, match="vertex quality cannot be set: .*; scale or center the mesh"):
        set_quality(ms, np.arange(7.0))
    assert not state.differences(before, state.of_meshset(ms))


@pytest.mark.parametrize("stream", ["stdout", "stderr"])
def test_vertices_can_be_set_without_standard_streams(monkeypatch, stream):
    ms = meshset.new(*torus(6, 5))
    monkeypatch.setattr(sys, stream, None)
    meshset.set_vertices(ms, ms.current_mesh().vertex_matrix() + 1)
    assert ms.mesh_number() == 1


CLOSED = """
import os
import numpy, pymeshlab
from meshlab_specsmooth.meshlab import meshset
for numbers in ([1], [2], [1, 2]):
    copy = os.fork()
    if copy == 0:
        for number in numbers:
            os.close(number)
        ms = meshset.new(numpy.eye(3), numpy.array([[0, 1, 2]]))
        meshset.set_vertices(ms, ms.current_mesh().vertex_matrix() + 1)
        os._exit(not (ms.current_mesh().vertex_matrix() == numpy.eye(3) + 1).all())
    assert os.waitpid(copy, 0)[1] == 0, numbers
"""


@pytest.mark.no_cover
@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork")
def test_vertices_can_be_set_with_closed_output():
    done = subprocess.run([sys.executable, "-c", CLOSED], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def test_the_next_mesh_gets_the_id_after_the_temporary_one():
    ms = meshset.new(*torus(6, 5))
    meshset.set_vertices(ms, ms.current_mesh().vertex_matrix() + 1)
    ms.create_cube()
    assert [m.id() for m in ms] == [0, 2]

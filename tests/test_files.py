"""Mesh files in and out; an output is whole or not there."""

import numpy as np
import pymeshlab
import pytest

import meshlab_specsmooth as mss
from meshlab_specsmooth.bridge import files, meshset
from tests.meshes import torus


@pytest.mark.parametrize("ending", ["ply", "obj", "stl", "off"])
@pytest.mark.parametrize("name", ["mesh", "a mesh with 'spaces' and ümlauts"])
def test_what_is_written_can_be_read(tmp_path, ending, name):
    V, F = torus(8, 6)
    path = tmp_path / f"{name}.{ending}"
    files.write(meshset.new(V, F), path)
    W, G = meshset.pull(files.read(path))
    assert len(G) == len(F)
    assert np.asarray(W[G]) == pytest.approx(V[F], abs=1e-5)
    assert [file.name for file in tmp_path.iterdir()] == [path.name]


def test_materials_and_textures_come_along(tmp_path):
    ms = files.read(files.sample("bunny10k_textured.obj"))
    files.write(ms, tmp_path / "copy.obj")
    assert (tmp_path / "copy.obj.mtl").is_file()
    assert files.read(tmp_path / "copy.obj").current_mesh().texture_number() == ms.current_mesh().texture_number() > 0


def test_a_missing_or_unreadable_file_is_one_clear_error(tmp_path):
    with pytest.raises(mss.FileError, match="nowhere.ply: no such file"):
        files.read(tmp_path / "nowhere.ply")
    strange = tmp_path / "notes.xyzzy"
    strange.write_text("not a mesh")
    with pytest.raises(mss.FileError, match="notes.xyzzy: cannot be read: .*format") as caught:
        files.read(strange)
    assert "\n" not in str(caught.value)


def test_an_old_file_survives_a_failed_write(tmp_path, monkeypatch):
    target = tmp_path / "out.ply"
    target.write_text("old")

    def fail_half_way(ms, path, **_):
        with open(path, "w") as file:  # noqa: PTH123 (as pymeshlab does)
            file.write("half")
        raise pymeshlab.PyMeshLabException("disk\nfull")

    monkeypatch.setattr(pymeshlab.MeshSet, "save_current_mesh", fail_half_way)
    with pytest.raises(mss.FileError, match="out.ply: cannot be written: disk full"):
        files.write(meshset.new(*torus(5, 4)), target)
    assert target.read_text() == "old"
    assert list(tmp_path.iterdir()) == [target]


def test_an_unknown_format_a_folder_and_a_missing_folder_are_refused(tmp_path):
    ms = meshset.new(*torus(5, 4))
    with pytest.raises(mss.FileError, match="out.xyzzy: cannot be written: .*format"):
        files.write(ms, tmp_path / "out.xyzzy")
    with pytest.raises(mss.FileError, match="is a folder"):
        files.write(ms, tmp_path)
    with pytest.raises(mss.FileError, match="there is no folder"):
        files.write(ms, tmp_path / "none" / "out.ply")
    with pytest.raises(mss.FileError, match="there is no folder"):
        files.write_text(tmp_path / "none" / "out.txt", "")
    assert list(tmp_path.iterdir()) == []


def test_an_operating_system_error_names_the_file(tmp_path, monkeypatch):
    def full(*_, **__):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(files.tempfile, "TemporaryDirectory", full)
    with pytest.raises(mss.FileError, match="out.ply: cannot be written: No space left"):
        files.write(meshset.new(*torus(5, 4)), tmp_path / "out.ply")
    with pytest.raises(mss.FileError, match="out.txt: cannot be written: No space left"):
        files.write_text(tmp_path / "out.txt", "text")


def test_text_is_written_whole(tmp_path):
    files.write_text(tmp_path / "t.txt", "eins ä\n")
    assert (tmp_path / "t.txt").read_text(encoding="utf-8") == "eins ä\n"
    assert len(list(tmp_path.iterdir())) == 1
    (tmp_path / "plain.txt").touch()
    assert (tmp_path / "t.txt").stat().st_mode == (tmp_path / "plain.txt").stat().st_mode


def test_samples_come_with_pymeshlab():
    assert files.sample("bunny.obj").is_file()
    with pytest.raises(mss.FileError, match="teapot.obj: not in pymeshlab 20"):
        files.sample("teapot.obj")

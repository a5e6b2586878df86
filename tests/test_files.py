"""Mesh files in and out; an output is whole or not there."""

import base64
import filecmp
import json

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


def textured(folder, *textures, name="in.obj"):
    """A tetrahedron with these textures, one a face, as an OBJ file with materials; the images are not made."""
    folder.mkdir(parents=True, exist_ok=True)
    corners = ["v 0 0 0", "v 1 0 0", "v 0 1 0", "v 0 0 1", "vt 0 0", "vt 1 0", "vt 0 1"]
    faces = ["f 1/1 3/2 2/3", "f 1/1 2/2 4/3", "f 2/1 3/2 4/3", "f 1/1 4/2 3/3"]
    for i in range(len(textures)):
        faces[i] = f"usemtl m{i}\n{faces[i]}"
    (folder / name).write_text("\n".join(["mtllib m.mtl", *corners, *faces]) + "\n")
    (folder / "m.mtl").write_text("".join(f"newmtl m{i}\nmap_Kd {name}\n" for i, name in enumerate(textures)))
    return folder / name


def image(path):
    """A PNG, made by the only writer of images at hand: pymeshlab's own."""
    ms = files.read(files.sample("bunny10k_textured.obj"))  # its images die with it
    path.parent.mkdir(parents=True, exist_ok=True)
    ms.current_mesh().textures()["TextureDouble_A.png"].save(str(path))
    return path


def references(path):
    """Names of textures in an OBJ file's materials or a PLY file's header."""
    text = (path if path.suffix == ".ply" else path.with_name(path.name + ".mtl")).read_bytes().decode("latin-1")
    return [line.split()[-1] for line in text.splitlines() if line.startswith(("map_Kd", "comment TextureFile"))]


@pytest.mark.parametrize("ending", ["obj", "ply"])
def test_textures_that_pymeshlab_cannot_read_stay_with_the_mesh(tmp_path, ending):
    source = textured(tmp_path / "in", "brick.jpg", "sub\\moss.tif", "missing.png", "stone.png")
    (tmp_path / "in" / "sub").mkdir()
    (tmp_path / "in" / "brick.jpg").write_bytes(b"a JPEG")
    (tmp_path / "in" / "sub" / "moss.tif").write_bytes(b"a TIFF")
    image(tmp_path / "in" / "stone.png")
    (tmp_path / "out").mkdir()
    out = tmp_path / "out" / f"o.{ending}"
    for step in (source, out):  # what was written is in turn such a file
        files.write(files.read(step), tmp_path / "again.ply" if step == out else out, source=step)
    for written in (out, tmp_path / "again.ply"):
        assert references(written) == ["brick.jpg", "sub/moss.tif", "missing.png", "stone.png"]
        for name in ("brick.jpg", "sub/moss.tif", "stone.png"):
            assert filecmp.cmp(written.parent / name, tmp_path / "in" / name, shallow=False)
        assert not (written.parent / "missing.png").exists()
        assert not (written.parent / "dummy.png").exists()


@pytest.mark.parametrize("name", ["../outside.jpg", "with a space.jpg"])
def test_a_texture_that_would_be_lost_is_refused(tmp_path, name):
    source = textured(tmp_path / "in", name)
    (tmp_path / "in" / name).write_bytes(b"a JPEG")
    with pytest.raises(mss.FileError, match=f"in.obj: pymeshlab cannot read its texture {name}; convert it to PNG"):
        files.read(source)


def test_a_stand_in_for_a_texture_is_never_written(tmp_path):
    ms = files.read(textured(tmp_path / "in", "missing.png"))
    with pytest.raises(mss.FileError, match="missing.png: a texture that pymeshlab could not read"):
        files.write(ms, tmp_path / "out.ply")
    lost = pymeshlab.MeshSet()
    lost.load_new_mesh(str(tmp_path / "in" / "in.obj"))
    with pytest.raises(mss.FileError, match="dummy.png: a texture that pymeshlab could not read"):
        files.write(lost, tmp_path / "out.ply")
    assert [file.name for file in tmp_path.iterdir()] == ["in"]


def test_a_texture_that_is_called_as_pymeshlab_calls_a_lost_one_is_as_good_as_any(tmp_path):
    source = textured(tmp_path / "in", "dummy.png")
    original = image(tmp_path / "in" / "dummy.png").read_bytes()
    files.write(files.read(source), tmp_path / "out.ply", source=source)
    assert references(tmp_path / "out.ply") == ["dummy.png"]
    assert (tmp_path / "dummy.png").read_bytes() == original


def test_the_texture_of_the_input_is_left_as_it_is(tmp_path):
    source = textured(tmp_path, "t.png", "missing.png")
    image(tmp_path / "t.png").write_bytes((files.sample("TextureDouble_A.png")).read_bytes())
    before = (tmp_path / "t.png").stat()
    assert before.st_size != image(tmp_path / "encoded.png").stat().st_size  # pymeshlab would write other bytes
    for out in (tmp_path / "out.obj", tmp_path / "out.ply", source):
        files.write(files.read(source), out, source=source)
    after = (tmp_path / "t.png").stat()
    assert (after.st_ino, after.st_mtime_ns, after.st_size) == (before.st_ino, before.st_mtime_ns, before.st_size)


@pytest.mark.parametrize("given", [True, False])
def test_a_file_that_happens_to_have_the_name_of_a_texture_is_not_replaced(tmp_path, given):
    source = textured(tmp_path / "in", "sub/t.png")
    image(tmp_path / "in" / "sub" / "t.png")
    (tmp_path / "sub").mkdir()
    (tmp_path / "sub" / "t.png").write_text("mine")
    (tmp_path / "out.obj").write_text("old")
    (tmp_path / "out.obj.mtl").write_text("old")
    with pytest.raises(mss.FileError, match="t.png: another file of that name belongs to out.obj"):
        files.write(files.read(source), tmp_path / "out.obj", source=source if given else None)
    assert (tmp_path / "sub" / "t.png").read_text() == "mine"
    assert (tmp_path / "out.obj").read_text() == (tmp_path / "out.obj.mtl").read_text() == "old"
    (tmp_path / "sub" / "t.png").unlink()
    for _ in range(2):  # the second time an equal one is there
        files.write(files.read(source), tmp_path / "out.obj", source=source if given else None)
    assert references(tmp_path / "out.obj") == ["sub/t.png"]  # its materials are its own, and were replaced


def test_a_texture_outside_of_the_folder_stays_where_it_is_or_is_refused(tmp_path):
    source = textured(tmp_path / "a" / "in", "../t.png")
    image(tmp_path / "a" / "t.png")
    (tmp_path / "a" / "out").mkdir()
    files.write(files.read(source), tmp_path / "a" / "out" / "o.ply", source=source)
    assert references(tmp_path / "a" / "out" / "o.ply") == ["../t.png"]
    (tmp_path / "b").mkdir()
    with pytest.raises(mss.FileError, match="t.png: a texture outside of the mesh's folder"):
        files.write(files.read(source), tmp_path / "b" / "o.ply", source=source)
    assert [file.name for file in tmp_path.iterdir() if file.is_file()] == []


def test_a_format_without_textures_gets_none(tmp_path):
    source = files.sample("bunny10k_textured.obj")
    files.write(files.read(source), tmp_path / "o.stl", source=source)
    assert [file.name for file in tmp_path.iterdir()] == ["o.stl"]


def gltf(path, meshes, **image):
    """A triangle so many times, with a texture if one is described."""
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], dtype="<f4")
    data = corners.tobytes() + np.arange(3, dtype="<u4").tobytes() + corners[:, :2].tobytes()
    views = [{"buffer": 0, "byteOffset": o, "byteLength": n} for o, n in ((0, 36), (36, 12), (48, 24))]
    kinds = [(5126, "VEC3", {"min": [0, 0, 0], "max": [1, 1, 0]}), (5125, "SCALAR", {}), (5126, "VEC2", {})]
    triangle = {"attributes": {"POSITION": 0, "TEXCOORD_0": 2}, "indices": 1, **({"material": 0} if image else {})}
    document = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": list(range(meshes))}],
        "nodes": [{"mesh": i} for i in range(meshes)],
        "meshes": [{"primitives": [triangle]}] * meshes,
        "buffers": [
            {"uri": f"data:application/octet-stream;base64,{base64.b64encode(data).decode()}", "byteLength": len(data)}
        ],
        "bufferViews": views,
        "accessors": [
            {"bufferView": i, "componentType": kind, "count": 3, "type": shape, **bounds}
            for i, (kind, shape, bounds) in enumerate(kinds)
        ],
    }
    if image:
        document["images"], document["textures"] = [image], [{"source": 0}]
        document["materials"] = [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}]
    path.write_text(json.dumps(document))
    return path


def test_several_meshes_in_a_file_are_refused(tmp_path):
    assert files.read(gltf(tmp_path / "one.gltf", 1)).mesh_number() == 1
    with pytest.raises(mss.FileError, match="three.gltf: holds 3 meshes; save each as a file of its own"):
        files.read(gltf(tmp_path / "three.gltf", 3))


def test_textures_of_other_formats_are_kept_or_refused_too(tmp_path):
    (tmp_path / "out").mkdir()
    encoded = image(tmp_path / "t.png").read_bytes()
    beside = gltf(tmp_path / "beside.gltf", 1, uri="t.png")
    files.write(files.read(beside), tmp_path / "out" / "o.obj", source=beside)
    assert (tmp_path / "out" / "t.png").read_bytes() == encoded
    inside = gltf(
        tmp_path / "inside.gltf", 1, uri=f"data:image/png;base64,{base64.b64encode(encoded).decode()}", name="brick"
    )
    with pytest.raises(mss.FileError, match="inside.obj: cannot be written: Cannot save .*texture_0"):
        files.write(files.read(inside), tmp_path / "inside.obj", source=inside)
    with pytest.raises(mss.FileError, match="missing.gltf: pymeshlab cannot read its texture .of unknown name"):
        files.read(gltf(tmp_path / "missing.gltf", 1, uri="nowhere.png"))


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


@pytest.mark.parametrize(
    ("name", "problem"),
    [
        ("out.xyzzy", "cannot be written: Unknown format"),
        ("out", "cannot be written: Unknown format"),
        ("out.glb", "cannot be written: Unknown format"),  # it is read, not written
        ("out.u3d", "cannot be written: pymeshlab writes no .u3d file"),
        (".", "is a folder"),
        ("none/out.ply", "there is no folder"),
    ],
)
def test_a_target_is_refused_before_there_is_anything_to_write(tmp_path, name, problem):
    with pytest.raises(mss.FileError, match=problem):
        files.check_target(tmp_path / name)
    with pytest.raises(mss.FileError, match=problem):
        files.write(meshset.new(*torus(5, 4)), tmp_path / name)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("ending", ["ply", "PLY", "obj", "stl", "off", "dae", "wrl", "x3d", "3ds", "3mf", "ctm", "xyz"])
def test_a_target_in_a_format_that_pymeshlab_writes_is_accepted(tmp_path, ending):
    assert files.check_target(tmp_path / f"out.{ending}") == tmp_path.resolve() / f"out.{ending}"
    assert list(tmp_path.iterdir()) == []


def test_a_folder_that_is_not_writable_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(files.os, "access", lambda path, mode: False)  # root may write everywhere
    with pytest.raises(mss.FileError, match="out.ply: the folder .* is not writable"):
        files.check_target(tmp_path / "out.ply")


def test_a_link_is_written_through(tmp_path):
    (tmp_path / "data").mkdir()
    link = tmp_path / "link.obj"
    link.symlink_to("data/real.obj")
    for _ in range(2):  # to a file that is not there yet, and to one that is
        files.write(meshset.new(*torus(5, 4)), link)
    files.write_text(link, "text")
    assert link.is_symlink()
    assert (tmp_path / "data" / "real.obj").read_text() == "text"
    assert {file.name for file in tmp_path.iterdir()} == {"link.obj", "data"}


def test_companions_are_moved_first_and_the_file_itself_last(tmp_path, monkeypatch):
    moved = []
    replace = files.Path.replace

    def watched(self, target):
        moved.append(target.name)
        return replace(self, target)

    monkeypatch.setattr(files.Path, "replace", watched)
    with files.replacing(tmp_path / "m.obj") as part:
        for name in ("m.obj", "a.png", "m.obj.mtl", "z.png"):
            (part.parent / name).write_text(name)
    assert moved == ["a.png", "m.obj.mtl", "z.png", "m.obj"]


def test_nothing_is_moved_where_the_work_failed(tmp_path):
    def fail_after_writing():
        with files.replacing(tmp_path / "m.obj") as part:
            part.write_text("")
            (part.parent / "t.png").write_text("")
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        fail_after_writing()
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

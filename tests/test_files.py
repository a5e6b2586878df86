"""Mesh files in and out; an output is whole or not there."""

import base64
import filecmp
import json
import os
import struct
import sys
from pathlib import Path

import numpy as np
import pymeshlab
import pytest

import meshlab_specsmooth as mss
from meshlab_specsmooth.batching import work
from meshlab_specsmooth.meshlab import images, mesh_files, meshset
from meshlab_specsmooth.runtime import atomic, temporary
from tests.meshes import torus

PNG = b"\x89PNG\r\n\x1a\n" + bytes(30)  # begin as images do; pymeshlab reads neither
JPEG, TIFF = b"\xff\xd8\xff\xe0" + bytes(30), b"II*\0" + bytes(30)


@pytest.mark.parametrize("ending", ["ply", "obj", "stl", "off"])
@pytest.mark.parametrize("name", ["mesh", "a mesh with 'spaces' and ümlauts"])
def test_what_is_written_can_be_read(tmp_path, ending, name):
    V, F = torus(8, 6)
    path = tmp_path / f"{name}.{ending}"
    mesh_files.write(meshset.new(V, F), path)
    W, G = meshset.get_arrays(mesh_files.read(path))
    assert len(G) == len(F)
    assert np.asarray(W[G]) == pytest.approx(V[F], abs=1e-5)
    assert [file.name for file in tmp_path.iterdir()] == [path.name]


def test_materials_and_textures_come_along(tmp_path):
    ms = mesh_files.read(mesh_files.sample("bunny10k_textured.obj"))
    mesh_files.write(ms, tmp_path / "copy.obj")
    assert (tmp_path / "copy.obj.mtl").is_file()
    assert (
        mesh_files.read(tmp_path / "copy.obj").current_mesh().texture_number() == ms.current_mesh().texture_number() > 0
    )


def textured(folder, *textures, name="in.obj"):
    """A tetrahedron with these textures, one a face, as an OBJ file with materials; the images are not made."""
    folder.mkdir(parents=True, exist_ok=True)
    corners = ["v 0 0 0", "v 1 0 0", "v 0 1 0", "v 0 0 1", "vt 0 0", "vt 1 0", "vt 0 1"]
    faces = ["f 1/1 3/2 2/3", "f 1/1 2/2 4/3", "f 2/1 3/2 4/3", "f 1/1 4/2 3/3"]
    faces *= -(-len(textures) // 4)
    for i in range(len(textures)):
        faces[i] = f"usemtl m{i}\n{faces[i]}"
    (folder / name).write_text("\n".join(["mtllib m.mtl", *corners, *faces]) + "\n")
    materials = "".join(f"newmtl m{i}\nmap_Kd {name}\n" for i, name in enumerate(textures))
    (folder / "m.mtl").write_text(materials, encoding="utf-8")
    return folder / name


def image(path):
    """A PNG, made by the only writer of images at hand: pymeshlab's own."""
    ms = mesh_files.read(mesh_files.sample("bunny10k_textured.obj"))  # its images die with it
    path.parent.mkdir(parents=True, exist_ok=True)
    ms.current_mesh().textures()["TextureDouble_A.png"].save(str(path))
    return path


def references(path):
    """Names of textures in an OBJ file's materials or a PLY file's header."""
    data = (path if path.suffix == ".ply" else path.with_name(path.name + ".mtl")).read_bytes()
    text = data.decode("utf-8", "replace")
    return [line.split()[-1] for line in text.splitlines() if line.startswith(("map_Kd", "comment TextureFile"))]


@pytest.mark.parametrize("ending", ["obj", "ply"])
def test_textures_that_pymeshlab_cannot_read_stay_with_the_mesh(tmp_path, ending):
    source = textured(tmp_path / "in", "brick.jpg", "sub\\moss.tif", "missing.png", "stone.png")
    (tmp_path / "in" / "sub").mkdir()
    (tmp_path / "in" / "brick.jpg").write_bytes(JPEG)
    (tmp_path / "in" / "sub" / "moss.tif").write_bytes(TIFF)
    image(tmp_path / "in" / "stone.png")
    (tmp_path / "out").mkdir()
    out = tmp_path / "out" / f"o.{ending}"
    for step in (source, out):  # what was written is in turn such a file
        mesh_files.write(mesh_files.read(step), tmp_path / "again.ply" if step == out else out, source=step)
    for written in (out, tmp_path / "again.ply"):
        assert references(written) == ["brick.jpg", "sub/moss.tif", "missing.png", "stone.png"]
        for name in ("brick.jpg", "sub/moss.tif", "stone.png"):
            assert filecmp.cmp(written.parent / name, tmp_path / "in" / name, shallow=False)
        assert not (written.parent / "missing.png").exists()
        assert not (written.parent / "dummy.png").exists()


@pytest.mark.parametrize(
    ("line", "name", "file"),
    [
        ("with a space.jpg", "with_a_space.jpg", "with a space.jpg"),
        ('"with a space.jpg"', "with_a_space.jpg", "with a space.jpg"),
        ("with a space.jpg # a comment", "with_a_space.jpg", "with a space.jpg"),
        ("-s 2 2 1 -o 0.5 0 0 -clamp on -bm 0.5 brick.jpg", "brick.jpg", "brick.jpg"),
        ("-s 2 2 1 2 rooms.png", "2_rooms.png", "2 rooms.png"),
        ("sub folder\\it's.png", "sub_folder/it_s.png", "sub folder/it's.png"),
        ("C:\\Users\\me\\brick 1.jpg", "brick_1.jpg", "brick 1.jpg"),
        ("a+b-c.d@e.png", "a+b-c.d@e.png", "a+b-c.d@e.png"),
    ],
)
@pytest.mark.parametrize("ending", ["obj", "ply"])
def test_a_texture_of_any_name_comes_along(tmp_path, line, name, file, ending):
    source = textured(tmp_path / "in", line)
    (tmp_path / "in" / file).parent.mkdir(exist_ok=True)
    (tmp_path / "in" / file).write_bytes(JPEG)
    out = tmp_path / "out" / f"o.{ending}"
    out.parent.mkdir()
    assert mesh_files.write(mesh_files.read(source), out, source=source).notices == ()
    assert references(out) == [name]
    assert (out.parent / name).read_bytes() == JPEG
    assert mesh_files.read(out).current_mesh().texture_number() == 1


HARMFUL = {
    ".ssh/authorized_keys": b"ssh-rsa",
    ".hidden.png": PNG,
    ".git/t.png": PNG,
    "notes.txt": b"text",
    "script.py": PNG,
    "text.png": b"text",
    "text.tga": b"\0\0\2text, and more than a header has",
    "bm.bmp": b"BM is how this text begins, and it is no image",
    "link.png": None,
    "linked/t.png": None,
    "o.obj": b"v 0 0 0",
    "o.obj.mtl": b"newmtl x",
    "o.ply": PNG,
    "missing.png": ...,
}


def test_a_texture_whose_name_is_not_ascii_comes_along(tmp_path):
    source = textured(tmp_path / "in", "ümlaut.png")
    (tmp_path / "in" / "ümlaut.png").write_bytes(JPEG)
    ply = tmp_path / "in" / "m.ply"
    mesh_files.write(mesh_files.read(source), ply, source=source)
    assert references(ply) == ["ümlaut.png"]
    mesh_files.write(mesh_files.read(ply), tmp_path / "o.ply", source=ply)  # pymeshlab reads none of a PLY file
    assert references(tmp_path / "o.ply") == ["_mlaut.png"]
    assert (tmp_path / "_mlaut.png").read_bytes() == JPEG


@pytest.mark.parametrize("ending", ["obj", "ply"])
def test_nothing_but_visible_images_is_copied(tmp_path, ending):
    """A texture named in a file may be any file of the one who opens it, and any place below the output's folder."""
    source = textured(tmp_path / "in", *HARMFUL)
    (tmp_path / "secret.png").write_bytes(PNG)
    (tmp_path / "images").mkdir()
    (tmp_path / "images" / "t.png").write_bytes(PNG)
    (tmp_path / "in" / "link.png").symlink_to("../secret.png")
    (tmp_path / "in" / "linked").symlink_to("../images")
    for name, data in HARMFUL.items():
        if isinstance(data, bytes):
            (tmp_path / "in" / name).parent.mkdir(exist_ok=True)
            (tmp_path / "in" / name).write_bytes(data)
    out = tmp_path / "out" / f"o.{ending}"
    out.parent.mkdir()
    (notice,) = mesh_files.write(mesh_files.read(source), out, source=source).notices
    assert notice.startswith(f"{out}: refers to textures that are not copied: ")
    assert "\n" not in notice
    assert {path.name for path in out.parent.rglob("*")} == {"o.obj", "o.obj.mtl"} if ending == "obj" else {"o.ply"}


def test_no_texture_is_written_through_a_link(tmp_path):
    source = textured(tmp_path / "in", "t.png", "sub/t.png")
    for folder in ("in/sub", "out", "elsewhere"):
        (tmp_path / folder).mkdir()
    for name in ("t.png", "sub/t.png"):
        (tmp_path / "in" / name).write_bytes(PNG)
    (tmp_path / "out" / "t.png").symlink_to("../elsewhere/t.png")
    (tmp_path / "out" / "sub").symlink_to("../elsewhere")
    (notice,) = mesh_files.write(mesh_files.read(source), tmp_path / "out" / "o.ply", source=source).notices
    assert notice.count("a symbolic link is in its place") == 2
    assert list((tmp_path / "elsewhere").iterdir()) == []


@pytest.mark.parametrize(
    ("start", "ending", "is_image"),
    [
        (PNG, ".jpg", True),
        (JPEG, ".jpg", True),
        (b"GIF89a", ".gif", True),
        (b"RIFF\0\0\0\0WEBPVP8 ", ".webp", True),
        (b"RIFF\0\0\0\0WAVEfmt ", ".webp", False),
        (b"P6\n# by hand\n2 3\n255\n", ".ppm", True),
        (b"P6 is a name", ".ppm", False),
        (b"BM" + bytes(12) + b"\x28\0\0\0", ".bmp", True),
        (bytes(2) + b"\2" + bytes(9) + b"\1\0\1\0\x18\0" + bytes(3), ".tga", True),
        (bytes(2) + b"\2" + bytes(9) + b"\1\0\1\0\x18\0" + bytes(2), ".tga", False),
        (bytes(2) + b"\2" + bytes(9) + b"\1\0\1\0\x18\0" + bytes(3), ".png", False),
        (bytes(60), ".tga", False),
        (b"", ".png", False),
    ],
)
def test_images_are_known_by_their_first_bytes(start, ending, is_image):
    assert images.is_image_data(start, len(start), ending) == is_image


def test_a_stand_in_for_a_texture_is_never_written(tmp_path):
    ms = mesh_files.read(textured(tmp_path / "in", "missing.png"))
    with pytest.raises(mss.FileError, match="missing.png: pymeshlab could not read this texture"):
        mesh_files.write(ms, tmp_path / "out.ply")
    lost = pymeshlab.MeshSet()
    lost.load_new_mesh(str(tmp_path / "in" / "in.obj"))
    with pytest.raises(mss.FileError, match="dummy.png: pymeshlab could not read this texture"):
        mesh_files.write(lost, tmp_path / "out.ply")
    assert [file.name for file in tmp_path.iterdir()] == ["in"]


def test_a_texture_with_pymeshlabs_placeholder_name_is_copied(tmp_path):
    source = textured(tmp_path / "in", "dummy.png")
    original = image(tmp_path / "in" / "dummy.png").read_bytes()
    mesh_files.write(mesh_files.read(source), tmp_path / "out.ply", source=source)
    assert references(tmp_path / "out.ply") == ["dummy.png"]
    assert (tmp_path / "dummy.png").read_bytes() == original


def test_the_texture_of_the_input_is_left_as_it_is(tmp_path):
    source = textured(tmp_path, "t.png", "missing.png")
    image(tmp_path / "t.png").write_bytes((mesh_files.sample("TextureDouble_A.png")).read_bytes())
    before = (tmp_path / "t.png").stat()
    assert before.st_size != image(tmp_path / "encoded.png").stat().st_size  # pymeshlab would write other bytes
    for out in (tmp_path / "out.obj", tmp_path / "out.ply", source):
        mesh_files.write(mesh_files.read(source), out, source=source)
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
    with pytest.raises(mss.FileError, match="t.png: exists with other content, and out.obj needs this name"):
        mesh_files.write(mesh_files.read(source), tmp_path / "out.obj", source=source if given else None)
    assert (tmp_path / "sub" / "t.png").read_text() == "mine"
    assert (tmp_path / "out.obj").read_text() == (tmp_path / "out.obj.mtl").read_text() == "old"
    (tmp_path / "sub" / "t.png").unlink()
    for _ in range(2):  # the second time an equal one is there
        mesh_files.write(mesh_files.read(source), tmp_path / "out.obj", source=source if given else None)
    assert references(tmp_path / "out.obj") == ["sub/t.png"]  # its materials are its own, and were replaced


def test_a_texture_outside_of_the_folder_stays_where_it_is(tmp_path):
    source = textured(tmp_path / "a" / "in", "../kept_outside.png")
    image(tmp_path / "a" / "kept_outside.png")
    (tmp_path / "a" / "out").mkdir()
    mesh_files.write(mesh_files.read(source), tmp_path / "a" / "out" / "o.ply", source=source)
    assert references(tmp_path / "a" / "out" / "o.ply") == ["../kept_outside.png"]
    (tmp_path / "b").mkdir()
    (notice,) = mesh_files.write(mesh_files.read(source), tmp_path / "b" / "o.ply", source=source).notices
    assert notice.endswith("not copied: ../kept_outside.png (outside of the mesh's folder)")
    assert [file.name for file in tmp_path.iterdir() if file.is_file()] == []
    (tmp_path / "a" / "kept_outside.png").write_bytes(JPEG)  # that pymeshlab does not read
    mesh_files.write(mesh_files.read(source), tmp_path / "a" / "out" / "o.ply", source=source)
    assert references(tmp_path / "a" / "out" / "o.ply") == ["../kept_outside.png"]


def test_a_format_without_textures_gets_none(tmp_path):
    source = mesh_files.sample("bunny10k_textured.obj")
    mesh_files.write(mesh_files.read(source), tmp_path / "o.stl", source=source)
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


@pytest.mark.parametrize("indexed", [True, False])
@pytest.mark.parametrize(
    ("mode", "problem"),
    [(1, "lines"), (2, "line loops"), (3, "line strips"), (5, "triangle strips"), (6, "triangle fans"), (7, "mode 7")],
)
def test_primitives_that_pymeshlab_damages_its_memory_with_are_refused(tmp_path, mode, problem, indexed):
    path = gltf(tmp_path / "m.gltf", 1)
    document = json.loads(path.read_text())
    (primitive,) = document["meshes"][0]["primitives"]
    primitive["mode"] = mode
    if not indexed:
        del primitive["indices"]
    path.write_text(json.dumps(document))
    with pytest.raises(mss.FileError, match=rf"m.gltf: cannot be read: it has .*{problem}.*with triangles only"):
        mesh_files.read(path)


@pytest.mark.parametrize(
    ("accessor", "changed", "problem"),
    [
        (1, {"count": 4}, "an accessor has 4 elements, which its buffer view of 12 bytes cannot hold"),
        (0, {"count": 30}, "an accessor has 30 elements"),
        (1, {"count": 2}, "2 corners, which is not a multiple of three"),
        (1, {"count": "3"}, "an accessor without count"),
        (0, {"componentType": 7}, "an accessor without count or type"),
    ],
)
def test_accessors_that_reach_too_far_are_refused(tmp_path, accessor, changed, problem):
    path = gltf(tmp_path / "m.gltf", 1)
    document = json.loads(path.read_text())
    document["accessors"][accessor] |= changed
    path.write_text(json.dumps(document))
    with pytest.raises(mss.FileError, match=f"m.gltf: cannot be read: .*{problem}"):
        mesh_files.read(path)


def test_points_of_a_gltf_file_are_points(tmp_path):
    path = gltf(tmp_path / "m.gltf", 1)
    path.write_text(path.read_text().replace('"indices": 1', '"mode": 0'))
    assert mesh_files.read(path).current_mesh().face_number() == 0


def test_several_meshes_in_a_file_are_refused(tmp_path):
    assert mesh_files.read(gltf(tmp_path / "one.gltf", 1)).mesh_number() == 1
    with pytest.raises(mss.FileError, match="three.gltf: contains 3 meshes; save each in a separate file"):
        mesh_files.read(gltf(tmp_path / "three.gltf", 3))


def test_textures_of_other_formats_are_kept_or_refused_too(tmp_path):
    (tmp_path / "out").mkdir()
    encoded = image(tmp_path / "t.png").read_bytes()
    beside = gltf(tmp_path / "beside.gltf", 1, uri="t.png")
    mesh_files.write(mesh_files.read(beside), tmp_path / "out" / "o.obj", source=beside)
    assert (tmp_path / "out" / "t.png").read_bytes() == encoded
    inside = gltf(
        tmp_path / "inside.gltf", 1, uri=f"data:image/png;base64,{base64.b64encode(encoded).decode()}", name="brick"
    )
    for source, reference in ((inside, "texture_0.png"), (glb(tmp_path / "inside.glb", inside), "x-texture_0.png")):
        ms = mesh_files.read(source, prefix=reference.removesuffix("texture_0.png"))
        for ending in ("obj", "ply"):
            mesh_files.write(ms, tmp_path / "out" / f"i.{ending}", source=source)
            assert references(tmp_path / "out" / f"i.{ending}") == [reference]
            assert (tmp_path / "out" / reference).read_bytes() == encoded
    blind = gltf(tmp_path / "blind.gltf", 1, uri=f"data:image/jpeg;base64,{base64.b64encode(JPEG).decode()}")
    mesh_files.write(mesh_files.read(blind), tmp_path / "out" / "b.obj", source=blind)  # pymeshlab cannot read it
    assert (tmp_path / "out" / "texture_0.jpg").read_bytes() == JPEG
    missing = gltf(tmp_path / "missing.gltf", 1, uri="no%20where.png")
    (notice,) = mesh_files.write(mesh_files.read(missing), tmp_path / "out" / "m.obj", source=missing).notices
    assert notice.endswith("not copied: no_where.png (no such file)")
    assert references(tmp_path / "out" / "m.obj") == ["no_where.png"]


def test_images_inside_of_two_files_of_a_folder_do_not_replace_each_other(tmp_path):
    for name, data in (("a", PNG), ("b", JPEG)):
        gltf(tmp_path / f"{name}.gltf", 1, uri=f"data:image/png;base64,{base64.b64encode(data).decode()}")
        job = work.Job(
            str(tmp_path / f"{name}.gltf"), str(tmp_path / f"{name}.obj"), "apply_coord_spectral_smoothing", {}
        )
        assert work.run(job).status == "done"
    assert (tmp_path / "a-texture_0.png").read_bytes() == PNG
    assert (tmp_path / "b-texture_0.jpg").read_bytes() == JPEG
    (tmp_path / "texture_0.png").write_text("mine")
    with pytest.raises(mss.FileError, match="texture_0.png: exists with other content, and b.ply needs this name"):
        mesh_files.check_textures(mesh_files.read(tmp_path / "a.gltf"), tmp_path / "b.ply", tmp_path / "a.gltf")


def glb(path, source):
    """A glTF file as a GLB, its image in the binary chunk."""
    document = json.loads(source.read_text())
    data = base64.b64decode(document["images"][0].pop("uri").partition(",")[2])
    document["images"] = [{"bufferView": 3, "mimeType": "image/png"}]
    corners = base64.b64decode(document["buffers"][0].pop("uri").partition(",")[2])
    document["bufferViews"].append({"buffer": 0, "byteOffset": len(corners), "byteLength": len(data)})
    binary = corners + data + bytes(-(len(corners) + len(data)) % 4)
    document["buffers"][0]["byteLength"] = len(binary)
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<II", len(text), 0x4E4F534A) + text + struct.pack("<II", len(binary), 0x004E4942) + binary
    path.write_bytes(struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks)
    return path


def test_a_missing_or_unreadable_file_is_one_clear_error(tmp_path):
    with pytest.raises(mss.FileError, match="nowhere.ply: no such file"):
        mesh_files.read(tmp_path / "nowhere.ply")
    strange = tmp_path / "notes.xyzzy"
    strange.write_text("not a mesh")
    with pytest.raises(mss.FileError, match="notes.xyzzy: cannot be read: .*format") as caught:
        mesh_files.read(strange)
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
        mesh_files.write(meshset.new(*torus(5, 4)), target)
    assert target.read_text() == "old"
    assert list(tmp_path.iterdir()) == [target]


def test_an_unknown_format_a_folder_and_a_missing_folder_are_refused(tmp_path):
    ms = meshset.new(*torus(5, 4))
    with pytest.raises(mss.FileError, match="out.xyzzy: cannot be written: .*format"):
        mesh_files.write(ms, tmp_path / "out.xyzzy")
    with pytest.raises(mss.FileError, match="is a folder"):
        mesh_files.write(ms, tmp_path)
    with pytest.raises(mss.FileError, match="there is no folder"):
        mesh_files.write(ms, tmp_path / "none" / "out.ply")
    with pytest.raises(mss.FileError, match="there is no folder"):
        atomic.write_text(tmp_path / "none" / "out.txt", "")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("name", "problem"),
    [
        ("out.xyzzy", "cannot be written: Unknown format"),
        ("out", "cannot be written: Unknown format"),
        ("out.glb", "cannot be written: Unknown format"),  # it is read, not written
        ("out.u3d", "cannot be written: pymeshlab cannot write .u3d files"),
        (".", "is a folder"),
        ("none/out.ply", "there is no folder"),
    ],
)
def test_a_target_is_refused_before_there_is_anything_to_write(tmp_path, name, problem):
    with pytest.raises(mss.FileError, match=problem):
        mesh_files.check_target(tmp_path / name)
    with pytest.raises(mss.FileError, match=problem):
        mesh_files.write(meshset.new(*torus(5, 4)), tmp_path / name)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("ending", ["ply", "PLY", "obj", "stl", "off", "dae", "wrl", "x3d", "3ds", "3mf", "ctm", "xyz"])
def test_a_target_in_a_format_that_pymeshlab_writes_is_accepted(tmp_path, ending):
    assert mesh_files.check_target(tmp_path / f"out.{ending}") == tmp_path.resolve() / f"out.{ending}"
    assert list(tmp_path.iterdir()) == []


def test_a_folder_that_is_not_writable_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(os, "access", lambda path, mode: False)  # root may write everywhere
    with pytest.raises(mss.FileError, match="out.ply: the folder .* is not writable"):
        mesh_files.check_target(tmp_path / "out.ply")


@pytest.mark.skipif(os.name != "posix", reason="files of POSIX")
def test_what_is_no_regular_file_is_no_target(tmp_path):
    os.mkfifo(tmp_path / "pipe.ply")
    (tmp_path / "null.ply").symlink_to(os.devnull)
    for name in ("pipe.ply", "null.ply"):
        with pytest.raises(mss.FileError, match=f"{name}: is not a regular file"):
            mesh_files.check_target(tmp_path / name)
    with pytest.raises(mss.FileError, match="pipe.ply: is not a regular file"):
        mesh_files.read(tmp_path / "pipe.ply")


@pytest.mark.skipif(os.name != "posix", reason="permissions of POSIX")
def test_a_file_that_is_replaced_keeps_its_permissions(tmp_path):
    ms = mesh_files.read(mesh_files.sample("bunny10k_textured.obj"))
    for mode in (0o640, 0o600, 0o664):
        for name in ("o.obj", "o.obj.mtl"):
            (tmp_path / name).touch()
            (tmp_path / name).chmod(mode)
        mesh_files.write(ms, tmp_path / "o.obj")
        for name in ("o.obj", "o.obj.mtl"):
            assert (tmp_path / name).stat().st_mode & 0o777 == mode


@pytest.mark.skipif(sys.platform != "linux", reason="names of POSIX")
def test_a_name_that_is_not_utf8_is_refused_on_one_line(tmp_path):
    name = tmp_path / os.fsdecode(b"bad\xff.ply")
    name.touch()
    for attempt in (mesh_files.read, mesh_files.check_target):
        with pytest.raises(mss.FileError, match="its name is not UTF-8"):
            attempt(name)


def test_nothing_is_moved_before_the_end_is_known(tmp_path):
    target = tmp_path / "o.txt"
    target.write_text("old")
    with atomic.postponed() as written:
        atomic.write_text(target, "new")
        assert target.read_text() == "old"
    (staged,) = written
    staged.move()
    staged.discard()
    assert target.read_text() == "new"

    def fail_after_writing():
        with atomic.postponed():
            atomic.write_text(target, "newer")
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        fail_after_writing()
    assert target.read_text() == "new"
    assert list(tmp_path.iterdir()) == [target]


def test_a_link_is_written_through(tmp_path):
    (tmp_path / "data").mkdir()
    link = tmp_path / "link.obj"
    link.symlink_to("data/real.obj")
    for _ in range(2):  # to a file that is not there yet, and to one that is
        mesh_files.write(meshset.new(*torus(5, 4)), link)
    atomic.write_text(link, "text")
    assert link.is_symlink()
    assert (tmp_path / "data" / "real.obj").read_text() == "text"
    assert {file.name for file in tmp_path.iterdir()} == {"link.obj", "data"}


def test_companions_are_moved_first_and_the_file_itself_last(tmp_path, monkeypatch):
    moved = []
    replace = Path.replace

    def watched(self, target):
        moved.append(target.name)
        return replace(self, target)

    monkeypatch.setattr(Path, "replace", watched)
    with atomic.atomic_write(tmp_path / "m.obj") as part:
        for name in ("m.obj", "a.png", "m.obj.mtl", "z.png"):
            (part.parent / name).write_text(name)
    assert moved == ["a.png", "m.obj.mtl", "z.png", "m.obj"]


def test_nothing_is_moved_where_the_work_failed(tmp_path):
    def fail_after_writing():
        with atomic.atomic_write(tmp_path / "m.obj") as part:
            part.write_text("")
            (part.parent / "t.png").write_text("")
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        fail_after_writing()
    assert list(tmp_path.iterdir()) == []


def test_an_operating_system_error_names_the_file(tmp_path, monkeypatch):
    def full(*_, **__):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(temporary, "create", full)
    with pytest.raises(mss.FileError, match="out.ply: cannot be written: No space left"):
        mesh_files.write(meshset.new(*torus(5, 4)), tmp_path / "out.ply")
    with pytest.raises(mss.FileError, match="out.txt: cannot be written: No space left"):
        atomic.write_text(tmp_path / "out.txt", "text")


def test_text_is_written_whole(tmp_path):
    atomic.write_text(tmp_path / "t.txt", "eins ä\n")
    assert (tmp_path / "t.txt").read_text(encoding="utf-8") == "eins ä\n"
    assert len(list(tmp_path.iterdir())) == 1
    (tmp_path / "plain.txt").touch()
    assert (tmp_path / "t.txt").stat().st_mode == (tmp_path / "plain.txt").stat().st_mode


def test_samples_come_with_pymeshlab():
    assert mesh_files.sample("bunny.obj").is_file()
    with pytest.raises(mss.FileError, match="teapot.obj: not in pymeshlab 20"):
        mesh_files.sample("teapot.obj")

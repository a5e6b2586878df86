"""Reports on coordinates that formats round, and on data that pymeshlab does not read."""

import numpy as np
import pytest
from scipy.spatial import cKDTree

import meshlab_specsmooth as mss
from meshlab_specsmooth.batching import record, work
from meshlab_specsmooth.cli import main
from meshlab_specsmooth.meshlab import losses, mesh_files, meshset, precision
from tests.meshes import rough, sheet

V, F = rough(sheet(), 0.05)
FAR = V * 0.1 + [456789.1, 5234567.8, 412]
EDGE = np.linalg.norm(FAR[F] - FAR[np.roll(F, 1, axis=1)], axis=2).mean()


@pytest.mark.parametrize("ending", ["ply", "obj", "off", "stl", "3ds", "ctm", "dae", "wrl", "x3d", "3mf", "xyz", "e57"])
@pytest.mark.parametrize("vertices", [FAR, V, 1e-4 * V], ids=["far", "near", "small"])
def test_the_rounding_of_each_format_is_what_it_does(tmp_path, ending, vertices):
    path = tmp_path / f"m.{ending}"
    mesh_files.write(meshset.new(vertices, F), path)
    distance = cKDTree(meshset.get_arrays(mesh_files.read(path))[0]).query(vertices, p=np.inf)[0].max()
    edge = np.linalg.norm(vertices[F] - vertices[np.roll(F, 1, axis=1)], axis=2).mean()
    expected = precision.output_rounding(vertices, F, path.suffix)
    assert distance / edge == pytest.approx(expected, rel=0.3, abs=1e-7)


def test_rounded_input_is_distinguished_from_integers_and_doubles():
    single = FAR.astype(np.float32).astype(float)
    assert precision.input_rounding(single, F) > 0.1
    assert precision.input_rounding(FAR, F) == 0
    grid = np.round(V * 4) + [456789, 5234567, 412]
    assert np.array_equal(grid, grid.astype(np.float32))
    assert precision.input_rounding(grid, F) == 0
    assert precision.input_rounding(V.astype(np.float32).astype(float), F) < 1e-5


@pytest.mark.parametrize("scale", [1e-300, 1e-46, 1e40, 1e300])
def test_any_scale_has_a_rounding(scale):
    for ending in (".stl", ".dae", ".xyz", ".3mf"):
        assert precision.output_rounding(V * scale, F, ending) >= 0
    assert precision.output_rounding(V * scale, F, ".stl") > 0.1
    assert precision.input_rounding(V * scale, F) == 0


def test_too_few_digits_are_refused_before_the_work_or_reported(tmp_path, capsys, monkeypatch):
    source, target = tmp_path / "utm.ply", tmp_path / "utm.stl"
    mesh_files.write(meshset.new(FAR, F), source)
    assert main(["denoise", str(source), str(target)]) == 1
    printed = capsys.readouterr().err
    assert "utm.stl: .stl has few digits" in printed
    assert "mean edges; write .ply or .obj" in printed
    assert printed.count("\n") == 1
    assert not target.exists()
    job = work.Job(str(source), str(target), "apply_coord_spectral_smoothing", {"barycenter_weight": 1.0})
    assert "mean edges; write .ply" in work.run(job).reason
    assert not list(tmp_path.glob("utm.stl*"))
    outcome = work.run(work.Job(**{**job.__dict__, "force": True}))
    assert outcome.status == "done"
    assert record.read_record(str(target)).outcome["warning"] == outcome.warning
    assert "utm.stl: .stl has few digits" in outcome.warning
    mesh_files.write(meshset.new(FAR.astype(np.float32), F), source)
    assert main(["smooth", str(source), str(tmp_path / "o.ply")]) == 1
    assert "utm.ply: its coordinates are float32" in capsys.readouterr().err
    assert main(["smooth", str(source), str(tmp_path / "o.ply"), "--force"]) == 0
    assert "utm.ply: its coordinates are float32" in capsys.readouterr().err


def test_coordinates_that_cannot_be_drawn_are_one_line(tmp_path, capsys):
    mesh_files.write(meshset.new(V * 1e200, F), tmp_path / "huge.ply")
    assert main(["compare", str(tmp_path / "huge.ply"), "--out", str(tmp_path / "out")]) == 1
    assert "pictures need at most 1e+18; scale it first" in capsys.readouterr().err


PLY = """ply
format ascii 1.0
element vertex 3
property float x
property float y
property float z
{vertex}element face 1
property list uchar int vertex_indices
{face}element edge {edges}
property int vertex1
end_header
"""


@pytest.mark.parametrize(
    ("vertex", "face", "edges", "lost"),
    [
        (
            ["uchar red", "float quality", "float radius", "float s"],
            ["uchar red", "list uchar float texcoord"],
            0,
            None,
        ),
        (["float nx", "float ny", "float nz"], [], 0, "normals"),
        (["float nx"], [], 0, "vertex properties nx"),
        (
            ["float confidence", "int label"],
            ["int group"],
            0,
            "vertex properties confidence, label, face properties group",
        ),
        (["float red"], ["float nx", "float ny", "float nz"], 0, "vertex properties red, normals of faces"),
        ([], [], 2, "elements edge"),
    ],
)
def test_what_a_ply_file_loses_is_reported(tmp_path, vertex, face, edges, lost):
    names = {"vertex": vertex, "face": face}
    text = PLY.format(
        edges=edges, **{key: "".join(f"property {name}\n" for name in value) for key, value in names.items()}
    )
    (tmp_path / "m.ply").write_text(text)
    notice = losses.find_losses(tmp_path / "m.ply")
    if lost is None:
        assert notice is None
    else:
        assert notice == f"{tmp_path}/m.ply: pymeshlab does not read, and the output lacks: {lost}"


def test_what_an_obj_file_loses_is_reported(tmp_path, capsys):
    corners = "v 0 0 0\nv 1 0 0\nv 0 1 0\n"
    (tmp_path / "plain.obj").write_text(f"mtllib m.mtl\no\ng default\ns off\n{corners}f 1 2 3\n")
    (tmp_path / "m.mtl").write_text("newmtl material_0\nKd 1 1 1\n")
    assert losses.find_losses(tmp_path / "plain.obj") is None
    (tmp_path / "plain.obj").write_text(f"mtllib m.mtl\no box\n{corners}g a\ns 1\nf 1 2 3\ng b c\nf 1 2 3\n")
    (tmp_path / "m.mtl").write_text("newmtl red\nmap_Kd -s 2 2 1 t.png\nmap_Bump n.png\nnewmtl material_1\n")
    assert main(["smooth", str(tmp_path / "plain.obj"), str(tmp_path / "o.ply")]) == 0
    assert (
        capsys.readouterr()
        .err.splitlines()[0]
        .endswith(
            "the output lacks: objects box, groups a, b c, smoothing groups 1, names of materials red, map_Bump, "
            "options of map_Kd -s 2 2 1"
        )
    )


def test_nothing_is_lost_in_other_formats(tmp_path):
    (tmp_path / "m.stl").write_bytes(b"")
    (tmp_path / "m.obj").write_bytes(b"")
    assert losses.find_losses(tmp_path / "m.stl") is None
    assert losses.find_losses(tmp_path / "m.obj") is None


def test_the_error_is_a_file_error():
    with pytest.raises(mss.FileError, match="export it with double precision"):
        precision.check_rounding(FAR.astype(np.float32).astype(float), F, "a.ply", None, force=False)

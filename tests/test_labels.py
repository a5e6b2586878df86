"""Surfaces of several labels: shared vertices, borders, volumes."""

import json
import sys

import numpy as np
import pymeshlab
import pytest
import pyvista as pv

import meshlab_specsmooth as mss
from meshlab_specsmooth.cli import main
from meshlab_specsmooth.meshlab import meshset
from tests.meshes import noisy, torus


def four_bodies(n=28):
    """Voxels of a ball that is cut into four bodies, which meet in a point."""
    g = np.stack(np.meshgrid(*[np.arange(n)] * 3, indexing="ij"), axis=-1) - (n - 1) / 2
    centers = np.array([[1, 0.2, 0.1], [-0.8, 0.9, -0.2], [-0.3, -1, 0.6], [0.1, 0.2, -1.2]]) * n * 0.2
    nearest = np.argmin([np.linalg.norm(g - c, axis=-1) for c in centers], axis=0) + 1
    return np.where(np.linalg.norm(g, axis=-1) < 0.42 * n, nearest, 0)


def voxel_faces(voxels):
    """Triangles between voxels of different labels, and the label behind each and in front of it."""
    corners, pairs = [], []
    for axis, square in enumerate(([1, 2], [2, 0], [0, 1])):
        back, front = np.delete(voxels, -1, axis), np.delete(voxels, 0, axis)
        at = np.argwhere(back != front) + np.eye(3, dtype=int)[axis]
        u, v = np.eye(3, dtype=int)[square]
        corners.append(np.stack([at, at + u, at + u + v, at + v], axis=1))
        pairs.append(np.stack([back[back != front], front[back != front]], axis=1))
    V, quads = np.unique(np.concatenate(corners).reshape(-1, 3), axis=0, return_inverse=True)
    quads, S = quads.reshape(-1, 4), np.concatenate(pairs)
    return V.astype(float), np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]]), np.concatenate([S, S])


def apart(V, F, S):
    """One closed mesh per label, with vertices of its own."""
    meshes = []
    for label in range(1, S.max() + 1):
        own = np.concatenate([F[S[:, 0] == label], F[S[:, 1] == label][:, ::-1]])
        used, faces = np.unique(own, return_inverse=True)
        meshes.append((V[used], faces.reshape(-1, 3)))
    return meshes


@pytest.fixture(scope="module")
def bodies():
    return voxel_faces(four_bodies())


@pytest.fixture(scope="module")
def smooth(bodies):
    V, F, S = bodies
    return mss.smooth_labels(V, F, labels=S)


def test_volumes_are_counted_in_voxels_and_stay_within_per_cents(bodies, smooth):
    voxels = four_bodies()
    assert [each.label for each in smooth.labels] == [1, 2, 3, 4]
    for each in smooth.labels:
        assert each.before == pytest.approx((voxels == each.label).sum())
        assert abs(each.change) < 0.03
    total = sum(each.after for each in smooth.labels)
    whole = mss.smooth_labels(bodies[0], bodies[1], labels=bodies[2] > 0).labels
    assert [each.label for each in whole] == [1]
    outer = mss.Surface(smooth.vertices, bodies[1][(bodies[2] == 0).any(axis=1)])
    X = outer.vertices[outer.faces]
    sign = np.where(bodies[2][(bodies[2] == 0).any(axis=1), 1] == 0, 1, -1)
    assert total == pytest.approx((sign * np.linalg.det(X)).sum() / 6)  # no gap and no overlap


def test_the_surfaces_between_borders_are_smooth_and_the_borders_too(bodies, smooth):
    V, F, S = bodies
    assert smooth.smoothing.noise.kind == "staircase"
    assert smooth.curves >= 10  # of six pairs on the outside, four inside, and where voxels touch at an edge
    outside = (S == 0).any(axis=1)
    used = np.unique(F[outside])
    center = 28 / 2
    before, after = (np.linalg.norm(X[used] - center, axis=1) for X in (V, smooth.vertices))
    assert after.std() < 0.35 * before.std()


def test_a_list_of_meshes_gives_the_same_and_vertices_stay_shared_to_the_bit(bodies, smooth):
    meshes = apart(*bodies)
    result = mss.smooth_labels(meshes)
    assert result.shared == result.still_shared == smooth.shared == smooth.still_shared > 500
    moved = dict(zip(map(tuple, bodies[0].tolist()), smooth.vertices.tolist(), strict=True))
    for (before, faces), (after, same) in zip(meshes, result.meshes, strict=True):
        assert np.array_equal(faces, same)
        np.testing.assert_allclose(after, [moved[tuple(v)] for v in before.tolist()], atol=1e-6)
    volumes = [each.after for each in result.labels]
    np.testing.assert_allclose(volumes, [each.after for each in smooth.labels], rtol=1e-6)


def test_patches_on_one_surface_are_bounded_by_curves_that_are_smoothed_along_themselves():
    V, F = noisy(torus(60, 36), 0.15)
    labels = (V[F].mean(axis=1)[:, 0] > 0).astype(int)
    result = mss.smooth_labels(V, F, labels=labels, barycenter_weight=0.3)
    assert [each.before for each in result.labels] == [None, None]  # open patches have no volume
    assert result.curves == 2
    plain = mss.smooth(V, F, barycenter_weight=0.3)
    assert 0 < np.abs(plain.vertices - result.vertices).max()
    assert "not closed" in str(result)


def test_an_open_boundary_stays():
    V, F = noisy(torus(60, 36), 0.15)
    F = F[V[F].mean(axis=1)[:, 2] > -0.5]
    labels = (V[F].mean(axis=1)[:, 0] > 0).astype(int)
    result = mss.smooth_labels(V, F, labels=labels, barycenter_weight=0.3)
    ends = np.sort(np.concatenate([F[:, [0, 1]], F[:, [1, 2]], F[:, [2, 0]]]), axis=1)
    edges, count = np.unique(ends, axis=0, return_counts=True)
    rim = np.unique(edges[count == 1])
    assert np.array_equal(result.vertices[rim], V[rim])


def test_no_vertex_moves_further_than_the_limit(bodies):
    V, F, S = bodies
    result = mss.smooth_labels(V, F, labels=S, max_displacement=0.3)
    assert np.linalg.norm(result.vertices - V, axis=1).max() <= 0.3
    assert result.limited > 0
    assert result.still_shared == result.shared


def named(kind, bodies, path):
    V, F, S = bodies
    if kind == "pyvista":
        mesh = pv.PolyData.from_regular_faces(V, F)
        mesh.cell_data["tissue"] = S
        return mesh
    if kind == "ply":
        rows = "\n".join(f"3 {a} {b} {c} {k}" for (a, b, c), k in zip(F.tolist(), S[:, 0].tolist(), strict=True))
        points = "\n".join(" ".join(map(str, v)) for v in V.tolist())
        head = f"ply\nformat ascii 1.0\nelement vertex {len(V)}\nproperty float x\nproperty float y\nproperty float z\n"
        head += f"element face {len(F)}\nproperty list uchar int vertex_indices\nproperty int tissue\nend_header\n"
        path.write_text(f"{head}{points}\n{rows}\n")
        return str(path)
    ms = meshset.new(V, F)
    ms.current_mesh().add_face_custom_scalar_attribute(S[:, 0].astype(float), "tissue")
    return ms


@pytest.mark.parametrize("kind", ["pyvista", "ply", "meshset"])
def test_labels_may_be_a_property_of_the_mesh(kind, bodies, tmp_path):
    mesh = named(kind, bodies, tmp_path / "tissues.ply")
    result = mss.smooth_labels(mesh, labels="tissue", barycenter_weight=0.5)
    S = bodies[2] if kind == "pyvista" else bodies[2][:, 0]
    expected = mss.smooth_labels(*bodies[:2], labels=S, barycenter_weight=0.5)
    np.testing.assert_allclose(result.vertices, expected.vertices, atol=1e-6)
    assert type(result.mesh) is (pymeshlab.MeshSet if kind == "ply" else type(mesh))
    with pytest.raises((mss.InvalidParameter, pymeshlab.PyMeshLabException)):
        mss.smooth_labels(mesh, labels="tisue")


@pytest.mark.parametrize(
    ("labels", "words"),
    [
        (None, "labels is None"),
        (np.zeros(7, dtype=int), "shape .7,."),
        (np.zeros((2, 3), dtype=int), "shape"),
        ([[1], [2, 3]], "not an array"),
        ("x", "no named face data"),
    ],
)
def test_labels_are_checked(labels, words):
    with pytest.raises(mss.InvalidParameter, match=words):
        mss.smooth_labels(*torus(), labels=labels)
    with pytest.raises(mss.InvalidParameter, match="empty list"):
        mss.smooth_labels([])
    with pytest.raises(mss.InvalidParameter, match="dtype"):
        mss.smooth_labels(*torus(), labels=np.full(len(torus()[1]), 0.5))


def test_without_the_extra_a_file_s_property_names_it(monkeypatch, bodies, tmp_path):
    path = named("ply", bodies, tmp_path / "tissues.ply")
    monkeypatch.setitem(sys.modules, "plyfile", None)
    with pytest.raises(mss.MissingExtra, match="labels"):
        mss.smooth_labels(path, labels="tissue")


def test_the_command_writes_all_meshes_and_the_volumes(bodies, tmp_path, capsys):
    files = []
    for number, (V, F) in enumerate(apart(*bodies)):
        files.append(str(tmp_path / f"body{number}.ply"))
        meshset.new(V, F).save_current_mesh(files[-1])
    assert main(["labels", *files, "--out", str(tmp_path / "out")]) == 0
    assert "4 labels" in capsys.readouterr().out
    found = json.loads((tmp_path / "out/labels.json").read_text())
    assert found["shared"] == found["still_shared"] > 500
    places = []
    for number in range(4):
        ms = pymeshlab.MeshSet()
        ms.load_new_mesh(str(tmp_path / f"out/body{number}.ply"))
        places += map(tuple, ms.current_mesh().vertex_matrix().tolist())
    assert len(places) - len(set(places)) > 500  # shared in the files as well
    path = named("ply", bodies, tmp_path / "tissues.ply")
    assert (
        main(["labels", path, "--property", "tissue", "--out", str(tmp_path / "two"), "--barycenter-weight", "1"]) == 0
    )
    assert (tmp_path / "two/tissues.ply").exists()
    for wrong in (["labels", files[0]], ["labels", *files[:2], "--property", "x"], ["labels", files[0], files[0]]):
        assert main([*wrong, "--out", str(tmp_path / "none")]) == 2
    assert main(["labels", *files, "--out", str(tmp_path)]) == 2

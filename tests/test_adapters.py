"""Meshes of every kind go in, and the same kind comes out."""

import collections
import copy
import gc
import pickle

import numpy as np
import pymeshlab
import pytest

import meshlab_specsmooth as mss
from meshlab_specsmooth.adapters import recognize
from meshlab_specsmooth.meshlab.filters import FILTERS
from meshlab_specsmooth.reports import compared
from tests import state
from tests.meshes import rough, torus

V, F = rough(torus(9, 8))
EXPECTED = mss.smooth(V, F, modes=12).vertices
NOISE = mss.estimate_noise(V, F).level
FUNCTIONS = (mss.smooth, mss.low_pass, mss.enhance, mss.smooth_edge_aware, mss.denoise)
QUADS = np.array([[i * 8 + j, (i + 1) % 9 * 8 + j, (i + 1) % 9 * 8 + (j + 1) % 8, i * 8 + (j + 1) % 8]
                  for i in range(9) for j in range(8)])  # fmt: skip


def pickled(result):
    return pickle.loads(pickle.dumps(result))  # noqa: S301 (it is ours)


def padded(rows):
    return np.concatenate([[len(row), *row] for row in rows])


def of_pyvista():
    pv = pytest.importorskip("pyvista")
    mesh = pv.PolyData(V, padded(F)).compute_normals(
        cell_normals=True, split_vertices=False, consistent_normals=False, auto_orient_normals=False
    )
    mesh.point_data["heat"] = np.arange(len(V))
    mesh.cell_data["part"] = np.arange(len(F))
    mesh.field_data["note"] = ["kept"]
    return mesh


def of_trimesh():
    trimesh = pytest.importorskip("trimesh")
    colors = np.random.default_rng(0).integers(0, 255, (len(V), 4), dtype=np.uint8)
    mesh = trimesh.Trimesh(V, F, vertex_colors=colors, vertex_normals=np.tile([0.0, 0, 1], (len(V), 1)), process=False)
    mesh.metadata["note"] = "kept"
    mesh.vertex_attributes["heat"] = np.arange(len(V))
    return mesh


def of_meshio():
    meshio = pytest.importorskip("meshio")
    cells = [("vertex", [[0]]), ("triangle", F)]
    normals = np.tile([0.0, 0, 1], (len(F), 1))
    nx, ny, nz = np.tile([0.0, 0, 1], (len(V), 1)).T
    return meshio.Mesh(
        V,
        cells,
        point_data={"heat": np.arange(len(V)), "nx": nx, "ny": ny, "nz": nz},
        cell_data={"part": [np.zeros(1), np.arange(len(F))], "Normals": [np.zeros((1, 3)), normals]},
    )


class Vector(np.ndarray):
    """As Open3D's vectors: made of an array."""

    def __new__(cls, rows):
        return np.array(rows, dtype=float).view(cls)


class LegacyOpen3D:
    def __init__(self):
        self.vertices, self.triangles, self.colors = Vector(V), F.copy(), np.arange(len(V))
        self.computed = []

    def has_vertex_normals(self):
        return True

    def has_triangle_normals(self):
        return False

    def compute_vertex_normals(self):
        self.computed.append("vertex")

    def compute_triangle_normals(self):
        self.computed.append("triangle")


class Tensor:
    def __init__(self, array):
        self.array, self.device = array, "here"

    @classmethod
    def from_numpy(cls, array):
        return cls(array)

    def to(self, device):
        assert device == "here"
        return self

    def cpu(self):
        return self

    def numpy(self):
        return self.array


class TensorOpen3D:
    def __init__(self):
        self.vertex = {"positions": Tensor(V), "normals": Tensor(V), "colors": Tensor(np.arange(len(V)))}
        self.triangle = {"indices": Tensor(F)}
        self.computed = []

    def clone(self):
        return copy.deepcopy(self)

    def compute_vertex_normals(self):
        self.computed.append("vertex")


class OldVedo:
    """As vedo was before ``points`` became an attribute."""

    def __init__(self):
        self.vertices, self.cells = V.copy(), F.tolist()
        self.pointdata = {"heat": np.arange(len(V)), "Normals": np.tile([0.0, 0, 1], (len(V), 1))}
        self.celldata, self.dataset = {}, None

    def points(self):
        raise AssertionError("not asked")

    def clone(self):
        return copy.deepcopy(self)


def of_vedo():
    vedo = pytest.importorskip("vedo")
    mesh = vedo.Mesh([V, F])
    mesh.pointdata["heat"] = np.arange(len(V))
    return mesh


def of_meshset():
    ms = pymeshlab.MeshSet()
    ms.create_cube()
    colors = np.random.default_rng(0).random((len(V), 4))
    ms.add_mesh(pymeshlab.Mesh(V, F, v_color_matrix=colors), "torus")
    ms.create_cube()
    ms.set_current_mesh(1)
    return ms


# each: a mesh, its positions, and what else it had, which stays
KINDS = {
    "trimesh": (of_trimesh, lambda m: m.vertices, lambda m: [m.faces, m.visual.vertex_colors, m.metadata["note"]]),
    "pyvista": (
        of_pyvista,
        lambda m: m.points,
        lambda m: [m.faces, m.point_data["heat"], m.cell_data["part"], m.field_data["note"]],
    ),
    "meshio": (
        of_meshio,
        lambda m: m.points,
        lambda m: [m.cells[1].data, m.point_data["heat"], m.cell_data["part"][1], m.cell_data["Normals"][0]],
    ),
    "vedo": (of_vedo, lambda m: m.points, lambda m: [np.array(m.cells), m.pointdata["heat"]]),
    "vedo, old": (OldVedo, lambda m: m.vertices, lambda m: [m.cells, m.pointdata["heat"]]),
    "open3d": (LegacyOpen3D, lambda m: m.vertices, lambda m: [m.triangles, m.colors]),
    "open3d, tensor": (
        TensorOpen3D,
        lambda m: m.vertex["positions"].array,
        lambda m: [m.triangle["indices"].array, m.vertex["colors"].array],
    ),
    "MeshSet": (
        of_meshset,
        lambda m: m.current_mesh().vertex_matrix(),
        lambda m: [m.current_mesh().face_matrix(), m.current_mesh().vertex_color_matrix(), m.current_mesh().label()],
    ),
    "Surface": (lambda: mss.Surface(V, F), lambda m: m.vertices, lambda m: [m.faces]),
    "tuple": (lambda: (V.copy(), F), lambda m: m[0], lambda m: [m[1]]),
}


@pytest.mark.parametrize("kind", KINDS)
def test_a_mesh_of_the_same_kind_comes_out(kind):
    make, positions, others = KINDS[kind]
    mesh = make()
    coarse = 1e-6 if kind == "vedo" else 0  # it has single precision
    result = mss.smooth(mesh, modes=12)
    assert np.abs(result.vertices - EXPECTED).max() <= coarse
    out = result.mesh
    assert type(out) is type(mesh)
    assert out is not mesh
    assert np.abs(positions(out) - result.vertices).max() <= coarse
    for given, kept in zip(others(make()), others(out), strict=True):
        assert np.array_equal(given, kept)
    # the one that was given is as it was, and what is done to it later does not reach the result
    assert np.array_equal(positions(mesh), positions(make()))
    again = pickled(result).mesh if kind not in ("MeshSet", "vedo") else out
    assert type(again) is type(mesh)
    for function in FUNCTIONS[1:] if kind == "trimesh" else ():
        assert type(function(mesh).mesh) is type(mesh)
    assert type(mss.smooth(mss.assemble(mesh), modes=12).mesh) is type(mesh)
    assert mss.estimate_noise(mesh).level == pytest.approx(NOISE, rel=1e-4)
    assert mss.estimate_error(lambda X: X, mesh, probes=1).error >= 0
    assert mss.spectrum(mesh).method == "exact"
    assert mss.self_intersecting_faces(mesh).shape == (len(F),)


def test_normals_are_recomputed():
    for mesh, read in (
        (of_pyvista(), lambda m: (m.point_data["Normals"], m.cell_data["Normals"])),
        (of_trimesh(), lambda m: (m.vertex_normals, m.face_normals)),
        (of_meshio(), lambda m: (np.c_[m.point_data["nx"], m.point_data["ny"], m.point_data["nz"]],
                                 m.cell_data["Normals"][1])),
    ):  # fmt: skip
        result = mss.smooth(mesh, modes=12)
        vectors = np.cross(*(result.vertices[F[:, i]] - result.vertices[F[:, 0]] for i in (1, 2)))
        of_faces = vectors / np.linalg.norm(vectors, axis=1)[:, None]
        of_vertices, found = read(result.mesh)
        side = np.sign((found * of_faces).sum())  # those of this meshio mesh pointed anywhere
        assert np.abs(found - side * of_faces).max() < 1e-5
        around = [of_vertices[i] @ of_faces[(i == F).any(axis=1)].sum(axis=0) for i in range(len(V))]
        assert (np.sign(around) == np.sign(around[0])).all()
        assert np.abs(np.linalg.norm(of_vertices, axis=1) - 1).max() < 1e-5
    for fake in (LegacyOpen3D(), TensorOpen3D()):
        assert mss.smooth(fake, modes=12).mesh.computed == ["vertex"]
    old = mss.smooth(OldVedo(), modes=12).mesh
    assert not (old.pointdata["Normals"] == [0, 0, 1]).all()


def test_a_mesh_of_pymeshlab_keeps_its_other_data(laden):
    before = state.of_mesh(laden.current_mesh())
    result = mss.smooth(laden, modes=9)
    laden.meshing_decimation_quadric_edge_collapse(targetfacenum=9)
    follows = {"id", *state.FOLLOWS}
    after = state.of_mesh(result.mesh.current_mesh())
    assert {name.split(":")[0].strip("/") for name in state.differences(before, after)} <= follows
    # pymeshlab's own mesh is gone with its MeshSet; this one is not
    mesh = mss.smooth(pymeshlab.Mesh(V, F), modes=12).mesh
    gc.collect()
    assert type(mesh) is pymeshlab.Mesh
    assert np.array_equal(mesh.vertex_matrix(), EXPECTED)
    assert type(mss.smooth(of_meshset_of(mss.MeshSet), modes=12).mesh) is mss.MeshSet
    vertices, faces = pickled(result).mesh
    assert np.array_equal(vertices, result.vertices)
    assert faces.shape == before["faces"].shape


def of_meshset_of(kind):
    ms = kind()
    ms.add_mesh(pymeshlab.Mesh(V, F))
    return ms


@pytest.mark.parametrize("as_path", [str, lambda path: path])
def test_a_path_is_read(tmp_path, as_path):
    path = tmp_path / "torus.ply"
    of_meshset().save_current_mesh(str(path), binary=False)
    result = mss.smooth(as_path(path), modes=12)
    mesh = result.mesh.current_mesh()
    assert np.array_equal(mesh.vertex_matrix(), result.vertices)
    assert mesh.has_vertex_color()
    assert pickled(result).mesh[1].shape == F.shape
    with pytest.raises(mss.FileError, match="no such file"):
        mss.denoise("nothing.ply")


def test_tuples_of_marching_cubes_and_of_igl():
    normals = mss.Surface(V, F)
    away = -np.asarray(recognize(of_trimesh()).vertices) / np.linalg.norm(V, axis=1)[:, None]
    values = np.arange(len(V), dtype=np.float32)
    vertices, faces, turned, same = mss.smooth((V, F.astype(np.int32), away.astype(np.float32), values), modes=12).mesh
    assert np.array_equal(vertices, EXPECTED)
    assert faces.dtype == np.int32
    assert same is values
    assert turned.dtype == np.float32
    assert (turned * away).sum() > 0  # on the side that they were
    assert np.abs(np.linalg.norm(turned, axis=1) - 1).max() < 1e-5
    # igl.readOBJ: V, TC, N, F, FTC, FN
    empty = np.empty((0, 3))
    texture = np.random.default_rng(0).random((len(V), 2))
    out = mss.smooth((V, texture, empty, F, F, empty.astype(int)), modes=12).mesh
    assert np.array_equal(out[0], EXPECTED)
    assert out[1] is texture
    # igl.read_mesh: V, tetrahedra, faces
    assert np.array_equal(mss.smooth((V, F[:, [0, 1, 2, 2]], F), modes=12).vertices, EXPECTED)
    named = collections.namedtuple("Named", "vertices faces")(V, F)
    assert type(mss.smooth(named, modes=12).mesh) is type(named)
    assert type(mss.smooth([V, F], modes=12).mesh) is list
    assert normals.faces.shape == F.shape


@pytest.mark.parametrize(
    "faces", [padded(F), F.tolist(), np.c_[np.full(len(F), 3), F], F.astype(np.uint64), padded(F).tolist()]
)
def test_triangles_in_other_layouts(faces):
    result = mss.smooth(V, faces, modes=12)
    assert np.array_equal(result.vertices, EXPECTED)
    assert result.mesh[1] is faces


def test_quads_and_polygons_are_split_and_kept():
    split = recognize(V, QUADS)
    length = [np.linalg.norm(V[QUADS[:, i]] - V[QUADS[:, i + 2]], axis=1) for i in (0, 1)]
    ends = np.sort(np.stack([split.faces[::2, 0], split.faces[::2, 2]], axis=1), axis=1)  # what both triangles share
    shorter = np.where((length[1] < length[0])[:, None], QUADS[:, [1, 3]], QUADS[:, [0, 2]])
    assert np.array_equal(ends, np.sort(shorter, axis=1))
    expected = mss.smooth(V, split.faces, modes=12).vertices
    mixed = [*QUADS[:-1].tolist(), [*QUADS[-1, :3].tolist()], [int(QUADS[-1, i]) for i in (0, 2, 3)]]
    for faces in (QUADS, QUADS.tolist(), padded(QUADS)):
        result = mss.smooth(V, faces, modes=12)
        assert np.array_equal(result.vertices, expected)
        assert result.mesh[1] is faces
    assert mss.smooth(V, mixed, modes=12).modes == 12
    assert mss.smooth(V, padded(mixed), modes=12).modes == 12
    assert mss.self_intersecting_faces(V, QUADS).shape == (len(QUADS),)
    pv, meshio = pytest.importorskip("pyvista"), pytest.importorskip("meshio")
    mesh = pv.PolyData(V, padded(mixed))
    assert np.array_equal(mss.smooth(mesh, modes=12).mesh.faces, padded(mixed))
    block = meshio.Mesh(V, [("quad", QUADS[:-1]), ("triangle", mixed[-2:])])
    assert np.array_equal(mss.smooth(block, modes=12).vertices, mss.smooth(V, mixed, modes=12).vertices)
    pentagon = [[0, 0, 0], [2, 0, 0], [2, 1, 0], [1, 2, 0], [0, 1, 0]]
    assert recognize(pentagon, [[0, 1, 2, 3, 4]]).faces.tolist() == [[0, 1, 2], [0, 2, 3], [0, 3, 4]]


def test_strips_of_pyvista():
    pv = pytest.importorskip("pyvista")
    strips = pv.PolyData(V, padded(F)).strip()
    assert strips.n_strips > 0
    result = mss.smooth(strips, modes=12)
    assert np.array_equal(result.vertices, EXPECTED)
    assert result.mesh.n_strips == strips.n_strips
    sides = {tuple(sorted(face)): mss.Surface(V, [face]) for face in recognize(strips).faces.tolist()}
    assert set(sides) == {tuple(sorted(face)) for face in F.tolist()}
    turned = [np.roll(face, -face.argmin()).tolist() for face in np.array(recognize(strips).faces)]
    assert sorted(turned) == sorted(np.roll(face, -face.argmin()).tolist() for face in F)


class Cloud:
    vertices = V


class Cells:
    points, cells = V, F


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ((5,), "mesh is 5; pass vertices and faces, a tuple"),
        ((None,), "mesh is None; pass"),
        (({"vertices": V},), "mesh is of type dict"),
        ((V,), "faces are missing"),
        ((V.tolist(),), "faces are missing"),
        ((Cloud(),), "has no faces .reconstruct"),
        ((Cells(),), "extract its surface first"),
        ((pymeshlab.MeshSet(),), "a MeshSet without a mesh"),
        ((V, [[0, 1, 2], [0, 1]]), r"faces\[1\] has 2 corners"),
        ((V, [[0, 1, 2, 3], [0, 1, 2, 99]]), r"faces\[1\] refers to vertex 99"),
        ((V, [[0, 1, 2, 3], [0, 1, 2]]), None),
        ((V, [3, 0, 1]), r"faces has shape \(3,\)"),
        ((V[:, :2], QUADS), "vertices has shape"),
    ],
)
def test_other_objects_are_refused_and_the_accepted_ones_named(given, words):
    if words is None:
        assert len(mss.smooth(*given, modes=2).vertices) == len(V)
        return
    for function in (mss.smooth, mss.denoise, mss.estimate_noise, mss.self_intersecting_faces):
        with pytest.raises(mss.InvalidSurface, match=words):
            function(*given)


def test_faces_besides_a_mesh_are_refused():
    with pytest.raises(mss.InvalidParameter, match="faces are given besides a mesh"):
        mss.smooth((V, F), F)


def test_vertices_can_be_passed_by_that_name():
    assert np.array_equal(mss.smooth(vertices=V, faces=F, modes=12).vertices, EXPECTED)
    assert mss.estimate_error(lambda X: X, vertices=V, faces=F, probes=1).probes == 1


def test_a_misspelled_keyword_is_corrected_in_the_message():
    with pytest.raises(TypeError, match=r"no parameter barycenter_wieght\. Did you mean barycenter_weight\?"):
        mss.smooth(V, F, barycenter_wieght=0.1)
    with pytest.raises(TypeError, match=r"denoise\(\) has no parameter color\.$"):
        mss.denoise(V, F, color="red")
    with pytest.raises(TypeError, match="vertices"):
        mss.smooth(mesh=V, vertices=V, faces=F)


def test_compare_takes_any_mesh(monkeypatch):
    surfaces = []
    monkeypatch.setattr(compared, "experiment", lambda given, truth, **_: surfaces.extend([given, truth]))
    monkeypatch.setattr(compared, "with_colors", lambda found, mesh: found)
    for given in ((V, F), ((V, F),), (of_trimesh(),), (of_meshset(),)):
        mss.compare(*given, ground_truth=of_trimesh())
    assert all(np.array_equal(surface.vertices, V) for surface in surfaces)
    with pytest.raises(mss.InvalidParameter, match="ground_truth is 5"):
        mss.compare((V, F), ground_truth=5)


@pytest.mark.parametrize("name", sorted(FILTERS))
def test_a_filter_names_the_function_for_other_meshes(name):
    with pytest.raises(mss.InvalidParameter, match="must be a pymeshlab.MeshSet.*for other meshes: ") as caught:
        getattr(mss, name)((V, F))
    function = str(caught.value).split("meshlab_specsmooth.")[1].split("(")[0]
    getattr(mss, function)(V, F)

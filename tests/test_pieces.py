"""Meshes in pieces: the result of the whole, files byte by byte, errors, and going on after a loss."""

from pathlib import Path

import numpy as np
import pytest

import meshlab_specsmooth as mss
from meshlab_specsmooth.cli import main
from meshlab_specsmooth.edge_aware.part import smooth_part
from meshlab_specsmooth.geometry.surface import signed_volume, vertex_normals
from meshlab_specsmooth.pieces import cut, ply, whole
from meshlab_specsmooth.pieces import weld as weld_module
from meshlab_specsmooth.pieces.bands import find_shares
from meshlab_specsmooth.pieces.margin import find_margin
from meshlab_specsmooth.pieces.partition import find_owners, route, split_space
from meshlab_specsmooth.pieces.piece import count_rings, run_piece
from meshlab_specsmooth.pieces.plan import pack_tree, unpack_tree
from meshlab_specsmooth.pieces.weld import STL_FACET
from meshlab_specsmooth.spectral.response import response
from tests.meshes import box, noisy, sheet, torus

CLOSED = noisy(torus(200, 128), 0.2)
OPEN = (CLOSED[0], CLOSED[1][CLOSED[0][CLOSED[1]].mean(axis=1)[:, 2] > -0.6])


def write(path, V, F, normals=False, wide=False):
    """A binary PLY file with properties that smoothing does not know."""
    real = "f8" if wide else "f4"
    vertex = [(name, f"<{real}") for name in "xyz"] + [("id", "<i4")] + [(f"n{a}", "<f4") for a in "xyz" if normals]
    face = [("count", "u1"), ("corners", "<i4", 3), ("label", "<u2")]
    v, f = np.zeros(len(V), vertex), np.zeros(len(F), face)
    v["x"], v["y"], v["z"] = V.T
    v["id"], f["count"], f["corners"], f["label"] = np.arange(len(V)), 3, F, np.arange(len(F)) % 7
    word = "double" if wide else "float"
    lines = [f"property {word} {a}" for a in "xyz"] + ["property int id"]
    lines += [f"property float n{a}" for a in "xyz" if normals]
    head = ["ply", "format binary_little_endian 1.0", f"element vertex {len(V)}", *lines]
    head += [f"element face {len(F)}", "property list uchar int vertex_indices", "property ushort label"]
    head += ["element camera 1", "property float focal", "end_header", ""]
    path.write_bytes("\n".join(head).encode() + v.tobytes() + f.tobytes() + np.float32(35).tobytes())
    return str(path)


def read(path):
    return ply.stack(ply.open_ply(path).positions())


@pytest.fixture
def small_pieces(monkeypatch):
    """Pieces of some thousand vertices, smoothed in this process."""
    done = []

    def outcomes(jobs, *_):
        for job, _size in jobs:
            done.append(job.number)
            yield run_piece(job)

    monkeypatch.setattr(whole.local, "outcomes", outcomes)
    monkeypatch.setattr(whole, "_MIN_PIECE", 4000)
    monkeypatch.setattr(whole, "_MAX_PIECE", 12_000)
    return done


@pytest.mark.parametrize("boundary", ["auto", "fixed", "curve", "free"])
@pytest.mark.parametrize("weight", [1.0, 0.2, 0.05])
def test_pieces_give_the_result_of_the_whole(tmp_path, small_pieces, weight, boundary):
    V, F = OPEN
    source = write(tmp_path / "scan.ply", V, F, wide=True)
    result = mss.smooth_pieces(source, tmp_path / "out.ply", barycenter_weight=weight, boundary=boundary)
    assert result.pieces >= 3
    given = {"response": response("heat", result.setting["cutoff"]), "barycenter_weight": weight, "boundary": boundary}
    expected = mss.smooth(V, F, **given, tolerance=1e-7).vertices
    error = np.linalg.norm(read(tmp_path / "out.ply") - expected, axis=1).max()
    rms = np.sqrt(np.square(expected - V).sum(axis=1).mean())
    assert error < 1e-3 * rms
    assert result.displacement == pytest.approx(rms, rel=1e-3)
    assert result.volume_change is None


@pytest.mark.parametrize(
    ("setting", "boundary"),
    [
        (mss.EdgeAware(strength=2, range_sigma=0.35, iterations=4, start="given", barycenter_weight=0.3), "auto"),
        (mss.EdgeAware(strength=8, range_sigma=1.0, iterations=6, start="given", barycenter_weight=0.3), "fixed"),
        (
            mss.EdgeAware(strength=0.4, range_sigma=0.28, iterations=8, start="smoothed", barycenter_weight=0.15),
            "curve",
        ),
        (mss.EdgeAware(iterations=0, start="smoothed", barycenter_weight=0.12), "free"),
    ],
)
def test_pieces_keep_edges_as_the_whole_does(tmp_path, small_pieces, setting, boundary):
    V, F = OPEN
    source = write(tmp_path / "scan.ply", V, F, wide=True)
    result = mss.denoise_pieces(source, tmp_path / "out.ply", boundary=boundary, **vars(setting))
    assert result.pieces >= 3
    assert (result.filter, result.setting["bands"][0]["edge_aware"]) == ("edge_aware", vars(setting))
    known = mss.smooth_edge_aware(V, F, setting, boundary=boundary)
    expected = smooth_part(V, F.astype(np.int32), setting, result.mean_edge, known.noise, boundary=boundary)
    moved = read(tmp_path / "out.ply")
    rms = np.sqrt(np.square(expected - V).sum(axis=1).mean())
    assert np.linalg.norm(moved - expected, axis=1).max() < 1e-3 * rms
    if (setting.strength or 0) < 8:  # in memory, six iterations are made for the normals
        assert np.sqrt(np.square(moved - known.vertices).sum(axis=1).mean()) < 0.03 * rms


def test_denoising_in_pieces_chooses_as_the_whole_does_and_keeps_its_volume(tmp_path, small_pieces):
    V, F = noisy(box(24), 0.2)
    source = write(tmp_path / "block.ply", V, F, wide=True)
    alone = mss.denoise(V, F)
    assert alone.iterations > 0  # it has edges
    result = mss.denoise_pieces(source, tmp_path / "out.ply", local=True)
    assert (result.pieces, result.filter) == (1, "edge_aware")
    moved = read(tmp_path / "out.ply")
    change = signed_volume(mss.Surface(moved, F)) / signed_volume(mss.Surface(V, F)) - 1
    assert result.volume_change == pytest.approx(change, abs=1e-5)
    assert abs(change) < 1e-4
    rms = np.sqrt(np.square(alone.vertices - V).sum(axis=1).mean())
    assert np.sqrt(np.square(moved - alone.vertices).sum(axis=1).mean()) < 0.3 * rms


def test_noise_is_treated_by_region_where_that_is_asked_for(tmp_path, small_pieces, monkeypatch):
    monkeypatch.setattr(cut, "_SAMPLE_VERTICES", 1500)
    V, F = sheet(160, 120)
    left = V[:, 0] < 80
    V[:, 2] = np.where(left, 0.5 * np.sin(V[:, 0] / 2), 0.0)
    level = np.where(left, 0.05, 0.5)
    rough = V + level[:, None] * np.random.default_rng(0).standard_normal(V.shape)
    source = write(tmp_path / "scan.ply", rough, F, wide=True)
    errors = []
    for local in (False, True):
        result = mss.smooth_pieces(source, tmp_path / "out.ply", local=local, difference=0.01)
        moved = read(tmp_path / "out.ply")
        errors.append([np.sqrt(np.square((moved - V)[side]).mean()) for side in (V[:, 0] < 65, V[:, 0] > 95)])
        assert local or "the noise varies, but one setting is for all" in result.warning
    assert len(result.setting["bands"]) > 1
    assert (np.array(errors[1]) < np.array(errors[0]) * [0.7, 0.5]).all()
    assert result.summary.count("barycenter weight") == len(result.setting["bands"])


def test_shares_of_bands_are_continuous_and_add_up():
    X = np.random.default_rng(0).random((2000, 3)) * 10
    levels = [[*center, 0.1 if center[0] < 5 else 0.8] for center in (X[:40]).tolist()]
    shares = find_shares(X, levels, [0.1, 0.8])
    assert np.allclose(shares.sum(axis=1), 1)
    assert ((shares >= 0) & (shares <= 1)).all()
    near = find_shares(X + 1e-7, levels, [0.1, 0.8])
    assert np.abs(near - shares).max() < 1e-4
    assert shares[X[:, 0] < 2, 0].mean() > 0.9
    assert find_shares(X[:3], None, [0.3]).tolist() == [[1.0]] * 3


def test_strays_are_put_back_and_a_shape_that_would_change_is_not_handed_out(tmp_path, small_pieces, monkeypatch):
    V, F = noisy(torus(100, 64), 0.1)
    V[::800] += 0.5
    source = write(tmp_path / "scan.ply", V, F, wide=True)
    for filter_in_pieces, in_memory in ((mss.smooth_pieces, mss.smooth), (mss.denoise_pieces, mss.denoise)):
        filter_in_pieces(source, tmp_path / "out.ply", difference=0.01)
        alone = in_memory(V, F)
        assert len(alone.outliers) > 5
        moved = read(tmp_path / "out.ply")
        assert np.linalg.norm(moved - alone.vertices, axis=1).max() < 0.1
    before = (tmp_path / "out.ply").read_bytes()
    with monkeypatch.context() as patch:
        judge = whole.judge_change
        patch.setattr(whole, "judge_change", lambda *given: whole.replace(judge(*given), excessive=np.array([True])))
        with pytest.raises(mss.FilterFailed, match="would change the shape by more than noise explains"):
            mss.smooth_pieces(source, tmp_path / "out.ply", difference=0.01, resume=False)
    assert (tmp_path / "out.ply").read_bytes() == before
    source = write(tmp_path / "small.ply", *torus(), wide=True)
    strong = mss.smooth_pieces(source, tmp_path / "out.ply", barycenter_weight=0.003, resume=False)
    assert "this setting changes the shape" in strong.warning


def test_one_setting_is_chosen_for_all_and_the_volume_is_that_of_the_whole(tmp_path, small_pieces):
    V, F = CLOSED
    source = write(tmp_path / "scan.ply", V, F, wide=True)
    stages, fractions = [], []

    class Bar:
        stage = staticmethod(stages.append)

        def __call__(self, fraction):
            fractions.append(fraction)

    result = mss.smooth_pieces(source, tmp_path / "out.ply", difference=0.01, progress=Bar())
    assert [f"{done} of {result.pieces} pieces" for done in range(result.pieces + 1)] == stages[1 : result.pieces + 2]
    assert fractions == sorted(fractions)
    assert fractions[-1] == 1
    alone = mss.smooth(V, F)
    assert result.noise.level == pytest.approx(alone.noise.level, rel=0.05)
    assert result.setting["bands"][0]["barycenter_weight"] == pytest.approx(alone.barycenter_weight, rel=0.5)
    after = mss.Surface(read(tmp_path / "out.ply"), F)
    change = signed_volume(after) / signed_volume(mss.Surface(V, F)) - 1
    assert result.volume_change == pytest.approx(change, abs=1e-5)
    assert "pieces" in result.summary
    assert "<table" in result._repr_html_()


def test_modes_are_those_of_the_whole(tmp_path, small_pieces):
    V, F = CLOSED
    source = write(tmp_path / "scan.ply", V, F)
    result = mss.smooth_pieces(source, tmp_path / "out.ply", modes=500, barycenter_weight=1.0, response="heat")
    expected = mss.smooth(V, F, modes=500, barycenter_weight=1.0, response="heat")
    assert result.setting["cutoff"] == pytest.approx(expected.cutoff, rel=0.1)


def test_what_is_not_known_passes_through_to_the_byte_and_normals_follow(tmp_path, small_pieces):
    V, F = CLOSED
    source = tmp_path / "scan.ply"
    write(source, V, F, normals=True)
    mss.smooth_pieces(source, tmp_path / "out.ply", barycenter_weight=0.5)
    before, after = source.read_bytes(), (tmp_path / "out.ply").read_bytes()
    assert len(before) == len(after)
    file = ply.open_ply(tmp_path / "out.ply")
    assert before[: file.vertex_start] == after[: file.vertex_start]
    end = file.vertex_start + file.vertex_count * file.vertex.itemsize
    assert before[end:] == after[end:]
    records = file.positions()
    assert np.array_equal(records["id"], np.arange(len(V)))
    normals = np.stack([records[f"n{a}"] for a in "xyz"], axis=-1)
    np.testing.assert_allclose(normals, vertex_normals(mss.Surface(ply.stack(records), F)), atol=1e-4)
    assert not (tmp_path / "out.ply.pieces").exists()


def test_a_clean_mesh_is_copied(tmp_path, small_pieces):
    V, F = torus(200, 128)
    source = write(tmp_path / "scan.ply", V, F, wide=True)
    result = mss.smooth_pieces(source, tmp_path / "out.ply")
    assert (tmp_path / "out.ply").read_bytes() == (tmp_path / "scan.ply").read_bytes()
    assert result.displacement == 0
    assert "left as they are" in result.summary


def test_a_piece_that_fails_costs_no_other_and_the_next_call_goes_on(tmp_path, small_pieces, monkeypatch):
    source = write(tmp_path / "scan.ply", *CLOSED)
    real = whole.local.outcomes

    def fail_once(jobs, *rest):
        for outcome in real(jobs, *rest):
            number = int(outcome.output[-10:-4])
            lost = whole.replace(outcome, status="crashed", reason="it was killed")
            yield lost if number == 1 and outcome.status == "done" else outcome
            if number == 1:
                Path(outcome.output).unlink(missing_ok=True)

    with monkeypatch.context() as patch:
        patch.setattr(whole.local, "outcomes", fail_once)
        with pytest.raises(mss.FilterFailed, match="piece 1: it was killed; . of . pieces are kept"):
            mss.smooth_pieces(source, tmp_path / "out.ply", barycenter_weight=1.0)
    assert not (tmp_path / "out.ply").exists()
    small_pieces.clear()
    mss.smooth_pieces(source, tmp_path / "out.ply", barycenter_weight=1.0)
    assert set(small_pieces) == {1}
    again = (tmp_path / "out.ply").read_bytes()
    small_pieces.clear()
    mss.smooth_pieces(source, tmp_path / "out.ply", barycenter_weight=1.0, resume=False)
    assert len(small_pieces) > 1
    assert (tmp_path / "out.ply").read_bytes() == again


def test_long_edges_widen_a_margin(tmp_path, small_pieces):
    """One half of the sheet has edges that are longer by a factor of six."""
    V, F = sheet(180, 120)
    V[:, 2] = 0
    V[:, 0] = np.where(V[:, 0] > 90, 90 + 6 * (V[:, 0] - 90), V[:, 0])
    V[:, 2] += 0.2 * np.random.default_rng(0).standard_normal(len(V))
    source = write(tmp_path / "scan.ply", V, F, wide=True)
    result = mss.smooth_pieces(source, tmp_path / "out.ply", barycenter_weight=0.3)
    heat = response("heat", result.setting["cutoff"])
    expected = mss.smooth(V, F, response=heat, barycenter_weight=0.3, tolerance=1e-7).vertices
    rms = np.sqrt(np.square(expected - V).sum(axis=1).mean())
    assert np.linalg.norm(read(tmp_path / "out.ply") - expected, axis=1).max() < 1e-3 * rms


def damage(path, old, new):
    content = path.read_bytes()
    assert old in content
    path.write_bytes(content.replace(old, new, 1))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda p: p.write_bytes(b"solid x"), "is not a PLY file"),
        (lambda p: damage(p, b"binary_little_endian", b"ascii"), "format ascii; pieces need a binary one"),
        (lambda p: p.write_bytes(p.read_bytes()[:-50_000]), "it was cut off"),
        (lambda p: damage(p, b"property int id", b"property list uchar int id"), "vertex has the list id"),
        (lambda p: damage(p, b"property int id", b"property odd id"), "unknown type odd"),
        (lambda p: damage(p, b"property float y", b"property float w"), "no vertex with x, y, z"),
        (lambda p: damage(p, b"\x03\x00\x00\x00\x00", b"\x04\x00\x00\x00\x00"), "face 0 has 4 corners"),
        (lambda p: damage(p, b"\x03\x00\x00\x00\x00", b"\x03\x00\x00\x00\x7f"), "face 0 has a vertex"),
    ],
)
def test_files_that_are_no_such_mesh_are_refused_with_the_reason(tmp_path, small_pieces, change, words):
    path = tmp_path / "scan.ply"
    write(path, *CLOSED)
    change(path)
    with pytest.raises(mss.FileError, match=words):
        mss.smooth_pieces(path, tmp_path / "out.ply", barycenter_weight=1.0)
    assert not (tmp_path / "out.ply").exists()


def test_vertices_that_are_not_finite_and_folders_of_others_are_refused(tmp_path, small_pieces):
    V, F = CLOSED
    V = V.copy()
    V[7] = np.nan
    source = write(tmp_path / "scan.ply", V, F)
    with pytest.raises(mss.FileError, match="vertex 7 is not finite"):
        mss.smooth_pieces(source, tmp_path / "out.ply")
    (tmp_path / "other.ply.pieces").mkdir()
    with pytest.raises(mss.FileError, match="not from an earlier call"):
        mss.smooth_pieces(source, tmp_path / "other.ply")
    with pytest.raises(mss.FileError, match="no such file"):
        mss.smooth_pieces(tmp_path / "none.ply", tmp_path / "out.ply")


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"memory_limit": "lots"}, "memory_limit is 'lots'"),
        ({"memory_limit": 5}, "half a gigabyte"),
        ({"difference": 0}, "difference is 0"),
        ({"workers": 0}, "workers is 0"),
        ({"barycenter_weight": np.ones(5)}, "one weight"),
        ({"spacing": 1.0}, "no spacing"),
        ({"boundary": "odd"}, "boundary is 'odd'"),
        ({"local": 2}, "local is 2"),
    ],
)
def test_parameters_are_checked_first(tmp_path, given, words):
    source = write(tmp_path / "scan.ply", *sheet())
    with pytest.raises(mss.InvalidParameter, match=words):
        mss.smooth_pieces(source, tmp_path / "out.ply", **given)
    for out, reason in (("scan.ply", "both source and output"), ("out.obj", "the format of the source")):
        with pytest.raises(mss.InvalidParameter, match=reason):
            mss.smooth_pieces(source, tmp_path / out)


def test_the_margin_grows_as_the_inverse_root_of_the_weight():
    narrow, wide = find_margin(0.4, 0.025, 1e-3), find_margin(0.025, 0.025, 1e-3)
    assert narrow < wide < 4 * narrow
    assert find_margin(0.1, 0.025, 1e-6) > find_margin(0.1, 0.025, 1e-3)


def test_space_is_split_into_boxes_with_as_many_points_and_margins_overlap():
    X = np.random.default_rng(0).random((5000, 3)) * [9, 3, 1]
    tree = split_space(X, 7)
    owners = find_owners(tree, X)
    assert np.bincount(owners).min() > 0.9 * 5000 / 7
    again = unpack_tree(pack_tree(tree))
    near = dict(route(again, X, X, np.full(7, 0.2)))
    for leaf in range(7):
        own = X[owners == leaf]
        gap = np.maximum(own.min(axis=0) - X, X - own.max(axis=0)).max(axis=1)
        assert set(np.flatnonzero(gap < 0.19)) <= set(near[leaf].tolist())


def test_rings_are_counted_along_edges_and_across_seams():
    V, F = sheet(30, 4)
    rings = count_rings(F.astype(np.int64), V[:, 0] < 5, np.arange(len(V)), 9)
    assert np.array_equal(rings, np.clip(V[:, 0] - 4, 0, 10))
    soup, faces = V[F].reshape(-1, 3), np.arange(3 * len(F)).reshape(-1, 3)
    _, first, place = np.unique(soup, axis=0, return_index=True, return_inverse=True)
    assert np.array_equal(count_rings(faces, soup[:, 0] < 5, first[place.ravel()], 9), rings[F].ravel())


def test_the_command_smooths_in_processes_of_its_own(tmp_path, capsys):
    source = write(tmp_path / "scan.ply", *CLOSED)
    command = ["smooth", source, str(tmp_path / "out.ply"), "--pieces", "--memory", "1G", "--barycenter-weight", "0.5"]
    assert main(command) == 0
    assert "in 1 piece" in capsys.readouterr().out
    expected = mss.smooth(*CLOSED, barycenter_weight=0.5).vertices
    rms = np.sqrt(np.square(expected - CLOSED[0]).sum(axis=1).mean())
    assert np.abs(read(tmp_path / "out.ply") - expected).max() < 0.02 * rms  # the tolerance of the whole
    assert main([*command[:3], "--pieces", "--spacing", "1"]) == 2
    assert main([*command[:3], "--pieces", "--wavelength", "5%"]) == 2
    assert main(["denoise", *command[1:3], "--pieces", "--crease-angle", "60"]) == 2
    assert main(["denoise", *command[1:5], "1G", "--local"]) == 0
    assert "edge-aware smoothing" in capsys.readouterr().out


def write_stl(path, V, F):
    facets = np.zeros(len(F), STL_FACET)
    facets["corners"], facets["attribute"] = V[F], np.arange(len(F)) % 5
    path.write_bytes(b"made here".ljust(80) + np.uint32(len(F)).tobytes() + facets.tobytes())
    return facets


def test_an_stl_file_is_welded_smoothed_and_written_with_its_attributes(tmp_path, small_pieces, monkeypatch):
    monkeypatch.setattr(weld_module, "_BOX", 20_000)
    V, F = CLOSED
    V = V.astype(np.float32).astype(float)
    before = write_stl(tmp_path / "scan.stl", V, F)
    result = mss.smooth_pieces(tmp_path / "scan.stl", tmp_path / "out.stl", barycenter_weight=0.5)
    assert (result.vertices, result.faces) == (len(V), len(F))
    heat = response("heat", result.setting["cutoff"])
    expected = mss.smooth(V, F, response=heat, barycenter_weight=0.5, tolerance=1e-7).vertices
    content = (tmp_path / "out.stl").read_bytes()
    assert content[:80] == b"made here".ljust(80)
    facets = np.frombuffer(content[84:], STL_FACET)
    np.testing.assert_allclose(facets["corners"], expected[F], atol=1e-4)
    assert np.array_equal(facets["attribute"], before["attribute"])
    assert not (tmp_path / "out.stl.pieces").exists()
    (tmp_path / "text.stl").write_text("solid x\nendsolid x\n")
    with pytest.raises(mss.FileError, match="no binary STL file"):
        mss.smooth_pieces(tmp_path / "text.stl", tmp_path / "out.stl")


def test_tiles_that_share_vertices_still_share_them(tmp_path, small_pieces):
    V, F = CLOSED
    folder = tmp_path / "tiles"
    folder.mkdir()
    used = []
    for number, part in enumerate(np.array_split(F, 3)):
        at, local = np.unique(part, return_inverse=True)
        write(folder / f"tile{number}.ply", V[at], local.reshape(-1, 3), wide=True)
        used.append(at)
    result = mss.smooth_pieces(folder, tmp_path / "out", barycenter_weight=0.5)
    assert result.vertices == len(V)
    heat = response("heat", result.setting["cutoff"])
    expected = mss.smooth(V, F, response=heat, barycenter_weight=0.5, tolerance=1e-7).vertices
    rms = np.sqrt(np.square(expected - V).sum(axis=1).mean())
    places = []
    for number, at in enumerate(used):
        X = read(tmp_path / f"out/tile{number}.ply")
        assert np.abs(X - expected[at]).max() < 1e-3 * rms
        places += map(tuple, X.tolist())
    assert len(set(places)) == len(V)  # every vertex on a seam is where that of the other tile is, to the bit
    with pytest.raises(mss.InvalidParameter, match="both source and output"):
        mss.smooth_pieces(folder, folder)
    (tmp_path / "empty").mkdir()
    with pytest.raises(mss.FileError, match="has no .ply files"):
        mss.smooth_pieces(tmp_path / "empty", tmp_path / "out")

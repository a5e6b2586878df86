"""The benchmark of quality runs, and its figures are those of the metrics."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import meshlab_specsmooth as mss
from meshlab_specsmooth.comparison import metrics
from meshlab_specsmooth.meshlab import meshset
from tests.meshes import rough, torus

SCRIPT = Path(__file__).parent.parent / "scripts" / "benchmark_quality.py"
pytestmark = [
    pytest.mark.no_cover,
    pytest.mark.skipif(
        not (SCRIPT.parent.parent / ".venv").exists(), reason="the script would make an environment first"
    ),
]


def run(*arguments):
    command = [sys.executable, str(SCRIPT), *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, check=False)


@pytest.fixture
def folder(tmp_path):
    """A pair of files."""
    pairs = tmp_path / "pairs"
    pairs.mkdir()
    for name, mesh in (("noisy", rough(torus())), ("truth", torus())):
        meshset.new(*mesh).save_current_mesh(str(pairs / f"ring_{name}.ply"))
    return pairs


def test_pairs_of_a_folder_are_measured_as_the_metrics_say(folder, tmp_path):
    kept, out = tmp_path / "kept.json", tmp_path / "out"
    arguments = ["--pairs", folder, "--methods", "Taubin", "--methods", "specsmooth automatic", "--small", "--out", out]
    done = run(*arguments, "--reference", kept, "--json", tmp_path / "rows.json")
    assert done.returncode == 0, done.stderr
    rows = {(row["method"], row["best_for"]): row for row in json.loads((tmp_path / "rows.json").read_text())["ring"]}
    truth, (V, F) = mss.Surface(*torus()), rough(torus())
    ours = mss.Surface(mss.smooth(V, F).vertices, F)
    row = rows["specsmooth automatic", "default"]["values"]
    for name, metric in {
        "normal_error": metrics.normal_error,
        "surface_error": metrics.surface_error,
        "vertex_error": metrics.vertex_error,
        "volume": metrics.volume_change,
        "flips": metrics.flipped,
    }.items():
        assert row[name] == pytest.approx(metric(ours, truth), rel=1e-4, abs=1e-4)  # the files are in single precision
    ms = meshset.new(V, F)
    ms.apply_coord_taubin_smoothing()
    default = metrics.normal_error(mss.Surface(ms.current_mesh().vertex_matrix(), F), truth)
    assert rows["MeshLab Taubin", "default"]["values"]["normal_error"] == pytest.approx(default, rel=1e-4)
    taubin = [row["values"] for row in rows.values() if row["method"] == "MeshLab Taubin"]
    for target, key in (("theta", "normal_error"), ("Ev", "surface_error")):
        assert rows["MeshLab Taubin", target]["values"][key] == min(values[key] for values in taubin)
    # the summary is the quotient of the two rows
    line = next(
        x for x in done.stdout.splitlines() if x.startswith("| specsmooth automatic") and "| MeshLab  | theta" in x
    )
    assert float(line.split("|")[4]) == pytest.approx(
        row["normal_error"] / min(values["normal_error"] for values in taubin), abs=2e-3
    )
    assert "pass_band: 0.01, 0.03;" in (out / "quality.md").read_text()
    assert (out / "ring.png").stat().st_size > 10_000
    # what was tuned is taken from the file, and only for the same arrays
    data = json.loads(kept.read_text())
    assert len(data) == 1
    for stored in data.values():
        for each in stored:
            each["values"]["normal_error"] = 77.0
    kept.write_text(json.dumps(data))
    for name, mesh in (("noisy", (V, F)), ("truth", (truth.vertices * [1, 1, 1.5], F))):
        meshset.new(*mesh).save_current_mesh(str(folder / f"taller_{name}.ply"))
    again = run(*arguments, "--reference", kept, "--no-pictures").stdout
    same, other = again[: again.index("### taller")], again[again.index("### taller") :]
    assert " 77.00 " in same
    assert " 77.00 " not in other


def test_what_fails_or_goes_astray_is_a_row_that_says_so(tmp_path):
    program = f"""
import sys
sys.path.insert(0, {str(SCRIPT.parent)!r})
sys.argv += ["--small", "--only", "torus_gaussian_0.3", "--no-pictures", "--out", {str(tmp_path)!r}]
import benchmark_filters
def breaks(vertices, faces):
    raise ValueError("it broke")
benchmark_filters.MESHLAB = [
    benchmark_filters.TunedFilter("broken", "MeshLab", breaks),
    benchmark_filters.TunedFilter("wild", "MeshLab", lambda V, F, by: V * by, {{"by": 1e300}}, {{"by": (1e200, 1.0)}}),
]
benchmark_filters.PAPER = []
import benchmark_quality
benchmark_quality.main()
"""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    lines = done.stdout.splitlines()
    assert any(line.startswith("| broken") and line.endswith("fails: it broke") for line in lines)
    assert any(line.startswith("| wild") and "| default" in line and line.endswith("diverges") for line in lines)
    assert any(line.startswith("| wild") and "| theta" in line and line.endswith("by=1") for line in lines)


def test_pairs_with_other_faces_are_refused(folder):
    V, F = torus()
    meshset.new(V, np.roll(F, 1, axis=0)).save_current_mesh(str(folder / "ring_truth.ply"))
    done = run("--pairs", folder)
    assert done.returncode == 1
    assert "same faces" in done.stderr


def test_made_pairs_are_what_they_are_called():
    """In one process, as the shapes are made one after the other; the same every time."""
    program = f"""
import sys
sys.path.insert(0, {str(SCRIPT.parent)!r})
import numpy as np
import pairs
from meshlab_specsmooth.geometry.surface import edges, face_vectors, is_closed, signed_volume
from meshlab_specsmooth.noise.voxels import find_voxels

assert {{shape for shape, _, _ in pairs.PAIRS.values()}} == set(pairs.SHAPES) | set(pairs.MASKS)
for name, make in pairs.MASKS.items():
    mask, truth = make(1500)
    assert 1000 < len(truth.vertices) < 3000, (name, len(truth.vertices))
    assert is_closed(truth) and signed_volume(truth) > 0, name
    assert np.abs(mask.vertices - truth.vertices).max() < 2, name
    assert find_voxels(mask.vertices, mask.faces) is not None, name
for name, make in pairs.SHAPES.items():
    truth = make(1500)
    assert 1200 < len(truth.vertices) < 3000, (name, len(truth.vertices))
    assert np.linalg.norm(face_vectors(truth), axis=1).min() > 0, name
    assert is_closed(truth) == (name not in ("relief", "open_block")), name
    assert not is_closed(truth) or signed_volume(truth) > 0, name
    ends, _ = edges(truth)
    length = np.linalg.norm(truth.vertices[ends[:, 0]] - truth.vertices[ends[:, 1]], axis=1)
    spread = np.percentile(length, 95) / np.percentile(length, 5)
    assert (spread > 3) == (name in ("bunny", "uneven_torus", "uneven_block", "cow")), (name, spread)
for name in ("capsule_block_gaussian_0.2", "uneven_block_gaussian_0.2"):
    (one, _), (other, _) = (pairs.make(name, 1500) for _ in range(2))
    assert np.array_equal(one.vertices, other.vertices) and np.array_equal(one.faces, other.faces), name
kinds = {{pairs.group_of(name) for name in pairs.PAIRS}}
assert kinds == {{"white", *pairs.GROUPS}}, kinds
"""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr

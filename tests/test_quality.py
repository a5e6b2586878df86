"""The benchmark of quality runs; what it measures is no matter for a test, but that it measures what it says is."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import meshlab_specsmooth as mss
from meshlab_specsmooth.bridge import meshset
from meshlab_specsmooth.compare import metrics
from tests.meshes import rough, torus

SCRIPT = Path(__file__).parent.parent / "scripts" / "benchmark_quality.py"
pytestmark = pytest.mark.skipif(
    not (SCRIPT.parent.parent / ".venv").exists(), reason="the script would make an environment first"
)


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
    arguments = ["--pairs", folder, "--methods", "Taubin", "--methods", "ours: smooth", "--out", out]
    done = run(*arguments, "--reference", kept, "--json", tmp_path / "rows.json")
    assert done.returncode == 0, done.stderr
    rows = {(row["method"], row["chosen"]): row for row in json.loads((tmp_path / "rows.json").read_text())["ring"]}
    truth, (V, F) = mss.Surface(*torus()), rough(torus())
    ours = mss.Surface(mss.smooth(V, F).vertices, F)
    row = rows["ours: smooth", "default"]
    for name, metric in {
        "theta": metrics.normal_error,
        "surface": metrics.surface_error,
        "vertex": metrics.vertex_error,
        "volume": metrics.volume_change,
        "flips": metrics.flipped,
    }.items():
        assert row[name] == pytest.approx(metric(ours, truth), rel=1e-4, abs=1e-4)  # the files are in single precision
    ms = meshset.new(V, F)
    ms.apply_coord_taubin_smoothing()
    default = metrics.normal_error(mss.Surface(ms.current_mesh().vertex_matrix(), F), truth)
    assert rows["Taubin", "default"]["theta"] == pytest.approx(default, rel=1e-4)
    for name, chosen in (("theta", "theta"), ("surface", "Ev")):
        assert rows["Taubin", chosen][name] == min(r[name] for r in rows.values() if r["method"] == "Taubin")
    # the summary is the quotient of the two rows
    line = next(x for x in done.stdout.splitlines() if x.startswith("| ours: smooth") and "| MeshLab  | theta" in x)
    assert float(line.split("|")[4]) == pytest.approx(row["theta"] / rows["Taubin", "theta"]["theta"], abs=2e-3)
    assert "pass_band: 0.03, 0.1, 0.2" in (out / "quality.md").read_text()
    assert (out / "ring.png").stat().st_size > 10_000
    # what was tuned is taken from the file, and only for the same arrays
    data = json.loads(kept.read_text())
    assert len(data) == 1
    for stored in data.values():
        for each in stored:
            each["theta"] = 77.0
    kept.write_text(json.dumps(data))
    again = run(*arguments, "--reference", kept, "--no-pictures")
    assert " 77.00 " in again.stdout
    moved = mss.Surface(truth.vertices * [1, 1, 1.5], F)
    meshset.new(moved.vertices, F).save_current_mesh(str(folder / "ring_truth.ply"))
    assert " 77.00 " not in run(*arguments, "--reference", kept, "--no-pictures").stdout


def test_what_fails_or_goes_astray_is_a_row_that_says_so(tmp_path):
    program = f"""
import sys
sys.path.insert(0, {str(SCRIPT.parent)!r})
sys.argv = ["benchmark_quality.py", "--small", "--only", "torus_gaussian_0.3", "--no-pictures", "--out", {str(tmp_path)!r}]
import contenders
def breaks(vertices, faces):
    raise ValueError("it broke")
contenders.MESHLAB = [
    contenders.Contender("broken", "MeshLab", breaks),
    contenders.Contender("wild", "MeshLab", lambda V, F, by: V * by, {{"by": 1e300}}, {{"by": (1e200, 1.0)}}),
]
contenders.PAPER = []
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
    assert run("--pairs", folder, "--only", "another").returncode == 1


@pytest.mark.parametrize("name", ["block", "capsule_block", "bumps", "bunny", "uneven_block", "cow", "relief", "open_block"])
def test_made_shapes_are_clean_and_of_their_kind(name):
    program = f"""
import sys
sys.path.insert(0, {str(SCRIPT.parent)!r})
import pairs
"""
    assert program

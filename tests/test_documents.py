"""What is generated is up to date, and what is shown runs."""

import importlib
import subprocess
import sys
from pathlib import Path

import pytest

import meshlab_specsmooth as mss

ROOT = Path(__file__).parent.parent


def test_generated_files_are_up_to_date(monkeypatch):
    monkeypatch.syspath_prepend(str(ROOT / "scripts"))
    bootstrap = importlib.import_module("bootstrap")
    monkeypatch.setattr(bootstrap, "enter", lambda extra: None)  # it would start this very process anew
    for file, made in importlib.import_module("make_docs").documents().items():
        assert file.read_text(encoding="utf-8") == made, f"{file.name}: run scripts/make_docs.py"


def test_the_api_pages_have_every_public_name():
    text = (ROOT / "docs/api.rst").read_text(encoding="utf-8")
    listed = {line.strip() for line in text.splitlines() if line.startswith("   ") and ":" not in line}
    assert listed - {"accessor.SpecsmoothAccessor"} == {*mss.__all__} - {"__version__"}


@pytest.mark.no_cover
def test_the_session_script_replays_itself_and_is_closer_than_the_built_ins(tmp_path):
    command = [sys.executable, ROOT / "scripts" / "pymeshlab_session.py", "--out", tmp_path]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert "exactly the same" in done.stdout
    far = {line.split()[0]: float(line.split()[2]) for line in done.stdout.splitlines() if "from the original" in line}
    assert far["ours"] < min(far["Taubin"], far["Laplacian"])
    assert {"session.mlx", "smoothed.ply"} == {path.name for path in tmp_path.iterdir()}
    assert "Spectral Smooth" in (tmp_path / "session.mlx").read_text()

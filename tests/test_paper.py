"""scripts/reproduce_paper.py makes every figure and the page, from coarser meshes."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

SCRIPT = Path(__file__).parent.parent / "scripts" / "reproduce_paper.py"


@pytest.mark.no_cover
def test_all_of_it_is_made_and_the_page_says_what_was_measured(tmp_path):
    command = [sys.executable, str(SCRIPT), "--small", "--out", str(tmp_path)]
    printed = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    pictures = sorted(path.name for path in tmp_path.glob("*.png"))
    assert pictures[:2] == ["figure1.png", "figure2.png"]
    assert len(pictures) == 4
    page = (tmp_path / "paper.md").read_text(encoding="utf-8")
    assert page in printed
    for claim in ("No shrinkage", "No distortion", "One parameter", "Smoother than", "Non-iterative", "Fast"):
        assert claim in page
    rows = re.findall(r"^\| (noisy|MeshLab.*?|spectral.*?|the paper's.*?) \| ([\d.]+) \|", page, re.MULTILINE)
    assert len(rows) == 10
    noisy, laplacian, _, paper, stronger = (float(error) for _, error in rows[:5])
    assert max(laplacian, paper, stronger) < noisy

"""The benchmark runs; what it measures is no matter for a test."""

import subprocess
import sys
from pathlib import Path

import pytest

SCRIPT = Path(__file__).parent.parent / "scripts" / "benchmark_speed.py"


@pytest.mark.no_cover
@pytest.mark.skipif(not (SCRIPT.parent.parent / ".venv").exists(), reason="the script would make an environment first")
def test_the_benchmark_measures_and_says_what_was_missed(tmp_path):
    measures = ["sweep", "slider", "basis"]
    chosen = [word for name in measures for word in ("--only", name)]
    command = [sys.executable, str(SCRIPT), "--small", "--runs", "1", "--out", str(tmp_path), *chosen]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    table = (tmp_path / "speed.txt").read_text(encoding="utf-8")
    assert table in done.stdout
    rows = [line for line in table.splitlines() if "at least" in line or "at most" in line]
    assert len(rows) == 4
    for row in rows:
        figure, wanted = float(row.split(")")[-1].split()[0]), float(row.split("at least")[1].split()[0])
        assert ("MISSED" in row) == (figure < wanted)

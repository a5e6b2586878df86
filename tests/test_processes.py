import os
import subprocess
import sys

import pytest

from meshlab_specsmooth.batching import local
from meshlab_specsmooth.batching.worker import serve
from meshlab_specsmooth.isolation import processes

# what Python imports as it starts, and what our processes do
NAMES = ["encodings", "io", "json", "numpy", "os", "pathlib", "signal", "site", "sitecustomize", "usercustomize"]


@pytest.fixture
def hostile_folder(tmp_path, monkeypatch):
    for name in NAMES:
        (tmp_path / f"{name}.py").write_text(f"open({str(tmp_path / 'ran')!r}, 'a').write('{name} ')\n")
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize("path", [None, "", os.pathsep, f"{os.curdir}{os.pathsep}{{folder}}/none", "./"])
@pytest.mark.parametrize("safe", ["", "1"])  # Python 3.11 has it
def test_a_process_imports_nothing_from_the_working_directory(path, safe, hostile_folder, monkeypatch):
    monkeypatch.setenv("PYTHONSAFEPATH", safe)
    if path is None:
        monkeypatch.delenv("PYTHONPATH", raising=False)
    else:
        monkeypatch.setenv("PYTHONPATH", path.format(folder=hostile_folder))
    command = processes.command(processes.environment)
    monkeypatch.setenv("PYTHONWARNINGS", "error")
    done = subprocess.run(command, env=processes.environment(), capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
    assert not (hostile_folder / "ran").exists()


@pytest.mark.no_cover  # what traces a process imports json before
def test_a_process_that_is_started_in_another_way_does(hostile_folder, monkeypatch):
    monkeypatch.delenv("PYTHONPATH", raising=False)
    monkeypatch.delenv("PYTHONSAFEPATH", raising=False)
    subprocess.run([sys.executable, "-c", "import json"], check=True)
    assert (hostile_folder / "ran").read_text() == "json "


def test_entries_of_the_python_path_stay(monkeypatch, tmp_path):
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join(["", str(tmp_path), ".", "modules", ""]))
    assert processes.environment()["PYTHONPATH"] == os.pathsep.join([str(tmp_path), "modules"])
    monkeypatch.delenv("PYTHONPATH")
    assert processes.environment() == dict(os.environ)


def test_the_worker_of_a_batch_starts_in_this_way(hostile_folder):
    assert local.command() == processes.command(serve)
    given = {"stdin": subprocess.DEVNULL, "capture_output": True, "check": False, "env": processes.environment()}
    done = subprocess.run(local.command(), **given)
    assert (done.stdout, done.stderr) == (b"", b"")
    assert not (hostile_folder / "ran").exists()

"""Runs the examples of the documents: Python blocks as they stand, console blocks command by command.

Each block has a folder of its own, with a small ``scan.ply`` to work on. A console block's lines with a prompt are run;
each must succeed, and the lines below it, if there are any, must be what it prints.

Console blocks under ``<!-- skip: next -->`` are not run: they make an environment (``python3 scripts/demo.py``), change
the one that the tests run in (``pip install``), or start these very tests (``python3 scripts/test.py``).
``tests/test_readme.py`` sees to it that nothing else is skipped.
"""

import os
import subprocess
import sys
from pathlib import Path

import pymeshlab
import pytest
from sybil import Example, Sybil
from sybil.parsers.markdown import CodeBlockParser, PythonCodeBlockParser, SkipParser

# examples that plot open no window, and without a display VTK renders by EGL
os.environ.setdefault("PYVISTA_OFF_SCREEN", "true")
if sys.platform == "linux" and "DISPLAY" not in os.environ:
    os.environ.setdefault("VTK_DEFAULT_OPENGL_WINDOW", "vtkEGLRenderWindow")


# run by the site, which is built before the tests
collect_ignore = ["docs/conf.py"]
collect_ignore_glob = ["docs/gallery/*"]


def run_console(example: Example) -> str | None:
    """Run a console block; what went wrong, or None."""
    before, *commands = f"\n{example.parsed}".split("\n$ ")
    if before.strip():
        return f"no command printed this:\n{before}"
    return next(filter(None, (run_command(*command.partition("\n")[::2]) for command in commands)), None)


def run_command(command: str, expected: str) -> str | None:
    """Run one command in the shell, with the environment's programs; what went wrong, or None."""
    path = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])
    # coverage is measured by the tests; here it would take as long as the commands do
    untraced = {name: value for name, value in os.environ.items() if not name.startswith("COVERAGE_")}
    done = subprocess.run(  # noqa: S602 (they are our own documents' lines)
        command,
        shell=True,
        env={**untraced, "PATH": path},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        check=False,
    )
    if done.returncode != 0:
        return f"$ {command}\nfailed with exit code {done.returncode}:\n{done.stdout}"
    if expected.strip() and done.stdout.strip() != expected.strip():
        return f"$ {command}\nprinted:\n{done.stdout}\nwhere the document says:\n{expected}"
    return None


@pytest.fixture
def in_a_folder_with_a_scan(tmp_path, monkeypatch):
    """Documents' examples read ``scan.ply``, a noisy sphere, and write where they like."""
    monkeypatch.chdir(tmp_path)
    ms = pymeshlab.MeshSet()
    ms.create_sphere(subdiv=4)
    ms.apply_coord_random_displacement(displacement=pymeshlab.PercentageValue(0.4))
    ms.save_current_mesh("scan.ply")


pytest_collect_file = Sybil(
    parsers=[PythonCodeBlockParser(), CodeBlockParser(language="console", evaluator=run_console), SkipParser()],
    patterns=["*.md"],
    fixtures=["in_a_folder_with_a_scan"],
).pytest()

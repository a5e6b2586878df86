"""Runs the examples of the documents: Python blocks as they stand, console blocks line by line against their output."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from sybil import Example, Sybil
from sybil.parsers.markdown import CodeBlockParser, PythonCodeBlockParser, SkipParser


def run_console(example: Example) -> str | None:
    """Run the lines that start with a prompt; each must succeed."""
    path = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])
    for line in example.parsed.splitlines():
        if line.startswith("$ "):
            done = subprocess.run(  # noqa: S602 (they are our own documents' lines)
                line[2:], shell=True, env={**os.environ, "PATH": path}, capture_output=True, text=True, check=False
            )
            if done.returncode != 0:
                return f"{line}\n{done.stdout}{done.stderr}"
    return None


@pytest.fixture
def in_an_empty_folder(tmp_path, monkeypatch):
    """Documents' examples write where they like."""
    monkeypatch.chdir(tmp_path)


pytest_collect_file = Sybil(
    parsers=[PythonCodeBlockParser(), CodeBlockParser(language="console", evaluator=run_console), SkipParser()],
    patterns=["*.md"],
    fixtures=["in_an_empty_folder"],
).pytest()

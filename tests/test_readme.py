"""What the README says and runs; its blocks themselves are run by conftest.py."""

import re
from argparse import ArgumentParser
from pathlib import Path
from types import SimpleNamespace

import pytest

import meshlab_specsmooth as mss
from conftest import run_console
from meshlab_specsmooth.cli import demo
from meshlab_specsmooth.comparison.filter_specs import DEMO
from meshlab_specsmooth.comparison.noise import gaussian
from meshlab_specsmooth.comparison.side_by_side import COLUMNS, run_side_by_side
from meshlab_specsmooth.comparison.tables import format_rows
from meshlab_specsmooth.meshlab import mesh_files, meshset

README = (Path(__file__).parent.parent / "README.md").read_text(encoding="utf-8")


def console(*lines):
    return run_console(SimpleNamespace(parsed="\n".join([*lines, ""])))


def test_commands_must_succeed_and_print_what_the_document_says(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert console("$ echo one", "one", "$ echo unsaid", "$ printf 'two\\nthree\\n'", "two", "three") is None
    assert "failed with exit code 3:\noh no" in console("$ echo one", "one", "$ echo oh no; exit 3", "$ touch after")
    assert not (tmp_path / "after").exists()
    assert "printed:\ntwo\n\nwhere the document says:\n2" in console("$ echo one", "$ echo two", "2", "$ echo three")
    assert "no command printed this:\n\none" in console("one", "$ echo one")
    assert "failed with exit code 2" in console("$ specsmooth smooth missing.ply out.ply --no-such-option")


def test_only_what_makes_environments_or_runs_the_tests_is_skipped():
    skipped = re.findall(r"<!-- skip: next -->\n```console\n(.*?)```", README, re.DOTALL)
    commands = ["python3 scripts/demo.py", "pip install '.[fast,report,progress]'", "python3 scripts/test.py"]
    assert skipped == [f"$ {command}\n" for command in commands]
    assert README.count("skip:") == len(skipped)
    assert README.count("```console") > len(skipped)


def cells(text):
    """Heading lines, and the row of each filter: normals, vertices, volume. The seconds are left out."""
    lines = text.strip("\n").splitlines()
    rows = (re.fullmatch(r"(\S.*?)  +(\S+) +(\S+) +(\S+) +(\S+)", line).groups() for line in lines[2:])
    return [line.split() for line in lines[:2]], {name: [float(x) for x in row[:3]] for name, *row in rows}


@pytest.mark.no_cover
def test_the_table_is_what_the_demo_gives():
    parser = ArgumentParser()
    demo.add_arguments(parser)
    defaults = parser.parse_args([])
    truth = mss.Surface(*meshset.get_arrays(mesh_files.read(mesh_files.sample("bunny.obj"))))
    rows = run_side_by_side(truth, gaussian(truth, defaults.noise, defaults.seed), DEMO)
    (said,) = re.findall(r"```text\n(.*?)```", README, re.DOTALL)
    headings, said_rows = cells(said)
    true_headings, true_rows = cells(format_rows(rows, COLUMNS))
    assert headings == true_headings
    assert list(said_rows) == list(true_rows)
    for name, numbers in true_rows.items():
        assert said_rows[name] == pytest.approx(numbers, rel=0.02, abs=0.02), name

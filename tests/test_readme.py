"""The README and the pages in docs/; their code blocks are run by conftest.py."""

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

ROOT = Path(__file__).parent.parent
PAGES = {
    path.relative_to(ROOT).as_posix(): path.read_text(encoding="utf-8")
    for path in (*ROOT.glob("*.md"), *ROOT.glob("docs/*.md"))
}
README = PAGES["README.md"]


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
    commands = ["pip install '.[fast,report,progress]'", "python3 scripts/demo.py", "python3 scripts/test.py"]
    assert skipped == [f"$ {command}\n" for command in commands]
    assert sum(text.count("skip:") for text in PAGES.values()) == len(skipped)
    assert README.count("```console") > len(skipped)


def test_the_readme_is_short_and_starts_with_install_code_picture_and_paper():
    lines = README.splitlines()
    assert len(lines) < 75
    first_screen = "\n".join(lines[:40])
    for each in (
        "pip install",
        "import meshlab_specsmooth as mss",
        "![",
        "Spectral mesh smoothing for virtual simulation",
    ):
        assert each in first_screen


@pytest.mark.parametrize("name", PAGES)
def test_lines_of_text_fit_on_a_screen(name):
    too_long = [line for line in PAGES[name].splitlines() if len(line) > 120 and not line.startswith("|")]
    assert too_long == []


@pytest.mark.parametrize("name", PAGES)
def test_links_and_files_that_are_named_exist(name):
    here = (ROOT / name).parent
    links = re.findall(r"\]\((?!https?:)([^)#]+)", PAGES[name])
    assert [link for link in links if not (here / link).exists()] == []
    # a file is named from the root of the repository or from the package on; tests by their names alone
    named = re.findall(r"`((?:[\w.]+/)*\w+\.(?:py|md|cff))`?", PAGES[name]) if name != "CHANGELOG.md" else []
    folders = (here, ROOT, ROOT / "meshlab_specsmooth", ROOT / "tests")
    assert [file for file in named if not any((folder / file).exists() for folder in folders)] == []


def test_every_guarantee_is_shown_by_tests_that_exist():
    file, missing = "", []
    for name in re.findall(r"`(test_\w+(?:\.py)?(?:::test_\w+)?)`", PAGES["docs/promises.md"]):
        stem, _, test = name.rpartition("::")
        if name.endswith(".py"):
            file = name
            continue
        file = stem or file
        if f"def {test}(" not in (ROOT / "tests" / file).read_text(encoding="utf-8"):
            missing.append(f"{file}::{test}")
    assert missing == []


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
    (said,) = re.findall(r"```text\n(.*?)```", PAGES["docs/performance.md"], re.DOTALL)
    headings, said_rows = cells(said)
    true_headings, true_rows = cells(format_rows(rows, COLUMNS))
    assert headings == true_headings
    assert list(said_rows) == list(true_rows)
    for name, numbers in true_rows.items():
        assert said_rows[name] == pytest.approx(numbers, rel=0.02, abs=0.02), name

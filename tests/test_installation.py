"""Reports of an installation, and completion in a shell."""

import importlib.metadata
import json
import os
import platform
import shutil
import subprocess
import sys

import pytest

import meshlab_specsmooth as mss
from meshlab_specsmooth.cli import main


def test_a_report_has_versions_extras_and_processors_and_nothing_personal():
    found = mss.report()
    assert found.required["numpy"] == importlib.metadata.version("numpy")
    assert found.extras["pyvista"]["pyvista"] == importlib.metadata.version("pyvista")
    assert not {"test", "demo", "release"} & found.extras.keys()
    assert found.processors >= 1
    text = str(found)
    assert found.version in text
    assert "numba" in text
    assert platform.node() not in text.split()
    assert os.path.expanduser("~") not in text  # noqa: PTH111 (a string is looked for)
    assert "<table" in found._repr_html_()


def test_a_package_that_is_missing_is_listed_as_such(monkeypatch):
    def version(name):
        if name == "numba":
            raise importlib.metadata.PackageNotFoundError(name)
        return "1"

    monkeypatch.setattr(importlib.metadata, "version", version)
    assert "numba (not installed)" in str(mss.report())


def test_without_metadata_the_required_packages_are_listed(monkeypatch):
    def requires(name):
        raise importlib.metadata.PackageNotFoundError(name)

    monkeypatch.setattr(importlib.metadata, "requires", requires)
    assert [*mss.report().required] == ["pymeshlab", "numpy", "scipy"]


def test_the_command_prints_it_as_text_or_json(capsys):
    assert main(["report"]) == 0
    assert "required" in capsys.readouterr().out
    assert main(["report", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["version"] == mss.__version__


@pytest.mark.skipif(shutil.which("bash") is None, reason="no bash")
def test_completion_in_bash_knows_commands_and_options(capsys, tmp_path):
    with pytest.raises(SystemExit) as ended:
        main(["--print-completion", "bash"])
    assert ended.value.code == 0
    script = tmp_path / "completion.sh"
    script.write_text(capsys.readouterr().out)
    for words, expected in (
        (["specsmooth", "dev"], "deviation"),
        (["specsmooth", "deviation", "--tol"], "--tolerance"),
    ):
        code = f"source {script}; COMP_WORDS=({' '.join(words)}); COMP_CWORD={len(words) - 1}; _shtab_specsmooth; "
        done = subprocess.run(
            [shutil.which("bash"), "-c", code + 'echo "${COMPREPLY[@]}"'], capture_output=True, text=True, check=True
        )
        assert expected in done.stdout.split()


def test_without_the_extra_completion_names_it(monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, "shtab", None)
    assert main(["--print-completion", "bash"]) == 1
    assert "completion" in capsys.readouterr().err

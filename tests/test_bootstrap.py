"""The scripts' environment, with the commands recorded instead of run."""

import importlib.util
import sys
from pathlib import Path

import pytest

SCRIPTS = Path(__file__).parent.parent / "scripts"


@pytest.fixture
def bootstrap(tmp_path, monkeypatch):
    """The module, in a clone of its own whose path has a space."""
    clone = tmp_path / "a clone"
    (clone / "scripts").mkdir(parents=True)
    (clone / "scripts" / "bootstrap.py").write_text((SCRIPTS / "bootstrap.py").read_text())
    (clone / "pyproject.toml").write_text("[project]")
    spec = importlib.util.spec_from_file_location("bootstrap_under_test", clone / "scripts" / "bootstrap.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    module.ran = []

    def run(command, environment=None):
        module.ran.append(command)
        if "venv" in command:
            (module.ENVIRONMENT / "bin").mkdir(parents=True, exist_ok=True)
            (module.ENVIRONMENT / "bin" / "python").touch()

    monkeypatch.setattr(module, "run", run)
    return module


def test_the_second_time_nothing_is_done(bootstrap):
    python = bootstrap.make_environment("demo")
    assert python == bootstrap.ENVIRONMENT / "bin" / "python"
    assert [("venv" in c, "install" in c) for c in bootstrap.ran] == [(True, False), (False, True)]
    assert bootstrap.ran[1][-1] == f"{bootstrap.ROOT}[demo]"
    bootstrap.make_environment("demo")
    assert len(bootstrap.ran) == 2


def test_another_extra_installs_into_the_same_environment(bootstrap):
    bootstrap.make_environment("demo")
    bootstrap.make_environment("test")
    assert [c[-1] for c in bootstrap.ran[2:]] == [f"{bootstrap.ROOT}[test]"]


def test_a_change_of_requirements_or_an_interruption_installs_again(bootstrap):
    bootstrap.make_environment("demo")
    (bootstrap.ROOT / "pyproject.toml").write_text("[project] # changed")
    bootstrap.make_environment("demo")
    assert len(bootstrap.ran) == 3
    (bootstrap.ENVIRONMENT / "installed-demo").unlink()  # as if the installation had been interrupted
    bootstrap.make_environment("demo")
    assert len(bootstrap.ran) == 4


def test_missing_system_libraries_are_one_command_to_type_or_are_installed(bootstrap, monkeypatch, capsys):
    monkeypatch.setattr(bootstrap, "needs", lambda library: library != "libGL.so.1")
    monkeypatch.setattr(bootstrap.shutil, "which", lambda _: "/usr/bin/apt-get")
    monkeypatch.setattr(bootstrap.os, "geteuid", lambda: 1000)
    with pytest.raises(SystemExit) as stopped:
        bootstrap.install_system_packages()
    assert "sudo apt-get update && sudo apt-get install -y libopengl0 libegl1" in str(stopped.value)
    assert bootstrap.ran == []
    monkeypatch.setattr(bootstrap.os, "geteuid", lambda: 0)
    bootstrap.install_system_packages()
    assert bootstrap.ran == [["apt-get", "update"], ["apt-get", "install", "-y", "libopengl0", "libegl1"]]
    assert "libopengl0" in capsys.readouterr().out


def test_what_is_there_needs_nothing(bootstrap, monkeypatch):
    monkeypatch.setattr(bootstrap, "needs", lambda library: False)
    bootstrap.install_system_packages()
    assert bootstrap.ran == []


def test_a_library_is_missing_when_it_cannot_be_loaded(bootstrap, monkeypatch):
    assert bootstrap.needs("libNoSuchThing.so.7") == (sys.platform == "linux")
    monkeypatch.setattr(bootstrap.sys, "platform", "darwin")
    assert not bootstrap.needs("libNoSuchThing.so.7")


def test_a_command_that_fails_shows_what_it_said(bootstrap, monkeypatch):
    monkeypatch.undo()
    with pytest.raises(SystemExit, match=r"(?s)too bad.*Failed: .*exit\(3\)"):
        bootstrap.run([sys.executable, "-c", "print('too bad'); exit(3)"])

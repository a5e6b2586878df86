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


def test_an_environment_for_the_tests_serves_the_demo(bootstrap):
    bootstrap.make_environment("test")
    done = len(bootstrap.ran)
    bootstrap.make_environment("demo")
    assert len(bootstrap.ran) == done


def test_another_extra_installs_into_the_same_environment(bootstrap):
    bootstrap.make_environment("demo")
    bootstrap.make_environment("test")
    assert [c[-1] for c in bootstrap.ran[2:]] == [f"{bootstrap.ROOT}[test]"]


class StartedAgain(Exception):  # noqa: N818 (no error: what os.execv does, as far as its caller can tell)
    pass


@pytest.fixture
def script(bootstrap, monkeypatch):
    """A script's ``enter(extra)`` in the Python with that prefix; the command by which it starts again, or None."""
    monkeypatch.setattr(bootstrap, "install_system_packages", lambda: None)
    monkeypatch.setattr(bootstrap.sys, "argv", ["scripts/some.py", "--flag"])

    def execute(path, command):
        raise StartedAgain(path, command)

    monkeypatch.setattr(bootstrap.os, "execv", execute)

    def enter(extra, prefix):
        with monkeypatch.context() as patch:
            patch.setattr(bootstrap.sys, "prefix", str(prefix))
            try:
                bootstrap.enter(extra)
            except StartedAgain as again:
                return again.args[1]
        return None

    return enter


def test_a_script_starts_again_inside_and_goes_on_there_at_once(bootstrap, script):
    python = str(bootstrap.ENVIRONMENT / "bin" / "python")
    assert script("demo", sys.base_prefix) == [python, "scripts/some.py", "--flag"]
    assert len(bootstrap.ran) == 2
    assert script("demo", bootstrap.ENVIRONMENT) is None
    assert script("demo", sys.base_prefix) == [python, "scripts/some.py", "--flag"]
    assert len(bootstrap.ran) == 2


@pytest.mark.parametrize("made_by", ["hand", "another script"])
def test_inside_an_environment_that_lacks_the_extra_it_is_installed_there(bootstrap, script, made_by):
    if made_by == "hand":
        (bootstrap.ENVIRONMENT / "bin").mkdir(parents=True)
        (bootstrap.ENVIRONMENT / "bin" / "python").touch()
    else:
        script("demo", sys.base_prefix)
    bootstrap.ran.clear()
    python = str(bootstrap.ENVIRONMENT / "bin" / "python")
    # started again: the Python that runs does not see what has just been installed
    assert script("test", bootstrap.ENVIRONMENT) == [python, "scripts/some.py", "--flag"]
    (install,) = bootstrap.ran  # and no new environment under the feet of the one that runs
    assert install[0] == python
    assert install[-1] == f"{bootstrap.ROOT}[test]"
    assert script("test", bootstrap.ENVIRONMENT) is None
    assert script("test", sys.base_prefix) is not None
    assert len(bootstrap.ran) == 1


def test_inside_a_change_of_requirements_installs_again(bootstrap, script):
    script("test", sys.base_prefix)
    (bootstrap.ROOT / "pyproject.toml").write_text("[project] # changed")
    assert script("test", bootstrap.ENVIRONMENT) is not None
    assert [c[-1] for c in bootstrap.ran[2:]] == [f"{bootstrap.ROOT}[test]"]
    assert script("test", bootstrap.ENVIRONMENT) is None


def test_an_environment_without_pip_gets_it_first(bootstrap, script, monkeypatch):
    script("demo", sys.base_prefix)
    monkeypatch.setattr(bootstrap.importlib.util, "find_spec", lambda name: None)
    script("test", bootstrap.ENVIRONMENT)
    assert [c[1:3] for c in bootstrap.ran[2:]] == [["-m", "ensurepip"], ["-m", "pip"]]


def test_an_environment_of_another_python_is_made_anew_from_outside(bootstrap, script, monkeypatch):
    script("demo", sys.base_prefix)
    monkeypatch.setattr(bootstrap.sys, "version", "3.99.0")
    script("demo", sys.base_prefix)
    assert [("venv" in c, "install" in c) for c in bootstrap.ran[2:]] == [(True, False), (False, True)]


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

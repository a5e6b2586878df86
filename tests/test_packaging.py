"""What people install, and where it runs."""

import ast
import os
import subprocess
import sys
import zipfile
from importlib.metadata import distribution, requires
from pathlib import Path

import jinja2
import pytest
import yaml

import meshlab_specsmooth as mss
from meshlab_specsmooth import meshlab as bridge
from meshlab_specsmooth.isolation import processes
from meshlab_specsmooth.meshlab import descriptors

ROOT = Path(__file__).parent.parent


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    folder = tmp_path_factory.mktemp("wheel")
    command = ["pip", "--disable-pip-version-check", "wheel", "--no-deps", "--no-build-isolation", "--quiet"]
    subprocess.run([sys.executable, "-m", *command, "--wheel-dir", folder, ROOT], check=True, capture_output=True)
    (built,) = folder.glob("*.whl")
    return built


def test_the_wheel_holds_the_package_its_command_and_the_descriptors_and_nothing_else(wheel):
    with zipfile.ZipFile(wheel) as archive:
        names = set(archive.namelist())
    shipped = {f"meshlab_specsmooth/{path.relative_to(ROOT)}" for path in (ROOT / "filters_xml").glob("*.xml")}
    assert len(shipped) >= 2
    assert shipped <= names
    assert "meshlab_specsmooth/py.typed" in names
    assert any(name.endswith("LICENSE") for name in names)
    assert {name.split("/")[0].split("-")[0] for name in names} == {"meshlab_specsmooth", "specsmooth.py"}
    modules = {str(path.relative_to(ROOT)) for path in (ROOT / "meshlab_specsmooth").rglob("*.py")}
    assert modules <= names


# without what an editable installation does to imports
BEGIN = """
import sys
sys.meta_path = [finder for finder in sys.meta_path if "editable" not in repr(finder)]
MESH = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]]
"""
FILTER = """
import meshlab_specsmooth as mss
ms = mss.MeshSet()
ms.create_cube()
assert ms.apply_coord_spectral_smoothing(modes=5)["modes"] == 5
print(mss.__file__)
"""
PROCESS = """
import numpy as np
from meshlab_specsmooth.meshlab.isolated_filter import FilterProcess
with FilterProcess(np.array(MESH[1])) as process:
    ran = process.run(np.array(MESH[0], dtype=float), "apply_coord_spectral_low_pass", {"modes": 4})
    assert ran.vertices.shape == (4, 3)
"""
ARRAYS = """
import meshlab_specsmooth as mss
for function in (mss.smooth, mss.low_pass, mss.enhance, mss.denoise, mss.smooth_edge_aware):
    assert function(*MESH).vertices.shape == (4, 3)
assert mss.smooth(mss.assemble(*MESH)).vertices.shape == (4, 3)
mss.spectrum(*MESH), mss.estimate_noise(*MESH), mss.estimate_error(lambda V: V, *MESH)
for name in ("MeshSet", "register", "get_spectrum", "self_intersecting_faces", "compare", "batch"):
    try:
        getattr(mss, name)
    except mss.MissingLibrary as error:
        print(error)
"""
REASON = "libGL.so.1: cannot open shared object file"
WITHOUT = f"pymeshlab cannot be loaded ({REASON}): apt-get install libgl1 libopengl0 libegl1"


def run(arguments, folder, path, modules):
    """Run Python with the wheel, and without numba, which would compile for some seconds."""
    (modules / "numba.py").write_text("raise ImportError('numpy is too new for it')")
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(path), str(modules)])}
    command = [sys.executable, "-W", "ignore::UserWarning", *arguments]  # such small meshes stay as they are
    return subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=False)


@pytest.mark.no_cover
@pytest.mark.parametrize("where", ["clone", "wheel"])
def test_it_runs_from_the_root_of_a_clone_beside_an_installed_wheel_and_from_an_archive(where, wheel, tmp_path):
    """In the root of a clone the folder there hides the installed package, and the descriptors lie beside it."""
    code, folder = (FILTER, ROOT) if where == "clone" else (FILTER + PROCESS, tmp_path)
    done = run(["-c", BEGIN + code], folder, wheel, tmp_path)
    assert (done.returncode, done.stderr) == (0, "")
    place = Path(done.stdout.strip()).parent.parent
    assert place == (ROOT if where == "clone" else wheel)


@pytest.mark.no_cover
def test_arrays_need_no_pymeshlab_and_the_rest_says_what_is_missing_and_the_remedy(wheel, tmp_path):
    (tmp_path / "pymeshlab.py").write_text(f"raise ImportError('{REASON}')")
    done = run(["-c", BEGIN + ARRAYS], tmp_path, wheel, tmp_path)
    assert (done.returncode, done.stderr, done.stdout.splitlines()) == (0, "", [WITHOUT] * 6)
    done = run(["-m", "meshlab_specsmooth", "--version"], tmp_path, wheel, tmp_path)
    assert (done.returncode, done.stdout, done.stderr) == (1, "", f"specsmooth: {WITHOUT}\n")


@pytest.mark.parametrize(
    ("error", "words"),
    [
        (ModuleNotFoundError("No module named 'pymeshlab'", name="pymeshlab"), "not installed: pip install pymeshlab"),
        (ModuleNotFoundError("No module named 'x'", name="x"), "(No module named 'x'): pip install --force-reinstall"),
        (ImportError("libc.so.6: version `GLIBC_2.35' not found"), "pip install 'pymeshlab<2025'"),
    ],
)
def test_each_reason_why_pymeshlab_cannot_be_loaded_has_its_remedy(error, words):
    assert words in bridge.explain(error)


@pytest.mark.no_cover
def test_importing_the_package_loads_and_reads_nothing():
    code = """
import pkgutil, sys
import meshlab_specsmooth as mss
ours = sorted(name for name in sys.modules if name.startswith("meshlab_specsmooth"))
assert ours == ["meshlab_specsmooth", "meshlab_specsmooth.version"], ours
heavy = {"pymeshlab", "numba", "matplotlib", "scipy", "numpy", "threadpoolctl"}
assert not heavy & sys.modules.keys()
mss.Surface, mss.errors.InvalidSurface
assert "scipy" not in sys.modules
mss.smooth, mss.denoise, mss.spectrum, mss.estimate_noise
assert not {"pymeshlab", "numba", "matplotlib", "meshlab_specsmooth.meshlab.descriptors"} & sys.modules.keys()
# no public name is that of a submodule, which would replace it when it is imported
import meshlab_specsmooth.comparison.metrics, meshlab_specsmooth.power_spectrum, meshlab_specsmooth.batching.many
assert all(callable(function) for function in (mss.compare, mss.spectrum, mss.batch))
assert not {*mss.__all__} & {name.name for name in pkgutil.iter_modules(mss.__path__)}
before = set(dir(mss))
from meshlab_specsmooth import *
assert {*mss.__all__} <= before and {*mss.__all__} <= globals().keys()
assert "matplotlib" not in sys.modules
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")


def test_names_are_the_same_for_type_checkers_and_for_the_interpreter():
    tree = ast.parse(Path(mss.__file__).with_suffix(".pyi").read_text(encoding="utf-8"))
    checked = {
        alias.name: node.module.partition(".")[2]
        for node in ast.walk(tree)
        if isinstance(node, ast.ImportFrom) and node.module.startswith("meshlab_specsmooth.")
        for alias in node.names
    }
    assert checked == mss._MODULE_OF
    assert mss.__all__ == sorted(["__version__", *checked])
    assert {name for name in mss.__all__ if callable(getattr(mss, name))} == set(checked)


def test_an_unknown_name_is_none_and_the_interpreter_knows_a_better_one():
    with pytest.raises(AttributeError, match="has no attribute 'smoth'") as caught:
        mss.smoth  # noqa: B018
    assert (caught.value.name, caught.value.obj) == ("smoth", mss)


def test_a_frozen_program_has_no_python_to_start(monkeypatch):
    monkeypatch.setattr(sys, "frozen", True, raising=False)
    with pytest.raises(mss.NoPython, match="has no Python that could be started"):
        processes.command(print)


def test_descriptors_that_were_not_packed_are_asked_for(monkeypatch, tmp_path):
    monkeypatch.setattr(descriptors, "files", lambda _: tmp_path / "package")
    with pytest.raises(mss.FileError, match="include filters_xml"):
        descriptors.names()


def test_only_three_libraries_are_required():
    required = [r for r in requires("meshlab-specsmooth") if "extra ==" not in r]
    assert sorted(r.split(">")[0] for r in required) == ["numpy", "pymeshlab", "scipy"]


def test_the_conda_recipe_has_the_version_and_the_requirements_of_the_package():
    """Rendered and parsed as conda-build does it, as far as that goes without conda."""
    text = (ROOT / "scripts/conda/meta.yaml").read_text(encoding="utf-8")
    recipe = yaml.safe_load(jinja2.Template(text).render(PYTHON="python"))
    assert recipe["package"] == {"name": "meshlab-specsmooth", "version": mss.__version__}
    needed = [line.replace(">=", " >=") for line in requires("meshlab-specsmooth") if "extra" not in line]
    assert sorted(recipe["requirements"]["run"][1:]) == sorted(needed)
    assert (ROOT / "scripts/conda" / recipe["source"]["path"]).resolve() == ROOT
    (command,) = recipe["build"]["entry_points"]
    assert command in {f"{e.name} = {e.value}" for e in distribution("meshlab-specsmooth").entry_points}
    assert f"version: {mss.__version__}" in (ROOT / "CITATION.cff").read_text(encoding="utf-8")

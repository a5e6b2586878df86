"""Data flows one way, and outside libraries stay in their rooms."""

import ast
import graphlib
from pathlib import Path

import pytest

import meshlab_specsmooth

PACKAGE = Path(meshlab_specsmooth.__file__).parent
MODULES = sorted(PACKAGE.rglob("*.py"))

# a room may use those before it
ROOMS = [
    {"version", "errors", "arrays"},
    {"parameters", "choices"},
    {"describe"},
    {"runtime"},
    {"isolation"},
    {"installation"},
    {"geometry"},
    {"adapters"},
    {"graph"},
    {"spectral"},
    {"operators"},
    {"noise"},
    {"risk"},
    {"smoothing"},
    {"edge_aware"},
    {"error_field"},
    {"power_spectrum"},
    {"meshlab"},
    {"comparison"},
    {"reports"},
    {"accessor"},
    {"batching"},
    {"pieces"},
    {"cli"},
    {"__init__", "__main__"},
]
HOME = {
    "pymeshlab": ("meshlab",),
    "distributed": ("batching",),
    "pyvista": ("reports", "accessor"),
    "matplotlib": ("reports",),
    "jinja2": ("reports",),
    "polyscope": ("reports",),
    "tqdm": ("runtime",),
    "plyfile": ("adapters",),
    "numba": ("graph",),
}


def room_of(path):
    return path.relative_to(PACKAGE).parts[0].removesuffix(".py")


def imports(path):
    """Modules that a file imports, at any depth of its code."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: relative import"
            yield node.module
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


def level(room):
    return next(i for i, rooms in enumerate(ROOMS) if room in rooms)


@pytest.mark.parametrize("path", MODULES, ids=lambda p: str(p.relative_to(PACKAGE)))
def test_nothing_looks_back(path):
    room = room_of(path)
    for name in imports(path):
        parts = name.split(".")
        if parts[0] == "meshlab_specsmooth" and len(parts) > 1 and parts[1].islower() and not parts[1].startswith("__"):
            assert level(parts[1]) <= level(room), f"{room} imports {name}"
        elif parts[0] in HOME:
            assert room in HOME[parts[0]], f"{room} imports {name}"


def test_every_room_is_listed():
    assert {room_of(path) for path in MODULES} == set().union(*ROOMS)


@pytest.mark.parametrize("path", MODULES, ids=lambda p: str(p.relative_to(PACKAGE)))
def test_python_is_started_in_one_place(path):
    assert ("sys.executable" in path.read_text(encoding="utf-8")) == (path.name == "processes.py")


def module_of(path):
    return ".".join(path.relative_to(PACKAGE.parent).with_suffix("").parts).removesuffix(".__init__")


def files_used(path, files):
    """Files of the package that a file imports; ``from package import module`` uses the module alone."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names if alias.name in files)
        elif isinstance(node, ast.ImportFrom):
            names = (f"{node.module}.{alias.name}" for alias in node.names)
            yield from (name if name in files else node.module for name in names if node.module in files)


def test_no_files_import_each_other_in_a_circle():
    files = {module_of(path): path for path in MODULES}
    graphlib.TopologicalSorter({name: set(files_used(path, files)) for name, path in files.items()}).prepare()

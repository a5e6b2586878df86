"""The drawing of the packages, and the page that says where things are."""

import importlib
import re
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
PAGE = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def architecture():
    sys.path.insert(0, str(ROOT / "scripts"))
    try:
        return importlib.import_module("architecture")
    finally:
        sys.path.remove(str(ROOT / "scripts"))


def test_the_arrows_that_are_drawn_imply_all_imports(architecture):
    direct = architecture.units()
    drawn = architecture.reduction(direct)
    assert architecture.closure(drawn) == architecture.closure(direct)
    for node, used in drawn.items():  # and none can be left out
        for each in used:
            fewer = {**drawn, node: used - {each}}
            assert each not in architecture.closure(fewer)[node]


def test_all_arrows_point_down(architecture):
    rows = architecture.rows(architecture.units())
    depth = {node: number for number, row in enumerate(rows) for node in row}
    assert all(depth[node] < depth[each] for node, used in architecture.units().items() for each in used)


@pytest.fixture
def small(architecture, tmp_path, monkeypatch):
    """A package of three modules, two of which import each other."""
    texts = {"a": "import meshlab_specsmooth.b", "b": "from meshlab_specsmooth import a, c", "c": "x: int = 1"}
    for name, text in texts.items():
        (tmp_path / f"{name}.py").write_text(text, encoding="utf-8")
    monkeypatch.setattr(architecture, "PACKAGE", tmp_path)
    monkeypatch.setattr(architecture, "sources", lambda: sorted(tmp_path.iterdir()))
    architecture.units.cache_clear()
    yield architecture
    architecture.units.cache_clear()


def test_packages_that_import_each_other_share_a_box(small):
    assert small.units() == {("a", "b"): {("c",)}, ("c",): set()}


def test_a_definition_is_found_or_is_an_error(small):
    assert small.find("c", "x") == small.find("c", "c.x") == "c.py"
    with pytest.raises(LookupError, match="c defines y in 0 files"):
        small.find("c", "y")


def test_every_file_on_the_page_exists_and_defines_what_is_named():
    places = re.findall(r"`([a-z_/]+\.py)`(?: \||:) `(\w+)`", PAGE)
    assert len(places) > 20
    for file, name in places:
        module = f"meshlab_specsmooth.{file.removesuffix('.py').replace('/', '.')}".removesuffix(".__init__")
        assert hasattr(importlib.import_module(module), name), f"{file}: {name}"


def test_every_package_is_on_the_page_and_in_the_drawing(architecture):
    drawing = (ROOT / "docs" / "architecture.svg").read_text(encoding="utf-8")
    for name in (name for unit in architecture.units() for name in unit):
        assert f"| `{name}` | {architecture.purpose(name)} |" in PAGE
        assert f">{name}</text>" in drawing

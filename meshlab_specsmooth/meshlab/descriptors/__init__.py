"""Filter descriptors: names, types, defaults, bounds and help of the filters on MeshSets.

The files in ``filters_xml/`` follow MeshLab's former ``MESHLAB_FILTER_INTERFACE`` grammar, version 2.0, which MeshLab
stopped reading in 2020. The filters' keyword arguments, the options of the command line and the documentation are
generated from them. The numerics do not read them; a test checks that their defaults agree.
"""

from __future__ import annotations

from importlib.resources import files
from typing import TYPE_CHECKING

from meshlab_specsmooth.errors import FileError
from meshlab_specsmooth.meshlab.descriptors.model import AnySelected, Descriptor, Length, Parameter, Value
from meshlab_specsmooth.meshlab.descriptors.parse import read

if TYPE_CHECKING:
    from importlib.abc import Traversable  # its location in Python 3.10

__all__ = ["AnySelected", "Descriptor", "Length", "Parameter", "Value", "folder", "load", "names", "read"]


def load(function: str) -> Descriptor:
    """Load the descriptor of the filter with this Python name from ``filters_xml/``."""
    path = folder() / f"{function}.xml"
    return read(path.read_bytes(), str(path))


def names() -> tuple[str, ...]:
    """Return the Python names of all filters, sorted."""
    return tuple(sorted(path.name[: -len(".xml")] for path in folder().iterdir() if path.name.endswith(".xml")))


def folder() -> Traversable:
    """Find ``filters_xml/``: a folder of the installed package, or beside the package in a clone of the repository.

    Raises
    ------
    FileError
        It is in neither place.
    """
    package = files("meshlab_specsmooth")
    inside = package / "filters_xml"
    if inside.is_dir():
        return inside
    # Traversable has no parent, but both implementations have: pathlib.Path and zipfile.Path
    beside: Traversable = package.parent / "filters_xml"  # type: ignore[attr-defined]
    if beside.is_dir():
        return beside
    raise FileError(
        f"{inside}: the filters' descriptions are missing; include filters_xml/*.xml when packing the package"
    )

"""Errors as types; every message names what is wrong, where, and the remedy."""

from __future__ import annotations

import difflib
from collections.abc import Iterable


class SpecsmoothError(Exception):
    """Base of every error that this package raises on purpose."""


class InvalidSurface(SpecsmoothError, ValueError):  # noqa: N818 (named for what is wrong, as the other errors are)
    """Arrays that are no triangle mesh.

    Attributes
    ----------
    array : str
        ``"vertices"`` or ``"faces"``; ``"mesh"`` of an object that is no mesh.
    index : int or None
        First bad row, where the fault has a place.
    """

    def __init__(self, array: str, problem: str, remedy: str, index: int | None = None) -> None:
        self.array = array
        self.index = index
        where = array if index is None else f"{array}[{index}]"
        super().__init__(f"{where} {problem}; {remedy}")


class InvalidParameter(SpecsmoothError, ValueError):  # noqa: N818
    """A parameter outside what the method allows."""


class NotAMesh(InvalidSurface, InvalidParameter):
    """An object that is no mesh of any kind, where one is wanted."""


class NotConverged(SpecsmoothError, ArithmeticError):  # noqa: N818
    """An iteration that ended before it reached its tolerance."""


class FilterFailed(SpecsmoothError, RuntimeError):  # noqa: N818
    """A filter, given as a function, that raised something or returned what is no set of vertices."""


class TooLarge(SpecsmoothError, MemoryError):  # noqa: N818
    """Work that would not fit in memory, refused before it starts."""


class MeshSetError(SpecsmoothError, RuntimeError):
    """A MeshSet that cannot be smoothed, or that did not take its new coordinates."""


class FileError(SpecsmoothError, OSError):
    """A mesh file that cannot be read or written."""


class ClusterError(SpecsmoothError, ConnectionError):
    """A cluster that cannot be reached, or is lost."""


class NoDisplay(SpecsmoothError, RuntimeError):  # noqa: N818
    """There is no display to open a window on."""


class NoPython(SpecsmoothError, RuntimeError):  # noqa: N818
    """There is no Python that could be started: the program is frozen, or Python is embedded in another."""


class InvalidXml(SpecsmoothError, ValueError):  # noqa: N818
    """An XML file that is malformed or does not follow its grammar: file, line, reason."""

    def __init__(self, source: str, line: int, reason: str) -> None:
        self.source = source
        self.line = line
        super().__init__(f"{source}:{line}: {reason}")


class MissingExtra(SpecsmoothError, ImportError):  # noqa: N818
    """An optional dependency that is not installed."""

    def __init__(self, what: str, extra: str) -> None:
        super().__init__(f"{what} needs the extra '{extra}': pip install 'meshlab-specsmooth[{extra}]'")


class MissingLibrary(SpecsmoothError, ImportError):  # noqa: N818
    """A required library that is not installed, or that this system cannot load."""


def suggest(name: str, known: Iterable[str]) -> str:
    """What to add to the message about an unknown name: the known name that it is most like, or nothing.

    Examples
    --------
    >>> from meshlab_specsmooth.errors import suggest
    >>> suggest("barycenter_wieght", ["barycenter_weight", "boundary"])
    ' Did you mean barycenter_weight?'
    >>> suggest("color", ["barycenter_weight", "boundary"])
    ''
    """
    found = difflib.get_close_matches(name, list(known), n=1)
    return f" Did you mean {found[0]}?" if found else ""


class SmoothingWarning(UserWarning):
    """What the ``warning`` of a result says: what was left alone, could not be taken into account, or is doubtful."""


class Slow(UserWarning):
    """Work that would be much faster with something that is not installed."""

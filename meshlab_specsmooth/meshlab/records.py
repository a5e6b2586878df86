"""State kept for each MeshSet: what it prints, and which records of its filter script stand for our filters.

pymeshlab records every filter that runs, and a filter script can only be saved, cleared or loaded as a whole. Removing
the records of the helper filters after each call would therefore take longer with every call. Instead, a call leaves
these records in place and notes here which filter of ours they stand for (:class:`Placeholder`); the script is
corrected when it is next read. To that end the methods of ``pymeshlab.MeshSet`` that read the script, or set the
verbosity, are wrapped. The wrappers do nothing for a MeshSet that none of our filters has run on.
"""

from __future__ import annotations

import functools
import weakref
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import pymeshlab


class Verbosity(NamedTuple):
    """What a MeshSet prints about the filters that it runs."""

    everything: bool
    parameters: bool


@dataclass(frozen=True)
class Placeholder:
    """A run of records that stands for one step of the filter script.

    Attributes
    ----------
    mesh : int
        Id of the temporary mesh, which no later mesh has. The records are the last ones that name it and those that
        follow, up to and including its deletion.
    preceding : int
        Number of records before these that belong to them as well.
    step : str
        XML of one of our filters, or empty.
    """

    mesh: int
    preceding: int = 0
    step: str = ""


@dataclass
class State:
    """State kept for a MeshSet; the verbosity is None while it is unknown."""

    verbosity: Verbosity | None = None
    placeholders: list[Placeholder] = field(default_factory=list)


_states: weakref.WeakKeyDictionary[pymeshlab.MeshSet, State] = weakref.WeakKeyDictionary()


def state_of(ms: pymeshlab.MeshSet) -> State:
    """Return the mutable state of a MeshSet."""
    return _states.setdefault(ms, State())


def wrap_methods(resolve_placeholders: Callable[[pymeshlab.MeshSet], None]) -> None:
    """Wrap the methods of ``pymeshlab.MeshSet``; those that read the script call ``resolve_placeholders`` first."""

    def forget(_: Any, known: State, *__: Any, **___: Any) -> None:
        known.placeholders.clear()

    def set_everything(_: Any, known: State, verbosity: bool) -> None:
        if known.verbosity is not None:
            known.verbosity = known.verbosity._replace(everything=bool(verbosity))

    def set_parameters(_: Any, known: State, verbosity: bool) -> None:
        if known.verbosity is not None:
            known.verbosity = known.verbosity._replace(parameters=bool(verbosity))

    # clear() as well: mesh ids start again after it
    for name in ("save_filter_script", "print_filter_script", "apply_filter_script", "clear"):
        _wrap(name, lambda ms, *_, **__: resolve_placeholders(ms))
    for name in ("load_filter_script", "clear_filter_script"):
        _wrap(name, forget)
    _wrap("set_verbosity", set_everything)
    _wrap("set_parameter_verbosity", set_parameters)


def _wrap(name: str, before: Callable[..., None]) -> None:
    """Call ``before`` ahead of a method of ``pymeshlab.MeshSet``, for MeshSets that have a state."""
    native = getattr(pymeshlab.MeshSet, name)

    @functools.wraps(native)
    def method(self: Any, *arguments: Any, **named: Any) -> Any:
        known = _states.get(self)
        if known is not None:
            before(self, known, *arguments, **named)
        return native(self, *arguments, **named)

    setattr(pymeshlab.MeshSet, name, method)

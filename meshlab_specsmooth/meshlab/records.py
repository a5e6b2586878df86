"""What a MeshSet cannot be asked, kept beside it: what it prints, and which records of its filter script are ours.

pymeshlab records every filter that runs, and only a whole script can be saved, cleared or loaded: to leave no trace of
the filters that write coordinates, and to record one of ours, took longer with every call. So a call leaves their
records where they are, and what they stand for is noted here; the script is put right when somebody looks at it. For
that the methods of ``pymeshlab.MeshSet`` that look at it are wrapped, and those that set what is printed. A MeshSet
that none of our filters was run on is as it was.
"""

from __future__ import annotations

import functools
import weakref
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple
from xml.parsers import expat

import pymeshlab

_DELETION = "Delete Current Mesh"
_MATRIX = "Matrix: Set/Copy Transformation"


class Verbosity(NamedTuple):
    """What a MeshSet prints of the filters that it runs."""

    everything: bool
    parameters: bool


@dataclass(frozen=True)
class Stand:
    """Records that stand for a step.

    Attributes
    ----------
    mesh : int
        Id of the temporary mesh: the records are the last that name it, and what follows up to its deletion. Afterwards
        no mesh has this id.
    ahead : int
        So many records before these belong to them.
    step : str
        XML of a filter of ours, or nothing.
    """

    mesh: int
    ahead: int = 0
    step: str = ""


@dataclass
class Kept:
    """What is known of a MeshSet; its verbosity is None where it is not known."""

    verbosity: Verbosity | None = None
    stands: list[Stand] = field(default_factory=list)


class _Record(NamedTuple):
    """A filter of a script: its XML, its name, and the ids of the meshes that it names."""

    text: str
    name: str
    meshes: frozenset[int]


_kept: weakref.WeakKeyDictionary[pymeshlab.MeshSet, Kept] = weakref.WeakKeyDictionary()


def kept(ms: pymeshlab.MeshSet) -> Kept:
    """What is known of a MeshSet, to be changed."""
    return _kept.setdefault(ms, Kept())


def put_right(script: str, stands: Sequence[Stand]) -> str:
    """A script with steps in place of the records that stand for them.

    Examples
    --------
    >>> from meshlab_specsmooth.meshlab.records import Stand, put_right
    >>> morph = '<filter name="Vertex Linear Morphing"><Param name="TargetMesh" type="RichMesh" value="3"/></filter>'
    >>> script = f'<FilterScript>{morph}<filter name="Delete Current Mesh"/><filter name="Other"/></FilterScript>'
    >>> put_right(script, [Stand(3, step='<filter name="Ours"/>')])
    '<FilterScript><filter name="Ours"/><filter name="Other"/></FilterScript>'
    """
    start, records, end = _parts(script)
    texts = [record.text for record in records]
    last = {mesh: number for number, record in enumerate(records) for mesh in record.meshes}
    for stand in stands:
        first = deletion = last[stand.mesh] + 1
        while first and stand.mesh in records[first - 1].meshes:
            first -= 1
        first -= stand.ahead
        while records[deletion].name != _DELETION:
            deletion += 1
        texts[first : deletion + 1] = [stand.step, *[""] * (deletion - first)]
    return start + "".join(texts) + end


def without_last(script: str, stands: Sequence[Stand]) -> str:
    """A script without what was recorded last, by a call that failed: records that name temporary meshes, or theirs."""
    start, records, end = _parts(script)
    meshes = {stand.mesh for stand in stands}
    deletions, matrices = len(stands), sum(2 * stand.ahead for stand in stands)
    while records:
        record = records[-1]
        if record.name == _DELETION and deletions:
            deletions -= 1
        elif record.name == _MATRIX and matrices:
            matrices -= 1
        elif not record.meshes & meshes:
            break
        records.pop()
    return start + "".join(record.text for record in records) + end


def _parts(script: str) -> tuple[str, list[_Record], str]:
    """What stands before the filters, these, and what stands after them."""
    data = script.replace("<FilterScript/>", "<FilterScript></FilterScript>").encode()
    records: list[_Record] = []
    ends = [data.index(b"<FilterScript>") + len(b"<FilterScript>")]
    name, meshes = "", set[int]()
    parser = expat.ParserCreate()

    def begin(tag: str, attributes: dict[str, str]) -> None:
        nonlocal name
        if tag == "filter":
            name = attributes["name"]
            meshes.clear()
        elif attributes.get("type") == "RichMesh":
            meshes.add(int(attributes["value"]))

    def finish(tag: str) -> None:
        if tag == "filter":
            at = parser.CurrentByteIndex
            # of an element without content this is behind it
            end = at + len(b"</filter>") if data.startswith(b"</filter>", at) else at
            records.append(_Record(data[ends[-1] : end].decode(), name, frozenset(meshes)))
            ends.append(end)

    parser.StartElementHandler, parser.EndElementHandler = begin, finish
    parser.Parse(data, True)
    return data[: ends[0]].decode(), records, data[ends[-1] :].decode()


def _wrap(name: str, before: Callable[..., None]) -> None:
    """Have something done before a method of ``pymeshlab.MeshSet``, for MeshSets that something is known of."""
    native = getattr(pymeshlab.MeshSet, name)

    @functools.wraps(native)
    def method(self: Any, *arguments: Any, **named: Any) -> Any:
        known = _kept.get(self)
        if known is not None:
            before(self, known, *arguments, **named)
        return native(self, *arguments, **named)

    setattr(pymeshlab.MeshSet, name, method)


def wrap(put_script_right: Callable[[pymeshlab.MeshSet], None]) -> None:
    """Wrap the methods; ``put_script_right`` is done before any of them that looks at the script."""

    def forget(_: Any, known: Kept, *__: Any, **___: Any) -> None:
        known.stands.clear()

    def set_everything(_: Any, known: Kept, verbosity: bool) -> None:
        if known.verbosity is not None:
            known.verbosity = known.verbosity._replace(everything=bool(verbosity))

    def set_parameters(_: Any, known: Kept, verbosity: bool) -> None:
        if known.verbosity is not None:
            known.verbosity = known.verbosity._replace(parameters=bool(verbosity))

    # after MeshSet.clear() ids may come again
    for name in ("save_filter_script", "print_filter_script", "apply_filter_script", "clear"):
        _wrap(name, lambda ms, *_, **__: put_script_right(ms))
    for name in ("load_filter_script", "clear_filter_script"):
        _wrap(name, forget)
    _wrap("set_verbosity", set_everything)
    _wrap("set_parameter_verbosity", set_parameters)

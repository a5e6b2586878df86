"""Edit the text of filter scripts: replace, remove and append records."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple
from xml.parsers import expat

from meshlab_specsmooth.meshlab.records import Placeholder

_DELETION = "Delete Current Mesh"
_MATRIX = "Matrix: Set/Copy Transformation"


class _Record(NamedTuple):
    """A filter of a script: its XML, its name, and the ids of the meshes that it names."""

    text: str
    name: str
    meshes: frozenset[int]


def substitute_steps(script: str, placeholders: Sequence[Placeholder]) -> str:
    """Replace the records of each placeholder by its step.

    Examples
    --------
    >>> from meshlab_specsmooth.meshlab.filter_script_text import substitute_steps
    >>> from meshlab_specsmooth.meshlab.records import Placeholder
    >>> morph = '<filter name="Vertex Linear Morphing"><Param name="TargetMesh" type="RichMesh" value="3"/></filter>'
    >>> script = f'<FilterScript>{morph}<filter name="Delete Current Mesh"/><filter name="Other"/></FilterScript>'
    >>> substitute_steps(script, [Placeholder(3, step='<filter name="Ours"/>')])
    '<FilterScript><filter name="Ours"/><filter name="Other"/></FilterScript>'
    """
    head, records, tail = _split(script)
    texts = [record.text for record in records]
    last = {mesh: number for number, record in enumerate(records) for mesh in record.meshes}
    for placeholder in placeholders:
        first = deletion = last[placeholder.mesh] + 1
        while first and placeholder.mesh in records[first - 1].meshes:
            first -= 1
        first -= placeholder.preceding
        while records[deletion].name != _DELETION:
            deletion += 1
        texts[first : deletion + 1] = [placeholder.step, *[""] * (deletion - first)]
    return head + "".join(texts) + tail


def remove_last(script: str, placeholders: Sequence[Placeholder]) -> str:
    """Remove the records at the end of a script that a failed call has left for these placeholders."""
    head, records, tail = _split(script)
    meshes = {placeholder.mesh for placeholder in placeholders}
    deletions, matrices = len(placeholders), sum(2 * placeholder.preceding for placeholder in placeholders)
    while records:
        record = records[-1]
        if record.name == _DELETION and deletions:
            deletions -= 1
        elif record.name == _MATRIX and matrices:
            matrices -= 1
        elif not record.meshes & meshes:
            break
        records.pop()
    return head + "".join(record.text for record in records) + tail


def append_step(script: str, step: str) -> str:
    """Append the XML of a filter to a script."""
    # edited as text: the script of a session may exceed the size that is allowed for untrusted files
    head, end, tail = _with_end_tag(script).rpartition("</FilterScript>")
    return head + step + end + tail


def _with_end_tag(script: str) -> str:
    return script.replace("<FilterScript/>", "<FilterScript></FilterScript>")


def _split(script: str) -> tuple[str, list[_Record], str]:
    """Split a script into the text before its filters, the filters, and the text after them."""
    data = _with_end_tag(script).encode()
    records: list[_Record] = []
    ends = [data.index(b"<FilterScript>") + len(b"<FilterScript>")]
    name, meshes = "", set[int]()
    parser = expat.ParserCreate()

    def start(tag: str, attributes: dict[str, str]) -> None:
        nonlocal name
        if tag == "filter":
            name = attributes["name"]
            meshes.clear()
        elif attributes.get("type") == "RichMesh":
            meshes.add(int(attributes["value"]))

    def finish(tag: str) -> None:
        if tag == "filter":
            at = parser.CurrentByteIndex
            # for an empty-element tag, expat's index is already past the element
            end = at + len(b"</filter>") if data.startswith(b"</filter>", at) else at
            records.append(_Record(data[ends[-1] : end].decode(), name, frozenset(meshes)))
            ends.append(end)

    parser.StartElementHandler, parser.EndElementHandler = start, finish
    parser.Parse(data, True)
    return data[: ends[0]].decode(), records, data[ends[-1] :].decode()

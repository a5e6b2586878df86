"""Filter scripts (.mlx): recording our filters, and replaying scripts that mix them with MeshLab's.

MeshLab's own filters are stored and run by pymeshlab. Ours stand between them as filters of their display name whose
parameters are text, so that no digit is lost; pymeshlab keeps and saves what it does not know, and only fails when it
is asked to run it, which is done here instead.
"""

from __future__ import annotations

import difflib
import itertools
import os
import re
import subprocess
import sys
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from xml.sax.saxutils import quoteattr

import pymeshlab

from meshlab_specsmooth import descriptors
from meshlab_specsmooth.bridge.meshset import leaving_no_trace, native_output_dropped
from meshlab_specsmooth.descriptors import Descriptor, Parameter
from meshlab_specsmooth.errors import FileError
from meshlab_specsmooth.xmltree import Element, InvalidXml, parse

# pymeshlab's own, whatever is registered later
_NATIVE_APPLY = pymeshlab.MeshSet.apply_filter_script
_NATIVE_LOAD = pymeshlab.MeshSet.load_filter_script

Filters = dict[str, Callable[..., dict[str, Any]]]


@dataclass(frozen=True)
class Step:
    """One filter of a script: display name, attributes of each parameter, and the line it stands on."""

    name: str
    parameters: tuple[dict[str, str], ...]
    line: int


@dataclass(frozen=True)
class Script:
    """A filter script and where it came from."""

    source: str
    steps: tuple[Step, ...]


def read(path: str | os.PathLike[str]) -> Script:
    """The script in a file.

    Raises
    ------
    FileError
        There is no such file.
    InvalidXml
        Malformed: file, line, reason.
    """
    try:
        data = Path(path).read_bytes()
    except OSError as error:
        raise FileError(f"{path}: cannot be read: {error.strerror}") from error
    return _script(data, str(path))


def of(ms: pymeshlab.MeshSet) -> Script:
    """The filter script of a MeshSet."""
    with tempfile.TemporaryDirectory(prefix="specsmooth-") as folder:
        path = Path(folder) / "script.mlx"
        ms.save_filter_script(str(path))
        return _script(path.read_bytes(), "the MeshSet's filter script")


def record(ms: pymeshlab.MeshSet, descriptor: Descriptor, values: dict[str, Any]) -> None:
    """Append one of our filters, with all its values, to a MeshSet's filter script."""
    parameters = tuple(
        {
            "name": parameter.name,
            "value": _as_text(values[parameter.name]),
            "type": "RichString",
            "description": parameter.label,
            "tooltip": parameter.help,
        }
        for parameter in descriptor.parameters
    )
    _load(ms, [*of(ms).steps, Step(descriptor.name, parameters, 0)])


def check(script: Script) -> None:
    """Refuse a script that could not run to its end for what it says; raises :class:`InvalidXml`."""
    ours = {descriptor.name: descriptor for descriptor in map(descriptors.load, descriptors.names())}
    for step in script.steps:
        if step.name in ours:
            _values(step, ours[step.name], script.source)
        elif not _is_native(step.name):
            known = [*ours, *(name.replace("_", " ").title() for name in _former_names())]
            nearest = difflib.get_close_matches(step.name, known, n=1, cutoff=0.0)[0]
            raise InvalidXml(
                script.source, step.line, f"no filter is called {step.name!r}; the nearest known name is {nearest!r}"
            )


def run(ms: pymeshlab.MeshSet, script: Script, filters: Filters) -> None:
    """Run a script, ours and MeshLab's, without recording it anew; nothing runs unless :func:`check` has passed."""
    check(script)
    ours = {descriptor.name: descriptor for descriptor in map(descriptors.load, descriptors.names())}
    for is_ours, group in itertools.groupby(script.steps, key=lambda step: step.name in ours):
        with leaving_no_trace(ms):
            if is_ours:
                for step in group:
                    descriptor = ours[step.name]
                    filters[descriptor.function](ms, **_values(step, descriptor, script.source))
            else:
                _load(ms, list(group))
                _NATIVE_APPLY(ms)


def has_ours(script: Script) -> bool:
    """Whether a script needs this package to run."""
    return not {descriptors.load(name).name for name in descriptors.names()}.isdisjoint(s.name for s in script.steps)


def _script(data: bytes, source: str) -> Script:
    root = parse(data, source)
    if root.tag != "FilterScript":
        raise InvalidXml(source, root.line, f"expected <FilterScript>, found <{root.tag}>")
    return Script(source, tuple(_step(element, source) for element in root.children))


def _step(element: Element, source: str) -> Step:
    if element.tag not in ("filter", "xmlfilter") or "name" not in element.attributes:
        raise InvalidXml(source, element.line, f'expected <filter name="...">, found <{element.tag}>')
    for child in element.children:
        if child.tag not in ("Param", "xmlparam") or "name" not in child.attributes:
            raise InvalidXml(source, child.line, f'expected <Param name="...">, found <{child.tag}>')
    return Step(element.attributes["name"], tuple(child.attributes for child in element.children), element.line)


def _values(step: Step, descriptor: Descriptor, source: str) -> dict[str, Any]:
    """Keyword arguments of one of our filters from the text of a script."""
    values: dict[str, Any] = {}
    known = {parameter.name: parameter for parameter in descriptor.parameters}
    for attributes in step.parameters:
        name, text = attributes["name"], attributes.get("value", "")
        if name not in known:
            raise InvalidXml(source, step.line, f"filter {step.name!r} has no parameter {name!r}")
        try:
            values[name] = _from_text(known[name], text)
        except ValueError as error:
            reason = f"{name} of filter {step.name!r} is {text!r}, which is no {known[name].type}"
            raise InvalidXml(source, step.line, reason) from error
    return values


def _as_text(value: Any) -> str:
    return str(value).lower() if isinstance(value, bool) else str(value)


def _from_text(parameter: Parameter, text: str) -> Any:
    if parameter.type == "bool":
        if text not in ("true", "false"):
            raise ValueError(text)
        return text == "true"
    if parameter.type == "enum":
        if text not in parameter.values:
            raise ValueError(text)
        return text
    number = int(text) if parameter.type == "int" else float(text)
    if not parameter.minimum <= number <= parameter.maximum:
        raise ValueError(text)
    return number


def _load(ms: pymeshlab.MeshSet, steps: Sequence[Step]) -> None:
    """Make these steps the MeshSet's filter script."""
    with tempfile.TemporaryDirectory(prefix="specsmooth-") as folder:
        path = Path(folder) / "script.mlx"
        path.write_text(_as_script(steps), encoding="utf-8")
        ms.clear_filter_script()
        with native_output_dropped():  # pymeshlab prints what it reads, verbose or not
            _NATIVE_LOAD(ms, str(path))


def _as_script(steps: Sequence[Step]) -> str:
    return "<!DOCTYPE FilterScript>\n<FilterScript>\n" + "".join(map(_as_xml, steps)) + "</FilterScript>\n"


def _as_xml(step: Step) -> str:
    lines = [f" <filter name={quoteattr(step.name)}>"]
    for parameter in step.parameters:
        attributes = " ".join(f"{name}={quoteattr(text)}" for name, text in parameter.items())
        lines += [f"  <Param {attributes}/>"]
    return "\n".join([*lines, " </filter>\n"])


def _former_names() -> dict[str, str]:
    """Names made from MeshLab's display names, and pymeshlab's of today: a table that comes with pymeshlab."""
    table = Path(pymeshlab.__file__).parent / "keys.txt"
    pairs = (line.split() for line in table.read_text(encoding="utf-8").splitlines() if line.strip())
    today = set(pymeshlab.filter_list())
    return {former: name for former, name in pairs if name in today}


def _is_native(name: str) -> bool:
    """Whether pymeshlab has a filter of that display name."""

    def letters(text: str) -> str:
        return re.sub(r"[^a-z0-9]", "", text.lower())

    if letters(name) in {letters(former) for former in _former_names()}:
        return True
    # The table is older than some filters. pymeshlab cannot be asked for display names, but when it is to run an
    # unknown one, and only then, it says that something really bad happened. That is tried on an empty MeshSet in a
    # process of its own, as some filters crash there.
    with tempfile.TemporaryDirectory(prefix="specsmooth-") as folder:
        (Path(folder) / "script.mlx").write_text(_as_script([Step(name, (), 0)]), encoding="utf-8")
        command = [sys.executable, "-c", _TRY]
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)  # noqa: S603
    return "UNKNOWN" not in done.stdout


_TRY = """
import pymeshlab
ms = pymeshlab.MeshSet()
ms.load_filter_script("script.mlx")
try:
    ms.apply_filter_script()
except pymeshlab.PyMeshLabException as error:
    if "Something really bad happened" in str(error):
        print("UNKNOWN")
"""

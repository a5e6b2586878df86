"""Filter scripts (.mlx): recording our filters, and replaying scripts that mix them with MeshLab's.

MeshLab's own filters are stored and run by pymeshlab. Ours stand between them as filters of their display name whose
parameters are text, so that no digit is lost; pymeshlab keeps and saves what it does not know, and only fails when it
is asked to run it, which is done here instead.
"""

from __future__ import annotations

import contextlib
import difflib
import functools
import importlib.resources
import itertools
import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any
from xml.sax.saxutils import quoteattr

import pymeshlab

from meshlab_specsmooth.errors import FileError, InvalidXml
from meshlab_specsmooth.isolation import processes
from meshlab_specsmooth.isolation.worker import Worker, WorkerFailed, serve
from meshlab_specsmooth.meshlab import descriptors
from meshlab_specsmooth.meshlab.descriptors import Descriptor, Parameter
from meshlab_specsmooth.meshlab.meshset import keeping_script, script_of, set_script
from meshlab_specsmooth.meshlab.xmltree import Element, parse
from meshlab_specsmooth.runtime import temporary
from meshlab_specsmooth.runtime.interrupts import Hold

# pymeshlab's own, whatever is registered later
_NATIVE_APPLY, _NATIVE_LOAD = pymeshlab.MeshSet.apply_filter_script, pymeshlab.MeshSet.load_filter_script

# the type of all parameters of ours: pymeshlab keeps six digits of a number, and all of a text
_TEXT = "RichString"

Filters = Mapping[str, Callable[..., dict[str, Any]]]


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
    return _script(script_of(ms).encode(), "the MeshSet's filter script")


def step_of(descriptor: Descriptor, values: dict[str, Any]) -> str:
    """XML of one of our filters, with all its values."""
    parameters = tuple(
        {
            "name": parameter.name,
            "value": _as_text(values[parameter.name]),
            "type": _TEXT,
            "description": parameter.label,
            "tooltip": parameter.help,
        }
        for parameter in descriptor.parameters
    )
    return _as_xml(Step(descriptor.name, parameters, 0))


def check(script: Script) -> None:
    """Refuse a script that could not run to its end for what it says; raises :class:`InvalidXml`."""
    ours = _ours()
    for step in script.steps:
        if step.name in ours:
            _values(step, ours[step.name], script.source)
    native = dict.fromkeys(step.name for step in script.steps if step.name not in ours)
    unknown = _unknown(tuple(native))
    for step in script.steps:
        if step.name in unknown and step.name in pymeshlab.filter_list():
            raise InvalidXml(
                script.source,
                step.line,
                f"{step.name!r} is what pymeshlab calls a filter; a script has MeshLab's own names, of filters and of "
                f"parameters: write {_display_name(step.name)!r}, or save the script with save_filter_script",
            )
        if step.name in unknown:
            known = [*ours, *_former_names()]
            nearest = difflib.get_close_matches(step.name, known, n=1, cutoff=0.0)[0]
            raise InvalidXml(
                script.source, step.line, f"no filter is called {step.name!r}; the nearest known name is {nearest!r}"
            )


def load(ms: pymeshlab.MeshSet, script: Script) -> None:
    """Make a script that was read the MeshSet's own; ours keep their values whatever types the file gave them."""
    ours = _ours()
    steps = []
    for step in script.steps:
        if step.name in ours:
            _values(step, ours[step.name], script.source)
            step = Step(step.name, tuple(p | {"type": _TEXT} for p in step.parameters), step.line)
        steps.append(step)
    set_script(ms, _as_script(steps))


def run(ms: pymeshlab.MeshSet, script: Script, filters: Filters) -> None:
    """Run a script, ours and MeshLab's, without recording it anew; nothing runs unless :func:`check` has passed."""
    check(script)
    ours = _ours()
    with Hold() as hold, keeping_script(ms):
        for is_ours, group in itertools.groupby(script.steps, key=lambda step: step.name in ours):
            if is_ours:
                for step in group:
                    descriptor = ours[step.name]
                    with hold.through():
                        filters[descriptor.function](ms, **_values(step, descriptor, script.source))
            else:
                set_script(ms, _as_script(list(group)))
                hold.deliver()
                _NATIVE_APPLY(ms)
                hold.deliver()


def has_ours(script: Script) -> bool:
    """Whether a script needs this package to run."""
    return not _ours().keys().isdisjoint(step.name for step in script.steps)


def _ours() -> dict[str, Descriptor]:
    """Our descriptors by display name."""
    return {descriptor.name: descriptor for descriptor in map(descriptors.load, descriptors.names())}


def _script(data: bytes, source: str) -> Script:
    root = parse(data, source)
    if root.tag != "FilterScript":
        raise InvalidXml(source, root.line, f"expected <FilterScript>, found <{root.tag}>")
    steps = [_step(element, source) for element in root.children]
    # ours by their Python names as well: with these the parameters are the same
    functions = {descriptor.function: name for name, descriptor in _ours().items()}
    return Script(source, tuple(replace(step, name=functions.get(step.name, step.name)) for step in steps))


def _step(element: Element, source: str) -> Step:
    if element.tag != "filter" or "name" not in element.attributes:
        raise InvalidXml(source, element.line, f'expected <filter name="...">, found <{element.tag}>')
    for child in element.children:
        if child.tag != "Param" or "name" not in child.attributes:
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
        if name in values:
            raise InvalidXml(source, step.line, f"filter {step.name!r} has {name!r} twice")
        try:
            values[name] = _from_text(known[name], text)
        except ValueError as error:
            reason = f"{name} of filter {step.name!r} is {text!r}, which is no {known[name].type}"
            raise InvalidXml(source, step.line, reason) from error
    if values.get("modes") and values.get("wavelength"):
        raise InvalidXml(source, step.line, f"filter {step.name!r} has both modes and a wavelength; give one of them")
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
    if not parameter.allows(number):
        raise ValueError(text)
    return number


def _as_script(steps: Sequence[Step]) -> str:
    return text_of(map(_as_xml, steps))


def text_of(steps: Iterable[str]) -> str:
    """A filter script, from the XML of its filters."""
    return "<!DOCTYPE FilterScript>\n<FilterScript>\n" + "".join(steps) + "</FilterScript>\n"


def _as_xml(step: Step) -> str:
    lines = [f" <filter name={quoteattr(step.name)}>"]
    for parameter in step.parameters:
        attributes = " ".join(f"{name}={quoteattr(text)}" for name, text in parameter.items())
        lines += [f"  <Param {attributes}/>"]
    return "\n".join([*lines, " </filter>\n"])


def _display_name(function: str) -> str:
    """About what MeshLab calls a filter that pymeshlab calls so."""
    return next((name for name, called in _table() if called == function), function.replace("_", " ").title())


def _former_names() -> list[str]:
    """About what MeshLab's filters are called."""
    return [name for name, _ in _table()]


def _table() -> list[tuple[str, str]]:
    """Pairs of what MeshLab, about, and pymeshlab call a filter: pymeshlab has names made from display names."""
    table = importlib.resources.files("pymeshlab") / "keys.txt"
    pairs = [line.split() for line in table.read_text(encoding="utf-8").splitlines() if line.strip()]
    return [(pair[0].replace("_", " ").title(), pair[-1]) for pair in pairs]


@functools.lru_cache(maxsize=64)
def _unknown(names: tuple[str, ...]) -> frozenset[str]:
    """Those of the display names that pymeshlab has no filter of.

    pymeshlab has no query for that, but raises an error with a distinctive text when it is to run an unknown filter.
    This is tried on empty MeshSets in another process, as some filters crash there; one that crashes is known.
    """
    unknown: set[str] = set()
    if not names:
        return frozenset()
    with Hold() as hold, temporary.folder() as folder, Worker(processes.command(serve_scripts)) as worker:
        path = folder / "filter.mlx"
        for name in names:
            path.write_text(_as_script([Step(name, (), 0)]), encoding="utf-8")
            with hold.through(), contextlib.suppress(WorkerFailed):
                if not worker.ask(str(path)):
                    unknown.add(name)
    return frozenset(unknown)


def serve_scripts() -> None:
    """Report, for each script of one filter, whether pymeshlab knows the filter."""
    serve(_is_known)


def _is_known(path: str) -> bool:
    ms = pymeshlab.MeshSet()
    _NATIVE_LOAD(ms, path)
    try:
        _NATIVE_APPLY(ms)
    except pymeshlab.PyMeshLabException as error:
        return "Something really bad happened" not in str(error)
    return True

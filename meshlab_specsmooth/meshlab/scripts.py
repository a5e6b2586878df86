"""Filter scripts (.mlx): record our filters, and run scripts that mix them with MeshLab's.

MeshLab's own filters are stored and run by pymeshlab. Ours are stored among them under their display name, with all
parameters as text, so that no digit is lost. pymeshlab stores and saves filters that it does not know, and only fails
when it has to run them, so they are run here.
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
from meshlab_specsmooth.meshlab.filter_script import get_script, preserve_script, set_script
from meshlab_specsmooth.meshlab.xmltree import Element, parse
from meshlab_specsmooth.runtime import temporary
from meshlab_specsmooth.runtime.interrupts import DeferInterrupts

# pymeshlab's own methods, bound before register() replaces them
_NATIVE_APPLY, _NATIVE_LOAD = pymeshlab.MeshSet.apply_filter_script, pymeshlab.MeshSet.load_filter_script

# Type of all parameters of our filters: pymeshlab keeps only six digits of a number, but all of a text
_TEXT = "RichString"

Filters = Mapping[str, Callable[..., dict[str, Any]]]


@dataclass(frozen=True)
class Step:
    """One filter of a script: display name, attributes of each parameter, and its line."""

    name: str
    parameters: tuple[dict[str, str], ...]
    line: int


@dataclass(frozen=True)
class Script:
    """A filter script and its source, for error messages."""

    source: str
    steps: tuple[Step, ...]


def read(path: str | os.PathLike[str]) -> Script:
    """Read a script from a file.

    Raises
    ------
    FileError
        The file cannot be read.
    InvalidXml
        It is malformed; the message names file, line and reason.
    """
    try:
        data = Path(path).read_bytes()
    except OSError as error:
        raise FileError(f"{path}: cannot be read: {error.strerror}") from error
    return _parse_script(data, str(path))


def script_of(ms: pymeshlab.MeshSet) -> Script:
    """Return the filter script of a MeshSet."""
    return _parse_script(get_script(ms).encode(), "the MeshSet's filter script")


def format_step(descriptor: Descriptor, values: dict[str, Any]) -> str:
    """Format a call of one of our filters, with the values of all parameters, as XML."""
    parameters = tuple(
        {
            "name": parameter.name,
            "value": _format_value(values[parameter.name]),
            "type": _TEXT,
            "description": parameter.label,
            "tooltip": parameter.help,
        }
        for parameter in descriptor.parameters
    )
    return _format_xml(Step(descriptor.name, parameters, 0))


def check(script: Script) -> None:
    """Refuse a script with unknown filters or invalid parameters of ours; raises :class:`InvalidXml`."""
    ours = _ours()
    for step in script.steps:
        if step.name in ours:
            _parse_values(step, ours[step.name], script.source)
    native = dict.fromkeys(step.name for step in script.steps if step.name not in ours)
    unknown = _find_unknown(tuple(native))
    for step in script.steps:
        if step.name in unknown and step.name in pymeshlab.filter_list():
            raise InvalidXml(
                script.source,
                step.line,
                f"{step.name!r} is a name of pymeshlab's; scripts contain MeshLab's names of filters and parameters: "
                f"write {_display_name(step.name)!r}, or save the script with save_filter_script",
            )
        if step.name in unknown:
            known = [*ours, *_display_names()]
            nearest = difflib.get_close_matches(step.name, known, n=1, cutoff=0.0)[0]
            raise InvalidXml(
                script.source, step.line, f"no filter is called {step.name!r}; the nearest known name is {nearest!r}"
            )


def load(ms: pymeshlab.MeshSet, script: Script) -> None:
    """Make a script the filter script of a MeshSet; values of our filters are stored as text, whatever their type."""
    ours = _ours()
    steps = []
    for step in script.steps:
        if step.name in ours:
            _parse_values(step, ours[step.name], script.source)
            step = Step(step.name, tuple(p | {"type": _TEXT} for p in step.parameters), step.line)
        steps.append(step)
    set_script(ms, _format_steps(steps))


def run(ms: pymeshlab.MeshSet, script: Script, filters: Filters) -> None:
    """Check a script, then run its filters, ours and MeshLab's, without recording them again."""
    check(script)
    ours = _ours()
    with DeferInterrupts() as hold, preserve_script(ms):
        for is_ours, group in itertools.groupby(script.steps, key=lambda step: step.name in ours):
            if is_ours:
                for step in group:
                    descriptor = ours[step.name]
                    with hold.allow():
                        filters[descriptor.function](ms, **_parse_values(step, descriptor, script.source))
            else:
                set_script(ms, _format_steps(list(group)))
                hold.deliver()
                _NATIVE_APPLY(ms)
                hold.deliver()


def has_ours(script: Script) -> bool:
    """Whether a script contains filters of this package."""
    return not _ours().keys().isdisjoint(step.name for step in script.steps)


def _ours() -> dict[str, Descriptor]:
    """Return our descriptors by display name."""
    return {descriptor.name: descriptor for descriptor in map(descriptors.load, descriptors.names())}


def _parse_script(data: bytes, source: str) -> Script:
    root = parse(data, source)
    if root.tag != "FilterScript":
        raise InvalidXml(source, root.line, f"expected <FilterScript>, found <{root.tag}>")
    steps = [_parse_step(element, source) for element in root.children]
    # our filters may be given by their Python names as well
    functions = {descriptor.function: name for name, descriptor in _ours().items()}
    return Script(source, tuple(replace(step, name=functions.get(step.name, step.name)) for step in steps))


def _parse_step(element: Element, source: str) -> Step:
    if element.tag != "filter" or "name" not in element.attributes:
        raise InvalidXml(source, element.line, f'expected <filter name="...">, found <{element.tag}>')
    for child in element.children:
        if child.tag != "Param" or "name" not in child.attributes:
            raise InvalidXml(source, child.line, f'expected <Param name="...">, found <{child.tag}>')
    return Step(element.attributes["name"], tuple(child.attributes for child in element.children), element.line)


def _parse_values(step: Step, descriptor: Descriptor, source: str) -> dict[str, Any]:
    """Parse the keyword arguments of one of our filters."""
    values: dict[str, Any] = {}
    known = {parameter.name: parameter for parameter in descriptor.parameters}
    for attributes in step.parameters:
        name, text = attributes["name"], attributes.get("value", "")
        if name not in known:
            raise InvalidXml(source, step.line, f"filter {step.name!r} has no parameter {name!r}")
        if name in values:
            raise InvalidXml(source, step.line, f"filter {step.name!r} has {name!r} twice")
        try:
            values[name] = _parse_value(known[name], text)
        except ValueError as error:
            reason = f"{name} of filter {step.name!r} is {text!r}, which is not of type {known[name].type}"
            raise InvalidXml(source, step.line, reason) from error
    if values.get("modes") and values.get("wavelength"):
        raise InvalidXml(source, step.line, f"filter {step.name!r} has both modes and a wavelength; give one of them")
    return values


def _format_value(value: Any) -> str:
    return str(value).lower() if isinstance(value, bool) else str(value)


def _parse_value(parameter: Parameter, text: str) -> Any:
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


def _format_steps(steps: Sequence[Step]) -> str:
    return format_script(map(_format_xml, steps))


def format_script(steps: Iterable[str]) -> str:
    """Format a filter script from the XML of its filters."""
    return "<!DOCTYPE FilterScript>\n<FilterScript>\n" + "".join(steps) + "</FilterScript>\n"


def _format_xml(step: Step) -> str:
    lines = [f" <filter name={quoteattr(step.name)}>"]
    for parameter in step.parameters:
        attributes = " ".join(f"{name}={quoteattr(text)}" for name, text in parameter.items())
        lines += [f"  <Param {attributes}/>"]
    return "\n".join([*lines, " </filter>\n"])


def _display_name(function: str) -> str:
    """Return the approximate display name in MeshLab of a filter of pymeshlab's."""
    return next((name for name, called in _name_pairs() if called == function), function.replace("_", " ").title())


def _display_names() -> list[str]:
    """Return the approximate display names of MeshLab's filters."""
    return [name for name, _ in _name_pairs()]


def _name_pairs() -> list[tuple[str, str]]:
    """Return pairs of the approximate display name and pymeshlab's name of each filter, from a table in pymeshlab."""
    table = importlib.resources.files("pymeshlab") / "keys.txt"
    pairs = [line.split() for line in table.read_text(encoding="utf-8").splitlines() if line.strip()]
    return [(pair[0].replace("_", " ").title(), pair[-1]) for pair in pairs]


@functools.lru_cache(maxsize=64)
def _find_unknown(names: tuple[str, ...]) -> frozenset[str]:
    """Return the display names that pymeshlab does not know.

    pymeshlab has no query for that, but raises an error with a distinctive text when it is to run an unknown filter.
    This is tried on empty MeshSets in another process, as some filters crash there; one that crashes is known.
    """
    unknown: set[str] = set()
    if not names:
        return frozenset()
    with DeferInterrupts() as hold, temporary.folder() as folder, Worker(processes.command(serve_scripts)) as worker:
        path = folder / "filter.mlx"
        for name in names:
            path.write_text(_format_steps([Step(name, (), 0)]), encoding="utf-8")
            with hold.allow(), contextlib.suppress(WorkerFailed):
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

"""Parser of filter descriptors: XML in MeshLab's ``MESHLAB_FILTER_INTERFACE`` grammar."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable
from typing import NoReturn

from meshlab_specsmooth.errors import InvalidXml
from meshlab_specsmooth.meshlab.descriptors.model import AnySelected, Descriptor, Length, Parameter, Value
from meshlab_specsmooth.meshlab.xmltree import Element, parse


def read(data: bytes, source: str) -> Descriptor:
    """Parse the descriptor in an XML document.

    Raises
    ------
    InvalidXml
        The message names file, line and reason.
    """
    interface = parse(data, source)
    _expect(interface, source, "MESHLAB_FILTER_INTERFACE", ["mfiVersion"], ["PLUGIN"])
    if interface.attributes["mfiVersion"] != "2.0":
        _refuse(interface, source, f"mfiVersion is {interface.attributes['mfiVersion']!r}; only 2.0 is supported")
    plugin = interface.children[0]
    _expect(plugin, source, "PLUGIN", ["pluginName", "pluginAuthor", "pluginEmail"], ["FILTER"])
    return _parse_filter(plugin.children[0], source)


_FILTER_ATTRIBUTES = [
    "filterName",
    "filterFunction",
    "filterClass",
    "filterPre",
    "filterPost",
    "filterArity",
    "filterRasterArity",
    "filterIsInterruptible",
]


_DATA = ["NONE", "VERTCOORD", "VERTNORMAL", "VERTQUALITY", "VERTCOLOR", "VERTFLAGSELECT", "VERTNUMBER"]
_DATA += ["FACENORMAL", "FACEQUALITY", "FACECOLOR", "FACEFLAGSELECT", "FACENUMBER", "ALL"]
_COMPONENTS = [f"MM_{name}" for name in _DATA]
_CLASSES = ["Smoothing", "Measure", "Quality", "Normal", "Remeshing", "Cleaning", "Selection", "Sampling", "Generic"]
_FILTER_WORDS = {
    "filterClass": _CLASSES,
    "filterPre": _COMPONENTS,
    "filterPost": _COMPONENTS,
    "filterArity": ["SingleMesh", "Fixed", "Variable", "FunctionDefined"],
    "filterRasterArity": ["NoRaster", "SingleRaster", "Fixed", "Variable"],
    "filterIsInterruptible": ["true", "false"],
}


def _parse_filter(element: Element, source: str) -> Descriptor:
    parameters = [child for child in element.children if child.tag == "PARAM"]
    _expect(element, source, "FILTER", _FILTER_ATTRIBUTES, ["FILTER_HELP"] + ["PARAM"] * len(parameters))
    function = element.attributes["filterFunction"]
    if not function.isidentifier():
        _refuse(element, source, f"filterFunction {function!r} is not a Python name")
    read_parameters = []
    seen: set[str] = set()
    for child in parameters:
        parameter = _parse_parameter(child, source)
        if parameter.name in seen:
            _refuse(child, source, f"parameter {parameter.name!r} is described twice")
        seen.add(parameter.name)
        read_parameters.append(parameter)
    for name, known in _FILTER_WORDS.items():
        for word in element.attributes[name].split(" | "):
            if word not in known:
                _refuse(element, source, f"{name} has {word!r}, which is not one of {', '.join(known)}")
    _expect(element.children[0], source, "FILTER_HELP", [], [])
    return Descriptor(
        function,
        element.attributes["filterName"],
        element.attributes["filterClass"],
        element.children[0].text.strip(),
        tuple(read_parameters),
        "MM_FACENUMBER" in element.attributes["filterPre"].split(" | "),
    )


def _parse_parameter(element: Element, source: str) -> Parameter:
    if len(element.children) != 2:
        _refuse(element, source, "PARAM must contain one PARAM_HELP and one GUI element, in that order")
    help_element, gui = element.children
    attributes = ["parName", "parType", "parDefault", "parIsImportant", "parIsPersistent"]
    _expect(element, source, "PARAM", attributes, ["PARAM_HELP", gui.tag])
    name, kind = element.attributes["parName"], element.attributes["parType"]
    if not name.isidentifier():
        _refuse(element, source, f"parName {name!r} is not a Python name")
    for flag in ("parIsImportant", "parIsPersistent"):
        _parse_boolean(element, element.attributes[flag], source)
    _expect(help_element, source, "PARAM_HELP", [], [])
    bounded = gui.tag in ("SLIDER_GUI", "ABSPERC_GUI")
    _expect(gui, source, gui.tag, ["guiLabel", "guiMin", "guiMax"] if bounded else ["guiLabel"], [])
    if kind.startswith("Enum"):
        type_, values = "enum", _parse_enum(element, kind, source)
    else:
        type_, values = {("Real", "ABSPERC_GUI"): "length"}.get((kind, gui.tag), _TYPES.get(kind, "")), ()
    if gui.tag not in _GUIS.get(type_, ()):
        _refuse(element, source, f"parType {kind!r} does not go with {gui.tag}")
    minimum, maximum = -math.inf, math.inf
    if type_ == "length":
        # the upper end of MeshLab's slider is no bound: wavelengths longer than the mesh are valid
        minimum = _parse_real(gui, gui.attributes["guiMin"], source)
        _parse_length(gui, gui.attributes["guiMax"], source)
    elif bounded:
        minimum, maximum = (_parse_real(gui, gui.attributes[key], source) for key in ("guiMin", "guiMax"))
    default = _parse_default(element, type_, values, source)
    if isinstance(default, int | float) and not minimum <= default <= maximum:
        _refuse(element, source, f"parDefault {default} lies outside [{minimum:g}, {maximum:g}]")
    return Parameter(
        name,
        type_,
        default,
        gui.attributes["guiLabel"],
        help_element.text.strip(),
        minimum,
        maximum,
        values,
    )


_TYPES = {"Boolean": "bool", "Int": "int", "Real": "float"}
_GUIS = {
    "bool": ("CHECKBOX_GUI",),
    "int": ("EDIT_GUI", "SLIDER_GUI"),
    "float": ("EDIT_GUI", "SLIDER_GUI"),
    "length": ("ABSPERC_GUI",),
    "enum": ("ENUM_GUI",),
}
# The only two expressions that are recognized; nothing is evaluated
_ANY_SELECTED = "meshDoc.current().sfn() > 0 || meshDoc.current().svn() > 0"
_ENUM = re.compile(r"Enum \{(.+)\}")
_DIAGONAL = re.compile(r"meshDoc\.current\(\)\.bboxDiag\(\)(?: ([*/]) ([0-9.eE+-]+))?")


def _parse_enum(element: Element, kind: str, source: str) -> tuple[str, ...]:
    match = _ENUM.fullmatch(kind)
    pairs = [part.split(":") for part in match[1].split("|")] if match else []
    values = tuple(pair[0].strip() for pair in pairs)
    numbered = all(len(pair) == 2 and pair[1].strip() == str(i) for i, pair in enumerate(pairs))
    if not pairs or not numbered or len(set(values)) < len(values):
        _refuse(element, source, f"parType {kind!r} is not of the form 'Enum {{A : 0 | B : 1}}'")
    return values


def _parse_default(element: Element, type_: str, values: tuple[str, ...], source: str) -> Value | Length | AnySelected:
    text = element.attributes["parDefault"]
    if type_ == "enum":
        if text not in values:
            _refuse(element, source, f"parDefault {text!r} is not one of {', '.join(values)}")
        return text
    if type_ == "bool" and text == _ANY_SELECTED:
        return AnySelected()
    readers: dict[str, Callable[[Element, str, str], Value | Length]] = {
        "bool": _parse_boolean,
        "int": _parse_integer,
        "float": _parse_real,
        "length": _parse_length,
    }
    return readers[type_](element, text, source)


def _parse_boolean(element: Element, text: str, source: str) -> bool:
    if text not in ("true", "false"):
        _refuse(element, source, f"{text!r} is neither true nor false")
    return text == "true"


def _parse_integer(element: Element, text: str, source: str) -> int:
    if not re.fullmatch(r"[+-]?[0-9]{1,10}", text):
        _refuse(element, source, f"{text!r} is not an integer")
    return int(text)


def _parse_real(element: Element, text: str, source: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        _refuse(element, source, f"{text!r} is not a finite number")
    return value


def _parse_length(element: Element, text: str, source: str) -> float | Length:
    """Parse a number, or the diagonal multiplied or divided by a number."""
    match = _DIAGONAL.fullmatch(text)
    if match is None:
        return _parse_real(element, text, source)
    factor = _parse_real(element, match[2] or "1", source)
    if match[1] == "/":
        if factor == 0:
            _refuse(element, source, f"{text!r} divides by zero")
        factor = 1 / factor
    return Length(factor)


def _expect(element: Element, source: str, tag: str, attributes: list[str], children: list[str]) -> None:
    """Require exactly this tag, these attributes and these tags of the children, in order."""
    if element.tag != tag:
        _refuse(element, source, f"expected <{tag}>, found <{element.tag}>")
    missing = [name for name in attributes if name not in element.attributes]
    if missing:
        _refuse(element, source, f"<{tag}> lacks {', '.join(missing)}")
    unknown = [name for name in element.attributes if name not in attributes]
    if unknown:
        _refuse(element, source, f"<{tag}> has unknown {', '.join(unknown)}")
    found = [child.tag for child in element.children]
    if found != children:
        _refuse(element, source, f"<{tag}> contains {_format_tags(found)}; expected {_format_tags(children)}")


def _format_tags(tags: Iterable[str]) -> str:
    return ", ".join(f"<{tag}>" for tag in tags) or "nothing"


def _refuse(element: Element, source: str, reason: str) -> NoReturn:
    raise InvalidXml(source, element.line, reason)

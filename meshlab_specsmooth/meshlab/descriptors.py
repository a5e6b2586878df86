"""Filter descriptors: the single source of each filter's names, types, defaults, bounds and help.

The files lie in ``filters_xml/`` and follow MeshLab's former ``MESHLAB_FILTER_INTERFACE`` grammar, version 2.0, which
MeshLab itself stopped reading in 2020. Python's keyword arguments, the command line's options and the documentation are
all made from them.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from importlib.resources import files
from typing import TYPE_CHECKING, NoReturn

from meshlab_specsmooth.errors import FileError, InvalidXml
from meshlab_specsmooth.meshlab.xmltree import Element, parse

if TYPE_CHECKING:
    from importlib.abc import Traversable  # its place in Python 3.10

Value = bool | int | float | str

_LARGEST_INT = 2**31 - 1


@dataclass(frozen=True)
class Length:
    """A length of ``share`` of the bounding-box diagonal."""

    share: float


@dataclass(frozen=True)
class AnySelected:
    """Whether a vertex or a face of the current mesh is selected."""


@dataclass(frozen=True)
class Parameter:
    """One parameter of a filter.

    Attributes
    ----------
    name : str
        Keyword in Python; with dashes for underscores, option of the command line.
    type : str
        ``"bool"``, ``"int"``, ``"float"``, ``"length"`` (a float in mesh units, or a percentage of the bounding-box
        diagonal) or ``"enum"``.
    default : bool, int, float, str, Length or AnySelected
    label, help : str
    minimum, maximum : float
        Inclusive bounds of a number; infinite where there are none.
    values : tuple of str
        Names of an enum's values.
    """

    name: str
    type: str
    default: Value | Length | AnySelected
    label: str
    help: str
    minimum: float
    maximum: float
    values: tuple[str, ...]

    def allows(self, number: float) -> bool:
        """Whether a number is finite and within the bounds."""
        return -math.inf < number < math.inf and self.minimum <= number <= self.maximum

    @property
    def kind(self) -> str:
        """Type and bounds, for people."""
        if self.type == "enum":
            return " | ".join(self.values)
        name = {"length": "float, PercentageValue or PureValue"}.get(self.type, self.type)
        if self.type == "length" or not math.isfinite(self.minimum):
            return name
        if self.maximum >= _LARGEST_INT:
            return f"{name} from {self.minimum:g}"
        return f"{name} in [{self.minimum:g}, {self.maximum:g}]"

    @property
    def shown_default(self) -> str:
        """The default, for people."""
        if isinstance(self.default, AnySelected):
            return "whether something is selected"
        if isinstance(self.default, Length):
            return f"{100 * self.default.share:g}%"
        return str(self.default)


@dataclass(frozen=True)
class Descriptor:
    """One filter: its Python function, MeshLab display name, class, help and parameters in order."""

    function: str
    name: str
    category: str
    help: str
    parameters: tuple[Parameter, ...]
    needs_faces: bool

    def __getitem__(self, name: str) -> Parameter:
        """The parameter of that name."""
        return next(p for p in self.parameters if p.name == name)


def load(function: str) -> Descriptor:
    """The descriptor of the filter with that Python name, from ``filters_xml/``."""
    path = folder() / f"{function}.xml"
    return read(path.read_bytes(), str(path))


def names() -> tuple[str, ...]:
    """Python names of all filters, sorted."""
    return tuple(sorted(path.name[: -len(".xml")] for path in folder().iterdir() if path.name.endswith(".xml")))


def folder() -> Traversable:
    """``filters_xml/``: in an installed package it is a folder of the package, in a clone it lies beside it.

    Raises
    ------
    FileError
        It is in neither place.
    """
    package = files("meshlab_specsmooth")
    inside = package / "filters_xml"
    if inside.is_dir():
        return inside
    # the folder of a package has a parent, on disk (pathlib.Path) as in an archive (zipfile.Path)
    beside: Traversable = package.parent / "filters_xml"  # type: ignore[attr-defined]
    if beside.is_dir():
        return beside
    raise FileError(
        f"{inside}: the filters' descriptions are missing; include filters_xml/*.xml when packing the package"
    )


def read(data: bytes, source: str) -> Descriptor:
    """The descriptor in an XML document.

    Raises
    ------
    InvalidXml
        File, line and reason.
    """
    interface = parse(data, source)
    _expect(interface, source, "MESHLAB_FILTER_INTERFACE", ["mfiVersion"], ["PLUGIN"])
    if interface.attributes["mfiVersion"] != "2.0":
        _refuse(interface, source, f"mfiVersion is {interface.attributes['mfiVersion']!r}; only 2.0 is read")
    plugin = interface.children[0]
    _expect(plugin, source, "PLUGIN", ["pluginName", "pluginAuthor", "pluginEmail"], ["FILTER"])
    return _filter(plugin.children[0], source)


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


def _filter(element: Element, source: str) -> Descriptor:
    parameters = [child for child in element.children if child.tag == "PARAM"]
    _expect(element, source, "FILTER", _FILTER_ATTRIBUTES, ["FILTER_HELP"] + ["PARAM"] * len(parameters))
    function = element.attributes["filterFunction"]
    if not function.isidentifier():
        _refuse(element, source, f"filterFunction {function!r} is no Python name")
    read_parameters = []
    seen: set[str] = set()
    for child in parameters:
        parameter = _parameter(child, source)
        if parameter.name in seen:
            _refuse(child, source, f"parameter {parameter.name!r} is described twice")
        seen.add(parameter.name)
        read_parameters.append(parameter)
    for name, known in _FILTER_WORDS.items():
        for word in element.attributes[name].split(" | "):
            if word not in known:
                _refuse(element, source, f"{name} has {word!r}, which is none of {', '.join(known)}")
    _expect(element.children[0], source, "FILTER_HELP", [], [])
    return Descriptor(
        function,
        element.attributes["filterName"],
        element.attributes["filterClass"],
        element.children[0].text.strip(),
        tuple(read_parameters),
        "MM_FACENUMBER" in element.attributes["filterPre"].split(" | "),
    )


def _parameter(element: Element, source: str) -> Parameter:
    if len(element.children) != 2:
        _refuse(element, source, "PARAM has one PARAM_HELP and one GUI element, in that order")
    help_element, gui = element.children
    attributes = ["parName", "parType", "parDefault", "parIsImportant", "parIsPersistent"]
    _expect(element, source, "PARAM", attributes, ["PARAM_HELP", gui.tag])
    name, kind = element.attributes["parName"], element.attributes["parType"]
    if not name.isidentifier():
        _refuse(element, source, f"parName {name!r} is no Python name")
    for flag in ("parIsImportant", "parIsPersistent"):
        _boolean(element, element.attributes[flag], source)
    _expect(help_element, source, "PARAM_HELP", [], [])
    bounded = gui.tag in ("SLIDER_GUI", "ABSPERC_GUI")
    _expect(gui, source, gui.tag, ["guiLabel", "guiMin", "guiMax"] if bounded else ["guiLabel"], [])
    if kind.startswith("Enum"):
        type_, values = "enum", _enum_values(element, kind, source)
    else:
        type_, values = {("Real", "ABSPERC_GUI"): "length"}.get((kind, gui.tag), _TYPES.get(kind, "")), ()
    if gui.tag not in _GUIS.get(type_, ()):
        _refuse(element, source, f"parType {kind!r} does not go with {gui.tag}")
    minimum, maximum = -math.inf, math.inf
    if type_ == "length":
        # a length is bounded by the diagonal only on MeshLab's slider: waves longer than the mesh do no harm
        minimum = _real(gui, gui.attributes["guiMin"], source)
        _length(gui, gui.attributes["guiMax"], source)
    elif bounded:
        minimum, maximum = (_real(gui, gui.attributes[key], source) for key in ("guiMin", "guiMax"))
    default = _default(element, type_, values, source)
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
# the two expressions that are understood; nothing is ever evaluated
_ANY_SELECTED = "meshDoc.current().sfn() > 0 || meshDoc.current().svn() > 0"
_ENUM = re.compile(r"Enum \{(.+)\}")
_DIAGONAL = re.compile(r"meshDoc\.current\(\)\.bboxDiag\(\)(?: ([*/]) ([0-9.eE+-]+))?")


def _enum_values(element: Element, kind: str, source: str) -> tuple[str, ...]:
    match = _ENUM.fullmatch(kind)
    pairs = [part.split(":") for part in match[1].split("|")] if match else []
    values = tuple(pair[0].strip() for pair in pairs)
    numbered = all(len(pair) == 2 and pair[1].strip() == str(i) for i, pair in enumerate(pairs))
    if not pairs or not numbered or len(set(values)) < len(values):
        _refuse(element, source, f"parType {kind!r} is not of the form 'Enum {{A : 0 | B : 1}}'")
    return values


def _default(element: Element, type_: str, values: tuple[str, ...], source: str) -> Value | Length | AnySelected:
    text = element.attributes["parDefault"]
    if type_ == "enum":
        if text not in values:
            _refuse(element, source, f"parDefault {text!r} is none of {', '.join(values)}")
        return text
    if type_ == "bool" and text == _ANY_SELECTED:
        return AnySelected()
    readers: dict[str, Callable[[Element, str, str], Value | Length]] = {
        "bool": _boolean,
        "int": _integer,
        "float": _real,
        "length": _length,
    }
    return readers[type_](element, text, source)


def _boolean(element: Element, text: str, source: str) -> bool:
    if text not in ("true", "false"):
        _refuse(element, source, f"{text!r} is neither true nor false")
    return text == "true"


def _integer(element: Element, text: str, source: str) -> int:
    if not re.fullmatch(r"[+-]?[0-9]{1,10}", text):
        _refuse(element, source, f"{text!r} is no whole number")
    return int(text)


def _real(element: Element, text: str, source: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        _refuse(element, source, f"{text!r} is no finite number")
    return value


def _length(element: Element, text: str, source: str) -> float | Length:
    """A number, or the diagonal times or over a number."""
    match = _DIAGONAL.fullmatch(text)
    if match is None:
        return _real(element, text, source)
    factor = _real(element, match[2] or "1", source)
    if match[1] == "/":
        if factor == 0:
            _refuse(element, source, f"{text!r} divides by zero")
        factor = 1 / factor
    return Length(factor)


def _expect(element: Element, source: str, tag: str, attributes: list[str], children: list[str]) -> None:
    """Refuse an element whose tag, attributes or children's tags are not exactly these."""
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
        _refuse(element, source, f"<{tag}> contains {_list(found)}; expected {_list(children)}")


def _list(tags: Iterable[str]) -> str:
    return ", ".join(f"<{tag}>" for tag in tags) or "nothing"


def _refuse(element: Element, source: str, reason: str) -> NoReturn:
    raise InvalidXml(source, element.line, reason)

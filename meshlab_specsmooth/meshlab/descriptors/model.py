"""What a descriptor says about a filter: names, types, defaults, bounds and help."""

from __future__ import annotations

import math
from dataclasses import dataclass

Value = bool | int | float | str

#: Largest value of the type Int in the descriptor grammar.
MAX_INT = 2**31 - 1


@dataclass(frozen=True)
class Length:
    """A length as a fraction of the bounding-box diagonal."""

    fraction: float


@dataclass(frozen=True)
class AnySelected:
    """The default of ``selected``: True if a vertex or a face of the current mesh is selected."""


@dataclass(frozen=True)
class Parameter:
    """One parameter of a filter.

    Attributes
    ----------
    name : str
        Keyword argument in Python; with dashes for underscores, the option of the command line.
    type : str
        ``"bool"``, ``"int"``, ``"float"``, ``"length"`` (a float in mesh units, or a percentage of the bounding-box
        diagonal) or ``"enum"``.
    default : bool, int, float, str, Length or AnySelected
    label, help : str
    minimum, maximum : float
        Inclusive bounds of a number; infinite if there are none.
    values : tuple of str
        Names of the values of an enum.
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
        """Type and bounds as text, for documentation."""
        if self.type == "enum":
            return " | ".join(self.values)
        name = {"length": "float, PercentageValue or PureValue"}.get(self.type, self.type)
        if self.type == "length" or not math.isfinite(self.minimum):
            return name
        if self.maximum >= MAX_INT:
            return f"{name} from {self.minimum:g}"
        return f"{name} in [{self.minimum:g}, {self.maximum:g}]"

    @property
    def shown_default(self) -> str:
        """The default as text, for documentation."""
        if isinstance(self.default, AnySelected):
            return "whether something is selected"
        if isinstance(self.default, Length):
            return f"{100 * self.default.fraction:g}%"
        return str(self.default)


@dataclass(frozen=True)
class Descriptor:
    """One filter: name of its Python function, display name in MeshLab, class, help, and parameters in order."""

    function: str
    name: str
    category: str
    help: str
    parameters: tuple[Parameter, ...]
    needs_faces: bool

    def __getitem__(self, name: str) -> Parameter:
        """Return the parameter with this name."""
        return next(p for p in self.parameters if p.name == name)

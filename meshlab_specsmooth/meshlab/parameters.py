"""Check the keyword arguments of a filter call against its descriptor, as pymeshlab does for its own filters."""

from __future__ import annotations

from typing import Any

import numpy as np
import pymeshlab
from pymeshlab import InvalidEnumException
from pymeshlab import PyMeshLabException as PyMeshLabException

from meshlab_specsmooth.errors import InvalidParameter, suggest
from meshlab_specsmooth.meshlab.descriptors import AnySelected, Descriptor, Length, Parameter
from meshlab_specsmooth.parameters import show


class WrongType(InvalidParameter, PyMeshLabException, RuntimeError):  # type: ignore[misc]  # noqa: N818
    """A value of the wrong type: a RuntimeError, as pymeshlab raises, and a PyMeshLabException as well."""


class UnknownEnum(InvalidParameter, InvalidEnumException):  # type: ignore[misc]
    """A value that is none of an enum's: an InvalidParameter, and pymeshlab's exception as well."""


class RefusedParameter(InvalidParameter, PyMeshLabException):  # type: ignore[misc]
    """An unknown parameter, or a value that is refused: an InvalidParameter, and a PyMeshLabException as well."""


def resolve(descriptor: Descriptor, given: dict[str, Any], ms: pymeshlab.MeshSet) -> dict[str, Any]:
    """Return checked values of all parameters: those given, and defaults for the others; lengths in mesh units.

    Raises
    ------
    InvalidParameter
        An unknown parameter, or a value of the wrong type or out of bounds. The error has pymeshlab's wording and is
        also of the type that pymeshlab raises.
    pymeshlab.PyMeshLabException
        The MeshSet has no mesh.
    """
    if ms.mesh_number() == 0:
        raise PyMeshLabException(f"{descriptor.function} requires at least one mesh loaded in the MeshSet.")
    known = {parameter.name: parameter for parameter in descriptor.parameters}
    for name in given:
        if name not in known:
            raise RefusedParameter(
                f"Parameter {name} not found for filter {descriptor.function}. Please check the documentation."
                + suggest(name, known)
            )
    values = {name: check_value(known[name], given.get(name, known[name].default), ms) for name in known}
    if "selected" not in given and values.get("features") in ("vertex_selection", "face_selection"):
        values["selected"] = False  # the selection marks features, so it does not restrict the filter
    return values


def resolve_for_any_mesh(descriptor: Descriptor, given: dict[str, Any]) -> dict[str, Any]:
    """Check the given parameters without a mesh; percentages stay fractions of the diagonal.

    Raises
    ------
    InvalidParameter
        A value is invalid for every mesh.
    """
    triangle = pymeshlab.MeshSet()
    triangle.add_mesh(pymeshlab.Mesh(np.eye(3), np.array([[0, 1, 2]])))
    values = resolve(descriptor, given, triangle)
    fractions = {name: _as_fraction(given[name]) for name in given}
    return {name: values[name] if fraction is None else fraction for name, fraction in fractions.items()}


def _as_fraction(given: Any) -> Length | None:
    if isinstance(given, pymeshlab.PercentageValue):
        return Length(given.value() / 100)
    return given if isinstance(given, Length) else None


def check_value(parameter: Parameter, given: Any, ms: pymeshlab.MeshSet) -> Any:
    """Return one checked value, of a plain Python type."""
    if isinstance(given, AnySelected):
        mesh = ms.current_mesh()
        return bool(mesh.selected_vertex_number() > 0 or mesh.selected_face_number() > 0)
    if parameter.type == "enum":
        return _check_enum(parameter, given)
    if parameter.type == "length":
        given = _in_mesh_units(given, ms)
    convert = _converter(parameter.type, given)
    if convert is None:
        raise WrongType(
            f"Parameter {parameter.name}: Unable to cast Python instance of type {type(given)} to {parameter.type}."
        )
    try:
        number = convert(given)
    except OverflowError:  # integer too large for a float
        number = np.inf
    if parameter.type != "bool" and not parameter.allows(number):
        raise RefusedParameter(
            f"Parameter {parameter.name}: {parameter.type} value {show(number)} out of bounds "
            f"(min: {parameter.minimum:g}; max: {parameter.maximum:g})."
        )
    return number


def _check_enum(parameter: Parameter, given: Any) -> str:
    if isinstance(given, str):
        if given not in parameter.values:
            possible = "".join(f"'{name}'; " for name in parameter.values)
            raise UnknownEnum(f"Enum {show(given)} not found. Possible values are {possible}")
        return given
    if _converter("int", given) is None:
        raise WrongType(f"Parameter {parameter.name}: Unable to cast Python instance of type {type(given)} to str.")
    if not 0 <= given < len(parameter.values):
        last = len(parameter.values)
        raise UnknownEnum(f"Enum {show(given)} not valid. Must be a value between 0 and {last}")
    return parameter.values[int(given)]


def _in_mesh_units(given: Any, ms: pymeshlab.MeshSet) -> Any:
    """Convert a length, possibly a percentage of the bounding-box diagonal, to mesh units."""
    diagonal = ms.current_mesh().bounding_box().diagonal()
    if isinstance(given, Length):
        return given.fraction * diagonal
    if isinstance(given, pymeshlab.PercentageValue):
        return given.value() / 100 * diagonal
    if isinstance(given, pymeshlab.PureValue):
        return given.value()
    return given


def _converter(kind: str, given: Any) -> type | None:
    """Return the plain type to convert a value to, or None if its type is wrong; True is 1, as for pymeshlab."""
    if isinstance(given, bool | np.bool_ | int | np.integer):
        return {"bool": bool, "int": int}.get(kind, float)
    if isinstance(given, float | np.floating) and kind in ("float", "length"):
        return float
    return None

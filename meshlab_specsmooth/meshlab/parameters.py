"""Keyword arguments of a filter call, checked against its descriptor as pymeshlab checks those of its own filters."""

from __future__ import annotations

from typing import Any

import numpy as np
import pymeshlab
from pymeshlab import InvalidEnumException
from pymeshlab import PyMeshLabException as PyMeshLabException

from meshlab_specsmooth.errors import InvalidParameter, suggest
from meshlab_specsmooth.meshlab.descriptors import AnySelected, Descriptor, Length, Parameter
from meshlab_specsmooth.parameters import show


class WrongType(PyMeshLabException, RuntimeError):  # type: ignore[misc]  # noqa: N818
    """A value of the wrong type: pymeshlab raises a RuntimeError here; this is its own exception as well."""


class RefusedParameter(InvalidParameter, PyMeshLabException):  # type: ignore[misc]
    """A parameter that the method refuses on this mesh: ours, and pymeshlab's exception as well."""


def resolve(descriptor: Descriptor, given: dict[str, Any], ms: pymeshlab.MeshSet) -> dict[str, Any]:
    """Values of all parameters: what was given, checked, and defaults for the rest; lengths in mesh units.

    Raises
    ------
    pymeshlab.PyMeshLabException
        In the words of pymeshlab's own filters: an unknown parameter, a value of the wrong type or out of bounds.
    """
    if ms.mesh_number() == 0:
        raise PyMeshLabException(f"{descriptor.function} requires at least one mesh loaded in the MeshSet.")
    known = {parameter.name: parameter for parameter in descriptor.parameters}
    for name in given:
        if name not in known:
            raise PyMeshLabException(
                f"Parameter {name} not found for filter {descriptor.function}. Please check the documentation."
                + suggest(name, known)
            )
    values = {name: value(known[name], given.get(name, known[name].default), ms) for name in known}
    if "selected" not in given and values.get("features") in ("vertex_selection", "face_selection"):
        values["selected"] = False  # the selection marks features, so it does not restrict the filter
    return values


def check_given(descriptor: Descriptor, given: dict[str, Any], ms: pymeshlab.MeshSet) -> dict[str, Any]:
    """As :func:`resolve`, for a command: what is wrong is its usage.

    Raises
    ------
    InvalidParameter
        What :func:`resolve` raises.
    """
    try:
        return resolve(descriptor, given, ms)
    except (PyMeshLabException, InvalidEnumException) as error:  # the one is none of the other
        raise InvalidParameter(str(error)) from error


def resolved_anywhere(descriptor: Descriptor, given: dict[str, Any]) -> dict[str, Any]:
    """What was given, checked, for meshes that are not there yet: percentages stay shares of whatever diagonal.

    Raises
    ------
    InvalidParameter
        What :func:`resolve` raises of any mesh.
    """
    triangle = pymeshlab.MeshSet()
    triangle.add_mesh(pymeshlab.Mesh(np.eye(3), np.array([[0, 1, 2]])))
    values = check_given(descriptor, given, triangle)
    shares = {name: _share(given[name]) for name in given}
    return {name: values[name] if share is None else share for name, share in shares.items()}


def _share(given: Any) -> Length | None:
    if isinstance(given, pymeshlab.PercentageValue):
        return Length(given.value() / 100)
    return given if isinstance(given, Length) else None


def value(parameter: Parameter, given: Any, ms: pymeshlab.MeshSet) -> Any:
    """One checked value, of a plain Python type."""
    if isinstance(given, AnySelected):
        mesh = ms.current_mesh()
        return bool(mesh.selected_vertex_number() > 0 or mesh.selected_face_number() > 0)
    if parameter.type == "enum":
        return _enum(parameter, given)
    if parameter.type == "length":
        given = _in_mesh_units(given, ms)
    convert = _converter(parameter.type, given)
    if convert is None:
        raise WrongType(
            f"Parameter {parameter.name}: Unable to cast Python instance of type {type(given)} to {parameter.type}."
        )
    try:
        number = convert(given)
    except OverflowError:  # an integer beyond the range of floats
        number = np.inf
    if parameter.type != "bool" and not parameter.allows(number):
        raise PyMeshLabException(
            f"Parameter {parameter.name}: {parameter.type} value {show(number)} out of bounds "
            f"(min: {parameter.minimum:g}; max: {parameter.maximum:g})."
        )
    return number


def _enum(parameter: Parameter, given: Any) -> str:
    if isinstance(given, str):
        if given not in parameter.values:
            possible = "".join(f"'{name}'; " for name in parameter.values)
            raise InvalidEnumException(f"Enum {show(given)} not found. Possible values are {possible}")
        return given
    if _converter("int", given) is None:
        raise WrongType(f"Parameter {parameter.name}: Unable to cast Python instance of type {type(given)} to str.")
    if not 0 <= given < len(parameter.values):
        last = len(parameter.values)
        raise InvalidEnumException(f"Enum {show(given)} not valid. Must be a value between 0 and {last}")
    return parameter.values[int(given)]


def _in_mesh_units(given: Any, ms: pymeshlab.MeshSet) -> Any:
    """A length given as a share of the bounding-box diagonal, or as a plain value, in mesh units."""
    diagonal = ms.current_mesh().bounding_box().diagonal()
    if isinstance(given, Length):
        return given.fraction * diagonal
    if isinstance(given, pymeshlab.PercentageValue):
        return given.value() / 100 * diagonal
    if isinstance(given, pymeshlab.PureValue):
        return given.value()
    return given


def _converter(kind: str, given: Any) -> type | None:
    """The plain type that a value becomes, or None where it has the wrong one; True is 1, as pymeshlab has it."""
    if isinstance(given, bool | np.bool_ | int | np.integer):
        return {"bool": bool, "int": int}.get(kind, float)
    if isinstance(given, float | np.floating) and kind in ("float", "length"):
        return float
    return None

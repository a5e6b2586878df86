"""The filters on MeshSets: in place, keywords only, as MeshLab's own are called."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pymeshlab
from pymeshlab import PyMeshLabException

from meshlab_specsmooth import descriptors
from meshlab_specsmooth.bridge.meshset import pull, push
from meshlab_specsmooth.descriptors import Descriptor, Length, Parameter
from meshlab_specsmooth.smoothing import Prepared, SmoothingResult, prepare

__all__ = [
    "FILTERS",
    "PyMeshLabException",
    "apply",
    "apply_coord_spectral_low_pass",
    "apply_coord_spectral_smoothing",
    "resolve",
]


def apply_coord_spectral_smoothing(ms: pymeshlab.MeshSet, **parameters: Any) -> dict[str, Any]:
    """Spectral Smooth: the paper's method, in place on the current mesh of a MeshSet.

    Everything but coordinates, normals and bounding box stays as it was: faces, polygons, colours, quality, texture
    coordinates, selections, attributes, transform, the other meshes, the filter script. If anything fails the MeshSet
    is as before.

    Parameters
    ----------
    ms : pymeshlab.MeshSet
    **parameters
        As in ``filters_xml/apply_coord_spectral_smoothing.xml``: modes, wavelength (a number in mesh units, or a
        ``pymeshlab.PercentageValue`` of the bounding-box diagonal), response, barycenter_weight, passes, laplacian,
        method. They mean what they mean in :func:`meshlab_specsmooth.smooth`; 0 modes or wavelength is "not given".
        ``progress`` takes a callable too.

    Returns
    -------
    dict
        The evidence: all fields of :class:`meshlab_specsmooth.SmoothingResult` but the vertices.

    Raises
    ------
    pymeshlab.PyMeshLabException
        No mesh, an unknown parameter, or a value of the wrong type or out of bounds.
    InvalidSurface, InvalidParameter, MeshSetError, NotConverged, TooLarge
        See :func:`meshlab_specsmooth.smooth`.

    Examples
    --------
    >>> import pymeshlab
    >>> import meshlab_specsmooth as mss
    >>> ms = pymeshlab.MeshSet()
    >>> ms.create_sphere()
    >>> report = mss.apply_coord_spectral_smoothing(ms, wavelength=pymeshlab.PercentageValue(10))
    >>> report["method"], report["residual"] < 1e-7
    ('exact', True)
    """
    return _smooth_in_place(ms, "apply_coord_spectral_smoothing", Prepared.smooth, parameters)


def apply_coord_spectral_low_pass(ms: pymeshlab.MeshSet, **parameters: Any) -> dict[str, Any]:
    """Spectral Low-Pass: V' = h(L) V, in place on the current mesh of a MeshSet.

    Parameters, returns and errors as for :func:`apply_coord_spectral_smoothing`, by
    ``filters_xml/apply_coord_spectral_low_pass.xml``.

    Examples
    --------
    >>> import pymeshlab
    >>> import meshlab_specsmooth as mss
    >>> ms = pymeshlab.MeshSet()
    >>> ms.create_sphere()
    >>> mss.apply_coord_spectral_low_pass(ms, modes=4)["modes"]
    4
    """
    return _smooth_in_place(ms, "apply_coord_spectral_low_pass", Prepared.low_pass, parameters)


#: Our filters by name; each has a descriptor of that name in ``filters_xml/``.
FILTERS: dict[str, Callable[..., dict[str, Any]]] = {
    f.__name__: f for f in (apply_coord_spectral_smoothing, apply_coord_spectral_low_pass)
}


def apply(ms: pymeshlab.MeshSet, name: str, **parameters: Any) -> dict[str, Any]:
    """Apply a filter by name, one of ours or one of MeshLab's.

    Examples
    --------
    >>> import pymeshlab
    >>> from meshlab_specsmooth.bridge import filters
    >>> ms = pymeshlab.MeshSet()
    >>> filters.apply(ms, "create_sphere")
    {}
    >>> filters.apply(ms, "apply_coord_spectral_low_pass", modes=9)["modes"]
    9
    """
    if name in FILTERS:
        return FILTERS[name](ms, **parameters)
    return dict(ms.apply_filter(name, **parameters))


def _smooth_in_place(
    ms: pymeshlab.MeshSet, name: str, method: Callable[..., SmoothingResult], parameters: dict[str, Any]
) -> dict[str, Any]:
    """Pull, smooth, push; the evidence as a dict."""
    progress = parameters.pop("progress", None)
    if ms.mesh_number() == 0:
        raise PyMeshLabException(f"{name} requires at least one mesh loaded in the MeshSet.")
    values = resolve(descriptors.load(name), parameters, ms)
    prepared = prepare(*pull(ms), laplacian=values.pop("laplacian"))
    for size in ("modes", "wavelength"):
        values[size] = values[size] or None
    result = method(prepared, **values, progress=progress)
    push(ms, result.vertices)
    evidence = dict(vars(result))
    del evidence["vertices"]
    return evidence


def resolve(descriptor: Descriptor, given: dict[str, Any], ms: pymeshlab.MeshSet) -> dict[str, Any]:
    """Values of all parameters: what was given, checked, and defaults for the rest; lengths in mesh units.

    Raises
    ------
    pymeshlab.PyMeshLabException
        In the words of pymeshlab's own filters.
    """
    known = {parameter.name: parameter for parameter in descriptor.parameters}
    for name in given:
        if name not in known:
            raise PyMeshLabException(
                f"Parameter {name} not found for filter {descriptor.function}. Please check the documentation."
            )
    return {name: _value(known[name], given.get(name, known[name].default), ms) for name in known}


def _value(parameter: Parameter, given: Any, ms: pymeshlab.MeshSet) -> Any:
    if parameter.type == "enum":
        if given not in parameter.values:
            possible = "".join(f"'{value}'; " for value in parameter.values)
            raise PyMeshLabException(f"Enum '{given}' not found. Possible values are {possible}")
        return given
    if parameter.type == "length":
        given = _in_mesh_units(given, ms)
    if not _has_type(given, parameter.type):
        raise PyMeshLabException(
            f"Parameter {parameter.name}: {type(given).__name__} value {given!r} where {parameter.type} is expected."
        )
    if parameter.type != "bool" and not (math.isfinite(given) and parameter.minimum <= given <= parameter.maximum):
        raise PyMeshLabException(
            f"Parameter {parameter.name}: {parameter.type} value {given} out of bounds "
            f"(min: {parameter.minimum:g}; max: {parameter.maximum:g})."
        )
    return given


def _in_mesh_units(given: Any, ms: pymeshlab.MeshSet) -> Any:
    """A length given as a share of the bounding-box diagonal, or as a plain value, in mesh units."""
    diagonal = ms.current_mesh().bounding_box().diagonal()
    if isinstance(given, Length):
        return given.share * diagonal
    if isinstance(given, pymeshlab.PercentageValue):
        return given.value() / 100 * diagonal
    if isinstance(given, pymeshlab.PureValue):
        return given.value()
    return given


def _has_type(value: Any, kind: str) -> bool:
    if isinstance(value, bool | np.bool_):
        return kind == "bool"
    if isinstance(value, int | np.integer):
        return kind in ("int", "float", "length")
    return isinstance(value, float | np.floating) and kind in ("float", "length")

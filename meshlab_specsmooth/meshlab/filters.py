"""The filters on MeshSets: in place, keywords only, as MeshLab's own are called.

A filter is one descriptor in ``filters_xml/`` and one function here of the same name: the function gets the MeshSet and
the checked values of all parameters, and only says what is to be changed; the decorator does the rest. So a MeshSet is
changed in one place, at the end of a call, and an interrupt before that finds nothing to undo.
"""

from __future__ import annotations

import contextlib
import inspect
import sys
import textwrap
import time
from collections.abc import Callable, Iterator
from contextvars import ContextVar
from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt
import pymeshlab
from pymeshlab import PyMeshLabException

from meshlab_specsmooth.arrays import Floats, Integers
from meshlab_specsmooth.describe import Report, Sentence, format_edges, format_length
from meshlab_specsmooth.edge_aware import EdgeAwareResult, denoise, smooth_edge_aware
from meshlab_specsmooth.errors import InvalidParameter
from meshlab_specsmooth.geometry.surface import Surface, vertex_normals
from meshlab_specsmooth.meshlab import descriptors, scripts
from meshlab_specsmooth.meshlab.creases import selected_edges
from meshlab_specsmooth.meshlab.descriptors import Descriptor
from meshlab_specsmooth.meshlab.meshset import Change, by_place, check_finite, in_one_pass, pull, verbosity_of, write
from meshlab_specsmooth.meshlab.parameters import RefusedParameter, resolve
from meshlab_specsmooth.operators.boundary import ALL_KEPT, NOTHING_SELECTED
from meshlab_specsmooth.parameters import show
from meshlab_specsmooth.power_spectrum import spectrum
from meshlab_specsmooth.runtime.bars import begin
from meshlab_specsmooth.runtime.memory import require
from meshlab_specsmooth.runtime.progress import Progress, announce, subrange
from meshlab_specsmooth.smoothing.api import (
    BYTES_PER_VERTEX,
    Prepared,
    SmoothingResult,
    assemble,
    warn_of_change,
)

Filter = Callable[..., Report]
Implementation = Callable[[pymeshlab.MeshSet, dict[str, Any], Progress | None], tuple[Report, Change]]

# Where a call stands, as shares of its time, when the operators are made, and when what remains is to write the result
_ASSEMBLY, _WRITING = 0.2, 0.65

# What pymeshlab takes for a moment when new coordinates are written: two point clouds, and the old coordinates
_WRITING_BYTES_PER_VERTEX = 205

# What does the same without a MeshSet
_ON_OTHER_MESHES = {
    "apply_coord_edge_aware_smoothing": "smooth_edge_aware(mesh)",
    "apply_coord_spectral_denoising": "denoise(mesh)",
    "apply_coord_spectral_enhancement": "enhance(mesh)",
    "apply_coord_spectral_low_pass": "low_pass(mesh)",
    "apply_coord_spectral_smoothing": "smooth(mesh)",
    "compute_scalar_by_spectral_displacement": "smooth(mesh), whose vertices are compared with the mesh's",
    "get_spectrum": "spectrum(mesh)",
}

#: Our filters by Python name.
FILTERS: dict[str, Filter] = {}

# Fields of results that are no evidence
_SURFACES = ("vertices", "given", "source")

# A report of more vertices keeps no surfaces for a picture: a notebook keeps all that it has shown
_MOST_PICTURED = 200_000

_is_quiet: ContextVar[bool] = ContextVar("_is_quiet", default=False)


@contextlib.contextmanager
def quiet() -> Iterator[None]:
    """Print no line about selections; whoever calls a filter inside prints the result's warning."""
    token = _is_quiet.set(True)
    try:
        yield
    finally:
        _is_quiet.reset(token)


def _documentation(descriptor: Descriptor, own: str) -> str:
    """A docstring: help and parameters from the descriptor, the rest from the function's own."""
    lines = [f"{descriptor.name}, in place on the current mesh of a MeshSet.", ""]
    lines += [*textwrap.wrap(descriptor.help, 116), "", "Parameters", "----------", "ms : pymeshlab.MeshSet"]
    for parameter in descriptor.parameters:
        lines.append(f"{parameter.name} : {parameter.kind}, default {parameter.shown_default}")
        lines += textwrap.wrap(parameter.help, 112, initial_indent="    ", subsequent_indent="    ")
    lines += ["progress : callable, optional", "    Called with the fraction done, rising to 1.", ""]
    lines += own.splitlines()
    lines += [
        "",
        "Raises",
        "------",
        "pymeshlab.PyMeshLabException",
        "    No mesh, no faces, an unknown parameter, or a value of the wrong type or out of bounds.",
        "SpecsmoothError",
        "    What :func:`meshlab_specsmooth.smooth` raises.",
        "",
        "Whatever is raised, KeyboardInterrupt as well, the MeshSet is as before.",
    ]
    return "\n".join(lines)


def _signature(descriptor: Descriptor) -> inspect.Signature:
    """The parameters by name, for editors and notebooks."""
    kinds = {"bool": bool, "int": int, "enum": str}
    parameters = [inspect.Parameter("ms", inspect.Parameter.POSITIONAL_OR_KEYWORD, annotation=pymeshlab.MeshSet)]
    parameters += [
        inspect.Parameter(
            each.name, inspect.Parameter.KEYWORD_ONLY, default=each.default, annotation=kinds.get(each.type, float)
        )
        for each in descriptor.parameters
    ]
    parameters.append(inspect.Parameter("progress", inspect.Parameter.KEYWORD_ONLY, default=None))
    return inspect.Signature(parameters, return_annotation=dict)


def mesh_filter(implementation: Implementation) -> Filter:
    """Make a filter of a function of the MeshSet, the values of all parameters by name, and a progress callback.

    The function returns what the filter returns, and what is to be changed.
    """
    descriptor = descriptors.load(implementation.__name__)

    def call(ms: pymeshlab.MeshSet, **parameters: Any) -> Report:
        start = time.perf_counter()
        progress = begin(parameters.pop("progress", None), "assembling")
        if not isinstance(ms, pymeshlab.MeshSet):
            raise InvalidParameter(
                f"ms is {show(ms)}; it must be a pymeshlab.MeshSet, which is changed in place; for other meshes: "
                f"meshlab_specsmooth.{_ON_OTHER_MESHES[descriptor.function]}"
            )
        values = resolve(descriptor, parameters, ms)
        if descriptor.needs_faces and ms.current_mesh().face_number() == 0:
            # the quotation mark is pymeshlab's
            raise PyMeshLabException(
                f"Failed to apply filter:  '{descriptor.function}. Current mesh does not have Any Faces."
            )
        verbosity = verbosity_of(ms)
        if any(verbosity):
            # in pymeshlab's words
            print(f"\nApplying filter {descriptor.function} with the following parameters:\n{values}\n")  # noqa: T201
        try:
            output, change = implementation(ms, dict(values), progress)
        except InvalidParameter as error:
            raise RefusedParameter(str(error)) from error
        if progress is not None:
            progress(_WRITING)
            announce(progress, "writing")
        write(ms, replace(change, step=scripts.step_of(descriptor, values)), verbosity)
        if progress is not None:
            progress(1.0)
        if "seconds" in output:
            output["seconds"] = time.perf_counter() - start
        line = _restriction(ms, values, is_default="selected" not in parameters)
        if line is not None:
            found = output.get("warning")
            output["warning"] = line if found is None else found if line in found else f"{found}; {line}"
            if not _is_quiet.get():
                print(f"Warning: {line}", file=sys.stderr)  # noqa: T201 (the trap is fallen into where nobody looks)
        return output

    call.__name__ = call.__qualname__ = implementation.__name__
    call.__module__ = implementation.__module__
    call.__signature__ = _signature(descriptor)  # type: ignore[attr-defined]
    call.__doc__ = _documentation(descriptor, inspect.getdoc(implementation) or "")
    FILTERS[call.__name__] = call
    return call


def apply(ms: pymeshlab.MeshSet, name: str, **parameters: Any) -> dict[str, Any]:
    """Apply a filter by name, one of ours or one of MeshLab's.

    Examples
    --------
    >>> import pymeshlab
    >>> from meshlab_specsmooth.meshlab import filters
    >>> ms = pymeshlab.MeshSet()
    >>> filters.apply(ms, "create_sphere")
    {}
    >>> filters.apply(ms, "apply_coord_spectral_low_pass", modes=9)["modes"]
    9
    """
    if isinstance(name, str) and name in FILTERS:
        return FILTERS[name](ms, **parameters)
    return dict(ms.apply_filter(name, **parameters))


@mesh_filter
def apply_coord_spectral_smoothing(
    ms: pymeshlab.MeshSet, values: dict[str, Any], progress: Progress | None
) -> tuple[Report, Change]:
    """
    Returns
    -------
    dict
        The evidence: all fields of :class:`meshlab_specsmooth.SmoothingResult` but the vertices.

    Examples
    --------
    >>> import pymeshlab
    >>> import meshlab_specsmooth as mss
    >>> ms = pymeshlab.MeshSet()
    >>> ms.create_sphere()
    >>> report = mss.apply_coord_spectral_smoothing(ms, wavelength=pymeshlab.PercentageValue(10))
    >>> report["method"], report["residual"] < 1e-4
    ('exact', True)
    """  # noqa: D205 (what it does stands in the descriptor)
    return _moved(ms, Prepared.smooth, values, progress)


@mesh_filter
def apply_coord_spectral_low_pass(
    ms: pymeshlab.MeshSet, values: dict[str, Any], progress: Progress | None
) -> tuple[Report, Change]:
    """
    Returns
    -------
    dict
        The evidence, as of :func:`apply_coord_spectral_smoothing`.

    Examples
    --------
    >>> import pymeshlab
    >>> import meshlab_specsmooth as mss
    >>> ms = pymeshlab.MeshSet()
    >>> ms.create_sphere()
    >>> mss.apply_coord_spectral_low_pass(ms, modes=4)["modes"]
    4
    """  # noqa: D205 (what it does stands in the descriptor)
    return _moved(ms, Prepared.low_pass, values, progress)


@mesh_filter
def apply_coord_spectral_enhancement(
    ms: pymeshlab.MeshSet, values: dict[str, Any], progress: Progress | None
) -> tuple[Report, Change]:
    """
    Returns
    -------
    dict
        The evidence, as of :func:`apply_coord_spectral_smoothing`.

    Examples
    --------
    >>> import pymeshlab
    >>> import meshlab_specsmooth as mss
    >>> ms = pymeshlab.MeshSet()
    >>> ms.create_sphere()
    >>> mss.apply_coord_spectral_enhancement(ms, gain=1.5)["displacement"] > 0
    True
    """  # noqa: D205 (what it does stands in the descriptor)
    return _moved(ms, Prepared.enhance, values, progress)


@mesh_filter
def apply_coord_edge_aware_smoothing(
    ms: pymeshlab.MeshSet, values: dict[str, Any], progress: Progress | None
) -> tuple[Report, Change]:
    """
    Returns
    -------
    dict
        The evidence: all fields of :class:`meshlab_specsmooth.EdgeAwareResult` but the vertices.

    Examples
    --------
    >>> import pymeshlab
    >>> import meshlab_specsmooth as mss
    >>> ms = pymeshlab.MeshSet()
    >>> ms.create_cube()
    >>> mss.apply_coord_edge_aware_smoothing(ms)["flips"]
    0
    """  # noqa: D205 (what it does stands in the descriptor)
    return _moved_by_normals(ms, smooth_edge_aware, values, progress)


@mesh_filter
def apply_coord_spectral_denoising(
    ms: pymeshlab.MeshSet, values: dict[str, Any], progress: Progress | None
) -> tuple[Report, Change]:
    """
    Returns
    -------
    dict
        The evidence: all fields of :class:`meshlab_specsmooth.EdgeAwareResult` but the vertices.

    Examples
    --------
    >>> import pymeshlab
    >>> import meshlab_specsmooth as mss
    >>> ms = pymeshlab.MeshSet()
    >>> ms.create_cube()
    >>> mss.apply_coord_spectral_denoising(ms)["noise"].kind  # of too few vertices to tell
    'unclear'
    """  # noqa: D205 (what it does stands in the descriptor)
    return _moved_by_normals(ms, denoise, values, progress)


@mesh_filter
def compute_scalar_by_spectral_displacement(
    ms: pymeshlab.MeshSet, values: dict[str, Any], progress: Progress | None
) -> tuple[Report, Change]:
    """
    Returns
    -------
    dict
        ``rms``, ``min`` and ``max`` of the displacement along the normals, in mesh units.

    Examples
    --------
    >>> import pymeshlab
    >>> import meshlab_specsmooth as mss
    >>> ms = pymeshlab.MeshSet()
    >>> ms.create_sphere()
    >>> report = mss.compute_scalar_by_spectral_displacement(ms)
    >>> bool(ms.current_mesh().vertex_scalar_array().max() == report["max"])
    True
    """  # noqa: D205 (what it does stands in the descriptor)
    vertices, faces = pull(ms)
    result = _smoothed(ms, vertices, faces, Prepared.smooth, values, progress)
    check_finite(vertices, is_moved=False)
    normals = vertex_normals(Surface(result.vertices, faces))
    quality = by_place(vertices, ((result.vertices - vertices) * normals).sum(axis=1))
    most = float(np.abs(quality).max()) or 1.0  # so that no square leaves the range of numbers
    rms = most * float(np.sqrt(((quality / most) ** 2).mean()))
    edge, low, high = result.mean_edge, float(quality.min()), float(quality.max())
    summary = (
        f"displacement along the normals: {format_length(rms, edge)} (RMS), from {format_edges(low, edge)} to "
        f"{format_edges(high, edge)}; {result.summary}"
    )
    return Report({"rms": rms, "min": low, "max": high}, Sentence(summary)), Change(quality=quality)


@mesh_filter
def get_spectrum(ms: pymeshlab.MeshSet, values: dict[str, Any], progress: Progress | None) -> tuple[Report, Change]:
    """
    Returns
    -------
    dict
        All fields of :class:`meshlab_specsmooth.Spectrum`: arrays with an entry a band, and the noise floor.

    Examples
    --------
    >>> import pymeshlab
    >>> import meshlab_specsmooth as mss
    >>> ms = pymeshlab.MeshSet()
    >>> ms.create_sphere()
    >>> spectrum = mss.get_spectrum(ms)
    >>> len(spectrum["eigenvalue"]) == ms.current_mesh().vertex_number()
    True
    """  # noqa: D205 (what it does stands in the descriptor)
    found = spectrum(*pull(ms), **values)
    return Report(vars(found), found), Change()


def _moved(
    ms: pymeshlab.MeshSet, method: Callable[..., SmoothingResult], values: dict[str, Any], progress: Progress | None
) -> tuple[Report, Change]:
    """The evidence as a dict, and the new vertices."""
    n = ms.current_mesh().vertex_number()
    require((BYTES_PER_VERTEX + _WRITING_BYTES_PER_VERTEX) * n, f"smoothing {n} vertices of a MeshSet")
    vertices, faces = pull(ms)
    result = _smoothed(ms, vertices, faces, method, values, progress)
    return _report(result), Change(vertices=in_one_pass(vertices, result.vertices))


def _moved_by_normals(
    ms: pymeshlab.MeshSet, function: Callable[..., EdgeAwareResult], values: dict[str, Any], progress: Progress | None
) -> tuple[Report, Change]:
    """The evidence as a dict, and the new vertices."""
    vertices, faces = pull(ms)
    creases = _creases_of(ms, values.pop("creases"), values.pop("crease_angle"))
    given = _given(ms, values, "strength", "range_sigma", "iterations", "barycenter_weight")
    result = function(vertices, faces, creases=creases, **given, progress=subrange(progress, 0.0, _WRITING))
    return _report(result), Change(vertices=in_one_pass(vertices, result.vertices))


def _report(result: SmoothingResult | EdgeAwareResult) -> Report:
    """All fields but the surfaces, as a dict."""
    evidence = {name: value for name, value in vars(result).items() if name not in _SURFACES}
    if len(result.vertices) > _MOST_PICTURED:
        result = replace(result, vertices=np.empty((0, 3)), given=None, source=None)
    return Report(evidence, result)


def _creases_of(ms: pymeshlab.MeshSet, source: str, angle: float) -> Integers | float | None:
    """Vertex pairs, an angle, or None where neither is given."""
    if source == "none":
        return angle or None
    if angle:
        raise InvalidParameter(f"creases is {source!r} and crease_angle {angle:g}; give one of them")
    pairs = selected_edges(ms)
    if len(pairs) == 0:
        raise InvalidParameter(f"creases is {source!r}, but no edge is selected")
    return pairs


def _smoothed(
    ms: pymeshlab.MeshSet,
    vertices: Floats,
    faces: Integers,
    method: Callable[..., SmoothingResult],
    values: dict[str, Any],
    progress: Progress | None,
) -> SmoothingResult:
    """What a method of :class:`Prepared` makes of the current mesh."""
    given = _given(ms, values, "modes", "wavelength", "longest", "shortest", "barycenter_weight")
    laplacian, weld = given.pop("laplacian"), given.pop("weld")
    prepared = assemble(vertices, faces, laplacian, subrange(progress, 0.0, _ASSEMBLY), weld)
    result = method(prepared, **given, progress=subrange(progress, _ASSEMBLY, _WRITING - _ASSEMBLY))
    is_given = method is Prepared.smooth and "barycenter_weight" in given
    return warn_of_change(prepared, result) if is_given else result


def _given(ms: pymeshlab.MeshSet, values: dict[str, Any], *optional: str) -> dict[str, Any]:
    """A filter's values as keyword arguments of its function on arrays.

    Of the ``optional`` ones zero stands for "not given", as a filter's parameters all have a value.
    """
    given = {name: value for name, value in values.items() if name not in optional or value != 0}
    if given.pop("selected", False):
        given["mask"] = _selected(ms, "vertex_selection") | _selected(ms, "face_selection")
    if "features" in given:
        given["features"] = features_of(ms, given["features"])
    return given


def _restriction(ms: pymeshlab.MeshSet, values: dict[str, Any], is_default: bool) -> str | None:
    """What to say of a selection that restricts a filter without being asked to, or of one that stops it."""
    mesh = ms.current_mesh()
    if values.get("selected"):
        counts = {
            "faces": (mesh.selected_face_number(), mesh.face_number()),
            "vertices": (mesh.selected_vertex_number(), mesh.vertex_number()),
        }
        if not any(selected for selected, _ in counts.values()):
            return NOTHING_SELECTED
        if is_default and all(selected < total for selected, total in counts.values()):
            told = [f"{k:,} of {n:,} {name}".replace(",", " ") for name, (k, n) in counts.items() if k]
            return f"{' and '.join(told)} are selected: only these are smoothed; selected=False for all"
    if values.get("feature_gain"):
        features = features_of(ms, values["features"])
        if features is not None and (features == 1).all():
            if values["feature_gain"] == 1:
                return ALL_KEPT
            return "all vertices are features, so none is smoothed as the rest"
    return None


def _selected(ms: pymeshlab.MeshSet, what: str) -> npt.NDArray[np.bool_]:
    """Vertices that are selected, or belong to a selected face."""
    mesh = ms.current_mesh()
    if what == "vertex_selection":
        return np.asarray(mesh.vertex_selection_array(), dtype=np.bool_)
    mask = np.zeros(mesh.vertex_number(), dtype=np.bool_)
    mask[mesh.face_matrix()[np.asarray(mesh.face_selection_array(), dtype=np.bool_)]] = True
    return mask


def features_of(ms: pymeshlab.MeshSet, source: str) -> Floats | None:
    """Feature weights of the vertices."""
    if source == "none":
        return None
    mesh = ms.current_mesh()
    if source == "vertex_quality":
        if not mesh.has_vertex_scalar():
            raise InvalidParameter("features is 'vertex_quality', but the current mesh has no vertex quality")
        return np.asarray(mesh.vertex_scalar_array(), dtype=np.float64)
    marked = _selected(ms, source)
    if not marked.any():
        raise InvalidParameter(f"features is {source!r}, but nothing is selected")
    return marked.astype(np.float64)


__all__ = [*FILTERS]

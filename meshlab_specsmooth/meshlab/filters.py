"""The filters on MeshSets: in place and with keyword arguments only, like MeshLab's own.

Each filter is a descriptor in ``filters_xml/`` and a function here with the same name; see
:mod:`meshlab_specsmooth.meshlab.mesh_filter`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pymeshlab

from meshlab_specsmooth.arrays import Floats, Integers
from meshlab_specsmooth.describe import Report, Sentence, format_edges, format_length
from meshlab_specsmooth.edge_aware.api import denoise, smooth_edge_aware
from meshlab_specsmooth.edge_aware.result import EdgeAwareResult
from meshlab_specsmooth.geometry.surface import Surface, vertex_normals
from meshlab_specsmooth.meshlab.commit import Change, average_coincident, check_finite, reachable_by_morph
from meshlab_specsmooth.meshlab.filter_inputs import creases_of, keyword_arguments
from meshlab_specsmooth.meshlab.mesh_filter import FILTERS as FILTERS
from meshlab_specsmooth.meshlab.mesh_filter import WRITING, Call, mesh_filter
from meshlab_specsmooth.meshlab.meshset import get_arrays
from meshlab_specsmooth.operators.assemble import BYTES_PER_VERTEX, assemble
from meshlab_specsmooth.power_spectrum import spectrum
from meshlab_specsmooth.risk.estimate_error import estimate_noise
from meshlab_specsmooth.runtime.memory import require
from meshlab_specsmooth.runtime.progress import subrange
from meshlab_specsmooth.smoothing.api import enhance, low_pass, smooth
from meshlab_specsmooth.smoothing.boundary import BoundaryResult, smooth_boundary
from meshlab_specsmooth.smoothing.result import SmoothingResult

# Memory that pymeshlab needs while vertices are written: two point clouds, and the old vertices
_WRITING_BYTES_PER_VERTEX = 205

# Parameters of several filters that are not given where they are 0
_OPTIONAL = ("barycenter_weight", "max_displacement")

# Fields of results that are not reported
_SURFACES = ("vertices", "given", "source")

# Reports of larger meshes keep no surfaces for a picture, as a notebook keeps all reports that it has shown
_MAX_PICTURED = 200_000


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
def apply_coord_spectral_smoothing(call: Call) -> tuple[Report, Change]:
    """
    Returns
    -------
    dict
        All fields of :class:`meshlab_specsmooth.SmoothingResult` except for the vertices.

    Examples
    --------
    >>> import pymeshlab
    >>> import meshlab_specsmooth as mss
    >>> ms = pymeshlab.MeshSet()
    >>> ms.create_sphere()
    >>> report = mss.apply_coord_spectral_smoothing(ms, wavelength=pymeshlab.PercentageValue(10))
    >>> report["method"], report["residual"] < 1e-4
    ('exact', True)
    """  # noqa: D205 (the summary is in the descriptor)
    return _smooth(call, smooth)


@mesh_filter
def apply_coord_spectral_low_pass(call: Call) -> tuple[Report, Change]:
    """
    Returns
    -------
    dict
        As of :func:`apply_coord_spectral_smoothing`.

    Examples
    --------
    >>> import pymeshlab
    >>> import meshlab_specsmooth as mss
    >>> ms = pymeshlab.MeshSet()
    >>> ms.create_sphere()
    >>> mss.apply_coord_spectral_low_pass(ms, modes=4)["modes"]
    4
    """  # noqa: D205 (the summary is in the descriptor)
    return _smooth(call, low_pass)


@mesh_filter
def apply_coord_spectral_enhancement(call: Call) -> tuple[Report, Change]:
    """
    Returns
    -------
    dict
        As of :func:`apply_coord_spectral_smoothing`.

    Examples
    --------
    >>> import pymeshlab
    >>> import meshlab_specsmooth as mss
    >>> ms = pymeshlab.MeshSet()
    >>> ms.create_sphere()
    >>> mss.apply_coord_spectral_enhancement(ms, gain=1.5)["displacement"] > 0
    True
    """  # noqa: D205 (the summary is in the descriptor)
    return _smooth(call, enhance)


@mesh_filter
def apply_coord_edge_aware_smoothing(call: Call) -> tuple[Report, Change]:
    """
    Returns
    -------
    dict
        All fields of :class:`meshlab_specsmooth.EdgeAwareResult` except for the vertices.

    Examples
    --------
    >>> import pymeshlab
    >>> import meshlab_specsmooth as mss
    >>> ms = pymeshlab.MeshSet()
    >>> ms.create_cube()
    >>> mss.apply_coord_edge_aware_smoothing(ms)["flips"]
    0
    """  # noqa: D205 (the summary is in the descriptor)
    return _smooth_normals(call, smooth_edge_aware)


@mesh_filter
def apply_coord_spectral_denoising(call: Call) -> tuple[Report, Change]:
    """
    Returns
    -------
    dict
        All fields of :class:`meshlab_specsmooth.EdgeAwareResult` except for the vertices.

    Examples
    --------
    >>> import pymeshlab
    >>> import meshlab_specsmooth as mss
    >>> ms = pymeshlab.MeshSet()
    >>> ms.create_cube()
    >>> mss.apply_coord_spectral_denoising(ms)["noise"].kind  # too few vertices
    'unclear'
    """  # noqa: D205 (the summary is in the descriptor)
    return _smooth_normals(call, denoise)


@mesh_filter
def apply_coord_boundary_smoothing(call: Call) -> tuple[Report, Change]:
    """
    Returns
    -------
    dict
        All fields of :class:`meshlab_specsmooth.BoundaryResult` except for the vertices.

    Examples
    --------
    >>> import pymeshlab
    >>> import meshlab_specsmooth as mss
    >>> ms = pymeshlab.MeshSet()
    >>> ms.create_grid(numvertx=20, numverty=20)
    >>> mss.apply_coord_boundary_smoothing(ms)["smoothed"]  # its boundary has no jags
    0
    """  # noqa: D205 (the summary is in the descriptor)
    vertices, faces = get_arrays(call.ms)
    result = smooth_boundary(
        vertices,
        faces,
        **keyword_arguments(call.ms, call.values, "wavelength", "max_displacement"),
        progress=subrange(call.progress, 0.0, WRITING),
    )
    return make_report(result), Change(vertices=reachable_by_morph(vertices, result.vertices))


@mesh_filter
def compute_scalar_by_spectral_displacement(call: Call) -> tuple[Report, Change]:
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
    """  # noqa: D205 (the summary is in the descriptor)
    vertices, faces = get_arrays(call.ms)
    result = _apply(call, vertices, faces, smooth)
    check_finite(vertices, is_moved=False)
    normals = vertex_normals(Surface(result.vertices, faces))
    quality = average_coincident(vertices, ((result.vertices - vertices) * normals).sum(axis=1))
    largest = float(np.abs(quality).max()) or 1.0  # no square may overflow
    rms = largest * float(np.sqrt(((quality / largest) ** 2).mean()))
    edge, low, high = result.mean_edge, float(quality.min()), float(quality.max())
    summary = (
        f"displacement along the normals: {format_length(rms, edge)} (RMS), from {format_edges(low, edge)} to "
        f"{format_edges(high, edge)}; {result.summary}"
    )
    return Report({"rms": rms, "min": low, "max": high}, Sentence(summary)), Change(quality=quality)


@mesh_filter
def compute_scalar_by_noise_level(call: Call) -> tuple[Report, Change]:
    """
    Returns
    -------
    dict
        All fields of :class:`meshlab_specsmooth.Noise` except for ``local``, which is the quality.

    Examples
    --------
    >>> import pymeshlab
    >>> import meshlab_specsmooth as mss
    >>> ms = pymeshlab.MeshSet()
    >>> ms.create_sphere()
    >>> mss.compute_scalar_by_noise_level(ms)["kind"]
    'none'
    """  # noqa: D205 (the summary is in the descriptor)
    vertices, faces = get_arrays(call.ms)
    check_finite(vertices, is_moved=False)
    unit = call.values.pop("unit")
    found = estimate_noise(assemble(vertices, faces, **call.values))
    local = np.zeros(len(vertices)) if found.local is None else found.local
    if unit == "edges" and found.mean_edge > 0:
        local = local / found.mean_edge
    fields = {name: value for name, value in vars(found).items() if name != "local"}
    return Report(fields, found), Change(quality=average_coincident(vertices, local))


@mesh_filter
def compute_scalar_by_estimated_error(call: Call) -> tuple[Report, Change]:
    """
    Returns
    -------
    dict
        ``rms`` and ``max`` of the expected error, in mesh units, and the ``noise``.

    Examples
    --------
    >>> import pymeshlab
    >>> import meshlab_specsmooth as mss
    >>> ms = pymeshlab.MeshSet()
    >>> ms.create_sphere(subdiv=5)
    >>> mss.compute_scalar_by_estimated_error(ms, after="smoothing")["noise"].kind
    'none'
    """  # noqa: D205 (the summary is in the descriptor)
    vertices, faces = get_arrays(call.ms)
    check_finite(vertices, is_moved=False)
    functions: dict[str, Callable[..., Any]] = {"denoising": denoise, "smoothing": smooth}
    function = functions[call.values.pop("after")]
    result = function(vertices, faces, **call.values, progress=subrange(call.progress, 0.0, WRITING))
    quality = average_coincident(vertices, result.error_field)
    largest = float(quality.max()) or 1.0  # no square may overflow
    rms, noise = largest * float(np.sqrt(((quality / largest) ** 2).mean())), result.noise
    summary = (
        f"expected error along the normals: {format_length(rms, noise.mean_edge)} (RMS), at most "
        f"{format_edges(float(quality.max()), noise.mean_edge)}; {noise.summary}"
    )
    report = {"rms": rms, "max": float(quality.max()), "noise": noise}
    return Report(report, Sentence(summary)), Change(quality=quality)


@mesh_filter
def get_spectrum(call: Call) -> tuple[Report, Change]:
    """
    Returns
    -------
    dict
        All fields of :class:`meshlab_specsmooth.Spectrum`: arrays with one entry per band, and the noise floor.

    Examples
    --------
    >>> import pymeshlab
    >>> import meshlab_specsmooth as mss
    >>> ms = pymeshlab.MeshSet()
    >>> ms.create_sphere()
    >>> spectrum = mss.get_spectrum(ms)
    >>> len(spectrum["eigenvalue"]) == ms.current_mesh().vertex_number()
    True
    """  # noqa: D205 (the summary is in the descriptor)
    found = spectrum(*get_arrays(call.ms), **call.values)
    return Report(vars(found), found), Change()


def _smooth(call: Call, function: Callable[..., SmoothingResult]) -> tuple[Report, Change]:
    """Run a filter, and return its report and the new vertices."""
    n = call.ms.current_mesh().vertex_number()
    require((BYTES_PER_VERTEX + _WRITING_BYTES_PER_VERTEX) * n, f"smoothing {n} vertices of a MeshSet")
    vertices, faces = get_arrays(call.ms)
    result = _apply(call, vertices, faces, function)
    return make_report(result), Change(vertices=reachable_by_morph(vertices, result.vertices))


def _smooth_normals(call: Call, function: Callable[..., EdgeAwareResult]) -> tuple[Report, Change]:
    """Run a filter, and return its report and the new vertices."""
    vertices, faces = get_arrays(call.ms)
    creases = creases_of(call.ms, call.values.pop("creases"), call.values.pop("crease_angle"))
    given = keyword_arguments(call.ms, call.values, "strength", "range_sigma", "iterations", *_OPTIONAL)
    result = function(vertices, faces, creases=creases, **given, progress=subrange(call.progress, 0.0, WRITING))
    return make_report(result), Change(vertices=reachable_by_morph(vertices, result.vertices))


def make_report(
    result: SmoothingResult | EdgeAwareResult | BoundaryResult, max_pictured: int = _MAX_PICTURED
) -> Report:
    """Return all fields except for the surfaces."""
    fields = {name: value for name, value in vars(result).items() if name not in _SURFACES}
    if len(result.vertices) > max_pictured:
        result = replace(result, vertices=np.empty((0, 3)), given=None, source=None)
    return Report(fields, result)


def _apply(call: Call, vertices: Floats, faces: Integers, function: Callable[..., SmoothingResult]) -> SmoothingResult:
    """Apply a function on arrays to the current mesh."""
    given = keyword_arguments(call.ms, call.values, "modes", "wavelength", "longest", "shortest", *_OPTIONAL)
    return function(vertices, faces, **given, progress=subrange(call.progress, 0.0, WRITING))


__all__ = [*FILTERS]

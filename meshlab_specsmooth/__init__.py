"""Spectral mesh smoothing with barycenter constraints, as a filter for pymeshlab.

Any mesh in (arrays, a mesh of another library, a path), the same kind out: :func:`smooth`, :func:`denoise`,
:func:`smooth_edge_aware`, :func:`low_pass`, :func:`enhance`, :func:`spectrum`, :func:`estimate_noise`,
:func:`estimate_error`, :func:`self_intersecting_faces`. Operators once, for many runs: :func:`assemble`. Settings as
values: :class:`Smoothing`, :class:`EdgeAware`, :func:`choose`. Side by side: :func:`compare`. Many files:
:func:`batch`. MeshSets, in place, as a MeshLab filter does it:
:func:`apply_coord_spectral_smoothing` and the others of its kind, as functions of a MeshSet, as methods of
:class:`MeshSet`, or after :func:`register` as methods of pymeshlab's own.

Importing the package loads nothing: each name is loaded when it is first used, and pymeshlab with the first name that
needs it. The functions on arrays work without pymeshlab.
"""

from __future__ import annotations

import importlib
import importlib.util
import sys

from meshlab_specsmooth.version import VERSION

__version__ = VERSION

# The public names by module. Their types stand in ``__init__.pyi``, made from this table by ``scripts/make_docs.py``.
_NAMES = {
    "batching.many": "batch",
    "batching.record": "Outcome",
    "batching.summary": "BatchSummary",
    "comparison.comparison": "Comparison",
    "comparison.deviation": "Deviation deviation",
    "comparison.filter_specs": "FilterSpec",
    "edge_aware.api": "denoise smooth_edge_aware",
    "edge_aware.result": "EdgeAwareResult",
    "edge_aware.settings": "Denoising EdgeAware EdgeAwareRegion",
    "error_field": "estimate_error_field",
    "errors": (
        "ClusterError FileError FilterFailed InvalidParameter InvalidSurface InvalidXml MeshSetError "
        "MissingExtra MissingLibrary NoDisplay NoPython NotAMesh NotConverged Slow SmoothingWarning SpecsmoothError "
        "TooLarge"
    ),
    "geometry.surface": "Surface",
    "installation": "Installation report",
    "meshlab.measures": "self_intersecting_faces",
    "meshlab.registry": "register unregister",
    "meshlab.signatures": (
        "MeshSet apply_coord_boundary_smoothing apply_coord_edge_aware_smoothing apply_coord_spectral_denoising "
        "apply_coord_spectral_enhancement apply_coord_spectral_low_pass apply_coord_spectral_smoothing "
        "compute_scalar_by_estimated_error compute_scalar_by_noise_level "
        "compute_scalar_by_spectral_displacement get_spectrum"
    ),
    "noise.model": "Noise",
    "operators.assemble": "Operators assemble",
    "pieces.api": "denoise_pieces smooth_pieces",
    "pieces.result": "PiecesResult",
    "power_spectrum": "Spectrum spectrum",
    "reports.compared": "compare",
    "reports.deviation_report": "draw_deviation write_deviation",
    "reports.fields": "draw_field",
    "risk.estimate_error": "ErrorEstimate estimate_error estimate_noise",
    "runtime.bars": "show_progress",
    "runtime.workspace": "Workspace",
    "smoothing.api": "choose enhance low_pass smooth smooth_labels",
    "smoothing.boundary": "BoundaryResult smooth_boundary",
    "smoothing.choice": "Choice ConsideredSetting",
    "smoothing.labels": "LabelResult LabelVolume",
    "smoothing.result": "SmoothingResult",
    "smoothing.settings": "Enhancement LowPass Region Smoothing",
    "spectral.low_pass": "Butterworth Gaussian Heat Ideal",
    "spectral.response": "Response",
}
_MODULE_OF = {name: module for module, names in _NAMES.items() for name in names.split()}

__all__ = sorted(["__version__", *_MODULE_OF])


def __getattr__(name: str) -> object:
    """Load a public name, or a submodule, when it is first used."""
    if name in _MODULE_OF:
        value = getattr(importlib.import_module(f"{__name__}.{_MODULE_OF[name]}"), name)
        globals()[name] = value
        return value
    if not name.startswith("_") and importlib.util.find_spec(f"{__name__}.{name}") is not None:
        return importlib.import_module(f"{__name__}.{name}")
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}", name=name, obj=sys.modules[__name__])


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})

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
from types import ModuleType
from typing import TYPE_CHECKING

from meshlab_specsmooth.version import VERSION

if TYPE_CHECKING:
    from meshlab_specsmooth.batching.many import batch
    from meshlab_specsmooth.batching.record import Outcome
    from meshlab_specsmooth.batching.summary import BatchSummary
    from meshlab_specsmooth.comparison.comparison import Comparison
    from meshlab_specsmooth.comparison.filter_specs import FilterSpec
    from meshlab_specsmooth.edge_aware.api import denoise, smooth_edge_aware
    from meshlab_specsmooth.edge_aware.result import EdgeAwareResult
    from meshlab_specsmooth.edge_aware.settings import Denoising, EdgeAware, EdgeAwareRegion
    from meshlab_specsmooth.errors import (
        ClusterError,
        FileError,
        FilterFailed,
        InvalidParameter,
        InvalidSurface,
        InvalidXml,
        MeshSetError,
        MissingExtra,
        MissingLibrary,
        NoDisplay,
        NoPython,
        NotAMesh,
        NotConverged,
        Slow,
        SpecsmoothError,
        TooLarge,
    )
    from meshlab_specsmooth.geometry.surface import Surface
    from meshlab_specsmooth.meshlab.measures import self_intersecting_faces
    from meshlab_specsmooth.meshlab.registry import register, unregister
    from meshlab_specsmooth.meshlab.signatures import (
        MeshSet,
        apply_coord_edge_aware_smoothing,
        apply_coord_spectral_denoising,
        apply_coord_spectral_enhancement,
        apply_coord_spectral_low_pass,
        apply_coord_spectral_smoothing,
        compute_scalar_by_spectral_displacement,
        get_spectrum,
    )
    from meshlab_specsmooth.noise.model import Noise
    from meshlab_specsmooth.operators.assemble import Operators, assemble
    from meshlab_specsmooth.power_spectrum import Spectrum, spectrum
    from meshlab_specsmooth.report.compared import compare
    from meshlab_specsmooth.risk.estimate_error import ErrorEstimate, estimate_error, estimate_noise
    from meshlab_specsmooth.runtime.bars import show_progress
    from meshlab_specsmooth.runtime.workspace import Workspace
    from meshlab_specsmooth.smoothing.api import choose, enhance, low_pass, smooth
    from meshlab_specsmooth.smoothing.choice import Choice, ConsideredSetting
    from meshlab_specsmooth.smoothing.result import SmoothingResult
    from meshlab_specsmooth.smoothing.settings import Enhancement, LowPass, Region, Smoothing
    from meshlab_specsmooth.spectral.low_pass import Butterworth, Gaussian, Heat, Ideal
    from meshlab_specsmooth.spectral.response import Response

__version__ = VERSION

# The same names as above, for the interpreter
_NAMES = {
    "runtime.bars": ("show_progress",),
    "batching.many": ("batch",),
    "batching.summary": ("BatchSummary",),
    "batching.record": ("Outcome",),
    "meshlab.signatures": (
        "MeshSet",
        "apply_coord_edge_aware_smoothing",
        "apply_coord_spectral_denoising",
        "apply_coord_spectral_enhancement",
        "apply_coord_spectral_low_pass",
        "apply_coord_spectral_smoothing",
        "compute_scalar_by_spectral_displacement",
        "get_spectrum",
    ),
    "meshlab.measures": ("self_intersecting_faces",),
    "meshlab.registry": (
        "register",
        "unregister",
    ),
    "comparison.comparison": ("Comparison",),
    "comparison.filter_specs": ("FilterSpec",),
    "edge_aware.api": ("denoise", "smooth_edge_aware"),
    "edge_aware.result": ("EdgeAwareResult",),
    "edge_aware.settings": ("Denoising", "EdgeAware", "EdgeAwareRegion"),
    "errors": (
        "ClusterError",
        "FileError",
        "FilterFailed",
        "InvalidParameter",
        "InvalidSurface",
        "InvalidXml",
        "MeshSetError",
        "MissingExtra",
        "MissingLibrary",
        "NoDisplay",
        "NoPython",
        "NotAMesh",
        "NotConverged",
        "Slow",
        "SpecsmoothError",
        "TooLarge",
    ),
    "risk.estimate_error": (
        "ErrorEstimate",
        "estimate_error",
        "estimate_noise",
    ),
    "noise.model": ("Noise",),
    "operators.assemble": ("Operators", "assemble"),
    "report.compared": ("compare",),
    "runtime.workspace": ("Workspace",),
    "smoothing.api": ("choose", "enhance", "low_pass", "smooth"),
    "smoothing.choice": ("Choice", "ConsideredSetting"),
    "smoothing.result": ("SmoothingResult",),
    "smoothing.settings": ("Enhancement", "LowPass", "Region", "Smoothing"),
    "spectral.low_pass": ("Butterworth", "Gaussian", "Heat", "Ideal"),
    "spectral.response": ("Response",),
    "power_spectrum": (
        "Spectrum",
        "spectrum",
    ),
    "geometry.surface": ("Surface",),
}
_MODULE_OF = {name: module for module, names in _NAMES.items() for name in names}

__all__ = [
    "BatchSummary",
    "Butterworth",
    "Choice",
    "ClusterError",
    "Comparison",
    "ConsideredSetting",
    "Denoising",
    "EdgeAware",
    "EdgeAwareRegion",
    "EdgeAwareResult",
    "Enhancement",
    "ErrorEstimate",
    "FileError",
    "FilterFailed",
    "FilterSpec",
    "Gaussian",
    "Heat",
    "Ideal",
    "InvalidParameter",
    "InvalidSurface",
    "InvalidXml",
    "LowPass",
    "MeshSet",
    "MeshSetError",
    "MissingExtra",
    "MissingLibrary",
    "NoDisplay",
    "NoPython",
    "Noise",
    "NotAMesh",
    "NotConverged",
    "Operators",
    "Outcome",
    "Region",
    "Response",
    "Slow",
    "Smoothing",
    "SmoothingResult",
    "SpecsmoothError",
    "Spectrum",
    "Surface",
    "TooLarge",
    "Workspace",
    "__version__",
    "apply_coord_edge_aware_smoothing",
    "apply_coord_spectral_denoising",
    "apply_coord_spectral_enhancement",
    "apply_coord_spectral_low_pass",
    "apply_coord_spectral_smoothing",
    "assemble",
    "batch",
    "choose",
    "compare",
    "compute_scalar_by_spectral_displacement",
    "denoise",
    "enhance",
    "estimate_error",
    "estimate_noise",
    "get_spectrum",
    "low_pass",
    "register",
    "self_intersecting_faces",
    "show_progress",
    "smooth",
    "smooth_edge_aware",
    "spectrum",
    "unregister",
]


class _Package(ModuleType):
    """A module in which ``batch``, ``compare`` and ``spectrum`` are the functions, not the submodules of these names.

    Importing a submodule sets an attribute of its name, also where a function of that name was.
    """

    def __setattr__(self, name: str, value: object) -> None:
        if not (name in _MODULE_OF and isinstance(value, ModuleType)):
            super().__setattr__(name, value)


sys.modules[__name__].__class__ = _Package

if not TYPE_CHECKING:  # a checker takes any name for defined where it sees this function

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

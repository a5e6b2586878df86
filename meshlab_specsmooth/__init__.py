"""Spectral mesh smoothing with barycentre constraints, as a filter for pymeshlab.

Arrays in, arrays out: :func:`smooth`, :func:`denoise`, :func:`smooth_edge_aware`, :func:`low_pass`, :func:`enhance`,
:func:`prepare`, :func:`spectrum`, :func:`estimate_noise`, :func:`estimate_error`, :func:`crossing_faces`. Side by side:
:func:`compare`. Many files: :func:`batch`. MeshSets, in place, as a MeshLab filter does it:
:func:`apply_coord_spectral_smoothing` and the others of its kind, as functions of a MeshSet, as methods of
:class:`MeshSet`, or after :func:`register` as methods of pymeshlab's own.
"""

from meshlab_specsmooth.bars import show_progress
from meshlab_specsmooth.batch.many import batch
from meshlab_specsmooth.batch.summary import BatchSummary
from meshlab_specsmooth.batch.work import Outcome
from meshlab_specsmooth.bridge import filters as _filters
from meshlab_specsmooth.bridge.filters import *  # noqa: F403 (each filter, by its name)
from meshlab_specsmooth.bridge.measures import crossing_faces
from meshlab_specsmooth.bridge.registry import MeshSet, register, unregister
from meshlab_specsmooth.compare.comparison import Comparison
from meshlab_specsmooth.compare.competitors import Competitor
from meshlab_specsmooth.describe import draw_with as _draw_with
from meshlab_specsmooth.edge_aware import EdgeAwareResult, denoise, smooth_edge_aware
from meshlab_specsmooth.errors import (
    ClusterError,
    FileError,
    FilterFailed,
    InvalidParameter,
    InvalidSurface,
    InvalidXml,
    MeshSetError,
    MissingExtra,
    NoDisplay,
    NotConverged,
    SpecsmoothError,
    TooLarge,
)
from meshlab_specsmooth.estimation import ErrorEstimate, estimate_error, estimate_noise
from meshlab_specsmooth.noise import Noise
from meshlab_specsmooth.report.compared import compare
from meshlab_specsmooth.report.thumbnails import draw as _draw
from meshlab_specsmooth.smoothing import Prepared, SmoothingResult, enhance, low_pass, prepare, smooth
from meshlab_specsmooth.spectrum import Spectrum, spectrum
from meshlab_specsmooth.surface import Surface
from meshlab_specsmooth.version import VERSION

__version__ = VERSION

_draw_with(_draw)  # what notebooks show of results

__all__ = [
    *_filters.__all__,
    "Comparison",
    "Competitor",
    "EdgeAwareResult",
    "ErrorEstimate",
    "BatchSummary",
    "ClusterError",
    "FileError",
    "FilterFailed",
    "InvalidParameter",
    "InvalidSurface",
    "InvalidXml",
    "MeshSet",
    "MeshSetError",
    "MissingExtra",
    "Noise",
    "NoDisplay",
    "NotConverged",
    "Outcome",
    "Prepared",
    "SmoothingResult",
    "SpecsmoothError",
    "Spectrum",
    "Surface",
    "TooLarge",
    "__version__",
    "compare",
    "crossing_faces",
    "denoise",
    "batch",
    "enhance",
    "estimate_error",
    "estimate_noise",
    "low_pass",
    "prepare",
    "register",
    "show_progress",
    "smooth",
    "smooth_edge_aware",
    "spectrum",
    "unregister",
]

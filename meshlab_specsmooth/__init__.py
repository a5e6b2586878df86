"""Spectral mesh smoothing with barycentre constraints, as a filter for pymeshlab.

Any mesh in (arrays, a mesh of another library, a path), the same kind out: :func:`smooth`, :func:`denoise`,
:func:`smooth_edge_aware`, :func:`low_pass`, :func:`enhance`, :func:`prepare`, :func:`spectrum`, :func:`estimate_noise`,
:func:`estimate_error`, :func:`crossing_faces`. Side by side: :func:`compare`. Many files: :func:`batch`.
MeshSets, in place, as a MeshLab filter does it:
:func:`apply_coord_spectral_smoothing` and the others of its kind, as functions of a MeshSet, as methods of
:class:`MeshSet`, or after :func:`register` as methods of pymeshlab's own.
"""

from meshlab_specsmooth.batch.many import batch
from meshlab_specsmooth.batch.summary import BatchSummary
from meshlab_specsmooth.batch.work import Outcome
from meshlab_specsmooth.bridge.measures import crossing_faces
from meshlab_specsmooth.bridge.registry import register, unregister
from meshlab_specsmooth.bridge.signatures import (
    MeshSet,
    apply_coord_edge_aware_smoothing,
    apply_coord_spectral_denoising,
    apply_coord_spectral_enhancement,
    apply_coord_spectral_low_pass,
    apply_coord_spectral_smoothing,
    compute_scalar_by_spectral_displacement,
    get_spectrum,
)
from meshlab_specsmooth.compare.comparison import Comparison
from meshlab_specsmooth.compare.competitors import Competitor
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
    NotAMesh,
    NotConverged,
    SpecsmoothError,
    TooLarge,
)
from meshlab_specsmooth.estimation import ErrorEstimate, estimate_error, estimate_noise
from meshlab_specsmooth.noise import Noise
from meshlab_specsmooth.report.compared import compare
from meshlab_specsmooth.smoothing import Prepared, SmoothingResult, enhance, low_pass, prepare, smooth
from meshlab_specsmooth.spectrum import Spectrum, spectrum
from meshlab_specsmooth.surface import Surface
from meshlab_specsmooth.version import VERSION

__version__ = VERSION

__all__ = [
    "BatchSummary",
    "ClusterError",
    "Comparison",
    "Competitor",
    "EdgeAwareResult",
    "ErrorEstimate",
    "FileError",
    "FilterFailed",
    "InvalidParameter",
    "InvalidSurface",
    "InvalidXml",
    "MeshSet",
    "MeshSetError",
    "MissingExtra",
    "NoDisplay",
    "Noise",
    "NotAMesh",
    "NotConverged",
    "Outcome",
    "Prepared",
    "SmoothingResult",
    "SpecsmoothError",
    "Spectrum",
    "Surface",
    "TooLarge",
    "__version__",
    "apply_coord_edge_aware_smoothing",
    "apply_coord_spectral_denoising",
    "apply_coord_spectral_enhancement",
    "apply_coord_spectral_low_pass",
    "apply_coord_spectral_smoothing",
    "batch",
    "compare",
    "compute_scalar_by_spectral_displacement",
    "crossing_faces",
    "denoise",
    "enhance",
    "estimate_error",
    "estimate_noise",
    "get_spectrum",
    "low_pass",
    "prepare",
    "register",
    "smooth",
    "smooth_edge_aware",
    "spectrum",
    "unregister",
]

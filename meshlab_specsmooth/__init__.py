"""Spectral mesh smoothing with barycentre constraints, as a filter for pymeshlab.

Arrays in, arrays out: :func:`smooth`, :func:`low_pass`, :func:`prepare`. MeshSets, in place, as a MeshLab filter does
it: :func:`apply_coord_spectral_smoothing`, :func:`apply_coord_spectral_low_pass`.
"""

from meshlab_specsmooth.bridge.filters import apply_coord_spectral_low_pass, apply_coord_spectral_smoothing
from meshlab_specsmooth.errors import (
    FileError,
    InvalidParameter,
    InvalidSurface,
    MeshSetError,
    MissingExtra,
    NotConverged,
    SpecsmoothError,
    TooLarge,
)
from meshlab_specsmooth.smoothing import Prepared, SmoothingResult, enhance, low_pass, prepare, smooth
from meshlab_specsmooth.surface import Surface
from meshlab_specsmooth.version import VERSION

__version__ = VERSION

__all__ = [
    "FileError",
    "InvalidParameter",
    "InvalidSurface",
    "MeshSetError",
    "MissingExtra",
    "NotConverged",
    "Prepared",
    "SmoothingResult",
    "SpecsmoothError",
    "Surface",
    "TooLarge",
    "__version__",
    "apply_coord_spectral_low_pass",
    "apply_coord_spectral_smoothing",
    "enhance",
    "low_pass",
    "prepare",
    "smooth",
]

"""Types of the public names, made by ``python3 scripts/make_docs.py``."""

from meshlab_specsmooth.batching.many import batch as batch
from meshlab_specsmooth.batching.record import Outcome as Outcome
from meshlab_specsmooth.batching.summary import BatchSummary as BatchSummary
from meshlab_specsmooth.comparison.comparison import Comparison as Comparison
from meshlab_specsmooth.comparison.filter_specs import FilterSpec as FilterSpec
from meshlab_specsmooth.edge_aware.api import denoise as denoise
from meshlab_specsmooth.edge_aware.api import smooth_edge_aware as smooth_edge_aware
from meshlab_specsmooth.edge_aware.result import EdgeAwareResult as EdgeAwareResult
from meshlab_specsmooth.edge_aware.settings import Denoising as Denoising
from meshlab_specsmooth.edge_aware.settings import EdgeAware as EdgeAware
from meshlab_specsmooth.edge_aware.settings import EdgeAwareRegion as EdgeAwareRegion
from meshlab_specsmooth.error_field import estimate_error_field as estimate_error_field
from meshlab_specsmooth.errors import ClusterError as ClusterError
from meshlab_specsmooth.errors import FileError as FileError
from meshlab_specsmooth.errors import FilterFailed as FilterFailed
from meshlab_specsmooth.errors import InvalidParameter as InvalidParameter
from meshlab_specsmooth.errors import InvalidSurface as InvalidSurface
from meshlab_specsmooth.errors import InvalidXml as InvalidXml
from meshlab_specsmooth.errors import MeshSetError as MeshSetError
from meshlab_specsmooth.errors import MissingExtra as MissingExtra
from meshlab_specsmooth.errors import MissingLibrary as MissingLibrary
from meshlab_specsmooth.errors import NoDisplay as NoDisplay
from meshlab_specsmooth.errors import NoPython as NoPython
from meshlab_specsmooth.errors import NotAMesh as NotAMesh
from meshlab_specsmooth.errors import NotConverged as NotConverged
from meshlab_specsmooth.errors import Slow as Slow
from meshlab_specsmooth.errors import SmoothingWarning as SmoothingWarning
from meshlab_specsmooth.errors import SpecsmoothError as SpecsmoothError
from meshlab_specsmooth.errors import TooLarge as TooLarge
from meshlab_specsmooth.geometry.surface import Surface as Surface
from meshlab_specsmooth.meshlab.measures import self_intersecting_faces as self_intersecting_faces
from meshlab_specsmooth.meshlab.registry import register as register
from meshlab_specsmooth.meshlab.registry import unregister as unregister
from meshlab_specsmooth.meshlab.signatures import MeshSet as MeshSet
from meshlab_specsmooth.meshlab.signatures import apply_coord_edge_aware_smoothing as apply_coord_edge_aware_smoothing
from meshlab_specsmooth.meshlab.signatures import apply_coord_spectral_denoising as apply_coord_spectral_denoising
from meshlab_specsmooth.meshlab.signatures import apply_coord_spectral_enhancement as apply_coord_spectral_enhancement
from meshlab_specsmooth.meshlab.signatures import apply_coord_spectral_low_pass as apply_coord_spectral_low_pass
from meshlab_specsmooth.meshlab.signatures import apply_coord_spectral_smoothing as apply_coord_spectral_smoothing
from meshlab_specsmooth.meshlab.signatures import compute_scalar_by_estimated_error as compute_scalar_by_estimated_error
from meshlab_specsmooth.meshlab.signatures import compute_scalar_by_noise_level as compute_scalar_by_noise_level
from meshlab_specsmooth.meshlab.signatures import (
    compute_scalar_by_spectral_displacement as compute_scalar_by_spectral_displacement,
)
from meshlab_specsmooth.meshlab.signatures import get_spectrum as get_spectrum
from meshlab_specsmooth.noise.model import Noise as Noise
from meshlab_specsmooth.operators.assemble import Operators as Operators
from meshlab_specsmooth.operators.assemble import assemble as assemble
from meshlab_specsmooth.power_spectrum import Spectrum as Spectrum
from meshlab_specsmooth.power_spectrum import spectrum as spectrum
from meshlab_specsmooth.report.compared import compare as compare
from meshlab_specsmooth.report.fields import draw_field as draw_field
from meshlab_specsmooth.risk.estimate_error import ErrorEstimate as ErrorEstimate
from meshlab_specsmooth.risk.estimate_error import estimate_error as estimate_error
from meshlab_specsmooth.risk.estimate_error import estimate_noise as estimate_noise
from meshlab_specsmooth.runtime.bars import show_progress as show_progress
from meshlab_specsmooth.runtime.workspace import Workspace as Workspace
from meshlab_specsmooth.smoothing.api import choose as choose
from meshlab_specsmooth.smoothing.api import enhance as enhance
from meshlab_specsmooth.smoothing.api import low_pass as low_pass
from meshlab_specsmooth.smoothing.api import smooth as smooth
from meshlab_specsmooth.smoothing.choice import Choice as Choice
from meshlab_specsmooth.smoothing.choice import ConsideredSetting as ConsideredSetting
from meshlab_specsmooth.smoothing.result import SmoothingResult as SmoothingResult
from meshlab_specsmooth.smoothing.settings import Enhancement as Enhancement
from meshlab_specsmooth.smoothing.settings import LowPass as LowPass
from meshlab_specsmooth.smoothing.settings import Region as Region
from meshlab_specsmooth.smoothing.settings import Smoothing as Smoothing
from meshlab_specsmooth.spectral.low_pass import Butterworth as Butterworth
from meshlab_specsmooth.spectral.low_pass import Gaussian as Gaussian
from meshlab_specsmooth.spectral.low_pass import Heat as Heat
from meshlab_specsmooth.spectral.low_pass import Ideal as Ideal
from meshlab_specsmooth.spectral.response import Response as Response

__version__: str

"""What comes of it: the surface, the setting, and what else was considered."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from meshlab_specsmooth.adapters import Source, WithMesh
from meshlab_specsmooth.noise import Noise
from meshlab_specsmooth.surface import Floats

DRAWN_IN = "drawn in"


@dataclass(frozen=True)
class Setting:
    """One setting of the filter.

    Attributes
    ----------
    start : {"given", "smoothed", "drawn in"}
        What the first pass takes its normals and vertices from: the surface as given, for hard edges, or the
        isotropically smoothed one, for organic shapes. ``"drawn in"``, with 0 passes: impulses are drawn in before the
        isotropic filter, as :func:`meshlab_specsmooth.smooth` does.
    strength : float
        t > 0 of the low-pass (I + t L_w)^-1.
    range_width : float
        Standard deviation of the weights over the distance of unit normals.
    passes : int
        0 is the isotropically smoothed surface.
    barycenter_weight : float
        w of the isotropic filter, which the first pass is guided by or starts from.
    """

    start: str
    strength: float
    range_width: float
    passes: int
    barycenter_weight: float


@dataclass(frozen=True)
class Considered:
    """A setting and its estimated root mean square error along the normals, in mesh units.

    What is below ``noise.resolution`` cannot be told from none; 0 where the estimate came out below zero.
    """

    setting: Setting
    error: float


@dataclass(frozen=True, eq=False)
class EdgeAwareResult(WithMesh):
    """The smoothed surface, and the evidence.

    Attributes
    ----------
    vertices : (n, 3) float64
        In mesh units; vertices that no face refers to are where they were, to the bit.
    noise : Noise
        What was measured of the input.
    level : float
        Standard deviation of the noise along the normals that the choice went by, in mesh units.
    start, strength, range_width, passes
        The setting, see :class:`Setting`.
    barycenter_weight : float
        w of the isotropic guide.
    error : float
        Estimated root mean square error along the normals, in mesh units. What is below ``noise.resolution`` cannot be
        told from none; 0 where the estimate came out below zero, NaN where nothing was to be chosen.
    considered : tuple of Considered
        All settings that were tried: the choice, then from the least error on. The choice is within 1 % of the least
        and lets the least noise through.
    flips : int
        Faces of the result that look away by more than 90 degrees from where the smoothed surface's do, or from where
        their neighbours do.
    volume_change : float
        In per cent; NaN of an open surface.
    displacement : float
        Root mean square distance between input and result, in mesh units.
    kernels : str
        ``"numba"`` where the extra ``fast`` is installed, else ``"scipy"``.
    warning : str or None
        What the choice could not take into account, and what was left alone for that.
    seconds : float
    creases : int
        Number of edges that nothing crosses, as given or found by their angle.
    welded : int
        Vertices that lie where another one does, and moved with it.
    outliers : (k,) int64
        Single stray vertices that were put where their neighbors expect them, where the setting was chosen.
    source : Source or None
        The mesh that was given, for ``mesh``.
    """

    vertices: Floats
    noise: Noise
    level: float
    start: str
    strength: float
    range_width: float
    passes: int
    barycenter_weight: float
    error: float
    considered: tuple[Considered, ...]
    flips: int
    volume_change: float
    displacement: float
    kernels: str
    warning: str | None
    seconds: float
    creases: int = 0
    welded: int = 0
    outliers: npt.NDArray[np.int64] = field(default_factory=lambda: np.empty(0, dtype=np.int64))
    source: Source | None = field(default=None, repr=False)

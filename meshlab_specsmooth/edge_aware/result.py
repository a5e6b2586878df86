"""What comes of it: the surface, the setting, and what else was considered."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from meshlab_specsmooth.adapters import Source, WithMesh
from meshlab_specsmooth.arrays import Floats
from meshlab_specsmooth.describe import Described, Pictured, Rows, count_of, format_length
from meshlab_specsmooth.geometry.surface import Surface
from meshlab_specsmooth.noise.estimate import Noise
from meshlab_specsmooth.sentences import describe_strays, describe_unmoved, moved_rows

CLIPPED = "clipped"


@dataclass(frozen=True)
class Setting:
    """One setting of the filter.

    Attributes
    ----------
    start : {"given", "smoothed", "clipped"}
        What the first pass takes its normals and vertices from: the surface as given, for hard edges, or the
        isotropically smoothed one, for organic shapes. ``"clipped"``, with 0 iterations: impulses are clipped before
        the isotropic filter, as :func:`meshlab_specsmooth.smooth` does.
    strength : float
        t > 0 of the low-pass (I + t L_w)^-1.
    range_sigma : float
        Standard deviation of the weights over the distance of unit normals.
    iterations : int
        0 is the isotropically smoothed surface.
    barycenter_weight : float
        w of the isotropic filter, which the first pass is guided by or starts from.
    """

    start: str
    strength: float
    range_sigma: float
    iterations: int
    barycenter_weight: float

    @property
    def is_isotropic(self) -> bool:
        """Whether it is the isotropic filter alone."""
        return self.iterations == 0

    def describe(self) -> str:
        """The filter and its strength in words."""
        if self.is_isotropic:
            first = "impulses clipped, then " if self.start == CLIPPED else ""
            return f"{first}isotropic smoothing, barycenter weight {self.barycenter_weight:.3g}"
        return f"edge-aware smoothing, {count_of(self.iterations, 'iteration')}"


@dataclass(frozen=True)
class Considered:
    """A setting and its estimated root mean square error along the normals, in mesh units.

    What is below ``noise.resolution`` cannot be told from none; 0 where the estimate came out below zero.
    """

    setting: Setting
    error: float


@dataclass(frozen=True, eq=False, repr=False)
class EdgeAwareResult(WithMesh, Described):
    """The smoothed surface, and the evidence.

    Attributes
    ----------
    vertices : (n, 3) float64
        In mesh units; vertices that no face refers to are where they were, to the bit.
    noise : Noise
        What was measured of the input.
    level : float
        Standard deviation of the noise along the normals that the choice went by, in mesh units.
    start, strength, range_sigma, iterations
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
        their neighbors do.
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
    given : Surface or None
        The input, for a notebook's picture of before and after.
    """

    vertices: Floats
    noise: Noise
    level: float
    start: str
    strength: float
    range_sigma: float
    iterations: int
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
    given: Surface | None = None

    @property
    def summary(self) -> str:
        """What was taken, and why, in a sentence."""
        if self.displacement == 0:
            return describe_unmoved(self.noise, self.warning)
        if not self.considered:
            return describe_strays(self.noise, len(self.outliers))
        taken, noise = self.considered[0], self.noise
        if len(self.considered) == 1:
            return f"{taken.setting.describe()} as given; moved by {format_length(self.displacement, noise.mean_edge)}"
        if math.isnan(taken.error):
            why = "what has the least estimated error would change the shape by more than noise explains"
        else:
            why = f"estimated error {noise.format_error(taken.error)} edges{self._describe_other(taken)}"
        return f"took {taken.setting.describe()}: {why}; {noise.summary}"

    def _describe_other(self, taken: Considered) -> str:
        """The least error of the other filter, if it was tried: the edge-aware or the isotropic one."""
        others = [row.error for row in self.considered if row.setting.is_isotropic != taken.setting.is_isotropic]
        name = "edge-aware" if taken.setting.is_isotropic else "isotropic"
        if not others:
            return ""
        error = self.noise.format_error(min(others))
        return f"; {name} {'as well' if error == self.noise.format_error(taken.error) else error}"

    def rows(self) -> Rows:
        """What was found and done, and how far vertices moved."""
        edge, rows = self.noise.mean_edge, [("noise", self.noise.describe_level())]
        if self.considered and not math.isnan(self.error):
            rows.append(("estimated error", self.noise.describe_error(self.error)))
        if len(self.considered) > 1:
            rows.append(("considered", f"{len(self.considered)} settings"))
        if self.iterations:
            start = "the surface as given" if self.start == "given" else "the smoothed surface"
            rows.append(("setting", f"from {start}, strength {self.strength:.3g}, range sigma {self.range_sigma:.2g}"))
        if self.creases:
            rows.append(("creases", f"{self.creases} edges that nothing crosses"))
        if self.flips:
            rows.append(("turned over", f"{self.flips} faces"))
        if not math.isnan(self.volume_change):
            rows.append(("volume", f"{self.volume_change:+.2f} %"))
        strays, seconds = len(self.outliers), self.seconds
        return [*rows, *moved_rows(self.displacement, edge, strays, self.welded, seconds, self.warning)]

    def pictured(self) -> Pictured | None:
        """Before and after."""
        return None if self.given is None else (self.given.vertices, self.vertices, self.given.faces)

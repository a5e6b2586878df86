"""The result of an edge-aware filter: the surface, the setting, and the settings that were considered."""

from __future__ import annotations

import math
from dataclasses import dataclass

from meshlab_specsmooth.describe import Rows, format_length
from meshlab_specsmooth.edge_aware.settings import GIVEN, EdgeAware
from meshlab_specsmooth.noise.model import STAIRCASE, Noise
from meshlab_specsmooth.smoothing.result import FilterResult


@dataclass(frozen=True)
class Considered:
    """A setting and its estimated root mean square error along the normals, in mesh units.

    Below ``noise.resolution`` the error cannot be distinguished from zero; it is 0 where the estimate is negative.
    """

    setting: EdgeAware
    error: float


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class EdgeAwareResult(FilterResult):
    """The smoothed surface, and the evidence. Further fields are those of :class:`SmoothingResult`'s base.

    Attributes
    ----------
    noise : Noise
        Of the input.
    level : float
        Standard deviation of the noise along the normals that the choice assumed, in mesh units.
    start, strength, range_sigma, iterations
        The setting, see :class:`EdgeAware`; strength and range sigma are 0 for the isotropic filter.
    barycenter_weight : float
        w of the isotropic guide.
    error : float
        Estimated root mean square error along the normals, in mesh units. Below ``noise.resolution`` it cannot be
        distinguished from zero; 0 where the estimate is negative, NaN where nothing was chosen.
    considered : tuple of Considered
        All settings that were tried: the choice, then from the least error on. The error of the choice is within 1 % of
        the least, and it lets the least noise through.
    flips : int
        Faces of the result that look away by more than 90 degrees from where the smoothed surface's do, or from where
        their neighbors do.
    volume_change : float
        In per cent; NaN for an open surface.
    creases : int
        Number of edges that nothing crosses, as given or found by their angle.
    """

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
    creases: int = 0

    @property
    def setting(self) -> EdgeAware | None:
        """The setting that was used, complete; None where nothing was done."""
        return self.considered[0].setting if self.considered else None

    @property
    def summary(self) -> str:
        """The setting and the reason for it, in a sentence."""
        if self.displacement == 0:
            return self._describe_unmoved(self.noise)
        if not self.considered:
            return self._describe_strays(self.noise)
        used, noise = self.considered[0], self.noise
        if noise.kind == STAIRCASE and used.setting.is_isotropic:
            return f"{used.setting.describe()}, as far as the voxels allow; {noise.summary}"
        if len(self.considered) == 1:
            return f"{used.setting.describe()} as given; moved by {format_length(self.displacement, noise.mean_edge)}"
        if math.isnan(used.error):
            reason = "what has the least estimated error would change the shape by more than noise explains"
        else:
            reason = f"estimated error {noise.format_error(used.error)} edges{self._describe_other(used)}"
        return f"took {used.setting.describe()}: {reason}; {noise.summary}"

    def _describe_other(self, used: Considered) -> str:
        """The least error of the other filter, if it was tried: the edge-aware or the isotropic one."""
        others = [each.error for each in self.considered if each.setting.is_isotropic != used.setting.is_isotropic]
        name = "edge-aware" if used.setting.is_isotropic else "isotropic"
        if not others:
            return ""
        error = self.noise.format_error(min(others))
        return f"; {name} {'as well' if error == self.noise.format_error(used.error) else error}"

    def rows(self) -> Rows:
        """Noise, error, setting, and how far vertices moved."""
        edge, rows = self.noise.mean_edge, [("noise", self.noise.describe_level())]
        if self.considered and not math.isnan(self.error):
            rows.append(("estimated error", self.noise.describe_error(self.error)))
        if len(self.considered) > 1:
            rows.append(("considered", f"{len(self.considered)} settings"))
        if self.iterations:
            start = "the surface as given" if self.start == GIVEN else "the smoothed surface"
            rows.append(("setting", f"from {start}, strength {self.strength:.3g}, range sigma {self.range_sigma:.2g}"))
        if self.creases:
            rows.append(("creases", f"{self.creases} edges that nothing crosses"))
        if self.flips:
            rows.append(("flipped", f"{self.flips} faces"))
        if not math.isnan(self.volume_change):
            rows.append(("volume", f"{self.volume_change:+.2f} %"))
        return [*rows, *self._final_rows(edge)]

"""A choice as the user sees it: the setting of least estimated error, and the table of those that were considered."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from meshlab_specsmooth.describe import Described, Rows
from meshlab_specsmooth.errors import InvalidParameter
from meshlab_specsmooth.noise.model import Noise
from meshlab_specsmooth.operators.assemble import Operators
from meshlab_specsmooth.runtime import blocks
from meshlab_specsmooth.runtime.progress import Progress
from meshlab_specsmooth.smoothing.automatic import choose_setting
from meshlab_specsmooth.smoothing.region import check_region
from meshlab_specsmooth.smoothing.result import format_weight
from meshlab_specsmooth.smoothing.settings import Region, Smoothing

# Settings in a printed table.
_MAX_SHOWN = 12


@dataclass(frozen=True)
class ConsideredSetting:
    """A setting and its estimated root mean square error along the normals, in mesh units.

    Below ``noise.resolution`` the error cannot be distinguished from zero; it is 0 where the estimate is negative.
    """

    setting: Smoothing
    error: float


@dataclass(frozen=True, eq=False, repr=False)
class Choice(Described):
    """The setting of least estimated error, and the evidence.

    Attributes
    ----------
    setting : Smoothing
    noise : Noise
        In mesh units.
    estimated_error : float
        Of the setting, in mesh units.
    considered : tuple of ConsideredSetting
        The settings that were evaluated, from the least error on; the choice is interpolated between them. Empty where
        there was nothing to choose.
    """

    setting: Smoothing
    noise: Noise
    estimated_error: float
    considered: tuple[ConsideredSetting, ...]

    @staticmethod
    def of(ops: Operators, setting: Smoothing, region: Region, progress: Progress | None = None) -> Choice:
        """Choose for a mesh."""
        if setting.barycenter_weight is not None:
            raise InvalidParameter("barycenter_weight is given; there is nothing to choose")
        if len(ops.active) == 0:
            raise InvalidParameter("a mesh without edges has no noise to choose by")
        check_region(ops, region)
        with blocks.one_blas_thread():
            chosen = choose_setting(ops, setting, region, progress)

        def in_mesh_units(risk: float) -> float:
            return float(np.ldexp(np.sqrt(max(risk, 0.0)), ops.exponent))

        considered = [
            ConsideredSetting(
                replace(setting, low_pass=chosen.candidates[each.low_pass], barycenter_weight=each.weight),
                in_mesh_units(each.risk),
            )
            for each in chosen.choice.considered
        ]
        return Choice(
            chosen.setting,
            chosen.choice.noise.scaled(ops.exponent),
            in_mesh_units(chosen.choice.risk),
            tuple(sorted(considered, key=lambda each: each.error)),
        )

    @property
    def summary(self) -> str:
        """The choice and the noise in a sentence."""
        if self.noise.is_left_alone:
            return f"nothing to choose: {self.noise.summary}"
        error = self.noise.format_error(self.estimated_error)
        weight = format_weight(self.setting.barycenter_weight or 0.0)
        return f"barycenter weight {weight} by estimated error {error} edges; {self.noise.summary}"

    def rows(self) -> Rows:
        """The choice, and the settings of least estimated error that it was interpolated from."""
        shown = [ConsideredSetting(self.setting, self.estimated_error), *self.considered[:_MAX_SHOWN]]
        return [(self.noise.describe_error(each.error), repr(each.setting)) for each in shown]

"""What was done to a file in pieces."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from meshlab_specsmooth.describe import Described, Rows, count_of, format_length
from meshlab_specsmooth.edge_aware.settings import EdgeAware
from meshlab_specsmooth.noise.model import Noise


@dataclass(frozen=True, repr=False)
class PiecesResult(Described):
    """What was done to a file in pieces.

    Attributes
    ----------
    output : str
    vertices, faces : int
    filter : {"isotropic", "edge_aware"}
    pieces : int
    rings : int
        Of the margin of each piece.
    setting : dict
        Of all pieces. ``bands`` has the weight, or the setting of the edge-aware filter, for each level of the noise:
        one, unless that is treated by region.
    noise : Noise or None
        Of samples from all over the mesh; None if the weight was given.
    displacement : float
        Root mean square, in mesh units.
    volume_change : float or None
        Relative, of the whole; None if it is open, or has no volume.
    mean_edge : float
    seconds : float
    warning : str or None
    """

    output: str
    vertices: int
    faces: int
    filter: str
    pieces: int
    rings: int
    setting: dict[str, Any]
    noise: Noise | None
    displacement: float
    volume_change: float | None
    mean_edge: float
    seconds: float
    warning: str | None = None

    @property
    def summary(self) -> str:
        """Summary of the result in one sentence."""
        if self.displacement == 0:
            return f"{self.vertices} vertices left as they are: {self.warning}"
        noise = "" if self.noise is None else f"; {self.noise.summary}"
        settings = [_describe(band) for band in self.setting["bands"]]
        return (
            f"{self.vertices} vertices in {count_of(self.pieces, 'piece')} with {self.rings} rings of margin: "
            f"{', '.join(settings)}{noise}"
        )

    def rows(self) -> Rows:
        """Return names and values to display below the summary."""
        rows = [("moved", f"{format_length(self.displacement, self.mean_edge)} (RMS)")]
        if self.volume_change is not None:
            rows.append(("volume", f"{100 * self.volume_change:+.3f} %"))
        rows += [("mean edge", f"{self.mean_edge:.4g}"), ("time", f"{self.seconds:.1f} s")]
        return rows if self.warning is None else [*rows, ("warning", self.warning)]


def _describe(band: dict[str, Any]) -> str:
    """The setting of a band in words."""
    if band["barycenter_weight"] is None:
        return "nothing where there is no noise"
    if band["edge_aware"] is not None:
        return EdgeAware(**band["edge_aware"]).describe()
    return f"barycenter weight {band['barycenter_weight']:.3g}"

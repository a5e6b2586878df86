"""The kinds of noise, and :class:`Noise`: level, kind and evidence."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from meshlab_specsmooth.arrays import Floats
from meshlab_specsmooth.describe import Described, Rows, format_bound, format_edges, format_length

NONE, WHITE, DIRECTIONAL, QUANTIZED = "none", "white", "directional", "quantized"
IMPULSE, CORRELATED, UNCLEAR = "impulse", "correlated", "unclear"
STAIRCASE = "staircase"
KINDS = (NONE, WHITE, DIRECTIONAL, QUANTIZED, IMPULSE, CORRELATED, UNCLEAR, STAIRCASE)

# Below this fraction of an edge nothing is called noise: it tilts normals by a degree or two, and the triangles of any
# real mesh leave as much (an unsmoothed scan of 28 000 vertices has 0.015, a coarse model of 3000 more).
# docs/constants.md: NEGLIGIBLE
NEGLIGIBLE = 0.02

#: Number of powers of L, and of bands of wavelength, in which a level is measured.
POWER_COUNT, BAND_COUNT = 4, 6

# Quantiles of a level that varies.
_SHOWN = (0.1, 0.9)

# Fields of :class:`Noise` that are lengths, and tuples of lengths.
LENGTHS = ("level", "low", "high", "mean_edge", "correlated_level")
LEVELS = ("levels_by_power", "levels_by_band", "spacing")


@dataclass(frozen=True, eq=False, repr=False)
class Noise(Described):
    """How much noise, of what kind, and the evidence. Lengths are in mesh units.

    Attributes
    ----------
    level : float
        Standard deviation along the normals.
    low, high : float
        95 % confidence interval of the level, if the kind is right. For ``"correlated"`` it is a factor of two either
        way, since the long waves of such noise cannot be separated from shape.
    kind : {"none", "white", "directional", "quantized", "impulse", "correlated", "unclear", "staircase"}
        ``"none"``: below 2 % of an edge. ``"white"``: independent from vertex to vertex. ``"directional"``: white,
        and along one direction mostly, as along the line of sight. ``"quantized"``: coordinates rounded to a lattice.
        ``"impulse"``: some vertices far off.
        ``"correlated"``: correlated between neighbors. ``"unclear"``: the triangles are too uneven, too coarse or too
        few to separate noise from shape; the level is then 0, and ``high`` the level if nothing were shape.
        ``"staircase"``: the surface of a binary mask, whose steps are known to be within half a voxel.
    mean_edge : float
        Of the mesh as given; noise makes edges longer.
    levels_by_power : (4,) tuple of float
        Levels from L, L^2, L^3, L^4: alike for white noise, falling for correlated noise, rising for impulses.
    levels_by_band : (6,) tuple of float
        Levels in bands of wavelength, each an octave of eigenvalues below the one before.
    kurtosis : float
        Excess kurtosis of the residual: 0 for white noise, above 3 for impulses, and for clean shapes with edges.
    outliers : float
        Fraction of vertices whose residual is beyond three standard deviations (0.003 for white noise).
    correlated_level : float
        The part of the level that is correlated between neighbors: level^2 = correlated_level^2 + white^2; 0 for other
        kinds.
    covariance : (3, 3) float64
        Of the noise vector of a vertex, in units of the squared level, so far as it is seen along the normals.
    impulse_density : float
        Fraction of the vertices that have noise: below 1 for impulses.
    reason : str or None
        Why noise and shape cannot be separated, or why the measured level may be something other than noise.
    spacing : (3,) tuple of float
        Sides of the voxels of a staircase; empty for other kinds.
    local : (n,) float64 or None
        The level at each vertex of the mesh, where it was measured: by ``estimate_noise``, and by the filters where it
        is not the same everywhere. 0 where there is none.
    varies : bool
        Whether the level is not the same everywhere: ``level`` is then the root mean square where there is noise.

    Examples
    --------
    >>> import numpy as np
    >>> import meshlab_specsmooth as mss
    >>> x, y = (a.ravel() for a in np.meshgrid(np.arange(40.0), np.arange(40.0)))
    >>> at = (np.arange(39)[:, None] * 40 + np.arange(39)).ravel()
    >>> faces = np.concatenate([np.c_[at, at + 1, at + 41], np.c_[at, at + 41, at + 40]])
    >>> flat = np.c_[x, y, 0.2 * np.random.default_rng(0).standard_normal(1600)]
    >>> noise = mss.estimate_noise(flat, faces)
    >>> noise.kind, round(noise.level, 1), noise.low < 0.2 < noise.high
    ('white', 0.2, True)
    """

    level: float
    low: float
    high: float
    kind: str
    mean_edge: float
    levels_by_power: tuple[float, ...]
    levels_by_band: tuple[float, ...]
    kurtosis: float
    outliers: float
    correlated_level: float
    covariance: Floats
    impulse_density: float = 1.0
    reason: str | None = None
    spacing: tuple[float, ...] = ()
    local: Floats | None = field(default=None, repr=False)
    varies: bool = False

    @property
    def warning(self) -> str | None:
        """What limits a choice by this noise, in a sentence."""
        if self.kind == UNCLEAR:
            return f"nothing is moved, as noise cannot be separated from shape: {self.reason}"
        if self.kind == CORRELATED:
            return (
                "the noise is correlated between neighbors; its low frequencies cannot be separated from shape, so the "
                "level and the strength are unreliable"
            )
        if self.reason is not None:
            return (
                f"{self.reason}: such steps are not noise, so the strength is unreliable; give one (barycenter_weight "
                "0.05 to 0.1)"
            )
        return None

    @property
    def is_left_alone(self) -> bool:
        """Whether there is nothing to remove, or nothing that can be separated from shape."""
        return self.kind in (NONE, UNCLEAR)

    @property
    def resolution(self) -> float:
        """The smallest error that an estimate can distinguish from zero, in mesh units: sqrt(level (high - level)).

        The error of an estimated squared error is about twice the level times the error of the level. For an unclear
        level it is the bound.
        """
        if self.kind == UNCLEAR:
            return self.high
        if self.kind == STAIRCASE:  # how far each vertex is off is not random
            return self.level
        return float(np.sqrt(self.level * (self.high - self.level)))

    @property
    def level_in_edges(self) -> float:
        """The level in mean edges of the mesh as given; 0 where no edge has a length."""
        return self.level / self.mean_edge if self.mean_edge else 0.0

    def format_error(self, error: float) -> str:
        """An estimated error in mean edges: "at most" where it cannot be distinguished from zero, and never 0."""
        if not error > self.resolution:
            return format_bound(self.resolution, self.mean_edge)
        return format_edges(error, self.mean_edge)

    def describe_error(self, error: float) -> str:
        """The same with the unit, and in mesh units."""
        return f"{self.format_error(error)} edges ({max(error, self.resolution):.3g})"

    @property
    def summary(self) -> str:
        """Kind and level in a few words."""
        if self.kind == NONE:
            return f"no noise (below {100 * NEGLIGIBLE:g} % of an edge)"
        if self.kind == UNCLEAR:
            return f"noise cannot be separated from shape: {self.reason}"
        return self.describe_level() if self.kind == STAIRCASE else f"noise {self.describe_level()}"

    def describe_level(self) -> str:
        """Kind and level for tables."""
        if self.kind == NONE:
            return f"none (below {100 * NEGLIGIBLE:g} % of an edge)"
        if self.kind == UNCLEAR:
            return f"unclear: {self.reason}"
        if self.kind == STAIRCASE:
            return f"staircase of voxels of {' x '.join(f'{side:.3g}' for side in self.spacing)}"
        return f"{self.kind} {format_length(self.level, self.mean_edge)}"

    def rows(self) -> Rows:
        """Kind, level, interval and details."""
        edge = self.mean_edge
        rows = [("kind", self.kind), ("level", format_length(self.level, edge))]
        if self.kind == UNCLEAR:
            rows[1:] = [("level", f"{format_bound(self.high, edge)} edges ({self.high:.3g})")]
        elif self.kind != NONE:
            rows.append(("interval", f"{format_edges(self.low, edge)} to {format_length(self.high, edge)}"))
        if self.correlated_level:
            rows.append(("correlated", f"{format_length(self.correlated_level, edge)} of it between neighbors"))
        if self.impulse_density < 1:
            rows.append(("impulses", f"at {100 * self.impulse_density:.3g} % of the vertices"))
        if self.varies and self.local is not None:
            low, high = np.quantile(self.local[self.local > 0], _SHOWN)
            rows.append(("varies", f"from {format_edges(low, edge)} to {format_length(high, edge)} over the surface"))
        rows.append(("mean edge", f"{edge:.4g}"))
        return rows if self.warning is None else [*rows, ("warning", self.warning)]

    def scaled(self, exponent: int, factor: float = 1.0) -> Noise:
        """The same noise with lengths times ``factor`` 2^exponent."""
        lengths = {
            name: np.ldexp(np.multiply(getattr(self, name), factor), exponent).tolist() for name in (*LENGTHS, *LEVELS)
        }
        local = None if self.local is None else np.ldexp(self.local * factor, exponent)
        return replace(self, **lengths | {name: tuple(lengths[name]) for name in LEVELS}, local=local)

    @staticmethod
    def zero(mean_edge: float) -> Noise:
        """No noise, on a mesh with edges of that length."""
        powers, bands = (0.0,) * POWER_COUNT, (0.0,) * BAND_COUNT
        return Noise(0.0, 0.0, 0.0, NONE, mean_edge, powers, bands, 0.0, 0.0, 0.0, np.zeros((3, 3)))

    def unclear(self, bound: float, reason: str) -> Noise:
        """The same evidence, but noise and shape cannot be separated; ``bound`` is the level if nothing were shape."""
        return replace(
            self,
            level=0.0,
            low=0.0,
            high=bound,
            kind=UNCLEAR,
            correlated_level=0.0,
            covariance=np.zeros((3, 3)),
            reason=reason,
            varies=False,
        )

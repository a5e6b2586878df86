"""Settings of the edge-aware filter, and where it acts."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy.typing as npt

from meshlab_specsmooth.describe import count_of
from meshlab_specsmooth.parameters import (
    MAX_FACE_ITERATIONS,
    RANGE_SIGMA_BOUNDS,
    STRENGTH_BOUNDS,
    check_barycenter_weight,
    check_choice,
    check_count,
    check_number,
)
from meshlab_specsmooth.smoothing.settings import Region, Setting, check_spacing

#: What the first iteration filters; ``"clipped"`` is the isotropic filter after clipping impulses, without iterations.
GIVEN, SMOOTHED, CLIPPED = "given", "smoothed", "clipped"
STARTS = ("auto", GIVEN, SMOOTHED, CLIPPED)


@dataclass(frozen=True, eq=False, repr=False)
class EdgeAware(Setting):
    """The three steps on face normals: noise is removed, and edges are kept.

    Parameters
    ----------
    strength : float, optional
        t, from 2.2e-16 to 4.5e15; 0.1 is gentle, 2 to 6 suits hard edges under much noise. Chosen by estimated error if
        not given.
    range_sigma : float, optional
        Standard deviation of the weights over the distance of unit normals, from 2.2e-16 to 6.7e7: 0.2 for hard edges,
        0.6 for organic shapes. Chosen if not given.
    iterations : int, optional
        0 to 100; 0 is the isotropic filter alone. Chosen if not given.
    start : {"auto", "given", "smoothed", "clipped"}
        What the first iteration filters: the surface as given, for hard edges, or the isotropically smoothed one, for
        organic shapes. ``"auto"`` chooses; if nothing else is left to be chosen, it is as given. ``"clipped"``, with 0
        iterations, is the isotropic filter after clipping impulses.
    barycenter_weight : float, optional
        w > 0 of the isotropic filter, which guides the first iteration, or which it starts from. By the noise if not
        given.

    Examples
    --------
    >>> import meshlab_specsmooth as mss
    >>> mss.EdgeAware(strength=2, range_sigma=0.3, iterations=3)
    EdgeAware(strength=2.0, range_sigma=0.3, iterations=3)
    """

    strength: float | None = None
    range_sigma: float | None = None
    iterations: int | None = None
    start: str = "auto"
    barycenter_weight: float | None = None

    def __post_init__(self) -> None:
        weight = self.barycenter_weight
        self._set(
            strength=None if self.strength is None else check_number("strength", self.strength, *STRENGTH_BOUNDS),
            range_sigma=None
            if self.range_sigma is None
            else check_number("range_sigma", self.range_sigma, *RANGE_SIGMA_BOUNDS),
            iterations=None
            if self.iterations is None
            else check_count("iterations", self.iterations, 0, MAX_FACE_ITERATIONS),
            start=check_choice("start", self.start, STARTS),
            barycenter_weight=None if weight is None else check_barycenter_weight(weight),
        )

    @property
    def is_automatic(self) -> bool:
        """Whether all of it is to be chosen."""
        return self == EdgeAware()

    @property
    def is_isotropic(self) -> bool:
        """Whether it is the isotropic filter alone."""
        return self.iterations == 0

    def complete(self, weight: float) -> EdgeAware | None:
        """The setting with ``weight`` and a start where these are not given; None if anything else is to be chosen."""
        if self.iterations != 0 and None in (self.strength, self.range_sigma, self.iterations):
            return None
        default = SMOOTHED if self.is_isotropic else GIVEN
        start = default if self.start == "auto" else self.start
        return replace(self, start=start, barycenter_weight=self.barycenter_weight or weight)

    def describe(self) -> str:
        """The filter and its strength in words."""
        if self.is_isotropic:
            first = "impulses clipped, then " if self.start == CLIPPED else ""
            return f"{first}isotropic smoothing, barycenter weight {self.barycenter_weight or 0.0:.3g}"
        return f"edge-aware smoothing, {count_of(self.iterations or 0, 'iteration')}"


@dataclass(frozen=True, eq=False, repr=False)
class Denoising(Setting):
    """The isotropic or the edge-aware filter, whichever has the least estimated error.

    Parameters
    ----------
    spacing : float or (3,) floats, optional
        Sides of the voxels, in mesh units and along x, y and z, where the surface was made from a binary mask: it is
        then smoothed as far as nearly all vertices stay within about half a voxel of where they were. Recognized if not
        given, where the mesh is unchanged but for its position, orientation and scale.
    """

    spacing: float | tuple[float, float, float] | None = None

    def __post_init__(self) -> None:
        self._set(spacing=None if self.spacing is None else check_spacing(self.spacing))


@dataclass(frozen=True, eq=False, repr=False)
class EdgeAwareRegion(Region):
    """Where an edge-aware filter acts, and the edges that it does not cross.

    Parameters
    ----------
    boundary : {"auto", "fixed", "curve", "free"}
        Treatment of the boundary of an open surface. ``"auto"``: it follows the normals of its faces, and is not pulled
        inward. ``"fixed"``: it stays to the bit, so that tiles with a common edge still fit. ``"curve"``: it is
        smoothed along itself, as by :func:`meshlab_specsmooth.smooth`. ``"free"``: it is treated like the rest.
    mask : (n,) array of weights in [0, 1] or of bool, optional
        Vertices that may move: those whose weight is above 0. The others stay to the bit, and the displacement fades
        out toward them over four rings of edges. Where there are 200 or more, the noise is estimated and the setting
        chosen on these alone.
    feature_gain : float
        A feature's displacement is multiplied by 1 - feature_gain * weight: 0 smooths it like the rest, 1 keeps it
        where it is, above 1 enhances what smoothing would remove. Without ``features`` it has no effect.
    creases : (k, 2) array of integers, or float, optional
        Edges that nothing crosses: as pairs of vertices, or all edges whose faces' normals differ by more than an angle
        in degrees. Faces on opposite sides exchange no normals: two faces are neighbors only where they are linked
        around a common vertex without crossing a crease, and never if they share a crease. The isotropic guide leaves
        the creases' vertices in place and is computed on each side by itself; afterward these vertices follow the faces
        of both sides. The choice and the units are common to the whole surface. The angle is measured on the surface as
        given where that has no noise, else between normals after a first edge-aware low-pass, as noise tilts faces by
        more than the angle of many edges. That finds hard edges, of 45 degrees and more; those of a smaller angle are
        better given as pairs.
    """

    creases: npt.ArrayLike | float | None = None

"""A region resolved on a mesh: the vertices that may move, the fraction of a displacement that each makes, creases."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from meshlab_specsmooth.arrays import Booleans, Floats, Integers
from meshlab_specsmooth.edge_aware.settings import EdgeAwareRegion
from meshlab_specsmooth.errors import InvalidParameter
from meshlab_specsmooth.geometry.surface import Surface
from meshlab_specsmooth.graph.creases import edge_keys, sort_halfedges
from meshlab_specsmooth.operators.boundary import fade
from meshlab_specsmooth.operators.patches import MIN_COUNTED
from meshlab_specsmooth.parameters import check_number, check_weights
from meshlab_specsmooth.smoothing.region import ALL_KEPT, NOTHING_SELECTED


@dataclass(frozen=True, eq=False)
class FaceRegion:
    """Where the filter acts; None means no restriction.

    Attributes
    ----------
    boundary : {"auto", "fixed", "curve", "free"}
    inside : (n,) bool or None
        Vertices that may move.
    kept : (n,) float64 or None
        Fraction of its displacement that a vertex does not make: feature gain times feature weight.
    creases : (k, 2) int32 or None
        Edges that nothing crosses.
    angle : float or None
        In degrees: edges whose faces' normals differ by more are creases.
    """

    boundary: str = "auto"
    inside: Booleans | None = None
    kept: Floats | None = None
    creases: Integers | None = None
    angle: float | None = None

    def renumbered(self, index: Integers, count: int) -> FaceRegion:
        """The same on ``count`` other vertices: each vertex becomes number ``index``, or none where that is -1.

        Where several vertices become one, it may move if all of them may, and keeps the largest of their fractions.
        """
        inside, kept, creases = self.inside, self.kept, self.creases
        used = np.flatnonzero(index >= 0)
        if inside is not None:
            outside = used[~inside[used]]
            inside = np.ones(count, dtype=np.bool_)
            inside[index[outside]] = False
        if kept is not None:
            most = np.zeros(count)
            np.maximum.at(most, index[used], kept[used])
            kept = most
        if creases is not None:
            creases = index[creases]
            creases = creases[creases[:, 0] != creases[:, 1]]
        return FaceRegion(self.boundary, inside, kept, creases, self.angle)

    def fractions(self, F: Integers, n: int) -> Floats | None:
        """(n,) fraction of its displacement that each vertex makes; None where all make all of it."""
        if self.inside is None and self.kept is None:
            return None
        fraction = np.ones(n) if self.inside is None else _fade_inside(F, self.inside)
        return fraction if self.kept is None else fraction * (1 - self.kept)

    def counted(self, n: int) -> Booleans:
        """(n,) vertices whose noise and error count: those that may move, if they are enough."""
        if self.inside is None or self.inside.sum() < MIN_COUNTED:
            return np.ones(n, dtype=np.bool_)
        return self.inside

    @property
    def warning(self) -> str | None:
        """The reason if nothing can move."""
        if self.inside is not None and not self.inside.any():
            return NOTHING_SELECTED
        if self.kept is not None and (self.kept == 1).all():
            return ALL_KEPT
        return None


def resolve_region(surface: Surface, region: EdgeAwareRegion) -> FaceRegion:
    """The region on a surface.

    Raises
    ------
    InvalidParameter
        Names the parameter, and the first vertex or row that is wrong.
    """
    n = len(surface.vertices)
    inside = None if region.mask is None else check_weights("mask", region.mask, n) > 0
    kept = None if region.features is None else region.feature_gain * check_weights("features", region.features, n)
    pairs, angle = None, None
    if region.creases is not None:
        given = _as_array(region.creases)
        if given.ndim == 0:
            angle = _check_angle(region.creases)
        else:
            pairs = _check_pairs(given, surface.faces, n)
    return FaceRegion(
        region.boundary,
        None if inside is None or inside.all() else inside,
        None if kept is None or not kept.any() else kept,
        pairs,
        angle,
    )


def _check_angle(given: object) -> float:
    angle = check_number("creases", given, 0.0, 180.0, "an angle between 0 and 180 degrees, both excluded")
    if not 0 < angle < 180:
        raise InvalidParameter(f"creases is {angle}; an angle lies between 0 and 180 degrees, both excluded")
    return angle


def _as_array(given: object) -> npt.NDArray[Any]:
    try:
        return np.asarray(given)
    except Exception as error:  # an object may raise anything when an array is made of it
        raise InvalidParameter(f"creases is no array of vertex pairs ({error})") from error


def _check_pairs(array: npt.NDArray[Any], F: Integers, n: int) -> Integers:
    """(k, 2) int32, each an edge of a face."""
    if array.ndim != 2 or array.shape[1] != 2:
        if array.shape == (0,):
            return np.empty((0, 2), dtype=np.int32)
        raise InvalidParameter(f"creases has shape {array.shape}; pass (k, 2) vertex pairs, or an angle in degrees")
    if not np.issubdtype(array.dtype, np.integer):
        raise InvalidParameter(f"creases has entries of type {array.dtype}; vertex pairs are integers")
    outside = ((array < 0) | (array >= n)).any(axis=1)
    if outside.any():
        row = int(np.flatnonzero(outside)[0])
        raise InvalidParameter(f"creases[{row}] is {_show(array[row])}; vertices are numbered from 0 to {n - 1}")
    strange = ~np.isin(edge_keys(array, n), sort_halfedges(F, n).key)
    if strange.any():
        row = int(np.flatnonzero(strange)[0])
        raise InvalidParameter(f"creases[{row}] is {_show(array[row])}, which is no edge of a face")
    return array.astype(np.int32)


def _show(row: npt.NDArray[np.integer]) -> str:
    return f"({row[0]}, {row[1]})"


def _fade_inside(F: Integers, inside: Booleans) -> Floats:
    """A weight that is 0 outside, and rises to 1 over some rings inside."""

    def erode(within: Booleans) -> Booleans:
        kept = within.copy()
        kept[F[~within[F].all(axis=1)]] = False
        return kept

    return fade(inside, erode)

"""Do no harm: a result that changes a shape by more than the noise explains is not handed out as success.

Noise hardly changes a volume, and neither does taking it away; it adds its variance to the size of a shape and to the
squares of its edges. What goes far beyond is shape that was taken for noise, whatever the estimate says. Each connected
component is judged by itself.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from meshlab_specsmooth.arrays import Booleans, Floats, Integers
from meshlab_specsmooth.graph.extent import sum_faces
from meshlab_specsmooth.graph.extent_scipy import measure_faces
from meshlab_specsmooth.noise.model import CORRELATED, QUANTIZED, Noise
from meshlab_specsmooth.runtime import blocks

# Changes below these fractions are of no concern, whatever explains them: of the volume, of the size along each
# principal axis (the standard deviation of the vertices), of the mean square of the edges.
_SMALL_VOLUME, _SMALL_SIZE, _SMALL_EDGE = 0.015, 0.02, 0.25
# A volume that changes by more is not explained by any noise; a mask's staircase is off by half a voxel everywhere.
# docs/constants.md: _MAX_VOLUME, _MAX_VOLUME_OF_MASK
_MAX_VOLUME, _MAX_VOLUME_OF_MASK = 0.03, 0.08
# Changes that are named, and those that a given setting is warned of
_WORTH_SAYING, _LARGE = 0.01, 0.03
# Standard errors of noise that are allowed for, and how many neighbors share correlated noise
# docs/constants.md: _SIGMAS, _CORRELATED_OVER
_SIGMAS, _CORRELATED_OVER = 3.0, 16.0


@dataclass(frozen=True, eq=False)
class ShapeChange:
    """How far shapes changed, one entry a connected component.

    Attributes
    ----------
    volume : (c,) float64
        Change relative to the volume before; NaN of an open component.
    size : (c,) float64
        Largest relative change of the size along a principal axis.
    edge : (c,) float64
        Change of the root mean square of the edges, relative.
    offset : (c,) float64
        How far the vertices would have to move along their normals to bring the volume back, in the units of positions;
        0 of an open component.
    excessive : (c,) bool
        More than the noise explains.
    """

    volume: Floats
    size: Floats
    edge: Floats
    offset: Floats
    excessive: Booleans

    @property
    def is_large(self) -> bool:
        """Whether a volume or a size has changed by per cents."""
        # the size is a number unless it left the range of numbers
        return bool((np.abs(self.volume) > _LARGE).any() or (~(np.abs(self.size) <= _LARGE)).any())

    def describe_replaced(self, what: str) -> str:
        """That another result is returned, and why."""
        return (
            f"{what} returned: the strength that the estimate asks for would change the shape by more than noise "
            f"explains ({self.describe()})"
        )

    def describe(self) -> str:
        """The largest changes, in words."""
        volume = self.volume[np.isfinite(self.volume)]
        parts = [("the volume", volume), ("the size", self.size), ("the edges", self.edge)]
        largest = [(name, x[np.abs(x).argmax()]) for name, x in parts if len(x)]
        return ", ".join(f"{name} by {100 * x:+.1f} %" for name, x in largest if abs(x) >= _WORTH_SAYING)


@dataclass(frozen=True, eq=False)
class Shape:
    """Sums over the vertices and faces of shapes, one entry a connected component; those of its pieces add up.

    Attributes
    ----------
    count, faces : (c,) float64
        Numbers of vertices and faces.
    first : (c, 3) float64
        Sums of the positions.
    second : (c, 3, 3) float64
        Of their products.
    volume, area, squares : (c,) float64
        Signed volumes between the faces and the origin, areas, and the faces' mean squared sides.
    """

    count: Floats
    faces: Floats
    first: Floats
    second: Floats
    volume: Floats
    area: Floats
    squares: Floats

    def covariance(self) -> Floats:
        """(c, 3, 3) of the vertices of each component."""
        mean = self.first / self.count[:, None]
        square = self.second / self.count[:, None, None]
        return np.asarray(square - mean[:, :, None] * mean[:, None, :])


@np.errstate(over="ignore", invalid="ignore")
def measure_shape(
    X: Floats, F: Integers, at: npt.NDArray[np.int32] | None = None, count: int = 1, among: Booleans | None = None
) -> Shape:
    """Sum over the vertices and faces of each of ``count`` components.

    Parameters
    ----------
    X : (n, 3) float64
    F : (m, 3) int32
    at : (n,) int32, optional
        Component of each vertex, where there are several.
    count : int
    among : (n,) bool, optional
        The vertices that are counted; the faces are all those given.
    """
    if len(F) == 0:
        nothing = np.zeros(count)
        volume, area, squares, faces = nothing, nothing, nothing, nothing
    elif at is None or count == 1:
        faces = np.array([len(F)], dtype=np.float64)
        volume, area, squares = (np.array([x]) for x in sum_faces(X, F))
    else:
        face = at[F[:, 0]]
        faces = np.bincount(face, minlength=count).astype(np.float64)
        volume, area, squares = (
            np.asarray(np.bincount(face, weights=x, minlength=count), dtype=np.float64) for x in measure_faces(X, F)
        )
    if among is not None:
        X, at = X[among], None if at is None else at[among]
    if at is None or count == 1:
        return Shape(
            np.array([len(X)], dtype=np.float64),
            faces,
            blocks.reduce_rows(np.add, X)[None] if len(X) else np.zeros((1, 3)),
            (X.T @ X)[None],
            volume,
            area,
            squares,
        )
    products = (X[:, :, None] * X[:, None, :]).reshape(-1, 9)
    first, second = (
        np.stack([np.bincount(at, weights=x, minlength=count).astype(np.float64) for x in columns.T], axis=1)
        for columns in (X, products)
    )
    number = np.bincount(at, minlength=count).astype(np.float64)
    return Shape(number, faces, first, second.reshape(-1, 3, 3), volume, area, squares)


def compare_shapes(
    X: Floats, Y: Floats, F: Integers, closed: Booleans, labels: npt.NDArray[np.int32] | None, noise: Noise
) -> ShapeChange:
    """Changes from X to Y, and which of them the noise does not explain.

    Parameters
    ----------
    X, Y : (n, 3) float64
        Positions before and after, about the origin and of size 1 or so; every vertex has a face.
    F : (m, 3) int32
    closed : (c,) bool
        Whether a component has no boundary.
    labels : (n,) int32 or None
        Component of each vertex; None for one.
    noise : Noise
        In the units of X.
    """
    before, after = (measure_shape(positions, F, labels, len(closed)) for positions in (X, Y))
    return judge_change(before, after, closed, noise)


@np.errstate(over="ignore", invalid="ignore")  # a given setting may throw vertices anywhere; infinite is large
def judge_change(shape: Shape, result: Shape, closed: Booleans, noise: Noise) -> ShapeChange:
    """Changes from one shape to another of the same faces; parameters as for :func:`compare_shapes`."""
    volume, after, area = shape.volume, result.volume, shape.area
    s2 = noise.level**2
    independent = shape.count / (_CORRELATED_OVER if noise.kind == CORRELATED else 1.0)
    is_mask = noise.kind == QUANTIZED

    tiny = np.finfo(np.float64).tiny
    by_chance = _SIGMAS * np.sqrt(s2 / independent) * area + (np.sqrt(s2) * area if is_mask else 0.0)
    limit = (_MAX_VOLUME_OF_MASK if is_mask else _MAX_VOLUME) * np.abs(volume)
    allowed = np.maximum(_SMALL_VOLUME * np.abs(volume), np.minimum(by_chance, limit))
    # a sheet that is closed by two coinciding sides, or a surface whose faces look this way and that, has no volume
    has_volume = closed & (np.abs(volume) > 1e-3 * area * np.sqrt(area))
    volume_change = np.where(has_volume, (after - volume) / np.where(has_volume, volume, 1.0), np.nan)
    excessive = has_volume & (np.abs(after - volume) > allowed)

    before, axes = np.linalg.eigh(shape.covariance())
    along = np.einsum("cij,cik,ckj->cj", axes, result.covariance(), axes)
    before = np.maximum(before, 0.0)
    chance = _SIGMAS * 2 * np.sqrt(s2 * before / independent[:, None])
    too_far = np.abs(along - before) > (1 + _SMALL_SIZE) ** 2 * before - before + 4 * s2 + chance
    excessive |= too_far.any(axis=1)
    # of an axis that a shape has no extent along, nothing is said
    has_extent = before > 1e-4 * before.max(axis=1, keepdims=True) + tiny
    ratio = np.sqrt(np.divide(along, before, out=np.ones_like(before), where=has_extent)) - 1
    size_change = np.take_along_axis(ratio, np.abs(ratio).argmax(axis=1)[:, None], axis=1)[:, 0]

    edges_before, edges_after = (each.squares / np.maximum(each.faces, 1) for each in (shape, result))
    excessive |= np.abs(edges_before - edges_after) > ((1 + _SMALL_EDGE) ** 2 - 1) * edges_before + 9 * s2
    edge_change = np.sqrt(edges_after / np.maximum(edges_before, tiny)) - 1
    offset = np.where(has_volume, (volume - after) / np.maximum(result.area, tiny), 0.0)
    return ShapeChange(volume_change, size_change, edge_change, offset, excessive)

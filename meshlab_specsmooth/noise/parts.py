"""Connected components grouped by scale and by noise: each group is smoothed by its own level and edge length."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from meshlab_specsmooth.arrays import Booleans, Floats, Integers
from meshlab_specsmooth.noise.estimate import estimate
from meshlab_specsmooth.noise.local import find_varying_noise
from meshlab_specsmooth.noise.model import NONE, UNCLEAR, Noise
from meshlab_specsmooth.operators.assemble import Operators, assemble_patch
from meshlab_specsmooth.operators.components import label_components
from meshlab_specsmooth.operators.patches import draw_patches

# Components of fewer vertices are not measured by themselves. They join the group of the most similar edge length, if
# the lengths differ by no more than this factor.
_MIN_MEASURED = 200
# docs/constants.md: _MAX_EDGE_RATIO_OF_SMALL
_MAX_EDGE_RATIO_OF_SMALL = 1.5

# Components form one group where their edges and their levels differ by no more than these factors, plus the scatter of
# the levels.
# docs/constants.md: _MAX_EDGE_RATIO, _MAX_LEVEL_RATIO
_MAX_EDGE_RATIO, _MAX_LEVEL_RATIO = 1.3, 1.3
# docs/constants.md: _STANDARD_ERROR
_STANDARD_ERROR = 1.25  # of a level, relative, times the root of the number of vertices

# Only this many of the largest components are measured.
_MAX_MEASURED = 32


@dataclass(frozen=True, eq=False)
class Part:
    """Components that are smoothed together.

    Attributes
    ----------
    vertices : (k,) int64
        Indices of active vertices, ascending.
    faces : (m,) int64
        Rows of ``Operators.faces``.
    is_left_alone : bool
        Too small to be measured: nothing is moved.
    """

    vertices: npt.NDArray[np.int64]
    faces: npt.NDArray[np.int64]
    is_left_alone: bool


def group_components(ops: Operators, count: int, labels: npt.NDArray[np.int32]) -> list[Part]:
    """Components grouped by edge length and noise, the largest group first; one group if all are similar.

    Parameters
    ----------
    ops : Operators
    count, labels
        As :func:`meshlab_specsmooth.operators.components.label_components` returns them.
    """
    X, F = ops.positions, ops.faces
    sizes = np.bincount(labels, minlength=count)
    by_size = np.lexsort((np.arange(count), -sizes))
    edges = _mean_edges(X, F, labels, count)
    measured = [c for c in by_size[:_MAX_MEASURED] if sizes[c] >= _MIN_MEASURED and edges[c] > 0]
    if len(measured) == 0 or count == 1:
        return [Part(np.arange(len(X)), np.arange(len(F)), False)]
    face_labels = labels[F[:, 0]]
    levels = {c: _estimate_part(X, F, labels == c, face_labels == c) for c in measured}
    groups: list[list[int]] = []
    for c in measured:
        match = next((g for g in groups if _are_alike(edges, sizes, levels, g[0], c)), None)
        if match is None:
            groups.append([c])
        else:
            match.append(c)
    group_of = np.full(count, -1)
    for number, group in enumerate(groups):
        group_of[group] = number
    heads = edges[[group[0] for group in groups]]
    small = np.flatnonzero((group_of < 0) & (edges > 0))
    apart = np.abs(np.log(edges[small, None] / heads))
    near = apart.argmin(axis=1)
    fits = np.take_along_axis(apart, near[:, None], axis=1)[:, 0] <= np.log(_MAX_EDGE_RATIO_OF_SMALL)
    group_of[small[fits]] = near[fits]
    if len(groups) == 1 and (group_of == 0).all():
        return [Part(np.arange(len(X)), np.arange(len(F)), False)]
    numbers = [*range(len(groups)), *([-1] if (group_of < 0).any() else [])]
    return [
        Part(np.flatnonzero(group_of[labels] == number), np.flatnonzero(group_of[face_labels] == number), number < 0)
        for number in numbers
    ]


def _mean_edges(X: Floats, F: Integers, labels: npt.NDArray[np.int32], count: int) -> Floats:
    """(c,) mean length of the faces' sides of each component."""
    length = sum(np.linalg.norm(X[F[:, k]] - X[F[:, k - 1]], axis=1) for k in range(3)) / 3
    face = labels[F[:, 0]]
    return np.asarray(np.bincount(face, weights=length, minlength=count) / np.bincount(face, minlength=count))


def estimate_surface(ops: Operators) -> Noise:
    """The noise that a surface is smoothed by, in the units of its positions: that of its largest measurable group."""
    count, labels = label_components(ops.L)
    parts = group_components(ops, count, labels) if count > 1 else []
    if len(parts) < 2:
        varying = find_varying_noise(ops)
        if varying is not None and varying.noise.varies:
            return replace(varying.noise, local=np.where(varying.is_noisy, varying.level, 0.0))
        patches = draw_patches(ops)
        return estimate(patches.ops, patches.counted).noise
    found = []
    for part in parts:
        if not part.is_left_alone:
            is_vertex = np.zeros(len(ops.positions), dtype=np.bool_)
            is_vertex[part.vertices] = True
            is_face = np.zeros(len(ops.faces), dtype=np.bool_)
            is_face[part.faces] = True
            found.append((_estimate_part(ops.positions, ops.faces, is_vertex, is_face), len(part.vertices)))
    return max(found, key=lambda pair: (not pair[0].is_left_alone, pair[1]))[0]


def _estimate_part(X: Floats, F: Integers, is_vertex: Booleans, is_face: Booleans) -> Noise:
    index = np.cumsum(is_vertex, dtype=np.int32) - np.int32(1)
    patches = draw_patches(assemble_patch(X[is_vertex], index[F[is_face]]))
    return estimate(patches.ops, patches.counted).noise


def _are_alike(edges: Floats, sizes: npt.NDArray[np.integer], levels: dict[int, Noise], a: int, b: int) -> bool:
    first, second = levels[a], levels[b]
    if (first.kind == UNCLEAR) != (second.kind == UNCLEAR) or (first.kind == NONE) != (second.kind == NONE):
        return False
    if abs(np.log(edges[a] / edges[b])) > np.log(_MAX_EDGE_RATIO):
        return False
    if first.is_left_alone:
        return True
    scatter = 3 * _STANDARD_ERROR * float(np.hypot(sizes[a] ** -0.5, sizes[b] ** -0.5))
    return bool(abs(np.log(first.level / second.level)) <= np.log(_MAX_LEVEL_RATIO) + scatter)


def describe_levels(noises: list[Noise]) -> str | None:
    """The noise of several parts in a sentence; None if no part has any, or there is one part."""
    if len(noises) < 2 or all(noise.is_left_alone for noise in noises):
        return None
    levels = ", ".join(
        noise.kind if noise.is_left_alone else f"{noise.level / noise.mean_edge:.3g} of its mean edges"
        for noise in noises
    )
    return f"{len(noises)} parts of different scale or noise were smoothed one by one, with noise of {levels}"


def describe_left_alone(part: Part) -> str:
    """A sentence for the warning of a result."""
    return (
        f"{len(part.vertices)} vertices in small components of another scale are left alone: too few to separate "
        "noise from shape"
    )

"""Connected components, grouped by scale and by noise: each group is smoothed by its own level and edge length."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.sparse.csgraph import connected_components

from meshlab_specsmooth.arrays import Floats, Integers
from meshlab_specsmooth.graph.laplacian import Laplacian
from meshlab_specsmooth.noise.estimate import NONE, UNCLEAR, Noise, measure, sheet
from meshlab_specsmooth.operators.patches import draw_sample

# Components of fewer vertices are not measured by themselves; they go with the group whose edges are most like theirs,
# if these are longer or shorter by no more than this factor.
_MIN_MEASURED = 200
_ALIKE_EDGES = 1.5
# Components are of one group where their edges and their levels differ by no more than these factors, and by what the
# levels scatter besides.
_SAME_EDGES, _SAME_LEVEL = 1.3, 1.3
_SPREAD = 1.25  # standard error of a level times the root of the number of vertices
# The largest components are measured; the rest goes the way of small ones
_MAX_MEASURED = 32


@dataclass(frozen=True, eq=False)
class Part:
    """Components that are smoothed together.

    Attributes
    ----------
    vertices : (k,) int64
        Their vertices, rising.
    faces : (m,) int64
        Rows of the mesh's faces.
    is_left_alone : bool
        Nothing is known of these, and nothing is moved.
    """

    vertices: npt.NDArray[np.int64]
    faces: npt.NDArray[np.int64]
    is_left_alone: bool


def label_components(L: Laplacian) -> tuple[int, npt.NDArray[np.int32]]:
    """Number of connected components, and (n,) the component of each vertex."""
    # every edge is stored in both directions; so this is the undirected answer, in half of the time
    count, labels = connected_components(L.graph.adjacency(), directed=True, connection="strong")
    return int(count), labels


def split(X: Floats, F: Integers, L: Laplacian, count: int, labels: npt.NDArray[np.int32]) -> list[Part]:
    """Components in groups of like edges and like noise, the largest group first; one group where all are alike.

    Parameters
    ----------
    X : (n, 3) float64
    F : (m, 3) int32
    L : Laplacian
    count, labels
        As :func:`label_components` returns them.
    """
    sizes = np.bincount(labels, minlength=count)
    by_size = np.lexsort((np.arange(count), -sizes))
    edges = _mean_edges(X, F, labels, count)
    measured = [c for c in by_size[:_MAX_MEASURED] if sizes[c] >= _MIN_MEASURED and edges[c] > 0]
    if len(measured) == 0 or count == 1:
        return [Part(np.arange(len(X)), np.arange(len(F)), False)]
    face_labels = labels[F[:, 0]]
    levels = {c: _noise_of(X, F, labels == c, face_labels == c) for c in measured}
    groups: list[list[int]] = []
    for c in measured:
        mate = next((g for g in groups if _are_alike(edges, sizes, levels, g[0], c)), None)
        if mate is None:
            groups.append([c])
        else:
            mate.append(c)
    group_of = np.full(count, -1)
    for number, group in enumerate(groups):
        group_of[group] = number
    heads = edges[[group[0] for group in groups]]
    small = np.flatnonzero((group_of < 0) & (edges > 0))
    apart = np.abs(np.log(edges[small, None] / heads))
    near = apart.argmin(axis=1)
    fits = np.take_along_axis(apart, near[:, None], axis=1)[:, 0] <= np.log(_ALIKE_EDGES)
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


def estimate_level(X: Floats, F: Integers, L: Laplacian) -> Noise:
    """The noise that a surface is smoothed by, in the units of X: of the largest part that can be told anything of."""
    count, labels = label_components(L)
    parts = split(X, F, L, count, labels) if count > 1 else []
    if len(parts) < 2:
        sample = draw_sample(X, F, L)
        return measure(sheet(X[sample.vertices], sample.faces)).noise
    is_face = np.zeros(len(F), dtype=np.bool_)
    found = []
    for part in parts:
        if not part.is_left_alone:
            is_vertex = np.zeros(len(X), dtype=np.bool_)
            is_vertex[part.vertices] = True
            is_face[:] = False
            is_face[part.faces] = True
            found.append((_noise_of(X, F, is_vertex, is_face), len(part.vertices)))
    return max(found, key=lambda pair: (not pair[0].is_left_alone, pair[1]))[0]


def _noise_of(X: Floats, F: Integers, vertices: npt.NDArray[np.bool_], faces: npt.NDArray[np.bool_]) -> Noise:
    at = np.flatnonzero(vertices)
    place = np.cumsum(vertices, dtype=np.int32) - np.int32(1)
    Y, G = X[at], place[F[faces]]
    whole = sheet(Y, G)
    sample = draw_sample(Y, G, whole.L)
    return measure(sheet(Y[sample.vertices], sample.faces)).noise


def _are_alike(edges: Floats, sizes: npt.NDArray[np.integer], levels: dict[int, Noise], a: int, b: int) -> bool:
    first, second = levels[a], levels[b]
    if (first.kind == UNCLEAR) != (second.kind == UNCLEAR) or (first.kind == NONE) != (second.kind == NONE):
        return False
    if abs(np.log(edges[a] / edges[b])) > np.log(_SAME_EDGES):
        return False
    if first.is_left_alone:
        return True
    scatter = 3 * _SPREAD * float(np.hypot(sizes[a] ** -0.5, sizes[b] ** -0.5))
    return bool(abs(np.log(first.level / second.level)) <= np.log(_SAME_LEVEL) + scatter)


def describe_levels(noises: list[Noise]) -> str | None:
    """What was found of several parts, in words; None where there is nothing to tell apart."""
    if len(noises) < 2 or all(noise.is_left_alone for noise in noises):
        return None
    levels = ", ".join(
        noise.kind if noise.is_left_alone else f"{noise.level / noise.mean_edge:.3g} of its mean edges"
        for noise in noises
    )
    return f"{len(noises)} parts of unlike scale or noise were taken one by one, with noise of {levels}"


def describe_left_alone(part: Part) -> str:
    """That nothing is known of a part."""
    return (
        f"{len(part.vertices)} vertices in small components of another scale are left alone: too few to tell noise "
        "from shape"
    )

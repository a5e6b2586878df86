"""The part of a mesh that noise is measured and settings are chosen on: the whole, or patches from all over it.

The patches are the same for every order of vertices and faces: they start at equal steps along Morton's curve, grow
ring by ring, and their vertices are numbered by their coordinates.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from meshlab_specsmooth.arrays import Booleans, Floats, Integers
from meshlab_specsmooth.graph.laplacian import Laplacian, neighbors_of
from meshlab_specsmooth.operators.assemble import Operators, assemble_patch
from meshlab_specsmooth.runtime import blocks

# Meshes of more vertices than this are represented by patches, this many of this size.
MAX_WHOLE = 10_000
# docs/constants.md: _COUNT
_COUNT = 5
# docs/constants.md: _SIZE
_SIZE = 1600

# Many small ones, to see whether they differ.
_SPOTS, _SIZE_OF_SPOT = 48, 250

#: Where waves are evaluated that are as long as these are wide.
WIDE = 5000

#: A mask restricts what is measured only if it leaves this many vertices.
MIN_COUNTED = 200

# Rings next to the boundary that are excluded, as the Laplacian is one-sided there, and the number of vertices that
# must be left for that.
# docs/constants.md: _MARGIN
_MARGIN = 3
_MARGIN_OF_WIDE = 8
MIN_VERTICES = 50

# Cells to a side of the grid that starts are spread over, and the bits of a cell's number along one axis, at the places
# 0, 3, 6, ...
_CELLS = 32
_INTERLEAVED = np.array([sum((i >> bit & 1) << 3 * bit for bit in range(5)) for i in range(_CELLS)], dtype=np.int64)


@dataclass(frozen=True, eq=False)
class Patches:
    """Patches of a mesh as one mesh in an order of its own.

    Attributes
    ----------
    ops : Operators
        Uniform, in the units of the mesh's positions.
    counted : (k,) bool
        Vertices whose noise and error count: away from boundaries, and in the mask where that leaves enough.
    vertices : (k,) int64
        Their indices among the active vertices of the mesh, ordered by coordinates.
    starts : tuple of int
        Where the patches start; empty if they are the whole mesh.
    """

    ops: Operators
    counted: Booleans
    vertices: npt.NDArray[np.int64]
    starts: tuple[int, ...] = ()


def draw_patches(ops: Operators, mask: Booleans | None = None) -> Patches:
    """Patches that represent a mesh; all of it where it is small.

    Parameters
    ----------
    ops : Operators
    mask : (n,) bool, optional
        Vertices to represent: all by default, or where fewer than :data:`MIN_COUNTED` are left.
    """
    X, n = ops.positions, len(ops.positions)
    if n <= MAX_WHOLE:
        vertices, faces = _sort(X, ops.faces, np.arange(n))
        return _assemble(ops, vertices, faces, mask, _MARGIN, ())
    if mask is not None and mask.sum() >= MIN_COUNTED:
        among = np.flatnonzero(mask)
        starts = tuple(int(among[at]) for at in _spread(X.take(among, axis=0)))
    else:
        starts = tuple(_spread(X))
    return _assemble(ops, *_cut_out(ops, starts, _SIZE), mask, _MARGIN, starts)


def draw_spots(ops: Operators, mask: Booleans | None = None) -> Patches:
    """Many small patches from all over a mesh."""
    among = np.arange(len(ops.positions)) if mask is None or mask.sum() < MIN_COUNTED else np.flatnonzero(mask)
    starts = tuple(int(among[at]) for at in _spread(ops.positions.take(among, axis=0), _SPOTS))
    return _assemble(ops, *_cut_out(ops, starts, _SIZE_OF_SPOT), mask, _MARGIN, starts)


def widen_patches(ops: Operators, patches: Patches, mask: Booleans | None = None) -> Patches:
    """Patches of :data:`WIDE` vertices at the same places, of which fewer next to the boundary count; or all of it."""
    if len(ops.positions) <= _COUNT * WIDE:
        vertices, faces = _sort(ops.positions, ops.faces, np.arange(len(ops.positions)))
        return _assemble(ops, vertices, faces, mask, _MARGIN, ())
    return _assemble(ops, *_cut_out(ops, patches.starts, WIDE), mask, _MARGIN_OF_WIDE, patches.starts)


def _cut_out(ops: Operators, starts: tuple[int, ...], size: int) -> tuple[npt.NDArray[np.int64], Integers]:
    """Vertices and faces of patches."""
    n, F = len(ops.positions), ops.faces
    chosen = np.zeros(n, dtype=np.bool_)
    for start in starts:
        _grow(ops.L, start, size, chosen)
    is_kept = np.empty(len(F), dtype=np.bool_)

    def look(at: slice) -> None:
        is_kept[at] = chosen.take(F[at, 0])  # few are left to look at

    blocks.parallel_rows(look, len(F))
    kept = F[is_kept]
    kept = kept[chosen[kept].all(axis=1)]
    at = np.unique(kept).astype(np.int64)
    index = np.full(n, -1, dtype=np.int32)
    index[at] = np.arange(len(at), dtype=np.int32)
    return _sort(ops.positions[at], index[kept], at)


def _assemble(
    ops: Operators,
    vertices: npt.NDArray[np.int64],
    faces: Integers,
    mask: Booleans | None,
    margin: int,
    starts: tuple[int, ...],
) -> Patches:
    patch = assemble_patch(ops.positions[vertices], faces)
    return Patches(patch, find_interior(patch, None if mask is None else mask[vertices], margin), vertices, starts)


def find_interior(ops: Operators, mask: Booleans | None = None, margin: int = _MARGIN) -> Booleans:
    """(n,) vertices away from the boundary and in the mask; each restriction applies only if it leaves enough."""
    outer = np.zeros(len(ops.positions), dtype=np.bool_)
    outer[ops.boundary_vertices] = True
    adjacency = ops.L.graph.adjacency(np.ones(len(ops.L.graph.indices)))
    for _ in range(margin):
        outer |= adjacency @ outer.astype(np.float64) > 0
    interior = ~outer if (~outer).sum() >= MIN_VERTICES else np.ones_like(outer)
    if mask is not None and (interior & mask).sum() >= MIN_COUNTED:
        interior &= mask
    return interior


def _spread(X: Floats, count: int = _COUNT) -> list[int]:
    """Indices of vertices at equal steps along Morton's curve through a grid, the lowest of each cell."""
    low, high = (blocks.reduce_rows(of, X) for of in (np.minimum, np.maximum))
    widest = float((high - low).max())
    scale = (_CELLS - 1) / widest if widest > 0 else 0.0
    code = np.empty(len(X), dtype=np.uint16)

    def encode(at: slice) -> None:
        cell = ((X[at] - low) * scale).astype(np.intp)
        code[at] = _INTERLEAVED[cell[:, 0]] + 2 * _INTERLEAVED[cell[:, 1]] + 4 * _INTERLEAVED[cell[:, 2]]

    blocks.parallel_rows(encode, len(X))
    below = np.cumsum(np.bincount(code))
    starts = []
    for k in range(count):
        chosen = np.searchsorted(below, (2 * k + 1) * len(X) / (2 * count))
        there = np.flatnonzero(code == chosen)
        starts.append(int(there[np.lexsort(X[there].T)[0]]))
    return starts


def _grow(L: Laplacian, start: int, size: int, chosen: Booleans) -> None:
    """Mark the vertices nearest to one, by whole rings, those of earlier patches included."""
    reached = np.zeros(L.size, dtype=np.bool_)
    ring, count = np.array([start]), 0
    while len(ring):
        reached[ring] = True
        count += len(ring)
        if count >= size:
            break
        _, beyond = neighbors_of(L, ring)
        ring = np.unique(beyond[~reached[beyond]])
    chosen |= reached


def _sort(X: Floats, F: Integers, at: npt.NDArray[np.int64]) -> tuple[npt.NDArray[np.int64], Integers]:
    """Vertices ordered by their coordinates; faces by their new numbers, each from its lowest corner on, sorted."""
    by_coordinates = np.lexsort(X.T)
    rank = np.empty(len(X), dtype=np.int32)
    rank[by_coordinates] = np.arange(len(X), dtype=np.int32)
    faces = rank[F]
    # rotated, so that the orientation stays
    turn = (np.argmin(faces, axis=1)[:, None] + np.arange(3)) % 3
    faces = np.take_along_axis(faces, turn, axis=1)
    return at[by_coordinates], np.ascontiguousarray(faces[np.lexsort(faces.T[::-1])])

"""A partition of space into boxes with about as many vertices each, and which of them a thing is near."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from meshlab_specsmooth.arrays import Floats

Indices = npt.NDArray[np.int64]


@dataclass(frozen=True)
class Node:
    """A box that is split at a coordinate along an axis; a leaf has a number in place of parts."""

    axis: int = 0
    at: float = 0.0
    low: Node | None = None
    high: Node | None = None
    leaf: int = -1
    first: int = 0
    end: int = 1


def split_space(X: Floats, count: int) -> Node:
    """Split space into ``count`` boxes that hold as many of some points each, along the longest side first.

    Parameters
    ----------
    X : (k, 3) float64
        A sample of the vertices.
    count : int
    """
    return _split(X, 0, count)


def _split(X: Floats, first: int, end: int) -> Node:
    count = end - first
    if count == 1:
        return Node(leaf=first, first=first, end=end)
    spans = np.ptp(X, axis=0) if len(X) else np.zeros(3)
    axis = int(np.argmax(spans))
    half = count // 2
    at = float(np.quantile(X[:, axis], half / count)) if len(X) else 0.0
    below = X[:, axis] < at
    return Node(
        axis, at, _split(X[below], first, first + half), _split(X[~below], first + half, end), first=first, end=end
    )


def find_owners(tree: Node, X: Floats) -> npt.NDArray[np.int32]:
    """Return the (k,) number of the box of each point."""
    owners = np.empty(len(X), dtype=np.int32)
    for leaf, at in route(tree, X, X, np.zeros(tree.end)):
        owners[at] = leaf
    return owners


def route(tree: Node, low: Floats, high: Floats, margins: Floats) -> Iterator[tuple[int, Indices]]:
    """Yield the number of each box, and the things that lie within its margin.

    Parameters
    ----------
    tree : Node
    low, high : (k, 3) float64
        Lowest and highest coordinates of each thing; a thing is within if all of it is.
    margins : (count,) float64
        Of each box. With zeros, and points for things, each has one box.
    """
    yield from _route(tree, np.arange(len(low)), low, high, margins)


def _route(node: Node, at: Indices, low: Floats, high: Floats, margins: Floats) -> Iterator[tuple[int, Indices]]:
    if len(at) == 0:
        return
    if node.low is None or node.high is None:
        yield node.leaf, at
        return
    split = node.at
    below, above = margins[node.low.first : node.low.end].max(), margins[node.high.first : node.high.end].max()
    yield from _route(node.low, at[high[at, node.axis] < split + below], low, high, margins)
    yield from _route(node.high, at[low[at, node.axis] >= split - above], low, high, margins)

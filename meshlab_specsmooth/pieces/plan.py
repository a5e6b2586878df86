"""What is the same for all pieces: the filter, its settings by the level of the noise, and the partition."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np

from meshlab_specsmooth.choices import Boundary, LaplacianKind
from meshlab_specsmooth.noise.model import Noise
from meshlab_specsmooth.pieces.partition import Node
from meshlab_specsmooth.runtime import atomic


@dataclass(frozen=True)
class Band:
    """What is done where the noise has a level.

    Attributes
    ----------
    level : float
        In mesh units.
    barycenter_weight : float or None
        None where nothing is to be removed.
    edge_aware : dict or None
        Fields of the setting of the edge-aware filter, where that is to be applied.
    """

    level: float
    barycenter_weight: float | None
    edge_aware: dict[str, Any] | None = None


@dataclass(frozen=True)
class Plan:
    """What is the same for all pieces; all of it plain values.

    Attributes
    ----------
    filter : {"isotropic", "edge_aware"}
    bands : tuple of Band
        By rising level; one, unless the noise is treated by region.
    levels : list of [x, y, z, level] or None
        Where levels were measured, if there are several bands.
    noise : dict
        Fields of the noise.
    mean_edge : float
    curve_edge : float or None
        Mean edge of the boundary, where that is smoothed along itself.
    stray_offset : float or None
        Median distance of a vertex from the mean of its neighbors; None if a setting was given.
    response : str
    cutoff : float
        Eigenvalue.
    iterations : int
    boundary, laplacian : str
    weld : bool
    max_displacement : float or None
    tolerance : float
        Of the least squares.
    rings : int
        Of the margin.
    center : list of float
        About which volumes are measured.
    tree : list
        The partition.
    """

    filter: str
    bands: tuple[Band, ...]
    levels: list[list[float]] | None
    noise: dict[str, Any]
    mean_edge: float
    curve_edge: float | None
    stray_offset: float | None
    response: str
    cutoff: float
    iterations: int
    boundary: Boundary
    laplacian: LaplacianKind
    weld: bool
    max_displacement: float | None
    tolerance: float
    rings: int
    center: list[float]
    tree: list[Any]


def write_plan(folder: Path, plan: Plan) -> None:
    """Store a plan."""
    atomic.write_text(folder / "plan.json", json.dumps(asdict(plan)) + "\n")


def read_plan(folder: Path) -> Plan:
    """Load a plan."""
    given = json.loads((folder / "plan.json").read_text(encoding="utf-8"))
    return Plan(**{**given, "bands": tuple(Band(**band) for band in given["bands"])})


def pack_noise(noise: Noise) -> dict[str, Any]:
    """The fields of a noise as plain values, without its levels by vertex."""
    found = {each.name: getattr(noise, each.name) for each in fields(noise) if each.name != "local"}
    return {**found, "covariance": noise.covariance.tolist()}


def unpack_noise(packed: dict[str, Any]) -> Noise:
    """The noise of :func:`pack_noise`."""
    tuples = {name: tuple(value) for name, value in packed.items() if isinstance(value, list)}
    return Noise(**{**packed, **tuples, "covariance": np.array(packed["covariance"])})


def pack_tree(node: Node) -> list[Any]:
    """A partition as nested lists."""
    if node.low is None or node.high is None:
        return [node.leaf]
    return [node.axis, node.at, pack_tree(node.low), pack_tree(node.high), node.first, node.end]


def unpack_tree(packed: list[Any]) -> Node:
    """The partition of :func:`pack_tree`."""
    if len(packed) == 1:
        return Node(leaf=packed[0], first=packed[0], end=packed[0] + 1)
    axis, at, low, high, first, end = packed
    return Node(axis, at, unpack_tree(low), unpack_tree(high), first=first, end=end)

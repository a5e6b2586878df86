"""The same noisy surface through several filters, measured against the truth."""

from __future__ import annotations

import time
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from meshlab_specsmooth.arrays import Floats
from meshlab_specsmooth.comparison.competitors import Competitor
from meshlab_specsmooth.comparison.metrics import normal_error, vertex_error, volume_change
from meshlab_specsmooth.geometry.surface import Surface
from meshlab_specsmooth.meshlab import filters, meshset


@dataclass(frozen=True, eq=False)
class Row:
    """A surface and its distance from the truth.

    Attributes
    ----------
    name, call : str
    surface : Surface
    normal_error : float
        Degrees.
    vertex_error : float
        Mean edge lengths.
    volume_change : float
        Per cent; of meaning for closed surfaces only.
    seconds : float
        Of the filter alone, on a mesh that is in its MeshSet already.
    """

    name: str
    call: str
    surface: Surface
    normal_error: float
    vertex_error: float
    volume_change: float
    seconds: float


def measure(name: str, call: str, surface: Surface, truth: Surface, seconds: float) -> Row:
    """A row of the table."""
    return Row(
        name,
        call,
        surface,
        normal_error(surface, truth),
        vertex_error(surface, truth),
        volume_change(surface, truth),
        seconds,
    )


def side_by_side(truth: Surface, noisy: Floats, competitors: Iterable[Competitor]) -> Iterator[Row]:
    """One row a competitor, as they finish; all of them run on MeshSets, the built-ins and ours alike."""
    for competitor in competitors:
        ms = meshset.new(noisy, truth.faces)
        start = time.perf_counter()
        filters.apply(ms, competitor.filter, **competitor.parameters)
        seconds = time.perf_counter() - start
        vertices, _ = meshset.get_arrays(ms)
        yield measure(competitor.name, competitor.call, Surface(vertices, truth.faces), truth, seconds)


def table(rows: Iterable[Row]) -> str:
    """The rows as text."""
    lines = [
        f"{'':32}{'normals':>9}{'vertices':>10}{'volume':>9}{'time':>8}",
        f"{'':32}{'degrees':>9}{'edges':>10}{'%':>9}{'s':>8}",
    ]
    lines += [
        f"{row.name:32}{row.normal_error:9.2f}{row.vertex_error:10.3f}{row.volume_change:+9.3f}{row.seconds:8.2f}"
        for row in rows
    ]
    return "\n".join(lines)

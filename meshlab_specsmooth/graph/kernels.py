"""What a sweep does: the walk P = D^-1 W over every vertex' neighbors, fused with what becomes of the outcome."""

from __future__ import annotations

from typing import Protocol

from meshlab_specsmooth.arrays import Floats
from meshlab_specsmooth.graph.build import Graph
from meshlab_specsmooth.graph.reference import ReferenceKernels
from meshlab_specsmooth.runtime import backend

COLUMNS = 3  # x, y and z: the kernels work on three columns at once, no more and no fewer


class Kernels(Protocol):
    """Work on the rows of the blocks ``first`` to ``last - 1``.

    Arrays are (n, 3) or (n, 1), in row order, and changed in place. Sums have one row a block, so that their order does
    not hang on the number of threads. ``rows`` and ``free`` may be None where they are 1 everywhere.
    """

    name: str

    def step(self, first: int, last: int, X: Floats, now: Floats, before: Floats, factor: float, share: float) -> None:
        """``before`` becomes share X - factor P now - before."""

    def differ(self, first: int, last: int, p: Floats, rows: Floats | None, kappa: float, z: Floats) -> None:
        """The first half of a product with the normal matrix: y = rows (p - P p) / d.

        ``z`` becomes what the second half gathers: kappa p - y where all weights are 1, y itself elsewhere.
        """

    def gather(
        self,
        first: int,
        last: int,
        p: Floats,
        z: Floats,
        free: Floats | None,
        kappa: float,
        gram: Floats,
        q: Floats,
        sums: Floats,
    ) -> None:
        """The second half: ``q`` becomes free (d y - W y + kappa A p + gram p), and ``sums`` p . q."""

    def descend(self, first: int, last: int, step: Floats, q: Floats, m: Floats, r: Floats, sums: Floats) -> None:
        """``r`` becomes r - q step, and ``sums`` r . r and r . (m r), in six columns."""

    def turn(
        self, first: int, last: int, step: Floats, turn: Floats, m: Floats, r: Floats, x: Floats, p: Floats
    ) -> None:
        """``x`` becomes x + p step, then ``p`` m r + p turn."""

    def squares(self, first: int, last: int, v: Floats, sums: Floats) -> None:
        """``sums``, (n, 1), becomes the sums of w_ij^2 v_j over the neighbors j."""

    def inner_products(self, first: int, last: int, X: Floats, Y: Floats, sums: Floats) -> None:
        """``sums`` becomes X . (D X) and X . (D Y), summed over the columns, in two columns."""

    def edge_lengths(self, first: int, last: int, X: Floats, sums: Floats) -> None:
        """``sums`` becomes the distances between the ends of each edge, every edge counted from both."""


def best(graph: Graph) -> Kernels:
    """Compiled ones where the extra ``fast`` is installed, else scipy's."""
    if not backend.is_compiled(graph.size):
        return ReferenceKernels(graph)
    from meshlab_specsmooth.graph.compiled import CompiledKernels

    return CompiledKernels(graph)

"""Functions of the Laplacian, h(L) X: by polynomials, or by eigenvectors."""

from __future__ import annotations

from typing import Protocol

from meshlab_specsmooth.arrays import Floats
from meshlab_specsmooth.graph.laplacian import Laplacian
from meshlab_specsmooth.runtime.progress import Progress


class SpectralFilter(Protocol):
    """A transfer function ready to be applied: the seam between the methods."""

    @property
    def degree(self) -> int:
        """Sweeps over the mesh that one application takes."""

    @property
    def error(self) -> float:
        """Bound on what the transfer function differs from the response by, weighed as it was asked for."""

    def apply(
        self, L: Laplacian, X: Floats, progress: Progress | None = None, spare: list[Floats] | None = None
    ) -> Floats:
        """h(L) X for X of shape (n, k).

        ``spare`` is memory of the shape of X that is not needed any more; what is left of it afterward is in it.
        """

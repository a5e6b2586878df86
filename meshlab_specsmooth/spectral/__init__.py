"""Functions of the Laplacian, h(L) X, evaluated with polynomials or with eigenvectors."""

from __future__ import annotations

from typing import Protocol

from meshlab_specsmooth.arrays import Floats
from meshlab_specsmooth.graph.laplacian import Laplacian
from meshlab_specsmooth.runtime.progress import Progress
from meshlab_specsmooth.runtime.workspace import Workspace


class SpectralFilter(Protocol):
    """A transfer function that can be applied; implemented by each method."""

    @property
    def degree(self) -> int:
        """Number of products with L that one application takes."""

    @property
    def error(self) -> float:
        """Bound on the weighted difference between the transfer function and the response."""

    def apply(
        self, L: Laplacian, X: Floats, progress: Progress | None = None, workspace: Workspace | None = None
    ) -> Floats:
        """h(L) X for X of shape (n, k), with work arrays from ``workspace``."""

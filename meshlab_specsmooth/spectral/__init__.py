"""Functions of the Laplacian, h(S) X: by polynomials, or by eigenvectors."""

from __future__ import annotations

from typing import Protocol

from scipy.sparse import csr_array

from meshlab_specsmooth.spectral.progress import Progress
from meshlab_specsmooth.surface import Floats


class SpectralFilter(Protocol):
    """A transfer function ready to be applied: the seam between the methods."""

    @property
    def degree(self) -> int:
        """Products with S that one application takes."""

    @property
    def error(self) -> float:
        """Bound on what the transfer function differs from the response by, at any eigenvalue."""

    def apply(self, S: csr_array, X: Floats, progress: Progress | None = None) -> Floats:
        """h(S) X for X of shape (n, k)."""

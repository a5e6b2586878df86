"""Three names of one cut-off: an eigenvalue, a number of modes, a wavelength."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

# On a regular triangle mesh with mean edge h the wave of length w has eigenvalue (pi h / w)^2, and n of them fill the
# spectrum so that the k-th has eigenvalue 2 pi / sqrt(3) k / n (Weyl's law).
WEYL = 2 * np.pi / np.sqrt(3)


@dataclass(frozen=True)
class Cutoff:
    """Where a response cuts off.

    Attributes
    ----------
    eigenvalue : float
        In (0, 2].
    modes : float
        Number of modes below it.
    error : float
        Standard error of ``modes``, relative to it; 0 where the eigenvalues were computed, NaN where ``modes`` is only
        Weyl's law for a regular mesh.
    """

    eigenvalue: float
    modes: float
    error: float


def from_wavelength(edges: float, vertex_count: int) -> Cutoff:
    """The cut-off at surface waves of so many mean edge lengths."""
    # waves shorter than the mesh can carry keep everything; those beyond all measure keep the constants
    eigenvalue = float(np.clip((np.pi / max(edges, 1.0)) ** 2, np.finfo(np.float64).tiny, 2.0))
    modes = float(max(1.0, vertex_count * min(1.0, eigenvalue / WEYL)))
    return Cutoff(eigenvalue, modes, float("nan"))


def wavelength_in_edges(eigenvalue: float) -> float:
    """Length of the surface wave with that eigenvalue, in mean edge lengths of a regular mesh."""
    return float(np.pi / np.sqrt(eigenvalue))

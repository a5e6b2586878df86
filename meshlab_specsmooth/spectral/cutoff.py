"""Cut-offs given as an eigenvalue, a number of modes or a wavelength, and the conversions between them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from meshlab_specsmooth.arrays import Floats

# On a regular triangle mesh with edge length h a wave of length w has the eigenvalue (pi h / w)^2, and the k-th of n
# eigenvalues is 2 pi / sqrt(3) k / n (Weyl's law).
WEYL = 2 * np.pi / np.sqrt(3)


@dataclass(frozen=True)
class Cutoff:
    """The cut-off of a response.

    Attributes
    ----------
    eigenvalue : float
        In (0, 2].
    modes : float
        Number of modes below ``eigenvalue``.
    error : float
        Relative standard error of ``modes``; 0 where the eigenvalues were computed, NaN where ``modes`` follows from
        the law of the regular lattice.
    """

    eigenvalue: float
    modes: float
    error: float


def from_eigenvalue(eigenvalue: float, vertex_count: int) -> Cutoff:
    """The cut-off at an eigenvalue, with the number of modes that the regular lattice has below it."""
    modes = float(max(1.0, vertex_count * min(1.0, lattice_fraction(np.array([eigenvalue]))[0])))
    return Cutoff(eigenvalue, modes, float("nan"))


def from_wavelength(edges: float, vertex_count: int) -> Cutoff:
    """The cut-off at surface waves of a length in mean edge lengths."""
    # waves shorter than the mesh can represent keep everything; extremely long ones keep only the constants
    eigenvalue = float(np.clip((np.pi / max(edges, 1.0)) ** 2, np.finfo(np.float64).tiny, 2.0))
    return from_eigenvalue(eigenvalue, vertex_count)


def wavelength_in_edges(eigenvalue: float) -> float:
    """Wavelength of the mode with an eigenvalue, in mean edge lengths of a regular mesh."""
    return float(np.pi / np.sqrt(eigenvalue))


def lattice_fraction(eigenvalues: Floats) -> Floats:
    """Fraction of the modes of the infinite regular triangle lattice below each eigenvalue, in [0, 2].

    The wave (a, b) has lambda = 1 - (cos a + 2 cos(a/2) cos(b + a/2)) / 3, so for each a the fraction over b is an arc.
    The relative error is 1e-4.
    """
    # no wave beyond this a is as low; integrating over its sine removes the square root at the end of the interval
    furthest = 2 * np.arccos(np.clip((np.sqrt(np.maximum(9 - 6 * eigenvalues, 0)) - 1) / 2, 0, 1))
    u = (np.arange(32) + 0.5) * np.pi / 64
    a = furthest[:, None] * np.sin(u)
    cosine = (3 * (1 - eigenvalues[:, None]) - np.cos(a)) / (2 * np.cos(a / 2))
    arc = np.arccos(np.clip(cosine, -1, 1)) / np.pi
    return np.asarray(furthest / 64 * (arc @ np.cos(u)))

"""Three names of one cut-off: an eigenvalue, a number of modes, a wavelength."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from meshlab_specsmooth.arrays import Floats

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
        the law of the regular lattice.
    """

    eigenvalue: float
    modes: float
    error: float


def from_eigenvalue(eigenvalue: float, vertex_count: int) -> Cutoff:
    """The cut-off at an eigenvalue, with the number of modes that the regular lattice has below it."""
    modes = float(max(1.0, vertex_count * min(1.0, lattice_share(np.array([eigenvalue]))[0])))
    return Cutoff(eigenvalue, modes, float("nan"))


def from_wavelength(edges: float, vertex_count: int) -> Cutoff:
    """The cut-off at surface waves of a length in mean edge lengths."""
    # waves shorter than the mesh can represent keep everything; extremely long ones keep only the constants
    eigenvalue = float(np.clip((np.pi / max(edges, 1.0)) ** 2, np.finfo(np.float64).tiny, 2.0))
    return from_eigenvalue(eigenvalue, vertex_count)


def wavelength_in_edges(eigenvalue: float) -> float:
    """Length of the surface wave with that eigenvalue, in mean edge lengths of a regular mesh."""
    return float(np.pi / np.sqrt(eigenvalue))


def lattice_share(eigenvalues: Floats) -> Floats:
    """Share of the modes of the endless regular triangle lattice that lie below each eigenvalue, in [0, 2].

    The wave (a, b) has lambda = 1 - (cos a + 2 cos(a/2) cos(b + a/2)) / 3, so for each a so the share over b is an arc.
    Good to 1e-4 of the share.
    """
    # beyond this a no wave is as low; its sine as the variable takes the square root out of the integrand's end
    furthest = 2 * np.arccos(np.clip((np.sqrt(np.maximum(9 - 6 * eigenvalues, 0)) - 1) / 2, 0, 1))
    u = (np.arange(32) + 0.5) * np.pi / 64
    a = furthest[:, None] * np.sin(u)
    cosine = (3 * (1 - eigenvalues[:, None]) - np.cos(a)) / (2 * np.cos(a / 2))
    arc = np.arccos(np.clip(cosine, -1, 1)) / np.pi
    return np.asarray(furthest / 64 * (arc @ np.cos(u)))

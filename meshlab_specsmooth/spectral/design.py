"""From what was asked for (modes or a wavelength, a response, a method) to a filter that can be applied."""

from __future__ import annotations

from dataclasses import dataclass

from meshlab_specsmooth.graph.laplacian import Laplacian
from meshlab_specsmooth.parameters import check_choice
from meshlab_specsmooth.runtime.progress import Progress
from meshlab_specsmooth.spectral import SpectralFilter, density, eigenbasis, inertia
from meshlab_specsmooth.spectral.chebyshev import PassedOn, approximate
from meshlab_specsmooth.spectral.cutoff import Cutoff, from_wavelength
from meshlab_specsmooth.spectral.density import Density
from meshlab_specsmooth.spectral.response import RESPONSES, Response, band, response

METHODS = ("auto", "exact", "chebyshev")
MODE_COUNTS = ("estimate", "exact")


@dataclass(frozen=True, eq=False)
class Design:
    """A filter and where it comes from.

    Attributes
    ----------
    filter : SpectralFilter
    response : Response
    cutoff : Cutoff
    method : str
        ``"exact"`` or ``"chebyshev"``.
    """

    filter: SpectralFilter
    response: Response
    cutoff: Cutoff
    method: str


def design(
    L: Laplacian,
    size: int | float,
    *,
    by: str,
    name: str,
    method: str,
    tolerance: float,
    mode_count: str = "estimate",
    passed_on: PassedOn | None = None,
    modes: Density | None = None,
    progress: Progress | None = None,
) -> Design:
    """A low-pass for L.

    Parameters
    ----------
    L : Laplacian
    size : float
        The number of modes kept, or the shortest wave kept in mean edge lengths.
    by : {"modes", "wavelength"}
        Which of the two ``size`` is.
    name : str
        Of the response, see :data:`meshlab_specsmooth.spectral.response.RESPONSES`.
    method : {"auto", "exact", "chebyshev"}
        ``auto`` is exact up to :data:`eigenbasis.DENSE_VERTICES` vertices.
    tolerance, passed_on
        Error allowed to a polynomial, see :func:`meshlab_specsmooth.spectral.chebyshev.approximate`.
    mode_count : {"estimate", "exact"}
        How a number of modes becomes a cut-off above :data:`eigenbasis.DENSE_VERTICES` vertices, for a polynomial.
    modes : Density, optional
        Where the modes of L lie, if that was measured already.
    progress : callable, optional
        Called with the fraction done, in [0, 1], while eigenvectors are computed.

    Raises
    ------
    InvalidParameter
        An unknown method or response, or a response too steep for a polynomial.
    TooLarge
        An eigenbasis that would not fit in memory.
    """
    n = L.size
    name = check_choice("response", name, RESPONSES)
    mode_count = check_choice("mode_count", mode_count, MODE_COUNTS)
    if not is_exact(method, n):
        if by == "wavelength":
            cutoff = from_wavelength(size, n)
        elif n <= eigenbasis.DENSE_VERTICES:
            cutoff = eigenbasis.complete(L.graph.symmetric_laplacian()).cutoff(int(size))
        else:
            cutoff = density.cutoff_of_modes(L, int(size)) if modes is None else modes.cutoff(int(size))
            if mode_count == "exact":
                cutoff = inertia.cutoff_of_modes(L.graph.symmetric_laplacian(), int(size), cutoff)
        h = response(name, cutoff.eigenvalue)
        return Design(approximate(h, tolerance, passed_on), h, cutoff, "chebyshev")
    S = L.graph.symmetric_laplacian()
    # a step needs the modes that it keeps and one more to tell where it lies; the others have a tail, so they get all
    if name != "ideal":
        basis = eigenbasis.complete(S, progress)
    elif by == "modes":
        basis = eigenbasis.covering(S, int(size), progress)
    else:
        basis = eigenbasis.below(S, from_wavelength(size, n), progress)
    cutoff = basis.cutoff(int(size)) if by == "modes" else from_wavelength(size, n)
    h = response(name, cutoff.eigenvalue)
    return Design(eigenbasis.Projection(basis, h), h, cutoff, "exact")


def design_band(
    L: Laplacian,
    longest: float,
    shortest: float,
    *,
    name: str,
    method: str,
    tolerance: float,
    passed_on: PassedOn | None = None,
) -> Design:
    """The pass of all waves between two lengths, in mean edges.

    Parameters, errors
        As for :func:`design`.

    Returns
    -------
    Design
        Its cut-off is that of the shortest wave.
    """
    n = L.size
    low, high = from_wavelength(longest, n), from_wavelength(shortest, n)
    h = band(response(name, low.eigenvalue), response(name, high.eigenvalue))
    if is_exact(method, n):
        return Design(eigenbasis.Projection(eigenbasis.complete(L.graph.symmetric_laplacian()), h), h, high, "exact")
    return Design(approximate(h, tolerance, passed_on), h, high, "chebyshev")


def is_exact(method: str, vertex_count: int) -> bool:
    """Whether a method means eigenvectors, at that size."""
    method = check_choice("method", method, METHODS)
    return method == "exact" or (method == "auto" and vertex_count <= eigenbasis.DENSE_VERTICES)

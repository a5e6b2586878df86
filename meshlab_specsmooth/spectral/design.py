"""Turn a response and a cut-off (a number of modes, a wavelength) into a filter that can be applied."""

from __future__ import annotations

from dataclasses import dataclass

from scipy.sparse import csr_array

from meshlab_specsmooth.errors import InvalidParameter
from meshlab_specsmooth.graph.laplacian import Laplacian
from meshlab_specsmooth.parameters import check_choice
from meshlab_specsmooth.runtime.progress import Progress
from meshlab_specsmooth.spectral import SpectralFilter, density, eigenbasis, inertia
from meshlab_specsmooth.spectral.chebyshev import ErrorGain, approximate
from meshlab_specsmooth.spectral.cutoff import Cutoff, from_eigenvalue, from_wavelength
from meshlab_specsmooth.spectral.density import Density
from meshlab_specsmooth.spectral.eigenbasis import Eigenbasis, Projection
from meshlab_specsmooth.spectral.response import Family, Response, band, check_response

METHODS = ("auto", "exact", "chebyshev")
MODE_COUNTS = ("estimate", "exact")

_ONE_CUTOFF = "a family of responses needs either modes or wavelength, a response takes neither"


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
    response: Response | Family,
    *,
    modes: int | None = None,
    wavelength: float | None = None,
    method: str,
    tolerance: float,
    mode_count: str = "estimate",
    error_gain: ErrorGain | None = None,
    mode_density: Density | None = None,
    progress: Progress | None = None,
) -> Design:
    """Design a filter for L.

    Parameters
    ----------
    L : Laplacian
    response : Response or callable
        A response, or a family of low-pass responses: a function from a cut-off eigenvalue to a response, such as
        those in :data:`meshlab_specsmooth.spectral.response.RESPONSES`.
    modes : int, optional
        Number of modes kept, 1 to n. A family needs this or ``wavelength``, a response takes neither.
    wavelength : float, optional
        Shortest wave kept, in mean edge lengths.
    method : {"auto", "exact", "chebyshev"}
        ``auto`` is exact up to :data:`eigenbasis.DENSE_VERTICES` vertices.
    tolerance, error_gain
        Error allowed to a polynomial, see :func:`meshlab_specsmooth.spectral.chebyshev.approximate`.
    mode_count : {"estimate", "exact"}
        How a number of modes becomes a cut-off above :data:`eigenbasis.DENSE_VERTICES` vertices, for a polynomial.
    mode_density : Density, optional
        The density of modes of L, if it was measured already.
    progress : callable, optional
        Called with the fraction done, in [0, 1], while eigenvectors are computed.

    Returns
    -------
    Design
        The cut-off of a response is the eigenvalue where its gain first falls to one half, 2 where it never does.

    Raises
    ------
    InvalidParameter
        An unknown method, an unusable response or one that is too steep for a polynomial, or a family without a
        cut-off or with two.
    TooLarge
        An eigenbasis that would not fit in memory.
    """
    if (modes is not None) + (wavelength is not None) > (0 if isinstance(response, Response) else 1):
        raise InvalidParameter(_ONE_CUTOFF)
    mode_count = check_choice("mode_count", mode_count, MODE_COUNTS)
    exact = is_exact(method, L.size)
    if isinstance(response, Response):
        h = check_response(response)
        cutoff = from_eigenvalue(h.cutoff, L.size)
    elif wavelength is not None:
        cutoff = from_wavelength(wavelength, L.size)
        h = check_response(response(cutoff.eigenvalue))
    elif modes is not None:
        if exact:
            return _keep_modes(L.graph.symmetric_laplacian(), response, modes, progress)
        cutoff = _cutoff_of_modes(L, modes, mode_count, mode_density)
        h = check_response(response(cutoff.eigenvalue))
    else:
        raise InvalidParameter(_ONE_CUTOFF)
    if exact:
        return Design(Projection(_basis_for(L.graph.symmetric_laplacian(), h, progress), h), h, cutoff, "exact")
    return Design(approximate(h, tolerance, error_gain), h, cutoff, "chebyshev")


def design_band(
    L: Laplacian,
    family: Family,
    longest: float,
    shortest: float,
    *,
    method: str,
    tolerance: float,
    error_gain: ErrorGain | None = None,
) -> Design:
    """Design a band-pass for the waves between two lengths, in mean edges.

    Parameters, errors
        As for :func:`design`.

    Returns
    -------
    Design
        Its cut-off is that of the shortest wave.
    """
    n = L.size
    low, high = from_wavelength(longest, n), from_wavelength(shortest, n)
    h = check_response(band(family(low.eigenvalue), family(high.eigenvalue)))
    if is_exact(method, n):
        return Design(Projection(eigenbasis.full(L.graph.symmetric_laplacian()), h), h, high, "exact")
    return Design(approximate(h, tolerance, error_gain), h, high, "chebyshev")


def is_exact(method: str, vertex_count: int) -> bool:
    """Whether a method means eigenvectors, at that size."""
    method = check_choice("method", method, METHODS)
    return method == "exact" or (method == "auto" and vertex_count <= eigenbasis.DENSE_VERTICES)


def _cutoff_of_modes(L: Laplacian, modes: int, mode_count: str, mode_density: Density | None) -> Cutoff:
    """The cut-off with that many modes below it, without eigenvectors on large meshes."""
    if L.size <= eigenbasis.DENSE_VERTICES:
        return eigenbasis.full(L.graph.symmetric_laplacian()).cutoff(modes)
    cutoff = density.cutoff_of_modes(L, modes) if mode_density is None else mode_density.cutoff(modes)
    return inertia.cutoff_of_modes(L.graph.symmetric_laplacian(), modes, cutoff) if mode_count == "exact" else cutoff


def _keep_modes(S: csr_array, family: Family, modes: int, progress: Progress | None) -> Design:
    """The exact filter that keeps a number of modes; the cut-off follows from the eigenvalues."""
    # a response that is zero above its cut-off needs the modes below and one more, to place the cut-off between them
    vanishes = check_response(family(1.0)).support <= 1.0
    basis = eigenbasis.lowest_with_gap(S, modes, progress) if vanishes else eigenbasis.full(S, progress)
    cutoff = basis.cutoff(modes)
    h = check_response(family(cutoff.eigenvalue))
    if len(basis.eigenvalues) < S.shape[0] and h.support > cutoff.eigenvalue:  # not at every cut-off
        basis = eigenbasis.full(S)
    return Design(Projection(basis, h), h, cutoff, "exact")


def _basis_for(S: csr_array, h: Response, progress: Progress | None) -> Eigenbasis:
    """The eigenvectors at which the response is not known to be zero."""
    if h.support < 2:
        return eigenbasis.up_to(S, from_eigenvalue(h.support, S.shape[0]), progress)
    return eigenbasis.full(S, progress)

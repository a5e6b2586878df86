"""How wide the margin of a piece must be for the piece to give what the whole gives."""

from __future__ import annotations

import math

#: Default difference to smoothing the whole, relative to the root mean square displacement.
TOLERANCE = 1e-3

# The amplitude with which an error at the border of a piece enters, as measured on irregular triangles
_AMPLITUDE = 4.0


# Variance, in squared rings, of what an iteration of the edge-aware filter spreads: its vertices take fifteen steps
# after the normals. Measured for strengths up to 8 and up to thirty iterations
_SPREAD = 8.0


def find_margin(
    weight: float,
    cutoff: float,
    tolerance: float = TOLERANCE,
    edge_aware_iterations: int = 0,
    along_curves: bool = False,
) -> int:
    """Return the number of rings of vertices around a piece for which its own vertices are as in the whole.

    The least squares of step 3 answer a change at one place by their Green's function. Its poles are where
    ``x^2 + w^2 = 0`` for the eigenvalue x. With x = k^2 / 4 for waves of wave number k per edge on triangles, they are
    at ``k = 2 sqrt(i w)``, so it falls off as ``exp(-sqrt(2 w) r)`` over r rings. The heat response ``exp(-t x)``,
    which is 1/2 at the cut-off, falls off as a Gaussian of variance t / 2. Iterations of the edge-aware filter spread
    a change as a Gaussian too. The errors of all add up.

    Parameters
    ----------
    weight : float
        Of the barycenters; the lowest one, if it varies.
    cutoff : float
        Eigenvalue at which the response is 1/2.
    tolerance : float
        Relative to the root mean square displacement.
    edge_aware_iterations : int
        Of the edge-aware filter, after isotropic smoothing as its guide.
    along_curves : bool
        Whether a boundary is smoothed along itself, where x = k^2 / 2.

    Examples
    --------
    >>> from meshlab_specsmooth.pieces.margin import find_margin
    >>> find_margin(0.1, 0.025), find_margin(0.02, 0.025)
    (23, 46)
    """
    decades = math.log(_AMPLITUDE / tolerance)
    of_least_squares = decades / math.sqrt(weight if along_curves else 2 * weight)
    deviation = math.sqrt(math.log(2) / cutoff / 2)
    of_response = math.sqrt(2 * decades) * deviation
    of_edge_aware = math.sqrt(2 * decades * _SPREAD * edge_aware_iterations)
    *smaller, largest = sorted((of_least_squares, of_response, of_edge_aware))
    return math.ceil(largest + sum(smaller) / 4)

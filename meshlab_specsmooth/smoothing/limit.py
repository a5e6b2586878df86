"""A limit of the displacement, as a constraint of the reconstruction.

The filter's surface Y minimizes the energy of step 3, E(V') = E(Y) + |V' - Y|_A^2 with the normal matrix
A = L^T L + w^2 C^T C. The surface of least energy with |V'_i - V_i| <= r at each vertex is thus the projection of Y on
these balls in the norm of A, not in the Euclidean one, which would cut each vertex off by itself and leave kinks. For
filters with another energy it is the surface that differs least from theirs in this norm: their detail is kept.

It is found by accelerated projected gradients in the inner product with the degrees D, in which D^-1 A is self-adjoint
and the projection on the balls is that of each vertex alone (Beck, Teboulle, *A fast iterative shrinkage-thresholding
algorithm*, SIAM J. Imaging Sci. 2009; restarted as by O'Donoghue, Candes, *Adaptive restart*, 2015).
"""

from __future__ import annotations

from dataclasses import replace
from typing import TypeVar

import numpy as np

from meshlab_specsmooth.arrays import Booleans, Floats
from meshlab_specsmooth.errors import NotConverged
from meshlab_specsmooth.graph.laplacian import Laplacian
from meshlab_specsmooth.operators.assemble import Operators, assemble_surface
from meshlab_specsmooth.operators.barycenters import Gram
from meshlab_specsmooth.operators.reconstruction import NormalMatrix
from meshlab_specsmooth.parameters import resolve_length
from meshlab_specsmooth.runtime.workspace import Workspace
from meshlab_specsmooth.smoothing.filter import get_displacement, hold_barycenters, move_vertices
from meshlab_specsmooth.smoothing.result import FilterResult, SmoothingResult, add_warnings
from meshlab_specsmooth.smoothing.settings import Region

R = TypeVar("R", bound=FilterResult)

# Weight of the barycenters in the norm for filters without one of their own. At noise of 0.3 edges, with a tenth of the
# vertices beyond the limit, the RMS error of the normals is 14 % lower than by shortening each displacement; with a
# weight of 1 it is 2 % lower, and with 3 it is higher
_WEIGHT = 0.3

# Change of a vertex in an iteration, relative to the limit, at which the iteration ends. It does not show
_TOLERANCE = 1e-3
_MAX_ITERATIONS = 2000

# Steps of the power iteration for the largest eigenvalue, and a margin on what it finds, which is from below
_POWER_STEPS = 12
_MARGIN = 1.2


def limit_displacement(result: R, region: Region, ops: Operators | None = None) -> R:
    """Hold a result within the ``max_displacement`` of a region.

    Parameters
    ----------
    result : FilterResult
        With ``given``, the surface before.
    region : Region
    ops : Operators, optional
        Of the surface before; assembled where needed if not given.

    Returns
    -------
    FilterResult
        The same result if no vertex moves further; else with other vertices, and with ``limited``, the number of
        vertices that are at the limit.

    Raises
    ------
    NotConverged
        The projection did not reach its tolerance.
    """
    if region.max_displacement is None or result.given is None:
        return result
    V = result.given.vertices
    limit = resolve_length(region.max_displacement, V)
    if not np.any(_lengths(result.vertices - V) > limit):
        return result
    ops = assemble_surface(result.given, weld=result.welded > 0) if ops is None else ops
    weight = result.barycenter_weight if isinstance(result, SmoothingResult) else _WEIGHT
    held = hold_barycenters(ops, weight if np.any(weight) else _WEIGHT)
    filtered = get_displacement(ops, result.vertices)
    radius = float(np.ldexp(limit, -ops.exponent))
    displacement = project(ops.L, held.gram.scaled(held.factor**2), filtered, radius)
    at_limit = find_limited(displacement, radius)
    count = int(at_limit.sum() if ops.active_index is None else at_limit[ops.active_index[ops.active_index >= 0]].sum())
    vertices, rms = move_vertices(ops, displacement)
    line = f"{count} of {len(V)} vertices are held at the max_displacement of {limit:.4g}"
    if getattr(result, "noise", None) is not None:
        line += "; estimated errors are those without this limit"
    return add_warnings(replace(result, vertices=vertices, displacement=rms, limited=count), line)


def find_limited(displacement: Floats, radius: float) -> Booleans:
    """(k,) whether a displacement is at the limit."""
    return np.asarray(_lengths(displacement) >= radius * (1 - _TOLERANCE))


def project(L: Laplacian, gram: Gram, filtered: Floats, radius: float) -> Floats:
    """Project displacements (k, 3) on |x_i| <= radius in the norm of L^T L + gram; rows of zeros stay zero."""
    moves = np.any(filtered, axis=1, keepdims=True).astype(np.float64)
    A = NormalMatrix(L, gram, moves, None)
    work = Workspace()
    step = 1.0 / (_MARGIN * _find_largest_eigenvalue(A, moves, work))
    x = _clip(filtered, radius)
    y, t = x, 1.0
    for _ in range(_MAX_ITERATIONS):
        gradient, _ = A.matvec(y - filtered, work)
        new = _clip(y - step * gradient, radius)
        work.give_back(gradient)
        change = new - x
        if np.sqrt(np.einsum("ij,ij->i", change, change).max(initial=0.0)) <= _TOLERANCE * radius:
            return new
        if np.einsum("ij,ij->", y - new, change) > 0:  # it turned back
            t = 1.0
        next_t = (1 + np.sqrt(1 + 4 * t * t)) / 2
        y = new + (t - 1) / next_t * change
        x, t = new, next_t
    raise NotConverged(
        f"the displacement is not limited to {_TOLERANCE:g} of max_displacement after {_MAX_ITERATIONS} iterations; "
        "raise barycenter_weight"
    )


def _find_largest_eigenvalue(A: NormalMatrix, moves: Floats, work: Workspace) -> float:
    """An estimate from below of the largest eigenvalue of D^-1 A."""
    x = np.random.default_rng(0).standard_normal((len(moves), 3)) * moves
    found = 1.0
    for _ in range(_POWER_STEPS):
        y, size = A.matvec(x, work)
        found = size / A.L.inner_products(x, x)[0]
        x = y / np.sqrt((y**2).mean())
    return found


def _clip(X: Floats, radius: float) -> Floats:
    """Rows that are longer than the radius are shortened to it, less a rounding."""
    length = _lengths(X)[:, None]
    return np.asarray(X * np.where(length > radius, radius / np.maximum(length, radius) * (1 - 1e-12), 1.0))


def _lengths(X: Floats) -> Floats:
    return np.asarray(np.sqrt(np.einsum("ij,ij->i", X, X)))

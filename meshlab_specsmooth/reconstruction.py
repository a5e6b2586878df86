"""Step 3: the surface that has the filtered differential coordinates and keeps its face barycentres (eq. 5-6).

Solves min over V' of |L V' - delta'|^2 + w^2 |C V' - C V|^2 for the displacement x = V' - V, whose normal equations are

    (L^T L + w^2 C^T C) x = L^T (delta' - L V),

by conjugate gradients with a Jacobi preconditioner, all columns together, L and L^T applied in turn: neither a dense
matrix nor L^T L is formed. On every component with an edge only constants are in the null space of L, and no constant
but zero is in that of C, so the system is positive definite for every w > 0.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_array

from meshlab_specsmooth.errors import NotConverged
from meshlab_specsmooth.operators import Laplacian
from meshlab_specsmooth.spectral.progress import Progress
from meshlab_specsmooth.surface import Floats

TOLERANCE = 1e-8  # residual of the normal equations relative to their right-hand side, each column
MOST_ITERATIONS = 20_000


@dataclass(frozen=True, eq=False)
class Solution:
    """The displacement and how well it solves the normal equations.

    Attributes
    ----------
    displacement : (n, k) float64
    iterations : int
    residual : float
        Largest over the columns of |A x - b| / |b|, recomputed from the solution.
    """

    displacement: Floats
    iterations: int
    residual: float


@dataclass(frozen=True, eq=False)
class Constraints:
    """What the reconstruction must leave alone.

    Attributes
    ----------
    free : (n, 1) float64
        1 where a vertex may move, 0 where its displacement is prescribed.
    rows : (n, 1) float64
        1 where a vertex' differential coordinates are asked for, 0 where they have no say.
    prescribed : (n, k) float64
        Displacements, in mesh units; 0 where free.
    """

    free: Floats
    rows: Floats
    prescribed: Floats


def solve(
    L: Laplacian,
    gram: csr_array,
    weight: float,
    change: Floats,
    progress: Progress | None = None,
    constraints: Constraints | None = None,
) -> Solution:
    """Displacement that turns the differential coordinates by ``change`` as well as the barycentres allow.

    Parameters
    ----------
    L : Laplacian
    gram : (n, n) csr_array
        C^T C of the face barycentres.
    weight : float
        w > 0, dimensionless.
    change : (n, k) float64
        delta' - delta, in mesh units.
    progress : callable, optional
        Called with the fraction done, in [0, 1].
    constraints : Constraints, optional
        None: every vertex is free and every row asked for.

    Raises
    ------
    NotConverged
        After :data:`MOST_ITERATIONS`, with the residual that was reached.
    """
    w2 = weight * weight
    free, rows = (constraints.free, constraints.rows) if constraints is not None else (1.0, 1.0)

    def normal_matrix(p: Floats) -> Floats:
        return np.asarray(free * (L.transposed(rows * (L @ p)) + w2 * (gram @ p)))

    b = free * L.transposed(rows * change)
    if constraints is not None:
        b = b - normal_matrix(constraints.prescribed)
    scale = np.linalg.norm(b, axis=0)
    # a column that is nothing but rounding has nothing to solve for
    active = scale > np.finfo(float).eps * scale.max(initial=0.0)
    x = np.zeros_like(b)
    if not active.any():
        return Solution(x if constraints is None else constraints.prescribed, 0, 0.0)
    scale, b = scale[active], b[:, active]

    inverse_diagonal = 1 / (_gram_diagonal(L, rows) + w2 * gram.diagonal()[:, None])
    target = TOLERANCE * scale
    residual = b.copy()
    z = inverse_diagonal * residual
    p = z.copy()
    rho = _dots(residual, z)
    solution = np.zeros_like(residual)
    iterations = 0
    while True:
        norm = np.sqrt(_dots(residual, residual))
        if (norm <= target).all():
            break
        if iterations == MOST_ITERATIONS:
            worst = float((norm / scale).max())
            raise NotConverged(
                f"the least-squares solve stands at a relative residual of {worst:.1e} after {iterations} iterations "
                f"(wanted {TOLERANCE:.0e}); raise barycenter_weight ({weight:g})"
            )
        if progress is not None:
            progress(float(np.clip(np.log(norm / scale).max() / np.log(TOLERANCE), 0, 1)))
        q = normal_matrix(p)
        curvature = _dots(p, q)
        # a column that has converged to the last bit has no direction left
        step = np.divide(rho, curvature, out=np.zeros_like(rho), where=curvature > 0)
        solution += step * p
        residual -= step * q
        z = inverse_diagonal * residual
        following = _dots(residual, z)
        p *= np.divide(following, rho, out=np.zeros_like(rho), where=rho > 0)
        p += z
        rho = following
        iterations += 1
    reached = np.linalg.norm(normal_matrix(solution) - b, axis=0) / scale
    x[:, active] = solution
    return Solution(x if constraints is None else x + constraints.prescribed, iterations, float(reached.max()))


def _dots(X: Floats, Y: Floats) -> Floats:
    """Dot product of each column."""
    return np.asarray(np.einsum("ij,ij->j", X, Y))


def _gram_diagonal(L: Laplacian, rows: Floats | float) -> Floats:
    """(n, 1) diagonal of L^T R L: sum over the rows i asked for of L_ij^2."""
    squared = L.S.copy()
    squared.data = squared.data**2
    # L_ij = d_i^-1/2 S_ij d_j^1/2
    return np.asarray(squared.T @ (rows / L.root_degree**2) * L.root_degree**2)

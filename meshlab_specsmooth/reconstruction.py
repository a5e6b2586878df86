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


def solve(L: Laplacian, gram: csr_array, weight: float, change: Floats, progress: Progress | None = None) -> Solution:
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

    Raises
    ------
    NotConverged
        After :data:`MOST_ITERATIONS`, with the residual that was reached.
    """
    b = L.transposed(change)
    scale = np.linalg.norm(b, axis=0)
    # a column that is nothing but rounding has nothing to solve for
    active = scale > np.finfo(float).eps * scale.max(initial=0.0)
    x = np.zeros_like(b)
    if not active.any():
        return Solution(x, 0, 0.0)

    w2 = weight * weight

    def normal_matrix(p: Floats) -> Floats:
        return L.transposed(L @ p) + w2 * np.asarray(gram @ p)

    inverse_diagonal = 1 / (_gram_diagonal(L) + w2 * gram.diagonal())[:, None]
    target = TOLERANCE * scale[active]
    residual = b[:, active].copy()
    z = inverse_diagonal * residual
    p = z.copy()
    rho = _dots(residual, z)
    x_active = np.zeros_like(residual)
    iterations = 0
    while True:
        norm = np.sqrt(_dots(residual, residual))
        if (norm <= target).all():
            break
        if iterations == MOST_ITERATIONS:
            worst = float((norm / scale[active]).max())
            raise NotConverged(
                f"the least-squares solve stands at a relative residual of {worst:.1e} after {iterations} iterations "
                f"(wanted {TOLERANCE:.0e}); raise barycenter_weight ({weight:g})"
            )
        if progress is not None:
            progress(float(np.clip(np.log(norm / scale[active]).max() / np.log(TOLERANCE), 0, 1)))
        q = normal_matrix(p)
        curvature = _dots(p, q)
        # a column that has converged to the last bit has no direction left
        step = np.divide(rho, curvature, out=np.zeros_like(rho), where=curvature > 0)
        x_active += step * p
        residual -= step * q
        z = inverse_diagonal * residual
        following = _dots(residual, z)
        p *= np.divide(following, rho, out=np.zeros_like(rho), where=rho > 0)
        p += z
        rho = following
        iterations += 1
    x[:, active] = x_active
    reached = np.linalg.norm(normal_matrix(x_active) - b[:, active], axis=0) / scale[active]
    return Solution(x, iterations, float(reached.max()))


def _dots(X: Floats, Y: Floats) -> Floats:
    """Dot product of each column."""
    return np.asarray(np.einsum("ij,ij->j", X, Y))


def _gram_diagonal(L: Laplacian) -> Floats:
    """Diagonal of L^T L: sum over i of L_ij^2."""
    squared = L.S.copy()
    squared.data = squared.data**2
    # L_ij = d_i^-1/2 S_ij d_j^1/2
    return np.asarray((squared.T @ (1 / L.root_degree**2) * L.root_degree**2)[:, 0])

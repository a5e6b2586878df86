"""Step 3: the surface with the filtered differential coordinates and the barycenters of the given one (eq. 5-6).

Solves min over V' of |L V' - delta'|^2 + w^2 |C V' - C V|^2 for the displacement x = V' - V, whose normal equations are

    (L^T L + w^2 C^T C) x = L^T (delta' - L V),

by conjugate gradients with a Jacobi preconditioner, x, y and z together, applying L and L^T in turn: neither a dense
matrix nor L^T L is formed. On every component with an edge the null space of L contains only constants, and that of C
no constant but zero, so the system is positive definite for every w > 0.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.sparse import csr_array

from meshlab_specsmooth.arrays import Floats
from meshlab_specsmooth.errors import NotConverged
from meshlab_specsmooth.graph.laplacian import Laplacian
from meshlab_specsmooth.graph.protocols import COLUMNS
from meshlab_specsmooth.operators.barycenters import Gram
from meshlab_specsmooth.runtime import blocks
from meshlab_specsmooth.runtime.progress import Progress
from meshlab_specsmooth.runtime.workspace import Workspace

# Residual of the normal equations relative to their right-hand side, each column, at w = 1. Their smallest eigenvalue
# decreases as w^2, and so does the tolerance for w < 1: the relative error of the displacement is then at most about
# this.
# docs/constants.md: TOLERANCE
TOLERANCE = 1e-4
_MIN_TOLERANCE = 1e-11  # rounding does not allow for much less
MAX_ITERATIONS = 20_000


def tolerance(weight: float, rtol: float = TOLERANCE) -> float:
    """Relative residual for a relative error ``rtol`` of the displacement, at a weight."""
    return max(rtol * min(1.0, weight * weight), _MIN_TOLERANCE)


def error_gain(eigenvalues: Floats, weight: float) -> Floats:
    """Sensitivity of a mode's displacement to an error in delta': l / (l^2 + w^2 b), b = 2 - 4 l / 3.

    Exact on a regular closed mesh, where b is the eigenvalue of C^T C.
    """
    b = np.maximum(2 - 4 * eigenvalues / 3, 0.0)
    return np.asarray(eigenvalues / np.maximum(eigenvalues**2 + weight**2 * b, np.finfo(np.float64).tiny))


def transfer_function(eigenvalues: Floats, gain: Floats, weight: float) -> Floats:
    """Gain of all three steps together, H = (l^2 h + w^2 b) / (l^2 + w^2 b), b = 2 - 4 l / 3.

    Exact on a regular closed mesh; ``gain`` is the low-pass h at the eigenvalues l.
    """
    held = weight**2 * np.maximum(2 - 4 * eigenvalues / 3, 0.0)
    whole = np.maximum(eigenvalues**2 + held, np.finfo(np.float64).tiny)
    return np.asarray((eigenvalues**2 * gain + held) / whole)


@dataclass(frozen=True, eq=False)
class Solution:
    """The displacement and the accuracy to which it solves the normal equations.

    Attributes
    ----------
    displacement : (n, 3) float64
    iterations : int
    residual : float
        Largest over the columns of |A x - b| / |b|, recomputed from the solution.
    """

    displacement: Floats
    iterations: int
    residual: float


@dataclass(frozen=True, eq=False)
class Constraints:
    """Vertices and equations that are excluded from the reconstruction.

    Attributes
    ----------
    free : (n, 1) float64
        1 where a vertex may move, 0 where its displacement is prescribed.
    rows : (n, 1) float64
        1 where the equations of a vertex' differential coordinates are used, 0 where they are left out.
    prescribed : (n, 3) float64
        Displacements, in mesh units; 0 where free.
    """

    free: Floats
    rows: Floats
    prescribed: Floats


@dataclass(frozen=True, eq=False)
class _NormalMatrix:
    """A = F (L^T R L + G), with G = w^2 C^T C, and the diagonals F of the free vertices and R of the rows used.

    Without constraints F and R are 1 everywhere, and None.
    """

    L: Laplacian
    gram: Gram
    free: Floats | None
    rows: Floats | None

    @functools.cached_property
    def irregular(self) -> tuple[npt.NDArray[np.int64], csr_array]:
        """The vertices at edges that do not have two faces, and their rows of the entries that G has there."""
        at = np.flatnonzero(np.diff(self.gram.irregular.indptr))
        entries = self.gram.irregular[at]
        return at, entries if self.free is None else entries.multiply(self.free[at]).tocsr()

    def matvec(self, p: Floats, scratch: Floats, q: Floats) -> Floats:
        """``q`` becomes A p, overwriting ``scratch``; returns (3,) p . q."""
        n, kernels, gram, edge = len(p), self.L.kernels, self.gram, self.gram.regular_edge
        sums = np.empty((blocks.count(n), COLUMNS))
        blocks.parallel_for(lambda i, j: kernels.normal_matvec_1(i, j, p, self.rows, edge, scratch), n)
        blocks.parallel_for(
            lambda i, j: kernels.normal_matvec_2(i, j, p, scratch, self.free, edge, gram.diagonal, q, sums), n
        )
        pAp = sums.sum(axis=0)
        at, entries = self.irregular
        if len(at):
            more = entries @ p
            q[at] += more
            pAp += (p[at] * more).sum(axis=0)
        return np.asarray(pAp)

    def inverse_diagonal(self) -> Floats:
        """(n, 1): one over the diagonal of L^T R L + G; L_ij = - w_ij / d_i."""
        sums = self.L.sums_of_squares(_or_one(self.rows) / self.L.degree**2)
        sums += _or_one(self.rows)
        sums += self.gram.diagonal
        return np.divide(1.0, sums, out=sums)


def solve(
    L: Laplacian,
    gram: Gram,
    weight: float,
    change: Floats,
    progress: Progress | None = None,
    constraints: Constraints | None = None,
    start: Floats | None = None,
    rtol: float = TOLERANCE,
    workspace: Workspace | None = None,
    overwrite_change: bool = False,
) -> Solution:
    """Solve for the displacement that changes the differential coordinates, subject to the barycenters.

    Preconditioned conjugate gradients; the numbers are those of Saad, *Iterative Methods for Sparse Linear Systems*
    (2003), algorithm 9.1.

    Parameters
    ----------
    L : Laplacian
    gram : Gram
        C^T C of the face barycenters.
    weight : float
        w > 0, dimensionless.
    change : (n, 3) float64
        delta' - delta, in mesh units.
    progress : callable, optional
        Called with the fraction done, in [0, 1].
    constraints : Constraints, optional
        None: every vertex is free and every row is used.
    start : (n, 3) float64, optional
        Initial guess of the displacement: the closer, the fewer iterations.
    rtol : float
        Relative error of the displacement.
    workspace : Workspace, optional
        Work arrays; those that were used, but not the displacement, are in it afterwards.
    overwrite_change : bool
        Whether ``change`` may be used as a work array and given to the workspace.

    Raises
    ------
    NotConverged
        After :data:`MAX_ITERATIONS`, with the residual that was reached.
    """
    w2 = weight * weight
    free, rows = (None, None) if constraints is None else (constraints.free, constraints.rows)
    A = _NormalMatrix(L, gram.scaled(w2), free, rows)
    work = Workspace() if workspace is None else workspace
    scratch = work.borrow(change)
    # L^T R change = D L D^-1 R change
    b = L.product(blocks.multiply(change, _or_one(rows) / L.degree, scratch), work.borrow(change))
    blocks.multiply(b, _or_one(free) * L.degree, b)
    if overwrite_change:
        work.give_back(change)
    q, r, p, x = (work.borrow(b) for _ in range(4))
    if constraints is not None and constraints.prescribed.any():
        A.matvec(constraints.prescribed, scratch, q)
        b -= q
    m = A.inverse_diagonal()  # M^-1, the preconditioner
    r[...] = b
    rr, rz = _update_residual(L, np.zeros(COLUMNS), b, m, r)
    scale = np.sqrt(rr)
    # a column that holds only rounding errors has nothing to solve for
    active = scale > np.finfo(float).eps * scale.max(initial=0.0)
    if not active.any():
        return Solution(np.zeros_like(b) if constraints is None else constraints.prescribed, 0, 0.0)
    for column in np.flatnonzero(~active):
        b[:, column], r[:, column], rz[column], rr[column], scale[column] = 0, 0, 0, 0, 1

    wanted = tolerance(weight, rtol)
    # 1. r = b - A x, z = M^-1 r, p = z
    if start is None:
        x.fill(0.0)
    else:
        np.multiply(start, _or_one(free) * active, out=x)
        A.matvec(x, scratch, q)
        rr, rz = _update_residual(L, np.ones(COLUMNS), q, m, r)
    blocks.multiply(r, m, p)
    norm = np.sqrt(rr)
    iterations = 0
    # 2. until convergence
    while (norm > wanted * scale).any():
        worst = float((norm / scale).max())
        if iterations == MAX_ITERATIONS:
            raise NotConverged(
                f"the least-squares solve stands at a relative residual of {worst:.1e} after {iterations} iterations "
                f"(wanted {wanted:.0e}); raise barycenter_weight ({weight:g})"
            )
        if progress is not None:
            progress(float(np.clip(np.log(worst) / np.log(wanted), 0, 1)))
        pAp = A.matvec(p, scratch, q)
        # 3. alpha = (r, z) / (A p, p); a column that has converged to the last bit has no direction left
        alpha = np.divide(rz, pAp, out=np.zeros_like(rz), where=pAp > 0)
        # 5., 6. r = r - alpha A p, z = M^-1 r
        rr, rz_next = _update_residual(L, alpha, q, m, r)
        norm = np.sqrt(rr)
        # 7. beta = (r, z) / (r, z) before
        beta = np.divide(rz_next, rz, out=np.zeros_like(rz), where=rz > 0)
        # 4., 8. x = x + alpha p, p = z + beta p
        _update_direction(L, alpha, beta, m, r, x, p)
        rz = rz_next
        iterations += 1
    A.matvec(x, scratch, q)
    rr, _ = _update_residual(L, np.ones(COLUMNS), q, m, b)
    reached = np.sqrt(rr) / scale
    work.give_back(scratch, b, q, r, p)
    if constraints is not None:
        x += constraints.prescribed
    return Solution(x, iterations, float(reached.max()))


def reconstruct(
    L: Laplacian, gram: Gram, X: Floats, weight: float, change: Floats | None = None, rtol: float = TOLERANCE
) -> Floats:
    """(n, 3) surface of least |L V' - L X - change|^2 + w^2 |C V' - C X|^2: the solution added to the positions.

    Without ``change`` no differential coordinates are kept, as with a very low cut-off. ``rtol`` is the relative error
    of the displacement.
    """
    return np.asarray(X + solve(L, gram, weight, -(L @ X) if change is None else change, rtol=rtol).displacement)


def _or_one(column: Floats | None) -> Floats | float:
    return 1.0 if column is None else column


def _update_residual(L: Laplacian, alpha: Floats, q: Floats, m: Floats, r: Floats) -> tuple[Floats, Floats]:
    """``r`` becomes r - alpha q; returns (3,) r . r and (3,) r . (m r)."""
    sums = np.empty((blocks.count(len(r)), 2 * COLUMNS))
    blocks.parallel_for(lambda i, j: L.kernels.update_residual(i, j, alpha, q, m, r, sums), len(r))
    both = sums.sum(axis=0)
    return both[:COLUMNS], both[COLUMNS:]


def _update_direction(L: Laplacian, alpha: Floats, beta: Floats, m: Floats, r: Floats, x: Floats, p: Floats) -> None:
    """``x`` becomes x + alpha p, then ``p`` m r + beta p."""
    blocks.parallel_for(lambda i, j: L.kernels.update_direction(i, j, alpha, beta, m, r, x, p), len(r))

"""Step 3: the surface with the filtered differential coordinates and the barycenters of the given one (eq. 5-6).

Solves min over V' of |L V' - delta'|^2 + w^2 |C V' - C V|^2 for the displacement x = V' - V, whose normal equations are

    (L^T L + w^2 C^T C) x = L^T (delta' - L V),

by conjugate gradients, preconditioned by a polynomial of L (see :mod:`.preconditioner`), x, y and z together, applying
L and L^T in turn: neither a dense matrix nor L^T L is formed. On every component with an edge the null space of L
contains only constants, and that of C no constant but zero, so the system is positive definite for every w > 0.
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
from meshlab_specsmooth.operators.barycenters import Gram
from meshlab_specsmooth.operators.preconditioner import Diagonal, Polynomials, precondition
from meshlab_specsmooth.runtime import blocks
from meshlab_specsmooth.runtime.progress import Progress
from meshlab_specsmooth.runtime.workspace import Workspace

#: Relative error of the displacement that does not show: of noise of 0.2 edges it is less than a thousandth of an edge.
# docs/constants.md: TOLERANCE
TOLERANCE = 3e-3
MAX_ITERATIONS = 20_000

# Rounding does not allow for a residual that is much less.
_MIN_RESIDUAL = 1e-13


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
        |A x - b| / |b|, recomputed from the solution, in the norm of D^-1.
    error : float
        Estimate of |x - A^-1 b| / |x|, in the norm of D.
    """

    displacement: Floats
    iterations: int
    residual: float
    error: float


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
class NormalMatrix:
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

    def matvec(self, p: Floats, workspace: Workspace) -> tuple[Floats, float]:
        """Q = D^-1 A p, and p . A p."""
        scratch, q = workspace.borrow(p), workspace.borrow(p)
        n, kernels, gram, edge = len(p), self.L.kernels, self.gram, self.gram.regular_edge
        sums = np.empty(blocks.count(n))
        blocks.parallel_for(lambda i, j: kernels.normal_matvec_1(i, j, p, self.rows, edge, scratch), n)
        blocks.parallel_for(
            lambda i, j: kernels.normal_matvec_2(i, j, p, scratch, self.free, edge, gram.diagonal, q, sums), n
        )
        pAp = float(sums.sum())
        at, entries = self.irregular
        if len(at):
            more = entries @ p
            q[at] += more / self.L.degree[at]
            pAp += float(np.einsum("ij,ij->", p[at], more))
        workspace.give_back(scratch)
        return q, pAp

    def precondition(self, is_uniform: bool) -> Diagonal | Polynomials:
        """An approximate inverse of D^-1 A."""
        found = precondition(self.L, self.gram.diagonal, is_uniform, self.free)
        if found is not None:
            return found
        # the diagonal of L^T R L + G; L_ij = - w_ij / d_i
        sums = self.L.sums_of_squares(_or_one(self.rows) / self.L.degree**2)
        sums += _or_one(self.rows)
        sums += self.gram.diagonal
        inverse = np.divide(self.L.degree, sums, out=sums)
        squared = 9 * self.gram.diagonal / self.L.degree
        moving = squared if self.free is None else squared[self.free > 0]
        lowest = float(np.sqrt(moving.min(initial=np.inf)))
        return Diagonal(inverse if self.free is None else inverse * self.free, lowest)


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
    overwrite_input: bool = False,
) -> Solution:
    """Solve for the displacement that changes the differential coordinates, subject to the barycenters.

    Preconditioned conjugate gradients in the inner product with the weights D, as D^-1 A is self-adjoint in it; the
    numbers are those of Saad, *Iterative Methods for Sparse Linear Systems* (2003), algorithm 9.1. The three columns
    share alpha and beta, so that the result is equivariant under rotations.

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
        Relative error of the displacement at which the iteration ends.
    workspace : Workspace, optional
        Work arrays; those that were used, but not the displacement, are in it afterwards.
    overwrite_input : bool
        Whether ``change`` and ``start`` may be used as work arrays, and be given to the workspace or returned.

    Raises
    ------
    NotConverged
        After :data:`MAX_ITERATIONS`, with the error that was reached.
    """
    free, rows = (None, None) if constraints is None else (constraints.free, constraints.rows)
    A = NormalMatrix(L, gram.scaled(weight * weight), free, rows)
    M = A.precondition(is_uniform=gram.regular_edge > 0)
    work = Workspace() if workspace is None else workspace
    # D^-1 b = D^-1 L^T R change = L D^-1 R change, where free
    scaled = blocks.multiply(change, _or_one(rows) / L.degree, work.borrow(change))
    b = L.product(scaled, change if overwrite_input else work.borrow(change))
    work.give_back(scaled)
    if free is not None:
        blocks.multiply(b, free, b)
    if constraints is not None and constraints.prescribed.any():
        _subtract(b, A.matvec(constraints.prescribed, work)[0], b)
    bb, _ = L.inner_products(b, b)
    if bb == 0:  # nothing to solve for
        return Solution(np.zeros_like(b) if constraints is None else constraints.prescribed, 0, 0.0, 0.0)
    # 1. r = b - A x, z = M^-1 r, p = z
    r = work.borrow(b)
    if start is None:
        x = work.borrow(b)
        x.fill(0.0)
        r[...] = b
    else:
        x = start if overwrite_input else work.borrow(b)
        if free is not None:
            blocks.multiply(start, free, x)
        elif x is not start:
            x[...] = start
        q, _ = A.matvec(x, work)
        _subtract(b, q, r)
        work.give_back(q)
    p = M.apply(r, work)
    zz, rz = L.inner_products(p, r)
    iterations, error, contraction = 0, 0.0, 0.0
    # 2. until convergence
    while rz > 0:
        # 3. alpha = (r, z) / (A p, p)
        q, pAp = A.matvec(p, work)
        alpha = rz / pAp
        # 4., 5. x = x + alpha p, r = r - alpha A p
        xx, rr = _update_solution(L, alpha, p, q, x, r)
        work.give_back(q)
        iterations += 1
        residual = float(np.sqrt(rr / bb))
        error = M.estimate_error(max(1.0, alpha) * np.sqrt(zz / xx), contraction, residual) if xx > 0 else np.inf
        if error <= rtol or residual <= _MIN_RESIDUAL:
            break
        if iterations == MAX_ITERATIONS:
            raise NotConverged(
                f"the least-squares solve stands at a relative error of {error:.1e} after {iterations} iterations "
                f"(wanted {rtol:.0e}); raise barycenter_weight ({weight:g})"
            )
        if progress is not None:
            progress(float(np.clip(np.log(error) / np.log(rtol), 0, 1)))
        # 6. z = M^-1 r
        z = M.apply(r, work)
        zz_next, rz_next = L.inner_products(z, r)
        contraction = np.sqrt(zz_next / zz)
        # 7., 8. beta = (r, z) / (r, z) before, p = z + beta p
        _update_direction(L, rz_next / rz, z, p)
        work.give_back(z)
        rz, zz = rz_next, zz_next
    q, _ = A.matvec(x, work)
    _subtract(b, q, r)
    reached = np.sqrt(L.inner_products(r, r)[0] / bb)
    work.give_back(b, q, r, p)
    if constraints is not None:
        x += constraints.prescribed
    return Solution(x, iterations, float(reached), float(error))


def reconstruct(
    L: Laplacian,
    gram: Gram,
    X: Floats,
    weight: float,
    change: Floats | None = None,
    rtol: float = TOLERANCE,
    start: Floats | None = None,
    constraints: Constraints | None = None,
) -> Floats:
    """(n, 3) surface of least |L V' - L X - change|^2 + w^2 |C V' - C X|^2: the solution added to the positions.

    Without ``change`` no differential coordinates are kept, as with a very low cut-off. ``rtol`` is the relative error
    of the displacement, ``start`` an initial guess of it.
    """
    if change is None:
        change = -(L @ X)
    return np.asarray(X + solve(L, gram, weight, change, None, constraints, start, rtol).displacement)


def _subtract(X: Floats, Y: Floats, out: Floats) -> Floats:
    """Write X - Y to ``out``."""
    blocks.parallel_rows(lambda at: np.subtract(X[at], Y[at], out=out[at]), len(X))
    return out


def _or_one(column: Floats | None) -> Floats | float:
    return 1.0 if column is None else column


def _update_solution(L: Laplacian, alpha: float, p: Floats, q: Floats, x: Floats, r: Floats) -> tuple[float, float]:
    """``x`` becomes x + alpha p and ``r`` r - alpha q; returns x . D x and r . D r."""
    sums = np.empty((blocks.count(len(r)), 2))
    blocks.parallel_for(lambda i, j: L.kernels.update_solution(i, j, alpha, p, q, x, r, sums), len(r))
    xx, rr = sums.sum(axis=0)
    return float(xx), float(rr)


def _update_direction(L: Laplacian, beta: float, z: Floats, p: Floats) -> None:
    """``p`` becomes z + beta p."""
    blocks.parallel_for(lambda i, j: L.kernels.update_direction(i, j, beta, z, p), len(p))

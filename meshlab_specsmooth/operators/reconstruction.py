"""Step 3: the surface that has the filtered differential coordinates and keeps its face barycenters (eq. 5-6).

Solves min over V' of |L V' - delta'|^2 + w^2 |C V' - C V|^2 for the displacement x = V' - V, whose normal equations are

    (L^T L + w^2 C^T C) x = L^T (delta' - L V),

by conjugate gradients with a Jacobi preconditioner, x, y and z together, L and L^T applied in turn: neither a dense
matrix nor L^T L is formed. On every component with an edge only constants are in the null space of L, and no constant
but zero is in that of C, so the system is positive definite for every w > 0.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.sparse import csr_array

from meshlab_specsmooth.arrays import Floats
from meshlab_specsmooth.errors import NotConverged
from meshlab_specsmooth.graph.kernels import COLUMNS
from meshlab_specsmooth.graph.laplacian import Laplacian
from meshlab_specsmooth.operators.barycenters import Gram
from meshlab_specsmooth.runtime import blocks
from meshlab_specsmooth.runtime.progress import Progress

# Residual of the normal equations relative to their right-hand side, each column, at w = 1. Their least eigenvalue
# falls as w^2, and so does what is asked for below 1: the displacement is then off by no more than about this share.
TOLERANCE = 1e-4
_LEAST_TOLERANCE = 1e-11  # rounding does not allow for much less
MOST_ITERATIONS = 20_000


def tolerance(weight: float, off: float = TOLERANCE) -> float:
    """Relative residual that is asked for at a weight, where the displacement may be off by such a share."""
    return max(off * min(1.0, weight * weight), _LEAST_TOLERANCE)


def error_gain(eigenvalues: Floats, weight: float) -> Floats:
    """How far the displacement of a mode follows its differential coordinates: l / (l^2 + w^2 b), b = 2 - 4 l / 3.

    So it is on a regular mesh, where b is the eigenvalue of C^T C; the share of an error in delta' that is seen.
    """
    b = np.maximum(2 - 4 * eigenvalues / 3, 0.0)
    return np.asarray(eigenvalues / np.maximum(eigenvalues**2 + weight**2 * b, np.finfo(np.float64).tiny))


def transferred(eigenvalues: Floats, gain: Floats, weight: float) -> Floats:
    """What all three steps keep of a mode, H = (l^2 h + w^2 b) / (l^2 + w^2 b), b = 2 - 4 l / 3.

    On a regular closed mesh; ``gain`` is the low-pass h at the eigenvalues l.
    """
    held = weight**2 * np.maximum(2 - 4 * eigenvalues / 3, 0.0)
    whole = np.maximum(eigenvalues**2 + held, np.finfo(np.float64).tiny)
    return np.asarray((eigenvalues**2 * gain + held) / whole)


@dataclass(frozen=True, eq=False)
class Solution:
    """The displacement and how well it solves the normal equations.

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
    """What the reconstruction must leave alone.

    Attributes
    ----------
    free : (n, 1) float64
        1 where a vertex may move, 0 where its displacement is prescribed.
    rows : (n, 1) float64
        1 where a vertex' differential coordinates are asked for, 0 where they have no say.
    prescribed : (n, 3) float64
        Displacements, in mesh units; 0 where free.
    """

    free: Floats
    rows: Floats
    prescribed: Floats


@dataclass(frozen=True, eq=False)
class _NormalMatrix:
    """A = F (L^T R L + G), with G = w^2 C^T C and diagonals F of the free vertices and R of the rows asked for.

    Without constraints both are 1 everywhere, and None.
    """

    L: Laplacian
    gram: Gram
    free: Floats | None
    rows: Floats | None

    @functools.cached_property
    def odd(self) -> tuple[npt.NDArray[np.int64], csr_array]:
        """Vertices at edges that have not two faces, and their rows of what G has there besides."""
        at = np.flatnonzero(np.diff(self.gram.irregular.indptr))
        odd = self.gram.irregular[at]
        return at, odd if self.free is None else odd.multiply(self.free[at]).tocsr()

    def times(self, p: Floats, z: Floats, q: Floats) -> Floats:
        """``q`` becomes A p, with ``z`` for scratch; returns (3,) p . q."""
        n, kernels, gram = len(p), self.L.kernels, self.gram
        sums = np.empty((blocks.count(n), COLUMNS))
        blocks.in_threads(lambda i, j: kernels.differ(i, j, p, self.rows, gram.regular_edge, z), n)
        blocks.in_threads(
            lambda i, j: kernels.gather(i, j, p, z, self.free, gram.regular_edge, gram.diagonal, q, sums), n
        )
        curvature = sums.sum(axis=0)
        at, odd = self.odd
        if len(at):
            more = odd @ p
            q[at] += more
            curvature += (p[at] * more).sum(axis=0)
        return np.asarray(curvature)

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
    spare: list[Floats] | None = None,
    start: Floats | None = None,
    off: float = TOLERANCE,
) -> Solution:
    """Displacement that turns the differential coordinates by ``change`` as well as the barycenters allow.

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
        None: every vertex is free and every row asked for.
    spare : list of (n, 3) float64, optional
        Memory that is not needed any more, to be used again; ``change`` may be among it. Afterwards all of it is in
        it again, and what was made besides, but the displacement.
    start : (n, 3) float64, optional
        A displacement that is probably near: the nearer, the fewer iterations.
    off : float
        Share of itself that the displacement may be off by.

    Raises
    ------
    NotConverged
        After :data:`MOST_ITERATIONS`, with the residual that was reached.
    """
    w2 = weight * weight
    free, rows = (None, None) if constraints is None else (constraints.free, constraints.rows)
    A = _NormalMatrix(L, gram.scaled(w2), free, rows)
    memory = [] if spare is None else spare
    z = blocks.taken(memory, change)
    # L^T R change = D L D^-1 R change; from here on, change is not looked at
    b = L.product(blocks.multiply(change, _or_one(rows) / L.degree, z), blocks.taken(memory, change))
    blocks.multiply(b, _or_one(free) * L.degree, b)
    q, r, p, x = (blocks.taken(memory, change) for _ in range(4))
    if constraints is not None and constraints.prescribed.any():
        A.times(constraints.prescribed, z, q)
        b -= q
    m = A.inverse_diagonal()
    r[...] = b
    square, rho = _descend(L, np.zeros(COLUMNS), b, m, r)
    scale = np.sqrt(square)
    # a column that is nothing but rounding has nothing to solve for
    active = scale > np.finfo(float).eps * scale.max(initial=0.0)
    if not active.any():
        return Solution(np.zeros_like(b) if constraints is None else constraints.prescribed, 0, 0.0)
    for column in np.flatnonzero(~active):
        b[:, column], r[:, column], rho[column], square[column], scale[column] = 0, 0, 0, 0, 1

    wanted = tolerance(weight, off)
    if start is None:
        x.fill(0.0)
    else:
        np.multiply(start, _or_one(free) * active, out=x)
        A.times(x, z, q)
        square, rho = _descend(L, np.ones(COLUMNS), q, m, r)
    blocks.multiply(r, m, p)
    norm = np.sqrt(square)
    iterations = 0
    while (norm > wanted * scale).any():
        worst = float((norm / scale).max())
        if iterations == MOST_ITERATIONS:
            raise NotConverged(
                f"the least-squares solve stands at a relative residual of {worst:.1e} after {iterations} iterations "
                f"(wanted {wanted:.0e}); raise barycenter_weight ({weight:g})"
            )
        if progress is not None:
            progress(float(np.clip(np.log(worst) / np.log(wanted), 0, 1)))
        curvature = A.times(p, z, q)
        # a column that has converged to the last bit has no direction left
        step = np.divide(rho, curvature, out=np.zeros_like(rho), where=curvature > 0)
        square, following = _descend(L, step, q, m, r)
        norm = np.sqrt(square)
        turn = np.divide(following, rho, out=np.zeros_like(rho), where=rho > 0)
        _turn(L, step, turn, m, r, x, p)
        rho = following
        iterations += 1
    A.times(x, z, q)
    square, _ = _descend(L, np.ones(COLUMNS), q, m, b)
    reached = np.sqrt(square) / scale
    memory += [z, b, q, r, p]
    if constraints is not None:
        x += constraints.prescribed
    return Solution(x, iterations, float(reached.max()))


def _or_one(column: Floats | None) -> Floats | float:
    return 1.0 if column is None else column


def _descend(L: Laplacian, step: Floats, q: Floats, m: Floats, r: Floats) -> tuple[Floats, Floats]:
    """``r`` becomes r - q step; returns (3,) r . r and (3,) r . (m r)."""
    sums = np.empty((blocks.count(len(r)), 2 * COLUMNS))
    blocks.in_threads(lambda first, last: L.kernels.descend(first, last, step, q, m, r, sums), len(r))
    both = sums.sum(axis=0)
    return both[:COLUMNS], both[COLUMNS:]


def _turn(L: Laplacian, step: Floats, turn: Floats, m: Floats, r: Floats, x: Floats, p: Floats) -> None:
    """``x`` becomes x + p step, then ``p`` m r + p turn."""
    blocks.in_threads(lambda first, last: L.kernels.turn(first, last, step, turn, m, r, x, p), len(r))


def reconstruct(
    L: Laplacian, gram: Gram, X: Floats, weight: float, change: Floats | None = None, rtol: float = TOLERANCE
) -> Floats:
    """(n, 3) surface of least |L V' - L X - change|^2 + w^2 |C V' - C X|^2 (step 3 without constraints).

    Without ``change`` no differential coordinates are kept, as with a very low cut-off. ``rtol`` is the relative error
    allowed in the displacement.
    """
    return np.asarray(X + solve(L, gram, weight, -(L @ X) if change is None else change, off=rtol).displacement)

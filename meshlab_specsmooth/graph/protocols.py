"""What the kernels compute: the implementations with scipy and with numba follow these protocols."""

from __future__ import annotations

from typing import Protocol

from meshlab_specsmooth.arrays import Floats

COLUMNS = 3  # x, y and z: the kernels work on exactly three columns at once


class VertexKernels(Protocol):
    """Kernels on a graph of vertices, on the rows of the blocks ``first`` to ``last - 1``.

    Arrays are (n, 3) or (n, 1), in row order, and changed in place. P = D^-1 W is the mean over a vertex' neighbors.
    Sums have one row for each block, so that the order of summation does not depend on the number of threads. The
    diagonals ``rows`` and ``free`` may be None, which stands for 1 everywhere.
    """

    name: str

    def chebyshev_step(
        self,
        first: int,
        last: int,
        X: Floats,
        now: Floats,
        before: Floats,
        factor: float,
        coefficient: float,
        free: Floats | None,
    ) -> None:
        """``before`` becomes coefficient X - factor free P now - before."""

    def normal_matvec_1(
        self, first: int, last: int, p: Floats, rows: Floats | None, edge_coefficient: float, z: Floats
    ) -> None:
        """First half of a product with the normal matrix: y = rows (p - P p) / d.

        ``z`` becomes the input of the second half: edge_coefficient p - y where all weights are 1, else y.
        """

    def normal_matvec_2(
        self,
        first: int,
        last: int,
        p: Floats,
        z: Floats,
        free: Floats | None,
        edge_coefficient: float,
        gram_diagonal: Floats,
        q: Floats,
        sums: Floats,
    ) -> None:
        """Second half: ``q`` becomes free (d y - W y + edge_coefficient A p + gram_diagonal p) / d.

        ``sums`` becomes p . (D q).
        """

    def update_solution(
        self, first: int, last: int, alpha: float, p: Floats, q: Floats, x: Floats, r: Floats, sums: Floats
    ) -> None:
        """``x`` becomes x + alpha p and ``r`` r - alpha q; ``sums`` x . (D x) and r . (D r), in two columns."""

    def update_direction(self, first: int, last: int, beta: float, z: Floats, p: Floats) -> None:
        """``p`` becomes z + beta p."""

    def sum_squared_weights(self, first: int, last: int, v: Floats, sums: Floats) -> None:
        """``sums``, (n, 1), becomes the sums of w_ij^2 v_j over the neighbors j."""

    def inner_products(self, first: int, last: int, X: Floats, Y: Floats, sums: Floats) -> None:
        """``sums`` becomes X . (D X) and X . (D Y), summed over the columns, in two columns."""

    def edge_lengths(self, first: int, last: int, X: Floats, sums: Floats) -> None:
        """``sums`` becomes the sum of the edge lengths, every edge counted from both ends."""


class FaceKernels(Protocol):
    """Kernels on a graph of faces; arrays are float64 and results are new arrays."""

    name: str

    def face_geometry(self, V: Floats) -> tuple[Floats, Floats, Floats]:
        """(m, 3) centroids, (m, 3) unit normals, zero for a face without area, and (m,) doubled areas."""

    def bilateral_weights(
        self, center: Floats, normal: Floats, root: Floats, inv_2sigma_s2: float, inv_2sigma_r2: float
    ) -> tuple[Floats, Floats]:
        """Bilateral weights of neighboring faces, and their sums, with ``root`` the (m,) square roots of the areas.

        w_ij = root_i root_j (1 - x / 8)^8, and 0 where x = inv_2sigma_s2 |c_i - c_j|^2 + inv_2sigma_r2 |n_i - n_j|^2 is
        above 8: close to the Gaussian exp(-x), with compact support.

        Returns
        -------
        weight : (e,) float64
        degree : (m,) float64
        """

    def solve(
        self, weight: Floats, diagonal: Floats, t: float, B: Floats, X: Floats, tolerance: float, max_iterations: int
    ) -> Floats:
        """(m, 3) solution of (diag(diagonal) - t W) Y = B, starting from X.

        Conjugate gradients with a Jacobi preconditioner, until the residual in the preconditioner's norm is below
        ``tolerance`` times that of B. The three columns share alpha and beta, so that the result is equivariant under
        rotations.
        """

    def update_vertices(self, V: Floats, normal: Floats, step_size: Floats, sweeps: int) -> Floats:
        """(n, 3) vertices fitted to the normals; see :mod:`meshlab_specsmooth.edge_aware`.

        In every sweep each vertex moves by ``step_size`` times the sum over its faces of n n.(c - v), c the face's
        centroid.
        """

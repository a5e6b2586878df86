"""Volume, area and squared edge lengths of faces, compiled with numba (the extra ``fast``)."""

from __future__ import annotations

import functools

import numba
import numpy as np

from meshlab_specsmooth.runtime import backend

_compiled = functools.partial(numba.njit, nogil=True, cache=backend.CAN_CACHE, fastmath={"reassoc", "contract"})


@_compiled
def sum_faces(low, high, X, F, sums):  # type: ignore[no-untyped-def]
    """``sums`` (3,) becomes the signed volume, area and mean squared edge length, summed from ``low`` to ``high``."""
    volume = area = squares = 0.0
    for f in range(low, high):
        i, j, k = F[f, 0], F[f, 1], F[f, 2]
        ax, ay, az = X[i, 0], X[i, 1], X[i, 2]
        ux, uy, uz = X[j, 0] - ax, X[j, 1] - ay, X[j, 2] - az
        vx, vy, vz = X[k, 0] - ax, X[k, 1] - ay, X[k, 2] - az
        nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
        volume += ax * nx + ay * ny + az * nz
        area += np.sqrt(nx * nx + ny * ny + nz * nz)
        wx, wy, wz = vx - ux, vy - uy, vz - uz
        squares += ux * ux + uy * uy + uz * uz + vx * vx + vy * vy + vz * vz + wx * wx + wy * wy + wz * wz
    sums[0], sums[1], sums[2] = volume / 6, area / 2, squares / 3

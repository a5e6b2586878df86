"""An order of the vertices that keeps neighbors close to each other in memory.

Kernels read the rows of a vertex' neighbors. If these are scattered, each read misses the cache, and a product takes
four to five times as long.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from meshlab_specsmooth.arrays import Floats, Integers

# Rows of three float64 that fit in a typical second-level cache
NEAR = 2**14
_SAMPLE = 50_000  # faces suffice for the estimate


def is_scattered(F: Integers, n: int) -> bool:
    """Whether more than a quarter of the edges join vertices that are far apart in memory."""
    sample = F[:: max(1, len(F) // _SAMPLE)].astype(np.int64)
    return n > 2 * NEAR and bool((np.abs(sample - sample[:, [1, 2, 0]]) > NEAR).mean() > 0.25)


def morton_order(V: Floats) -> npt.NDArray[np.int64]:
    """Indices that sort the vertices along a Morton curve, which visits nearby places one after the other.

    Parameters
    ----------
    V : (n, 3) float64
    """
    low, high = V.min(axis=0), V.max(axis=0)
    widest = (high - low).max()
    cell = ((V - low) * ((_CELLS - 1) / widest if widest > 0 else 0.0)).astype(np.uint32)
    code = np.zeros(len(V), dtype=np.uint32)
    for axis in range(3):
        code |= _every_third_bit(cell[:, axis]) << np.uint32(axis)
    # numpy sorts 16-bit numbers by counting, in a tenth of the time: by the lower half first, then by the upper
    order = np.argsort(code.astype(np.uint16), kind="stable")
    return order[np.argsort((code[order] >> np.uint32(16)).astype(np.uint16), kind="stable")]


_CELLS = 2**10  # along each axis


def _every_third_bit(x: npt.NDArray[np.uint32]) -> npt.NDArray[np.uint32]:
    """Spread the 10 bits of x to the positions 0, 3, 6, ..."""
    for shift, mask in ((16, 0x030000FF), (8, 0x0300F00F), (4, 0x030C30C3), (2, 0x09249249)):
        x = (x | x << np.uint32(shift)) & np.uint32(mask)
    return x

#!/usr/bin/env python3
"""Speed, as ratios in one run: the book way (eigenvectors, a sparse direct solve) against this package.

python3 scripts/benchmark_speed.py [--modes 200] [--runs 3]
"""

import argparse
import statistics
import sys
import time
from collections.abc import Callable

import bootstrap

bootstrap.enter("demo")

import numpy as np  # noqa: E402
from scipy.sparse import eye_array  # noqa: E402
from scipy.sparse.linalg import eigsh, splu  # noqa: E402

import meshlab_specsmooth as mss  # noqa: E402
from meshlab_specsmooth.bridge import files, meshset  # noqa: E402
from meshlab_specsmooth.compare.metrics import add_noise  # noqa: E402
from meshlab_specsmooth.operators import barycenters, laplacian  # noqa: E402
from meshlab_specsmooth.surface import Surface, edges, mean_edge_length  # noqa: E402


def book_way(surface: Surface, modes: int) -> np.ndarray:
    """The paper as one would write it down: eigsh with shift and invert, and the normal equations by sparse LU."""
    L, C = laplacian(surface, edges(surface)[0]), barycenters(surface)
    n = len(surface.vertices)
    _, U = eigsh((L.S + 1e-3 * eye_array(n)).tocsc(), k=modes, sigma=0)
    delta = L @ surface.vertices
    filtered = (U @ (U.T @ (delta * L.root_degree))) / L.root_degree
    matrix = L.S.multiply(1 / L.root_degree).multiply(L.root_degree.T).tocsr()
    normal = (matrix.T @ matrix + C.T @ C).tocsc()
    right = L.transposed(filtered) + C.T @ (C @ surface.vertices)
    # a symmetric ordering and no pivoting, as suits a positive definite matrix
    lu = splu(normal, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
    return lu.solve(right)


def timed(work: Callable[[], np.ndarray], runs: int) -> tuple[float, np.ndarray]:
    """Median seconds, and the last result."""
    seconds = []
    for _ in range(runs):
        start = time.perf_counter()
        result = work()
        seconds.append(time.perf_counter() - start)
    return statistics.median(seconds), result


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--modes", type=int, default=200)
    parser.add_argument("--runs", type=int, default=3, help="the median of so many is shown (default: 3)")
    given = parser.parse_args()
    truth = Surface(*meshset.pull(files.read(files.sample("bunny.obj"))))
    noisy = Surface(add_noise(truth, 0.2, seed=1), truth.faces)
    ours, surface = timed(
        lambda: mss.smooth(noisy.vertices, noisy.faces, modes=given.modes, method="chebyshev").vertices, given.runs
    )
    book, reference = timed(lambda: book_way(noisy, given.modes), given.runs)
    edge = mean_edge_length(truth)
    apart = np.sqrt(((surface - reference) ** 2).sum(axis=1).mean()) / edge
    moved = np.sqrt(((reference - noisy.vertices) ** 2).sum(axis=1).mean()) / edge
    print(f"bunny, {len(truth.vertices)} vertices, modes={given.modes}, median of {given.runs}")
    print(f"  book way   {book:8.2f} s   eigsh(k={given.modes}, sigma), sparse LU of the normal equations")
    print(f"  ours       {ours:8.2f} s   smooth(..., modes={given.modes}, method='chebyshev'), operators included")
    print(f"  book way / ours = {book / ours:.1f}")
    print(f"  the surfaces differ by {apart:.5f} mean edges RMS, where the smoothing moves vertices by {moved:.3f}")


if __name__ == "__main__":
    sys.exit(main())

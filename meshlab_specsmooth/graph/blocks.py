"""Work on blocks of rows, in threads: the products and sums inside release Python's lock."""

from __future__ import annotations

import functools
import itertools
import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

# Sums are taken over blocks of so many rows, and these added in order: the bits do not depend on how many threads there
# are. A block's rows stay in the second-level cache from one operation on them to the next.
ROWS = 2**13

# Handing work to a thread takes as long as some ten thousand rows of a sweep.
_WORTH_A_THREAD = 2**16

Work = Callable[[int, int], None]


def threads() -> int:
    """Processors that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


@functools.cache
def _pool() -> ThreadPoolExecutor:
    return ThreadPoolExecutor(threads(), thread_name_prefix="specsmooth")


if hasattr(os, "register_at_fork"):  # a child has none of its parent's threads
    os.register_at_fork(after_in_child=_pool.cache_clear)


def count(n: int) -> int:
    """Number of blocks of n rows."""
    return -(-n // ROWS)


def in_threads(work: Work, n: int) -> None:
    """Call ``work(first, last)`` for ranges of blocks that cover n rows, one range a thread."""
    blocks = count(n)
    parts = min(threads(), blocks) if n >= _WORTH_A_THREAD else 1
    bounds = [blocks * i // parts for i in range(parts + 1)]
    ranges = list(itertools.pairwise(bounds))
    waiting = [_pool().submit(work, first, last) for first, last in ranges[1:]]
    work(*ranges[0])
    for future in waiting:
        future.result()

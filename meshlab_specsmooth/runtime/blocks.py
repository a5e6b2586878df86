"""Parallel work on blocks of rows, in threads: numpy, scipy and compiled kernels release the interpreter lock."""

from __future__ import annotations

import contextlib
import functools
import itertools
import os
import threading
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from typing import Any, TypeVar

import numpy as np

from meshlab_specsmooth.arrays import Floats
from meshlab_specsmooth.runtime import backend

# Rows in a block. Sums are taken over blocks and added in order, so that the bits do not depend on the number of
# threads. The rows of a block stay in the second-level cache from one operation on them to the next.
ROWS = 2**13

# Fewest numbers that are split between threads: handing work over takes as long as some ten thousand rows of three
_WORTH_A_THREAD = 3 * 2**16

# Rows of three that are reduced side by side
_ROWS_ABREAST = 64

Work = Callable[[int, int], object]
Item = TypeVar("Item")


def threads() -> int:
    """Number of processors that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


@functools.cache
def _pool() -> ThreadPoolExecutor:
    return ThreadPoolExecutor(threads(), thread_name_prefix="specsmooth")


if hasattr(os, "register_at_fork"):  # threads do not survive a fork
    os.register_at_fork(after_in_child=_pool.cache_clear)


def count(n: int) -> int:
    """Number of blocks in n rows."""
    return -(-n // ROWS)


def parallel_for(work: Work, n: int, width: int = 3) -> None:
    """Call ``work(first, last)`` for ranges of blocks that cover n rows of ``width`` numbers, one range per thread."""
    blocks = count(n)
    parts = min(threads(), blocks) if n * width >= _WORTH_A_THREAD else 1
    bounds = [blocks * i // parts for i in range(parts + 1)]
    map_threads(lambda part: work(*part), itertools.pairwise(bounds))


def parallel_rows(work: Callable[[slice], object], n: int) -> None:
    """Call ``work(rows)`` for slices that cover n rows, one slice per thread."""
    parallel_for(lambda first, last: work(slice(first * ROWS, min(last * ROWS, n))), n)


def map_threads(work: Callable[[Item], object], items: Iterable[Item]) -> None:
    """Call ``work(item)`` for each item, in threads; an exception in any of them is raised."""
    first, *others = items
    waiting = [_pool().submit(work, item) for item in others]
    work(first)
    for future in waiting:
        future.result()


def multiply(X: Floats, by: Floats, out: Floats) -> Floats:
    """Write X times ``by`` to ``out``, for X and ``out`` of shape (n, 3) and ``by`` of shape (n, 1)."""
    parallel_rows(lambda at: np.multiply(X[at], by[at], out=out[at]), len(X))
    return out


def reduce_rows(ufunc: np.ufunc, X: Floats) -> Floats:
    """Reduce the rows of X, (n, 3), to (3,); many rows side by side, as numpy is slow with rows of three."""
    wide = len(X) - len(X) % _ROWS_ABREAST
    rows = X[wide:]
    if wide:
        rows = np.concatenate([rows, ufunc.reduce(X[:wide].reshape(-1, 3 * _ROWS_ABREAST), axis=0).reshape(-1, 3)])
    return np.asarray(ufunc.reduce(rows, axis=0))


def rows(block: int, n: int) -> slice:
    """The rows of a block, of n rows in all."""
    return slice(block * ROWS, min((block + 1) * ROWS, n))


@contextlib.contextmanager
def one_blas_thread() -> Iterator[None]:
    """Limit BLAS to one thread, if the extra ``fast`` is installed; a context manager and a decorator.

    The threads of BLAS wait for each other by spinning: many small products take longer with two threads than with one,
    and up to four times as long while the processors are busy. Its bits depend on the number of threads, too, so that
    every call that promises the same bits runs inside of this context.

    The limit holds for the whole process. Of concurrent calls, the first sets it and the last lifts it.
    """
    if not backend.has_threadpoolctl():
        yield
        return
    _limit.begin()
    try:
        yield
    finally:
        _limit.end()


class _BlasLimit:
    """A limit of one BLAS thread, counted by its holders."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._holders = 0
        self._lift = contextlib.ExitStack()

    def begin(self) -> None:
        with self._lock:
            if self._holders == 0:
                self._lift.enter_context(_blas().limit(limits=1, user_api="blas"))
            self._holders += 1

    def end(self) -> None:
        with self._lock:
            self._holders -= 1
            if self._holders == 0:
                self._lift.close()


_limit = _BlasLimit()


@functools.cache
def _blas() -> Any:
    """The BLAS libraries in this process; finding them takes a hundred times as long as limiting them."""
    import threadpoolctl

    return threadpoolctl.ThreadpoolController()

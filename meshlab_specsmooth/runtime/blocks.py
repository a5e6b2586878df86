"""Work on blocks of rows, in threads: the products and sums inside release Python's lock."""

from __future__ import annotations

import contextlib
import functools
import itertools
import os
import threading
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from typing import Any, TypeVar

import numpy as np

from meshlab_specsmooth.arrays import Floats
from meshlab_specsmooth.runtime import backend

# Sums are taken over blocks of so many rows, and these added in order: the bits do not depend on how many threads there
# are. A block's rows stay in the second-level cache from one operation on them to the next.
ROWS = 2**13

# Handing work to a thread takes as long as some ten thousand rows of a sweep, which are three numbers wide.
_WORTH_A_THREAD = 3 * 2**16

# So many rows of three are reduced side by side
_ABREAST = 64

Work = Callable[[int, int], object]
Item = TypeVar("Item")

#: Memory of the last call for the next: a list of arrays, or none while a call has it.
Spare = deque[list[Floats]]


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


def in_threads(work: Work, n: int, width: int = 3) -> None:
    """Call ``work(first, last)`` for ranges of blocks that cover n rows, ``width`` wide, one range a thread."""
    blocks = count(n)
    parts = min(threads(), blocks) if n * width >= _WORTH_A_THREAD else 1
    bounds = [blocks * i // parts for i in range(parts + 1)]
    each(lambda of: work(*of), itertools.pairwise(bounds))


def in_slices(work: Callable[[slice], object], n: int) -> None:
    """The same, by slices of the rows."""

    def of_rows(first: int, last: int) -> None:
        work(slice(first * ROWS, min(last * ROWS, n)))

    in_threads(of_rows, n)


def each(work: Callable[[Item], object], items: Iterable[Item]) -> None:
    """Call ``work(item)`` for each, in threads."""
    first, *others = items
    waiting = [_pool().submit(work, item) for item in others]
    work(first)
    for future in waiting:
        future.result()


def multiply(X: Floats, by: Floats, out: Floats) -> Floats:
    """``out`` becomes X ``by``, for X and ``out`` of shape (n, 3) and ``by`` of shape (n, 1)."""
    in_slices(lambda at: np.multiply(X[at], by[at], out=out[at]), len(X))
    return out


def reduced(of: np.ufunc, X: Floats) -> Floats:
    """(3,) ``of`` over the rows of X, (n, 3): a row of many at a time, as numpy is slow at rows of three."""
    wide = len(X) - len(X) % _ABREAST
    rows = X[wide:]
    if wide:
        rows = np.concatenate([rows, of.reduce(X[:wide].reshape(-1, 3 * _ABREAST), axis=0).reshape(-1, 3)])
    return np.asarray(of.reduce(rows, axis=0))


def no_spare() -> Spare:
    """Memory that calls hand on to each other, with none in it yet."""
    return deque(maxlen=1)


def take_spare(spare: Spare) -> list[Floats]:
    """The memory that is there, for one call alone; a call beside it, in another thread, finds none.

    A call works with a list of its own and appends it to ``spare`` at its end. Both are atomic, so two calls never
    share an array.
    """
    try:
        return spare.pop()
    except IndexError:  # asking first would be no use: another thread may take it in between
        return []


def taken(spare: list[Floats], like: Floats) -> Floats:
    """Memory of that shape, to be written over: from what is spare, or new.

    New memory is cleared by the system, page by page: on large meshes that took a quarter of the time.
    """
    return spare.pop() if spare else np.empty_like(like)


def rows(block: int, n: int) -> slice:
    """The rows of a block of n rows."""
    return slice(block * ROWS, min((block + 1) * ROWS, n))


@contextlib.contextmanager
def one_blas_thread() -> Iterator[None]:
    """Have BLAS leave the threads to us, where the extra ``fast`` is installed; as a context, or as a decorator.

    Its own threads wait for each other by spinning: many small products take longer with two than with one, and up to
    four times as long while the processors have other work. And its bits depend on how many there are, so every call
    of which the same bits are promised is inside of one as a whole.

    The limit is the process's. Of calls at once, in several threads, the first sets it and the last lifts it.
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
    """A limit of one thread, for as long as anybody needs it."""

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
    """The libraries that numpy and scipy have loaded, which takes a hundred times as long as to limit them."""
    import threadpoolctl

    return threadpoolctl.ThreadpoolController()

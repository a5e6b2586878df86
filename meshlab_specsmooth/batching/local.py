"""Jobs in processes of this machine: as many at once as there are processors and memory for."""

from __future__ import annotations

import math
import queue
import sys
from collections.abc import Callable, Generator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from dataclasses import asdict
from pathlib import Path
from typing import Any

from meshlab_specsmooth.batching.record import CRASHED, Outcome
from meshlab_specsmooth.batching.work import failure
from meshlab_specsmooth.batching.worker import serve
from meshlab_specsmooth.isolation import processes
from meshlab_specsmooth.isolation.worker import Worker, WorkerFailed
from meshlab_specsmooth.parameters import MAX_WORKERS, check_count, check_number
from meshlab_specsmooth.runtime import blocks, memory, temporary
from meshlab_specsmooth.runtime.interrupts import DeferInterrupts

# Bytes of memory per byte of the file, at the peak: a binary PLY has 38 bytes per vertex and its two faces, for which
# pymeshlab takes about 500 and smoothing 800 more. Compressed files are ten times smaller.
_FACTOR, _COMPRESSED_FACTOR = 40, 400
_COMPRESSED = frozenset((".ctm", ".3mf"))
# of a process before it reads a mesh, and for the smallest mesh
_BASE = 400 * 2**20
# factor by which a mesh may exceed the estimate, if the share of its process in the memory allows it
_HEADROOM = 4
# the rounding of a BLAS may depend on its number of threads, which is 1 on a Dask worker too
_ONE_BLAS_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
# seconds that a worker may take to clean up when it is terminated
_GRACE = 5.0


def command(serves: Callable[[], None] = serve) -> tuple[str, ...]:
    """Return the command that starts a worker."""
    return processes.command(serves)


def bytes_needed(path: str, size: int) -> int:
    """Estimate the memory that the work on a mesh file takes, including the process, in bytes.

    Examples
    --------
    >>> from meshlab_specsmooth.batching.local import bytes_needed
    >>> bytes_needed("a.ctm", 10**6) > bytes_needed("a.ply", 10**6) > 40 * 10**6
    True
    """
    return _BASE + size * (_COMPRESSED_FACTOR if Path(path).suffix.lower() in _COMPRESSED else _FACTOR)


def bytes_allowed(needed: int, share: int) -> int:
    """Return the memory limit of a job: more than it is estimated to need, if the share of its process allows it.

    Examples
    --------
    >>> from meshlab_specsmooth.batching.local import bytes_allowed
    >>> bytes_allowed(600, 1000), bytes_allowed(600, 10_000), bytes_allowed(600, 100)
    (1000, 2400, 600)
    """
    return max(needed, min(_HEADROOM * needed, share))


def check_time_limit(time_limit: float) -> float:
    """Check a limit in seconds, which may be infinite; raises :class:`InvalidParameter`."""
    return check_number("time_limit", time_limit, sys.float_info.min, math.inf, "a positive number of seconds")


def outcomes(
    jobs: Sequence[tuple[Any, int]],
    workers: int | None,
    time_limit: float,
    serves: Callable[[], None] = serve,
    budget: int | None = None,
) -> Generator[Outcome]:
    """Do jobs, the largest first; yields their outcomes as they come.

    A mesh that crashes its process is an outcome too; the next one has a new process. A mesh that is estimated to take
    more memory than there is runs alone, and fails if that is not enough. Closing the iterator ends the processes;
    unfinished jobs leave no files.

    Parameters
    ----------
    jobs : sequence of (Job, int)
        Each with the bytes of memory that it is estimated to need, see :func:`bytes_needed`.
    workers : int, optional
        Maximum number of processes; the number of processors by default.
    time_limit : float
        Seconds after which the process of a mesh is killed: reading or writing some files never ends.
    serves : callable
        What a process does: :func:`meshlab_specsmooth.batching.worker.serve`, for jobs of some kind.
    budget : int, optional
        Bytes of memory for all processes; by default what is free.

    Raises
    ------
    InvalidParameter
        Before anything is done: ``workers`` is less than 1, or ``time_limit`` is not positive.
    """
    count = blocks.threads() if workers is None else check_count("workers", workers, 1, MAX_WORKERS)
    return _outcomes(jobs, min(count, len(jobs)), check_time_limit(time_limit), serves, budget)


def _outcomes(
    jobs: Sequence[tuple[Any, int]], count: int, time_limit: float, serves: Callable[[], None], limit: int | None
) -> Generator[Outcome]:
    waiting = sorted(jobs, key=lambda entry: -entry[1])
    budget = memory.available() if limit is None else min(limit, memory.available())
    running: dict[Future[Outcome], int] = {}
    idle: queue.SimpleQueue[MeshWorker] = queue.SimpleQueue()
    workers = [MeshWorker(serves) for _ in range(count)]
    for worker in workers:
        idle.put(worker)

    def do(job: Any, limit: int) -> Outcome:
        worker = idle.get()
        try:
            return worker.do(job, limit, time_limit)
        finally:
            idle.put(worker)

    with ThreadPoolExecutor(count) as threads:
        try:
            while waiting or running:
                while len(running) < count:
                    free = budget - sum(running.values())
                    fitting = next((entry for entry in waiting if entry[1] <= free or not running), None)
                    if fitting is None:
                        break
                    waiting.remove(fitting)
                    job, needed = fitting
                    running[threads.submit(do, job, bytes_allowed(needed, budget // count))] = needed
                for ended in wait(running, return_when=FIRST_COMPLETED).done:
                    del running[ended]
                    yield ended.result()
        finally:
            with DeferInterrupts():
                for worker in workers:
                    worker.terminate()
                for worker in workers:
                    worker.end()
                # a process that was killed may have left temporary folders
                for folder in {Path(job.output).parent for job, _ in jobs}:
                    temporary.remove_stale(folder)


class MeshWorker(Worker):
    """A process that does one job after the other."""

    def __init__(self, serves: Callable[[], None] = serve) -> None:
        super().__init__(command(serves), _ONE_BLAS_THREAD, _GRACE)

    def do(self, job: Any, limit: int, time_limit: float) -> Outcome:
        """Do a job with this many bytes of memory, within this many seconds."""
        try:
            return Outcome(**self.ask({"job": asdict(job), "bytes": limit}, time_limit))
        except WorkerFailed as error:
            return failure(job, CRASHED, f"the process that read or smoothed it {error}")

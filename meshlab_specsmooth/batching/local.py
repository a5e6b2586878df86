"""Jobs in processes of this machine: as many at once as it has processors, and memory for."""

from __future__ import annotations

import contextlib
import json
import math
import os
import queue
import signal
import subprocess
import sys
import threading
from collections.abc import Generator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from dataclasses import asdict
from pathlib import Path

from meshlab_specsmooth.batching.work import CRASHED, Job, Outcome, failure
from meshlab_specsmooth.batching.worker import serve
from meshlab_specsmooth.isolation import processes
from meshlab_specsmooth.parameters import MAX_WORKERS, check_count, check_number
from meshlab_specsmooth.runtime import memory, temporary
from meshlab_specsmooth.runtime.interrupts import DeferInterrupts

# Bytes of memory for a byte of the file, at the peak: a binary PLY has 38 bytes a vertex, two faces included, of which
# pymeshlab makes some 500 and smoothing 800 more. Compressed formats have a tenth of the bytes.
_FACTOR, _COMPRESSED_FACTOR = 40, 400
_COMPRESSED = frozenset((".ctm", ".3mf"))
# what a process has before it reads anything, and takes for the smallest mesh
_BASE = 400 * 2**20
# by how much a mesh may exceed the estimate, where its share of the memory allows it
_LENIENCE = 4
# the bits of a BLAS may hang on how many threads it has; those of a Dask worker have one as well
_ONE_BLAS_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
# how long a worker may take to clean up after itself when it is told to end
_PATIENCE = 5.0


def command() -> tuple[str, ...]:
    """What a worker is started with; its standard streams are those of ``batch/worker.py``."""
    return processes.command(serve)


def bytes_needed(path: str, size: int) -> int:
    """An estimate of the memory that a mesh file takes, worker included.

    Examples
    --------
    >>> from meshlab_specsmooth.batching.local import bytes_needed
    >>> bytes_needed("a.ctm", 10**6) > bytes_needed("a.ply", 10**6) > 40 * 10**6
    True
    """
    return _BASE + size * (_COMPRESSED_FACTOR if Path(path).suffix.lower() in _COMPRESSED else _FACTOR)


def bytes_allowed(path: str, size: int, share: int) -> int:
    """What a mesh file may take: more than the estimate, where the process's share of the memory allows it.

    Examples
    --------
    >>> from meshlab_specsmooth.batching.local import bytes_allowed, bytes_needed
    >>> bytes_allowed("a.ply", 10**6, 10**9) == 10**9 > bytes_needed("a.ply", 10**6) == bytes_allowed("a.ply", 10**6, 0)
    True
    """
    needed = bytes_needed(path, size)
    return max(needed, min(_LENIENCE * needed, share))


def check_time_limit(time_limit: float) -> float:
    """A limit in seconds, which may be infinite; raises :class:`InvalidParameter`."""
    return check_number("time_limit", time_limit, sys.float_info.min, math.inf, "a positive number of seconds")


def outcomes(jobs: Sequence[tuple[Job, int]], workers: int | None, time_limit: float) -> Generator[Outcome]:
    """Do jobs, each given with the size of its file, the largest first; the outcomes as they come.

    A mesh that takes its process down is an outcome as well; the next has a new process. A mesh that is estimated to
    take more memory than there is has it for itself alone, and fails by itself if that is too little. Closing the
    iterator ends the processes; what they had not finished leaves nothing.

    Parameters
    ----------
    jobs : sequence of (Job, int)
    workers : int, optional
        How many processes at most; None for as many as there are processors.
    time_limit : float
        Seconds after which a mesh is given up, and its process killed: some files pymeshlab reads or writes for ever.

    Raises
    ------
    InvalidParameter
        At once: ``workers`` is less than 1, or ``time_limit`` not positive.
    """
    most = _processors() if workers is None else workers
    check_count("workers", most, 1, MAX_WORKERS)
    time_limit = check_time_limit(time_limit)
    return _outcomes(jobs, min(most, len(jobs)), time_limit)


def _outcomes(jobs: Sequence[tuple[Job, int]], most: int, time_limit: float) -> Generator[Outcome]:
    sized = ((bytes_needed(job.source, size), job, size) for job, size in jobs)
    waiting = sorted(sized, key=lambda entry: -entry[0])
    budget = memory.available()
    running: dict[Future[Outcome], int] = {}
    idle: queue.SimpleQueue[Worker] = queue.SimpleQueue()
    crew = [Worker() for _ in range(most)]
    for worker in crew:
        idle.put(worker)

    def do(job: Job, limit: int) -> Outcome:
        worker = idle.get()
        try:
            return worker.do(job, limit, time_limit)
        finally:
            idle.put(worker)

    with ThreadPoolExecutor(most) as threads:
        try:
            while waiting or running:
                while len(running) < most:
                    left = budget - sum(running.values())
                    fitting = next((entry for entry in waiting if entry[0] <= left or not running), None)
                    if fitting is None:
                        break
                    waiting.remove(fitting)
                    needed, job, size = fitting
                    limit = bytes_allowed(job.source, size, budget // most)
                    running[threads.submit(do, job, limit)] = needed
                for ended in wait(running, return_when=FIRST_COMPLETED).done:
                    del running[ended]
                    yield ended.result()
        finally:
            with DeferInterrupts():
                for worker in crew:
                    worker.tell_to_end()
                for worker in crew:
                    worker.end()
                # a process that had to be killed, or was interrupted twice, may have left something
                for folder in {Path(job.output).parent for job, _ in jobs}:
                    temporary.remove_stale(folder)


class Worker:
    """A process that does one job after the other; started when there is one, and anew when it died."""

    def __init__(self) -> None:
        self._process: subprocess.Popen[bytes] | None = None
        self._is_ended = False

    def do(self, job: Job, limit: int, time_limit: float) -> Outcome:
        """Do a job, with so many bytes of memory, in so many seconds."""
        process = self._started()
        answer = b""
        if process is not None and process.stdin is not None and process.stdout is not None:
            with contextlib.suppress(OSError):  # it died before it could take it
                process.stdin.write(json.dumps({"job": asdict(job), "bytes": limit}).encode() + b"\n")
                process.stdin.flush()
            is_late = threading.Event()
            clock = threading.Timer(min(time_limit, threading.TIMEOUT_MAX), _give_up, (process, is_late))
            clock.start()
            answer = process.stdout.readline()
            clock.cancel()
            if is_late.is_set():
                self._bury()
                return failure(job, CRASHED, f"given up after {time_limit:g} s")
        if not answer.endswith(b"\n"):
            return failure(job, CRASHED, f"the process that read or smoothed it {self._bury()}")
        return Outcome(**json.loads(answer))

    def tell_to_end(self) -> None:
        """No more jobs, and an end to the one that it has."""
        self._is_ended = True
        if self._process is not None:
            self._process.terminate()

    def end(self) -> None:
        """Wait for the end, but not for ever."""
        process = self._process
        if process is None:
            return
        try:
            process.wait(_PATIENCE)
        except subprocess.TimeoutExpired:
            process.kill()
        self._bury()

    def _started(self) -> subprocess.Popen[bytes] | None:
        if self._process is None and not self._is_ended:
            self._process = subprocess.Popen(  # noqa: S603 (our own module)
                command(),
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.DEVNULL,
                env=processes.environment() | _ONE_BLAS_THREAD,
                start_new_session=True,  # Ctrl-C is for whoever started it, to end it
            )
        return self._process

    def _bury(self) -> str:
        """What became of a process that is no more; the next job has another."""
        process, self._process = self._process, None
        if process is None:
            return "was not started"
        code = process.wait()
        for stream in (process.stdin, process.stdout):
            if stream is not None:
                with contextlib.suppress(OSError):
                    stream.close()
        if code < 0:
            return f"crashed ({signal.Signals(-code).name})"
        return f"ended with exit code {code}"


def _give_up(process: subprocess.Popen[bytes], is_late: threading.Event) -> None:
    is_late.set()
    process.kill()


def _processors() -> int:
    """Those that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1

"""A process that smooths one mesh after the other; :mod:`meshlab_specsmooth.batching.local` starts it.

A line of JSON comes in for each, and one goes out. Each mesh is read, smoothed and written in a copy of it (on Linux),
which may die: a reader that damages the memory of its process harms its own mesh alone. It ends when nothing more can
come, as whoever started it is gone, and at once: also in the middle of a mesh, which leaves nothing.
"""

from __future__ import annotations

import json
import os
import queue
import signal
import tempfile
import threading
from collections.abc import Callable
from dataclasses import asdict
from io import RawIOBase
from pathlib import Path
from types import FrameType
from typing import Any

from meshlab_specsmooth.batching.work import CRASHED, FAILED, Job, Outcome, failure, run, warm_up
from meshlab_specsmooth.errors import FileError
from meshlab_specsmooth.isolation import copies
from meshlab_specsmooth.runtime import atomic, memory, temporary


def serve(work: Callable[[Job], Outcome] = run) -> None:
    """Answer each job from standard input on standard output."""
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # whatever C++ has to say must not get in between
    signal.signal(signal.SIGTERM, _end)  # so that temporary folders are removed
    temporary.remove_stale(tempfile.gettempdir())
    jobs: queue.SimpleQueue[dict[str, Any] | None] = queue.SimpleQueue()
    # without a buffer, as a copy of this process would wait for the lock of it as it ends
    stream = open(0, "rb", buffering=0, closefd=False)  # noqa: SIM115 (for as long as the process)
    threading.Thread(target=_listen, args=(stream, jobs), daemon=True).start()
    while (message := jobs.get()) is not None:
        outcome = _done(work, Job(**message["job"]), message["bytes"])
        answers.write(json.dumps(asdict(outcome)).encode() + b"\n")
        answers.flush()


def _done(work: Callable[[Job], Outcome], job: Job, limit: int) -> Outcome:
    """Do a job, in a copy of this process where it may be copied; what it wrote is moved when the copy ended well."""
    if not copies.are_possible():
        with memory.limited(limit):
            return work(job)
    if work is run:
        warm_up()
    # what a handler raises while a process is copied may be dropped by Python
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGTERM})
    copy = copies.start()
    if copy.process == 0:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
        with atomic.postponed() as written, memory.limited(limit):
            outcome = work(job)
        if not outcome.is_there:
            copies.Left(written).discard()
            written = []
        copies.hand_over(copy, written, asdict(outcome))
        raise SystemExit(0)
    code = None
    try:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
        code = os.waitstatus_to_exitcode(os.waitpid(copy.process, 0)[1])
    finally:
        if code is None:  # this process is to end; the copy removes what it has begun
            os.kill(copy.process, signal.SIGTERM)
            os.waitpid(copy.process, 0)
        left = copies.take_over(copy)
        if code != 0:
            left.discard()
            temporary.remove_stale(Path(job.output).parent, copy.process)
    if code != 0 or left.answer is None:
        end = f"crashed ({signal.Signals(-code).name})" if code < 0 else f"ended with exit code {code}"
        return failure(job, CRASHED, f"the process that read or smoothed it {end}")
    return _moved(job, left)


def _moved(job: Job, left: copies.Left) -> Outcome:
    """The outcome, when what the copy wrote is at its place."""
    try:
        for staged in left.written:
            staged.move()
    except FileError as error:
        return failure(job, FAILED, str(error))
    finally:
        left.discard()
    return Outcome(**left.answer)


def _listen(stream: RawIOBase, jobs: queue.SimpleQueue[dict[str, Any] | None]) -> None:
    if hasattr(signal, "pthread_sigmask"):  # it is for the main thread to get
        signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGTERM})
    for line in stream:
        jobs.put(json.loads(line))
    jobs.put(None)
    if os.name == "posix":
        os.kill(os.getpid(), signal.SIGTERM)
    else:
        signal.raise_signal(signal.SIGTERM)


def _end(number: int, frame: FrameType | None) -> None:
    raise SystemExit(128 + number)

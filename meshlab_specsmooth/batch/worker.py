"""A process that smooths one mesh after the other, until it is left; :mod:`meshlab_specsmooth.batch.local` starts it.

A line of JSON comes in for each, and one goes out. It ends when nothing more can come, as whoever started it is gone,
and at once: also in the middle of a mesh, which leaves nothing.
"""

from __future__ import annotations

import json
import os
import queue
import signal
import sys
import threading
from collections.abc import Callable
from dataclasses import asdict
from types import FrameType
from typing import Any, BinaryIO

from meshlab_specsmooth import memory
from meshlab_specsmooth.batch.work import Job, Outcome, run


def serve(work: Callable[[Job], Outcome] = run) -> None:
    """Answer each job from standard input on standard output."""
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # whatever C++ has to say must not get in between
    signal.signal(signal.SIGTERM, _end)  # so that temporary folders are removed
    jobs: queue.SimpleQueue[dict[str, Any] | None] = queue.SimpleQueue()
    threading.Thread(target=_listen, args=(sys.stdin.buffer, jobs), daemon=True).start()
    while (message := jobs.get()) is not None:
        with memory.limited(message["bytes"]):
            outcome = work(Job(**message["job"]))
        answers.write(json.dumps(asdict(outcome)).encode() + b"\n")
        answers.flush()


def _listen(stream: BinaryIO, jobs: queue.SimpleQueue[dict[str, Any] | None]) -> None:
    for line in stream:
        jobs.put(json.loads(line))
    jobs.put(None)
    signal.raise_signal(signal.SIGTERM)


def _end(number: int, frame: FrameType | None) -> None:
    raise SystemExit(128 + number)

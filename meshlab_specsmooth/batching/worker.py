"""A process that smooths one mesh after the other; :mod:`meshlab_specsmooth.batching.local` starts it.

Each mesh is read, smoothed and written in a fork of it (on Linux), which may crash: a reader that damages the memory of
its process harms its own mesh only.
"""

from __future__ import annotations

import signal
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import Any

from meshlab_specsmooth.batching.record import CRASHED, FAILED, Outcome
from meshlab_specsmooth.batching.work import Job, failure, run, warm_up
from meshlab_specsmooth.errors import FileError
from meshlab_specsmooth.isolation import fork, worker
from meshlab_specsmooth.isolation.exit_status import describe_exit
from meshlab_specsmooth.runtime import memory
from meshlab_specsmooth.runtime.atomic import Staged


def serve(
    work: Callable[[Any], Outcome] = run, kind: Callable[..., Any] = Job, prepare: Callable[[], None] = warm_up
) -> None:
    """Do the jobs, of some kind, of the process that started this one."""
    worker.serve(lambda request: _do(work, kind(**request["job"]), request["bytes"], prepare))


def _do(work: Callable[[Any], Outcome], job: Any, limit: int, prepare: Callable[[], None]) -> dict[str, Any]:
    """Return the outcome of a job with this many bytes of memory, done in a fork if possible."""

    def work_within_limit(written: list[Staged]) -> dict[str, Any]:
        with memory.limited(limit):
            outcome = work(job)
        if not outcome.is_there:
            fork.discard(written)
        return asdict(outcome)

    if not fork.can_fork():
        return work_within_limit([])
    prepare()
    try:
        result = fork.run_in_fork(work_within_limit, {signal.SIGTERM}, [Path(job.output).parent])
    except FileError as error:
        return asdict(failure(job, FAILED, str(error)))
    if result.signals:
        raise SystemExit(128 + signal.SIGTERM)
    reason = f"the process that read or smoothed it {describe_exit(result.code)}"
    return asdict(failure(job, CRASHED, reason)) if result.code or result.answer is None else dict(result.answer)

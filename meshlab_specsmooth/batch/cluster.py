"""The same jobs on a Dask cluster that is there already: whose processes and machines, is its business."""

from __future__ import annotations

from collections.abc import Generator, Iterator, Sequence
from typing import Any

from meshlab_specsmooth.batch.work import CRASHED, FAILED, Job, Outcome, failure, run
from meshlab_specsmooth.errors import ClusterError, MissingExtra


def outcomes(jobs: Sequence[tuple[Job, int]], scheduler: str) -> Generator[Outcome]:
    """Do jobs on a cluster, each given with the size of its file, the largest first; the outcomes as they come.

    The package must be installed on its workers, and the files be there under the same names. Where a worker dies, Dask
    gives what it was at to others; what has outlived too many workers (``distributed.scheduler.allowed-failures``) is
    tried once more when the rest is done, by itself: then it is known whose fault it was. Closing the iterator cancels
    what is not done.

    Raises
    ------
    MissingExtra
        At once.
    ClusterError
        There is no scheduler at that address, or it is lost.
    """
    try:
        import distributed
    except ImportError as error:
        raise MissingExtra("a Dask cluster", "cluster") from error
    try:
        client = distributed.Client(scheduler, set_as_default=False)
    except (OSError, ValueError, TypeError) as error:
        raise ClusterError(f"{scheduler}: there is no Dask scheduler ({error})") from error
    return _outcomes(client, [job for job, _ in sorted(jobs, key=lambda pair: -pair[1])])


def _outcomes(client: Any, jobs: Sequence[Job]) -> Generator[Outcome]:
    with client:
        suspects: list[Job] = []
        for job, outcome in _done(client, jobs):
            if outcome.status == CRASHED:
                suspects.append(job)
            else:
                yield outcome
        for suspect in suspects:
            yield from (outcome for _, outcome in _done(client, [suspect]))


def _done(client: Any, jobs: Sequence[Job]) -> Iterator[tuple[Job, Outcome]]:
    from distributed import KilledWorker, as_completed

    owners = {client.submit(run, job, pure=False): job for job in jobs}
    try:
        for future in as_completed(list(owners), loop=client.loop):
            job = owners[future]
            error = future.exception() if future.status == "error" else None
            if future.status not in ("finished", "error"):
                raise ClusterError(f"{client.scheduler.address}: the scheduler is lost; what is done is recorded")
            if error is None:
                yield job, future.result()
            elif isinstance(error, KilledWorker):
                yield job, failure(job, CRASHED, "every worker that read or smoothed it died")
            else:
                yield job, failure(job, FAILED, f"{type(error).__name__}: {error}")
            future.release()
    finally:
        client.cancel([future for future in owners if not future.done()])

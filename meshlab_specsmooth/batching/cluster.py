"""The same jobs on a Dask cluster that is there already: whose processes and machines, is its business."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Generator, Iterator, Sequence
from typing import Any

from meshlab_specsmooth.batching.local import MeshWorker, bytes_allowed, check_time_limit
from meshlab_specsmooth.batching.record import CRASHED, FAILED, Outcome
from meshlab_specsmooth.batching.work import Job, failure
from meshlab_specsmooth.errors import ClusterError, MissingExtra
from meshlab_specsmooth.runtime import memory

# Seconds to find a scheduler in; Dask itself tries for half a minute
_PATIENCE = 10.0


def outcomes(jobs: Sequence[tuple[Job, int]], scheduler: str, time_limit: float) -> Generator[Outcome]:
    """Do jobs on a cluster, each given with the size of its file, the largest first; the outcomes as they come.

    The package must be installed on its workers, and the files be there under the same names. Each job has a process
    of its own there, with limits of memory and time as on this machine. Where a worker dies, Dask gives what it was at
    to others; what has outlived too many workers (``distributed.scheduler.allowed-failures``) is tried once more when
    the rest is done, by itself: then it is known whose fault it was. Closing the iterator cancels what is not done.

    Raises
    ------
    InvalidParameter
        At once: ``time_limit`` is not positive.
    MissingExtra
        At once.
    ClusterError
        There is no scheduler at that address, or it is lost.
    """
    time_limit = check_time_limit(time_limit)
    try:
        import distributed  # noqa: F401 (whether it is there)
    except ImportError as error:
        raise MissingExtra("a Dask cluster", "cluster") from error
    # Found out before there is a client: one that finds no scheduler does not end, and neither does the process then
    try:
        asyncio.run(_connected(scheduler))
    except Exception as error:  # of whatever kind Dask's protocols raise: addresses, certificates, sockets
        raise ClusterError(f"{scheduler}: there is no Dask scheduler ({_in_a_line(error)})") from error
    return _outcomes(scheduler, sorted(jobs, key=lambda pair: -pair[1]), time_limit)


async def _connected(scheduler: str) -> None:
    """Connect to a scheduler and leave; raises where there is none within some seconds."""
    import dask.config
    from distributed.comm import connect
    from distributed.comm.addressing import get_address_host_port
    from distributed.security import Security

    address = scheduler if "://" in scheduler else f"tcp://{scheduler}"
    host, port = get_address_host_port(address, strict=True)
    if not host or not 0 < port < 2**16:
        raise ValueError("an address is tcp://HOST:PORT")
    asked = dask.config.get("distributed.comm.timeouts.connect")
    timeout = min(dask.utils.parse_timedelta(asked), _PATIENCE)
    comm = await connect(address, timeout=timeout, **Security().get_connection_args("client"))
    comm.abort()


def _in_a_line(error: Exception) -> str:
    return " ".join(str(error).split()) or type(error).__name__


def run_there(job: Job, size: int, time_limit: float) -> Outcome:
    """Do a job on a worker of the cluster, in a process that may die."""
    from distributed import get_worker

    share = memory.available() // get_worker().state.nthreads
    with MeshWorker() as worker:
        return worker.do(job, bytes_allowed(job.source, size, share), time_limit)


def _outcomes(scheduler: str, jobs: Sequence[tuple[Job, int]], time_limit: float) -> Generator[Outcome]:
    import distributed
    from distributed.utils import silence_logging_cmgr

    # of a scheduler that dies Dask's client logs tracebacks, and our error says it all
    with (
        silence_logging_cmgr(logging.CRITICAL, root="distributed"),
        distributed.Client(scheduler, set_as_default=False) as client,
    ):
        suspects: list[tuple[Job, int]] = []
        for given, outcome in _done(client, jobs, time_limit):
            if outcome is None:
                suspects.append(given)
            else:
                yield outcome
        for suspect in suspects:
            for (job, _), outcome in _done(client, [suspect], time_limit):
                yield outcome or failure(job, CRASHED, "every Dask worker that had it died")


def _done(
    client: Any, jobs: Sequence[tuple[Job, int]], time_limit: float
) -> Iterator[tuple[tuple[Job, int], Outcome | None]]:
    """Jobs with their outcomes; None where too many workers died that had it."""
    from distributed import KilledWorker, as_completed

    owners = {client.submit(run_there, *job, time_limit, pure=False): job for job in jobs}
    try:
        for future in as_completed(list(owners), loop=client.loop):
            given = owners[future]
            error = future.exception() if future.status == "error" else None
            if future.status not in ("finished", "error"):
                raise ClusterError(f"{client.scheduler.address}: the scheduler is lost; what is done is recorded")
            if error is None:
                yield given, future.result()
            elif isinstance(error, KilledWorker):
                yield given, None
            else:
                yield given, failure(given[0], FAILED, f"{type(error).__name__}: {error}")
            future.release()
    finally:
        client.cancel([future for future in owners if not future.done()])

"""Jobs on an existing Dask cluster, which manages its own workers."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable, Generator, Iterator, Sequence
from typing import Any

from meshlab_specsmooth.batching.local import MeshWorker, bytes_allowed, check_time_limit
from meshlab_specsmooth.batching.record import CRASHED, FAILED, Outcome
from meshlab_specsmooth.batching.work import failure
from meshlab_specsmooth.batching.worker import serve
from meshlab_specsmooth.errors import ClusterError, MissingExtra
from meshlab_specsmooth.runtime import memory

# seconds in which to find a scheduler; Dask itself tries for half a minute
_CONNECT_SECONDS = 10.0


def outcomes(
    jobs: Sequence[tuple[Any, int]], scheduler: str, time_limit: float, serves: Callable[[], None] = serve
) -> Generator[Outcome]:
    """Do jobs on a cluster, given with the bytes that they need, the largest first; yields outcomes as they come.

    The package must be installed on the workers, and the files must have the same names there. Each job runs in a
    separate process, with limits of memory and time as on this machine. If a worker dies, Dask gives its jobs to
    others; a job during which too many workers died (``distributed.scheduler.allowed-failures``) is repeated alone when
    the others are done, which shows whether it is the cause. Closing the iterator cancels the remaining jobs.

    Raises
    ------
    InvalidParameter
        ``time_limit`` is not positive.
    MissingExtra
        Dask is not installed.
    ClusterError
        There is no scheduler at that address, or the connection to it is lost.
    """
    time_limit = check_time_limit(time_limit)
    try:
        import distributed  # noqa: F401 (whether it is installed)
    except ImportError as error:
        raise MissingExtra("a Dask cluster", "cluster") from error
    # checked before a client is created: one that finds no scheduler never ends, and keeps the process alive
    try:
        asyncio.run(_connected(scheduler))
    except Exception as error:  # of any type: Dask's protocols check addresses, certificates, sockets
        raise ClusterError(f"{scheduler}: there is no Dask scheduler ({_in_a_line(error)})") from error
    return _outcomes(scheduler, sorted(jobs, key=lambda pair: -pair[1]), time_limit, serves)


async def _connected(scheduler: str) -> None:
    """Connect to a scheduler and disconnect; raises if there is none within some seconds."""
    import dask.config
    from distributed.comm import connect
    from distributed.comm.addressing import get_address_host_port
    from distributed.security import Security

    address = scheduler if "://" in scheduler else f"tcp://{scheduler}"
    host, port = get_address_host_port(address, strict=True)
    if not host or not 0 < port < 2**16:
        raise ValueError("an address is tcp://HOST:PORT")
    asked = dask.config.get("distributed.comm.timeouts.connect")
    timeout = min(dask.utils.parse_timedelta(asked), _CONNECT_SECONDS)
    comm = await connect(address, timeout=timeout, **Security().get_connection_args("client"))
    comm.abort()


def _in_a_line(error: Exception) -> str:
    return " ".join(str(error).split()) or type(error).__name__


def run_there(job: Any, needed: int, time_limit: float, serves: Callable[[], None]) -> Outcome:
    """Do a job on a worker of the cluster, in a separate process."""
    from distributed import get_worker

    share = memory.available() // get_worker().state.nthreads
    with MeshWorker(serves) as worker:
        return worker.do(job, bytes_allowed(needed, share), time_limit)


def _outcomes(
    scheduler: str, jobs: Sequence[tuple[Any, int]], time_limit: float, serves: Callable[[], None]
) -> Generator[Outcome]:
    import distributed
    from distributed.utils import silence_logging_cmgr

    # Dask's client logs tracebacks when the scheduler dies, beside the error that is raised here
    with (
        silence_logging_cmgr(logging.CRITICAL, root="distributed"),
        distributed.Client(scheduler, set_as_default=False) as client,
    ):
        suspects: list[tuple[Any, int]] = []
        for given, outcome in _done(client, jobs, time_limit, serves):
            if outcome is None:
                suspects.append(given)
            else:
                yield outcome
        for suspect in suspects:
            for (job, _), outcome in _done(client, [suspect], time_limit, serves):
                yield outcome or failure(job, CRASHED, "every Dask worker that ran it died")


def _done(
    client: Any, jobs: Sequence[tuple[Any, int]], time_limit: float, serves: Callable[[], None]
) -> Iterator[tuple[tuple[Any, int], Outcome | None]]:
    """Yield jobs with their outcomes; None where too many workers died during a job."""
    from distributed import KilledWorker, as_completed

    owners = {client.submit(run_there, *job, time_limit, serves, pure=False): job for job in jobs}
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

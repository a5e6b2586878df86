"""A worker: a process that answers requests one after the other, and may crash without harm to the caller.

:class:`Worker` is the caller's end, :func:`serve` the worker's; see :mod:`~meshlab_specsmooth.isolation.messages`.
"""

from __future__ import annotations

import contextlib
import math
import os
import queue
import signal
import subprocess
import tempfile
import threading
from collections.abc import Callable, Mapping, Sequence
from types import FrameType, TracebackType
from typing import Any, TypeVar

from meshlab_specsmooth.isolation import processes
from meshlab_specsmooth.isolation.exit_status import describe_exit
from meshlab_specsmooth.isolation.messages import read_message, write_message
from meshlab_specsmooth.runtime import temporary

_W = TypeVar("_W", bound="Worker")


class WorkerFailed(Exception):  # noqa: N818 (named for what happened, as the other errors are)
    """No answer; the text is the predicate of a sentence about the process, as ``crashed (SIGSEGV)``."""


class Worker:
    """The caller's end of a worker; a context manager, which ends it.

    The process starts at the first request, and another one at the first request after it has ended.

    Parameters
    ----------
    command : sequence of str
        From :func:`meshlab_specsmooth.isolation.processes.command`, of a function that calls :func:`serve`.
    variables : mapping, optional
        Environment variables in addition to those of :func:`~meshlab_specsmooth.isolation.processes.environment`.
    grace : float
        Seconds that the process may take to clean up when it is to end; after them it is killed.
    """

    def __init__(self, command: Sequence[str], variables: Mapping[str, str] | None = None, grace: float = 0.0) -> None:
        self._command = command
        self._variables = variables or {}
        self._grace = grace
        self._process: subprocess.Popen[bytes] | None = None
        self._is_terminated = False

    def __enter__(self: _W) -> _W:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self.end()

    def ask(self, request: object, timeout: float = math.inf) -> Any:
        """Return the answer to a request; both consist of what JSON can represent, and of arrays.

        Parameters
        ----------
        request : object
        timeout : float
            Seconds after which the process is killed.

        Raises
        ------
        WorkerFailed
            The process crashed, ended, took too long, or was terminated before.
        """
        process = self._start()
        is_late = threading.Event()

        def give_up() -> None:
            is_late.set()
            process.kill()

        timer = threading.Timer(min(timeout, threading.TIMEOUT_MAX), give_up)
        timer.daemon = True
        timer.start()
        try:
            with contextlib.suppress(OSError):  # if it has died, reading says so
                write_message(process.stdin, request)
            return read_message(process.stdout)
        except (EOFError, OSError, ValueError) as error:
            if isinstance(error, ValueError):  # not a message; the process may be alive
                process.kill()
            code = process.wait()
            self.end()
            raise WorkerFailed(f"took more than {timeout:g} s" if is_late.is_set() else describe_exit(code)) from error
        except BaseException:  # an interrupt: the answer would be mistaken for that to the next request
            self.end()
            raise
        finally:
            timer.cancel()

    def terminate(self) -> None:
        """Accept no more requests, and ask the process to end, without waiting for it."""
        self._is_terminated = True
        if self._process is not None:
            self._process.terminate()

    def end(self) -> None:
        """End the process, if there is one, and wait for it."""
        process, self._process = self._process, None
        if process is None:
            return
        with contextlib.suppress(OSError), process:  # of data in the pipes, which this closes
            if self._grace and not self._is_terminated:
                process.terminate()
            try:
                process.wait(self._grace)
            except subprocess.TimeoutExpired:
                process.kill()

    def _start(self) -> subprocess.Popen[bytes]:
        if self._is_terminated:
            raise WorkerFailed("was not started")
        if self._process is None:
            self._process = subprocess.Popen(  # noqa: S603 (our own module)
                self._command,
                env={**processes.environment(), **self._variables},
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.DEVNULL,
                start_new_session=True,  # signals of the terminal are for the caller, who ends the worker
            )
        return self._process


def serve(answer: Callable[[Any], object]) -> None:
    """Answer requests until the caller is gone, then end at once, in the middle of a request too.

    What native code prints to standard output does not get between the messages. On SIGTERM the process unwinds, so
    that its temporary folders are removed.
    """
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    signal.signal(signal.SIGTERM, _exit)
    temporary.remove_stale(tempfile.gettempdir())
    requests: queue.SimpleQueue[Any] = queue.SimpleQueue()
    threading.Thread(target=_listen, args=(requests,), daemon=True).start()
    while (request := requests.get()) is not None:
        write_message(answers, answer(request))


def _listen(requests: queue.SimpleQueue[Any]) -> None:
    if hasattr(signal, "pthread_sigmask"):  # the main thread is to receive these
        signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGTERM, signal.SIGCHLD})
    # unbuffered: a fork of this process would wait for the lock of a buffer as it ends
    with open(0, "rb", buffering=0, closefd=False) as stream, contextlib.suppress(EOFError):
        while True:
            requests.put(read_message(stream))
    requests.put(None)
    if os.name == "posix":
        os.kill(os.getpid(), signal.SIGTERM)
    else:
        signal.raise_signal(signal.SIGTERM)


def _exit(number: int, frame: FrameType | None) -> None:
    raise SystemExit(128 + number)

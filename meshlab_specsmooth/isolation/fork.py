"""Forks: copies of this process, which start at once and may crash in native code that reads or writes files."""

from __future__ import annotations

import contextlib
import ctypes
import io
import os
import signal
import socket
import sys
import threading
import warnings
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, replace
from typing import Any

from meshlab_specsmooth.isolation.messages import read_message, write_message

# Linux: the signal that a process gets when its parent ends (sys/prctl.h), and the origin of a signal that the terminal
# sends to all of its processes, as at Ctrl-C (asm-generic/siginfo.h)
_PR_SET_PDEATHSIG, _SI_KERNEL = 1, 0x80
_MAX_DESCRIPTORS = 250
# SIGCHLD may be taken by a thread of a native library, so that the fork is looked at after these seconds too
_POLL_SECONDS = 0.2


@dataclass(frozen=True)
class ForkResult:
    """The end of a fork.

    Attributes
    ----------
    pid : int
    code : int
        Its exit code, or the negative number of the signal that killed it.
    signals : frozenset of int
        Those of the forwarded signals that came; the caller decides about them.
    answer : object
        None where it ended before it could answer.
    descriptors : tuple of int
        Of the files that it handed over; whoever gets them closes them.
    """

    pid: int
    code: int
    signals: frozenset[int]
    answer: Any = None
    descriptors: tuple[int, ...] = ()


def can_fork() -> bool:
    """Whether :func:`run_in_fork` works: on Linux, in the main thread."""
    return sys.platform == "linux" and threading.current_thread() is threading.main_thread()


def run_in_fork(
    work: Callable[[], tuple[object, Sequence[int]]],
    forwarded: Collection[signal.Signals],
    finish: Callable[[ForkResult], ForkResult],
) -> ForkResult:
    """Work in a fork, which is killed when this process ends.

    Parameters
    ----------
    work : callable
        Called in the fork; returns an answer and descriptors of files to hand over. What it raises is raised to the
        caller there; after it the fork raises SystemExit.
    forwarded : collection of Signals
        Sent on to the fork instead of being handled here, unless the terminal has sent them to both.
    finish : callable
        Called here when the fork has ended, while signals still wait; what it returns is returned.
    """
    signal.signal(signal.SIGCHLD, signal.SIG_DFL)  # where it is ignored there is no exit code
    parent = os.getpid()
    blocked = {*forwarded, signal.SIGCHLD}
    before = signal.pthread_sigmask(signal.SIG_BLOCK, blocked)
    try:
        ours, theirs = socket.socketpair()
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", DeprecationWarning)  # of threads: OpenBLAS has some, and restarts its own
            pid = os.fork()
        if pid == 0:
            ours.close()
            ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
            if os.getppid() != parent:  # it has ended already
                os._exit(1)
            signal.pthread_sigmask(signal.SIG_SETMASK, before)
            _send(theirs, *work())
            raise SystemExit(0)
        theirs.close()
        with ours:
            result = finish(ForkResult(pid, *_wait(pid, blocked), *_receive(ours)))
        late = signal.sigpending() & {*forwarded}
        for number in late:
            signal.sigtimedwait({number}, 0)
        return replace(result, signals=result.signals | late)
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _wait(pid: int, signals: Collection[signal.Signals]) -> tuple[int, frozenset[int]]:
    """Return the exit status of a fork, and those of the signals that came, which are blocked; forward these."""
    received = set[int]()
    try:
        while True:
            info = signal.sigtimedwait(signals, _POLL_SECONDS)
            if info is not None and info.si_signo != signal.SIGCHLD:
                received.add(info.si_signo)
                if info.si_code != _SI_KERNEL:
                    os.kill(pid, info.si_signo)
            ended, status = os.waitpid(pid, os.WNOHANG)
            if ended:
                return os.waitstatus_to_exitcode(status), frozenset(received)
    except BaseException:  # of a handler, as a thread of a native library may take a signal; the fork cleans up
        with contextlib.suppress(OSError):
            os.kill(pid, signal.SIGTERM)
            os.waitpid(pid, 0)
        raise


def _send(channel: socket.socket, answer: object, descriptors: Sequence[int]) -> None:
    socket.send_fds(channel, [b"\n"], descriptors)
    with channel, channel.makefile("wb") as stream:
        write_message(stream, answer)


def _receive(channel: socket.socket) -> tuple[Any, tuple[int, ...]]:
    """Return the answer of a fork that has ended, and descriptors; None and none where it is not complete."""
    descriptors = socket.recv_fds(channel, 1, _MAX_DESCRIPTORS, socket.MSG_CMSG_CLOEXEC)[1]
    try:
        with channel.makefile("rb") as stream:
            return read_message(stream), tuple(descriptors)
    except EOFError:
        for descriptor in descriptors:
            os.close(descriptor)
        return None, ()


def silence_native_output() -> None:
    """In a fork: discard what C and C++ print, such as the last message of a crash, and keep what Python prints."""
    nowhere = os.open(os.devnull, os.O_WRONLY)
    for name, number in (("stdout", 1), ("stderr", 2)):
        stream = getattr(sys, name)
        if not isinstance(stream, io.TextIOWrapper):
            continue
        stream.flush()
        with contextlib.suppress(io.UnsupportedOperation):
            if stream.fileno() == number:
                kept = os.fdopen(os.dup(number), "wb")
                text = io.TextIOWrapper(kept, stream.encoding, stream.errors, line_buffering=stream.line_buffering)
                setattr(sys, name, text)
        os.dup2(nowhere, number)
    os.close(nowhere)

"""Forks: copies of this process, which start at once and may crash in native code that reads or writes files.

Some readers damage the memory of their process, which is noticed only when it ends. Until then what the fork has
written stays in temporary folders. It hands over their locks, so that no other process removes them meanwhile.
"""

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
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from meshlab_specsmooth.isolation.messages import read_message, write_message
from meshlab_specsmooth.runtime import temporary
from meshlab_specsmooth.runtime.atomic import Staged, postponed
from meshlab_specsmooth.runtime.temporary import Temporary

# Linux: the signal that a process gets when its parent ends (sys/prctl.h), and the origin of a signal that the terminal
# sends to all of its processes, as at Ctrl-C (asm-generic/siginfo.h)
_PR_SET_PDEATHSIG, _SI_KERNEL = 1, 0x80
_MAX_FILES = 250
# a thread of a native library may take SIGCHLD, so the fork is looked at after these seconds too
_POLL_SECONDS = 0.2


@dataclass(frozen=True)
class ForkResult:
    """The end of a fork.

    Attributes
    ----------
    code : int
        Its exit code, or the negative number of the signal that killed it.
    answer : object
        What its work returned; None where it ended before.
    signals : frozenset of int
        Those of the forwarded signals that came.
    """

    code: int
    answer: Any
    signals: frozenset[int]


def can_fork() -> bool:
    """Whether :func:`run_in_fork` works: on Linux, in the main thread."""
    return sys.platform == "linux" and threading.current_thread() is threading.main_thread()


def run_in_fork(
    work: Callable[[list[Staged]], object],
    forwarded: Collection[signal.Signals],
    folders: Sequence[str | os.PathLike[str]],
    is_staged: bool = True,
) -> ForkResult:
    """Work in a fork, which is killed when this process ends; move its files if its exit code is 0, else remove them.

    Parameters
    ----------
    work : callable
        Called in the fork with the list of the files that it has written so far; returns an answer that a message can
        represent. What it raises is raised to the caller there; after it the fork raises SystemExit.
    forwarded : collection of Signals
        Sent on to the fork instead of being handled here, unless the terminal has sent them to both.
    folders : sequence of path
        Where the fork writes; temporary folders that it leaves there are removed.
    is_staged : bool
        False where the fork moves each file as soon as it is written.

    Raises
    ------
    FileError
        A file cannot be moved.
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
            with postponed() if is_staged else contextlib.nullcontext(list[Staged]()) as written:
                answer = work(written)
            _hand_over(theirs, answer, written)
            raise SystemExit(0)
        theirs.close()
        with ours:
            code, signals = _wait(pid, blocked)
            answer, written = _take_over(ours)
        try:
            for staged in written if code == 0 else ():
                staged.move()
        finally:
            discard(written)
            for folder in folders if code != 0 else ():
                temporary.remove_stale(folder, pid)
        late = signal.sigpending() & {*forwarded}
        for number in late:
            signal.sigtimedwait({number}, 0)
        return ForkResult(code, answer, signals | late)
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


def _hand_over(channel: socket.socket, answer: object, written: Sequence[Staged]) -> None:
    locks = [each.temporary.lock for each in written if each.temporary.lock >= 0]  # -1 where the system has none
    socket.send_fds(channel, [b"\n"], locks)
    files = [(str(each.temporary.root), each.temporary.lock >= 0, str(each.target)) for each in written]
    with channel, channel.makefile("wb") as stream:
        write_message(stream, (answer, files))


def _take_over(channel: socket.socket) -> tuple[Any, list[Staged]]:
    """Return the answer of a fork that has ended, and its files; None and none where it did not come to its end."""
    locks = socket.recv_fds(channel, 1, _MAX_FILES, socket.MSG_CMSG_CLOEXEC)[1]
    try:
        with channel.makefile("rb") as stream:
            answer, files = read_message(stream)
    except EOFError:
        for lock in locks:
            os.close(lock)
        return None, []
    given = iter(locks)
    return answer, [
        Staged(Temporary(Path(root), next(given) if is_locked else -1), Path(target))
        for root, is_locked, target in files
    ]


def discard(written: list[Staged]) -> None:
    """Remove the files that were written so far."""
    while written:
        written.pop().discard()


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

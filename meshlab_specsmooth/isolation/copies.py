"""Work in a copy of this process (a fork), which takes no time to start and may die of what C++ does with files.

What the copy writes stays in temporary folders until it has ended well: some readers damage the memory of their
process, which is noticed only when it ends. Then this process moves what is there. The copy hands over the locks of the
folders too, so that nobody sweeps them meanwhile.
"""

from __future__ import annotations

import contextlib
import ctypes
import io
import json
import os
import signal
import socket
import sys
import threading
import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from meshlab_specsmooth.runtime.atomic import Staged
from meshlab_specsmooth.runtime.temporary import Temporary

# Linux: the signal that a process gets when the one that started it ends (sys/prctl.h); and that a signal is from the
# kernel (asm-generic/siginfo.h), as at Ctrl-C, when all processes of the terminal have it
_PR_SET_PDEATHSIG, _SI_KERNEL = 1, 0x80
_BLOCK, _MOST_FILES = 2**16, 250


@dataclass(frozen=True)
class Copy:
    """A copy of this process.

    Attributes
    ----------
    process : int
        Its number; 0 in the copy itself.
    channel : socket.socket
        An end of what connects both.
    """

    process: int
    channel: socket.socket


def are_possible() -> bool:
    """Whether a process may be copied: on Linux, by the main thread."""
    return sys.platform == "linux" and threading.current_thread() is threading.main_thread()


def start() -> Copy:
    """Copy this process. The copy ends when this one does."""
    signal.signal(signal.SIGCHLD, signal.SIG_DFL)  # where it is ignored there is no exit code
    this = os.getpid()
    ours, its = socket.socketpair()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)  # of threads: OpenBLAS has some, and starts its own anew
        process = os.fork()
    if process:
        its.close()
        return Copy(process, ours)
    ours.close()
    ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
    if os.getppid() != this:  # it has ended already
        os._exit(1)
    return Copy(0, its)


def hand_over(copy: Copy, written: Sequence[Staged], answer: object = None) -> None:
    """In the copy, when all is done: leave what was written, and an answer that JSON has, to the process it is of."""
    message = {"written": [[str(each.temporary.root), str(each.target)] for each in written], "answer": answer}
    data = json.dumps(message).encode() + b"\n"
    sent = socket.send_fds(copy.channel, [data], [each.temporary.lock for each in written])
    copy.channel.sendall(data[sent:])
    copy.channel.close()


@dataclass(frozen=True)
class Left:
    """What a copy left.

    Attributes
    ----------
    written : list of Staged
    answer
        None where it did not come to its end.
    """

    written: list[Staged]
    answer: Any = None

    def discard(self) -> None:
        """Remove what it wrote."""
        for staged in self.written:
            staged.discard()


def take_over(copy: Copy) -> Left:
    """When a copy has ended: what it left."""
    data, locks = b"", list[int]()
    with copy.channel as channel:
        while True:
            block, more, _, _ = socket.recv_fds(channel, _BLOCK, _MOST_FILES)
            locks += more
            if not block:
                break
            data += block
    for lock in locks:
        os.set_inheritable(lock, False)
    if not data.endswith(b"\n"):
        for lock in locks:
            os.close(lock)
        return Left([])
    message = json.loads(data)
    written = [
        Staged(Temporary(Path(root), lock), Path(target))
        for (root, target), lock in zip(message["written"], locks, strict=True)
    ]
    return Left(written, message["answer"])


def wait(copy: Copy, handed_on: set[signal.Signals]) -> int:
    """The exit code of a copy, or the negative number of the signal that killed it.

    These signals, and SIGCHLD, must be blocked; they are handed on to the copy.
    """
    while True:
        came = signal.sigwaitinfo({*handed_on, signal.SIGCHLD})
        if came.si_signo != signal.SIGCHLD and came.si_code != _SI_KERNEL:
            os.kill(copy.process, came.si_signo)
        ended, status = os.waitpid(copy.process, os.WNOHANG)
        if ended:
            return os.waitstatus_to_exitcode(status)


def keep_out_of_streams() -> None:
    """In a copy: what C and C++ print goes nowhere, as the last words of a process that dies; Python's does not."""
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

"""Work in a process of its own, whose death is told on one line: for what C++ does with files from strangers.

It is a copy of this one (a fork), so that it takes no time to start. This one waits for its end, and hands on the
signals that it gets itself.
"""

from __future__ import annotations

import ctypes
import os
import signal
import sys
import threading
import warnings

from meshlab_specsmooth.errors import SpecsmoothError

# Linux: the signal that a process gets when the one that started it ends (sys/prctl.h); and that a signal is from the
# kernel (asm-generic/siginfo.h), as at Ctrl-C, when all processes of the terminal have it
_PR_SET_PDEATHSIG, _SI_KERNEL = 1, 0x80


class Crashed(SpecsmoothError):  # noqa: N818 (named for what is wrong, as the other errors are)
    """The process that did the work was killed by a signal."""


def in_a_copy(what: str) -> int | None:
    """Go on in a copy of this process: None there, and here its exit code when it has ended.

    Only as the process's last work: an interrupt that comes at the end is ignored. The copy ends when this one does.
    Without effect, so that all goes on here, except on Linux, and in a process with threads, which a copy has not.

    Parameters
    ----------
    what : str
        What is worked on; begins the message of the error.

    Raises
    ------
    Crashed
    """
    if sys.platform != "linux" or threading.active_count() > 1:
        return None
    handed_on = {signal.SIGINT, signal.SIGTERM, signal.SIGHUP}
    signal.signal(signal.SIGCHLD, signal.SIG_DFL)  # where it is ignored there is no exit code
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {*handed_on, signal.SIGCHLD})
    this = os.getpid()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)  # of threads: OpenBLAS has some, and starts its own anew
        copy = os.fork()
    if copy == 0:
        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
        if os.getppid() != this:  # it has ended already
            os._exit(1)
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
        return None
    code = _wait(copy, handed_on)
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.pthread_sigmask(signal.SIG_SETMASK, before)
    if code < 0:
        raise Crashed(f"{what}: the process that read, changed or wrote it crashed ({signal.Signals(-code).name})")
    return code


def _wait(copy: int, handed_on: set[signal.Signals]) -> int:
    """The exit code of a copy, or the negative number of the signal that killed it."""
    while True:
        came = signal.sigwaitinfo({*handed_on, signal.SIGCHLD})
        if came.si_signo != signal.SIGCHLD and came.si_code != _SI_KERNEL:
            os.kill(copy, came.si_signo)
        ended, status = os.waitpid(copy, os.WNOHANG)
        if ended:
            return os.waitstatus_to_exitcode(status)

"""The exit status of a process in words."""

from __future__ import annotations

import signal


def describe_exit(code: int) -> str:
    """Say how a process ended, as the predicate of a sentence.

    Parameters
    ----------
    code : int
        Its exit code, or the negative number of the signal that killed it, as :mod:`subprocess` has it.

    Examples
    --------
    >>> from meshlab_specsmooth.isolation.exit_status import describe_exit
    >>> describe_exit(3), describe_exit(-9)
    ('ended with exit code 3', 'crashed (SIGKILL)')
    """
    if code >= 0:
        return f"ended with exit code {code}"
    try:
        return f"crashed ({signal.Signals(-code).name})"
    except ValueError:  # a real-time signal, which has no name
        return f"crashed (signal {-code})"

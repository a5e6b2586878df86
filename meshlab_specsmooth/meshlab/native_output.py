"""Capture what C++ writes to the standard streams of the process."""

from __future__ import annotations

import contextlib
import os
import sys
import tempfile
import threading
from collections.abc import Iterator

# The standard streams belong to the process, so only one thread at a time may replace them
_streams = threading.RLock()


@contextlib.contextmanager
def capture() -> Iterator[list[str]]:
    """Capture standard output and standard error during one short call; the text is appended to the list afterward.

    Use it within :class:`DeferInterrupts`, or an interrupt may leave the process without its standard output.
    """
    captured: list[str] = []
    with _streams, tempfile.TemporaryFile() as file:
        for stream in (sys.stdout, sys.stderr):
            if stream is not None:
                stream.flush()
        saved = {number: os.dup(number) for number in (1, 2) if _is_open(number)}
        try:
            for number in saved:
                os.dup2(file.fileno(), number)
            yield captured
        finally:
            for number, copy in saved.items():
                os.dup2(copy, number)
                os.close(copy)
            file.seek(0)
            captured.append(file.read().decode(errors="replace"))


def _is_open(number: int) -> bool:
    try:
        os.fstat(number)
    except OSError:
        return False
    return True

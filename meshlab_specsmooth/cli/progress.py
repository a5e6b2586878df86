"""Output of the command line: progress bars on terminals, lines and notices."""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Iterator

from meshlab_specsmooth.errors import MissingExtra
from meshlab_specsmooth.runtime import bars
from meshlab_specsmooth.runtime.progress import Progress

# Fraction of a bar after which the file is written, which reports no progress
FILTERING = 0.95


@contextlib.contextmanager
def bar(stage: str) -> Iterator[Progress | None]:
    """Yield a progress bar as a callback for the fraction done, or None if standard error is not a terminal.

    The bar needs the extra ``progress``; without it a line recommends to install it, and None is yielded.
    """
    if not sys.stderr.isatty():
        yield None
        return
    try:
        shown = bars.terminal_bar(stage)
    except ImportError:
        print(MissingExtra("a progress bar", "progress"), file=sys.stderr)
        yield None
        return
    try:
        yield shown
    finally:
        shown.close()


def say(line: str) -> None:
    """Print a line to standard output, above the bar if there is one."""
    with bars.above_bars(sys.stdout):
        print(line, flush=True)


def notice(message: object) -> None:
    """Print a message on one line of standard error, with unprintable characters escaped."""
    with bars.above_bars(sys.stderr):
        print("specsmooth:", printable(" ".join(str(message).split())), file=sys.stderr)


def printable(text: str) -> str:
    r"""Escape unprintable characters.

    Examples
    --------
    >>> from meshlab_specsmooth.cli.progress import printable
    >>> print(printable("a\x1bb"))
    a\x1bb
    """
    return "".join(c if c.isprintable() else ascii(c)[1:-1] for c in text)

"""What is printed: a progress bar on a terminal, lines elsewhere."""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Iterator

from meshlab_specsmooth.errors import MissingExtra
from meshlab_specsmooth.runtime import bars
from meshlab_specsmooth.runtime.progress import Progress

# Share of a bar that is left for the writing of a file, which does not say how far it is
FILTERING = 0.95


@contextlib.contextmanager
def bar(stage: str) -> Iterator[Progress | None]:
    """A bar as a callback for the fraction done, or None where standard error is no terminal.

    The bar itself is the extra ``progress``; without it a line says so, and the work goes on.
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
    """A line on standard output, above a bar if there is one."""
    with bars.above_bars(sys.stdout):
        print(line, flush=True)


def notice(message: object) -> None:
    """A message on one line of standard error, printable whatever the names of files in it."""
    with bars.above_bars(sys.stderr):
        print("specsmooth:", printable(" ".join(str(message).split())), file=sys.stderr)


def printable(text: str) -> str:
    r"""Text in which what is not printable is spelled out.

    Examples
    --------
    >>> from meshlab_specsmooth.cli.progress import printable
    >>> print(printable("a\x1bb"))
    a\x1bb
    """
    return "".join(c if c.isprintable() else ascii(c)[1:-1] for c in text)

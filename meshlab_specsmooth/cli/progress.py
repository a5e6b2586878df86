"""What is printed: a progress bar on a terminal, lines elsewhere."""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Iterator

from meshlab_specsmooth.errors import MissingExtra
from meshlab_specsmooth.spectral.progress import Progress


@contextlib.contextmanager
def bar(description: str) -> Iterator[Progress | None]:
    """A callback for the fraction done, or None where standard error is no terminal.

    The bar itself is the extra ``progress``; without it a line says so, and the work goes on.
    """
    if not sys.stderr.isatty():
        yield None
        return
    try:
        from tqdm import tqdm
    except ImportError:
        print(MissingExtra("a progress bar", "progress"), file=sys.stderr)
        yield None
        return
    shape = "{desc} |{bar}| {percentage:3.0f}% {elapsed}"
    with tqdm(desc=description, total=1.0, bar_format=shape, leave=False, file=sys.stderr) as display:

        def show(fraction: float) -> None:
            display.update(fraction - display.n)

        yield show


def say(line: str) -> None:
    """A line on standard output, above a bar if there is one."""
    try:
        from tqdm import tqdm
    except ImportError:
        print(line, flush=True)
        return
    with tqdm.external_write_mode(file=sys.stdout):
        print(line, flush=True)


def notice(message: object) -> None:
    """A message on one line of standard error, printable whatever the names of files in it."""
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

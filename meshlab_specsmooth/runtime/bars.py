"""Progress bars (extra ``progress``): in notebooks by themselves, on terminals by the command line."""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Callable, Iterator
from typing import Any

from meshlab_specsmooth.parameters import check_flag, check_progress

# what is done, how far, since when, and for how long
_SHAPE = "{desc} |{bar}| {percentage:3.0f}% {elapsed}<{remaining}"

# None: in notebooks alone
_is_shown: bool | None = None


def show_progress(shown: bool | None) -> None:
    """Show a bar at calls that are given no ``progress``, or none.

    Parameters
    ----------
    shown : bool or None
        True everywhere, False nowhere; None, as at the start, in notebooks where the extra ``progress`` is installed.

    Raises
    ------
    InvalidParameter
        Anything else.

    Examples
    --------
    >>> import meshlab_specsmooth as mss
    >>> mss.show_progress(False)
    >>> mss.show_progress(None)
    """
    global _is_shown
    _is_shown = None if shown is None else check_flag("shown", shown)


def begin(progress: Callable[[float], None] | None, stage: str) -> Callable[[float], None] | None:
    """The callback that a caller gave, checked, or a bar where one is to be shown; else None.

    The bar goes when the fraction is 1, or when nothing refers to it any more.
    """
    if progress is not None or _is_shown is False or not (_is_shown or _is_notebook()):
        return check_progress(progress)
    try:
        from tqdm.auto import tqdm
    except ImportError:
        return None
    return Bar(tqdm, stage)


class Bar:
    """A bar as a callback for the fraction done; its method ``stage`` says what begins."""

    def __init__(self, tqdm: Any, stage: str) -> None:
        self._display = tqdm(desc=stage, total=1.0, bar_format=_SHAPE, leave=False, file=sys.stderr)

    def __call__(self, fraction: float) -> None:
        """Show the fraction done; the bar goes at the end."""
        self._display.update(fraction - self._display.n)
        if fraction >= 1:
            self.close()

    def stage(self, name: str) -> None:
        """Show what begins."""
        self._display.set_description_str(name)

    def close(self) -> None:
        """Take the bar away."""
        self._display.close()


def terminal_bar(stage: str) -> Bar:
    """A bar on standard error; raises ImportError without the extra ``progress``."""
    from tqdm import tqdm

    return Bar(tqdm, stage)


@contextlib.contextmanager
def above_bars(stream: Any) -> Iterator[None]:
    """Clear bars while something is printed, if there are any."""
    tqdm = sys.modules.get("tqdm")
    with contextlib.nullcontext() if tqdm is None else tqdm.tqdm.external_write_mode(file=stream):
        yield


def _is_notebook() -> bool:
    """Whether this is the kernel of a notebook."""
    ipython = sys.modules.get("IPython")
    shell = None if ipython is None else ipython.get_ipython()
    return shell is not None and "IPKernelApp" in shell.config

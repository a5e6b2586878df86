"""Progress bars (extra ``progress``): shown automatically in notebooks, and by the command line on terminals."""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Callable, Iterator
from typing import Any

from meshlab_specsmooth.parameters import check_flag, check_progress

# stage, fraction done, time elapsed and remaining
_SHAPE = "{desc} |{bar}| {percentage:3.0f}% {elapsed}<{remaining}"

# None: in notebooks only
_is_shown: bool | None = None


def show_progress(shown: bool | None) -> None:
    """Set whether calls without ``progress`` show a bar.

    Parameters
    ----------
    shown : bool or None
        True everywhere, False nowhere; None (the default) in notebooks where the extra ``progress`` is installed.

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
    """The callback that the caller gave, checked; else a bar if one is to be shown, or None.

    The bar disappears when the fraction is 1, or when it is garbage-collected.
    """
    if progress is not None or _is_shown is False or not (_is_shown or _is_notebook()):
        return check_progress(progress)
    try:
        from tqdm.auto import tqdm
    except ImportError:
        return None
    return Bar(tqdm, stage)


class Bar:
    """A bar as a callback for the fraction done; its method ``stage`` shows the name of the current stage."""

    def __init__(self, tqdm: Any, stage: str) -> None:
        self._display = tqdm(desc=stage, total=1.0, bar_format=_SHAPE, leave=False, file=sys.stderr)

    def __call__(self, fraction: float) -> None:
        """Show the fraction done; closes the bar at 1."""
        self._display.update(fraction - self._display.n)
        if fraction >= 1:
            self.close()

    def stage(self, name: str) -> None:
        """Show the name of the stage that begins."""
        self._display.set_description_str(name)

    def close(self) -> None:
        """Remove the bar."""
        self._display.close()


def terminal_bar(stage: str) -> Bar:
    """A bar on standard error; raises ImportError without the extra ``progress``."""
    from tqdm import tqdm

    return Bar(tqdm, stage)


@contextlib.contextmanager
def above_bars(stream: Any) -> Iterator[None]:
    """Clear any bars while something is printed."""
    tqdm = sys.modules.get("tqdm")
    with contextlib.nullcontext() if tqdm is None else tqdm.tqdm.external_write_mode(file=stream):
        yield


def _is_notebook() -> bool:
    """Whether this process is the kernel of a notebook."""
    ipython = sys.modules.get("IPython")
    shell = None if ipython is None else ipython.get_ipython()
    return shell is not None and "IPKernelApp" in shell.config

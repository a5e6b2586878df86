"""Ctrl-C while something must not be left half done: it waits until nothing is, or until all can be undone.

Python raises KeyboardInterrupt between any two bytecodes of the main thread, so ``try`` and ``finally`` alone protect
nothing: it may come before the one begins, or in the middle of the other. Here the handler of SIGINT is replaced for
that long, which is the only place where an interrupt can be stopped at every bytecode.
"""

from __future__ import annotations

import contextlib
import signal
import threading
from collections.abc import Callable, Iterator
from types import FrameType, TracebackType
from typing import Any

Handler = Callable[[int, FrameType | None], Any]


class _StandIn:
    """Handler of SIGINT in place of another, which gets interrupts at once or later."""

    def __init__(self, handler: Handler) -> None:
        self.handler = handler
        self.waits = True
        self.came = False

    def __call__(self, number: int, frame: FrameType | None) -> None:
        if self.waits:
            self.came = True
            return
        self.waits = True  # so that what cleans up when the handler raises is not interrupted as well
        self.handler(number, frame)
        self.waits = False

    def deliver(self) -> None:
        """Hand over the interrupt that came meanwhile; the handler usually raises."""
        if self.came:
            self.came = False
            self.handler(signal.SIGINT, None)


class Hold:
    """Interrupts wait from its making until :meth:`end`, or the end of a ``with`` block.

    Without effect in threads other than the main one, which are never interrupted, and where SIGINT is ignored or ends
    the process. Inside of another hold, it is the outer one that hands over what came.

    Examples
    --------
    >>> import signal
    >>> from meshlab_specsmooth.runtime.interrupts import Hold
    >>> try:
    ...     with Hold():
    ...         signal.raise_signal(signal.SIGINT)
    ...         print("to its end")
    ... except KeyboardInterrupt:
    ...     print("then interrupted")
    to its end
    then interrupted
    """

    def __init__(self) -> None:
        self._stand_in: _StandIn | None = None
        self._is_outermost = False
        self._waited = False
        self.begin()

    def begin(self) -> None:
        """Wait again, where it came to its end; else go on waiting."""
        in_main = threading.current_thread() is threading.main_thread()
        handler = signal.getsignal(signal.SIGINT) if in_main else None
        if isinstance(handler, _StandIn):
            if handler is not self._stand_in:
                self._stand_in, self._waited = handler, handler.waits
            handler.waits = True
        elif callable(handler):
            self._stand_in, self._is_outermost = _StandIn(handler), True
            signal.signal(signal.SIGINT, self._stand_in)

    def deliver(self) -> None:
        """Let an interrupt that came raise here, where it can be undone."""
        if self._stand_in is not None and not self._waited:
            self._stand_in.deliver()

    def end(self) -> None:
        """Let interrupts raise from here on, the one that came first."""
        if self._stand_in is None:
            return
        if self._is_outermost:
            signal.signal(signal.SIGINT, self._stand_in.handler)
            self._is_outermost = False
        else:
            self._stand_in.waits = self._waited
        self.deliver()

    @contextlib.contextmanager
    def through(self) -> Iterator[None]:
        """Inside, interrupts raise at once, and wait again from the moment that one does."""
        self.deliver()
        if self._stand_in is not None:
            self._stand_in.waits = self._waited
        try:
            yield
        finally:
            if self._stand_in is not None:
                self._stand_in.waits = True

    def __enter__(self) -> Hold:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self.end()


def all_or_nothing(change: Callable[[Callable[[], None]], None], undo: Callable[[], None]) -> None:
    """Make a change as a whole, or raise with nothing changed, whenever an interrupt comes.

    Parameters
    ----------
    change : callable
        Gets a function to call wherever it may be broken off.
    undo : callable
        Puts back what was there, however far the change has come; it is not interrupted.
    """
    hold = Hold()
    try:
        change(hold.deliver)
        hold.deliver()
        hold.end()  # nothing comes after it: an interrupt is undone, or finds us gone
    except BaseException:
        hold.begin()
        try:
            undo()
        finally:
            hold.end()
        raise

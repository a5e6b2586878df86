"""Deferred keyboard interrupts, for changes that must be made completely or not at all.

Python raises KeyboardInterrupt between any two bytecodes of the main thread, so that ``try`` and ``finally`` alone
protect nothing: it may arrive before the first begins or in the middle of the second. Replacing the handler of SIGINT
is the only way to defer an interrupt at every bytecode.
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
    """Handler of SIGINT that passes interrupts on to another handler, at once or later."""

    def __init__(self, handler: Handler) -> None:
        self.handler = handler
        self.waits = True
        self.came = False

    def __call__(self, number: int, frame: FrameType | None) -> None:
        if self.waits:
            self.came = True
            return
        self.waits = True  # cleaning up after the handler has raised must not be interrupted as well
        self.handler(number, frame)
        self.waits = False

    def deliver(self) -> None:
        """Pass on an interrupt that arrived meanwhile; the handler usually raises."""
        if self.came:
            self.came = False
            self.handler(signal.SIGINT, None)


class DeferInterrupts:
    """Defer interrupts from the construction until :meth:`end`, or the end of a ``with`` block.

    Has no effect in threads other than the main one, which are never interrupted, and where SIGINT is ignored or ends
    the process. Nested contexts leave the interrupt to the outermost one.

    Examples
    --------
    >>> import signal
    >>> from meshlab_specsmooth.runtime.interrupts import DeferInterrupts
    >>> try:
    ...     with DeferInterrupts():
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
        """Defer again after :meth:`end`; otherwise continue to defer."""
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
        """Let an interrupt that has arrived raise here, where the work can be undone."""
        if self._stand_in is not None and not self._waited:
            self._stand_in.deliver()

    def end(self) -> None:
        """Stop deferring; an interrupt that has arrived raises here."""
        if self._stand_in is None:
            return
        if self._is_outermost:
            signal.signal(signal.SIGINT, self._stand_in.handler)
            self._is_outermost = False
        else:
            self._stand_in.waits = self._waited
        self.deliver()

    @contextlib.contextmanager
    def allow(self) -> Iterator[None]:
        """Let interrupts raise at once inside of a ``with`` block; once one has raised, others are deferred again."""
        self.deliver()
        if self._stand_in is not None:
            self._stand_in.waits = self._waited
        try:
            yield
        finally:
            if self._stand_in is not None:
                self._stand_in.waits = True

    def __enter__(self) -> DeferInterrupts:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self.end()


def all_or_nothing(change: Callable[[Callable[[], None]], None], undo: Callable[[], None]) -> None:
    """Make a change completely, or raise with nothing changed, whenever an interrupt arrives.

    Parameters
    ----------
    change : callable
        Receives a function to call wherever it may be interrupted.
    undo : callable
        Restores the former state, however far the change has come; it is not interrupted.
    """
    hold = DeferInterrupts()
    try:
        change(hold.deliver)
        hold.deliver()
        hold.end()  # the last statement: an interrupt is either undone or arrives after the call
    except BaseException:
        hold.begin()
        try:
            undo()
        finally:
            hold.end()
        raise

"""How long work reports where it is."""

from __future__ import annotations

from collections.abc import Callable

#: Called with the fraction done, rising from 0 to 1. A method ``stage``, if there is one, gets the name of what begins.
Progress = Callable[[float], None]


def announce(progress: Progress | None, stage: str) -> None:
    """Say what begins, to a callback that has a method ``stage``."""
    say = getattr(progress, "stage", None)
    if callable(say):
        say(stage)


def finish(progress: Progress | None) -> None:
    """Report that all is done, whatever way it went."""
    if progress is not None:
        progress(1.0)


def part(progress: Progress | None, start: float, share: float) -> Progress | None:
    """A callback for a part of the work, which runs from ``start`` over ``share`` of the whole."""
    return None if progress is None else _Part(progress, start, share)


def rising(progress: Progress | None) -> Progress | None:
    """The callback without steps back, which residuals of conjugate gradients make."""
    return None if progress is None else _Rising(progress)


class _Part:
    def __init__(self, whole: Progress, start: float, share: float) -> None:
        self._whole, self._start, self._share = whole, start, share

    def __call__(self, fraction: float) -> None:
        self._whole(self._start + self._share * fraction)

    def stage(self, name: str) -> None:
        announce(self._whole, name)


class _Rising:
    def __init__(self, progress: Progress) -> None:
        self._progress, self._highest = progress, 0.0

    def __call__(self, fraction: float) -> None:
        self._highest = max(self._highest, fraction)
        self._progress(self._highest)

    def stage(self, name: str) -> None:
        announce(self._progress, name)

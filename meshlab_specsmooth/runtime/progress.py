"""Progress callbacks for parts of longer work."""

from __future__ import annotations

from collections.abc import Callable

#: Called with the fraction done, from 0 to 1. An optional method ``stage`` is called with the name of each stage.
Progress = Callable[[float], None]


def announce(progress: Progress | None, stage: str) -> None:
    """Report the name of a stage that begins, if the callback has a method ``stage``."""
    report = getattr(progress, "stage", None)
    if callable(report):
        report(stage)


def finish(progress: Progress | None) -> None:
    """Report that all is done, whichever way was taken."""
    if progress is not None:
        progress(1.0)


def subrange(progress: Progress | None, start: float, fraction: float) -> Progress | None:
    """A callback for a part of the work: its 0 to 1 is reported as ``start`` to ``start + fraction``."""
    return None if progress is None else _Subrange(progress, start, fraction)


def monotone(progress: Progress | None) -> Progress | None:
    """A callback that never reports less than before, as the residuals of conjugate gradients would."""
    return None if progress is None else _Monotone(progress)


class _Subrange:
    def __init__(self, whole: Progress, start: float, fraction: float) -> None:
        self._whole, self._start, self._fraction = whole, start, fraction

    def __call__(self, fraction: float) -> None:
        self._whole(self._start + self._fraction * fraction)

    def stage(self, name: str) -> None:
        announce(self._whole, name)


class _Monotone:
    def __init__(self, progress: Progress) -> None:
        self._progress, self._highest = progress, 0.0

    def __call__(self, fraction: float) -> None:
        self._highest = max(self._highest, fraction)
        self._progress(self._highest)

    def stage(self, name: str) -> None:
        announce(self._progress, name)

"""How long work reports where it is."""

from __future__ import annotations

from collections.abc import Callable

#: Called with the fraction done, rising from 0 to 1.
Progress = Callable[[float], None]


def part(progress: Progress | None, start: float, share: float) -> Progress | None:
    """A callback for a part of the work, which runs from ``start`` over ``share`` of the whole."""
    if progress is None:
        return None
    return lambda fraction: progress(start + share * fraction)


def rising(progress: Progress | None) -> Progress | None:
    """The callback without steps back, which residuals of conjugate gradients make."""
    if progress is None:
        return None
    highest = 0.0

    def report(fraction: float) -> None:
        nonlocal highest
        highest = max(highest, fraction)
        progress(highest)

    return report

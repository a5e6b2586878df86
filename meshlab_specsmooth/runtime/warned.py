"""Python warnings for what stands in the ``warning`` of a result: one for each call of a user."""

from __future__ import annotations

import contextlib
import functools
import sys
import warnings
from collections.abc import Callable, Iterator
from contextvars import ContextVar
from typing import ParamSpec, TypeVar

from meshlab_specsmooth.errors import SmoothingWarning

P = ParamSpec("P")
R = TypeVar("R")

_is_inner: ContextVar[bool] = ContextVar("_is_inner", default=False)


@contextlib.contextmanager
def unwarned() -> Iterator[None]:
    """Let calls inside the block return their warnings only; for callers that pass them on."""
    token = _is_inner.set(True)
    try:
        yield
    finally:
        _is_inner.reset(token)


def warn_once(function: Callable[P, R]) -> Callable[P, R]:
    """Issue the ``warning`` of what a function returns, unless another such function called it."""

    @functools.wraps(function)
    def call(*args: P.args, **kwargs: P.kwargs) -> R:
        if _is_inner.get():
            return function(*args, **kwargs)
        with unwarned():
            found = function(*args, **kwargs)
        text = found.get("warning") if isinstance(found, dict) else getattr(found, "warning", None)
        if text:
            warnings.warn(text, SmoothingWarning, stacklevel=count_frames())
        return found

    return call


def count_frames() -> int:
    """Number of frames from the caller up to the code that called this package."""
    package = __name__.partition(".")[0]
    frame, depth, outermost = sys._getframe(1), 1, 1
    while frame.f_back is not None:
        if frame.f_globals.get("__name__", "").partition(".")[0] == package:
            outermost = depth
        frame, depth = frame.f_back, depth + 1
    return outermost + 1

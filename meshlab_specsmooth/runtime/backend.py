"""What is there of the extra ``fast``: numba for compiled sweeps, threadpoolctl to limit the threads of BLAS.

Every other module asks here, each time anew. Errors inside of compiled modules are errors; only numba itself may be
absent, or fail to be loaded, and then scipy does the work.
"""

from __future__ import annotations

import functools
import importlib
import importlib.util
import os
import sys
import threading
import warnings

from meshlab_specsmooth.errors import Slow

#: From so many vertices on it matters whether sweeps are compiled: below, a call takes less than some five seconds.
LARGE = 20_000

#: Whether numba can keep on disk what it compiled: it needs a source file, or a frozen program, and archives have none.
IS_KEPT = bool(getattr(sys, "frozen", False)) or os.path.exists((__spec__.origin if __spec__ else None) or "")  # noqa: PTH110

_said = threading.Event()


def is_compiled(vertices: int = 0) -> bool:
    """Whether sweeps are compiled; if not, and for more than :data:`LARGE` vertices, a warning says so, once a process.

    Warns
    -----
    Slow
    """
    problem = _problem()
    if problem is None:
        return True
    if vertices > LARGE and not _said.is_set():
        _said.set()
        warnings.warn(f"{problem}; without numba this takes two to five times as long", Slow, _depth())
    return False


def has_threadpoolctl() -> bool:
    """Whether the threads of BLAS can be limited."""
    return importlib.util.find_spec("threadpoolctl") is not None


def _problem() -> str | None:
    """Why numba cannot be used, and the remedy."""
    if importlib.util.find_spec("numba") is None:
        return "numba is not installed (pip install numba threadpoolctl)"
    return _failure()


@functools.cache
def _failure() -> str | None:
    """Why numba, which is installed, cannot be loaded: as a rule numpy is too new for it."""
    try:
        importlib.import_module("numba")
    except (ImportError, OSError) as error:  # llvmlite raises the latter
        return f"numba cannot be loaded: {' '.join(str(error).split())} (pip install --upgrade numba)"
    return None


def _depth() -> int:
    """Which frame above the caller belongs to whoever called this package."""
    package = __name__.partition(".")[0]
    frame, depth, outermost = sys._getframe(1), 1, 1
    while frame.f_back is not None:
        if frame.f_globals.get("__name__", "").partition(".")[0] == package:
            outermost = depth
        frame, depth = frame.f_back, depth + 1
    return outermost + 1

"""Availability of the extra ``fast``: numba for compiled kernels, threadpoolctl to limit the threads of BLAS.

Other modules ask here. Only numba itself may be missing or fail to load, and then scipy is used; errors inside of
compiled modules are raised.
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
from meshlab_specsmooth.runtime.interrupts import DeferInterrupts
from meshlab_specsmooth.runtime.warned import count_frames

#: Above this many vertices missing numba is warned of: below, a call takes less than some five seconds.
LARGE = 20_000

#: Whether numba can cache compiled code on disk: it needs a source file or a frozen program; zip archives have neither.
CAN_CACHE = bool(getattr(sys, "frozen", False)) or os.path.exists((__spec__.origin if __spec__ else None) or "")  # noqa: PTH110

_has_warned = threading.Event()


def is_compiled(vertices: int = 0) -> bool:
    """Whether kernels are compiled; if not, warn once per process for meshes of more than :data:`LARGE` vertices.

    Warns
    -----
    Slow
    """
    problem = _problem()
    if problem is None:
        return True
    if vertices > LARGE and not _has_warned.is_set():
        _has_warned.set()
        warnings.warn(f"{problem}; without numba this takes two to five times as long", Slow, count_frames())
    return False


def has_threadpoolctl() -> bool:
    """Whether the threads of BLAS can be limited."""
    return importlib.util.find_spec("threadpoolctl") is not None


def _problem() -> str | None:
    """Why numba cannot be used, and the remedy; None if it can."""
    if importlib.util.find_spec("numba") is None:
        return "numba is not installed (pip install numba threadpoolctl)"
    return _failure()


@functools.cache
def _failure() -> str | None:
    """Why numba is installed but cannot be loaded, usually because numpy is too new for it; None if it can."""
    try:
        with DeferInterrupts():  # it may crash if it is interrupted while it loads
            importlib.import_module("numba")
    except (ImportError, OSError) as error:  # llvmlite raises the latter
        return f"numba cannot be loaded: {' '.join(str(error).split())} (pip install --upgrade numba)"
    return None

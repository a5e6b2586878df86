"""Available memory: refuse work that would not fit, and limit what a process may allocate."""

from __future__ import annotations

import contextlib
import os
import re
import threading
from collections.abc import Iterator
from pathlib import Path

from meshlab_specsmooth.errors import TooLarge

_PROC = Path("/proc")
_CGROUPS = Path("/sys/fs/cgroup")


def available() -> int:
    """Bytes that this process can still allocate without swapping, given the machine and its control groups.

    2^63 - 1 where this is not known (systems that are neither Linux nor POSIX).

    Examples
    --------
    >>> from meshlab_specsmooth.runtime.memory import available
    >>> available() > 0
    True
    """
    return min([_of_machine(), *_of_groups()])


def require(needed: int, task: str) -> None:
    """Raise if work needs more memory than is available.

    Parameters
    ----------
    needed : int
        Bytes in addition to what the process has.
    task : str
        The work, as the subject of the error message.

    Raises
    ------
    TooLarge

    Examples
    --------
    >>> from meshlab_specsmooth.runtime.memory import require
    >>> require(2**80, "smoothing 1e21 vertices")
    Traceback (most recent call last):
    ...
    meshlab_specsmooth.errors.TooLarge: smoothing 1e21 vertices needs 1125899906842624.0 GiB of memory, ...
    """
    free = available()
    if needed > free:
        raise TooLarge(
            f"{task} needs {needed / 2**30:.1f} GiB of memory, and {free / 2**30:.1f} GiB are available; close other "
            "programs, take a machine (or a container's limit) with more, or decimate or split the mesh first"
        )


@contextlib.contextmanager
def limited(more: int) -> Iterator[None]:
    """Limit what this process can allocate in addition to what it has; without effect on systems other than Linux.

    Further allocations fail with a MemoryError, those in C++ as well. An existing lower limit is kept. The limit holds
    for the whole process, so that it is only set in the main thread, where contexts can only be nested.

    Parameters
    ----------
    more : int
        Bytes.

    Examples
    --------
    >>> from meshlab_specsmooth.runtime.memory import limited
    >>> with limited(2**20):
    ...     pass
    """
    held = _data_bytes()
    if held is None or threading.current_thread() is not threading.main_thread():
        yield
        return
    import resource  # POSIX only

    before, hard = resource.getrlimit(resource.RLIMIT_DATA)
    wanted = min(held + more, *(limit for limit in (before, hard) if limit != resource.RLIM_INFINITY), 2**62)
    resource.setrlimit(resource.RLIMIT_DATA, (wanted, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_DATA, (before, hard))


def _data_bytes() -> int | None:
    """The bytes that Linux counts against RLIMIT_DATA; None on other systems."""
    try:
        pages = int((_PROC / "self" / "statm").read_text(encoding="ascii").split()[5])
    except (OSError, IndexError, ValueError):
        return None
    return pages * os.sysconf("SC_PAGE_SIZE")


def _of_machine() -> int:
    """The bytes that Linux considers available without swapping; on other systems the free pages, if known."""
    found = _numbers(_PROC / "meminfo").get("MemAvailable")
    if found is not None:
        return found * 1024
    try:
        return os.sysconf("SC_AVPHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    except (AttributeError, ValueError, OSError):  # Windows has no sysconf, macOS not this name
        return 2**63 - 1


def _of_groups() -> list[int]:
    """The bytes that are left of each limit of this process' control groups and of the groups around them."""
    left = []
    for group, limit, usage, cache in _groups():
        for folder in (group, *group.parents):
            if not folder.is_relative_to(_CGROUPS):
                break
            maximum, used = _number(folder / limit), _number(folder / usage)
            if maximum is not None and used is not None:
                # cached files count as used, but are dropped on demand
                left.append(max(0, maximum - used + _numbers(folder / "memory.stat").get(cache, 0)))
    return left


def _groups() -> list[tuple[Path, str, str, str]]:
    """The folder of each memory control group of this process, and the names of its limit, usage and cache."""
    groups = []
    for line in _text(_PROC / "self" / "cgroup").splitlines():
        number, controllers, path = line.split(":", 2)
        if number == "0" and not controllers:  # version 2
            groups.append((_CGROUPS / path.lstrip("/"), "memory.max", "memory.current", "inactive_file"))
        elif "memory" in controllers.split(","):
            folder = _CGROUPS / "memory" / path.lstrip("/")
            groups.append((folder, "memory.limit_in_bytes", "memory.usage_in_bytes", "total_inactive_file"))
    return groups


def _number(path: Path) -> int | None:
    """The number in a file; None if there is no file, or it holds "max"."""
    text = _text(path).strip()
    return int(text) if text.isdecimal() else None


def _numbers(path: Path) -> dict[str, int]:
    """The numbers in a file by name, one per line; empty if there is no file."""
    return {name: int(number) for name, number in re.findall(r"^(\w+):?\s+(\d+)", _text(path), re.MULTILINE)}


def _text(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8")
    except OSError:
        return ""

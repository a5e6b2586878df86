"""What memory there is: to refuse work that would not fit before it starts, and end what takes more than there is."""

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
    """Bytes that this process can still take without swapping: the machine's, or what its control group allows.

    Where neither the machine nor a group tells (neither Linux nor POSIX), it is said to be without end: 2^63 - 1.

    Examples
    --------
    >>> from meshlab_specsmooth.runtime.memory import available
    >>> available() > 0
    True
    """
    return min([_of_machine(), *_of_groups()])


def require(needed: int, what: str) -> None:
    """Refuse work that needs more memory than is available.

    Parameters
    ----------
    needed : int
        Bytes on top of what the process has.
    what : str
        What needs them, as the beginning of a sentence.

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
            f"{what} needs {needed / 2**30:.1f} GiB of memory, and {free / 2**30:.1f} GiB are available; close other "
            "programs, take a machine (or a container's limit) with more, or decimate or split the mesh first"
        )


@contextlib.contextmanager
def limited(more: int) -> Iterator[None]:
    """Inside, this process may take so many bytes more than it has, where the system can see to it (Linux).

    What takes more gets a MemoryError, as C++ is refused it, too. A limit that is lower already stays. The limit is
    the process's, so that it is set in the main thread alone, where one can only lie inside of another.

    Parameters
    ----------
    more : int

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
    import resource  # POSIX's alone

    before, hard = resource.getrlimit(resource.RLIMIT_DATA)
    wanted = min(held + more, *(limit for limit in (before, hard) if limit != resource.RLIM_INFINITY), 2**62)
    resource.setrlimit(resource.RLIMIT_DATA, (wanted, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_DATA, (before, hard))


def _data_bytes() -> int | None:
    """What Linux counts against RLIMIT_DATA; None elsewhere."""
    try:
        pages = int((_PROC / "self" / "statm").read_text(encoding="ascii").split()[5])
    except (OSError, IndexError, ValueError):
        return None
    return pages * os.sysconf("SC_PAGE_SIZE")


def _of_machine() -> int:
    """What Linux says could be taken without swapping; elsewhere the pages that are free, if that can be asked."""
    found = _numbers(_PROC / "meminfo").get("MemAvailable")
    if found is not None:
        return found * 1024
    try:
        return os.sysconf("SC_AVPHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    except (AttributeError, ValueError, OSError):  # Windows has no sysconf, macOS not this name
        return 2**63 - 1


def _of_groups() -> list[int]:
    """What is left of each limit of the control groups that this process is in, and of those around them."""
    left = []
    for group, limit, usage, cache in _groups():
        for folder in (group, *group.parents):
            if not folder.is_relative_to(_CGROUPS):
                break
            most, used = _number(folder / limit), _number(folder / usage)
            if most is not None and used is not None:
                # files that were read count as used, but give way
                left.append(max(0, most - used + _numbers(folder / "memory.stat").get(cache, 0)))
    return left


def _groups() -> list[tuple[Path, str, str, str]]:
    """The folder of each memory control group of this process, and what its files and its cache are called."""
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
    """A file's one number; None where there is no file, or it says "max"."""
    text = _text(path).strip()
    return int(text) if text.isdecimal() else None


def _numbers(path: Path) -> dict[str, int]:
    """Numbers by name, one a line; none where there is no file."""
    return {name: int(number) for name, number in re.findall(r"^(\w+):?\s+(\d+)", _text(path), re.MULTILINE)}


def _text(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8")
    except OSError:
        return ""

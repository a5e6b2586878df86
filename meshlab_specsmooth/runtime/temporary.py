"""Temporary folders that are removed even if the process that made them was killed.

Each holds a file that is locked while its process, or one that took over from it, is alive. The system releases the
lock of a process that dies for any reason, also across containers, where process ids mean nothing. A folder whose lock
can be acquired is abandoned.
"""

from __future__ import annotations

import contextlib
import os
import shutil
import stat
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from meshlab_specsmooth.runtime.interrupts import DeferInterrupts

#: Prefix of the names of all temporary folders.
PREFIX = ".specsmooth-"
_LOCK, _CONTENT = "lock", "files"
# seconds after which a folder without a lock is abandoned: its process was killed early, or there are no locks
_MAX_AGE = 86400.0


@dataclass(frozen=True)
class Temporary:
    """A temporary folder.

    Attributes
    ----------
    root : Path
        The folder that is removed.
    lock : int
        Descriptor of the locked file; -1 if the system has no such locks.
    """

    root: Path
    lock: int

    @property
    def content(self) -> Path:
        """The folder to write in."""
        return self.root / _CONTENT

    def remove(self) -> None:
        """Remove the folder with its content, and release the lock."""
        shutil.rmtree(self.content, ignore_errors=True)  # the lock last
        shutil.rmtree(self.root, ignore_errors=True)
        if self.lock >= 0:
            os.close(self.lock)


def create(place: str | os.PathLike[str] | None = None) -> Temporary:
    """Create a temporary folder in a place, by default the system's, that only this user can read."""
    root = Path(tempfile.mkdtemp(prefix=f"{PREFIX}{os.getpid()}-", dir=place))
    lock = -1
    try:
        lock = _create_lock(root)  # first, as a folder without one is kept for a day
        (root / _CONTENT).mkdir()
    except BaseException:
        Temporary(root, lock).remove()
        raise
    return Temporary(root, lock)


@contextlib.contextmanager
def folder(place: str | os.PathLike[str] | None = None) -> Iterator[Path]:
    """A temporary folder to write in; interrupts are deferred until it is removed."""
    with DeferInterrupts():
        temporary = create(place)
        try:
            yield temporary.content
        finally:
            temporary.remove()


def _create_lock(root: Path) -> int:
    """Create a locked file and return its descriptor; it gets its name only when it is locked."""
    if os.name != "posix":
        return -1
    new = root / f"{_LOCK}.new"
    lock = os.open(new, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o600)
    if not _try_lock(lock):  # a file system without locks
        os.close(lock)
        return -1
    new.rename(root / _LOCK)
    return lock


def _try_lock(file: int) -> bool:
    import fcntl  # POSIX only

    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:  # held by another process, or there are no locks
        return False
    return True


def remove_stale(place: str | os.PathLike[str], ended: int | None = None) -> None:
    """Remove the abandoned temporary folders in a place.

    Parameters
    ----------
    place : path
    ended : int, optional
        Id of a forked child that has ended: it may have created a folder without locking it.
    """
    if os.name != "posix":
        return
    for root in Path(place).glob(f"{PREFIX}*"):
        if _is_abandoned(root, begun=root.name.startswith(f"{PREFIX}{ended}-")):
            shutil.rmtree(root, ignore_errors=True)


def _is_abandoned(root: Path, begun: bool) -> bool:
    try:
        status = root.lstat()
        if not stat.S_ISDIR(status.st_mode) or status.st_uid != os.getuid():
            return False
        if not (root / _LOCK).is_file():
            return begun or time.time() - status.st_mtime > _MAX_AGE
        lock = os.open(root / _LOCK, os.O_RDWR | os.O_CLOEXEC | os.O_NOFOLLOW)
    except OSError:  # removed meanwhile, or not readable
        return False
    try:
        return _try_lock(lock)
    finally:
        os.close(lock)

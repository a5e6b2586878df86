"""Temporary folders that are removed even where the process that made them was killed, and only then.

Each holds a file that is locked for as long as its process, or one that took over from it, lives. The system gives up
the lock of a process that dies, whatever killed it, on either side of a container: numbers of processes say nothing
there. A folder whose lock can be had is nobody's.
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

from meshlab_specsmooth.runtime.interrupts import Hold

#: How the names of all of them begin.
PREFIX = ".specsmooth-"
_LOCK, _CONTENT = "lock", "files"
# seconds after which a folder without a lock is nobody's: its process was killed as it began, or there are no locks
_FORGOTTEN = 86400.0


@dataclass(frozen=True)
class Temporary:
    """A temporary folder.

    Attributes
    ----------
    root : Path
        What is removed.
    lock : int
        Descriptor of the file that is locked; -1 where the system has no such locks.
    """

    root: Path
    lock: int

    @property
    def content(self) -> Path:
        """The folder to write in."""
        return self.root / _CONTENT

    def remove(self) -> None:
        """Remove it with all that it holds, and give up the lock."""
        shutil.rmtree(self.content, ignore_errors=True)  # the lock last
        shutil.rmtree(self.root, ignore_errors=True)
        if self.lock >= 0:
            os.close(self.lock)


def make(place: str | os.PathLike[str] | None = None) -> Temporary:
    """Make a temporary folder in a place, or where the system has them; only this user can look into it."""
    root = Path(tempfile.mkdtemp(prefix=f"{PREFIX}{os.getpid()}-", dir=place))
    lock = -1
    try:
        (root / _CONTENT).mkdir()
        lock = _locked(root)
    except BaseException:
        shutil.rmtree(root, ignore_errors=True)
        raise
    return Temporary(root, lock)


@contextlib.contextmanager
def folder(place: str | os.PathLike[str] | None = None) -> Iterator[Path]:
    """A temporary folder to write in; interrupts wait until it is removed."""
    with Hold():
        made = make(place)
        try:
            yield made.content
        finally:
            made.remove()


def _locked(root: Path) -> int:
    """The descriptor of a locked file; it gets its name once it is locked, so that a file of its name always is."""
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
    import fcntl  # POSIX's alone

    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:  # another has it, or there are no locks
        return False
    return True


def sweep(place: str | os.PathLike[str], ended: int | None = None) -> None:
    """Remove the temporary folders of a place that are nobody's any more.

    Parameters
    ----------
    place : path
    ended : int, optional
        A copy of this process that has ended: it may have begun a folder, and not have locked it yet.
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
            return begun or time.time() - status.st_mtime > _FORGOTTEN
        lock = os.open(root / _LOCK, os.O_RDWR | os.O_CLOEXEC | os.O_NOFOLLOW)
    except OSError:  # it is being removed, or not for this process to look at
        return False
    try:
        return _try_lock(lock)
    finally:
        os.close(lock)

"""Work in a fork whose files reach their places only when it has ended well.

Some readers damage the memory of their process, which is noticed only when it ends. Until then what the fork has
written stays in temporary folders. It hands over their locks, so that no other process removes them meanwhile.
"""

from __future__ import annotations

import contextlib
import os
import signal
from collections.abc import Callable, Collection, Sequence
from dataclasses import replace
from pathlib import Path

from meshlab_specsmooth.isolation import fork
from meshlab_specsmooth.isolation.fork import ForkResult
from meshlab_specsmooth.meshlab.files import Staged, postponed
from meshlab_specsmooth.runtime import temporary
from meshlab_specsmooth.runtime.temporary import Temporary


def run_staged(
    work: Callable[[list[Staged]], object],
    forwarded: Collection[signal.Signals],
    folders: Sequence[str | os.PathLike[str]],
    is_staged: bool = True,
) -> ForkResult:
    """Work in a fork, and move its files when it has ended with exit code 0, else remove them.

    Parameters
    ----------
    work : callable
        Called in the fork with the list of the files that it has written so far; returns an answer that JSON can
        represent.
    forwarded : collection of Signals
        See :func:`meshlab_specsmooth.isolation.fork.run_in_fork`.
    folders : sequence of path
        Where the fork writes; temporary folders that it leaves there are removed.
    is_staged : bool
        False where the fork moves each file as soon as it is written.

    Raises
    ------
    FileError
        A file cannot be moved.
    """

    def work_with_files() -> tuple[object, Sequence[int]]:
        with postponed() if is_staged else contextlib.nullcontext(list[Staged]()) as written:
            answer = work(written)
        files = [(str(each.temporary.root), each.temporary.lock >= 0, str(each.target)) for each in written]
        return (answer, files), [each.temporary.lock for each in written if each.temporary.lock >= 0]

    def finish(result: ForkResult) -> ForkResult:
        answer, files = result.answer or (None, [])
        locks = iter(result.descriptors)
        written = [
            Staged(Temporary(Path(root), next(locks) if is_locked else -1), Path(target))
            for root, is_locked, target in files
        ]
        try:
            for staged in written if result.code == 0 else ():
                staged.move()
        finally:
            discard(written)
            for folder in folders if result.code != 0 else ():
                temporary.sweep(folder, result.pid)
        return replace(result, answer=answer, descriptors=())

    return fork.run_in_fork(work_with_files, forwarded, finish)


def discard(written: list[Staged]) -> None:
    """Remove what was written so far."""
    while written:
        written.pop().discard()

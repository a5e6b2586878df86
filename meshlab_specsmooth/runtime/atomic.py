"""Write files atomically: into a temporary folder beside the target, then move them into place."""

from __future__ import annotations

import contextlib
import filecmp
import os
import stat
from collections.abc import Iterator
from contextvars import ContextVar
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

from meshlab_specsmooth.errors import FileError
from meshlab_specsmooth.runtime import temporary
from meshlab_specsmooth.runtime.interrupts import DeferInterrupts


@dataclass(frozen=True)
class Staged:
    """A file in a temporary folder beside its target, together with its companions.

    Attributes
    ----------
    temporary : Temporary
        The folder.
    target : Path
        Where the file is to be moved.
    """

    temporary: temporary.Temporary
    target: Path

    @property
    def part(self) -> Path:
        """Path of the file in the temporary folder."""
        return self.temporary.content / self.target.name

    def move(self) -> None:
        """Move all files into place, the file itself last, so that it never refers to missing companions.

        Replaced files keep their permissions. Raises :class:`FileError`.
        """
        with file_errors(self.target, "written"), DeferInterrupts():
            for companion in self.new_companions():
                place = self.target.parent / companion.relative_to(self.temporary.content)
                place.parent.mkdir(parents=True, exist_ok=True)
                _move(companion, place)
            _move(self.part, self.target)

    def new_companions(self) -> list[Path]:
        """List the companions that the target's folder lacks; raises :class:`FileError` if one would replace a file."""
        content = self.temporary.content
        new = []
        for companion in sorted(file for file in content.rglob("*") if file.is_file() and file != self.part):
            name = companion.relative_to(content)
            place = self.target.parent / name
            if companion.name == f"{self.target.name}.mtl" and not place.is_dir():
                new.append(companion)
            elif is_linked(self.target.parent, name.as_posix()):
                raise FileError(f"{place}: is a symbolic link, which is not followed; write to another folder")
            elif not place.exists():
                new.append(companion)
            elif not has_content(place, companion):
                raise name_conflict(place, self.target)
        return new

    def discard(self) -> None:
        """Remove the temporary folder."""
        self.temporary.remove()


_POSTPONED: ContextVar[list[Staged] | None] = ContextVar("_POSTPONED", default=None)


@contextlib.contextmanager
def postponed() -> Iterator[list[Staged]]:
    """Leave written files in their temporary folders, and list them for the caller to move.

    If an exception ends the block, they are removed.
    """
    written: list[Staged] = []
    token = _POSTPONED.set(written)
    try:
        yield written
    except BaseException:
        for staged in written:
            staged.discard()
        raise
    finally:
        _POSTPONED.reset(token)


@contextlib.contextmanager
def atomic_write(path: str | os.PathLike[str]) -> Iterator[Path]:
    """Yield a path in a temporary folder beside the target, and move all files in it into place at the end.

    Companions are moved first and the file itself last. A companion that would replace a file of different content is
    an error, and nothing is moved; only the materials of an OBJ file (the target's name with ``.mtl``) are replaced.
    An interrupt (Ctrl-C) waits until the file is written, and then nothing is moved; or until everything is moved.

    Raises
    ------
    FileError
        See :func:`check_place`; or the operating system, or the writer of the format, refuses.
    """
    target = check_place(path)
    with file_errors(target, "written"), DeferInterrupts() as hold:
        staged = Staged(temporary.create(target.parent), target)
        waiting = _POSTPONED.get()
        is_kept = False
        try:
            yield staged.part
            hold.deliver()
            if waiting is None:
                staged.move()
            else:
                staged.new_companions()
                waiting.append(staged)
                is_kept = True
        finally:
            if not is_kept:
                staged.discard()


def write_text(path: str | os.PathLike[str], text: str) -> None:
    """Write a UTF-8 text file atomically; raises :class:`FileError`."""
    with atomic_write(path) as part:
        part.write_text(text, encoding="utf-8")


def check_place(path: str | os.PathLike[str]) -> Path:
    """Check that a file can be written at a path, before any work is done for it.

    Returns
    -------
    Path
        The file that will be written, with symbolic links resolved.

    Raises
    ------
    FileError
        The path is a folder, a pipe or a device, or its parent folder is missing or not writable.
    """
    with file_errors(Path(path), "written"):
        target = Path(os.path.realpath(path))
        if target.is_dir():
            raise FileError(f"{path}: is a folder")
        if target.exists() and not target.is_file():
            raise FileError(f"{path}: is not a regular file")
        if not target.parent.is_dir():
            raise FileError(f"{path}: there is no folder {target.parent}")
        if not os.access(target.parent, os.W_OK | os.X_OK):
            raise FileError(f"{path}: the folder {target.parent} is not writable")
        return target


@contextlib.contextmanager
def file_errors(path: Path, action: str, *errors: type[Exception]) -> Iterator[None]:
    """Turn errors of the operating system, of writers, and those given into a :class:`FileError` that names the file.

    Parameters
    ----------
    path : Path
    action : str
        ``"read"`` or ``"written"``.
    *errors : exception types
        In addition to OSError, MemoryError, ValueError and RuntimeError.
    """
    try:
        yield
    except FileError:
        raise
    except OSError as error:
        raise FileError(f"{path}: cannot be {action}: {error.strerror or error}") from error
    except MemoryError as error:
        raise FileError(f"{path}: cannot be {action}: memory ran out") from error
    except (ValueError, RuntimeError) + errors as error:  # noqa: RUF005 (mypy)
        raise FileError(f"{path}: cannot be {action}: {' '.join(str(error).split())}") from error


def is_linked(folder: Path, name: str) -> bool:
    """Whether any part of a relative path below a folder is a symbolic link."""
    path = folder
    for part in PurePosixPath(name).parts:
        path /= part
        if path.is_symlink():
            return True
    return False


def has_content(path: Path, content: Path | bytes) -> bool:
    """Whether a file exists and is equal to another file, or to bytes."""
    if isinstance(content, bytes):
        return path.is_file() and path.read_bytes() == content
    return path.is_file() and filecmp.cmp(content, path, shallow=False)


def name_conflict(place: Path, target: Path) -> FileError:
    """Return the error for a companion of the target that would replace another file."""
    return FileError(f"{place}: exists with other content, and {target.name} needs this name; write to another folder")


def _move(part: Path, place: Path) -> None:
    with contextlib.suppress(FileNotFoundError):
        part.chmod(stat.S_IMODE(place.stat().st_mode) & 0o777)
    part.replace(place)

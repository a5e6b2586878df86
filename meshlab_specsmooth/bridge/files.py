"""Mesh files, read and written by pymeshlab; an output is written whole or not at all."""

from __future__ import annotations

import contextlib
import os
import tempfile
from collections.abc import Iterator
from pathlib import Path

import pymeshlab

from meshlab_specsmooth.errors import FileError


def read(path: str | os.PathLike[str]) -> pymeshlab.MeshSet:
    """A new MeshSet with the mesh of a file, in any format that pymeshlab reads.

    Raises
    ------
    FileError
        There is no such file, or pymeshlab cannot read it.
    """
    if not Path(path).is_file():
        raise FileError(f"{path}: no such file")
    ms = pymeshlab.MeshSet()
    try:
        ms.load_new_mesh(str(path))
    except pymeshlab.PyMeshLabException as error:
        raise FileError(f"{path}: cannot be read: {_one_line(error)}") from error
    return ms


def write(ms: pymeshlab.MeshSet, path: str | os.PathLike[str]) -> None:
    """Write the current mesh, in any format that pymeshlab writes.

    It is written into a temporary folder beside the target, with all that belongs to it (materials, textures), and
    moved from there, the mesh last: the target is the old file or the whole new one, never a part.

    Raises
    ------
    FileError
        The folder is missing or not writable, or pymeshlab cannot write the format.
    """
    with _replacing(path) as part:
        try:
            ms.save_current_mesh(str(part))
        except pymeshlab.PyMeshLabException as error:
            raise FileError(f"{path}: cannot be written: {_one_line(error)}") from error


def write_text(path: str | os.PathLike[str], text: str) -> None:
    """Write a text file whole or not at all; raises :class:`FileError`."""
    with _replacing(path) as part:
        part.write_text(text, encoding="utf-8")


@contextlib.contextmanager
def _replacing(path: str | os.PathLike[str]) -> Iterator[Path]:
    """A file of that name in a temporary folder beside the target, moved there in the end, companions first."""
    target = check_target(path)
    try:
        with tempfile.TemporaryDirectory(prefix=".specsmooth-", dir=target.parent) as folder:
            part = Path(folder) / target.name
            yield part
            companions = [file for file in Path(folder).iterdir() if file != part]
            for file in [*companions, part]:
                file.replace(target.parent / file.name)
    except OSError as error:
        if isinstance(error, FileError):
            raise
        raise FileError(f"{target}: cannot be written: {error.strerror}") from error


def check_target(path: str | os.PathLike[str]) -> Path:
    """Refuse a path that cannot be written to, before any work is done for it; raises :class:`FileError`."""
    target = Path(path)
    if target.is_dir():
        raise FileError(f"{target}: is a folder")
    if not target.parent.is_dir():
        raise FileError(f"{target}: there is no folder {target.parent}")
    return target


def sample(name: str) -> Path:
    """A mesh that comes inside the pymeshlab wheel: ``"bunny.obj"`` is the Stanford bunny, closed, 28088 vertices.

    Raises
    ------
    FileError
        This pymeshlab has no such mesh.
    """
    path = Path(pymeshlab.__file__).parent / "tests" / "sample_meshes" / name
    if not path.is_file():
        raise FileError(f"{path}: not in pymeshlab {_version()}; reinstall pymeshlab from its wheel")
    return path


def _version() -> str:
    from importlib.metadata import version

    return version("pymeshlab")


def _one_line(error: BaseException) -> str:
    return " ".join(str(error).split())

"""Folders that are created where they are missing."""

from __future__ import annotations

from pathlib import Path

from meshlab_specsmooth.errors import FileError


def ensure_folder(path: Path) -> None:
    """Create a folder and its parents where they are missing; raises :class:`FileError` if that is not possible."""
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise FileError(f"{path}: cannot be created: {error.strerror}") from error

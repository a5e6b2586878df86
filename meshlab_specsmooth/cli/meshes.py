"""Meshes of the command line: read, with all that is to be said before the work, and written."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from meshlab_specsmooth.cli.progress import notice
from meshlab_specsmooth.errors import InvalidParameter
from meshlab_specsmooth.meshlab import losses, mesh_files, meshset, precision


def read_to_write(arguments: argparse.Namespace, moves: bool = False) -> Any:
    """The MeshSet of the input; what is wrong with the input or would be with the output is said, or refused.

    Parameters
    ----------
    arguments : Namespace
    moves : bool
        The mesh may be moved elsewhere, where its coordinates have other digits: those are checked at the end.

    Raises
    ------
    InvalidParameter
        The output is the input, and ``--overwrite`` is not given.
    FileError
        It cannot be read; a texture would replace another file; or coordinates are rounded too far.
    """
    if not arguments.overwrite and Path(arguments.input).resolve() == Path(arguments.output).resolve():
        raise InvalidParameter(f"{arguments.output} is the input and the output; --overwrite replaces it")
    ms = mesh_files.read(arguments.input)
    mesh_files.check_textures(ms, arguments.output, arguments.input)
    lost = losses.find_losses(arguments.input)
    if lost is not None:
        notice(lost)
    _check_rounding(ms, arguments, None if moves else arguments.output)
    return ms


def write(ms: Any, arguments: argparse.Namespace, moved: bool = False) -> None:
    """Write the output, and say what is missing; raises :class:`FileError`."""
    if moved:
        _check_rounding(ms, arguments, arguments.output)
    for line in mesh_files.write(ms, arguments.output, source=arguments.input).notices:
        notice(line)


def say_rounding(ms: Any, source: str) -> None:
    """Say how far the coordinates of an input were rounded already, where it is far."""
    for line in precision.check_rounding(*meshset.get_arrays(ms), source, None, force=True):
        notice(line)


def _check_rounding(ms: Any, arguments: argparse.Namespace, target: str | None) -> None:
    for line in precision.check_rounding(*meshset.get_arrays(ms), arguments.input, target, arguments.force):
        notice(line)

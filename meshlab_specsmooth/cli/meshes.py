"""Read and write the meshes of a command, and print notices about them."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from meshlab_specsmooth.cli.progress import notice
from meshlab_specsmooth.errors import InvalidParameter
from meshlab_specsmooth.meshlab import losses, mesh_files, meshset, precision


def read_to_write(arguments: argparse.Namespace, moves: bool = False) -> Any:
    """Read the input into a MeshSet; print notices about data and digits that will be lost.

    Parameters
    ----------
    arguments : Namespace
    moves : bool
        Whether the mesh may be moved far, so that the rounding of the output is only checked by :func:`write`.

    Returns
    -------
    pymeshlab.MeshSet

    Raises
    ------
    InvalidParameter
        The output is the input, and ``--overwrite`` is not given.
    FileError
        The input cannot be read, a texture would replace another file, or coordinates are rounded too much.
    """
    if not arguments.overwrite and Path(arguments.input).resolve() == Path(arguments.output).resolve():
        raise InvalidParameter(f"{arguments.output} is both input and output; --overwrite replaces it")
    ms = mesh_files.read(arguments.input)
    mesh_files.check_textures(ms, arguments.output, arguments.input)
    lost = losses.find_losses(arguments.input)
    if lost is not None:
        notice(lost)
    _check_rounding(ms, arguments, None if moves else arguments.output)
    return ms


def write(ms: Any, arguments: argparse.Namespace, moved: bool = False) -> None:
    """Write the output, and print notices about it; raises :class:`FileError`."""
    if moved:
        _check_rounding(ms, arguments, arguments.output)
    for line in mesh_files.write(ms, arguments.output, source=arguments.input).notices:
        notice(line)


def report_rounding(ms: Any, source: str) -> None:
    """Print a notice if the coordinates of an input were rounded considerably."""
    for line in precision.check_rounding(*meshset.get_arrays(ms), source, None, force=True):
        notice(line)


def _check_rounding(ms: Any, arguments: argparse.Namespace, target: str | None) -> None:
    for line in precision.check_rounding(*meshset.get_arrays(ms), arguments.input, target, arguments.force):
        notice(line)

"""Options and runs of a mesh file that is larger than memory: ``--pieces``."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from typing import Any

from meshlab_specsmooth.cli.options import given_parameters
from meshlab_specsmooth.cli.progress import bar
from meshlab_specsmooth.errors import InvalidParameter
from meshlab_specsmooth.meshlab.descriptors import Descriptor, Length
from meshlab_specsmooth.pieces.result import PiecesResult


def add_pieces(parser: argparse.ArgumentParser) -> None:
    """Add the group of options."""
    group = parser.add_argument_group("a mesh that is larger than memory (binary PLY or STL, a folder of tiles)")
    group.add_argument("--pieces", action="store_true", help="in pieces, with the result of the whole")
    group.add_argument("--memory", metavar="BYTES", help="limit of memory, such as 4G (default: half of what is free)")
    group.add_argument("--local", action="store_true", help="treat the noise by region where it varies")
    group.add_argument("--workers", type=int, default=1, metavar="N", help="processes on this machine (default: 1)")
    group.add_argument("--scheduler", metavar="ADDRESS", help="Dask scheduler, such as tcp://host:8786")
    group.add_argument("--no-resume", action="store_true", help="do pieces again that an earlier run has finished")


def run_pieces(
    arguments: argparse.Namespace,
    descriptor: Descriptor,
    allowed: Sequence[str],
    apply: Callable[..., PiecesResult],
) -> None:
    """Filter a file in pieces, and print the result.

    Parameters
    ----------
    arguments : Namespace
    descriptor : Descriptor
        Of the filter for meshes in memory.
    allowed : sequence of str
        Its parameters that pieces have.
    apply : callable
        :func:`meshlab_specsmooth.smooth_pieces` or :func:`meshlab_specsmooth.denoise_pieces`.

    Raises
    ------
    InvalidParameter
        Another parameter is given.
    """
    given = given_parameters(arguments, descriptor)
    other = next((name for name in given if name not in allowed), None)
    if other is not None:
        raise InvalidParameter(f"--{other.replace('_', '-')} is not for --pieces")
    with bar("looking at the file") as progress:
        result = apply(
            arguments.input,
            arguments.output,
            memory_limit=arguments.memory,
            local=arguments.local,
            workers=arguments.workers,
            scheduler=arguments.scheduler,
            resume=not arguments.no_resume,
            progress=progress,
            **{name: _as_argument(name, value) for name, value in given.items()},
        )
    print(f"{arguments.output}: {result}")


def _as_argument(name: str, value: Any) -> Any:
    """A percentage as the function takes it."""
    if not isinstance(value, Length):
        return value
    if name != "max_displacement":
        raise InvalidParameter(f"--{name} in percent is not for --pieces; give a length")
    return f"{100 * value.fraction:g}%"

"""``specsmooth smooth IN OUT``."""

from __future__ import annotations

import argparse
import textwrap
from typing import Any

from meshlab_specsmooth.cli.filtering import apply_and_write, print_report, read_input
from meshlab_specsmooth.cli.options import add_files, add_options, given_parameters
from meshlab_specsmooth.cli.progress import bar
from meshlab_specsmooth.describe import count_of
from meshlab_specsmooth.errors import InvalidParameter
from meshlab_specsmooth.meshlab import descriptors
from meshlab_specsmooth.meshlab.descriptors import Length
from meshlab_specsmooth.pieces.api import smooth_pieces
from meshlab_specsmooth.spectral.response import name_of

_DESCRIPTOR = descriptors.load("apply_coord_spectral_smoothing")

SUMMARY = "smooth a mesh file"
DESCRIPTION = textwrap.fill(_DESCRIPTOR.help, 100)
EXAMPLES = """examples:
  specsmooth smooth scan.ply smooth.ply
  specsmooth smooth scan.ply smooth.obj --wavelength 20% --barycenter-weight 0.3
  specsmooth smooth scan.stl smooth.ply --modes 500 --response butterworth
  specsmooth smooth huge.ply smooth.ply --pieces --memory 4G"""

# What pieces have; everything else is of a mesh in memory
_OF_PIECES = (
    "barycenter_weight",
    "boundary",
    "iterations",
    "laplacian",
    "max_displacement",
    "modes",
    "response",
    "wavelength",
    "weld",
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the subcommand."""
    add_files(parser)
    add_options(parser, _DESCRIPTOR)
    pieces = parser.add_argument_group("a mesh that is larger than memory (binary PLY)")
    pieces.add_argument("--pieces", action="store_true", help="smooth it in pieces, with the result of the whole")
    pieces.add_argument("--memory", metavar="BYTES", help="limit of memory, such as 4G (default: half of what is free)")
    pieces.add_argument("--workers", type=int, default=1, metavar="N", help="processes on this machine (default: 1)")
    pieces.add_argument("--scheduler", metavar="ADDRESS", help="Dask scheduler, such as tcp://host:8786")
    pieces.add_argument("--no-resume", action="store_true", help="do pieces again that an earlier run has finished")


def run(arguments: argparse.Namespace) -> None:
    """Read, smooth, write, and print the result."""
    if arguments.pieces:
        run_pieces(arguments)
        return
    with bar("reading") as progress:
        ms = read_input(arguments)
        report = apply_and_write(ms, arguments, _DESCRIPTOR, progress)
    equivalent = (
        f"--barycenter-weight {report['barycenter_weight']:.4g} --response {name_of(report['response'])} "
        f"--wavelength {report['wavelength']:.4g} ({count_of(round(report['modes']), 'mode')} kept), residual "
        f"{report['residual']:.0e}"
    )
    print_report(ms, arguments, report, report["mean_edge"], *([equivalent] if report["displacement"] > 0 else []))


def run_pieces(arguments: argparse.Namespace) -> None:
    """Smooth a file in pieces, and print the result."""
    given = given_parameters(arguments, _DESCRIPTOR)
    other = next((name for name in given if name not in _OF_PIECES), None)
    if other is not None:
        raise InvalidParameter(f"--{other.replace('_', '-')} is not for --pieces")
    with bar("looking at the file") as progress:
        result = smooth_pieces(
            arguments.input,
            arguments.output,
            memory_limit=arguments.memory,
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

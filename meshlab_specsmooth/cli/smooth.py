"""``specsmooth smooth IN OUT``."""

from __future__ import annotations

import argparse
import textwrap

from meshlab_specsmooth.cli.filtering import apply_and_write, print_report, read_input
from meshlab_specsmooth.cli.options import add_files, add_options
from meshlab_specsmooth.cli.pieces import add_pieces, run_pieces
from meshlab_specsmooth.cli.progress import bar
from meshlab_specsmooth.describe import count_of
from meshlab_specsmooth.meshlab import descriptors
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
    add_pieces(parser)


def run(arguments: argparse.Namespace) -> None:
    """Read, smooth, write, and print the result."""
    if arguments.pieces:
        run_pieces(arguments, _DESCRIPTOR, _OF_PIECES, smooth_pieces)
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

"""``specsmooth boundary IN OUT``."""

from __future__ import annotations

import argparse
import textwrap

from meshlab_specsmooth.cli.filtering import apply_and_write, print_report, read_input
from meshlab_specsmooth.cli.options import add_files, add_options
from meshlab_specsmooth.cli.progress import bar
from meshlab_specsmooth.meshlab import descriptors

_DESCRIPTOR = descriptors.load("apply_coord_boundary_smoothing")

SUMMARY = "smooth the boundary of a mesh file along itself"
DESCRIPTION = textwrap.fill(_DESCRIPTOR.help, 100)
EXAMPLES = """examples:
  specsmooth boundary scan.ply smooth.ply
  specsmooth boundary scan.ply smooth.ply --wavelength 5% --rings 5"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the subcommand."""
    add_files(parser)
    add_options(parser, _DESCRIPTOR)


def run(arguments: argparse.Namespace) -> None:
    """Read, smooth the boundary, write, and print the result."""
    with bar("reading") as progress:
        ms = read_input(arguments)
        report = apply_and_write(ms, arguments, _DESCRIPTOR, progress)
    print_report(ms, arguments, report, report["mean_segment"])

"""``specsmooth smooth IN OUT``."""

from __future__ import annotations

import argparse
import textwrap

from meshlab_specsmooth import descriptors
from meshlab_specsmooth.bridge import files, filters
from meshlab_specsmooth.bridge.parameters import PyMeshLabException, resolve
from meshlab_specsmooth.cli.options import add_options, given_parameters
from meshlab_specsmooth.cli.progress import bar
from meshlab_specsmooth.errors import InvalidParameter

_DESCRIPTOR = descriptors.load("apply_coord_spectral_smoothing")

SUMMARY = "smooth a mesh file"
DESCRIPTION = textwrap.fill(_DESCRIPTOR.help, 100)
EXAMPLES = """examples:
  specsmooth smooth scan.ply smooth.ply
  specsmooth smooth scan.ply smooth.obj --wavelength 2% --barycenter-weight 0.3
  specsmooth smooth scan.stl smooth.ply --modes 500 --response butterworth"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the subcommand."""
    parser.add_argument("input", metavar="IN", help="mesh to read, in any format that pymeshlab reads")
    parser.add_argument("output", metavar="OUT", help="mesh to write: whole or not at all, in the format of its ending")
    add_options(parser, _DESCRIPTOR)


def run(arguments: argparse.Namespace) -> None:
    """Read, smooth, write, and say what was done."""
    files.check_target(arguments.output)
    ms = files.read(arguments.input)
    given = given_parameters(arguments, _DESCRIPTOR)
    try:
        resolve(_DESCRIPTOR, given, ms)
    except PyMeshLabException as error:  # wrong usage; what MeshLab raises from here on is a failure
        raise InvalidParameter(str(error)) from error
    with bar("smoothing") as progress:
        report = filters.apply_coord_spectral_smoothing(ms, **given, progress=progress)
    files.write(ms, arguments.output, source=arguments.input)
    print(
        f"{arguments.output}: {ms.current_mesh().vertex_number()} vertices, kept waves longer than "
        f"{report['wavelength']:.4g} ({report['modes']:.0f} modes), moved vertices by "
        f"{report['displacement'] / report['mean_edge'] if report['mean_edge'] else 0:.3f} mean edges (RMS), "
        f"residual {report['residual']:.0e}, {report['seconds']:.2f} s"
    )

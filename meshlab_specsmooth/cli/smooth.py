"""``specsmooth smooth IN OUT``."""

from __future__ import annotations

import argparse
import textwrap

from meshlab_specsmooth.cli.meshes import read_to_write, write
from meshlab_specsmooth.cli.options import add_files, add_options, given_parameters
from meshlab_specsmooth.cli.progress import FILTERING, bar, notice
from meshlab_specsmooth.describe import count_of, format_length
from meshlab_specsmooth.geometry.surface import Surface
from meshlab_specsmooth.meshlab import descriptors, files, filters, meshset
from meshlab_specsmooth.meshlab.parameters import check_given
from meshlab_specsmooth.runtime.progress import announce, subrange
from meshlab_specsmooth.spectral.response import name_of

_DESCRIPTOR = descriptors.load("apply_coord_spectral_smoothing")

SUMMARY = "smooth a mesh file"
DESCRIPTION = textwrap.fill(_DESCRIPTOR.help, 100)
EXAMPLES = """examples:
  specsmooth smooth scan.ply smooth.ply
  specsmooth smooth scan.ply smooth.obj --wavelength 20% --barycenter-weight 0.3
  specsmooth smooth scan.stl smooth.ply --modes 500 --response butterworth"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the subcommand."""
    add_files(parser)
    add_options(parser, _DESCRIPTOR)


def run(arguments: argparse.Namespace) -> None:
    """Read, smooth, write, and say what was done."""
    files.check_target(arguments.output)
    with bar("reading") as progress:
        ms = read_to_write(arguments)
        if ms.current_mesh().face_number() == 0:
            Surface(*meshset.pull(ms))  # says what is wrong, and the remedy
        given = given_parameters(arguments, _DESCRIPTOR)
        check_given(_DESCRIPTOR, given, ms)
        with filters.quiet():
            report = filters.apply_coord_spectral_smoothing(ms, **given, progress=subrange(progress, 0.0, FILTERING))
        announce(progress, "writing")
        write(ms, arguments)
    print(
        f"{arguments.output}: {ms.current_mesh().vertex_number()} vertices, moved by "
        f"{format_length(report['displacement'], report['mean_edge'])} (RMS), {report['seconds']:.2f} s"
    )
    print(f"  {report.summary}")
    if report["displacement"] > 0:
        print(
            f"  --barycenter-weight {report['barycenter_weight']:.4g} --response {name_of(report['response'])} "
            f"--wavelength {report['wavelength']:.4g} ({count_of(round(report['modes']), 'mode')} kept), residual "
            f"{report['residual']:.0e}"
        )
    if report["warning"] is not None:
        notice(report["warning"])

"""``specsmooth denoise IN OUT``."""

from __future__ import annotations

import argparse

from meshlab_specsmooth.arrays import Floats, Integers
from meshlab_specsmooth.cli.meshes import read_to_write, write
from meshlab_specsmooth.cli.options import add_files, add_options, given_parameters
from meshlab_specsmooth.cli.progress import FILTERING, bar, notice
from meshlab_specsmooth.describe import format_length
from meshlab_specsmooth.geometry.surface import Surface
from meshlab_specsmooth.meshlab import descriptors, files, filters, meshset
from meshlab_specsmooth.meshlab.measures import self_intersecting_faces
from meshlab_specsmooth.meshlab.parameters import check_given
from meshlab_specsmooth.runtime.progress import announce, subrange

_DESCRIPTOR = descriptors.load("apply_coord_spectral_denoising")

SUMMARY = "smooth a mesh file by whatever has the least estimated error"
DESCRIPTION = """Measures the noise, tries the isotropic filter and settings of the edge-aware one, and writes the
surface of the setting that has the least estimated error; no parameter is needed, and no ground truth."""
EXAMPLES = """examples:
  specsmooth denoise scan.ply smooth.ply
  specsmooth denoise scan.ply smooth.obj --criterion normals
  specsmooth denoise tile.ply smooth.ply --boundary fixed
  specsmooth denoise part.ply smooth.ply --crease-angle 60"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the subcommand."""
    add_files(parser)
    add_options(parser, _DESCRIPTOR)


def run(arguments: argparse.Namespace) -> None:
    """Read, denoise, write, and say what was taken and why."""
    files.check_target(arguments.output)
    with bar("reading") as progress:
        ms = read_to_write(arguments)
        vertices, faces = meshset.pull(ms)
        Surface(vertices, faces)  # says what is wrong, and the remedy
        given = given_parameters(arguments, _DESCRIPTOR)
        check_given(_DESCRIPTOR, given, ms)
        with filters.quiet():
            report = filters.apply_coord_spectral_denoising(ms, **given, progress=subrange(progress, 0.0, FILTERING))
        announce(progress, "writing")
        write(ms, arguments)
        crossing, new = crossed(vertices, meshset.pull(ms)[0], faces)
    print(
        f"{arguments.output}: {len(vertices)} vertices, moved by "
        f"{format_length(report['displacement'], report['noise'].mean_edge)} (RMS), {report['seconds']:.2f} s"
    )
    print(f"  {report.summary}")
    print(f"  self-intersecting faces: {crossing} ({new} new); flipped faces: {report['flips']}")
    if report["warning"] is not None:
        notice(report["warning"])


def crossed(before: Floats, after: Floats, faces: Integers) -> tuple[int, int]:
    """How many faces run through others afterward, and how many of them did not before."""
    crossing = self_intersecting_faces(after, faces)
    if not crossing.any():
        return 0, 0  # as nearly always, and the count is slow
    return int(crossing.sum()), int((crossing & ~self_intersecting_faces(before, faces)).sum())

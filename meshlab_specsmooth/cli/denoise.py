"""``specsmooth denoise IN OUT``."""

from __future__ import annotations

import argparse

from meshlab_specsmooth.arrays import Floats, Integers
from meshlab_specsmooth.cli.filtering import apply_and_write, print_report, read_input
from meshlab_specsmooth.cli.options import add_files, add_options
from meshlab_specsmooth.cli.pieces import add_pieces, run_pieces
from meshlab_specsmooth.cli.progress import bar
from meshlab_specsmooth.meshlab import descriptors, meshset
from meshlab_specsmooth.meshlab.measures import self_intersecting_faces
from meshlab_specsmooth.pieces.api import denoise_pieces

_DESCRIPTOR = descriptors.load("apply_coord_spectral_denoising")

SUMMARY = "denoise a mesh file; the method is chosen by estimated error"
DESCRIPTION = """Estimates the noise, tries the isotropic filter and several settings of the edge-aware one, and writes
the result of least estimated error. Needs no parameter and no ground truth."""
EXAMPLES = """examples:
  specsmooth denoise scan.ply smooth.ply
  specsmooth denoise mask.stl smooth.stl --spacing 0.7 --slice-spacing 3
  specsmooth denoise tile.ply smooth.ply --boundary fixed
  specsmooth denoise part.ply smooth.ply --crease-angle 60
  specsmooth denoise huge.ply smooth.ply --pieces --memory 4G"""

# What pieces have; everything else is of a mesh in memory
_OF_PIECES = ("boundary", "weld")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the subcommand."""
    add_files(parser)
    add_options(parser, _DESCRIPTOR)
    add_pieces(parser)


def run(arguments: argparse.Namespace) -> None:
    """Read, denoise, write, and print the result and the reason for the choice."""
    if arguments.pieces:
        run_pieces(arguments, _DESCRIPTOR, _OF_PIECES, denoise_pieces)
        return
    with bar("reading") as progress:
        ms = read_input(arguments)
        before, faces = meshset.get_arrays(ms)
        report = apply_and_write(ms, arguments, _DESCRIPTOR, progress)
        intersecting, new = count_self_intersections(before, meshset.get_arrays(ms)[0], faces)
    line = f"self-intersecting faces: {intersecting} ({new} new); flipped faces: {report['flips']}"
    print_report(ms, arguments, report, report["noise"].mean_edge, line)


def count_self_intersections(before: Floats, after: Floats, faces: Integers) -> tuple[int, int]:
    """Count the self-intersecting faces of a filtered mesh.

    Parameters
    ----------
    before, after : (n, 3) float64
        Vertices before and after the filter.
    faces : (m, 3) int

    Returns
    -------
    count : int
    new : int
        Number of those that did not intersect others before.
    """
    intersecting = self_intersecting_faces(after, faces)
    if not intersecting.any():
        return 0, 0  # the usual case; saves the second measurement, which is slow
    return int(intersecting.sum()), int((intersecting & ~self_intersecting_faces(before, faces)).sum())

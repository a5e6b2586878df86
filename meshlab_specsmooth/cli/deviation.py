"""``specsmooth deviation BEFORE AFTER``."""

from __future__ import annotations

import argparse
import json
from pathlib import Path

from meshlab_specsmooth.cli.options import add_input
from meshlab_specsmooth.comparison.deviation import deviation
from meshlab_specsmooth.errors import InvalidParameter
from meshlab_specsmooth.meshlab import mesh_files, meshset
from meshlab_specsmooth.parameters import check_extent
from meshlab_specsmooth.reports.deviation_report import color_by_deviation, draw_deviation
from meshlab_specsmooth.runtime import atomic

EXCEEDED = 3

SUMMARY = "measure how far a mesh deviates from another one, and check a tolerance"
DESCRIPTION = """Measures the signed distance of each vertex of AFTER from the surface BEFORE, along its normals, and
prints the extremes, the share within the tolerance, and the worst places. Meshes with the same faces are compared
vertex by vertex; others by the exact distance to the surface. The exit code is 3 if a vertex is beyond the
tolerance."""
EXAMPLES = """examples:
  specsmooth deviation scan.ply smooth.ply
  specsmooth deviation scan.ply smooth.ply --tolerance 0.05
  specsmooth deviation scan.ply smooth.ply --tolerance 0.1% --out colored.ply --picture report.png --json report.json
  specsmooth deviation part.stl scan.ply --tolerance 0.05 || echo "out of tolerance\""""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the subcommand."""
    add_input(parser, "BEFORE")
    parser.add_argument("after", metavar="AFTER", help="mesh to measure, in any format that pymeshlab reads")
    parser.add_argument(
        "--tolerance",
        metavar="T",
        type=_tolerance,
        help="largest permitted distance, in mesh units or in percent of the diagonal of BEFORE, such as 0.1%%",
    )
    parser.add_argument("--out", metavar="MESH", help="write AFTER with the distances as colors and vertex quality")
    parser.add_argument("--picture", metavar="PNG", help="write a picture of both sides with a histogram")
    parser.add_argument("--json", metavar="FILE", help="write the numbers as JSON")


def _tolerance(text: str) -> float | str:
    try:
        return check_extent("tolerance", text if text.strip().endswith("%") else float(text))
    except (InvalidParameter, ValueError) as error:
        raise argparse.ArgumentTypeError(
            f"{text!r} is neither a positive length nor a percentage such as 0.1%"
        ) from error


def run(arguments: argparse.Namespace) -> int:
    """Measure the deviation, write the files, and print a summary; returns the exit code."""
    for path in (arguments.picture, arguments.json):
        if path is not None:
            atomic.check_place(path)
    if arguments.out is not None:
        mesh_files.check_target(arguments.out)
    before, after = mesh_files.read(arguments.input), mesh_files.read(arguments.after)
    found = deviation(meshset.get_arrays(before), meshset.get_arrays(after), tolerance=arguments.tolerance)
    if arguments.picture is not None:
        names = f"{Path(arguments.after).name} against {Path(arguments.input).name}"
        draw_deviation(arguments.picture, found, title=names)
    if arguments.json is not None:
        files = {"before": str(arguments.input), "after": str(arguments.after)}
        atomic.write_text(arguments.json, json.dumps({**files, **found.to_dict()}, indent=1, allow_nan=False) + "\n")
    if arguments.out is not None:
        color_by_deviation(after, found)
        mesh_files.write(after, arguments.out, source=arguments.after)
    print(found)
    return 0 if found.is_within else EXCEEDED

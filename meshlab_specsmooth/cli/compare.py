"""``specsmooth compare MESH --out DIR``."""

from __future__ import annotations

import argparse
import shlex
from pathlib import Path

from meshlab_specsmooth.cli.meshes import report_rounding
from meshlab_specsmooth.cli.options import add_overwrite, add_seed, noise_level
from meshlab_specsmooth.cli.progress import bar, notice
from meshlab_specsmooth.comparison.filter_specs import DEFAULT, FILTER_SPECS, select_filters
from meshlab_specsmooth.errors import InvalidParameter, MissingExtra
from meshlab_specsmooth.meshlab import mesh_files, meshset, precision
from meshlab_specsmooth.reports import export
from meshlab_specsmooth.reports.compared import compare

SUMMARY = "compare MeshLab's filters and this package's on a mesh, and recommend one"
DESCRIPTION = f"""Runs MeshLab's smoothing filters and this package's on a mesh, at their defaults and over their
strengths, estimates how far each result is from the unknown true surface, and writes a page that recommends one
(comparison.html, for any browser), a MeshLab project with one layer for each result (comparison.mlp), and the figures
(comparison.json, comparison.txt). A filter that crashes or diverges is reported in its row.

filters by short name:
  {", ".join(DEFAULT)};
  not by default: {", ".join(key for key in FILTER_SPECS if key not in DEFAULT)}"""
EXAMPLES = """examples:
  specsmooth compare scan.ply --out comparison
  specsmooth compare part.stl --noise 0.2 --out comparison
  specsmooth compare noisy.obj --ground-truth clean.obj --out comparison
  specsmooth compare scan.ply --out comparison --filters automatic "apply_coord_taubin_smoothing(lambda_=0.7)\""""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the subcommand."""
    parser.add_argument("mesh", metavar="MESH", help="mesh to read, in any format that pymeshlab reads")
    parser.add_argument("--out", metavar="DIR", required=True, help="folder for the page, the project and the figures")
    parser.add_argument("--ground-truth", metavar="MESH", help="the true surface, if it is known")
    parser.add_argument(
        "--noise",
        metavar="X",
        type=noise_level,
        help="add white noise of X mean edges to MESH, which is then the truth itself",
    )
    add_seed(parser)
    parser.add_argument(
        "--filters", metavar="FILTER", nargs="+", help="short names, filters, or calls as name(parameter=value)"
    )
    add_overwrite(parser)


def run(arguments: argparse.Namespace) -> None:
    """Read the mesh, compare the filters, print and write the result."""
    if arguments.noise is not None and arguments.ground_truth is not None:
        raise InvalidParameter("--noise and --ground-truth are both given; noise is added to a clean mesh")
    specs = select_filters(arguments.filters)
    export.check_folder(arguments.out)
    if not arguments.overwrite:
        inputs = [each for each in (arguments.mesh, arguments.ground_truth) if each is not None]
        export.check_inputs(arguments.out, inputs, [each.name for each in specs])
    ms = mesh_files.read(arguments.mesh)
    report_rounding(ms, arguments.mesh)
    precision.check_drawable(meshset.get_arrays(ms)[0], arguments.mesh)
    has_extra = True
    try:
        export.check_extra()
    except MissingExtra as error:  # the other files do not need it
        notice(f"{error}; without it there are the project and the figures")
        has_extra = False
    truth = None if arguments.ground_truth is None else mesh_files.read(arguments.ground_truth)
    with bar("comparing") as progress:
        found = compare(
            ms,
            ground_truth=truth,
            noise=arguments.noise,
            seed=arguments.seed,
            filters=specs,
            name=Path(arguments.mesh).name,
            progress=progress,
        )
    print(export.summarize(found))
    written = export.write(found, arguments.out, recipe_of(arguments), with_page=has_extra)
    print("\n".join(str(path) for path in reversed(written)))


def recipe_of(arguments: argparse.Namespace) -> str:
    """What to type to get the same export."""
    words = ["specsmooth", "compare", arguments.mesh]
    if arguments.ground_truth is not None:
        words += ["--ground-truth", arguments.ground_truth]
    if arguments.noise is not None:
        words += ["--noise", f"{arguments.noise:g}", "--seed", str(arguments.seed)]
    words += ["--out", arguments.out]
    return shlex.join([*words, *(["--filters", *arguments.filters] if arguments.filters else [])])

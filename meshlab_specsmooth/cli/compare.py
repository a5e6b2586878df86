"""``specsmooth compare MESH --out DIR``."""

from __future__ import annotations

import argparse
import shlex
from pathlib import Path

from meshlab_specsmooth.cli.demo import noise_level, seed_number
from meshlab_specsmooth.cli.meshes import say_rounding
from meshlab_specsmooth.cli.options import add_overwrite
from meshlab_specsmooth.cli.progress import bar, notice
from meshlab_specsmooth.comparison.comparison import table
from meshlab_specsmooth.comparison.competitors import COMPETITORS, DEFAULT, competitors
from meshlab_specsmooth.comparison.experiment import experiment
from meshlab_specsmooth.errors import InvalidParameter, MissingExtra
from meshlab_specsmooth.meshlab import mesh_files, meshset, precision
from meshlab_specsmooth.report import page
from meshlab_specsmooth.report.compared import surface_of, with_colors

SUMMARY = "find out which filter suits a mesh, MeshLab's and ours side by side"
DESCRIPTION = f"""Runs MeshLab's smoothing filters and this package's on a mesh, at their defaults and over their
strengths, estimates how far each result is from the unknown true surface, and writes a page that says which to take
(comparison.html, for any browser), a MeshLab project with one layer a result (comparison.mlp), and the figures
(comparison.json, comparison.txt). A filter that crashes or diverges is a row that says so.

filters by short name:
  {", ".join(DEFAULT)};
  not by default: {", ".join(key for key in COMPETITORS if key not in DEFAULT)}"""
EXAMPLES = """examples:
  specsmooth compare scan.ply --out comparison
  specsmooth compare part.stl --noise 0.2 --out comparison
  specsmooth compare noisy.obj --ground-truth clean.obj --out comparison
  specsmooth compare scan.ply --out comparison --filters automatic "apply_coord_taubin_smoothing(lambda_=0.7)\""""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the subcommand."""
    parser.add_argument("mesh", metavar="MESH", help="mesh to read, in any format that pymeshlab reads")
    parser.add_argument("--out", metavar="DIR", required=True, help="folder for the page, the project and the figures")
    parser.add_argument("--ground-truth", metavar="MESH", help="the true surface, where it is known")
    parser.add_argument(
        "--noise",
        metavar="X",
        type=noise_level,
        help="add white noise of X mean edges to MESH, which is then the truth itself",
    )
    parser.add_argument("--seed", metavar="N", type=seed_number, default=1, help="seed of the noise (default: 1)")
    parser.add_argument(
        "--filters", metavar="FILTER", nargs="+", help="short names, filters, or calls as name(parameter=value)"
    )
    add_overwrite(parser)


def run(arguments: argparse.Namespace) -> None:
    """Read, compare, write, and say what was found."""
    if arguments.noise is not None and arguments.ground_truth is not None:
        raise InvalidParameter("--noise and --ground-truth are both given; noise is added to a clean mesh")
    wanted = competitors(arguments.filters)
    page.check_folder(arguments.out)
    if not arguments.overwrite:
        inputs = [each for each in (arguments.mesh, arguments.ground_truth) if each is not None]
        page.check_inputs(arguments.out, inputs, [each.name for each in wanted])
    ms = mesh_files.read(arguments.mesh)
    say_rounding(ms, arguments.mesh)
    precision.check_drawable(meshset.get_arrays(ms)[0], arguments.mesh)
    has_extra = True
    try:
        page.check_extra()
    except MissingExtra as error:  # the figures can be made all the same
        notice(f"{error}; without it there are the project and the figures")
        has_extra = False
    given = surface_of(ms)
    truth = None if arguments.ground_truth is None else surface_of(mesh_files.read(arguments.ground_truth))
    with bar("comparing") as progress:
        found = experiment(
            given,
            truth=truth,
            added=arguments.noise,
            seed=arguments.seed,
            filters=wanted,
            name=Path(arguments.mesh).name,
            progress=progress,
        )
    found = with_colors(found, ms)
    print(f"{found.headline()}.\n{' '.join(found.reasons())}\n\n{table(found)}\n")
    written = page.write(found, arguments.out, recipe_of(arguments), with_page=has_extra)
    print("\n".join(str(path) for path in reversed(written)))


def recipe_of(arguments: argparse.Namespace) -> str:
    """What to type to get the same page."""
    words = ["specsmooth", "compare", arguments.mesh]
    if arguments.ground_truth is not None:
        words += ["--ground-truth", arguments.ground_truth]
    if arguments.noise is not None:
        words += ["--noise", f"{arguments.noise:g}", "--seed", str(arguments.seed)]
    words += ["--out", arguments.out]
    return shlex.join([*words, *(["--filters", *arguments.filters] if arguments.filters else [])])

"""``specsmooth run SCRIPT IN OUT``."""

from __future__ import annotations

import argparse

from meshlab_specsmooth.bridge import files, scripts
from meshlab_specsmooth.bridge.filters import FILTERS
from meshlab_specsmooth.cli.options import add_files

SUMMARY = "apply a filter script to a mesh file"
DESCRIPTION = """Applies a MeshLab filter script (.mlx), of MeshLab's filters, ours, or both, to a mesh file. Nothing
runs unless the whole script is understood."""
EXAMPLES = """examples:
  specsmooth run clean.mlx scan.ply clean.ply"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the subcommand."""
    parser.add_argument("script", metavar="SCRIPT", help="filter script, as MeshLab or save_filter_script writes it")
    add_files(parser)


def run(arguments: argparse.Namespace) -> None:
    """Check, read, run, write."""
    files.check_target(arguments.output)
    script = scripts.read(arguments.script)
    scripts.check(script)
    ms = files.read(arguments.input)
    scripts.run(ms, script, FILTERS)
    files.write(ms, arguments.output, source=arguments.input)
    print(f"{arguments.output}: {', '.join(step.name for step in script.steps) or 'the script has no filter'}")

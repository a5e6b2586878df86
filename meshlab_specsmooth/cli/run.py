"""``specsmooth run SCRIPT IN OUT``."""

from __future__ import annotations

import argparse

from meshlab_specsmooth.cli.meshes import read_to_write, write
from meshlab_specsmooth.cli.options import add_files
from meshlab_specsmooth.meshlab import descriptors, mesh_files, scripts
from meshlab_specsmooth.meshlab.filters import FILTERS

_OURS = frozenset(descriptors.load(name).name for name in FILTERS)

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
    mesh_files.check_target(arguments.output)
    script = scripts.read(arguments.script)
    scripts.check(script)
    # MeshLab's filters may take the mesh elsewhere; ours leave it where it is
    moves = any(step.name not in _OURS for step in script.steps)
    ms = read_to_write(arguments, moves)
    scripts.run(ms, script, FILTERS)
    write(ms, arguments, moves)
    print(f"{arguments.output}: {', '.join(step.name for step in script.steps) or 'the script has no filter'}")

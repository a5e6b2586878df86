"""``specsmooth filters [NAME]``."""

from __future__ import annotations

import argparse
import textwrap

from meshlab_specsmooth.meshlab import descriptors

SUMMARY = "list the filters, or describe one"
DESCRIPTION = "Lists the filters for MeshSets and filter scripts, or describes one with all its parameters."
EXAMPLES = """examples:
  specsmooth filters
  specsmooth filters apply_coord_spectral_smoothing"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the subcommand."""
    parser.add_argument("name", metavar="NAME", nargs="?", choices=descriptors.names(), help="filter to describe")


def run(arguments: argparse.Namespace) -> None:
    """Print the list of filters, or the description of one."""
    if arguments.name is None:
        for name in descriptors.names():
            print(f"{name:42}{descriptors.load(name).name}")
        return
    descriptor = descriptors.load(arguments.name)
    print(f"{descriptor.function}: {descriptor.name} ({descriptor.category})\n")
    print(textwrap.fill(descriptor.help, 100), "\n")
    for parameter in descriptor.parameters:
        print(f"{parameter.name} : {parameter.kind} = {parameter.shown_default}")
        print(textwrap.fill(parameter.help, 100, initial_indent="    ", subsequent_indent="    "))

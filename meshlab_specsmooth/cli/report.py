"""``specsmooth report``."""

from __future__ import annotations

import argparse
import json

from meshlab_specsmooth.installation import report

SUMMARY = "print versions, platform, extras and processors, for a report of a bug"
DESCRIPTION = """Prints what is installed: versions of this package, of Python and of all packages that it can use, the
platform and the number of processors. Nothing is sent anywhere; no name of a user, host or path is included."""
EXAMPLES = """examples:
  specsmooth report
  specsmooth report --json"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the subcommand."""
    parser.add_argument("--json", action="store_true", help="print JSON")


def run(arguments: argparse.Namespace) -> None:
    """Print the report."""
    found = report()
    print(json.dumps(found.to_dict(), indent=1) if arguments.json else found)

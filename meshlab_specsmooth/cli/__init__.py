"""The command line: one file a subcommand, each with ``add_arguments`` and ``run``; here they are only routed to."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence

from meshlab_specsmooth.bridge.parameters import PyMeshLabException
from meshlab_specsmooth.cli import demo, filters, run, smooth
from meshlab_specsmooth.errors import InvalidParameter, SpecsmoothError
from meshlab_specsmooth.version import VERSION

DONE, FAILED, USAGE = 0, 1, 2

_COMMANDS = {"smooth": smooth, "run": run, "filters": filters, "demo": demo}


def main(arguments: Sequence[str] | None = None) -> int:
    """Run ``specsmooth`` with these arguments (those of the process by default); returns the exit code."""
    parser = argparse.ArgumentParser(
        prog="specsmooth",
        description="Spectral mesh smoothing with barycentre constraints, for meshes of any format that MeshLab reads.",
        epilog="exit codes: 0 done, 1 failed, 2 wrong usage",
    )
    parser.add_argument("--version", action="version", version=f"specsmooth {VERSION}")
    subparsers = parser.add_subparsers(metavar="COMMAND", required=True)
    for name, command in _COMMANDS.items():
        subparser = subparsers.add_parser(
            name,
            help=command.SUMMARY,
            description=command.DESCRIPTION,
            epilog=command.EXAMPLES,
            formatter_class=argparse.RawDescriptionHelpFormatter,
        )
        command.add_arguments(subparser)
        subparser.set_defaults(run=command.run)
    given = parser.parse_args(arguments)
    try:
        given.run(given)
    except (PyMeshLabException, InvalidParameter) as error:
        return _complain(error, USAGE)
    except SpecsmoothError as error:
        return _complain(error, FAILED)
    except KeyboardInterrupt:
        print("specsmooth: interrupted; nothing was written", file=sys.stderr)
        return FAILED
    return DONE


def _complain(error: Exception, code: int) -> int:
    print("specsmooth:", " ".join(str(error).split()), file=sys.stderr)
    return code

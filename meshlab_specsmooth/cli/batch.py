"""``specsmooth batch INPUTS... --out DIR``."""

from __future__ import annotations

import argparse

from meshlab_specsmooth.batching.many import FILTER, TIME_LIMIT, batch
from meshlab_specsmooth.batching.record import Outcome
from meshlab_specsmooth.cli.options import add_force, add_options, given_parameters
from meshlab_specsmooth.cli.progress import bar, printable, say
from meshlab_specsmooth.errors import SpecsmoothError
from meshlab_specsmooth.meshlab import descriptors

_DESCRIPTOR = descriptors.load(FILTER)
_DENOISING = descriptors.load("apply_coord_spectral_denoising")
_ONLY_DENOISING = {p.name for p in _DENOISING.parameters} - {p.name for p in _DESCRIPTOR.parameters}

SUMMARY = "smooth many mesh files"
DESCRIPTION = """Smooths many meshes as `specsmooth smooth` does one, on this machine or on a Dask cluster. A mesh that
crashes its process does not affect the others. Finished meshes are recorded and skipped by the next run: the same
command continues a run that was interrupted. Writes summary.json and summary.csv, and with the extra `report` contact
sheets of pictures before and after."""
EXAMPLES = """examples:
  specsmooth batch scans/ --out smooth
  specsmooth batch scans/ --out smooth --denoise
  specsmooth batch 'scans/**/*.ply' more/head.obj --out smooth --wavelength 20%
  specsmooth batch manifest.txt --out smooth --workers 4 --format ply
  specsmooth batch scans/ --out smooth --scheduler tcp://10.0.0.1:8786

exit codes: 0 all outputs are there, 1 some failed, 2 wrong usage"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the subcommand."""
    parser.add_argument(
        "inputs",
        metavar="INPUT",
        nargs="+",
        help="mesh, folder, pattern in quotation marks, or manifest (.txt: a path per line, relative to it)",
    )
    parser.add_argument(
        "--out",
        metavar="DIR",
        required=True,
        help="folder for the outputs; those of a folder keep their paths below it",
    )
    parser.add_argument(
        "--scheduler", metavar="ADDRESS", help="Dask scheduler to run on (extra `cluster`); default: this machine"
    )
    parser.add_argument(
        "--workers",
        metavar="N",
        type=int,
        help="number of processes (default: as processors and memory allow)",
    )
    parser.add_argument(
        "--time-limit",
        metavar="SECONDS",
        type=float,
        default=TIME_LIMIT,
        help=f"per mesh, after which its process is killed (default: {TIME_LIMIT:g})",
    )
    parser.add_argument(
        "--format", metavar="NAME", help="format of the outputs, e.g. ply (default: that of each input)"
    )
    parser.add_argument(
        "--resume",
        action=argparse.BooleanOptionalAction,
        default=True,
        help="skip meshes that are done with the same input, parameters and version (default: True)",
    )
    parser.add_argument(
        "--pictures",
        action=argparse.BooleanOptionalAction,
        default=True,
        help="write contact sheets, if the extra `report` is installed (default: True)",
    )
    add_force(parser)
    parser.add_argument(
        "--denoise",
        action="store_true",
        help="denoise as `specsmooth denoise` does, edge-aware or isotropic, and accept its options",
    )
    add_options(parser, _DESCRIPTOR)
    add_options(parser, _DENOISING, _ONLY_DENOISING)


def run(arguments: argparse.Namespace) -> None:
    """Smooth all meshes and print a line for each; raises an error if some have failed."""
    with bar("smoothing") as progress:
        summary = batch(
            arguments.inputs,
            arguments.out,
            filter_name=_DENOISING.function if arguments.denoise else FILTER,
            scheduler=arguments.scheduler,
            workers=arguments.workers,
            time_limit=arguments.time_limit,
            resume=arguments.resume,
            ending=None if arguments.format is None else "." + arguments.format.lstrip("."),
            pictures=arguments.pictures,
            force=arguments.force,
            progress=progress,
            each=lambda outcome: say(line(outcome)),
            **given_parameters(arguments, _DESCRIPTOR),
            **given_parameters(arguments, _DENOISING, _ONLY_DENOISING),
        )
    counts = ", ".join(f"{count} {status}" for status, count in summary.counts.items())
    print(f"{counts}, {summary.seconds:.1f} s; {arguments.out}: summary.json, summary.csv", end="")
    print(f", {len(summary.pictures)} contact sheet(s)" if summary.pictures else "")
    if not summary.is_complete:
        missing = sum(not outcome.is_there for outcome in summary.outcomes)
        raise SpecsmoothError(f"{missing} of {len(summary.outcomes)} meshes failed; see {arguments.out}/summary.csv")


def line(outcome: Outcome) -> str:
    """Describe an outcome on one line of printable characters, whatever the name of the file."""
    words = [f"{outcome.status:8}", outcome.output if outcome.is_there else f"{outcome.input}: {outcome.reason}"]
    if outcome.is_there:
        words.append(f" {outcome.vertices} vertices")
        if outcome.noise is not None:
            words.append(f"noise {outcome.noise:.4g} in mesh units")
        if outcome.volume_change is not None:
            words.append(f"volume {100 * outcome.volume_change:+.3f} %")
        words.append(f"{outcome.seconds:.2f} s")
        if outcome.warning:
            words.append(f"({outcome.warning})")
    return printable(" ".join(words))

"""Command-line options from a filter's descriptor, and back to its keyword arguments."""

from __future__ import annotations

import argparse
import math
from collections.abc import Collection
from typing import Any

from meshlab_specsmooth.meshlab.descriptors import Descriptor, Length, Parameter


def add_files(parser: argparse.ArgumentParser) -> None:
    """The mesh that is read, and the one that is written."""
    add_input(parser, "IN")
    parser.add_argument("output", metavar="OUT", help="mesh to write: whole or not at all, in the format of its ending")
    add_force(parser)
    add_overwrite(parser)


def add_overwrite(parser: argparse.ArgumentParser) -> None:
    """Whether the output may be the input."""
    parser.add_argument("--overwrite", action="store_true", help="write also where that replaces the input")


def add_force(parser: argparse.ArgumentParser) -> None:
    """Whether coordinates may be rounded."""
    parser.add_argument(
        "--force",
        action="store_true",
        help="write also where the format of the output, or that of the input, rounds coordinates by more than a tenth "
        "of a mean edge",
    )


def add_input(parser: argparse.ArgumentParser, metavar: str) -> None:
    """The mesh that is read."""
    parser.add_argument("input", metavar=metavar, help="mesh to read, in any format that pymeshlab reads")


def add_seed(parser: argparse.ArgumentParser) -> None:
    """The seed of added noise."""
    parser.add_argument("--seed", metavar="N", type=_seed, default=1, help="seed of the noise (default: 1)")


def noise_level(text: str) -> float:
    """Parse the level of noise to add."""
    level = float(text)
    if not 0 <= level < math.inf:
        raise argparse.ArgumentTypeError(f"{text} is not a finite number from 0")
    return level


def _seed(text: str) -> int:
    seed = int(text)
    if seed < 0:
        raise argparse.ArgumentTypeError(f"{text} is less than 0")
    return seed


noise_level.__name__, _seed.__name__ = "noise", "seed"  # argparse puts them into "invalid seed value"


def add_options(parser: argparse.ArgumentParser, descriptor: Descriptor, only: Collection[str] | None = None) -> None:
    """One option a parameter, or some of them: same name, type, choices, default and help as everywhere else."""
    for parameter in _parameters(descriptor, only):
        kind: dict[str, Any] = {"choices": parameter.values} if parameter.type == "enum" else _TYPES[parameter.type]
        parser.add_argument(
            "--" + parameter.name.replace("_", "-"),
            default=parameter.default,
            help=f"{parameter.help} (default: {parameter.shown_default})".replace("%", "%%"),
            **kind,
        )


def _parameters(descriptor: Descriptor, only: Collection[str] | None) -> list[Parameter]:
    return [parameter for parameter in descriptor.parameters if only is None or parameter.name in only]


def given_parameters(
    arguments: argparse.Namespace, descriptor: Descriptor, only: Collection[str] | None = None
) -> dict[str, Any]:
    """Keyword arguments for the filter; only what differs from its defaults."""
    values = {parameter.name: getattr(arguments, parameter.name) for parameter in _parameters(descriptor, only)}
    return {name: value for name, value in values.items() if value != descriptor[name].default}


def _length(text: str) -> float | Length:
    """A plain number is in mesh units, a number with a per-cent sign a share of the bounding-box diagonal."""
    if text.endswith("%"):
        return Length(float(text[:-1]) / 100)
    return float(text)


_length.__name__ = "length"
_TYPES: dict[str, dict[str, Any]] = {
    "bool": {"action": argparse.BooleanOptionalAction},
    "int": {"type": int, "metavar": "N"},
    "float": {"type": float, "metavar": "X"},
    "length": {"type": _length, "metavar": "LENGTH|N%"},
}

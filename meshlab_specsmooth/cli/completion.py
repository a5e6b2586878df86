"""The option ``--print-completion``: completion of commands and options in a shell, by shtab."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from typing import Any

from meshlab_specsmooth.errors import MissingExtra

SHELLS = ("bash", "zsh", "tcsh")


class PrintCompletion(argparse.Action):
    """Print the script for a shell, and exit."""

    def __init__(self, option_strings: Sequence[str], dest: str, **options: Any) -> None:
        super().__init__(option_strings, argparse.SUPPRESS, choices=SHELLS, metavar="SHELL", **options)

    def __call__(
        self,
        parser: argparse.ArgumentParser,
        namespace: argparse.Namespace,
        values: Any,
        option_string: str | None = None,
    ) -> None:
        """Print the completion of the whole parser; raises :class:`MissingExtra`."""
        try:
            import shtab
        except ImportError as error:
            raise MissingExtra("completion", "completion") from error
        _complete_files(parser)
        print(shtab.complete(parser, shell=values))
        parser.exit()


def _complete_files(parser: argparse.ArgumentParser) -> None:
    """Let positional arguments without choices complete to files."""
    import shtab

    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            for each in action.choices.values():
                _complete_files(each)
        elif action.choices is None and action.nargs != 0:
            action.complete = shtab.FILE  # type: ignore[attr-defined]

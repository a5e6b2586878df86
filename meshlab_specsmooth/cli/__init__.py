"""The command line: parses the arguments and calls a subcommand, each a module with ``add_arguments`` and ``run``."""

from __future__ import annotations

import argparse
import contextlib
import io
import os
import signal
import sys
import tempfile
import threading
import warnings
from collections.abc import Iterator, Sequence
from pathlib import Path
from types import FrameType
from typing import Any

from meshlab_specsmooth.cli import (
    batch,
    boundary,
    compare,
    completion,
    demo,
    denoise,
    deviation,
    filters,
    labels,
    report,
    run,
    smooth,
    spectrum,
    tune,
)
from meshlab_specsmooth.cli.progress import notice
from meshlab_specsmooth.errors import InvalidParameter, Slow, SmoothingWarning, SpecsmoothError, suggest
from meshlab_specsmooth.isolation import fork
from meshlab_specsmooth.isolation.exit_status import describe_exit
from meshlab_specsmooth.meshlab.parameters import PyMeshLabException
from meshlab_specsmooth.runtime import temporary
from meshlab_specsmooth.version import VERSION

DONE, FAILED, USAGE = 0, 1, 2

_COMMANDS = {
    "smooth": smooth,
    "denoise": denoise,
    "boundary": boundary,
    "labels": labels,
    "compare": compare,
    "deviation": deviation,
    "batch": batch,
    "spectrum": spectrum,
    "tune": tune,
    "run": run,
    "filters": filters,
    "demo": demo,
    "report": report,
}


class Crashed(SpecsmoothError):  # noqa: N818 (named for what is wrong, as the other errors are)
    """The process that did the work was killed by a signal."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run ``specsmooth`` with these arguments (those of the process by default); returns the exit code."""
    if sys.stderr is None:  # closed (2>&-)
        sys.stderr = Path(os.devnull).open("w", encoding="utf-8")  # noqa: SIM115 (open until the process ends)
    if sys.stdout is None:  # closed (>&-): the next file opened would get its number, and everything that C++ prints
        return _report_error("standard output is closed", FAILED)
    try:
        with _exit_on_signals(), _escape_unencodable(), _warnings_as_notices():
            return _run(arguments)
    except InvalidParameter as error:
        return _report_error(error, USAGE)
    except (PyMeshLabException, SpecsmoothError) as error:
        return _report_error(error, FAILED)
    except MemoryError:
        return _report_error("memory ran out", FAILED)
    except BrokenPipeError:  # the reader of the output has closed it
        return FAILED
    except OSError as error:
        return _report_error(f"{error.filename or 'standard output'}: {error.strerror or error}", FAILED)
    except KeyboardInterrupt:
        code = _report_error("interrupted", FAILED)
        if arguments is None and _may_set_handlers():
            # everything is undone and reported; a normal exit can crash in a half-imported extension module
            sys.stderr.flush()
            os._exit(code)
        return code


@contextlib.contextmanager
def _escape_unencodable() -> Iterator[None]:
    """Escape characters, as of file names, that the encoding of standard output does not have."""
    stream = sys.stdout
    if not isinstance(stream, io.TextIOWrapper):
        yield
        return
    before = stream.errors
    stream.reconfigure(errors="backslashreplace")
    try:
        yield
    finally:
        stream.reconfigure(errors=before)


@contextlib.contextmanager
def _warnings_as_notices() -> Iterator[None]:
    """Print our warnings as notices, without the line of code that raised them."""
    with warnings.catch_warnings():
        warnings.simplefilter("default", Slow)
        warnings.simplefilter("always", SmoothingWarning)
        show = warnings.showwarning

        def print_warning(message: Warning | str, category: type[Warning], *rest: Any, **named: Any) -> None:
            if issubclass(category, (Slow, SmoothingWarning)):
                notice(message)
            else:
                show(message, category, *rest, **named)

        warnings.showwarning = print_warning
        yield


def _run(arguments: Sequence[str] | None) -> int:
    try:
        given = _parse_arguments(arguments)
        file = getattr(given, "input", getattr(given, "mesh", None))
        # the process is ours, and its file may crash it. A fork has no other threads
        if arguments is None and file is not None and fork.can_fork() and threading.active_count() == 1:
            return _run_in_fork(given, file)
        return int(given.run(given) or DONE)
    finally:
        _flush()
        if arguments is None and _may_set_handlers():  # the process ends now
            signal.signal(signal.SIGINT, signal.SIG_IGN)


def _run_in_fork(given: argparse.Namespace, file: str) -> int:
    """Run a command in a fork; what it wrote and printed appears when it has ended well."""
    places = _output_folders(given)
    for place in places:  # files of a process that was killed
        temporary.remove_stale(place)
    is_staged = not (getattr(given, "writes_at_once", False) or getattr(given, "pieces", False))

    def work(_: object) -> tuple[str, int]:
        fork.silence_native_output()
        if not is_staged:
            return "", given.run(given) or DONE
        with contextlib.redirect_stdout(io.StringIO()) as printed:
            code = given.run(given) or DONE
        return printed.getvalue(), code

    result = fork.run_in_fork(work, {signal.SIGINT, signal.SIGTERM, signal.SIGHUP}, places, is_staged)
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the process ends now
    if result.code < 0:
        raise Crashed(f"{file}: the process that read, changed or wrote it {describe_exit(result.code)}")
    if result.code != DONE:
        return result.code
    printed, code = result.answer
    print(printed, end="")
    return int(code)


def _output_folders(given: argparse.Namespace) -> list[Path]:
    """List the folders that a command writes to."""
    out = getattr(given, "out", None)
    places = [Path(tempfile.gettempdir())]
    files = [getattr(given, name, None) for name in ("output", "picture", "json")]
    places += [Path(os.path.realpath(file)).parent for file in files if file is not None]
    if out is not None:
        places.append(Path(os.path.realpath(out)))
        places.append(Path(os.path.realpath(out)).parent)
    return places


def _may_set_handlers() -> bool:
    """Whether this is the main thread, the only one that may set handlers of signals."""
    return threading.current_thread() is threading.main_thread()


def _flush() -> None:
    """Flush standard output while an error can still be reported, which is impossible at the exit of Python."""
    try:
        sys.stdout.flush()
    except OSError:
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, sys.stdout.fileno())  # or Python would try again at its exit, and fail
        os.close(nowhere)
        raise


def _parse_arguments(arguments: Sequence[str] | None) -> argparse.Namespace:
    """Parse the arguments; for unknown ones, the usage of the subcommand is printed."""
    given, unknown = _make_parser().parse_known_args(arguments)
    if unknown:
        parser: argparse.ArgumentParser = given.parser
        options = [option for action in parser._actions for option in action.option_strings]
        unknown_options = [word.partition("=")[0] for word in unknown if word.startswith("-")]
        remedies = "".join(suggest(name, options) for name in unknown_options)
        parser.error(f"unrecognized arguments: {' '.join(unknown_options or unknown)}" + (remedies and f".{remedies}"))
    return given


def _make_parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="specsmooth",
        description="Spectral mesh smoothing with barycenter constraints, for meshes of any format that MeshLab reads.",
        epilog="exit codes: 0 done, 1 failed, 2 wrong usage, 3 tolerance exceeded (deviation)",
    )
    parser.add_argument("--version", action="version", version=f"specsmooth {VERSION}")
    parser.add_argument(
        "--print-completion",
        action=completion.PrintCompletion,
        help="print a script that completes commands and options in a shell (bash, zsh, tcsh), and exit",
    )
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
        subparser.set_defaults(run=command.run, parser=subparser)
    return parser


@contextlib.contextmanager
def _exit_on_signals() -> Iterator[None]:
    """Exit by an exception at signals that end the process, so that temporary folders are removed.

    Has no effect in threads, and for signals that have another handler or are ignored (nohup).
    """
    names = [name for name in ("SIGTERM", "SIGHUP") if hasattr(signal, name)]  # Windows has no SIGHUP
    numbers = [getattr(signal, name) for name in names]
    ours = [number for number in numbers if _may_set_handlers() and signal.getsignal(number) is signal.SIG_DFL]
    for number in ours:
        signal.signal(number, _exit)
    try:
        yield
    finally:
        for number in ours:
            signal.signal(number, signal.SIG_DFL)


def _exit(number: int, frame: FrameType | None) -> None:
    raise SystemExit(128 + number)


def _report_error(problem: object, code: int) -> int:
    notice(problem)
    return code

"""The command line: one file a subcommand, each with ``add_arguments`` and ``run``; here they are only routed to."""

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

from meshlab_specsmooth.cli import batch, compare, demo, denoise, filters, run, smooth, spectrum, tune
from meshlab_specsmooth.cli.progress import notice
from meshlab_specsmooth.errors import InvalidParameter, Slow, SpecsmoothError, suggest
from meshlab_specsmooth.isolation import fork
from meshlab_specsmooth.isolation.exit_status import describe_exit
from meshlab_specsmooth.meshlab.parameters import PyMeshLabException
from meshlab_specsmooth.runtime import temporary
from meshlab_specsmooth.version import VERSION

DONE, FAILED, USAGE = 0, 1, 2

_COMMANDS = {
    "smooth": smooth,
    "denoise": denoise,
    "compare": compare,
    "batch": batch,
    "spectrum": spectrum,
    "tune": tune,
    "run": run,
    "filters": filters,
    "demo": demo,
}


class Crashed(SpecsmoothError):  # noqa: N818 (named for what is wrong, as the other errors are)
    """The process that did the work was killed by a signal."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run ``specsmooth`` with these arguments (those of the process by default); returns the exit code."""
    if sys.stderr is None:  # closed (2>&-)
        sys.stderr = Path(os.devnull).open("w", encoding="utf-8")  # noqa: SIM115 (for as long as the process)
    if sys.stdout is None:  # closed (>&-): the next file to be opened would get its number, and all that C++ prints
        return _complain("standard output is closed", FAILED)
    try:
        with _signals_end_it(), _anything_can_be_printed(), _a_warning_is_a_line():
            return _run(arguments)
    except InvalidParameter as error:
        return _complain(error, USAGE)
    except (PyMeshLabException, SpecsmoothError) as error:
        return _complain(error, FAILED)
    except MemoryError:
        return _complain("memory ran out", FAILED)
    except BrokenPipeError:  # whoever read the output has seen enough
        return FAILED
    except OSError as error:
        return _complain(f"{error.filename or 'standard output'}: {error.strerror or error}", FAILED)
    except KeyboardInterrupt:
        code = _complain("interrupted", FAILED)
        if arguments is None and _may_set_handlers():
            # all is put back and said. Compiled code whose loading was interrupted can crash when Python takes it apart
            sys.stderr.flush()
            os._exit(code)
        return code


@contextlib.contextmanager
def _anything_can_be_printed() -> Iterator[None]:
    """Letters that standard output has not, as those of a file's name may be, are spelled out."""
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
def _a_warning_is_a_line() -> Iterator[None]:
    """That something is slow is said without the line of code that noticed it."""
    with warnings.catch_warnings():
        warnings.simplefilter("default", Slow)
        show = warnings.showwarning

        def say(message: Warning | str, category: type[Warning], *rest: Any, **named: Any) -> None:
            if issubclass(category, Slow):
                notice(message)
            else:
                show(message, category, *rest, **named)

        warnings.showwarning = say
        yield


def _run(arguments: Sequence[str] | None) -> int:
    try:
        given = _parsed(arguments)
        file = getattr(given, "input", getattr(given, "mesh", None))
        # the process is ours, and its file may crash it. A fork has no other threads
        if arguments is None and file is not None and fork.can_fork() and threading.active_count() == 1:
            return _run_in_fork(given, file)
        given.run(given)
        return DONE
    finally:
        _flush()
        if arguments is None and _may_set_handlers():  # the process ends now; nothing is left to interrupt
            signal.signal(signal.SIGINT, signal.SIG_IGN)


def _run_in_fork(given: argparse.Namespace, file: str) -> int:
    """Run a command in a fork; what it wrote and printed appears when it has ended well."""
    places = _places(given)
    for place in places:  # files of a process that was killed
        temporary.remove_stale(place)
    is_staged = not getattr(given, "writes_at_once", False)

    def work(_: object) -> str:
        fork.silence_native_output()
        if not is_staged:
            given.run(given)
            return ""
        with contextlib.redirect_stdout(io.StringIO()) as printed:
            given.run(given)
        return printed.getvalue()

    result = fork.run_in_fork(work, {signal.SIGINT, signal.SIGTERM, signal.SIGHUP}, places, is_staged)
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the process ends now
    if result.code < 0:
        raise Crashed(f"{file}: the process that read, changed or wrote it {describe_exit(result.code)}")
    if result.code == DONE:
        print(result.answer, end="")
    return result.code


def _places(given: argparse.Namespace) -> list[Path]:
    """The folders that a command writes to."""
    output, out = getattr(given, "output", None), getattr(given, "out", None)
    places = [Path(tempfile.gettempdir())]
    if output is not None:
        places.append(Path(os.path.realpath(output)).parent)
    if out is not None:
        places.append(Path(os.path.realpath(out)))
        places.append(Path(os.path.realpath(out)).parent)
    return places


def _may_set_handlers() -> bool:
    """Python allows it in the main thread alone."""
    return threading.current_thread() is threading.main_thread()


def _flush() -> None:
    """Write out what was printed, while an error can still be told; at the exit of Python it no longer can."""
    try:
        sys.stdout.flush()
    except OSError:
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, sys.stdout.fileno())  # or Python tries once more, in vain
        os.close(nowhere)
        raise


def _parsed(arguments: Sequence[str] | None) -> argparse.Namespace:
    """The arguments; of what a subcommand does not know, its own usage is printed, and not that of all subcommands."""
    given, unknown = _parser().parse_known_args(arguments)
    if unknown:
        parser: argparse.ArgumentParser = given.parser
        options = [option for action in parser._actions for option in action.option_strings]
        misspelled = [word.partition("=")[0] for word in unknown if word.startswith("-")]
        remedies = "".join(suggest(name, options) for name in misspelled)
        parser.error(f"unrecognized arguments: {' '.join(misspelled or unknown)}" + (remedies and f".{remedies}"))
    return given


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="specsmooth",
        description="Spectral mesh smoothing with barycenter constraints, for meshes of any format that MeshLab reads.",
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
        subparser.set_defaults(run=command.run, parser=subparser)
    return parser


@contextlib.contextmanager
def _signals_end_it() -> Iterator[None]:
    """Let signals that end the process unwind it, so that temporary folders are removed.

    Not in a thread, and not where the process was told to do otherwise (nohup).
    """
    names = [name for name in ("SIGTERM", "SIGHUP") if hasattr(signal, name)]  # Windows has no SIGHUP
    numbers = [getattr(signal, name) for name in names]
    ours = [number for number in numbers if _may_set_handlers() and signal.getsignal(number) is signal.SIG_DFL]
    for number in ours:
        signal.signal(number, _end)
    try:
        yield
    finally:
        for number in ours:
            signal.signal(number, signal.SIG_DFL)


def _end(number: int, frame: FrameType | None) -> None:
    raise SystemExit(128 + number)


def _complain(problem: object, code: int) -> int:
    notice(problem)
    return code

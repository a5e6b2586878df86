"""Entry point of the command ``specsmooth`` and of ``python -m meshlab_specsmooth``."""

from __future__ import annotations

import os
import signal
import sys
from types import FrameType
from typing import NoReturn


def main() -> int:
    """Run the command line with the arguments of the process; returns the exit code.

    An interrupt while the command line is being imported is reported on one line, like any other error.
    """
    before = signal.getsignal(signal.SIGINT)
    is_default = before is signal.default_int_handler  # background processes ignore interrupts
    try:
        if is_default:
            signal.signal(signal.SIGINT, _exit)
        from meshlab_specsmooth.cli import main as run

        if is_default:
            signal.signal(signal.SIGINT, before)
        return run()
    except KeyboardInterrupt:
        _exit(signal.SIGINT, None)
    except MemoryError:
        return _report_error("memory ran out")
    except Exception as error:
        from meshlab_specsmooth.errors import SpecsmoothError

        if isinstance(error, SpecsmoothError):  # pymeshlab or the descriptors of the filters are missing
            return _report_error(str(error))
        if isinstance(error, ImportError):
            return _report_error(f"cannot be imported: {error}")
        raise


def _exit(number: int, frame: FrameType | None) -> NoReturn:
    """Exit at once: there is nothing to undo yet, and a normal exit can crash in a half-imported extension module."""
    os._exit(_report_error("interrupted"))


def _report_error(problem: str) -> int:
    os.write(2, f"specsmooth: {' '.join(problem.split())}\n".encode())
    return 1


if __name__ == "__main__":
    if not getattr(sys.flags, "safe_path", False):
        # -m puts the working directory first, whose files would shadow libraries; the installed command does not
        del sys.path[0]
    sys.exit(main())

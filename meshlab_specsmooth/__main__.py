"""The command ``specsmooth``: an interrupt while what it needs is imported is one line as well."""

from __future__ import annotations

import os
import signal
import sys
from types import FrameType
from typing import NoReturn


def main() -> int:
    """Run the command line with the arguments of the process; returns the exit code."""
    before = signal.getsignal(signal.SIGINT)
    is_default = before is signal.default_int_handler  # in the background interrupts are ignored, and stay so
    try:
        if is_default:
            signal.signal(signal.SIGINT, _end)
        from meshlab_specsmooth.cli import main as run

        if is_default:
            signal.signal(signal.SIGINT, before)
        return run()
    except KeyboardInterrupt:
        _end(signal.SIGINT, None)
    except MemoryError:
        return _complain("memory ran out")
    except Exception as error:
        from meshlab_specsmooth.errors import SpecsmoothError

        if isinstance(error, SpecsmoothError):  # pymeshlab or the filters' descriptions are missing
            return _complain(str(error))
        if isinstance(error, ImportError):
            return _complain(f"cannot be imported: {error}")
        raise


def _end(number: int, frame: FrameType | None) -> NoReturn:
    """Nothing is begun yet that would have to be undone, and compiled code that is half loaded can crash at the end."""
    os._exit(_complain("interrupted"))


def _complain(problem: str) -> int:
    os.write(2, f"specsmooth: {' '.join(problem.split())}\n".encode())
    return 1


if __name__ == "__main__":
    sys.exit(main())

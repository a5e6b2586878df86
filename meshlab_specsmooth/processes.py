"""How this package starts Python: never so that the working directory is looked into for modules.

The working directory is often a folder of files from strangers, and a ``json.py`` among them would be run.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from pathlib import Path


def command(function: Callable[[], object], *arguments: str) -> tuple[str, ...]:
    """What starts a Python that calls a function of this package; to be run with :func:`environment`.

    Parameters
    ----------
    function : callable
        Of a module, without arguments; it finds ``arguments`` in ``sys.argv[1:]``.
    arguments : str

    Examples
    --------
    >>> from meshlab_specsmooth import processes
    >>> processes.command(processes.environment)[2]
    'meshlab_specsmooth.processes:environment'
    """
    start = str(Path(__file__).with_name("start.py"))
    return (sys.executable, start, f"{function.__module__}:{function.__qualname__}", *arguments)


def environment() -> dict[str, str]:
    """The environment of this process, less what would have Python look for modules in the working directory.

    In PYTHONPATH that is an empty entry, as a colon too many leaves one, or a dot.

    Examples
    --------
    >>> import os
    >>> from meshlab_specsmooth import processes
    >>> processes.environment() == dict(os.environ) or "PYTHONPATH" in os.environ
    True
    """
    found = dict(os.environ)
    if "PYTHONPATH" in found:
        entries = found.pop("PYTHONPATH").split(os.pathsep)
        kept = [entry for entry in entries if os.path.normpath(entry) != os.curdir]
        if kept:
            found["PYTHONPATH"] = os.pathsep.join(kept)
    return found

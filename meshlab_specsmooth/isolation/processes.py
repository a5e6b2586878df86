"""Commands that start Python without the working directory on its path.

The working directory is often a folder of files from strangers, and a ``json.py`` in it would be run.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from pathlib import Path

from meshlab_specsmooth.errors import NoPython

# ``python -c`` puts the working directory before the standard library, so it is removed before anything is imported
# from there; -P, which does that, is new in Python 3.11. Then this package is imported from where it was found (also in
# an archive), and a function of it is called. Ctrl-C is for the process that started this one, and will end it.
_START = """
import sys
if not getattr(sys.flags, "safe_path", False):
    del sys.path[0]
import importlib.machinery, importlib.util, signal
signal.signal(signal.SIGINT, signal.SIG_IGN)
spec = importlib.machinery.PathFinder.find_spec("meshlab_specsmooth", [sys.argv.pop(1)])
sys.modules[spec.name] = package = importlib.util.module_from_spec(spec)
spec.loader.exec_module(package)
module, function = sys.argv.pop(1).split(":")
getattr(importlib.import_module(module), function)()
"""


def command(function: Callable[[], object]) -> tuple[str, ...]:
    """Return the command that calls a function of this package in a new process; to be run with :func:`environment`.

    Parameters
    ----------
    function : callable
        Defined in a module, without arguments.

    Raises
    ------
    NoPython
        The program is frozen, or Python is embedded and does not know its executable.

    Examples
    --------
    >>> from meshlab_specsmooth.isolation import processes
    >>> processes.command(processes.environment)[-1]
    'meshlab_specsmooth.isolation.processes:environment'
    """
    if getattr(sys, "frozen", False) or not sys.executable:
        raise NoPython(
            "this program has no Python that could be started for work that may crash; call smooth, denoise or a "
            "filter on a MeshSet, which start no process"
        )
    package = sys.modules[__name__.partition(".")[0]].__path__[0]
    place = str(Path(package).absolute().parent)
    return (sys.executable, "-c", _START, place, f"{function.__module__}:{function.__qualname__}")


def environment() -> dict[str, str]:
    """Return the environment variables of this process, without the working directory in PYTHONPATH.

    There it is an empty entry, as a superfluous colon leaves one, or a dot.

    Examples
    --------
    >>> import os
    >>> from meshlab_specsmooth.isolation import processes
    >>> processes.environment() == dict(os.environ) or "PYTHONPATH" in os.environ
    True
    """
    found = dict(os.environ)
    entries = found.pop("PYTHONPATH", "").split(os.pathsep)
    kept = os.pathsep.join(entry for entry in entries if os.path.normpath(entry) != os.curdir)
    return {**found, "PYTHONPATH": kept} if kept else found

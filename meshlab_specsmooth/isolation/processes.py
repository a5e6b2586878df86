"""How this package starts Python: never so that the working directory is looked into for modules.

The working directory is often a folder of files from strangers, and a ``json.py`` among them would be run.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from pathlib import Path

from meshlab_specsmooth.errors import NoPython

# ``python -c`` puts the working directory before Python's own library, and so it is taken away before anything is
# imported from there; -P, which does that, came with Python 3.11 only. Then this very package is imported, wherever it
# was found, from a folder or an archive, and a function of it called. Ctrl-C is for whoever started the process, who
# then ends it.
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


def command(function: Callable[[], object], *arguments: str) -> tuple[str, ...]:
    """What starts a Python that calls a function of this package; to be run with :func:`environment`.

    Parameters
    ----------
    function : callable
        Of a module, without arguments; it finds ``arguments`` in ``sys.argv[1:]``.
    arguments : str

    Raises
    ------
    NoPython
        In a frozen program, and where Python is embedded and does not know its executable.

    Examples
    --------
    >>> from meshlab_specsmooth.isolation import processes
    >>> processes.command(processes.environment)[-1]
    'meshlab_specsmooth.isolation.processes:environment'
    """
    if getattr(sys, "frozen", False) or not sys.executable:
        raise NoPython(
            "this program has no Python that could be started for work that may crash; call smooth, denoise or a "
            "filter on a MeshSet, which need none"
        )
    package = sys.modules[__name__.partition(".")[0]].__path__[0]
    place = str(Path(package).absolute().parent)
    return (sys.executable, "-c", _START, place, f"{function.__module__}:{function.__qualname__}", *arguments)


def environment() -> dict[str, str]:
    """The environment of this process, less what would have Python look for modules in the working directory.

    In PYTHONPATH that is an empty entry, as a colon too many leaves one, or a dot.

    Examples
    --------
    >>> import os
    >>> from meshlab_specsmooth.isolation import processes
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

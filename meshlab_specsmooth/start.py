"""What a process of this package begins with: ``python start.py MODULE:FUNCTION [ARGUMENT...]`` calls that function.

Run as a file: with ``-c`` and with ``-m`` Python puts the working directory before its own library, and ``-P``, which
does not, came with Python 3.11 only. The package is the one that this file belongs to, wherever it was found.
"""

import sys

if __name__ == "__main__":
    if not getattr(sys.flags, "safe_path", False):  # of Python 3.11 with PYTHONSAFEPATH
        del sys.path[0]  # the folder of this file, whose modules have short names
    import importlib.util
    import signal
    from pathlib import Path

    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for whoever started this process, who then ends it
    spec = importlib.util.spec_from_file_location("meshlab_specsmooth", Path(__file__).with_name("__init__.py"))
    assert spec is not None  # noqa: S101 (for the type checker)
    # known, but not run: it imports all there is, and the function's module just what it needs, in half the time
    sys.modules["meshlab_specsmooth"] = importlib.util.module_from_spec(spec)
    module, function = sys.argv.pop(1).split(":")
    getattr(importlib.import_module(module), function)()

"""MeshSets to arrays and back: the only package that imports pymeshlab."""

from __future__ import annotations

from meshlab_specsmooth.errors import MissingLibrary

# What pymeshlab loads and a system without a display often lacks
_GRAPHICS = ("libGL.so", "libOpenGL.so", "libEGL.so")


def explain(error: ImportError) -> str:
    """Why pymeshlab cannot be imported, and the remedy.

    Examples
    --------
    >>> from meshlab_specsmooth.meshlab import explain
    >>> explain(ModuleNotFoundError("No module named 'pymeshlab'", name="pymeshlab"))
    'pymeshlab is not installed: pip install pymeshlab'
    """
    reason = " ".join(str(error).split())
    if isinstance(error, ModuleNotFoundError) and error.name == "pymeshlab":
        return "pymeshlab is not installed: pip install pymeshlab"
    if any(name in reason for name in _GRAPHICS):
        remedy = "apt-get install libgl1 libopengl0 libegl1"
    elif "GLIBC" in reason:
        remedy = "this system is older than it; pip install 'pymeshlab<2025'"
    else:
        remedy = "pip install --force-reinstall pymeshlab"
    return f"pymeshlab cannot be loaded ({reason}): {remedy}"


try:
    import pymeshlab  # noqa: F401 (so that every module of this room may import it)
except ImportError as _error:
    raise MissingLibrary(explain(_error)) from _error

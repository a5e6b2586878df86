"""Meshes of other libraries: arrays from them, and meshes of the same kind with new positions.

A mesh is recognized by its attributes, so no library is imported for it. It becomes a :class:`Source`: vertices and
triangles to compute with, and functions that make a mesh of the same kind. To add a library, write a function in
``libraries.py`` that returns a :class:`Source` or None, and append it to ``_RECOGNIZERS`` in ``recognize.py``.
"""

from meshlab_specsmooth.adapters.recognize import accept_meshes, recognize
from meshlab_specsmooth.adapters.source import Mesh, Source, WithMesh

__all__ = ["Mesh", "Source", "WithMesh", "accept_meshes", "recognize"]

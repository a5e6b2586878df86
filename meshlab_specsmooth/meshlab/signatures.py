"""The filters on MeshSets and :class:`MeshSet`, by name.

Their parameters stand in ``signatures.pyi``, for type checkers and editors; it is made from the descriptors by
``scripts/make_docs.py``.
"""

from meshlab_specsmooth.meshlab.filters import *  # noqa: F403 (each filter, by its name)
from meshlab_specsmooth.meshlab.filters import FILTERS
from meshlab_specsmooth.meshlab.registry import MeshSet

__all__ = ["MeshSet", *FILTERS]

"""Meshes that are given to the functions on arrays: read from files, and copied with new positions."""

from __future__ import annotations

import os
import weakref
from typing import Any

import numpy as np
import pymeshlab

from meshlab_specsmooth.arrays import Floats
from meshlab_specsmooth.meshlab import files, meshset
from meshlab_specsmooth.runtime.interrupts import DeferInterrupts


def read(path: str | os.PathLike[str]) -> pymeshlab.MeshSet:
    """A new MeshSet with the mesh of a file; raises :class:`FileError`."""
    return files.read(path)


def duplicate(mesh: Any) -> pymeshlab.MeshSet:
    """A new MeshSet with a copy of a mesh, or of a MeshSet's current one."""
    is_set = isinstance(mesh, pymeshlab.MeshSet)
    current = mesh.current_mesh() if is_set else mesh
    is_made_alike = is_set and type(mesh).__init__ is pymeshlab.MeshSet.__init__
    ms = type(mesh)() if is_made_alike else pymeshlab.MeshSet()
    ms.add_mesh(current, current.label())
    transform = current.transform_matrix()  # which is not copied
    if not np.array_equal(transform, np.eye(4)):
        with DeferInterrupts(), meshset.keeping_script(ms):
            ms.set_matrix(transformmatrix=transform, freeze=False)
    return ms


def moved(ms: pymeshlab.MeshSet, vertices: Floats) -> pymeshlab.MeshSet:
    """The same MeshSet, with new positions of its current mesh, to the bit."""
    meshset.push(ms, vertices)
    return ms


def only_mesh(ms: pymeshlab.MeshSet) -> pymeshlab.Mesh:
    """The current mesh by itself: pymeshlab's own is gone as soon as its MeshSet is, so it keeps that."""
    mesh = ms.current_mesh()
    weakref.finalize(mesh, _let_go, ms)
    return mesh


def _let_go(ms: pymeshlab.MeshSet) -> None:
    """Nothing is left to do: whatever holds this call has held the MeshSet."""

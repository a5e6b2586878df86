"""Meshes passed to the functions on arrays: read from files, and copied with new positions."""

from __future__ import annotations

import os
import weakref
from typing import Any

import numpy as np
import pymeshlab

from meshlab_specsmooth.arrays import Floats
from meshlab_specsmooth.meshlab import mesh_files, meshset
from meshlab_specsmooth.meshlab.filter_script import preserve_script
from meshlab_specsmooth.runtime.interrupts import DeferInterrupts


def read(path: str | os.PathLike[str]) -> pymeshlab.MeshSet:
    """Read a mesh file into a new MeshSet; raises :class:`FileError`."""
    return mesh_files.read(path)


def duplicate(mesh: Any) -> pymeshlab.MeshSet:
    """Copy a mesh, or the current mesh of a MeshSet, into a new MeshSet."""
    is_set = isinstance(mesh, pymeshlab.MeshSet)
    current = mesh.current_mesh() if is_set else mesh
    has_default_init = is_set and type(mesh).__init__ is pymeshlab.MeshSet.__init__
    ms = type(mesh)() if has_default_init else pymeshlab.MeshSet()
    ms.add_mesh(current, current.label())
    transform = current.transform_matrix()  # not copied by add_mesh
    if not np.array_equal(transform, np.eye(4)):
        with DeferInterrupts(), preserve_script(ms):
            ms.set_matrix(transformmatrix=transform, freeze=False)
    return ms


def move(ms: pymeshlab.MeshSet, vertices: Floats) -> pymeshlab.MeshSet:
    """Set the vertices of the current mesh exactly, and return the MeshSet."""
    meshset.set_vertices(ms, vertices)
    return ms


def only_mesh(ms: pymeshlab.MeshSet) -> pymeshlab.Mesh:
    """Return the current mesh, which keeps the MeshSet alive: without it pymeshlab deletes the mesh."""
    mesh = ms.current_mesh()
    weakref.finalize(mesh, _release, ms)
    return mesh


def _release(ms: pymeshlab.MeshSet) -> None:
    """Do nothing; the reference to the MeshSet held by this callback is its only purpose."""

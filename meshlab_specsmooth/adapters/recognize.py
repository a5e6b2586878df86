"""Recognize a mesh of any kind, and decorate functions that accept one."""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable
from typing import Any, ParamSpec, TypeVar

import numpy as np

from meshlab_specsmooth.adapters import libraries
from meshlab_specsmooth.adapters.source import Mesh, Source, from_arrays, has_attributes
from meshlab_specsmooth.errors import InvalidParameter, InvalidSurface, NotAMesh, suggest
from meshlab_specsmooth.parameters import show
from meshlab_specsmooth.runtime.warned import warn_once

P = ParamSpec("P")
R = TypeVar("R")

_ACCEPTED = (
    "pass vertices and faces, a tuple (vertices, faces, ...), a mesh of pymeshlab, trimesh, PyVista, Open3D, meshio or "
    "vedo, or the path of a file"
)

# In this order; each returns a Source or None
_RECOGNIZERS: tuple[Callable[[Mesh], Source | None], ...] = (
    libraries.recognize_tuple,
    libraries.recognize_path,
    libraries.recognize_meshset,
    libraries.recognize_pymeshlab,
    libraries.recognize_open3d_tensor,
    libraries.recognize_open3d,
    libraries.recognize_pyvista,
    libraries.recognize_vedo,
    libraries.recognize_meshio,
    libraries.recognize_object,
)


def accept_meshes(function: Callable[P, R]) -> Callable[P, R]:
    """Let callers pass ``mesh`` as ``vertices``, suggest corrections of keywords, and issue the result's warning."""
    known = [*inspect.signature(function).parameters, "vertices"]
    run = warn_once(function)

    @functools.wraps(function)
    def call(*args: P.args, **kwargs: P.kwargs) -> R:
        for name in kwargs:
            if name not in known:
                raise TypeError(f"{function.__name__}() has no parameter {name}.{suggest(name, known)}")
        if "vertices" in kwargs and "mesh" not in kwargs:
            kwargs["mesh"] = kwargs.pop("vertices")
        return run(*args, **kwargs)

    return call


def recognize(mesh: Mesh, faces: Any = None, name: str = "mesh") -> Source:
    """Recognize a mesh of any kind, and return its vertices and triangles.

    Parameters
    ----------
    mesh : array_like or mesh
        (n, 3) vertices if ``faces`` are given. Otherwise a pymeshlab ``MeshSet`` (its current mesh) or ``Mesh``; a
        mesh of trimesh, PyVista (``PolyData``), Open3D (``TriangleMesh``, legacy or tensor), meshio or vedo, or any
        object with ``vertices`` and ``faces``; a tuple of vertices, faces and more, as of
        ``skimage.measure.marching_cubes`` and igl's readers; or the path of a file.
    faces : array_like, optional
        (m, 3) triangles, (m, k) polygons, rows of different lengths, or PyVista's padded ``[k, a, b, c, ..., k, ...]``.
        Quads are split along the shorter diagonal, larger polygons into fans.
    name : str
        Name of the parameter, for the error message.

    Raises
    ------
    NotAMesh
        The object is not a mesh. An :class:`InvalidSurface` as well as an :class:`InvalidParameter`.
    InvalidSurface
        The mesh has no faces, or its cells are not polygons. Arrays are only checked by :meth:`Source.surface`.
    FileError
        The file cannot be read.

    Examples
    --------
    >>> from meshlab_specsmooth.adapters import recognize
    >>> square = recognize([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 2, 0]], [[0, 1, 2, 3]])
    >>> square.faces.tolist(), square.polygons.tolist()
    ([[0, 1, 2], [0, 2, 3]], [0, 0])
    >>> recognize(5)
    Traceback (most recent call last):
    ...
    meshlab_specsmooth.errors.NotAMesh: mesh is 5; pass vertices and faces, a tuple (vertices, faces, ...), ...
    """
    if isinstance(mesh, np.ndarray) and faces is not None:
        return from_arrays(mesh, faces)
    for each in _RECOGNIZERS:
        found = each(mesh)
        if found is not None and faces is not None:
            raise InvalidParameter("faces are given besides a mesh with faces; pass vertices and faces, or a mesh")
        if found is not None:
            return found
    if faces is not None:
        return from_arrays(mesh, faces)
    if isinstance(mesh, np.ndarray | list | tuple):
        raise InvalidSurface("faces", "are missing", _ACCEPTED)
    raise NotAMesh(name, f"is {show(mesh)}{_why_not(mesh)}", _ACCEPTED)


def _why_not(mesh: Mesh) -> str:
    """Explain why an object that resembles a mesh is not accepted."""
    if has_attributes(mesh, "extract_surface") or has_attributes(mesh, "points", "cells"):
        return ", which has cells instead of faces (extract its surface first)"
    if has_attributes(mesh, "geometry", "graph"):
        return ", a scene (pass one of its meshes)"
    if has_attributes(mesh, "vertices") or has_attributes(mesh, "points"):
        return ", which has no faces (reconstruct a surface from the points first)"
    return ""

"""Labels of faces: given as arrays, or by the name of a face property of a mesh."""

from __future__ import annotations

import os
from typing import Any

import numpy as np
import numpy.typing as npt

from meshlab_specsmooth.adapters.source import Mesh, has_attributes
from meshlab_specsmooth.errors import FileError, InvalidParameter, MissingExtra, suggest
from meshlab_specsmooth.parameters import show

_COLUMNS = (1, 2)


def find_labels(mesh: Mesh, labels: Any, count: int) -> npt.NDArray[np.int64]:
    """Return the labels of the faces of a mesh, one or two of each.

    Parameters
    ----------
    mesh : mesh
        As given by the user.
    labels : (count,) or (count, 2) array_like of int, or str
        The name of a face property: of a PLY file (extra ``labels``), of ``cell_data`` of PyVista and meshio, of
        ``face_attributes`` of trimesh, or of a custom attribute of pymeshlab.
    count : int
        Number of faces.

    Returns
    -------
    (count, 1) or (count, 2) int64

    Raises
    ------
    InvalidParameter
        There is no such property, or the values are not one or two integers for each face.
    """
    given = _read_property(mesh, labels) if isinstance(labels, str) else labels
    try:
        array = np.asarray(given)
    except ValueError as error:
        raise InvalidParameter(f"labels is not an array of integers ({error})") from error
    if array.ndim == 1:
        array = array[:, None]
    if array.ndim != len(_COLUMNS) or len(array) != count or array.shape[1] not in _COLUMNS:
        raise InvalidParameter(
            f"labels has shape {np.shape(given)}; pass one label or two for each of the {count} faces"
        )
    if array.dtype.kind == "f" and np.isfinite(array).all() and (array == np.floor(array)).all():
        array = array.astype(np.int64)  # as pymeshlab stores them
    if array.dtype.kind not in "biu":
        raise InvalidParameter(f"labels has dtype {array.dtype}; pass integers")
    return array.astype(np.int64)


def _read_property(mesh: Mesh, name: str) -> Any:
    """Read the face property of this name."""
    if isinstance(mesh, str | os.PathLike):
        return _read_ply(mesh, name)
    if has_attributes(mesh, "current_mesh", "mesh_number"):
        mesh = mesh.current_mesh()
    if has_attributes(mesh, "face_custom_scalar_attribute_array"):
        return mesh.face_custom_scalar_attribute_array(name)
    found = next((getattr(mesh, each) for each in ("cell_data", "face_attributes") if hasattr(mesh, each)), None)
    if found is None:
        raise InvalidParameter(f"labels is {show(name)}, but the mesh has no named face data; pass an array")
    names = list(found.keys())
    if name not in names:
        raise InvalidParameter(
            f"labels is {show(name)}; the mesh has {', '.join(names) or 'none'}.{suggest(name, names)}"
        )
    values = found[name]
    return np.concatenate(values) if isinstance(values, list) else values


def _read_ply(path: str | os.PathLike[str], name: str) -> Any:
    try:
        from plyfile import PlyData, PlyParseError
    except ImportError as error:
        raise MissingExtra("a face property of a file", "labels") from error
    try:
        read = PlyData.read(path)
    except (OSError, PlyParseError) as error:
        raise FileError(f"{path}: no labels can be read: {error}; pass an array, or a PLY file") from error
    elements = {element.name: element for element in read.elements}
    names = [each.name for each in elements["face"].properties] if "face" in elements else []
    if name not in names:
        raise InvalidParameter(f"labels is {show(name)}; the faces of {path} have {', '.join(names) or 'no property'}")
    return elements["face"][name]

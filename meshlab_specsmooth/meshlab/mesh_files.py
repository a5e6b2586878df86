"""Read and write mesh files by pymeshlab; outputs are written atomically."""

from __future__ import annotations

import os
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pymeshlab

from meshlab_specsmooth.errors import FileError
from meshlab_specsmooth.meshlab import gltf, headers
from meshlab_specsmooth.meshlab.images import STAND_IN
from meshlab_specsmooth.meshlab.texture_copies import copy_with_renamed_textures
from meshlab_specsmooth.meshlab.texture_output import PLACEHOLDER_NAME, check_conflicts, copy_textures, plan_textures
from meshlab_specsmooth.meshlab.textures import Texture, textures_of
from meshlab_specsmooth.runtime import memory, temporary
from meshlab_specsmooth.runtime.atomic import atomic_write, check_place, file_errors
from meshlab_specsmooth.runtime.interrupts import DeferInterrupts

# Bytes that must be free after a mesh is written: more than the buffer of any writer
_MIN_FREE = 2**16
# Formats with polygons: pymeshlab assembles them from triangles, and if more than two triangles meet at an edge inside
# a polygon, it walks around it without end and stores each step. The limit exceeds the needs of any valid mesh.
_POLYGONAL = {".obj", ".off"}
_WALK_BYTES, _WALK_BYTES_PER_ELEMENT = 2**28, 2**10
# Parameters of writers: by default CTM is rounded to a grid whose step is unrelated to the mesh
_PARAMETERS = {".ctm": {"lossless": True}}


def read(path: str | os.PathLike[str], prefix: str = "") -> pymeshlab.MeshSet:
    """Read a mesh file, in any format that pymeshlab reads, into a new MeshSet.

    Textures that pymeshlab cannot read (JPEG, or a missing file) keep their names, but have no image; pass the path of
    the mesh to :func:`write` as ``source``, and they are copied from there. Characters that end a texture's name for
    pymeshlab, such as blanks, become ``_``.

    Parameters
    ----------
    path : path
    prefix : str
        Prefix of the names of images that are embedded in the file.

    Raises
    ------
    FileError
        The file does not exist, pymeshlab cannot read it, it does not contain exactly one mesh, or a texture would be
        lost.
    """
    source = Path(path)
    with meshlab_errors(source, "read"):
        if not source.is_file():
            if source.is_dir():
                raise FileError(f"{path}: is a folder; give one of the mesh files in it")
            raise FileError(f"{path}: {'is not a regular file' if source.exists() else 'no such file'}")
        _check_name(source)
        headers.check(source)
        is_gltf = source.suffix.lower() in gltf.ENDINGS
        found = textures_of(source, prefix) if is_gltf else []
        is_renamed = any(texture.name != texture.written for texture in found)
        ms = _load_copy(source, found) if is_renamed else _load(source)
        if ms.mesh_number() != 1:
            raise FileError(f"{path}: contains {ms.mesh_number()} meshes; save each in a separate file")
        if not _lost_a_texture(ms, source):
            return ms
        found = textures_of(source, prefix)
        ms = _load_copy(source, found)
        if _lost_a_texture(ms, source):
            names = ", ".join(texture.written for texture in found) or "(of unknown name)"
            raise FileError(f"{path}: pymeshlab cannot read its texture {names}; convert it to PNG, beside the mesh")
        return ms


def _check_name(path: Path) -> None:
    """Refuse paths that pymeshlab cannot open."""
    try:
        str(path).encode()
    except UnicodeEncodeError as error:
        raise FileError(f"{path}: pymeshlab cannot open it, as its name is not UTF-8; rename it") from error


def _load(path: Path) -> pymeshlab.MeshSet:
    """Read a file with limited memory, as some readers allocate without end for malformed files."""
    ms = pymeshlab.MeshSet()
    with DeferInterrupts(), memory.limited(memory.available()):
        ms.load_new_mesh(str(path))
    return ms


def _load_copy(source: Path, found: list[Texture]) -> pymeshlab.MeshSet:
    """Read a copy of a file whose textures are replaced by images that pymeshlab can read."""
    with temporary.folder() as folder:
        try:
            return _load(copy_with_renamed_textures(source, folder, found, STAND_IN))
        except pymeshlab.PyMeshLabException:
            if all(texture.file is not None for texture in found):
                raise
        # pymeshlab cannot read an embedded image: replace these as well
        blind = [Texture(t.written, t.name, t.file or source, t.data) for t in found]
        return _load(copy_with_renamed_textures(source, folder, blind, STAND_IN))


def _lost_a_texture(ms: pymeshlab.MeshSet, source: Path) -> bool:
    has_this_name = (source.parent / PLACEHOLDER_NAME).is_file()
    return PLACEHOLDER_NAME in ms.current_mesh().textures() and not has_this_name


@dataclass(frozen=True)
class Written:
    """A mesh file that was written.

    Attributes
    ----------
    file : Path
        Its current path: in a temporary folder within :func:`postponed`.
    notices : tuple of str
        Differences from the input that the user should know, one line each.
    """

    file: Path
    notices: tuple[str, ...]


def write(ms: pymeshlab.MeshSet, path: str | os.PathLike[str], source: str | os.PathLike[str] | None = None) -> Written:
    """Write the current mesh, in any format that pymeshlab writes.

    The mesh with its companions (materials, textures) is written into a temporary folder beside the target and moved
    from there, the mesh last: the target is either the old file or the complete new one. Symbolic links are resolved.
    Only the target itself and the materials of an OBJ file (its name with ``.mtl``) are ever replaced: a texture with
    the name of an existing file is an error, unless both are equal.

    A texture is copied to the same relative path below the target's folder as below the source's, if its name and first
    bytes are those of an image, and no part of either path is hidden or a symbolic link.

    Parameters
    ----------
    ms : pymeshlab.MeshSet
    path : path
        Its suffix determines the format.
    source : path, optional
        The file that the mesh was read from, whose textures are copied unchanged. Without it pymeshlab encodes them
        again.

    Raises
    ------
    FileError
        The folder is missing or not writable, pymeshlab cannot write the format, or a texture cannot be written
        without replacing another file.
    """
    target = check_target(path)
    with atomic_write(target) as part, meshlab_errors(target, "written"):
        _save(ms, part)
        notices = copy_textures(plan_textures(ms, target, source), part.parent)
    return Written(part if part.exists() else target, notices)


def check_textures(
    ms: pymeshlab.MeshSet, path: str | os.PathLike[str], source: str | os.PathLike[str] | None = None
) -> None:
    """Refuse textures that :func:`write` would refuse, before any work is done; raises :class:`FileError`."""
    target = check_place(path)
    with meshlab_errors(target, "written"):
        check_conflicts(plan_textures(ms, target, source))


def _save(ms: pymeshlab.MeshSet, path: Path) -> None:
    """Save the current mesh, without its textures, in an empty folder."""
    mesh = ms.current_mesh()
    walks = path.suffix.lower() in _POLYGONAL
    elements = mesh.vertex_number() + mesh.face_number()
    limit = _WALK_BYTES + _WALK_BYTES_PER_ELEMENT * elements if walks else memory.available()
    try:
        with memory.limited(limit):
            ms.save_current_mesh(str(path), save_textures=False, **_PARAMETERS.get(path.suffix.lower(), {}))
    except MemoryError as error:
        if not walks:
            raise
        raise pymeshlab.PyMeshLabException(
            "memory ran out, probably because a polygon overlaps another face or repeats a corner, so that pymeshlab "
            "walks around it without end; write .ply, or triangulate all polygons first (meshing_poly_to_tri)"
        ) from error
    if not path.is_file():  # .u3d: pymeshlab reports success, but writes nothing
        raise pymeshlab.PyMeshLabException(f"pymeshlab cannot write {path.suffix} files")
    _check_free_space(path)


def _check_free_space(path: Path) -> None:
    """Raise if the file cannot grow: it may be truncated then, which not all of pymeshlab's writers report."""
    size = path.stat().st_size
    with path.open("ab") as file:
        file.write(bytes(_MIN_FREE))
    os.truncate(path, size)


def check_target(path: str | os.PathLike[str]) -> Path:
    """Check that a mesh file can be written, before any work is done for it.

    Returns
    -------
    Path
        The file that will be written; see :func:`check_place`.

    Raises
    ------
    FileError
        See :func:`check_place`; or pymeshlab cannot write this format.
    """
    target = check_place(path)
    _check_name(target)
    triangle = pymeshlab.MeshSet()
    triangle.add_mesh(pymeshlab.Mesh(np.eye(3), np.array([[0, 1, 2]])))
    with meshlab_errors(target, "written"), temporary.folder() as folder:
        _save(triangle, folder / f"trial{target.suffix}")
    return target


def sample(name: str) -> Path:
    """Find a mesh inside the pymeshlab wheel: ``"bunny.obj"`` is the Stanford bunny, closed, 28088 vertices.

    Raises
    ------
    FileError
        The installed pymeshlab does not contain this mesh.
    """
    path = Path(pymeshlab.__file__).parent / "tests" / "sample_meshes" / name
    if not path.is_file():
        raise FileError(f"{path}: not in pymeshlab {_version()}; reinstall pymeshlab from its wheel")
    return path


def meshlab_errors(path: Path, action: str) -> AbstractContextManager[None]:
    """Turn errors of pymeshlab and of the operating system into a :class:`FileError`; see :func:`file_errors`."""
    return file_errors(path, action, pymeshlab.PyMeshLabException)


def _version() -> str:
    from importlib.metadata import version

    return version("pymeshlab")

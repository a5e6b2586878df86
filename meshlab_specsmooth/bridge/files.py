"""Mesh files, read and written by pymeshlab; an output is written whole or not at all."""

from __future__ import annotations

import contextlib
import filecmp
import os
import platform
import re
import shutil
import tempfile
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pymeshlab

from meshlab_specsmooth import memory
from meshlab_specsmooth.bridge import headers
from meshlab_specsmooth.bridge.interrupts import Hold
from meshlab_specsmooth.bridge.textures import is_inside, material_names, texture_names
from meshlab_specsmooth.errors import FileError

# bytes that must be left where a mesh was written: a writer's last buffer
_ROOM = 2**16
# formats that have polygons: pymeshlab puts them together from triangles, and where more than two of these meet inside
# of one it goes around without end, and remembers each step; what it may remember is more than any sound mesh needs
_POLYGONAL = {".obj", ".off"}
_WALK, _WALK_EACH = 2**28, 2**10
# formats that name no texture
_UNTEXTURED = {".stl", ".off", ".xyz", ".dxf"}
# what pymeshlab calls, and puts in place of, every texture that it cannot read; the texture's own name is lost
_DUMMY = "dummy.png"
# an image that pymeshlab reads whatever the ending of its name, and of a size that no texture has
_STAND_IN_SIZE = (1, 997)
_STAND_IN = b"P4 %d %d\n" % _STAND_IN_SIZE + bytes(997)


def read(path: str | os.PathLike[str]) -> pymeshlab.MeshSet:
    """A new MeshSet with the mesh of a file, in any format that pymeshlab reads.

    Textures that pymeshlab cannot read (JPEG, or a file that is not there) keep their names, but have no
    image; give :func:`write` the file that the mesh came from, and it takes its textures from there.

    Raises
    ------
    FileError
        There is no such file, pymeshlab cannot read it, it holds several meshes or none, or a texture would be lost.
    """
    source = Path(path)
    with _as_file_error(source, "read"):
        if not source.is_file():
            raise FileError(f"{path}: no such file")
        headers.check(source)
        ms = _load(source)
        if ms.mesh_number() != 1:
            raise FileError(f"{path}: holds {ms.mesh_number()} meshes; save each as a file of its own")
        if not _lost_a_texture(ms, source):
            return ms
        with Hold(), tempfile.TemporaryDirectory(prefix="specsmooth-") as folder:
            ms = _load(_with_stand_ins(source, Path(folder)))
        if _lost_a_texture(ms, source):
            names = ", ".join(texture_names(source)) or "(of unknown name)"
            raise FileError(f"{path}: pymeshlab cannot read its texture {names}; convert it to PNG, beside the mesh")
        return ms


def _load(path: Path) -> pymeshlab.MeshSet:
    """Read a file with no more memory than there is: a reader that grows without end ends, and not the machine."""
    ms = pymeshlab.MeshSet()
    with Hold(), memory.limited(memory.available()):
        ms.load_new_mesh(str(path))
    return ms


def _lost_a_texture(ms: pymeshlab.MeshSet, source: Path) -> bool:
    is_really_called_so = (source.parent / _DUMMY).is_file()
    return _DUMMY in ms.current_mesh().textures() and not is_really_called_so


def _with_stand_ins(source: Path, folder: Path) -> Path:
    """A copy of a mesh file in another folder, where each of its textures is an image that pymeshlab can read."""
    for name in texture_names(source):
        if is_inside(name):
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            (folder / name).write_bytes(_STAND_IN)
    for name in material_names(source):
        if is_inside(name) and (source.parent / name).is_file():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(source.parent / name, folder / name)
    return Path(shutil.copyfile(source, folder / source.name))


def write(ms: pymeshlab.MeshSet, path: str | os.PathLike[str], source: str | os.PathLike[str] | None = None) -> None:
    """Write the current mesh, in any format that pymeshlab writes.

    It is written into a temporary folder beside the target, with all that belongs to it (materials, textures), and
    moved from there, the mesh last: the target is the old file or the whole new one, never a part. Where the target is
    a link, that is the file which it points to. Only the target itself and an OBJ file's materials (its name and
    ``.mtl``) are ever replaced: a texture of the same name as another file is an error, unless they are equal.

    Parameters
    ----------
    ms : pymeshlab.MeshSet
    path : path
        Its ending says the format.
    source : path, optional
        The file that the mesh was read from: textures beside it are taken as they are. Without it pymeshlab encodes
        them anew.

    Raises
    ------
    FileError
        The folder is missing or not writable, pymeshlab cannot write the format, or a texture cannot be written
        without replacing another file.
    """
    target = check_target(path)
    with replacing(target) as part:
        _save(ms, part)
        if part.suffix.lower() not in _UNTEXTURED:
            origin = None if source is None else Path(source)
            _lay_textures(ms.current_mesh().textures(), origin, part.parent, target.parent)


def _save(ms: pymeshlab.MeshSet, path: Path) -> None:
    """Save the current mesh without its textures, in an empty folder."""
    mesh = ms.current_mesh()
    walks = path.suffix.lower() in _POLYGONAL
    most = _WALK + _WALK_EACH * (mesh.vertex_number() + mesh.face_number()) if walks else memory.available()
    try:
        with memory.limited(most):
            ms.save_current_mesh(str(path), save_textures=False)
    except MemoryError as error:
        if not walks:
            raise
        raise pymeshlab.PyMeshLabException(
            "memory ran out, as it does where a polygon lies upon another face or has a corner twice, and pymeshlab "
            "goes around it without end; write .ply, or make triangles of all polygons first (meshing_poly_to_tri)"
        ) from error
    if not path.is_file():  # .u3d: it is said to be written, and is not
        raise pymeshlab.PyMeshLabException(f"pymeshlab writes no {path.suffix} file")
    _check_room_left(path)


def _check_room_left(path: Path) -> None:
    """Raise where a file could not grow: then it may have been cut short, and not all of pymeshlab's writers say so."""
    size = path.stat().st_size
    with path.open("ab") as file:
        file.write(bytes(_ROOM))
    os.truncate(path, size)


def _lay_textures(textures: dict[str, Any], source: Path | None, folder: Path, destination: Path) -> None:
    """Put the textures into the folder of a mesh that will end up in the destination."""
    originals = {} if source is None else _originals(textures, source)
    for name, image in textures.items():
        original = originals.get(name)
        if original is not None and original.resolve() == (destination / name).resolve():
            continue  # it lies where it belongs
        if not is_inside(name):
            raise FileError(f"{destination / name}: a texture outside of the mesh's folder; write beside the input")
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        if original is None:
            if name == _DUMMY or (image.width(), image.height()) == _STAND_IN_SIZE:
                raise FileError(f"{destination / name}: a texture that pymeshlab could not read, and would write empty")
            image.save(str(folder / name))
        elif original.is_file():  # else the input refers to a file that is not there, and so does the output
            shutil.copyfile(original, folder / name)


def _originals(textures: Iterable[str], source: Path) -> dict[str, Path]:
    """Textures that are files beside the source, or would be if they were there; the others came inside of it."""
    named = texture_names(source)
    return {name: source.parent / name for name in textures if name in named or (source.parent / name).is_file()}


def write_text(path: str | os.PathLike[str], text: str) -> None:
    """Write a text file whole or not at all; raises :class:`FileError`."""
    with replacing(path) as part:
        part.write_text(text, encoding="utf-8")


@contextlib.contextmanager
def replacing(path: str | os.PathLike[str]) -> Iterator[Path]:
    """A file to write in a temporary folder beside the target; all that is there in the end is moved to the target's.

    Companions go first and the file itself last, so that it never refers to what is not there. A companion that would
    replace a file of other content is an error, and nothing is moved; the materials of an OBJ file are its own. An
    interrupt (Ctrl-C) waits until the file is written, and then nothing is moved; or until all is moved.

    Raises
    ------
    FileError
        See :func:`check_place`; or the operating system, or pymeshlab, refuses.
    """
    target = check_place(path)
    with (
        _as_file_error(target, "written"),
        Hold() as hold,
        tempfile.TemporaryDirectory(prefix=_temporary_prefix(os.getpid()), dir=target.parent) as folder,
    ):
        part = Path(folder) / target.name
        yield part
        hold.deliver()
        for companion in _new_companions(part, target):
            place = target.parent / companion.relative_to(folder)
            place.parent.mkdir(parents=True, exist_ok=True)
            companion.replace(place)
        part.replace(target)


def _temporary_prefix(process: int | str) -> str:
    """How the temporary folders of a process of this machine begin."""
    return f".specsmooth-{re.sub(r'[^A-Za-z0-9]', '_', platform.node())}-{process}-"


def sweep(folder: str | os.PathLike[str]) -> None:
    """Remove what processes of this machine, killed while they wrote into a folder, have left there."""
    if os.name != "posix":  # elsewhere to ask for a process may end it
        return
    pattern = re.compile(re.escape(_temporary_prefix("")).replace(r"\-\-", "-([0-9]+)-") + ".*")
    for left in Path(folder).glob(".specsmooth-*"):
        match = pattern.fullmatch(left.name)
        if match is not None and not _is_alive(int(match[1])):
            shutil.rmtree(left, ignore_errors=True)


def _is_alive(process: int) -> bool:
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except PermissionError:
        pass
    return True


def _new_companions(part: Path, target: Path) -> list[Path]:
    """Files beside the part that are not yet beside the target; raises where another file is in the way."""
    new = []
    for companion in sorted(file for file in part.parent.rglob("*") if file.is_file() and file != part):
        place = target.parent / companion.relative_to(part.parent)
        if not place.exists() or companion.name == f"{target.name}.mtl":
            new.append(companion)
        elif not (place.is_file() and filecmp.cmp(companion, place, shallow=False)):
            raise FileError(f"{place}: another file of that name belongs to {target.name}; write to another folder")
    return new


@contextlib.contextmanager
def _as_file_error(path: Path, done: str) -> Iterator[None]:
    """What the operating system and pymeshlab raise, as one line that names the file."""
    try:
        yield
    except FileError:
        raise
    except OSError as error:
        raise FileError(f"{path}: cannot be {done}: {error.strerror}") from error
    except MemoryError as error:
        raise FileError(f"{path}: cannot be {done}: memory ran out") from error
    except (pymeshlab.PyMeshLabException, ValueError, RuntimeError) as error:  # C++'s own come through as these
        raise FileError(f"{path}: cannot be {done}: {_one_line(error)}") from error


def check_target(path: str | os.PathLike[str]) -> Path:
    """Refuse a mesh file that cannot be written, before any work is done for it.

    Returns
    -------
    Path
        The file that will be written; see :func:`check_place`.

    Raises
    ------
    FileError
        See :func:`check_place`; or pymeshlab writes no files of that ending.
    """
    target = check_place(path)
    triangle = pymeshlab.MeshSet()
    triangle.add_mesh(pymeshlab.Mesh(np.eye(3), np.array([[0, 1, 2]])))
    with _as_file_error(target, "written"), Hold(), tempfile.TemporaryDirectory(prefix="specsmooth-") as folder:
        _save(triangle, Path(folder) / f"trial{target.suffix}")
    return target


def check_place(path: str | os.PathLike[str]) -> Path:
    """Refuse a path that no file can be written to, before any work is done for it.

    Returns
    -------
    Path
        The file that will be written: what a link points to, in the end.

    Raises
    ------
    FileError
        It is a folder, or its own folder is missing or not writable.
    """
    with _as_file_error(Path(path), "written"):
        target = Path(os.path.realpath(path))
        if target.is_dir():
            raise FileError(f"{path}: is a folder")
        if not target.parent.is_dir():
            raise FileError(f"{path}: there is no folder {target.parent}")
        if not os.access(target.parent, os.W_OK | os.X_OK):
            raise FileError(f"{path}: the folder {target.parent} is not writable")
        return target


def sample(name: str) -> Path:
    """A mesh that comes inside the pymeshlab wheel: ``"bunny.obj"`` is the Stanford bunny, closed, 28088 vertices.

    Raises
    ------
    FileError
        This pymeshlab has no such mesh.
    """
    path = Path(pymeshlab.__file__).parent / "tests" / "sample_meshes" / name
    if not path.is_file():
        raise FileError(f"{path}: not in pymeshlab {_version()}; reinstall pymeshlab from its wheel")
    return path


def _version() -> str:
    from importlib.metadata import version

    return version("pymeshlab")


def _one_line(error: BaseException) -> str:
    return " ".join(str(error).split())

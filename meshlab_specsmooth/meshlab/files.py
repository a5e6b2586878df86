"""Mesh files, read and written by pymeshlab; an output is written whole or not at all."""

from __future__ import annotations

import contextlib
import filecmp
import os
import re
import shutil
import stat
import struct
import zlib
from collections.abc import Iterator
from contextvars import ContextVar
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pymeshlab

from meshlab_specsmooth.errors import FileError
from meshlab_specsmooth.meshlab import gltf, headers, textures
from meshlab_specsmooth.meshlab.textures import Texture
from meshlab_specsmooth.runtime import memory, temporary
from meshlab_specsmooth.runtime.interrupts import DeferInterrupts

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
# an image of a size that no texture has; pymeshlab reads PNG whatever the ending of the name
_STAND_IN_SIZE = (1, 997)
# parameters of writers: by default this one rounds to a grid whose step has nothing to do with the mesh
_PARAMETERS = {".ctm": {"lossless": True}}
# names of textures that one line tells
_MOST_TOLD = 5


def _png(width: int, height: int) -> bytes:
    """A black image."""
    header = struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0)
    chunks = ((b"IHDR", header), (b"IDAT", zlib.compress(bytes((width + 1) * height))), (b"IEND", b""))
    framed = (
        struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data)) for kind, data in chunks
    )
    return b"\x89PNG\r\n\x1a\n" + b"".join(framed)


_STAND_IN = _png(*_STAND_IN_SIZE)


def read(path: str | os.PathLike[str], prefix: str = "") -> pymeshlab.MeshSet:
    """A new MeshSet with the mesh of a file, in any format that pymeshlab reads.

    Textures that pymeshlab cannot read (JPEG, or a file that is not there) keep their names, but have no
    image; give :func:`write` the file that the mesh came from, and it takes its textures from there. Blanks and other
    characters of a name that pymeshlab takes for its end become ``_``.

    Parameters
    ----------
    path : path
    prefix : str
        Begins the names of images that are inside of the file.

    Raises
    ------
    FileError
        There is no such file, pymeshlab cannot read it, it holds several meshes or none, or a texture would be lost.
    """
    source = Path(path)
    with _as_file_error(source, "read"):
        if not source.is_file():
            if source.is_dir():
                raise FileError(f"{path}: is a folder; give one of the mesh files in it")
            raise FileError(f"{path}: {'is no regular file' if source.exists() else 'no such file'}")
        _check_name(source)
        headers.check(source)
        is_gltf = source.suffix.lower() in gltf.ENDINGS
        found = textures.textures_of(source, prefix) if is_gltf else []
        is_renamed = any(texture.name != texture.written for texture in found)
        ms = _load_copy(source, found) if is_renamed else _load(source)
        if ms.mesh_number() != 1:
            raise FileError(f"{path}: holds {ms.mesh_number()} meshes; save each as a file of its own")
        if not _lost_a_texture(ms, source):
            return ms
        found = textures.textures_of(source, prefix)
        ms = _load_copy(source, found)
        if _lost_a_texture(ms, source):
            names = ", ".join(texture.written for texture in found) or "(of unknown name)"
            raise FileError(f"{path}: pymeshlab cannot read its texture {names}; convert it to PNG, beside the mesh")
        return ms


def _check_name(path: Path) -> None:
    """Refuse what pymeshlab cannot be given."""
    try:
        str(path).encode()
    except UnicodeEncodeError as error:
        raise FileError(f"{path}: its name is not UTF-8, and pymeshlab opens no such file; rename it") from error


def _load(path: Path) -> pymeshlab.MeshSet:
    """Read a file with no more memory than there is: a reader that grows without end ends, and not the machine."""
    ms = pymeshlab.MeshSet()
    with DeferInterrupts(), memory.limited(memory.available()):
        ms.load_new_mesh(str(path))
    return ms


def _load_copy(source: Path, found: list[Texture]) -> pymeshlab.MeshSet:
    """Read a copy of a file, beside which each of its textures is an image that pymeshlab can read."""
    with temporary.folder() as folder:
        try:
            return _load(textures.copy_renamed(source, folder, found, _STAND_IN))
        except pymeshlab.PyMeshLabException:
            if all(texture.file is not None for texture in found):
                raise
        # an image inside of the file is one that pymeshlab cannot read
        blind = [Texture(t.written, t.name, t.file or source, t.data) for t in found]
        return _load(textures.copy_renamed(source, folder, blind, _STAND_IN))


def _lost_a_texture(ms: pymeshlab.MeshSet, source: Path) -> bool:
    is_really_called_so = (source.parent / _DUMMY).is_file()
    return _DUMMY in ms.current_mesh().textures() and not is_really_called_so


@dataclass(frozen=True)
class Written:
    """A mesh file that was written.

    Attributes
    ----------
    file : Path
        Where it lies now: see :func:`postponed`.
    notices : tuple of str
        What is not as one might think, a line each.
    """

    file: Path
    notices: tuple[str, ...]


def write(ms: pymeshlab.MeshSet, path: str | os.PathLike[str], source: str | os.PathLike[str] | None = None) -> Written:
    """Write the current mesh, in any format that pymeshlab writes.

    It is written into a temporary folder beside the target, with all that belongs to it (materials, textures), and
    moved from there, the mesh last: the target is the old file or the whole new one, never a part. Where the target is
    a link, that is the file which it points to. Only the target itself and an OBJ file's materials (its name and
    ``.mtl``) are ever replaced: a texture of the same name as another file is an error, unless they are equal.

    A texture is copied to the place below the target's folder that it has below the source's, if it is an image by its
    name and its first bytes, and no part of either place is hidden or a link.

    Parameters
    ----------
    ms : pymeshlab.MeshSet
    path : path
        Its ending says the format.
    source : path, optional
        The file that the mesh was read from: textures of it are taken as they are. Without it pymeshlab encodes
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
        notices = _lay_textures(_planned(ms, target, source), part.parent)
    return Written(part if part.exists() else target, notices)


def check_textures(
    ms: pymeshlab.MeshSet, path: str | os.PathLike[str], source: str | os.PathLike[str] | None = None
) -> None:
    """Refuse textures that :func:`write` would refuse, before any work is done; raises :class:`FileError`."""
    target = check_place(path)
    with _as_file_error(target, "written"):
        plan = _planned(ms, target, source)
        for name, image in plan.images.items():
            place = target.parent / name
            if place.exists() and not (isinstance(image, Path | bytes) and _holds(place, image)):
                if isinstance(image, Path | bytes):
                    raise _in_the_way(place, target)
                _check_image(place, image)


@dataclass(frozen=True)
class _Plan:
    """Textures by their names: a file to copy, bytes, or an image of pymeshlab's; and why others are not copied."""

    target: Path
    images: dict[str, Any]
    left: dict[str, str]


def _planned(ms: pymeshlab.MeshSet, target: Path, source: str | os.PathLike[str] | None) -> _Plan:
    plan = _Plan(target, {}, {})
    if target.suffix.lower() in _UNTEXTURED or ms.current_mesh().texture_number() == 0:
        return plan
    origin = None if source is None else Path(source)
    known = [] if origin is None else textures.textures_of(origin)
    for name, image in ms.current_mesh().textures().items():
        found = _original(name, known, origin)
        if isinstance(found, Path) and found.resolve() == (target.parent / name).resolve():
            continue  # it lies where it belongs
        problem = _problem_of_texture(name, found, origin, target)
        if problem is None:
            plan.images[name] = image if found is None else found
        else:
            plan.left[name] = problem
    return plan


def _original(name: str, known: list[Texture], source: Path | None) -> Path | bytes | None:
    """The file, or the bytes, that a texture was read from."""
    inside = re.fullmatch(rf"(?:.*-)?({textures.EMBEDDED}\d+\.\w+)", name)
    for texture in known:
        if texture.name == name and texture.file is not None:
            return texture.file
        if inside is not None and texture.name == inside[1]:
            return texture.data
    if source is not None and (source.parent / name).is_file():
        return source.parent / name
    return None


def _problem_of_texture(name: str, found: Path | bytes | None, source: Path | None, target: Path) -> str | None:
    """Why a texture is not to be copied."""
    if not textures.is_inside(name):
        return "outside of the mesh's folder"
    if not textures.is_image_name(name):
        return "not the name of an image that is not hidden"
    if name.casefold() in (target.name.casefold(), f"{target.name}.mtl".casefold()):
        return "the name of the output"
    if textures.is_linked(target.parent, name):
        return "there is a symbolic link in its place"
    if isinstance(found, bytes):
        is_image = textures.is_image_data(found[:64], len(found), Path(name).suffix)
        return None if is_image else "not an image"
    if found is None or source is None:
        return None
    if textures.is_linked(source.parent, os.path.relpath(found, source.parent)):
        return "a symbolic link"
    if not found.exists():
        return "no such file"
    return None if textures.is_image(found) else "not an image"


def _save(ms: pymeshlab.MeshSet, path: Path) -> None:
    """Save the current mesh without its textures, in an empty folder."""
    mesh = ms.current_mesh()
    walks = path.suffix.lower() in _POLYGONAL
    most = _WALK + _WALK_EACH * (mesh.vertex_number() + mesh.face_number()) if walks else memory.available()
    try:
        with memory.limited(most):
            ms.save_current_mesh(str(path), save_textures=False, **_PARAMETERS.get(path.suffix.lower(), {}))
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


def _lay_textures(plan: _Plan, folder: Path) -> tuple[str, ...]:
    """Put textures into the folder of a mesh that will end up beside the target; returns what there is to say."""
    for name, image in plan.images.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        if isinstance(image, bytes):
            (folder / name).write_bytes(image)
        elif isinstance(image, Path):
            shutil.copyfile(image, folder / name)
        else:
            _check_image(plan.target.parent / name, image)
            image.save(str(folder / name))
    if not plan.left:
        return ()
    told = [f"{name} ({problem})" for name, problem in plan.left.items()]
    more = f" and {len(told) - _MOST_TOLD} more" if len(told) > _MOST_TOLD else ""
    return (f"{plan.target}: textures that it refers to and that are not copied: {', '.join(told[:_MOST_TOLD])}{more}",)


def _check_image(place: Path, image: Any) -> None:
    """Refuse an image of pymeshlab's that is none."""
    if place.name == _DUMMY or (image.width(), image.height()) == _STAND_IN_SIZE:
        raise FileError(f"{place}: a texture that pymeshlab could not read, and would write empty")


def _holds(place: Path, image: Path | bytes) -> bool:
    """Whether a file has this content."""
    if isinstance(image, bytes):
        return place.is_file() and place.read_bytes() == image
    return place.is_file() and filecmp.cmp(image, place, shallow=False)


def write_text(path: str | os.PathLike[str], text: str) -> None:
    """Write a text file whole or not at all; raises :class:`FileError`."""
    with replacing(path) as part:
        part.write_text(text, encoding="utf-8")


@dataclass(frozen=True)
class Staged:
    """A file in a temporary folder beside its target, with its companions."""

    temporary: temporary.Temporary
    target: Path

    @property
    def part(self) -> Path:
        """Where it is written."""
        return self.temporary.content / self.target.name

    def move(self) -> None:
        """Move all to its place, the file itself last, so that it never refers to what is not there.

        What is replaced keeps its permissions. Raises :class:`FileError`.
        """
        with _as_file_error(self.target, "written"), DeferInterrupts():
            for companion in self.new_companions():
                place = self.target.parent / companion.relative_to(self.temporary.content)
                place.parent.mkdir(parents=True, exist_ok=True)
                _move(companion, place)
            _move(self.part, self.target)

    def new_companions(self) -> list[Path]:
        """Files beside the part that are not yet beside the target; raises where another file is in the way."""
        content = self.temporary.content
        new = []
        for companion in sorted(file for file in content.rglob("*") if file.is_file() and file != self.part):
            name = companion.relative_to(content)
            place = self.target.parent / name
            if companion.name == f"{self.target.name}.mtl" and not place.is_dir():
                new.append(companion)
            elif textures.is_linked(self.target.parent, name.as_posix()):
                raise FileError(f"{place}: a symbolic link, which is not written through; write to another folder")
            elif not place.exists():
                new.append(companion)
            elif not _holds(place, companion):
                raise _in_the_way(place, self.target)
        return new

    def discard(self) -> None:
        """Remove what is left of it."""
        self.temporary.remove()


def _move(part: Path, place: Path) -> None:
    with contextlib.suppress(FileNotFoundError):
        part.chmod(stat.S_IMODE(place.stat().st_mode) & 0o777)
    part.replace(place)


def _in_the_way(place: Path, target: Path) -> FileError:
    return FileError(f"{place}: another file of that name belongs to {target.name}; write to another folder")


_POSTPONED: ContextVar[list[Staged] | None] = ContextVar("_POSTPONED", default=None)


@contextlib.contextmanager
def postponed() -> Iterator[list[Staged]]:
    """Inside, what is written stays in its temporary folders, and is left to whoever gets the list to be moved.

    Where an exception ends it, they are removed.
    """
    written: list[Staged] = []
    token = _POSTPONED.set(written)
    try:
        yield written
    except BaseException:
        for staged in written:
            staged.discard()
        raise
    finally:
        _POSTPONED.reset(token)


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
    with _as_file_error(target, "written"), DeferInterrupts() as hold:
        staged = Staged(temporary.create(target.parent), target)
        waiting = _POSTPONED.get()
        is_kept = False
        try:
            yield staged.part
            hold.deliver()
            if waiting is None:
                staged.move()
            else:
                staged.new_companions()
                waiting.append(staged)
                is_kept = True
        finally:
            if not is_kept:
                staged.discard()


@contextlib.contextmanager
def _as_file_error(path: Path, done: str) -> Iterator[None]:
    """What the operating system and pymeshlab raise, as one line that names the file."""
    try:
        yield
    except FileError:
        raise
    except OSError as error:
        raise FileError(f"{path}: cannot be {done}: {error.strerror or error}") from error
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
    _check_name(target)
    triangle = pymeshlab.MeshSet()
    triangle.add_mesh(pymeshlab.Mesh(np.eye(3), np.array([[0, 1, 2]])))
    with _as_file_error(target, "written"), temporary.folder() as folder:
        _save(triangle, folder / f"trial{target.suffix}")
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
        It is a folder, a pipe or a device, or its own folder is missing or not writable.
    """
    with _as_file_error(Path(path), "written"):
        target = Path(os.path.realpath(path))
        if target.is_dir():
            raise FileError(f"{path}: is a folder")
        if target.exists() and not target.is_file():
            raise FileError(f"{path}: is no regular file, and only such are written")
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

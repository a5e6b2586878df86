"""Which files are meant, and where what is made of each belongs."""

from __future__ import annotations

import glob
import os
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from meshlab_specsmooth.errors import FileError, InvalidParameter
from meshlab_specsmooth.parameters import check_path, show

# what pymeshlab reads and what has triangles; other files of a folder are passed over
MESH_ENDINGS = frozenset(
    f".{name}"
    for name in (
        *("3ds", "3mf", "bre", "ctm", "dae", "e57", "fbx", "glb", "gltf", "gts"),
        *("obj", "off", "ply", "qobj", "stl", "tri", "vmi", "wrl", "x3d", "x3dv"),
    )
)
# a list of files, one a line
MANIFEST_ENDING = ".txt"
_LONGEST_LINE = 4096


@dataclass(frozen=True)
class Source:
    """A mesh to read, and the file of the output folder that it becomes.

    Attributes
    ----------
    path : str
        Absolute.
    output : str
        Absolute.
    size : int
        Bytes of the file; 0 where there is none (it fails when it is read, and is told then).
    """

    path: str
    output: str
    size: int


def sources(
    paths: str | os.PathLike[str] | Iterable[str | os.PathLike[str]],
    out: str | os.PathLike[str],
    ending: str | None = None,
) -> tuple[Source, ...]:
    """The meshes that files, folders, patterns and manifests stand for, in their order, each once.

    A file becomes one of its name in the output folder. Meshes of a folder, at any depth, keep their place below it,
    and so do those that a pattern finds below its last folder before a wildcard, and those of a manifest below the
    manifest's. What a folder or a pattern finds in the output folder is no input.

    Parameters
    ----------
    paths : path or iterable of paths
        Mesh files, folders, patterns (``"scans/**/*.ply"``), and manifests (``.txt``: a path a line, relative to the
        manifest; empty lines and those that begin with ``#`` say nothing).
    out : path
        The output folder.
    ending : str, optional
        Format of the outputs, as ``".ply"``; that of each input by default.

    Raises
    ------
    FileError
        A manifest cannot be read, or a folder or pattern has no mesh.
    InvalidParameter
        Two meshes would become the same file, or one would replace its input.

    Examples
    --------
    >>> from pathlib import PurePath
    >>> from meshlab_specsmooth.batching.inputs import sources
    >>> (scan,) = sources("scans/head.obj", "smooth", ".ply")
    >>> PurePath(scan.output).parts[-2:]
    ('smooth', 'head.ply')
    """
    if isinstance(paths, bytes | Mapping) or not isinstance(paths, str | os.PathLike | Iterable):
        raise InvalidParameter(f"paths is {show(paths)}; it must be a path, or several")
    several = [paths] if isinstance(paths, str | os.PathLike) else list(paths)
    given = [check_path("paths" if one is paths else f"paths[{i}]", one) for i, one in enumerate(several)]
    folder = Path(out).absolute()
    places: dict[str, str] = {}
    owners: dict[str, str] = {}
    for path, place in (found for one in given for found in _expanded(one, folder)):
        source = os.path.realpath(path)
        if source in places:
            continue
        target = folder / (place if ending is None else place.with_suffix(ending))
        name = os.path.normcase(os.path.realpath(target))
        if name == os.path.normcase(source):
            raise InvalidParameter(f"{path} would be replaced by its own result; choose another output folder")
        if name in owners:
            raise InvalidParameter(
                f"{owners[name]} and {path} would both become {target}; give the folder above them, or a pattern in "
                "quotation marks, and they keep their places below it"
            )
        owners[name], places[source] = path, str(target)
    if not places:
        raise InvalidParameter("there is no mesh to smooth")
    return tuple(Source(path, output, _size(path)) for path, output in places.items())


def _expanded(given: str, out: Path) -> Iterator[tuple[str, Path]]:
    """Files, and their places in the output folder."""
    path = Path(given)
    if path.is_dir():
        yield from _below(path, (file for file in path.rglob("*") if _is_mesh(file)), out, f"{given}: no mesh in it")
    elif path.suffix.lower() == MANIFEST_ENDING:
        yield from _listed(path)
    elif not path.exists() and glob.has_magic(given):
        found = (Path(file) for file in glob.iglob(given, recursive=True))  # noqa: PTH207 (absolute as well)
        meshes = (file for file in found if _is_mesh(file))
        yield from _below(_fixed_part(path), meshes, out, f"{given}: no mesh is called so")
    else:
        yield given, Path(path.name)


def _below(base: Path, files: Iterable[Path], out: Path, problem: str) -> Iterator[tuple[str, Path]]:
    kept = sorted(file for file in files if not file.absolute().is_relative_to(out))
    if not kept:
        raise FileError(problem)
    for file in kept:
        yield str(file), file.relative_to(base)


def _is_mesh(path: Path) -> bool:
    """Whether it is a mesh by its name, and not hidden: what is being written is in hidden folders."""
    hidden = any(part.startswith(".") and part not in (".", "..") for part in path.parts[-2:])
    return path.suffix.lower() in MESH_ENDINGS and not hidden and path.is_file()


def _fixed_part(pattern: Path) -> Path:
    """The folders before the first wildcard."""
    parts = list(pattern.parts)
    first = next(number for number, part in enumerate(parts) if glob.has_magic(part))
    return Path(*parts[:first])


def _listed(manifest: Path) -> Iterator[tuple[str, Path]]:
    try:
        lines = manifest.read_text(encoding="utf-8").splitlines()
    except OSError as error:
        raise FileError(f"{manifest}: cannot be read: {error.strerror}") from error
    except UnicodeDecodeError as error:
        raise FileError(f"{manifest}: cannot be read: it is no text in UTF-8") from error
    for number, line in enumerate(lines, start=1):
        if len(line) > _LONGEST_LINE or "\0" in line:
            raise FileError(f"{manifest}:{number}: is no path")
        if line.strip() and not line.startswith("#"):
            path = manifest.parent / line.strip()
            inside = path.absolute().is_relative_to(manifest.parent.absolute()) and ".." not in path.parts
            yield str(path), path.relative_to(manifest.parent) if inside else Path(path.name)


def _size(path: str) -> int:
    try:
        return Path(path).stat().st_size
    except OSError:
        return 0

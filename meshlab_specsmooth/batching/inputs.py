"""The input files of a batch, and the output file of each."""

from __future__ import annotations

import glob
import os
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from meshlab_specsmooth.errors import FileError, InvalidParameter
from meshlab_specsmooth.parameters import check_path, show

# formats that pymeshlab reads and that have triangles; other files of a folder are ignored
MESH_ENDINGS = frozenset(
    f".{name}"
    for name in (
        *("3ds", "3mf", "bre", "ctm", "dae", "e57", "fbx", "glb", "gltf", "gts"),
        *("obj", "off", "ply", "qobj", "stl", "tri", "vmi", "wrl", "x3d", "x3dv"),
    )
)
# a list of files, one per line
MANIFEST_ENDING = ".txt"
_MAX_LINE_LENGTH = 4096


@dataclass(frozen=True)
class Source:
    """A mesh file and its output file.

    Attributes
    ----------
    path : str
        Absolute.
    output : str
        Absolute.
    size : int
        Bytes of the file; 0 if there is none, which is reported when it is read.
    """

    path: str
    output: str
    size: int


def sources(
    paths: str | os.PathLike[str] | Iterable[str | os.PathLike[str]],
    out: str | os.PathLike[str],
    ending: str | None = None,
) -> tuple[Source, ...]:
    """Return the meshes of files, folders, patterns and manifests, in their order, each once.

    A single file keeps its name in the output folder. Meshes of a folder, at any depth, keep their path relative to it;
    those of a pattern keep the path relative to its last folder before a wildcard, those of a manifest the path
    relative to the manifest. Files in the output folder are not inputs of a folder or a pattern.

    Parameters
    ----------
    paths : path or iterable of paths
        Mesh files, folders, patterns (``"scans/**/*.ply"``), and manifests (``.txt``: a path per line, relative to the
        manifest; empty lines and those that begin with ``#`` are ignored).
    out : path
        The output folder.
    ending : str, optional
        Format of the outputs, such as ``".ply"``; that of each input by default.

    Raises
    ------
    FileError
        A manifest cannot be read, or there is no mesh in a folder or for a pattern.
    InvalidParameter
        Two meshes would have the same output file, or one would replace its input.

    Examples
    --------
    >>> from pathlib import PurePath
    >>> from meshlab_specsmooth.batching.inputs import sources
    >>> (scan,) = sources("scans/head.obj", "smooth", ".ply")
    >>> PurePath(scan.output).parts[-2:]
    ('smooth', 'head.ply')
    """
    if isinstance(paths, bytes | Mapping) or not isinstance(paths, str | os.PathLike | Iterable):
        raise InvalidParameter(f"paths is {show(paths)}; it must be a path, or several paths")
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
                f"{owners[name]} and {path} would both become {target}; pass the folder above them, or a pattern in "
                "quotation marks, and they keep their paths below it"
            )
        owners[name], places[source] = path, str(target)
    if not places:
        raise InvalidParameter("there is no mesh to smooth")
    return tuple(Source(path, output, _size(path)) for path, output in places.items())


def _expanded(given: str, out: Path) -> Iterator[tuple[str, Path]]:
    """Yield the files of one argument, and their paths in the output folder."""
    path = Path(given)
    if path.is_dir():
        yield from _below(path, (file for file in path.rglob("*") if _is_mesh(file)), out, f"{given}: contains no mesh")
    elif path.suffix.lower() == MANIFEST_ENDING:
        yield from _listed(path)
    elif not path.exists() and glob.has_magic(given):
        found = (Path(file) for file in glob.iglob(given, recursive=True))  # noqa: PTH207 (absolute as well)
        meshes = (file for file in found if _is_mesh(file))
        yield from _below(_fixed_part(path), meshes, out, f"{given}: matches no mesh")
    else:
        yield given, Path(path.name)


def _below(base: Path, files: Iterable[Path], out: Path, problem: str) -> Iterator[tuple[str, Path]]:
    kept = sorted(file for file in files if not file.absolute().is_relative_to(out))
    if not kept:
        raise FileError(problem)
    for file in kept:
        yield str(file), file.relative_to(base)


def _is_mesh(path: Path) -> bool:
    """Whether the name is that of a mesh that is not hidden: files are written in hidden folders first."""
    hidden = any(part.startswith(".") and part not in (".", "..") for part in path.parts[-2:])
    return path.suffix.lower() in MESH_ENDINGS and not hidden and path.is_file()


def _fixed_part(pattern: Path) -> Path:
    """Return the folders before the first wildcard."""
    parts = list(pattern.parts)
    first = next(number for number, part in enumerate(parts) if glob.has_magic(part))
    return Path(*parts[:first])


def _listed(manifest: Path) -> Iterator[tuple[str, Path]]:
    try:
        lines = manifest.read_text(encoding="utf-8").splitlines()
    except OSError as error:
        raise FileError(f"{manifest}: cannot be read: {error.strerror}") from error
    except UnicodeDecodeError as error:
        raise FileError(f"{manifest}: cannot be read: it is not UTF-8 text") from error
    for number, line in enumerate(lines, start=1):
        if len(line) > _MAX_LINE_LENGTH or "\0" in line:
            raise FileError(f"{manifest}:{number}: is not a path")
        if line.strip() and not line.startswith("#"):
            path = manifest.parent / line.strip()
            inside = path.absolute().is_relative_to(manifest.parent.absolute()) and ".." not in path.parts
            yield str(path), path.relative_to(manifest.parent) if inside else Path(path.name)


def _size(path: str) -> int:
    try:
        return Path(path).stat().st_size
    except OSError:
        return 0

"""Textures of a mesh file: those that it refers to and those embedded in it.

They are read from the file itself, as pymeshlab loses the names of textures that it cannot read.
"""

from __future__ import annotations

import itertools
import os
import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path, PurePosixPath
from urllib.parse import unquote

from meshlab_specsmooth.meshlab import gltf
from meshlab_specsmooth.meshlab.images import JPEG, PNG

# Options of map_Kd with their maximum number of arguments, which are numbers for those of _NUMERIC
_NUMERIC = {b"-s": 3, b"-o": 3, b"-t": 3, b"-mm": 2, b"-bm": 1, b"-boost": 1, b"-texres": 1}
_WORDS = {b"-blendu": 1, b"-blendv": 1, b"-cc": 1, b"-clamp": 1, b"-imfchan": 1, b"-type": 1, b"-colorspace": 1}
_NUMBER = re.compile(rb"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?")
# Characters that pymeshlab, a shell or another program does not accept in a name
_INVALID = re.compile(r"[\s\"'`<>:|?*&#;$%\\]+")
_INVALID_IN_PLY = re.compile(rf"(?:{_INVALID.pattern}|[^\x00-\x7f]+)+")
_MIME = {"image/png": ".png", "image/jpeg": ".jpg", "image/bmp": ".bmp", "image/gif": ".gif", "image/webp": ".webp"}
#: Names of embedded images; a number and a suffix follow.
EMBEDDED = "texture_"
_MAX_NAME_LENGTH = 200


@dataclass(frozen=True)
class Texture:
    """A texture of a mesh file.

    Attributes
    ----------
    written : str
        Its name in the mesh file.
    name : str
        Its name in a mesh read from the file, without characters that end a name for pymeshlab.
    file : Path or None
        The file referred to, which need not exist; None for an embedded image.
    data : bytes
        The embedded image.
    """

    written: str
    name: str
    file: Path | None = None
    data: bytes = field(default=b"", repr=False)


def textures_of(source: Path, prefix: str = "") -> list[Texture]:
    """List the textures of an OBJ (from its materials), PLY, glTF or GLB file in order; none for other formats.

    Parameters
    ----------
    source : Path
    prefix : str
        Prefix of the names of embedded images.
    """
    ending = source.suffix.lower()
    if ending in gltf.ENDINGS:
        return _of_gltf(source, prefix)
    if ending == ".ply":
        with source.open("rb") as file:
            written = values_of(_header(file), b"comment TextureFile")
    elif ending == ".obj":
        lines = itertools.chain.from_iterable(read_lines(material) for material in materials_of(source))
        written = [name for name in map(map_name, lines) if name]
    else:
        return []
    return _distinct(Texture(name, *_place(name, source)) for name in map(os.fsdecode, written))


def _distinct(textures: Iterable[Texture]) -> list[Texture]:
    """Remove duplicates, and number textures whose names would coincide."""
    found: dict[str, Texture] = {}
    taken: set[str] = set()
    for texture in textures:
        if texture.written in found:
            continue
        path = PurePosixPath(texture.name)
        numbered = (str(path.with_name(f"{path.stem}_{number}{path.suffix}")) for number in itertools.count(2))
        name = next(name for name in itertools.chain([texture.name], numbered) if name.casefold() not in taken)
        taken.add(name.casefold())
        found[texture.written] = Texture(texture.written, name, texture.file, texture.data)
    return list(found.values())


def _place(written: str, source: Path) -> tuple[str, Path]:
    """Return the name of a texture for pymeshlab, and the file referred to."""
    name = written.replace("\\", "/")
    if name.startswith("/") or re.match(
        r"[A-Za-z]:", name
    ):  # absolute, perhaps of another machine: search beside the mesh
        name = name.rpartition("/")[2]
    invalid = _INVALID_IN_PLY if source.suffix.lower() == ".ply" else _INVALID
    parts = [invalid.sub("_", part) for part in name.split("/")]
    return "/".join(
        "".join(c for c in part if c.isprintable())[-_MAX_NAME_LENGTH:] for part in parts
    ), source.parent / name


def _of_gltf(source: Path, prefix: str) -> list[Texture]:
    document, chunk = gltf.load(source)
    found = []
    for number, image in enumerate(gltf.rows(document, "images")):
        uri = image.get("uri")
        if isinstance(uri, str) and not uri.startswith("data:"):
            found.append(Texture(uri, *_place(unquote(uri), source)))
            continue
        data = gltf.image_data(document, chunk, image, source)
        ending = _MIME.get(str(image.get("mimeType")), "")
        if isinstance(uri, str):
            ending = _MIME.get(uri[5:].partition(";")[0].partition(",")[0], ending)
        ending = ".png" if data.startswith(PNG) else ".jpg" if data.startswith(JPEG) else ending or ".png"
        found.append(Texture(f"#{number}", f"{prefix}{EMBEDDED}{number}{ending}", None, data))
    return _distinct(found)


def materials_of(source: Path) -> list[Path]:
    """List the existing material files of an OBJ file; if there are none, the one with its name, as pymeshlab does."""
    with source.open("rb") as file:
        named = values_of(file, b"mtllib")
    found = []
    for value in named:
        whole = os.fsdecode(value).strip('"').replace("\\", "/")
        words = [whole] if (source.parent / whole).is_file() else whole.split()
        found += [source.parent / word for word in words]
    existing = [path for path in dict.fromkeys(found) if path.is_file()]
    own = source.with_suffix(".mtl")
    return existing or ([own] if own.is_file() else [])


def read_lines(path: Path) -> Iterator[bytes]:
    """Yield the lines of a file."""
    with path.open("rb") as file:
        yield from file


def _header(lines: Iterable[bytes]) -> Iterator[bytes]:
    return itertools.takewhile(lambda line: line.strip() != b"end_header", lines)


def values_of(lines: Iterable[bytes], key: bytes) -> list[bytes]:
    """Return the rest of each line that starts with a keyword."""
    stripped = (line.strip() for line in lines if line.lstrip().startswith(key))
    return [line[len(key) :].strip() for line in stripped if line[len(key) : len(key) + 1] in (b" ", b"\t")]


def map_name(line: bytes) -> bytes:
    """Return the texture that a line of a material file names, without options; empty if it names none."""
    values = values_of([line], b"map_Kd")
    return split_map(values[0])[1] if values else b""


def split_map(value: bytes) -> tuple[bytes, bytes]:
    """Split the value of ``map_Kd`` into its options and the name of the file.

    Examples
    --------
    >>> from meshlab_specsmooth.meshlab.textures import split_map
    >>> split_map(b"-s 2 2 1 -clamp on photo 1.png")
    (b'-s 2 2 1 -clamp on', b'photo 1.png')
    """
    rest = value.strip()
    while True:
        word, _, after = _partition(rest)
        if word in _WORDS:
            rest = _partition(after)[2]
        elif word in _NUMERIC:
            for _ in range(_NUMERIC[word]):
                number, _, following = _partition(after)
                if not following or not _NUMBER.fullmatch(number):
                    break
                after = following
            rest = after
        else:
            break
    options = value.strip()[: len(value.strip()) - len(rest)].strip()
    if len(rest) > 1 and rest[:1] == rest[-1:] == b'"':
        rest = rest[1:-1]
    return options, re.split(rb"\s#", rest)[0].strip()


def _partition(text: bytes) -> tuple[bytes, bytes, bytes]:
    word, *rest = text.split(None, 1)[:2] or [b""]
    return word, b" ", rest[0] if rest else b""

"""Textures that a mesh file refers to or holds, and which of them may be copied beside another mesh.

They are read from the file itself: pymeshlab forgets the names of those that it cannot read. What a stranger's file
names need not be an image, so that nothing is copied but files that are images by name and by their first bytes.
"""

from __future__ import annotations

import base64
import binascii
import itertools
import os
import re
import shutil
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path, PurePosixPath
from typing import Any
from urllib.parse import unquote, unquote_to_bytes

from meshlab_specsmooth.meshlab import gltf

#: Endings of the names of images.
ENDINGS = frozenset(
    f".{ending}"
    for ending in (
        *("bmp", "dds", "exr", "gif", "hdr", "jfif", "jp2", "jpe", "jpeg", "jpg", "pbm", "pgm", "png", "pnm", "ppm"),
        *("psd", "tga", "tif", "tiff", "webp"),
    )
)
_START = 64
_MAGIC = (
    *(b"\x89PNG\r\n\x1a\n", b"\xff\xd8\xff", b"GIF87a", b"GIF89a", b"II*\0", b"MM\0*", b"II+\0", b"MM\0+"),
    *(b"DDS \x7c\0\0\0", b"\x76\x2f\x31\x01", b"#?RADIANCE", b"#?RGBE", b"8BPS\0\x01", b"\0\0\0\x0cjP  \r\n"),
)
# a bitmap's second header says its own length
_BMP_HEADERS = frozenset((12, 16, 40, 52, 56, 64, 108, 124))
_PNM = re.compile(rb"P[1-6]\s(?:\s|#[^\n]*\n)*\d+\s(?:\s|#[^\n]*\n)*\d+\s")
_TGA_HEADER = 18
# options of a material's map, and how many words at most follow each; those of _NUMERIC are numbers
_NUMERIC = {b"-s": 3, b"-o": 3, b"-t": 3, b"-mm": 2, b"-bm": 1, b"-boost": 1, b"-texres": 1}
_WORDS = {b"-blendu": 1, b"-blendv": 1, b"-cc": 1, b"-clamp": 1, b"-imfchan": 1, b"-type": 1, b"-colorspace": 1}
_NUMBER = re.compile(rb"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?")
# what pymeshlab, a shell or another program would not take for a part of a name
_ODD = re.compile(r"[\s\"'`<>:|?*&#;$%\\]+")
_ODD_IN_PLY = re.compile(rf"(?:{_ODD.pattern}|[^\x00-\x7f]+)+")
_MIME = {"image/png": ".png", "image/jpeg": ".jpg", "image/bmp": ".bmp", "image/gif": ".gif", "image/webp": ".webp"}
#: What the images inside of a file are called; a number and an ending follow.
EMBEDDED = "texture_"
# in the copy of a mesh, the file of all its materials
_MATERIALS = "materials.mtl"
_NAME_LENGTH = 200


@dataclass(frozen=True)
class Texture:
    """A texture of a mesh file.

    Attributes
    ----------
    written : str
        As the file has it.
    name : str
        As a mesh has it that was read from the file: without what pymeshlab takes for the end of a name.
    file : Path or None
        The file that is meant, which need not be there; None of an image inside of the mesh file.
    data : bytes
        The image inside of the mesh file.
    """

    written: str
    name: str
    file: Path | None = None
    data: bytes = field(default=b"", repr=False)


def textures_of(source: Path, prefix: str = "") -> list[Texture]:
    """The textures of an OBJ (by way of its materials), PLY, glTF or GLB file, in its order; of others none.

    Parameters
    ----------
    source : Path
    prefix : str
        Begins the names of images that are inside of the file.
    """
    ending = source.suffix.lower()
    if ending in gltf.ENDINGS:
        return _of_gltf(source, prefix)
    if ending == ".ply":
        with source.open("rb") as file:
            written = _values(_header(file), b"comment TextureFile")
    elif ending == ".obj":
        lines = itertools.chain.from_iterable(_lines(material) for material in materials_of(source))
        written = [name for name in map(_map_name, lines) if name]
    else:
        return []
    return _distinct(Texture(name, *_place(name, source)) for name in map(os.fsdecode, written))


def _distinct(textures: Iterable[Texture]) -> list[Texture]:
    """Each once; of two whose names would become one, the second has a number."""
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
    """The name that pymeshlab is given for a texture, and the file that is meant."""
    name = written.replace("\\", "/")
    if name.startswith("/") or re.match(r"[A-Za-z]:", name):  # of this machine or another: looked for beside the mesh
        name = name.rpartition("/")[2]
    odd = _ODD_IN_PLY if source.suffix.lower() == ".ply" else _ODD
    parts = [odd.sub("_", part) for part in name.split("/")]
    return "/".join("".join(c for c in part if c.isprintable())[-_NAME_LENGTH:] for part in parts), source.parent / name


def _of_gltf(source: Path, prefix: str) -> list[Texture]:
    document, chunk = gltf.load(source)
    found = []
    for number, image in enumerate(gltf.rows(document, "images")):
        uri = image.get("uri")
        if isinstance(uri, str) and not uri.startswith("data:"):
            found.append(Texture(uri, *_place(unquote(uri), source)))
            continue
        data = _inside(document, chunk, image, source)
        ending = _MIME.get(str(image.get("mimeType")), "")
        if isinstance(uri, str):
            ending = _MIME.get(uri[5:].partition(";")[0].partition(",")[0], ending)
        known = next((known for known in (".png", ".jpg") if data.startswith(_MAGIC[known == ".jpg"])), ending)
        found.append(Texture(f"#{number}", f"{prefix}{EMBEDDED}{number}{known or '.png'}", None, data))
    return _distinct(found)


def _inside(document: dict[str, Any], chunk: bytes, image: dict[str, Any], source: Path) -> bytes:
    """The bytes of an image that is in the document itself, or in a buffer of it; none where they are not there."""
    uri = image.get("uri")
    if isinstance(uri, str):
        return data_of(uri)
    view = gltf.row(document, "bufferViews", image.get("bufferView"))
    number, start, length = (view.get(key, 0) for key in ("buffer", "byteOffset", "byteLength"))
    buffer = gltf.row(document, "buffers", number)
    if not (isinstance(start, int) and isinstance(length, int) and start >= 0 and length >= 0):
        return b""
    uri = buffer.get("uri")
    if uri is None:
        return chunk[start : start + length]
    if not isinstance(uri, str):
        return b""
    if uri.startswith("data:"):
        return data_of(uri)[start : start + length]
    path = source.parent / unquote(uri)
    if not is_inside(unquote(uri)) or not path.is_file():
        return b""
    with path.open("rb") as file:
        file.seek(start)
        return file.read(length)


def data_of(uri: str) -> bytes:
    """The bytes of a ``data:`` URI; none where it is malformed."""
    head, _, body = uri.partition(",")
    if not head.endswith(";base64"):
        return unquote_to_bytes(body)
    try:
        return base64.b64decode(unquote_to_bytes(body))
    except binascii.Error:
        return b""


def materials_of(source: Path) -> list[Path]:
    """The material files of an OBJ file that are there; as pymeshlab does, that of its own name where none is."""
    with source.open("rb") as file:
        named = _values(file, b"mtllib")
    found = []
    for value in named:
        whole = os.fsdecode(value).strip('"').replace("\\", "/")
        words = [whole] if (source.parent / whole).is_file() else whole.split()
        found += [source.parent / word for word in words]
    there = [path for path in dict.fromkeys(found) if path.is_file()]
    own = source.with_suffix(".mtl")
    return there or ([own] if own.is_file() else [])


def _lines(path: Path) -> Iterator[bytes]:
    with path.open("rb") as file:
        yield from file


def _header(lines: Iterable[bytes]) -> Iterator[bytes]:
    return itertools.takewhile(lambda line: line.strip() != b"end_header", lines)


def _values(lines: Iterable[bytes], key: bytes) -> list[bytes]:
    """What follows a keyword, on each line that starts with it."""
    stripped = (line.strip() for line in lines if line.lstrip().startswith(key))
    return [line[len(key) :].strip() for line in stripped if line[len(key) : len(key) + 1] in (b" ", b"\t")]


def _map_name(line: bytes) -> bytes:
    """The texture that a line of a material file names, without the options of the map; empty where it names none."""
    values = _values([line], b"map_Kd")
    return split_map(values[0])[1] if values else b""


def split_map(value: bytes) -> tuple[bytes, bytes]:
    """Options, and the name of the file, of what follows ``map_Kd``.

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


def is_inside(name: str) -> bool:
    """Whether a relative path stays in its folder."""
    return not Path(name).is_absolute() and ".." not in Path(name).parts


def is_image_name(name: str) -> bool:
    """Whether a relative name is one of an image that is not hidden, in its folder or a folder below it.

    Examples
    --------
    >>> from meshlab_specsmooth.meshlab.textures import is_image_name
    >>> [is_image_name(name) for name in ("a/b.png", "a/b.txt", ".a/b.png", "../b.png", ".png")]
    [True, False, False, False, False]
    """
    path = PurePosixPath(name)
    visible = not any(part.startswith(".") for part in path.parts)
    return is_inside(name) and visible and path.suffix.lower() in ENDINGS and name.isprintable() and "\\" not in name


def is_image(path: Path) -> bool:
    """Whether a regular file, no link, is an image by the ending of its name and by its first bytes."""
    if path.is_symlink() or not path.is_file() or path.suffix.lower() not in ENDINGS:
        return False
    with path.open("rb") as file:
        return is_image_data(file.read(_START), path.stat().st_size, path.suffix)


def is_image_data(start: bytes, size: int, ending: str) -> bool:
    """Whether the first bytes of so many are those of an image; the ending says of which kind, where they do not."""
    if start.startswith(_MAGIC) or _PNM.match(start) or (start[:4] == b"RIFF" and start[8:12] == b"WEBP"):
        return True
    if start[:2] == b"BM" and int.from_bytes(start[14:18], "little") in _BMP_HEADERS:
        return True
    return ending.lower() == ".tga" and _is_tga(start, size)


def _is_tga(start: bytes, size: int) -> bool:
    """Whether a header is plausible: the format has no bytes that tell it."""
    if len(start) < _TGA_HEADER:
        return False
    identity, has_map, kind = start[:3]
    map_length, map_bits = int.from_bytes(start[5:7], "little"), start[7]
    width, height = (int.from_bytes(start[at : at + 2], "little") for at in (12, 14))
    bits, descriptor = start[16:18]
    if kind not in (1, 2, 3, 9, 10, 11) or has_map not in (0, 1) or width == 0 or height == 0 or descriptor & 0xC0:
        return False
    if has_map and map_bits not in (15, 16, 24, 32):
        return False
    if (kind in (1, 9) and (not has_map or bits not in (8, 16))) or bits not in (8, 15, 16, 24, 32):
        return False
    least = _TGA_HEADER + identity + (map_length * ((map_bits + 7) // 8) if has_map else 0)
    return size >= least + (width * height * ((bits + 7) // 8) if kind < 9 else 1)


def is_linked(folder: Path, name: str) -> bool:
    """Whether a part of a path below a folder is a symbolic link."""
    path = folder
    for part in PurePosixPath(name).parts:
        path /= part
        if path.is_symlink():
            return True
    return False


def copy_renamed(source: Path, folder: Path, textures: Sequence[Texture], stand_in: bytes) -> Path:
    """A copy of a mesh file in a folder, which refers to its textures by the names that a mesh is to have them by.

    Those inside of the file are files beside the copy, and so is a stand-in for each other one.

    Parameters
    ----------
    source, folder : Path
    textures : sequence of Texture
    stand_in : bytes
        An image that pymeshlab reads whatever the ending of its name.

    Returns
    -------
    Path
        Below the folder, at a depth from which names that lead out of the mesh's folder do not lead out of this one.
    """
    depth = max((texture.name.split("/").count("..") for texture in textures), default=0)
    place = folder.joinpath(*("x" * depth))
    for texture in textures:
        target = Path(os.path.normpath(place / texture.name))
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_bytes(texture.data if texture.file is None else stand_in)
    place.mkdir(parents=True, exist_ok=True)
    names = {texture.written: texture.name for texture in textures}
    copy = place / source.name
    if source.suffix.lower() in gltf.ENDINGS:
        gltf.copy_with_images(source, copy, [names.get(_written(i, image), "") for i, image in _images(source)])
    elif source.suffix.lower() == ".ply":
        _copy_ply(source, copy, names)
    elif source.suffix.lower() == ".obj":
        _copy_obj(source, copy, names)
    else:
        shutil.copyfile(source, copy)
    return copy


def _images(source: Path) -> Iterator[tuple[int, dict[str, Any]]]:
    return enumerate(gltf.rows(gltf.load(source)[0], "images"))


def _written(number: int, image: dict[str, Any]) -> str:
    uri = image.get("uri")
    return uri if isinstance(uri, str) and not uri.startswith("data:") else f"#{number}"


def _copy_ply(source: Path, copy: Path, names: dict[str, str]) -> None:
    with source.open("rb") as old, copy.open("wb") as new:
        for line in old:
            values = _values([line], b"comment TextureFile")
            name = names.get(os.fsdecode(values[0])) if values else None
            new.write(line if name is None else b"comment TextureFile " + os.fsencode(name) + b"\n")
            if line.strip() == b"end_header":
                break
        shutil.copyfileobj(old, new)


def _copy_obj(source: Path, copy: Path, names: dict[str, str]) -> None:
    with source.open("rb") as old, copy.open("wb") as new:
        new.write(f"mtllib {_MATERIALS}\n".encode())
        new.writelines(line for line in old if not line.lstrip().startswith(b"mtllib"))
    with (copy.parent / _MATERIALS).open("wb") as materials:
        for path in materials_of(source):
            for line in _lines(path):
                name = names.get(os.fsdecode(_map_name(line)))
                materials.write(line if name is None else b"map_Kd " + os.fsencode(name) + b"\n")
            materials.write(b"\n")

"""Recognize image files by their names and first bytes."""

from __future__ import annotations

import re
import struct
import zlib
from pathlib import Path, PurePosixPath

#: Suffixes of image files.
ENDINGS = frozenset(
    f".{ending}"
    for ending in (
        *("bmp", "dds", "exr", "gif", "hdr", "jfif", "jp2", "jpe", "jpeg", "jpg", "pbm", "pgm", "png", "pnm", "ppm"),
        *("psd", "tga", "tif", "tiff", "webp"),
    )
)
_HEADER_LENGTH = 64
#: Signatures.
PNG, JPEG = b"\x89PNG\r\n\x1a\n", b"\xff\xd8\xff"
_MAGIC = (
    *(PNG, JPEG, b"GIF87a", b"GIF89a", b"II*\0", b"MM\0*", b"II+\0", b"MM\0+"),
    *(b"DDS \x7c\0\0\0", b"\x76\x2f\x31\x01", b"#?RADIANCE", b"#?RGBE", b"8BPS\0\x01", b"\0\0\0\x0cjP  \r\n"),
)
# Lengths of the known variants of the second header of BMP
_BMP_HEADERS = frozenset((12, 16, 40, 52, 56, 64, 108, 124))
_PNM = re.compile(rb"P[1-6]\s(?:\s|#[^\n]*\n)*\d+\s(?:\s|#[^\n]*\n)*\d+\s")
_TGA_HEADER = 18

#: An image of a size that no texture has, in place of one that pymeshlab cannot read; it reads PNG whatever the suffix.
STAND_IN_SIZE = (1, 997)


def _black_png(width: int, height: int) -> bytes:
    """Encode a black grayscale image."""
    header = struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0)
    chunks = ((b"IHDR", header), (b"IDAT", zlib.compress(bytes((width + 1) * height))), (b"IEND", b""))
    framed = (
        struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data)) for kind, data in chunks
    )
    return PNG + b"".join(framed)


STAND_IN = _black_png(*STAND_IN_SIZE)


def is_inside(name: str) -> bool:
    """Whether a relative path stays in its folder."""
    return not Path(name).is_absolute() and ".." not in Path(name).parts


def is_image_name(name: str) -> bool:
    """Whether a relative path names an image that is not hidden, in its folder or below.

    Examples
    --------
    >>> from meshlab_specsmooth.meshlab.images import is_image_name
    >>> [is_image_name(name) for name in ("a/b.png", "a/b.txt", ".a/b.png", "../b.png", ".png")]
    [True, False, False, False, False]
    """
    path = PurePosixPath(name)
    visible = not any(part.startswith(".") for part in path.parts)
    return is_inside(name) and visible and path.suffix.lower() in ENDINGS and name.isprintable() and "\\" not in name


def is_image(path: Path) -> bool:
    """Whether a path is a regular file, not a link, with the suffix and the first bytes of an image."""
    if path.is_symlink() or not path.is_file() or path.suffix.lower() not in ENDINGS:
        return False
    with path.open("rb") as file:
        return is_image_data(file.read(_HEADER_LENGTH), path.stat().st_size, path.suffix)


def is_image_data(start: bytes, size: int, ending: str) -> bool:
    """Whether data begins like an image.

    Parameters
    ----------
    start : bytes
        The first bytes.
    size : int
        Number of all bytes.
    ending : str
        Suffix of the name; only TGA, which has no signature, is recognized with its help.
    """
    if start.startswith(_MAGIC) or _PNM.match(start) or (start[:4] == b"RIFF" and start[8:12] == b"WEBP"):
        return True
    if start[:2] == b"BM" and int.from_bytes(start[14:18], "little") in _BMP_HEADERS:
        return True
    return ending.lower() == ".tga" and _is_tga(start, size)


def _is_tga(start: bytes, size: int) -> bool:
    """Whether a TGA header is plausible; the format has no signature."""
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
    min_size = _TGA_HEADER + identity + (map_length * ((map_bits + 7) // 8) if has_map else 0)
    return size >= min_size + (width * height * ((bits + 7) // 8) if kind < 9 else 1)

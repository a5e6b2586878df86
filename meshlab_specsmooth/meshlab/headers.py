"""Compare the header of a mesh file with its size before pymeshlab reads it.

pymeshlab allocates memory for any number of vertices that a header declares, and reads some invalid STL files without
end, so that a small file could consume all memory or all time.
"""

from __future__ import annotations

import itertools
import re
from pathlib import Path

from meshlab_specsmooth.errors import FileError
from meshlab_specsmooth.meshlab import gltf

# Longer headers are invalid
_MAX_HEADER_LENGTH = 2**20
# pymeshlab crashes on an element whose name has a thousand letters
_MAX_NAME_LENGTH = 200
_STL_HEADER, _STL_FACET = 84, 50
_BYTES = {
    **dict.fromkeys(("char", "uchar", "int8", "uint8"), 1),
    **dict.fromkeys(("short", "ushort", "int16", "uint16"), 2),
    **dict.fromkeys(("int", "uint", "int32", "uint32", "float", "float32"), 4),
    **dict.fromkeys(("double", "float64"), 8),
}


def check(path: Path) -> None:
    """Refuse a file whose header declares more data than it contains.

    Raises
    ------
    FileError
        The message names the contradiction.
    """
    size = path.stat().st_size
    with path.open("rb") as file:
        start = file.read(_MAX_HEADER_LENGTH)
    checker = {".ply": _check_ply, ".stl": _check_stl, ".off": _check_off}.get(path.suffix.lower())
    if path.suffix.lower() in gltf.ENDINGS:
        problem = gltf.find_problem(path)
    else:
        problem = None if checker is None else checker(start, size)
    if problem is not None:
        raise FileError(f"{path}: cannot be read: {problem}")


def _check_ply(start: bytes, size: int) -> str | None:
    end = re.search(rb"^end_header\s", start, re.MULTILINE)
    if end is None:
        return (
            None
            if len(start) == size < _MAX_HEADER_LENGTH
            else f"its header does not end within {_MAX_HEADER_LENGTH} bytes"
        )
    is_text = re.search(rb"^format\s+ascii", start[: end.start()], re.MULTILINE) is not None
    min_size = 0
    count: int | None = 0
    each = 0
    for words in itertools.chain(map(bytes.split, start[: end.start()].splitlines()), [[b"element", b"", b"0"]]):
        if words[:1] in ([b"element"], [b"property"]) and max(map(len, words)) > _MAX_NAME_LENGTH:
            return f"its header has a name of more than {_MAX_NAME_LENGTH} letters"
        if words[:1] == [b"element"]:
            min_size += (count or 0) * max(each, 1)
            count, each = _parse_count(words[2:3]), 0
            if count is None:
                return "its header has an element without a count"
        elif words[:1] == [b"property"]:
            each += 2 if is_text else _BYTES.get(words[1].decode("latin-1") if len(words) > 1 else "", 1)
    if end.end() + min_size > size + 1:  # the last line of a text may lack its end
        return f"its header declares at least {min_size} bytes, but {size - end.end()} follow"
    return None


def _parse_count(words: list[bytes]) -> int | None:
    """Parse a non-negative integer of plausible length."""
    return int(words[0]) if words and re.fullmatch(rb"[0-9]{1,18}", words[0]) else None


def _check_stl(start: bytes, size: int) -> str | None:
    if start.lstrip()[:5].lower() == b"solid" and b"\0" not in start:  # text, of any length
        return None if b"\n" in start else "it is text without line breaks"
    declared = _STL_HEADER + _STL_FACET * int.from_bytes(start[80:_STL_HEADER], "little")
    # pymeshlab accepts additional bytes if the first ones cannot be text; otherwise it reads without end
    has_binary_bytes = any(byte > 127 for byte in start[_STL_HEADER : _STL_HEADER + 1000])
    if size == declared or (size > declared and has_binary_bytes):
        return None
    return f"it is not text, and as binary STL its header declares {declared} bytes, but it has {size}"


def _check_off(start: bytes, size: int) -> str | None:
    text = re.sub(rb"#[^\n]*", b"", start).split(maxsplit=4)
    numbers = text[1:] if text and not text[0][:1].isdigit() else text
    counts = [_parse_count([word]) for word in numbers[:2]]
    if len(counts) < 2 and b"BINARY" not in text[:2]:
        return "its header lacks the numbers of vertices and faces"
    # three digits with spaces are the shortest vertex, and the shortest face
    if b"BINARY" not in text[:2] and any(count is not None and 4 * count > size for count in counts):
        return f"its header declares {counts[0]} vertices and {counts[1]} faces, but it has {size} bytes"
    return None

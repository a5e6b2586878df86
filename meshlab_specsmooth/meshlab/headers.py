"""What a mesh file promises in its header, held against its size before pymeshlab believes it.

pymeshlab makes room for whatever number of vertices a header names, and reads some files that it takes for STL without
end. So a file of some bytes could take all memory, or all time.
"""

from __future__ import annotations

import itertools
import re
from pathlib import Path

from meshlab_specsmooth.errors import FileError
from meshlab_specsmooth.meshlab import gltf

# a header longer than this is none
_LONGEST_HEADER = 2**20
# pymeshlab dies of an element whose name has a thousand letters
_LONGEST_NAME = 200
_STL_HEADER, _STL_FACET = 84, 50
_BYTES = {
    **dict.fromkeys(("char", "uchar", "int8", "uint8"), 1),
    **dict.fromkeys(("short", "ushort", "int16", "uint16"), 2),
    **dict.fromkeys(("int", "uint", "int32", "uint32", "float", "float32"), 4),
    **dict.fromkeys(("double", "float64"), 8),
}


def check(path: Path) -> None:
    """Refuse a file that promises more than it can hold.

    Raises
    ------
    FileError
    """
    size = path.stat().st_size
    with path.open("rb") as file:
        start = file.read(_LONGEST_HEADER)
    checker = {".ply": _check_ply, ".stl": _check_stl, ".off": _check_off}.get(path.suffix.lower())
    if path.suffix.lower() in gltf.ENDINGS:
        problem = gltf.problem(path)
    else:
        problem = None if checker is None else checker(start, size)
    if problem is not None:
        raise FileError(f"{path}: cannot be read: {problem}")


def _check_ply(start: bytes, size: int) -> str | None:
    end = re.search(rb"^end_header\s", start, re.MULTILINE)
    if end is None:
        return None if len(start) == size < _LONGEST_HEADER else f"its header has no end within {_LONGEST_HEADER} bytes"
    is_text = re.search(rb"^format\s+ascii", start[: end.start()], re.MULTILINE) is not None
    least = 0
    count: int | None = 0
    each = 0
    for words in itertools.chain(map(bytes.split, start[: end.start()].splitlines()), [[b"element", b"", b"0"]]):
        if words[:1] in ([b"element"], [b"property"]) and max(map(len, words)) > _LONGEST_NAME:
            return f"its header has a name of more than {_LONGEST_NAME} letters"
        if words[:1] == [b"element"]:
            least += (count or 0) * max(each, 1)
            count, each = _whole(words[2:3]), 0
            if count is None:
                return "its header has an element without a number"
        elif words[:1] == [b"property"]:
            each += 2 if is_text else _BYTES.get(words[1].decode("latin-1") if len(words) > 1 else "", 1)
    if end.end() + least > size + 1:  # the last line of a text needs no end
        return f"its header promises {least} bytes or more, and {size - end.end()} follow"
    return None


def _whole(words: list[bytes]) -> int | None:
    """A number that is not negative and no longer than any that is meant."""
    return int(words[0]) if words and re.fullmatch(rb"[0-9]{1,18}", words[0]) else None


def _check_stl(start: bytes, size: int) -> str | None:
    if start.lstrip()[:5].lower() == b"solid" and b"\0" not in start:  # text, of any length
        return None if b"\n" in start else "it is text without lines"
    promised = _STL_HEADER + _STL_FACET * int.from_bytes(start[80:_STL_HEADER], "little")
    # what has more bytes pymeshlab takes for binary as well, but only where these could be no text; else it never ends
    is_told_by_its_bytes = any(byte > 127 for byte in start[_STL_HEADER : _STL_HEADER + 1000])
    if size == promised or (size > promised and is_told_by_its_bytes):
        return None
    return f"it is no text, and as binary STL its header promises {promised} bytes, and it has {size}"


def _check_off(start: bytes, size: int) -> str | None:
    text = re.sub(rb"#[^\n]*", b"", start).split(maxsplit=4)
    numbers = text[1:] if text and not text[0][:1].isdigit() else text
    counts = [_whole([word]) for word in numbers[:2]]
    if len(counts) < 2 and b"BINARY" not in text[:2]:
        return "its header has no numbers of vertices and faces"
    # the shortest vertex is three digits with spaces; so is the shortest face
    if b"BINARY" not in text[:2] and any(count is not None and 4 * count > size for count in counts):
        return f"its header promises {counts[0]} vertices and {counts[1]} faces, and it has {size} bytes"
    return None

"""glTF and GLB files: validation before pymeshlab reads them, embedded images, and copies with other images.

pymeshlab reads every primitive except points as separate triangles, without checking the number of corners. Invalid
files therefore make it write beyond its memory, and the process crashes sooner or later.
"""

from __future__ import annotations

import base64
import binascii
import json
import shutil
import struct
from collections.abc import Sequence
from pathlib import Path
from typing import Any
from urllib.parse import quote, unquote, unquote_to_bytes

from meshlab_specsmooth.meshlab.images import is_inside

#: Suffixes of such files.
ENDINGS = (".gltf", ".glb")
_MODES = ("points", "lines", "line loops", "line strips", "triangles", "triangle strips", "triangle fans")
_POINTS, _TRIANGLES = 0, 4
_MAGIC, _HEADER = b"glTF", 12
_JSON, _BINARY = 0x4E4F534A, 0x004E4942
_COMPONENTS = {5120: 1, 5121: 1, 5122: 2, 5123: 2, 5125: 4, 5126: 4}
_SHAPES = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT2": 4, "MAT3": 9, "MAT4": 16}


def load(path: Path) -> tuple[dict[str, Any], bytes]:
    """Read the JSON document of a file and its binary chunk; both are empty if the file is malformed."""
    data = path.read_bytes()
    text, chunk = data, b""
    if data[:4] == _MAGIC:
        chunks = dict(reversed(_chunks(data)))  # the first of each kind
        text, chunk = chunks.get(_JSON, b""), chunks.get(_BINARY, b"")
    try:
        document = json.loads(text)
    except (ValueError, RecursionError):
        return {}, b""
    return (document, chunk) if isinstance(document, dict) else ({}, b"")


def _chunks(data: bytes) -> list[tuple[int, bytes]]:
    found, at = [], _HEADER
    while at + 8 <= len(data):
        length, kind = struct.unpack_from("<II", data, at)
        found.append((kind, data[at + 8 : at + 8 + length]))
        at += 8 + length
    return found


def rows(document: dict[str, Any], key: str) -> list[dict[str, Any]]:
    """Return the objects of a list in the document; empty if there is no such list."""
    found = document.get(key)
    return [row if isinstance(row, dict) else {} for row in found] if isinstance(found, list) else []


def row(document: dict[str, Any], key: str, number: object) -> dict[str, Any]:
    """Return one object of a list in the document; empty if there is none."""
    found = rows(document, key)
    return found[number] if type(number) is int and 0 <= number < len(found) else {}


def find_problem(path: Path) -> str | None:
    """Describe what pymeshlab would misread or crash on; None if the file is fine."""
    document, _ = load(path)
    for mesh in rows(document, "meshes"):
        for primitive in rows(mesh, "primitives"):
            found = _check_primitive(document, primitive)
            if found is not None:
                return found
    return None


def _check_primitive(document: dict[str, Any], primitive: dict[str, Any]) -> str | None:
    mode = primitive.get("mode", _TRIANGLES)
    if mode == _POINTS:
        return None
    if mode != _TRIANGLES:
        name = _MODES[mode] if type(mode) is int and 0 <= mode < len(_MODES) else f"primitives of mode {mode!r}"
        return f"it has {name}, which pymeshlab reads as separate triangles; export it with triangles only"
    if "extensions" in primitive and "KHR_draco_mesh_compression" in primitive["extensions"]:
        return None  # reported by pymeshlab itself
    attributes = primitive.get("attributes")
    positions = row(document, "accessors", attributes.get("POSITION") if isinstance(attributes, dict) else None)
    corners = row(document, "accessors", primitive["indices"]) if "indices" in primitive else positions
    for accessor in (positions, corners):
        found = _check_accessor(document, accessor)
        if found is not None:
            return found
    if corners["count"] % 3:
        return f"its triangles have {corners['count']} corners, which is not a multiple of three"
    return None


def _check_accessor(document: dict[str, Any], accessor: dict[str, Any]) -> str | None:
    """Check that an accessor stays within its buffer view."""
    count, offset = accessor.get("count"), accessor.get("byteOffset", 0)
    each = _COMPONENTS.get(accessor.get("componentType", 0), 0) * _SHAPES.get(str(accessor.get("type")), 0)
    if type(count) is not int or type(offset) is not int or min(count, offset) < 0 or each == 0:
        return "it has triangles without positions, or an accessor without count or type"
    if "bufferView" not in accessor:
        return None
    view = row(document, "bufferViews", accessor["bufferView"])
    length, stride = view.get("byteLength"), view.get("byteStride", each)
    if type(length) is not int or type(stride) is not int or offset + (count - 1) * stride + each > length:
        return f"an accessor has {count} elements, which its buffer view of {length} bytes cannot hold"
    return None


def image_data(document: dict[str, Any], chunk: bytes, image: dict[str, Any], source: Path) -> bytes:
    """Return the bytes of an image inside the document or one of its buffers; empty if they are missing."""
    uri = image.get("uri")
    if isinstance(uri, str):
        return _decode_data_uri(uri)
    view = row(document, "bufferViews", image.get("bufferView"))
    number, start, length = (view.get(key, 0) for key in ("buffer", "byteOffset", "byteLength"))
    buffer = row(document, "buffers", number)
    if not (isinstance(start, int) and isinstance(length, int) and start >= 0 and length >= 0):
        return b""
    uri = buffer.get("uri")
    if uri is None:
        return chunk[start : start + length]
    if not isinstance(uri, str):
        return b""
    if uri.startswith("data:"):
        return _decode_data_uri(uri)[start : start + length]
    path = source.parent / unquote(uri)
    if not is_inside(unquote(uri)) or not path.is_file():
        return b""
    with path.open("rb") as file:
        file.seek(start)
        return file.read(length)


def _decode_data_uri(uri: str) -> bytes:
    """Decode a ``data:`` URI; empty if it is malformed."""
    head, _, body = uri.partition(",")
    if not head.endswith(";base64"):
        return unquote_to_bytes(body)
    try:
        return base64.b64decode(unquote_to_bytes(body))
    except binascii.Error:
        return b""


def copy_with_images(source: Path, copy: Path, names: Sequence[str]) -> None:
    """Copy a file, with the buffers in its folder, and replace its images by files with these names."""
    data = source.read_bytes()
    document, chunk = load(source)
    for image, name in zip(rows(document, "images"), names, strict=True):
        image.pop("bufferView", None)
        image["uri"] = quote(name)
    for buffer in rows(document, "buffers"):
        uri = buffer.get("uri")
        if isinstance(uri, str) and not uri.startswith("data:"):
            name = unquote(uri)
            if is_inside(name) and (source.parent / name).is_file():
                (copy.parent / name).parent.mkdir(parents=True, exist_ok=True)
                shutil.copyfile(source.parent / name, copy.parent / name)
    text = json.dumps(document).encode()
    if data[:4] != _MAGIC:
        copy.write_bytes(text)
        return
    text += b" " * (-len(text) % 4)
    binary = chunk + bytes(-len(chunk) % 4)
    parts = [struct.pack("<II", len(text), _JSON), text]
    if chunk:
        parts += [struct.pack("<II", len(binary), _BINARY), binary]
    copy.write_bytes(struct.pack("<4sII", _MAGIC, 2, _HEADER + sum(map(len, parts))) + b"".join(parts))

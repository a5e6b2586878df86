"""glTF and GLB files: what their document says, checked before pymeshlab believes it; copies with other images.

pymeshlab reads every primitive but points as triangles, whatever it is, and writes beyond its memory where they do not
come out even: the process then ends, sooner or later.
"""

from __future__ import annotations

import json
import shutil
import struct
from collections.abc import Sequence
from pathlib import Path
from typing import Any
from urllib.parse import quote, unquote

#: Endings of the names of such files.
ENDINGS = (".gltf", ".glb")
_MODES = ("points", "lines", "line loops", "line strips", "triangles", "triangle strips", "triangle fans")
_POINTS, _TRIANGLES = 0, 4
_MAGIC, _HEADER = b"glTF", 12
_JSON, _BINARY = 0x4E4F534A, 0x004E4942
_COMPONENTS = {5120: 1, 5121: 1, 5122: 2, 5123: 2, 5125: 4, 5126: 4}
_SHAPES = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT2": 4, "MAT3": 9, "MAT4": 16}


def load(path: Path) -> tuple[dict[str, Any], bytes]:
    """The document of a file and its binary chunk; both empty where it is none that can be understood."""
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
    """The objects of a list of the document; none where it has no such list."""
    found = document.get(key)
    return [row if isinstance(row, dict) else {} for row in found] if isinstance(found, list) else []


def row(document: dict[str, Any], key: str, number: object) -> dict[str, Any]:
    """One of them by its number; empty where there is none."""
    found = rows(document, key)
    return found[number] if type(number) is int and 0 <= number < len(found) else {}


def problem(path: Path) -> str | None:
    """What pymeshlab would misread or damage its memory with; None where there is nothing."""
    document, _ = load(path)
    for mesh in rows(document, "meshes"):
        for primitive in rows(mesh, "primitives"):
            found = _problem_of(document, primitive)
            if found is not None:
                return found
    return None


def _problem_of(document: dict[str, Any], primitive: dict[str, Any]) -> str | None:
    mode = primitive.get("mode", _TRIANGLES)
    if mode == _POINTS:
        return None
    if mode != _TRIANGLES:
        name = _MODES[mode] if type(mode) is int and 0 <= mode < len(_MODES) else f"primitives of mode {mode!r}"
        return f"it has {name}, which pymeshlab takes for separate triangles; export it as triangles alone"
    if "extensions" in primitive and "KHR_draco_mesh_compression" in primitive["extensions"]:
        return None  # pymeshlab says itself that it cannot read these
    attributes = primitive.get("attributes")
    positions = row(document, "accessors", attributes.get("POSITION") if isinstance(attributes, dict) else None)
    corners = row(document, "accessors", primitive["indices"]) if "indices" in primitive else positions
    for accessor in (positions, corners):
        found = _problem_of_accessor(document, accessor)
        if found is not None:
            return found
    if corners["count"] % 3:
        return f"it has triangles with {corners['count']} corners, which is no multiple of three"
    return None


def _problem_of_accessor(document: dict[str, Any], accessor: dict[str, Any]) -> str | None:
    """Whether it reaches beyond its part of a buffer."""
    count, offset = accessor.get("count"), accessor.get("byteOffset", 0)
    each = _COMPONENTS.get(accessor.get("componentType", 0), 0) * _SHAPES.get(str(accessor.get("type")), 0)
    if type(count) is not int or type(offset) is not int or min(count, offset) < 0 or each == 0:
        return "it has triangles without positions, or an accessor without a number or a type"
    if "bufferView" not in accessor:
        return None
    view = row(document, "bufferViews", accessor["bufferView"])
    length, stride = view.get("byteLength"), view.get("byteStride", each)
    if type(length) is not int or type(stride) is not int or offset + (count - 1) * stride + each > length:
        return f"an accessor promises {count} elements, and its buffer view has {length} bytes"
    return None


def copy_with_images(source: Path, copy: Path, names: Sequence[str]) -> None:
    """Copy a file, with the buffers beside it that are in its folder; its images are files of these names."""
    data = source.read_bytes()
    document, chunk = load(source)
    for image, name in zip(rows(document, "images"), names, strict=True):
        image.pop("bufferView", None)
        image["uri"] = quote(name)
    for buffer in rows(document, "buffers"):
        uri = buffer.get("uri")
        if isinstance(uri, str) and not uri.startswith("data:"):
            name = unquote(uri)
            if not Path(name).is_absolute() and ".." not in Path(name).parts and (source.parent / name).is_file():
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

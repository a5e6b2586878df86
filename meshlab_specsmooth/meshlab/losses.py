"""Data of a mesh file that pymeshlab does not read, and that outputs therefore lack."""

from __future__ import annotations

import mmap
import os
import re
from collections.abc import Iterable
from pathlib import Path

from meshlab_specsmooth.meshlab import textures

_MAX_LISTED = 5
# Properties that are preserved when pymeshlab reads and writes a PLY file (measured)
_COLORS = frozenset(("red", "green", "blue", "alpha", "diffuse_red", "diffuse_green", "diffuse_blue", "diffuse_alpha"))
_KEPT = {
    "vertex": _COLORS | {"x", "y", "z", "quality", "radius", "s", "t", "texture_u", "texture_v", "flags"},
    "face": _COLORS | {"vertex_indices", "vertex_index", "quality", "texcoord", "texnumber", "flags"},
    "tristrips": frozenset(("vertex_indices", "vertex_index")),
}
_NORMALS = ("nx", "ny", "nz")
_BYTE = ("uchar", "uint8", "char", "int8")
_MAX_HEADER_LENGTH = 2**20
# Names in an OBJ file, except for those that exporters write by default
_GROUPS = {
    "objects": re.compile(rb"^[ \t]*o[ \t]+([^\s#][^\r\n]*)", re.MULTILINE),
    "groups": re.compile(rb"^[ \t]*g[ \t]+(?!default\s)([^\s#][^\r\n]*)", re.MULTILINE),
    "smoothing groups": re.compile(rb"^[ \t]*s[ \t]+(?!off\b|0\b)([^\s#][^\r\n]*)", re.MULTILINE),
}
_MATERIAL = re.compile(rb"^[ \t]*newmtl[ \t]+([^\r\n]*)", re.MULTILINE)
_DEFAULT_MATERIAL = re.compile(r"material_\d+")
_OTHER_MAP = re.compile(
    rb"^[ \t]*(?!map_Kd[ \t])((?:map_|bump|disp|decal|norm|refl)\w*)[ \t]", re.MULTILINE | re.IGNORECASE
)
_COLOR_MAP = re.compile(rb"^[ \t]*map_Kd[ \t]+([^\r\n]*)", re.MULTILINE)


def find_losses(source: str | os.PathLike[str]) -> str | None:
    """Describe on one line which data of a file is lost; None if nothing is.

    Reports normals, properties and elements of PLY files, and names, groups and maps of OBJ files.
    """
    path = Path(source)
    ending = path.suffix.lower()
    found = _of_ply(path) if ending == ".ply" else _of_obj(path) if ending == ".obj" else []
    return f"{path}: pymeshlab does not read, and the output lacks: {', '.join(found)}" if found else None


def _of_ply(path: Path) -> list[str]:
    with path.open("rb") as file:
        header = re.split(rb"^end_header\s", file.read(_MAX_HEADER_LENGTH), maxsplit=1, flags=re.MULTILINE)[0]
    properties: dict[str, list[str]] = {}
    elements: list[str] = []
    owner = ""
    for words in (line.decode("latin-1").split() for line in header.splitlines()):
        if words[:1] == ["element"] and len(words) > 2:
            owner = words[1]
            if owner not in _KEPT and words[2] != "0":
                elements.append(owner)
        elif words[:1] == ["property"] and len(words) > 2 and owner in _KEPT:
            is_color = words[-1] in _COLORS
            if words[-1] not in _KEPT[owner] or (is_color and words[1] not in _BYTE):
                properties.setdefault(owner, []).append(words[-1])
    found = []
    for owner, names in properties.items():
        if set(_NORMALS) <= set(names):
            found.append("normals" if owner == "vertex" else "normals of faces")
        others = [name for name in names if name not in _NORMALS or not set(_NORMALS) <= set(names)]
        if others:
            found.append(f"{owner} properties {_format_list(others)}")
    return found + ([f"elements {_format_list(elements)}"] if elements else [])


def _of_obj(path: Path) -> list[str]:
    if path.stat().st_size == 0:
        return []
    found = []
    with path.open("rb") as file, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as text:
        for what, pattern in _GROUPS.items():
            names = _distinct(match[1] for match in pattern.finditer(text))
            if names:
                found.append(f"{what} {_format_list(names)}")
    materials = b"\n".join(material.read_bytes() for material in textures.materials_of(path))
    names = [name for name in _distinct(match[1] for match in _MATERIAL.finditer(materials)) if not _is_default(name)]
    if names:
        found.append(f"names of materials {_format_list(names)}")
    maps = _distinct(match[1] for match in _OTHER_MAP.finditer(materials))
    if maps:
        found.append(_format_list(maps))
    options = _distinct(textures.split_map(match[1])[0] for match in _COLOR_MAP.finditer(materials))
    return found + ([f"options of map_Kd {_format_list(options)}"] if options else [])


def _is_default(name: str) -> bool:
    return _DEFAULT_MATERIAL.fullmatch(name) is not None


def _distinct(values: Iterable[bytes]) -> list[str]:
    """Return the distinct values in order, at most one more than are listed."""
    found: dict[str, None] = {}
    for value in values:
        text = value.decode("utf-8", "backslashreplace").strip()
        if text:
            found[text] = None
        if len(found) > _MAX_LISTED:
            break
    return list(found)


def _format_list(names: list[str]) -> str:
    return ", ".join(names[:_MAX_LISTED]) + (", ..." if len(names) > _MAX_LISTED else "")

"""What a mesh file holds that pymeshlab does not keep, and that what it writes is therefore without."""

from __future__ import annotations

import mmap
import os
import re
from collections.abc import Iterable
from pathlib import Path

from meshlab_specsmooth.meshlab import textures

_MOST_TOLD = 5
# properties that come back when a PLY file is read and written (measured)
_COLORS = frozenset(("red", "green", "blue", "alpha", "diffuse_red", "diffuse_green", "diffuse_blue", "diffuse_alpha"))
_KEPT = {
    "vertex": _COLORS | {"x", "y", "z", "quality", "radius", "s", "t", "texture_u", "texture_v", "flags"},
    "face": _COLORS | {"vertex_indices", "vertex_index", "quality", "texcoord", "texnumber", "flags"},
    "tristrips": frozenset(("vertex_indices", "vertex_index")),
}
_NORMALS = ("nx", "ny", "nz")
_BYTE = ("uchar", "uint8", "char", "int8")
_HEADER = 2**20
# names of an OBJ file, without those that every exporter gives
_GROUPS = {
    "objects": re.compile(rb"^[ \t]*o[ \t]+([^\s#][^\r\n]*)", re.MULTILINE),
    "groups": re.compile(rb"^[ \t]*g[ \t]+(?!default\s)([^\s#][^\r\n]*)", re.MULTILINE),
    "smoothing groups": re.compile(rb"^[ \t]*s[ \t]+(?!off\b|0\b)([^\s#][^\r\n]*)", re.MULTILINE),
}
_MATERIAL = re.compile(rb"^[ \t]*newmtl[ \t]+([^\r\n]*)", re.MULTILINE)
_OWN_MATERIAL = re.compile(r"material_\d+")
_MAP = re.compile(rb"^[ \t]*(?!map_Kd[ \t])((?:map_|bump|disp|decal|norm|refl)\w*)[ \t]", re.MULTILINE | re.IGNORECASE)
_OWN_MAP = re.compile(rb"^[ \t]*map_Kd[ \t]+([^\r\n]*)", re.MULTILINE)


def losses(source: str | os.PathLike[str]) -> str | None:
    """On one line, what of a file is lost; None where nothing is.

    Normals, properties and elements of PLY files; names, groups and maps of OBJ files.
    """
    path = Path(source)
    ending = path.suffix.lower()
    found = _of_ply(path) if ending == ".ply" else _of_obj(path) if ending == ".obj" else []
    return f"{path}: pymeshlab does not keep, and the output is without: {', '.join(found)}" if found else None


def _of_ply(path: Path) -> list[str]:
    with path.open("rb") as file:
        header = re.split(rb"^end_header\s", file.read(_HEADER), maxsplit=1, flags=re.MULTILINE)[0]
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
            found.append(f"{owner} properties {_listed(others)}")
    return found + ([f"elements {_listed(elements)}"] if elements else [])


def _of_obj(path: Path) -> list[str]:
    if path.stat().st_size == 0:
        return []
    found = []
    with path.open("rb") as file, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as text:
        for what, pattern in _GROUPS.items():
            names = _first(match[1] for match in pattern.finditer(text))
            if names:
                found.append(f"{what} {_listed(names)}")
    materials = b"\n".join(material.read_bytes() for material in textures.materials_of(path))
    names = [name for name in _first(match[1] for match in _MATERIAL.finditer(materials)) if not _is_own(name)]
    if names:
        found.append(f"names of materials {_listed(names)}")
    maps = _first(match[1] for match in _MAP.finditer(materials))
    if maps:
        found.append(_listed(maps))
    options = _first(textures.split_map(match[1])[0] for match in _OWN_MAP.finditer(materials))
    return found + ([f"options of map_Kd {_listed(options)}"] if options else [])


def _is_own(name: str) -> bool:
    return _OWN_MATERIAL.fullmatch(name) is not None


def _first(values: Iterable[bytes]) -> list[str]:
    """Those that differ, in their order; no more than it takes to know that there are too many to list."""
    found: dict[str, None] = {}
    for value in values:
        text = value.decode("utf-8", "backslashreplace").strip()
        if text:
            found[text] = None
        if len(found) > _MOST_TOLD:
            break
    return list(found)


def _listed(names: list[str]) -> str:
    return ", ".join(names[:_MOST_TOLD]) + (", ..." if len(names) > _MOST_TOLD else "")

"""What a mesh file says of its textures, read from the file: pymeshlab forgets the names of those it cannot read."""

from __future__ import annotations

import itertools
import os
from collections.abc import Iterable
from pathlib import Path


def texture_names(source: Path) -> list[str]:
    """The textures that an OBJ (by way of its materials) or a PLY file refers to, relative to its folder."""
    if source.suffix.lower() == ".ply":
        with source.open("rb") as file:
            header = itertools.takewhile(lambda line: line.strip() != b"end_header", file)
            return _values(header, b"comment TextureFile")
    names = []
    for material in material_names(source):
        if (source.parent / material).is_file():
            with (source.parent / material).open("rb") as file:
                names += _values(file, b"map_Kd")
    return [name.replace("\\", "/") for name in names]  # as pymeshlab reads them


def material_names(source: Path) -> list[str]:
    """The material files that an OBJ file refers to, relative to its folder."""
    if source.suffix.lower() != ".obj":
        return []
    with source.open("rb") as file:
        return _values(file, b"mtllib")


def _values(lines: Iterable[bytes], key: bytes) -> list[str]:
    """What follows a keyword, on each line that starts with it."""
    stripped = (line.strip() for line in lines)
    return [os.fsdecode(line[len(key) :].strip()) for line in stripped if line.startswith((key + b" ", key + b"\t"))]


def is_inside(name: str) -> bool:
    """Whether a relative path stays in its folder."""
    return not Path(name).is_absolute() and ".." not in Path(name).parts

"""Copy a mesh file so that it refers to textures which pymeshlab can read."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from meshlab_specsmooth.meshlab import gltf
from meshlab_specsmooth.meshlab.textures import Texture, map_name, materials_of, read_lines, values_of

# Name of the single file of materials of a copy
_MATERIALS = "materials.mtl"


def copy_with_renamed_textures(source: Path, folder: Path, textures: Sequence[Texture], stand_in: bytes) -> Path:
    """Copy a mesh file into a folder so that it refers to each texture by ``texture.name``.

    Embedded images are written beside the copy, and a stand-in in place of each other texture.

    Parameters
    ----------
    source, folder : Path
    textures : sequence of Texture
    stand_in : bytes
        An image that pymeshlab reads whatever the suffix of its name.

    Returns
    -------
    Path
        The copy, so deep below the folder that no name with ``..`` leads out of it.
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
            values = values_of([line], b"comment TextureFile")
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
            for line in read_lines(path):
                name = names.get(os.fsdecode(map_name(line)))
                materials.write(line if name is None else b"map_Kd " + os.fsencode(name) + b"\n")
            materials.write(b"\n")

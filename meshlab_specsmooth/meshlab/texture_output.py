"""Copy the textures of a mesh beside its output, without replacing or revealing other files."""

from __future__ import annotations

import os
import re
import shutil
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pymeshlab

from meshlab_specsmooth.errors import FileError
from meshlab_specsmooth.meshlab import images, textures
from meshlab_specsmooth.meshlab.textures import Texture
from meshlab_specsmooth.runtime.atomic import has_content, is_linked, name_conflict

#: Name that pymeshlab gives to every texture that it cannot read; the original name is lost.
PLACEHOLDER_NAME = "dummy.png"
# Formats without textures
_UNTEXTURED = {".stl", ".off", ".xyz", ".dxf"}
# Number of textures that a notice lists
_MAX_LISTED = 5


@dataclass(frozen=True)
class Plan:
    """Textures to be written beside a mesh.

    Attributes
    ----------
    target : Path
        The mesh file.
    images : dict
        From names to a file to copy, bytes, or an image object of pymeshlab's.
    omitted : dict
        From the names of other textures to the reason why they are not copied.
    """

    target: Path
    images: dict[str, Any]
    omitted: dict[str, str]


def plan_textures(ms: pymeshlab.MeshSet, target: Path, source: str | os.PathLike[str] | None) -> Plan:
    """Decide for each texture of the current mesh whether and from where it is copied."""
    plan = Plan(target, {}, {})
    if target.suffix.lower() in _UNTEXTURED or ms.current_mesh().texture_number() == 0:
        return plan
    origin = None if source is None else Path(source)
    known = [] if origin is None else textures.textures_of(origin)
    for name, image in ms.current_mesh().textures().items():
        found = _original(name, known, origin)
        if isinstance(found, Path) and found.resolve() == (target.parent / name).resolve():
            continue  # already in place
        problem = _problem_of_texture(name, found, origin, target)
        if problem is None:
            plan.images[name] = image if found is None else found
        else:
            plan.omitted[name] = problem
    return plan


def _original(name: str, known: list[Texture], source: Path | None) -> Path | bytes | None:
    """Return the file, or the bytes, that a texture was read from; None if unknown."""
    embedded = re.fullmatch(rf"(?:.*-)?({textures.EMBEDDED}\d+\.\w+)", name)
    for texture in known:
        if texture.name == name and texture.file is not None:
            return texture.file
        if embedded is not None and texture.name == embedded[1]:
            return texture.data
    if source is not None and (source.parent / name).is_file():
        return source.parent / name
    return None


def _problem_of_texture(name: str, found: Path | bytes | None, source: Path | None, target: Path) -> str | None:
    """Return the reason why a texture must not be copied, if any."""
    if not images.is_inside(name):
        return "outside of the mesh's folder"
    if not images.is_image_name(name):
        return "hidden, or not the name of an image"
    if name.casefold() in (target.name.casefold(), f"{target.name}.mtl".casefold()):
        return "the name of the output"
    if is_linked(target.parent, name):
        return "a symbolic link is in its place"
    if isinstance(found, bytes):
        is_image = images.is_image_data(found[:64], len(found), Path(name).suffix)
        return None if is_image else "not an image"
    if found is None or source is None:
        return None
    if is_linked(source.parent, os.path.relpath(found, source.parent)):
        return "a symbolic link"
    if not found.exists():
        return "no such file"
    return None if images.is_image(found) else "not an image"


def check_conflicts(plan: Plan) -> None:
    """Raise :class:`FileError` if a texture would replace another file or cannot be written."""
    for name, image in plan.images.items():
        place = plan.target.parent / name
        is_data = isinstance(image, Path | bytes)
        if place.exists() and not (is_data and has_content(place, image)):
            if is_data:
                raise name_conflict(place, plan.target)
            _check_image(place, image)


def copy_textures(plan: Plan, folder: Path) -> tuple[str, ...]:
    """Write textures into a folder, whose files are moved beside the target later; returns notices for the user."""
    for name, image in plan.images.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        if isinstance(image, bytes):
            (folder / name).write_bytes(image)
        elif isinstance(image, Path):
            shutil.copyfile(image, folder / name)
        else:
            _check_image(plan.target.parent / name, image)
            image.save(str(folder / name))
    if not plan.omitted:
        return ()
    listed = [f"{name} ({problem})" for name, problem in plan.omitted.items()]
    more = f" and {len(listed) - _MAX_LISTED} more" if len(listed) > _MAX_LISTED else ""
    return (f"{plan.target}: refers to textures that are not copied: {', '.join(listed[:_MAX_LISTED])}{more}",)


def _check_image(place: Path, image: Any) -> None:
    """Refuse pymeshlab's substitute for a texture that it could not read."""
    if place.name == PLACEHOLDER_NAME or (image.width(), image.height()) == images.STAND_IN_SIZE:
        raise FileError(f"{place}: pymeshlab could not read this texture, and would write an empty image")

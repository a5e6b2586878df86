"""MeshLab projects: documents that MeshLab opens with one layer per mesh."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from xml.sax.saxutils import quoteattr

import numpy as np
import pymeshlab

from meshlab_specsmooth.arrays import Floats
from meshlab_specsmooth.geometry.surface import Surface
from meshlab_specsmooth.meshlab.mesh_files import meshlab_errors
from meshlab_specsmooth.runtime.atomic import atomic_write, check_place, write_text

_IDENTITY = "1 0 0 0 \n0 1 0 0 \n0 0 1 0 \n0 0 0 1 \n"


@dataclass(frozen=True, eq=False)
class Layer:
    """A layer of a project: one mesh.

    Attributes
    ----------
    label : str
    file : str
        Name of its PLY file, in the folder of the project.
    surface : Surface
    quality : (n,) float64
        Quality of the vertices.
    colors : (n, 3) float64 or None
        Colors of the vertices, in [0, 1].
    visible : bool
    face_colors : (m, 3) float64 or None
        Colors of the faces, in [0, 1].
    """

    label: str
    file: str
    surface: Surface
    quality: Floats
    colors: Floats | None
    visible: bool = True
    face_colors: Floats | None = None


def write(path: str | os.PathLike[str], layers: Sequence[Layer]) -> None:
    """Write a project (.mlp) and its meshes into a folder; existing files of these names are replaced.

    Raises
    ------
    FileError
        The folder is missing or not writable.
    """
    target = check_place(path)
    lines = ["<!DOCTYPE MeshLabDocument>", "<MeshLabProject>", " <MeshGroup>"]
    for layer in layers:
        _write_mesh(target.parent / layer.file, layer)
        lines += [
            f'  <MLMesh visible="{int(layer.visible)}" label={quoteattr(layer.label)} '
            f'filename={quoteattr(layer.file)} idInFile="-1">',
            f"   <MLMatrix44>\n{_IDENTITY}</MLMatrix44>",
            "  </MLMesh>",
        ]
    lines += [" </MeshGroup>", " <RasterGroup/>", "</MeshLabProject>", ""]
    write_text(target, "\n".join(lines))


def _write_mesh(path: Path, layer: Layer) -> None:
    colors = {
        f"{kind}_color_matrix": np.concatenate([each, np.ones((len(each), 1))], axis=1)
        for kind, each in (("v", layer.colors), ("f", layer.face_colors))
        if each is not None
    }
    ms = pymeshlab.MeshSet()
    ms.add_mesh(pymeshlab.Mesh(layer.surface.vertices, layer.surface.faces, v_scalar_array=layer.quality, **colors))
    with atomic_write(path) as part, meshlab_errors(path, "written"):
        ms.save_current_mesh(
            str(part),
            save_vertex_quality=True,
            save_vertex_color=layer.colors is not None,
            save_vertex_coord=True,
            save_vertex_normal=False,
            save_face_color=layer.face_colors is not None,
            save_face_quality=False,
            save_wedge_texcoord=False,
            save_wedge_normal=False,
        )

"""Surfaces side by side as one PNG, rendered without a display."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from meshlab_specsmooth.arrays import Floats
from meshlab_specsmooth.errors import MissingExtra
from meshlab_specsmooth.geometry.surface import Surface
from meshlab_specsmooth.runtime import atomic

_COLOUR = "#d8c9a8"
_WIDTH, _TITLE, _MARGIN = 360, 46, 6  # pixels of a panel
HEIGHT_BY_WIDTH = (_WIDTH + _TITLE) / _WIDTH


@dataclass(frozen=True, eq=False)
class Panel:
    """A surface and the lines written over it."""

    title: str
    surface: Surface


@dataclass(frozen=True, eq=False)
class View:
    """Where to look from, the same for every panel.

    Attributes
    ----------
    center : (3,) float64
        Point looked at, in mesh units.
    direction, up : (3,) float64
        From the center toward the eye, and upward in the picture.
    height : float
        What the picture spans from bottom to top, in mesh units.
    """

    center: Floats
    direction: Floats
    up: Floats
    height: float


def front(surface: Surface) -> View:
    """All of a surface, seen along -z with y upward."""
    low, high = surface.vertices.min(axis=0), surface.vertices.max(axis=0)
    span = float((high - low).max())
    up = np.array([0.0, 1.0, 0.0])
    # looked at a little above its middle, which leaves room for the title
    return View((low + high) / 2 + 0.06 * span * up, np.array([0.25, 0.15, 1.0]), up, 1.25 * span)


def close_up(view: View, center: Floats, share: float) -> View:
    """The same view, centered elsewhere and spanning a share of its height."""
    return View(center, view.direction, view.up, view.height * share)


def picture(path: str | os.PathLike[str], panels: Sequence[Panel], views: Sequence[View]) -> None:
    """Write a PNG with a column a panel and a row a view; flat shaded, so that noise shows.

    Raises
    ------
    MissingExtra
        PyVista is not installed.
    FileError
        The file cannot be written.
    """
    with atomic.atomic_write(path) as part:
        render(part, panels, views)


def render(path: Path, panels: Sequence[Panel], views: Sequence[View]) -> None:
    """The same into a file of a temporary folder, which is written at once; raises :class:`MissingExtra`."""
    try:
        import pyvista
    except ImportError as error:
        raise MissingExtra("a picture", "report") from error
    if sys.platform == "linux" and "DISPLAY" not in os.environ:
        os.environ.setdefault("VTK_DEFAULT_OPENGL_WINDOW", "vtkEGLRenderWindow")  # or it warns of a missing X server
    shape = (len(views), len(panels))
    size = (_WIDTH * len(panels), (_WIDTH + _TITLE) * len(views))
    plotter = pyvista.Plotter(off_screen=True, shape=shape, window_size=size, border=False, lighting="none")
    try:
        for column, panel in enumerate(panels):
            mesh = pyvista.PolyData.from_regular_faces(panel.surface.vertices, panel.surface.faces)
            for row, view in enumerate(views):
                plotter.subplot(row, column)
                _draw(plotter, pyvista, mesh, view)
                if row == 0:
                    plotter.add_text(panel.title, position="upper_edge", font_size=9, color="black")
        plotter.screenshot(str(path))
    finally:
        plotter.close()


def _draw(plotter: Any, pyvista: Any, mesh: Any, view: View) -> None:
    plotter.set_background("white")
    plotter.add_mesh(mesh, color=_COLOUR, ambient=0.12, diffuse=0.9, specular=0.15, specular_power=12)
    # one lamp from the upper left, low over the surface, as a restorer lights a relief; a weak one from the eye
    side = np.cross(view.up, view.direction)
    for toward, intensity in ((view.direction + 0.8 * view.up - 1.2 * side, 0.85), (view.direction, 0.25)):
        lamp = pyvista.Light(position=tuple(view.center + toward), focal_point=tuple(view.center), intensity=intensity)
        lamp.positional = False
        plotter.add_light(lamp, only_active=True)
    distance = 4 * view.height
    eye = view.center + distance * view.direction / np.linalg.norm(view.direction)
    plotter.camera.position, plotter.camera.focal_point, plotter.camera.up = (
        tuple(eye),
        tuple(view.center),
        tuple(view.up),
    )
    plotter.camera.parallel_projection = True
    plotter.camera.parallel_scale = view.height / 2
    plotter.reset_camera_clipping_range()

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

_COLOR = "#d8c9a8"
_WIDTH, _TITLE, _MARGIN = 360, 46, 6  # pixels of a panel
HEIGHT_BY_WIDTH = (_WIDTH + _TITLE) / _WIDTH


@dataclass(frozen=True, eq=False)
class Panel:
    """A surface and its title."""

    title: str
    surface: Surface


@dataclass(frozen=True, eq=False)
class View:
    """A direction of view with parallel projection, the same for every panel.

    Attributes
    ----------
    center : (3,) float64
        Center of the picture, in mesh units.
    direction, up : (3,) float64
        From the center toward the viewer, and upward in the picture.
    height : float
        Height of the picture, in mesh units.
    """

    center: Floats
    direction: Floats
    up: Floats
    height: float


def front(surface: Surface) -> View:
    """Return the view of a whole surface from the front, along -z with y upward."""
    low, high = surface.vertices.min(axis=0), surface.vertices.max(axis=0)
    span = float((high - low).max())
    up = np.array([0.0, 1.0, 0.0])
    # centered a little above the middle, which leaves room for the title
    return View((low + high) / 2 + 0.06 * span * up, np.array([0.25, 0.15, 1.0]), up, 1.25 * span)


def close_up(view: View, center: Floats, fraction: float) -> View:
    """Return a view from the same direction with another center and a fraction of the height."""
    return View(center, view.direction, view.up, view.height * fraction)


def picture(path: str | os.PathLike[str], panels: Sequence[Panel], views: Sequence[View]) -> None:
    """Write a PNG with one column for each panel and one row for each view; flat shading makes noise visible.

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
    """Write the PNG of :func:`picture` directly, without a temporary file; raises :class:`MissingExtra`."""
    try:
        import pyvista
    except ImportError as error:
        raise MissingExtra("a picture", "report") from error
    size = (_WIDTH * len(panels), (_WIDTH + _TITLE) * len(views))
    plotter = open_plotter(pyvista, (len(views), len(panels)), size, border=False)
    try:
        for column, panel in enumerate(panels):
            mesh = pyvista.PolyData.from_regular_faces(panel.surface.vertices, panel.surface.faces)
            for row, view in enumerate(views):
                plotter.subplot(row, column)
                draw_mesh(plotter, pyvista, mesh, view)
                if row == 0:
                    plotter.add_text(panel.title, position="upper_edge", font_size=9, color="black")
        plotter.screenshot(str(path))
    finally:
        plotter.close()


def open_plotter(pyvista: Any, shape: tuple[int, int], size: tuple[int, int], **options: Any) -> Any:
    """Open a PyVista plotter without lights that renders off screen, with or without a display.

    Parameters
    ----------
    pyvista : module
    shape : (int, int)
        Rows and columns of views.
    size : (int, int)
        Width and height in pixels.
    **options
        For PyVista.
    """
    if sys.platform == "linux" and "DISPLAY" not in os.environ:
        os.environ.setdefault("VTK_DEFAULT_OPENGL_WINDOW", "vtkEGLRenderWindow")  # else VTK warns of a missing X server
    return pyvista.Plotter(off_screen=True, shape=shape, window_size=size, lighting="none", **options)


def draw_mesh(
    plotter: Any,
    pyvista: Any,
    mesh: Any,
    view: View,
    limits: tuple[float, float] | None = None,
    label: str | None = "",
    colormap: str = "viridis",
    beyond: tuple[str, str] | None = None,
) -> None:
    """Draw a PyVista mesh in the active view of a plotter, lit from the upper left.

    With ``limits``, it is colored by its ``values`` from the first to the second, with a color bar if ``label`` is not
    None; ``beyond`` has the colors of values below and above the limits, if not those at the ends of the colormap.
    """
    plotter.set_background("white")
    bar: dict[str, Any] = {"title": f"{label}\n", "color": "black", "fmt": "%.3g", "n_labels": 5, "vertical": True}
    bar |= {"position_x": 0.82, "position_y": 0.2, "height": 0.6, "width": 0.07}
    colors: dict[str, Any] = {"color": _COLOR}
    if limits is not None:
        colors = {"scalars": "values", "clim": limits, "cmap": colormap, "scalar_bar_args": bar}
        colors["show_scalar_bar"] = label is not None
        if beyond is not None:
            colors |= {"below_color": beyond[0], "above_color": beyond[1]}
    plotter.add_mesh(mesh, **colors, ambient=0.12, diffuse=0.9, specular=0.15, specular_power=12)
    # a grazing light from the upper left, which shows roughness, and a weak one from the viewer
    side = np.cross(view.up, view.direction)
    for toward, intensity in ((view.direction + 0.8 * view.up - 1.2 * side, 0.85), (view.direction, 0.25)):
        light = pyvista.Light(position=tuple(view.center + toward), focal_point=tuple(view.center), intensity=intensity)
        light.positional = False
        plotter.add_light(light, only_active=True)
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

"""A deviation as a colored mesh file and as a picture."""

from __future__ import annotations

import io
import os
from typing import Any

import numpy as np

from meshlab_specsmooth.comparison.deviation import Deviation, Place
from meshlab_specsmooth.errors import MissingExtra
from meshlab_specsmooth.geometry.surface import Surface
from meshlab_specsmooth.meshlab import commit, mesh_files, meshset
from meshlab_specsmooth.reports.pictures import View, draw_mesh, front, open_plotter
from meshlab_specsmooth.runtime import atomic

# Width and height of a rendered view in pixels; of the whole picture in inches
_VIEW, _SIZE, _DPI = (760, 640), (12.0, 8.2), 120

# Without a tolerance, colors end at this quantile, so that a few large distances do not hide the rest
_QUANTILE = 0.99

# From blue below the surface over white to red above it, as in the file; beyond the tolerance:
_ABOVE, _BELOW = "#ff9500", "#00a5a5"
_LIMIT_BINS = 8


def color_limit(found: Deviation) -> float:
    """The distance at which the colors end: the tolerance, or else almost the largest distance."""
    if found.tolerance is not None:
        return found.tolerance
    return float(np.quantile(np.abs(found.distances[found.is_used]), _QUANTILE)) or found.largest or 1.0


def color_by_deviation(ms: Any, found: Deviation) -> None:
    """Put the distances of a deviation into the vertex quality of a MeshSet's current mesh, and color it by them.

    Parameters
    ----------
    ms : pymeshlab.MeshSet
        Its current mesh has the vertices of the deviation.
    found : Deviation

    Raises
    ------
    MeshSetError
    """
    quality = commit.average_coincident(ms.current_mesh().vertex_matrix(), found.distances)
    commit.write(ms, commit.Change(quality=quality))
    at = f"(q/{color_limit(found):.17g})"
    ms.compute_color_by_function_per_vertex(
        x=f"{at}>1?255:({at}<-1?0:255*min(1,1+{at}))",
        y=f"{at}>1?149:({at}<-1?165:255*(1-abs({at})))",
        z=f"{at}>1?0:({at}<-1?165:255*min(1,1-{at}))",
        a="255",
    )


def write_deviation(path: str | os.PathLike[str], found: Deviation) -> None:
    """Write the surface ``after`` of a deviation, colored by the distances, which are its vertex quality as well.

    Blue is below the surface ``before``, red above it, white on it; beyond the tolerance the color is orange above and
    teal below. Without a tolerance, colors end at the 0.99 quantile of the distances.

    Parameters
    ----------
    path : path
        Of a format with colors, such as PLY.
    found : Deviation

    Raises
    ------
    FileError
        The file cannot be written.

    Examples
    --------
    >>> import meshlab_specsmooth as mss
    >>> found = mss.deviation("scan.ply", "smooth.ply", tolerance=0.05)  # doctest: +SKIP
    >>> mss.write_deviation("deviation.ply", found)  # doctest: +SKIP
    """
    ms = meshset.new(found.vertices, found.faces)
    color_by_deviation(ms, found)
    mesh_files.write(ms, path)


def draw_deviation(path: str | os.PathLike[str], found: Deviation, *, title: str = "") -> None:
    """Write a picture of a deviation: both sides of the colored surface, worst places, histogram and numbers.

    The colors are those of :func:`meshlab_specsmooth.write_deviation`.

    Parameters
    ----------
    path : path
        Of a PNG.
    found : Deviation
    title : str
        Above the picture.

    Raises
    ------
    MissingExtra
        PyVista or Matplotlib is not installed.
    FileError
        The file cannot be written.

    Examples
    --------
    >>> import meshlab_specsmooth as mss
    >>> found = mss.deviation("scan.ply", "smooth.ply", tolerance=0.05)  # doctest: +SKIP
    >>> mss.draw_deviation("deviation.png", found)  # doctest: +SKIP
    """
    try:
        import pyvista
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure
    except ImportError as error:
        raise MissingExtra("a picture", "report") from error
    places = found.worst()
    figure = Figure(figsize=_SIZE, dpi=_DPI, layout="constrained")
    FigureCanvasAgg(figure)
    axes: Any = figure.subplot_mosaic([["front", "back"], ["histogram", "numbers"]], height_ratios=(3, 2))
    for name, image in zip(("front", "back"), _render(pyvista, found, places), strict=True):
        axes[name].imshow(image)
        axes[name].set_title(f"from the {name}", fontsize=10)
        axes[name].axis("off")
    _draw_histogram(axes["histogram"], found)
    axes["numbers"].axis("off")
    lines = [f"{name:12}  {value}" for name, value in found.rows()]
    axes["numbers"].text(0, 1, "\n".join(lines), va="top", family="monospace", fontsize=8)
    figure.suptitle((f"{title}\n" if title else "") + found.summary, fontsize=11)
    image = io.BytesIO()
    figure.savefig(image, format="png")
    with atomic.atomic_write(path) as part:
        part.write_bytes(image.getvalue())


def _render(pyvista: Any, found: Deviation, places: tuple[Place, ...]) -> list[Any]:
    """Images of the colored surface from the front and from the back."""
    is_used = found.is_used
    surface = Surface(found.vertices[is_used], (np.cumsum(is_used) - 1)[found.faces])
    mesh = pyvista.PolyData.from_regular_faces(surface.vertices, surface.faces)
    mesh.point_data["values"] = found.distances[is_used]
    limit, view = color_limit(found), front(surface)
    behind = View(view.center, view.direction * [-1, 1, -1], view.up, view.height)
    images = []
    for toward in (view, behind):
        plotter = open_plotter(pyvista, (1, 1), _VIEW, border=False)
        try:
            draw_mesh(plotter, pyvista, mesh, toward, (-limit, limit), None, "bwr", (_BELOW, _ABOVE))
            seen = [(number, p) for number, p in enumerate(places, start=1) if _faces(found, p, toward)]
            if seen:
                plotter.add_point_labels(
                    np.array([p.position for _, p in seen]),
                    [str(number) for number, _ in seen],
                    always_visible=True,
                    shape_color="white",
                    text_color="black",
                    point_color="black",
                    point_size=8,
                    font_size=14,
                )
            images.append(plotter.screenshot(return_img=True))
        finally:
            plotter.close()
    return images


def _faces(found: Deviation, place: Place, view: View) -> bool:
    """Whether the surface at a place looks toward the viewer."""
    at = (found.faces == place.vertex).any(axis=1)
    a, b, c = (found.vertices[found.faces[at, k]] for k in range(3))
    return bool(np.cross(b - a, c - a).sum(axis=0) @ view.direction > 0)


def _draw_histogram(axes: Any, found: Deviation) -> None:
    counts, limits = found.histogram()
    centers, limit = (limits[1:] + limits[:-1]) / 2, color_limit(found)
    from matplotlib import colormaps

    colors = [
        _ABOVE if x > limit and found.tolerance else _BELOW if x < -limit and found.tolerance else color
        for x, color in zip(centers, colormaps["bwr"]((centers / limit + 1) / 2), strict=True)
    ]
    axes.bar(centers, counts, width=np.diff(limits), color=colors, edgecolor="0.4", linewidth=0.5)
    if found.tolerance is not None:
        for x in (-found.tolerance, found.tolerance):
            axes.axvline(x, color="black", linestyle="--", linewidth=1)
    axes.set(xlabel="distance along the normal, in mesh units", ylabel="vertices", yscale="symlog")
    axes.set_ylim(bottom=0)
    axes.locator_params(axis="x", nbins=_LIMIT_BINS)

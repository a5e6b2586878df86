"""A mesh colored by a field, as a PNG."""

from __future__ import annotations

import os

import numpy as np
import numpy.typing as npt

from meshlab_specsmooth.adapters import Mesh, recognize
from meshlab_specsmooth.errors import InvalidParameter, MissingExtra
from meshlab_specsmooth.parameters import show
from meshlab_specsmooth.reports.pictures import draw_mesh, front, open_plotter
from meshlab_specsmooth.runtime import atomic

_SIZE = (900, 640)

# Colors end at this quantile, so that a few high values do not hide the rest.
_QUANTILE = 0.99


def draw_field(
    path: str | os.PathLike[str],
    mesh: Mesh,
    values: npt.ArrayLike,
    *,
    faces: npt.ArrayLike | None = None,
    label: str = "",
) -> None:
    """Write a picture of a mesh that is colored by a value at each vertex, such as ``noise.local``.

    Parameters
    ----------
    path : path
        Of a PNG.
    mesh : (n, 3) real array, or a mesh of any kind
    values : (n,) real array
    faces : (m, 3) integer array, optional
        As for :func:`meshlab_specsmooth.smooth`.
    label : str
        Title of the color bar.

    Raises
    ------
    InvalidParameter
        The values are not one finite number for each vertex.
    MissingExtra
        PyVista is not installed.
    FileError
        The file cannot be written.

    Examples
    --------
    >>> import meshlab_specsmooth as mss
    >>> noise = mss.estimate_noise("scan.ply")  # doctest: +SKIP
    >>> mss.draw_field("noise.png", "scan.ply", noise.local, label="noise")  # doctest: +SKIP
    """
    surface = recognize(mesh, faces).surface()
    field = np.asarray(values, dtype=np.float64)
    if field.shape != (len(surface.vertices),) or not np.isfinite(field).all():
        raise InvalidParameter(
            f"values is {show(values)}; it must be one finite number for each of {len(surface.vertices)} vertices"
        )
    try:
        import pyvista
    except ImportError as error:
        raise MissingExtra("a picture", "report") from error
    low, high = float(field.min(initial=0.0)), float(np.quantile(field, _QUANTILE)) if len(field) else 1.0
    with atomic.atomic_write(path) as part:
        plotter = open_plotter(pyvista, (1, 1), _SIZE, border=False)
        try:
            polygons = pyvista.PolyData.from_regular_faces(surface.vertices, surface.faces)
            polygons.point_data["values"] = field
            draw_mesh(plotter, pyvista, polygons, front(surface), (low, high if high > low else low + 1.0), label)
            plotter.screenshot(str(part))
        finally:
            plotter.close()

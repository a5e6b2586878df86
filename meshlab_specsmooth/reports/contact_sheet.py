"""Contact sheets: small pictures of many meshes, before and after.

They are drawn in a separate process, as a mesh or a graphics driver may crash it.
"""

from __future__ import annotations

import contextlib
import importlib.util
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from meshlab_specsmooth.geometry.surface import Surface
from meshlab_specsmooth.isolation import processes
from meshlab_specsmooth.isolation.worker import Worker, WorkerFailed, serve
from meshlab_specsmooth.meshlab import mesh_files, meshset
from meshlab_specsmooth.reports import pictures
from meshlab_specsmooth.runtime import atomic

# Pairs in a row and rows of a sheet; width and height of a picture in pixels
_COLUMNS, _ROWS, _SIZE = 3, 8, 180
_MAX_TITLE = 24


def draw_apart(folder: Path, pairs: Sequence[tuple[str, str]]) -> tuple[str, ...]:
    """Draw ``contact-1.png``, ``contact-2.png`` and so on; none where PyVista is not installed, or fails.

    Parameters
    ----------
    folder : Path
    pairs : sequence of (str, str)
        Mesh files before and after.

    Returns
    -------
    tuple of str
        The sheets that were drawn.
    """
    if not pairs or importlib.util.find_spec("pyvista") is None:
        return ()
    drawn = []
    per_sheet = _COLUMNS * _ROWS
    with Worker(processes.command(serve_sheets)) as worker:
        for number, first in enumerate(range(0, len(pairs), per_sheet), start=1):
            path = str(folder / f"contact-{number}.png")
            with contextlib.suppress(WorkerFailed):
                worker.ask((path, pairs[first : first + per_sheet]))
                drawn.append(path)
    return tuple(drawn)


def serve_sheets() -> None:
    """Draw sheets for the process that started this one; a request has the arguments of :func:`contact_sheet`."""
    serve(lambda request: contact_sheet(*request))


def contact_sheet(path: str | os.PathLike[str], pairs: Sequence[tuple[str, str]]) -> None:
    """Write a PNG with a small picture of each mesh before and after.

    Raises
    ------
    ImportError
        PyVista is not installed.
    FileError
        A mesh cannot be read, or the file not be written.
    """
    import pyvista

    columns = min(_COLUMNS, len(pairs))
    rows = -(-len(pairs) // columns)
    plotter = pictures.open_plotter(pyvista, (rows, 2 * columns), (2 * columns * _SIZE, rows * _SIZE))
    try:
        for number, pair in enumerate(pairs):
            _draw_pair(plotter, pyvista, number // columns, 2 * (number % columns), pair)
        with atomic.atomic_write(path) as part:
            plotter.screenshot(str(part))
    finally:
        plotter.close()


def _draw_pair(plotter: Any, pyvista: Any, row: int, column: int, pair: tuple[str, str]) -> None:
    view = None
    for offset, path in enumerate(pair):
        plotter.subplot(row, column + offset)
        plotter.set_background("white")
        surface = Surface(*meshset.get_arrays(mesh_files.read(path)))
        view = view or pictures.front(surface)  # the same for both
        pictures.draw_mesh(plotter, pyvista, pyvista.PolyData.from_regular_faces(surface.vertices, surface.faces), view)
    plotter.add_text(_title(Path(pair[1]).name), position="upper_edge", font_size=6, color="black")


def _title(name: str) -> str:
    shown = "".join(c if c.isprintable() and c.isascii() else "?" for c in name)
    return shown if len(shown) <= _MAX_TITLE else f"...{shown[3 - _MAX_TITLE :]}"

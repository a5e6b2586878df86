"""A comparison as files: the page, a MeshLab project with its meshes, and the figures as JSON and text."""

from __future__ import annotations

import contextlib
import json
import math
import os
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from meshlab_specsmooth.arrays import Floats
from meshlab_specsmooth.comparison.comparison import Comparison
from meshlab_specsmooth.errors import InvalidParameter, MissingExtra
from meshlab_specsmooth.meshlab import projects
from meshlab_specsmooth.reports.page import make_page
from meshlab_specsmooth.reports.scene import (
    GIVEN,
    MAX_DRAWN,
    TRUTH,
    color_range,
    diverging_colors,
    list_colorings,
    list_shapes,
)
from meshlab_specsmooth.runtime import atomic
from meshlab_specsmooth.runtime.folders import ensure_folder


def write(
    found: Comparison,
    folder: str | os.PathLike[str],
    recipe: str = "",
    with_page: bool = True,
    max_drawn: int = MAX_DRAWN,
) -> list[Path]:
    """Write ``comparison.html``, ``comparison.mlp`` with its meshes, ``comparison.json`` and ``comparison.txt``.

    Parameters
    ----------
    found : Comparison
    folder : path
        Created if it does not exist.
    recipe : str
        The command that reproduces the comparison.
    with_page : bool
        Whether to write the page, which needs the extra ``report``.
    max_drawn : int
        The page draws a decimation of meshes with more vertices.

    Returns
    -------
    list of Path
        The files, without the meshes.

    Raises
    ------
    MissingExtra
        jinja2, matplotlib or PyVista is not installed; :func:`check_extra` tests this beforehand.
    FileError
        The folder cannot be created or written.
    """
    written = output_paths(folder) if with_page else output_paths(folder)[:-1]
    with _ensured(folder):
        atomic.write_text(written[0], summarize(found))
        atomic.write_text(written[1], json.dumps(data_of(found), indent=1) + "\n")
        projects.write(written[2], make_layers(found))
        if with_page:
            atomic.write_text(written[3], make_page(found, recipe, max_drawn))
    return written


def summarize(found: Comparison) -> str:
    """Return the recommendation, its reasons and the table as text."""
    return f"{found.headline()}.\n{' '.join(found.reasons())}\n\n{found}\n"


def output_paths(folder: str | os.PathLike[str]) -> list[Path]:
    """Return the files of a comparison in a folder: text, JSON, project, page."""
    return [Path(folder) / f"comparison.{kind}" for kind in ("txt", "json", "mlp", "html")]


def check_extra() -> None:
    """Raise :class:`MissingExtra` if a package that the page needs is not installed."""
    try:
        import jinja2  # noqa: F401
        import matplotlib  # noqa: F401
        import pyvista  # noqa: F401
    except ImportError as error:
        raise MissingExtra("the page", "report") from error


def check_folder(folder: str | os.PathLike[str]) -> None:
    """Raise :class:`FileError` if a folder cannot be created or written; nothing is left behind."""
    with _ensured(folder, is_kept=False):
        pass


def check_inputs(
    folder: str | os.PathLike[str], inputs: Iterable[str | os.PathLike[str]], names: Iterable[str]
) -> None:
    """Raise :class:`InvalidParameter` if the files of a comparison of filters ``names`` would replace an input."""
    layers = [Path(folder) / layer_file(name) for name in (GIVEN, TRUTH, *names)]
    written = {path.resolve() for path in (*output_paths(folder), *layers)}
    for each in inputs:
        if Path(each).resolve() in written:
            raise InvalidParameter(f"{each} is an input, and would be replaced by the output; --overwrite allows that")


@contextlib.contextmanager
def _ensured(folder: str | os.PathLike[str], is_kept: bool = True) -> Iterator[None]:
    """Create a folder; after a failure, or unless it is to be kept, remove the new folders that are empty."""
    path = Path(folder)
    new = [each for each in (path, *path.parents) if not each.exists()]
    is_done = False
    try:
        ensure_folder(path)
        atomic.check_place(output_paths(path)[-1])
        yield
        is_done = True
    finally:
        for each in new if not (is_done and is_kept) else ():
            with contextlib.suppress(OSError):  # it was never created, or is not empty
                each.rmdir()


def data_of(found: Comparison) -> dict[str, Any]:
    """Return all figures of a comparison, ready for JSON."""
    return {
        "name": found.name,
        "vertices": len(found.given.vertices),
        "faces": len(found.given.faces),
        "mean_edge": found.edge,
        "noise": {key: getattr(found.noise, key) for key in ("kind", "level", "low", "high")},
        "added": found.added,
        "seed": found.seed,
        "headline": found.headline(),
        "trusted": found.trusted,
        "reasons": list(found.reasons()),
        "correlation": _finite(found.correlation),
        "rows": [
            {
                "name": row.name,
                "call": row.call,
                "failure": row.failure,
                "chosen": dict(row.chosen),
                "sha256": row.hash,
                "uncertainty": _finite(row.uncertainty),
                "gap": _finite(row.gap),
                "gap_uncertainty": _finite(row.gap_uncertainty),
                **{key: _finite(value) for key, value in row.values.items()},
            }
            for row in found.rows
        ],
        "curves": [
            {"call": point.call, "filter": curve.spec.name, **{k: _finite(v) for k, v in point.values.items()}}
            for curve in found.curves
            for point in curve.points
        ],
        "versions": dict(found.versions),
    }


def _finite(value: float) -> float | None:
    """None for infinities and NaN, which JSON does not have."""
    return value if math.isfinite(value) else None


_MAX_FILE_NAME = 40


def make_layers(found: Comparison) -> list[projects.Layer]:
    """Return one layer for each surface, all but the first hidden.

    The quality of the vertices is the distance to the truth if that is known, else the displacement. The mesh as given
    keeps its own colors, if it has any; the others are colored by quality, with the range in the label.
    """
    coloring = list_colorings(found)[0]
    low, high = color_range(found, coloring)
    quantity = "from the truth" if coloring.key == "error" else "of displacement"
    layers = []
    for i, shape in enumerate(list_shapes(found)):
        quality = shape.values.get(coloring.key, np.zeros(len(shape.surface.vertices)))
        colors: Floats | None = diverging_colors((quality - low) / (high - low))
        face_colors: Floats | None = None
        label = f"{shape.name} (blue 0, red {_percent(high)} % of an edge {quantity})"
        if i == 0 and (found.vertex_colors is not None or found.face_colors is not None):
            colors, face_colors = found.vertex_colors, found.face_colors
            label = f"{shape.name} (its own colors)"
        # MeshLab displays a label up to its first dot only, as if a file name extension followed
        label = label.replace(".", ",")
        layers.append(
            projects.Layer(label, layer_file(shape.name), shape.surface, quality, colors, i == 0, face_colors)
        )
    return layers


def layer_file(name: str) -> str:
    """Return the file name of a layer."""
    return "".join(c if c.isalnum() else "_" for c in name.lower()).strip("_")[:_MAX_FILE_NAME] + ".ply"


def _percent(fraction: float) -> str:
    return f"{100 * fraction:.0f}" if fraction >= 0.1 else f"{100 * fraction:.2g}"

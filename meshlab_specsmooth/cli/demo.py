"""``specsmooth demo``: the noisy Stanford bunny, smoothed by MeshLab's filters and this package's."""

from __future__ import annotations

import argparse
import textwrap
from pathlib import Path

import numpy as np

from meshlab_specsmooth.cli.options import add_seed, noise_level
from meshlab_specsmooth.cli.progress import bar
from meshlab_specsmooth.comparison.filter_specs import DEMO
from meshlab_specsmooth.comparison.noise import gaussian
from meshlab_specsmooth.comparison.rows import Row
from meshlab_specsmooth.comparison.side_by_side import COLUMNS, explain_paper_setting, run_side_by_side
from meshlab_specsmooth.comparison.tables import format_rows
from meshlab_specsmooth.geometry.surface import Surface
from meshlab_specsmooth.meshlab import mesh_files, meshset
from meshlab_specsmooth.reports.pictures import Panel, View, close_up, front, picture
from meshlab_specsmooth.runtime import atomic
from meshlab_specsmooth.runtime.folders import ensure_folder
from meshlab_specsmooth.smoothing.api import smooth

SUMMARY = "compare filters on the Stanford bunny, with a picture and a table"
DESCRIPTION = """Adds seeded noise to the bunny that comes with pymeshlab, smooths it with MeshLab's Laplacian and
Taubin filters, with plain spectral low-pass and with this package's filter, and writes a picture and a table."""
EXAMPLES = """examples:
  specsmooth demo
  specsmooth demo --out /tmp/bunny --noise 0.3 --seed 2
  specsmooth demo --scan scan.ply"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the subcommand."""
    parser.add_argument(
        "--out", metavar="DIR", default="demo", help="folder for the picture and the table (default: demo)"
    )
    parser.add_argument(
        "--noise", metavar="X", type=noise_level, default=0.2, help="noise in mean edges (default: 0.2)"
    )
    add_seed(parser)
    parser.add_argument("--scan", metavar="FILE", help="write the noisy bunny there, and do nothing else")


def run(arguments: argparse.Namespace) -> None:
    """Smooth the bunny, measure the results, print and draw them."""
    if arguments.scan is not None:
        mesh_files.check_target(arguments.scan)
        _, noisy = _bunny(arguments)
        mesh_files.write(meshset.new(noisy.vertices, noisy.faces), arguments.scan)
        return
    out = Path(arguments.out)
    ensure_folder(out)
    for name in ("table.txt", "bunny.png"):
        atomic.check_place(out / name)
    truth, noisy = _bunny(arguments)
    # a first call, so that one-time loading and compilation are not timed
    smooth(truth.vertices, truth.faces, modes=200)
    rows: list[Row] = []
    with bar("smoothing") as progress:
        for row in run_side_by_side(truth, noisy.vertices, DEMO):
            rows.append(row)
            if progress is not None:
                progress((len(rows) - 1) / len(DEMO))
    by_key = {row.spec.key: row for row in rows if row.spec is not None}
    finding = explain_paper_setting(rows[0], *(by_key[key] for key in ("laplacian", "paper", "automatic")))
    calls = "\n".join(f"{row.name:32}{row.call}" for row in rows if row.call)
    text = (
        f"Stanford bunny, {len(truth.vertices)} vertices, noise of {arguments.noise:g} mean edge lengths, seed "
        f"{arguments.seed}\n\n{format_rows(rows, COLUMNS)}\n\n{calls}\n\n{textwrap.fill(finding, width=100)}"
    )
    print(text)
    atomic.write_text(out / "table.txt", text + "\n")
    panels = [Panel(f"original\n{len(truth.faces)} faces", truth)]
    panels += [
        Panel(f"{row.name}\nnormal error {row.values['normal_error']:.1f} deg", row.surface)
        for row in rows
        if row.surface is not None
    ]
    view = front(truth)
    picture(out / "bunny.png", panels, [view, close_up(view, _head_of(truth, view), 0.28)])
    print(f"\npicture: {out / 'bunny.png'}\ntable:   {out / 'table.txt'}")


def _bunny(arguments: argparse.Namespace) -> tuple[Surface, Surface]:
    """The bunny that comes with pymeshlab, without and with noise."""
    truth = Surface(*meshset.get_arrays(mesh_files.read(mesh_files.sample("bunny.obj"))))
    return truth, Surface(gaussian(truth, arguments.noise, arguments.seed), truth.faces)


def _head_of(truth: Surface, view: View) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    """A point on the bunny's head, in fractions of its bounding box."""
    low, high = truth.vertices.min(axis=0), truth.vertices.max(axis=0)
    return np.asarray(low + np.array([0.24, 0.62, 0.8]) * (high - low))

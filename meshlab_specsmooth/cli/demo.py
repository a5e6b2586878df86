"""``specsmooth demo``: the Stanford bunny, noisy, through MeshLab's filters and ours."""

from __future__ import annotations

import argparse
import math
import textwrap
from pathlib import Path

import numpy as np

from meshlab_specsmooth.cli.progress import bar
from meshlab_specsmooth.comparison.competitors import Competitor
from meshlab_specsmooth.comparison.metrics import add_noise
from meshlab_specsmooth.comparison.side_by_side import Row, measure, side_by_side, table
from meshlab_specsmooth.errors import FileError
from meshlab_specsmooth.geometry.surface import Surface
from meshlab_specsmooth.meshlab import mesh_files, meshset
from meshlab_specsmooth.report.pictures import Panel, View, close_up, front, picture
from meshlab_specsmooth.runtime import atomic
from meshlab_specsmooth.smoothing.api import smooth

SUMMARY = "show the filters side by side on the Stanford bunny"
DESCRIPTION = """Adds seeded noise to the bunny that comes with pymeshlab, smooths it with MeshLab's Laplacian and
Taubin filters, with plain spectral low-pass and with this package's filter, and writes a picture and a table."""
EXAMPLES = """examples:
  specsmooth demo
  specsmooth demo --out /tmp/bunny --noise 0.3 --seed 2
  specsmooth demo --scan scan.ply"""

_OURS = "apply_coord_spectral_smoothing"
COMPETITORS = (
    Competitor("MeshLab Laplacian", "apply_coord_laplacian_smoothing"),
    Competitor("MeshLab Taubin", "apply_coord_taubin_smoothing"),
    Competitor("spectral low-pass, 200 modes", "apply_coord_spectral_low_pass", {"modes": 200}),
    Competitor("ours, the paper's setting", _OURS, {"modes": 200, "barycenter_weight": 1.0}),
    Competitor("ours, without a parameter", _OURS),
    Competitor("ours, edge-aware", "apply_coord_edge_aware_smoothing"),
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the subcommand."""
    parser.add_argument(
        "--out", metavar="DIR", default="demo", help="folder for the picture and the table (default: demo)"
    )
    parser.add_argument(
        "--noise", metavar="X", type=noise_level, default=0.2, help="noise in mean edges (default: 0.2)"
    )
    parser.add_argument("--seed", metavar="N", type=seed_number, default=1, help="seed of the noise (default: 1)")
    parser.add_argument("--scan", metavar="FILE", help="write the noisy bunny there, and do nothing else")


def noise_level(text: str) -> float:
    """An argument that is a level of noise."""
    level = float(text)
    if not 0 <= level < math.inf:
        raise argparse.ArgumentTypeError(f"{text} is not a finite number from 0")
    return level


def seed_number(text: str) -> int:
    """An argument that is a seed."""
    seed = int(text)
    if seed < 0:
        raise argparse.ArgumentTypeError(f"{text} is less than 0")
    return seed


noise_level.__name__, seed_number.__name__ = "noise", "seed"  # as argparse puts them into "invalid seed value"


def run(arguments: argparse.Namespace) -> None:
    """Smooth, measure, print, draw."""
    if arguments.scan is not None:
        mesh_files.check_target(arguments.scan)
        _, noisy = _bunny(arguments)
        mesh_files.write(meshset.new(noisy.vertices, noisy.faces), arguments.scan)
        return
    out = Path(arguments.out)
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise FileError(f"{out}: cannot be made: {error.strerror}") from error
    for name in ("table.txt", "bunny.png"):
        atomic.check_place(out / name)
    truth, noisy = _bunny(arguments)
    rows = [measure("noisy", "", noisy, truth, 0.0)]
    # what is compiled at the first call of all, or loaded at the first of a process, is no part of the comparison
    smooth(truth.vertices, truth.faces, modes=200)
    with bar("smoothing") as progress:
        for row in side_by_side(truth, noisy.vertices, COMPETITORS):
            rows.append(row)
            if progress is not None:
                progress((len(rows) - 1) / len(COMPETITORS))
    text = (
        f"Stanford bunny, {len(truth.vertices)} vertices, noise of {arguments.noise:g} mean edge lengths, seed "
        f"{arguments.seed}\n\n{table(rows)}\n\n{_calls(rows)}\n\n{_finding(rows)}"
    )
    print(text)
    atomic.write_text(out / "table.txt", text + "\n")
    panels = [Panel(f"original\n{len(truth.faces)} faces", truth)]
    panels += [Panel(f"{row.name}\nnormals off by {row.normal_error:.1f} deg", row.surface) for row in rows]
    view = front(truth)
    picture(out / "bunny.png", panels, [view, close_up(view, _eye_of(truth, view), 0.28)])
    print(f"\npicture: {out / 'bunny.png'}\ntable:   {out / 'table.txt'}")


def _bunny(arguments: argparse.Namespace) -> tuple[Surface, Surface]:
    """The bunny that comes with pymeshlab, as it is and with noise."""
    truth = Surface(*meshset.get_arrays(mesh_files.read(mesh_files.sample("bunny.obj"))))
    return truth, Surface(add_noise(truth, arguments.noise, arguments.seed), truth.faces)


def _calls(rows: list[Row]) -> str:
    return "\n".join(f"{row.name:32}ms.{row.call}" for row in rows if row.call)


def _finding(rows: list[Row]) -> str:
    """What the figures say of the paper's literal setting at this size, in words."""
    by_name = {row.name: row for row in rows}
    noisy, paper = by_name["noisy"], by_name["ours, the paper's setting"]
    ours, laplacian = by_name["ours, without a parameter"], by_name["MeshLab Laplacian"]
    less = paper.normal_error > laplacian.normal_error
    return textwrap.fill(
        f"The paper's setting (200 modes, weight 1, one pass) takes {noisy.normal_error:.1f} degrees of normal error "
        f"to {paper.normal_error:.1f} here: it changes the volume by {abs(paper.volume_change):.3f} %, but smooths "
        f"{'less than' if less else 'at least as well as'} MeshLab's Laplacian ({laplacian.normal_error:.1f}). On a "
        "mesh of this size 200 modes are so few that nearly all of the work is done by the barycenter constraints, "
        "and their weight is the strength that counts: chosen from the noise measured, it leaves "
        f"{ours.normal_error:.1f} degrees, the volume changed by {abs(ours.volume_change):.3f} %. (The noise itself "
        "changed it by "
        f"{abs(noisy.volume_change):.3f} %.)",
        width=100,
    )


def _eye_of(truth: Surface, view: View) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    """A point on the bunny's head, given as shares of its bounding box."""
    low, high = truth.vertices.min(axis=0), truth.vertices.max(axis=0)
    return np.asarray(low + np.array([0.24, 0.62, 0.8]) * (high - low))

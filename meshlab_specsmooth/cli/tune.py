"""``specsmooth tune MESH``."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

import numpy as np

from meshlab_specsmooth.cli.options import add_force, add_input, add_options
from meshlab_specsmooth.cli.progress import notice
from meshlab_specsmooth.meshlab import descriptors, mesh_files, meshset, precision, scripts
from meshlab_specsmooth.meshlab.filter_inputs import features_of
from meshlab_specsmooth.meshlab.parameters import resolve
from meshlab_specsmooth.operators.assemble import assemble
from meshlab_specsmooth.reports.window import WEIGHTS, Sliders, tune
from meshlab_specsmooth.runtime import atomic
from meshlab_specsmooth.smoothing.api import smooth
from meshlab_specsmooth.smoothing.filter import DEFAULT_WAVELENGTH_IN_EDGES
from meshlab_specsmooth.smoothing.result import SmoothingResult
from meshlab_specsmooth.spectral.response import name_of

_DESCRIPTOR = descriptors.load("apply_coord_spectral_smoothing")

SUMMARY = "find a setting interactively, with sliders"
DESCRIPTION = """Opens a window with sliders for cut-off, weight, response and, if the mesh has features, their gain;
the surface is updated at once. The initial weight is chosen by the noise. Buttons save the mesh, save the filter
as a script for `specsmooth run` and MeshSets, or print the call in Python."""
EXAMPLES = """examples:
  specsmooth tune scan.ply
  specsmooth tune scan.ply --out smooth.ply --script smooth.mlx
  specsmooth tune scan.ply --features vertex_quality
  specsmooth tune scan.ply --screenshot window.png"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the subcommand."""
    add_input(parser, "MESH")
    parser.add_argument("--out", metavar="FILE", help="file for the mesh (default: MESH-smooth.ply)")
    parser.add_argument("--script", metavar="FILE", help="file for the script (default: MESH-smooth.mlx)")
    parser.add_argument("--screenshot", metavar="FILE", help="render the window to a PNG instead; needs no display")
    add_options(parser, _DESCRIPTOR, only=("features",))
    add_force(parser)
    parser.set_defaults(writes_at_once=True)  # when a button is pressed, while the window stays open


def run(arguments: argparse.Namespace) -> None:
    """Read the mesh, open the window, and perform the actions of its buttons."""
    source = Path(arguments.input)
    out = Path(arguments.out or source.with_name(f"{source.stem}-smooth.ply"))
    script = Path(arguments.script or source.with_name(f"{source.stem}-smooth.mlx"))
    for path in (out, script, arguments.screenshot):
        if path is not None:
            atomic.check_place(path)
    ms = mesh_files.read(source)
    mesh_files.check_textures(ms, out, source)
    for line in precision.check_rounding(*meshset.get_arrays(ms), source, out, arguments.force):
        notice(line)
    features = features_of(ms, arguments.features)
    ops = assemble(*meshset.get_arrays(ms))
    chosen = smooth(ops)
    weight, response = float(np.clip(chosen.barycenter_weight, *WEIGHTS)), name_of(chosen.response)
    first = Sliders(DEFAULT_WAVELENGTH_IN_EDGES, weight, response, 1.0 if features is not None else 0.0)

    def save_mesh(setting: Sliders, result: SmoothingResult) -> str:
        changed = mesh_files.read(source)
        meshset.set_vertices(changed, result.vertices)
        return "; ".join([f"saved {out}", *mesh_files.write(changed, out, source=source).notices])

    def save_script(setting: Sliders, result: SmoothingResult) -> str:
        step = scripts.format_step(
            _DESCRIPTOR, resolve(_DESCRIPTOR, parameters(setting, result, arguments.features), ms)
        )
        atomic.write_text(script, scripts.format_script([step]))
        return f"saved {script}"

    def print_call(setting: Sliders, result: SmoothingResult) -> str:
        text = call(parameters(setting, result, arguments.features))
        print(text, flush=True)
        return text

    actions = {"save the mesh": save_mesh, "save the script": save_script, "print the call": print_call}
    tune(ops, first, actions, features=features, screenshot=arguments.screenshot)
    if arguments.screenshot is not None:
        print(f"picture: {arguments.screenshot}")


def parameters(setting: Sliders, result: SmoothingResult, features: str) -> dict[str, Any]:
    """Return the parameters of the filter for the positions of the sliders."""
    given = {"wavelength": result.wavelength, "barycenter_weight": setting.weight, "response": setting.response}
    return given if features == "none" else given | {"features": features, "feature_gain": setting.gain}


def call(given: dict[str, Any]) -> str:
    """Format the call on a MeshSet in Python; lengths are in mesh units."""
    typed = ", ".join(
        f"{name}=pymeshlab.PureValue({value!r})" if name == "wavelength" else f"{name}={value!r}"
        for name, value in given.items()
    )
    return f"ms.apply_coord_spectral_smoothing({typed})"

"""``specsmooth spectrum MESH``."""

from __future__ import annotations

import argparse
import csv
import io
import json
import math
import sys
from pathlib import Path

from meshlab_specsmooth.cli.meshes import report_rounding
from meshlab_specsmooth.cli.options import add_input, add_options, given_parameters
from meshlab_specsmooth.cli.progress import bar
from meshlab_specsmooth.describe import count_of, format_edges
from meshlab_specsmooth.errors import MissingExtra
from meshlab_specsmooth.meshlab import descriptors, filters, mesh_files, meshset
from meshlab_specsmooth.meshlab.parameters import resolve
from meshlab_specsmooth.power_spectrum import Spectrum, spectrum
from meshlab_specsmooth.reports.spectrum_plot import spectrum_plot
from meshlab_specsmooth.runtime import atomic
from meshlab_specsmooth.runtime.folders import ensure_folder
from meshlab_specsmooth.runtime.progress import subrange
from meshlab_specsmooth.spectral.response import name_of, response

_SPECTRUM = descriptors.load("get_spectrum")
_SMOOTHING = descriptors.load("apply_coord_spectral_smoothing")
# Fraction of the time that the spectrum takes
_MEASURING = 0.5

_SHOWN = ("modes", "wavelength", "response", "barycenter_weight")

SUMMARY = "show the distribution of shape, detail and noise over the frequencies"
DESCRIPTION = """Measures the power spectrum of the coordinates and of the differential coordinates, the density of
modes, the noise and the noise floor, and plots them with the transfer function of the filter that `specsmooth smooth`
would apply with these options. Writes spectrum.json, spectrum.csv and spectrum.png."""
EXAMPLES = """examples:
  specsmooth spectrum scan.ply
  specsmooth spectrum scan.ply --out /tmp/scan --bands 128
  specsmooth spectrum scan.ply --modes 200 --response butterworth --barycenter-weight 0.3"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the subcommand."""
    add_input(parser, "MESH")
    parser.add_argument("--out", metavar="DIR", default="spectrum", help="folder for the files (default: spectrum)")
    add_options(parser, _SPECTRUM)
    add_options(parser, _SMOOTHING, only=_SHOWN)


def run(arguments: argparse.Namespace) -> None:
    """Measure the spectrum, choose the filter, write the files, and print a summary."""
    out = Path(arguments.out)
    ensure_folder(out)
    for name in ("spectrum.json", "spectrum.csv", "spectrum.png"):
        atomic.check_place(out / name)
    ms = mesh_files.read(arguments.input)
    report_rounding(ms, arguments.input)
    given = given_parameters(arguments, _SMOOTHING, only=_SHOWN) | {"laplacian": arguments.laplacian}
    resolve(_SMOOTHING, given, ms)  # before the work
    with bar("measuring the spectrum") as progress:
        measured = spectrum(*meshset.get_arrays(ms), **given_parameters(arguments, _SPECTRUM))
        chosen = filters.apply_coord_spectral_smoothing(
            ms, **given, progress=subrange(progress, _MEASURING, 1 - _MEASURING)
        )
    edge = measured.noise.mean_edge
    atomic.write_text(out / "spectrum.json", as_json(measured, chosen))
    atomic.write_text(out / "spectrum.csv", as_csv(measured))
    print(
        f"{arguments.input}: {ms.current_mesh().vertex_number()} vertices, mean edge {edge:.4g}; "
        f"{measured.noise.summary}\n"
        f"noise floor {measured.noise_floor:.3g} a coordinate ({format_edges(measured.noise_floor, edge)} edges), "
        "fine detail and uneven triangles included\n"
        f"filter: {chosen['response']}, {count_of(round(chosen['modes']), 'mode')}, waves longer than "
        f"{chosen['wavelength']:.4g}; barycenter weight {chosen['barycenter_weight']:.3g}\n"
        f"figures: {out / 'spectrum.json'}, {out / 'spectrum.csv'}"
    )
    low_pass = response(name_of(chosen["response"]), chosen["cutoff"])
    try:
        spectrum_plot(
            out / "spectrum.png",
            measured,
            float(chosen["mean_edge"]),
            low_pass,
            chosen["barycenter_weight"],
            Path(arguments.input).name,
        )
    except MissingExtra as error:
        print(error, file=sys.stderr)
    else:
        print(f"plot:    {out / 'spectrum.png'}")


_COLUMNS = ("eigenvalue", "wavelength", "modes", "coordinate_power", "differential_power")


def as_json(measured: Spectrum, chosen: dict[str, object]) -> str:
    """Format the spectrum and the filter as JSON; the infinite wavelength of the constant mode is null."""
    bands = {name: [x if math.isfinite(x) else None for x in getattr(measured, name).tolist()] for name in _COLUMNS}
    evidence = {name: chosen[name] for name in ("response", "cutoff", "modes", "wavelength", "barycenter_weight")}
    noise = {name: getattr(measured.noise, name) for name in ("level", "low", "high", "kind", "mean_edge")}
    whole = {
        "noise": noise,
        "noise_floor": measured.noise_floor,
        "method": measured.method,
        "bands": bands,
        "filter": evidence,
    }
    return json.dumps(whole, indent=1, allow_nan=False) + "\n"


def as_csv(measured: Spectrum) -> str:
    """Format the spectrum as CSV, with a line for each band."""
    text = io.StringIO()
    lines = csv.writer(text, lineterminator="\n")
    lines.writerow(_COLUMNS)
    lines.writerows(zip(*(getattr(measured, name).tolist() for name in _COLUMNS), strict=True))
    return text.getvalue()

"""``specsmooth labels MESH ... --out DIR``."""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any

from meshlab_specsmooth.cli.options import add_options, given_parameters
from meshlab_specsmooth.cli.progress import bar
from meshlab_specsmooth.errors import InvalidParameter
from meshlab_specsmooth.meshlab import descriptors, mesh_files, meshset
from meshlab_specsmooth.meshlab.parameters import resolve
from meshlab_specsmooth.runtime import atomic
from meshlab_specsmooth.runtime.folders import ensure_folder
from meshlab_specsmooth.runtime.progress import Progress
from meshlab_specsmooth.smoothing.api import smooth_labels
from meshlab_specsmooth.smoothing.labels import LabelResult, list_labels

_DESCRIPTOR = descriptors.load("apply_coord_spectral_smoothing")
_SHOWN = ("barycenter_weight", "max_displacement")

SUMMARY = "smooth the surfaces of several labels that share borders"
DESCRIPTION = """Smooths tissues, grains or materials at once: vertices at one place move as one, so that neither gaps
nor overlaps appear, and borders are smoothed along themselves. The surfaces are several files whose vertices coincide
where they touch, or one PLY file with a face property. Writes the meshes and labels.json, with the volume of each
label before and after, into a folder."""
EXAMPLES = """examples:
  specsmooth labels liver.ply spleen.ply aorta.ply --out smooth
  specsmooth labels tissues.ply --property label --out smooth"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the subcommand."""
    parser.add_argument("meshes", metavar="MESH", nargs="+", help="meshes to read; with --property one PLY file")
    parser.add_argument("--out", metavar="DIR", required=True, help="folder for the meshes, which keep their names")
    parser.add_argument("--property", metavar="NAME", help="face property of the file that holds the labels")
    add_options(parser, _DESCRIPTOR, only=_SHOWN)


def run(arguments: argparse.Namespace) -> None:
    """Read, smooth, write, and print the result."""
    paths = [Path(path) for path in arguments.meshes]
    out = Path(arguments.out)
    _check(paths, out, arguments.property)
    ensure_folder(out)
    for path in paths:
        mesh_files.check_target(out / path.name)
    with bar("reading") as progress:
        sets = [mesh_files.read(path) for path in paths]
        given = given_parameters(arguments, _DESCRIPTOR, only=_SHOWN)
        known = resolve(_DESCRIPTOR, given, sets[0])
        wanted = {name: known[name] for name in _SHOWN if known[name]}
        result = _smooth(arguments, sets, wanted, progress)
        start = 0
        for ms, path in zip(sets, paths, strict=True):
            count = ms.current_mesh().vertex_number()
            meshset.set_vertices(ms, result.vertices[start : start + count])
            mesh_files.write(ms, out / path.name, source=path)
            start += count
    names = {"files": [str(path) for path in paths], "labels": list_labels(result)}
    shared = {"shared": result.shared, "still_shared": result.still_shared, "curves": result.curves}
    atomic.write_text(out / "labels.json", json.dumps({**names, **shared}, indent=1, allow_nan=False) + "\n")
    print(result)
    print(f"files: {', '.join(str(out / path.name) for path in paths)}, {out / 'labels.json'}")


def _check(paths: list[Path], out: Path, name: str | None) -> None:
    if name is not None and len(paths) > 1:
        raise InvalidParameter("--property is that of one file; without it each file is a label")
    if name is None and len(paths) == 1:
        raise InvalidParameter("one file has one label; give several files, or --property")
    names = [path.name for path in paths]
    twice = next((each for each in names if names.count(each) > 1), None)
    if twice is not None:
        raise InvalidParameter(f"two files are named {twice}, and would be written to the same place; rename one")
    if any(path.resolve() == (out / path.name).resolve() for path in paths):
        raise InvalidParameter(f"the files are in {out}, where they would be replaced; give another --out")


def _smooth(
    arguments: argparse.Namespace, sets: list[Any], wanted: dict[str, Any], progress: Progress | None
) -> LabelResult:
    if arguments.property is not None:
        return smooth_labels(arguments.meshes[0], labels=arguments.property, **wanted, progress=progress)
    return smooth_labels(sets, **wanted, progress=progress)

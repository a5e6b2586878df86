"""Apply one filter to a mesh file: the steps that ``smooth`` and ``denoise`` share."""

from __future__ import annotations

import argparse
from typing import Any

from meshlab_specsmooth.cli.meshes import read_to_write, write
from meshlab_specsmooth.cli.options import given_parameters
from meshlab_specsmooth.cli.progress import FILTERING
from meshlab_specsmooth.describe import Report, format_length
from meshlab_specsmooth.geometry.surface import Surface
from meshlab_specsmooth.meshlab import filters, mesh_files, meshset
from meshlab_specsmooth.meshlab.descriptors import Descriptor
from meshlab_specsmooth.runtime.progress import Progress, announce, subrange


def read_input(arguments: argparse.Namespace) -> Any:
    """Check the output, then read the input into a MeshSet; raises :class:`FileError` or :class:`InvalidSurface`."""
    mesh_files.check_target(arguments.output)
    ms = read_to_write(arguments)
    if ms.current_mesh().face_number() == 0:
        Surface(*meshset.get_arrays(ms))  # raises the error that names the remedy
    return ms


def apply_and_write(
    ms: Any, arguments: argparse.Namespace, descriptor: Descriptor, progress: Progress | None
) -> Report:
    """Apply a filter with the options given to the mesh in place, write the output, and return the report."""
    given = given_parameters(arguments, descriptor)
    report = filters.FILTERS[descriptor.function](ms, **given, progress=subrange(progress, 0.0, FILTERING))
    announce(progress, "writing")
    write(ms, arguments)
    return report


def print_report(ms: Any, arguments: argparse.Namespace, report: Report, mean_edge: float, *lines: str) -> None:
    """Print the displacement, the summary and further lines."""
    print(
        f"{arguments.output}: {ms.current_mesh().vertex_number()} vertices, moved by "
        f"{format_length(report['displacement'], mean_edge)} (RMS), {report['seconds']:.2f} s"
    )
    for line in (report.summary, *lines):
        print(f"  {line}")

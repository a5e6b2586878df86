"""The decorator that makes a filter on MeshSets of a function and a descriptor.

The function receives the MeshSet and the checked values of all parameters, and returns what to report and what to
change. The decorator checks the parameters, prints what pymeshlab would print, and writes the change at the end of the
call, so an interrupt before that has nothing to undo.
"""

from __future__ import annotations

import inspect
import textwrap
import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any, NamedTuple

import pymeshlab
from pymeshlab import PyMeshLabException

from meshlab_specsmooth.describe import Report
from meshlab_specsmooth.errors import InvalidParameter
from meshlab_specsmooth.meshlab import descriptors, scripts
from meshlab_specsmooth.meshlab.commit import Change, write
from meshlab_specsmooth.meshlab.descriptors import Descriptor
from meshlab_specsmooth.meshlab.filter_inputs import describe_restriction
from meshlab_specsmooth.meshlab.parameters import RefusedParameter, resolve
from meshlab_specsmooth.meshlab.verbosity import verbosity_of
from meshlab_specsmooth.parameters import show
from meshlab_specsmooth.runtime.bars import begin
from meshlab_specsmooth.runtime.progress import Progress, announce
from meshlab_specsmooth.runtime.warned import warn_once

Filter = Callable[..., Report]


class Call(NamedTuple):
    """The arguments of a filter: MeshSet, checked values of all parameters by name, and progress callback or None."""

    ms: pymeshlab.MeshSet
    values: dict[str, Any]
    progress: Progress | None


Implementation = Callable[[Call], tuple[Report, Change]]

#: Fraction of the time of a call after which the result is written.
WRITING = 0.65

# Functions for other meshes
_ON_OTHER_MESHES = {
    "apply_coord_boundary_smoothing": "smooth_boundary(mesh)",
    "apply_coord_edge_aware_smoothing": "smooth_edge_aware(mesh)",
    "apply_coord_spectral_denoising": "denoise(mesh)",
    "apply_coord_spectral_enhancement": "enhance(mesh)",
    "apply_coord_spectral_low_pass": "low_pass(mesh)",
    "apply_coord_spectral_smoothing": "smooth(mesh)",
    "compute_scalar_by_estimated_error": "denoise(mesh) or smooth(mesh), whose error_field it is",
    "compute_scalar_by_noise_level": "estimate_noise(mesh), whose local is the level at each vertex",
    "compute_scalar_by_spectral_displacement": "smooth(mesh), whose vertices are compared with the mesh's",
    "get_spectrum": "spectrum(mesh)",
}

#: Our filters by Python name.
FILTERS: dict[str, Filter] = {}


def _documentation(descriptor: Descriptor, own: str) -> str:
    """Compose a docstring: help and parameters from the descriptor, the rest from the docstring of the function."""
    lines = [f"{descriptor.name}, in place on the current mesh of a MeshSet.", ""]
    lines += [*textwrap.wrap(descriptor.help, 116), "", "Parameters", "----------", "ms : pymeshlab.MeshSet"]
    for parameter in descriptor.parameters:
        lines.append(f"{parameter.name} : {parameter.kind}, default {parameter.shown_default}")
        lines += textwrap.wrap(parameter.help, 112, initial_indent="    ", subsequent_indent="    ")
    lines += ["progress : callable, optional", "    Called with the fraction done, rising to 1.", ""]
    lines += own.splitlines()
    lines += [
        "",
        "Raises",
        "------",
        "pymeshlab.PyMeshLabException",
        "    No mesh, no faces, an unknown parameter, or a value of the wrong type or out of bounds.",
        "SpecsmoothError",
        "    As raised by :func:`meshlab_specsmooth.smooth`.",
        "",
        "After any exception, including KeyboardInterrupt, the MeshSet is unchanged.",
    ]
    return "\n".join(lines)


def _signature(descriptor: Descriptor) -> inspect.Signature:
    """Compose the signature, for editors and notebooks."""
    kinds = {"bool": bool, "int": int, "enum": str}
    parameters = [inspect.Parameter("ms", inspect.Parameter.POSITIONAL_OR_KEYWORD, annotation=pymeshlab.MeshSet)]
    parameters += [
        inspect.Parameter(
            each.name, inspect.Parameter.KEYWORD_ONLY, default=each.default, annotation=kinds.get(each.type, float)
        )
        for each in descriptor.parameters
    ]
    parameters.append(inspect.Parameter("progress", inspect.Parameter.KEYWORD_ONLY, default=None))
    return inspect.Signature(parameters, return_annotation=dict)


def mesh_filter(implementation: Implementation) -> Filter:
    """Make a filter of a function, and add it to :data:`FILTERS` under its name.

    The function returns the report of the filter, and the change to write.
    """
    descriptor = descriptors.load(implementation.__name__)

    @warn_once
    def call(ms: pymeshlab.MeshSet, **parameters: Any) -> Report:
        start = time.perf_counter()
        progress = begin(parameters.pop("progress", None), "assembling")
        if not isinstance(ms, pymeshlab.MeshSet):
            raise InvalidParameter(
                f"ms is {show(ms)}; it must be a pymeshlab.MeshSet, which is changed in place; for other meshes: "
                f"meshlab_specsmooth.{_ON_OTHER_MESHES[descriptor.function]}"
            )
        values = resolve(descriptor, parameters, ms)
        if descriptor.needs_faces and ms.current_mesh().face_number() == 0:
            # sic: the quotation mark is missing in pymeshlab's message as well
            raise PyMeshLabException(
                f"Failed to apply filter:  '{descriptor.function}. Current mesh does not have Any Faces."
            )
        verbosity = verbosity_of(ms)
        if any(verbosity):
            # as pymeshlab prints it
            print(f"\nApplying filter {descriptor.function} with the following parameters:\n{values}\n")  # noqa: T201
        try:
            output, change = implementation(Call(ms, dict(values), progress))
        except InvalidParameter as error:
            raise RefusedParameter(str(error)) from error
        if progress is not None:
            progress(WRITING)
            announce(progress, "writing")
        write(ms, replace(change, step=scripts.format_step(descriptor, values)), verbosity)
        if progress is not None:
            progress(1.0)
        if "seconds" in output:
            output["seconds"] = time.perf_counter() - start
        line = describe_restriction(ms, values, is_default="selected" not in parameters)
        if line is not None:
            found = output.get("warning")
            output["warning"] = line if found is None else found if line in found else f"{found}; {line}"
        return output

    call.__name__ = call.__qualname__ = implementation.__name__
    call.__module__ = implementation.__module__
    call.__signature__ = _signature(descriptor)  # type: ignore[attr-defined]
    call.__doc__ = _documentation(descriptor, inspect.getdoc(implementation) or "")
    FILTERS[call.__name__] = call
    return call

"""The work on one mesh: read, smooth, write and record it; any error becomes its outcome."""

from __future__ import annotations

import functools
import json
import time
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from meshlab_specsmooth.arrays import Floats
from meshlab_specsmooth.batching.record import (
    DONE,
    FAILED,
    RECORD_ENDING,
    SKIPPED,
    Outcome,
    Record,
    compute_digest,
    read_record,
)
from meshlab_specsmooth.errors import SpecsmoothError
from meshlab_specsmooth.geometry.surface import Surface, is_closed, signed_volume
from meshlab_specsmooth.meshlab import descriptors, isolated_filter, losses, mesh_files, meshset, precision
from meshlab_specsmooth.meshlab.descriptors import AnySelected
from meshlab_specsmooth.meshlab.filters import FILTERS
from meshlab_specsmooth.meshlab.isolated_filter import decode_argument, encode_argument
from meshlab_specsmooth.meshlab.parameters import PyMeshLabException
from meshlab_specsmooth.runtime import atomic, temporary
from meshlab_specsmooth.runtime.warned import unwarned
from meshlab_specsmooth.version import VERSION


@dataclass(frozen=True)
class Job:
    """A mesh file, a filter and an output; all of it plain values, for other processes and machines.

    Attributes
    ----------
    source, output : str
        Absolute paths.
    filter_name : str
        A filter of this package that moves vertices.
    settings : dict
        Its keyword arguments, encoded by :func:`~meshlab_specsmooth.meshlab.isolated_filter.encode_argument`.
    resume : bool
        Skip it where a record says that the same was done before.
    force : bool
        Write it also where the format rounds its coordinates by more than a tenth of a mean edge.
    """

    source: str
    output: str
    filter_name: str
    settings: dict[str, Any]
    resume: bool = True
    force: bool = False


def run(job: Job) -> Outcome:
    """Do a job; raises only what ends the process."""
    start = time.perf_counter()
    try:
        return _run(job, start)
    except (SpecsmoothError, PyMeshLabException) as error:
        outcome = failure(job, FAILED, str(error))
    except MemoryError:
        outcome = failure(job, FAILED, "memory ran out")
    except Exception as error:  # an error of this package on one mesh must not lose the others
        outcome = failure(job, FAILED, f"{type(error).__name__}: {error}")
    return replace(outcome, seconds=time.perf_counter() - start)


@functools.cache
def warm_up() -> None:
    """Smooth a small mesh once, so that forks of this process find everything loaded that the first call loads."""
    isolated_filter.run(*isolated_filter.make_sphere(), "apply_coord_spectral_smoothing", {})


def failure(job: Any, status: str, reason: str) -> Outcome:
    """Return the outcome of a job that failed; the reason is put on one line."""
    return Outcome(job.source, job.output, status, " ".join(reason.removeprefix(f"{job.source}: ").split()))


def _run(job: Job, start: float) -> Outcome:
    before = Record(compute_digest(job.source), job.filter_name, _all_settings(job), VERSION)
    if job.resume:
        earlier = read_record(job.output)
        if earlier is not None and earlier.outcome and earlier.asks_the_same(before) and earlier.is_of(job.output):
            return replace(Outcome(**earlier.outcome), input=job.source, output=job.output, status=SKIPPED)
    temporary.remove_stale(Path(job.output).parent)
    target = mesh_files.check_target(job.output)
    # images inside of the files of a folder may have the same names
    ms = mesh_files.read(job.source, prefix=f"{Path(job.output).stem}-")
    mesh_files.check_textures(ms, target, job.source)
    vertices, faces = meshset.get_arrays(ms)
    lost = losses.find_losses(job.source)
    notices = [] if lost is None else [lost]
    notices += precision.check_rounding(vertices, faces, job.source, job.output, job.force)
    with unwarned():
        report = FILTERS[job.filter_name](ms, **{name: decode_argument(value) for name, value in job.settings.items()})
    notices += [report["warning"]] if report.get("warning") else []
    written = mesh_files.write(ms, target, source=job.source)
    noise = report.get("noise")  # estimated if the strength is chosen; the edge-aware filter has no cut-off
    outcome = Outcome(
        job.source,
        job.output,
        DONE,
        vertices=len(vertices),
        noise=None if noise is None else noise.level,
        cutoff=report.get("cutoff"),
        volume_change=_volume_change(vertices, meshset.get_arrays(ms)[0], faces),
        warning="; ".join([*notices, *written.notices]),
        seconds=time.perf_counter() - start,
    )
    record = replace(before, output_sha256=compute_digest(str(written.file)), outcome=asdict(outcome))
    atomic.write_text(job.output + RECORD_ENDING, json.dumps(asdict(record), indent=1) + "\n")
    return outcome


def _all_settings(job: Job) -> dict[str, Any]:
    """Return the settings of a job with the defaults of those that were not given."""
    known = descriptors.load(job.filter_name).parameters
    defaults = {
        p.name: "any selected" if isinstance(p.default, AnySelected) else encode_argument(p.default) for p in known
    }
    return defaults | job.settings


def _volume_change(before: Floats, after: Floats, faces: Any) -> float | None:
    """Return the relative change of the enclosed volume; None if the surface is not closed."""
    _, exponent = np.frexp(np.abs(before).max(initial=0.0))
    old, new = (Surface(np.ldexp(V, -exponent), faces) for V in (before, after))  # its cube must not overflow
    volume = signed_volume(old)
    if volume == 0 or not is_closed(old):
        return None
    return signed_volume(new) / volume - 1

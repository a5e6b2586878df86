"""One mesh: read, smoothed, written, and recorded; whatever it is that goes wrong becomes its outcome."""

from __future__ import annotations

import functools
import hashlib
import json
import time
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from meshlab_specsmooth.arrays import Floats
from meshlab_specsmooth.errors import FileError, SpecsmoothError
from meshlab_specsmooth.geometry.surface import Surface, is_closed, signed_volume
from meshlab_specsmooth.meshlab import descriptors, losses, mesh_files, meshset, precision
from meshlab_specsmooth.meshlab.descriptors import AnySelected, Length
from meshlab_specsmooth.meshlab.filters import FILTERS, quiet
from meshlab_specsmooth.meshlab.parameters import PyMeshLabException
from meshlab_specsmooth.runtime import atomic, temporary
from meshlab_specsmooth.version import VERSION

#: How a mesh can have ended: smoothed now, or by a run before; refused or in trouble; its process died; not begun.
STATUSES = DONE, SKIPPED, FAILED, CRASHED, NOT_RUN = "done", "skipped", "failed", "crashed", "not run"

#: Added to an output's name, it is the name of its record.
RECORD_ENDING = ".specsmooth.json"


@dataclass(frozen=True)
class Job:
    """A mesh, what to do to it, and where to put it; all of it plain values, for other processes and machines.

    Attributes
    ----------
    source, output : str
        Absolute paths.
    filter_name : str
        One of our filters that move vertices.
    settings : dict
        Its keyword arguments, as :func:`portable` has them.
    resume : bool
        Skip it where the record says that just this is done.
    force : bool
        Write it also where its coordinates are rounded by more than a tenth of a mean edge.
    """

    source: str
    output: str
    filter_name: str
    settings: dict[str, Any]
    resume: bool = True
    force: bool = False


@dataclass(frozen=True)
class Outcome:
    """A line of the summary.

    Attributes
    ----------
    input, output : str
        Paths; there is no output unless the status is ``"done"`` or ``"skipped"``.
    status : str
        One of :data:`STATUSES`.
    reason : str
        Why not, on one line.
    vertices : int or None
    noise : float or None
        Estimated level of the noise along the normals, in mesh units.
    cutoff : float or None
        Eigenvalue of the Laplacian.
    volume_change : float or None
        Relative; None of a surface that is not closed.
    seconds : float
        Wall time, reading and writing included; of a mesh that is skipped, when it was smoothed.
    warning : str
        What is to be known of the output, and what the filter warned of, on one line.
    """

    input: str
    output: str
    status: str
    reason: str = ""
    vertices: int | None = None
    noise: float | None = None
    cutoff: float | None = None
    volume_change: float | None = None
    seconds: float = 0.0
    warning: str = ""

    @property
    def is_there(self) -> bool:
        """Whether the output is there, and what was asked for."""
        return self.status in (DONE, SKIPPED)


def run(job: Job) -> Outcome:
    """Do a job; never raises but what ends the process."""
    start = time.perf_counter()
    try:
        return _run(job, start)
    except (SpecsmoothError, PyMeshLabException) as error:
        outcome = failure(job, FAILED, str(error))
    except MemoryError:
        outcome = failure(job, FAILED, "memory ran out")
    except Exception as error:  # a fault of ours in one mesh is no reason to lose the others
        outcome = failure(job, FAILED, f"{type(error).__name__}: {error}")
    return replace(outcome, seconds=time.perf_counter() - start)


@functools.cache
def warm_up() -> None:
    """Smooth a small mesh once, so that copies of this process need not load again what is loaded at a first call."""
    side = 40  # more vertices than are treated by other methods than large meshes are
    i, j = (x.ravel() for x in np.meshgrid(np.arange(side), np.arange(side)))
    heights = 0.2 * np.random.default_rng(0).standard_normal(side * side)
    corner = (np.arange(side - 1)[:, None] * side + np.arange(side - 1)).ravel()
    faces = np.concatenate(
        [
            np.stack([corner, corner + 1, corner + side + 1], axis=1),
            np.stack([corner, corner + side + 1, corner + side], axis=1),
        ]
    )
    FILTERS["apply_coord_spectral_smoothing"](meshset.new(np.stack([i, j, heights], axis=1).astype(float), faces))


def failure(job: Job, status: str, reason: str) -> Outcome:
    """The outcome of a job that did not come to its end."""
    return Outcome(job.source, job.output, status, " ".join(reason.removeprefix(f"{job.source}: ").split()))


def portable(value: Any) -> Any:
    """A filter's checked argument as JSON has it: a share of the diagonal becomes a dict."""
    return {"diagonals": value.fraction} if isinstance(value, Length) else value


def _native(value: Any) -> Any:
    return Length(value["diagonals"]) if isinstance(value, dict) else value


def _run(job: Job, start: float) -> Outcome:
    before = Record(digest(job.source), job.filter_name, _all_settings(job), VERSION)
    if job.resume:
        earlier = read_record(job.output)
        if earlier is not None and earlier.outcome and earlier.asks_the_same(before) and earlier.is_of(job.output):
            return replace(Outcome(**earlier.outcome), input=job.source, output=job.output, status=SKIPPED)
    temporary.remove_stale(Path(job.output).parent)
    target = mesh_files.check_target(job.output)
    # meshes of a folder may all have such images: each needs names of its own
    ms = mesh_files.read(job.source, prefix=f"{Path(job.output).stem}-")
    mesh_files.check_textures(ms, target, job.source)
    vertices, faces = meshset.get_arrays(ms)
    lost = losses.find_losses(job.source)
    notices = [] if lost is None else [lost]
    notices += precision.check_rounding(vertices, faces, job.source, job.output, job.force)
    with quiet():
        report = FILTERS[job.filter_name](ms, **{name: _native(value) for name, value in job.settings.items()})
    notices += [report["warning"]] if report.get("warning") else []
    written = mesh_files.write(ms, target, source=job.source)
    noise = report.get("noise")  # measured where the strength is chosen; the edge-aware filter has no cut-off
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
    record = replace(before, output_sha256=digest(str(written.file)), outcome=asdict(outcome))
    atomic.write_text(job.output + RECORD_ENDING, json.dumps(asdict(record), indent=1) + "\n")
    return outcome


@dataclass(frozen=True)
class Record:
    """What an output was made from, and what was found on the way; a file beside it."""

    input_sha256: str
    filter_name: str
    settings: dict[str, Any]
    version: str
    output_sha256: str = ""
    outcome: dict[str, Any] | None = None

    def asks_the_same(self, other: Record) -> bool:
        """Whether both stand for the same input, filter, settings and version."""
        return asdict(replace(self, output_sha256="", outcome=None)) == asdict(other)

    def is_of(self, output: str) -> bool:
        """Whether the output is, to the bit, what was recorded."""
        return Path(output).is_file() and digest(output) == self.output_sha256


def read_record(output: str) -> Record | None:
    """The record of an output; None where there is none, or none that can be understood."""
    try:
        record = Record(**json.loads(Path(output + RECORD_ENDING).read_text(encoding="utf-8")))
        Outcome(**record.outcome or {})
    except (OSError, ValueError, TypeError):
        return None
    return record


def digest(path: str) -> str:
    """SHA-256 of a file; raises :class:`FileError`."""
    sha = hashlib.sha256()
    try:
        with Path(path).open("rb") as file:
            while block := file.read(2**20):
                sha.update(block)
    except FileNotFoundError as error:
        raise FileError(f"{path}: no such file") from error
    except OSError as error:
        raise FileError(f"{path}: cannot be read: {error.strerror}") from error
    return sha.hexdigest()


def _all_settings(job: Job) -> dict[str, Any]:
    """Settings with defaults for those not given."""
    known = descriptors.load(job.filter_name).parameters
    defaults = {p.name: "any selected" if isinstance(p.default, AnySelected) else portable(p.default) for p in known}
    return defaults | job.settings


def _volume_change(before: Floats, after: Floats, faces: Any) -> float | None:
    """Relative change of the volume that is enclosed, or None where none is."""
    _, exponent = np.frexp(np.abs(before).max(initial=0.0))
    old, new = (Surface(np.ldexp(V, -exponent), faces) for V in (before, after))  # its cube must not overflow
    volume = signed_volume(old)
    if volume == 0 or not is_closed(old):
        return None
    return signed_volume(new) / volume - 1

"""Smooth many meshes, on this machine or on a cluster."""

from __future__ import annotations

import contextlib
import os
import time
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any

from meshlab_specsmooth.batching import cluster, local
from meshlab_specsmooth.batching.inputs import sources
from meshlab_specsmooth.batching.record import NOT_RUN, Outcome
from meshlab_specsmooth.batching.summary import BatchSummary
from meshlab_specsmooth.batching.work import Job, failure
from meshlab_specsmooth.errors import InvalidParameter
from meshlab_specsmooth.meshlab import descriptors
from meshlab_specsmooth.meshlab.filters import FILTERS
from meshlab_specsmooth.meshlab.isolated_filter import encode_argument
from meshlab_specsmooth.meshlab.parameters import resolve_for_any_mesh
from meshlab_specsmooth.parameters import (
    MAX_WORKERS,
    check_choice,
    check_count,
    check_flag,
    check_function,
    check_path,
    show,
)
from meshlab_specsmooth.reports import contact_sheet
from meshlab_specsmooth.runtime import backend
from meshlab_specsmooth.runtime.bars import begin
from meshlab_specsmooth.runtime.folders import ensure_folder
from meshlab_specsmooth.runtime.progress import Progress

#: The filter of ``specsmooth smooth``.
FILTER = "apply_coord_spectral_smoothing"

#: Default time limit per mesh in seconds, a hundred times what ten million vertices take.
TIME_LIMIT = 3600.0

# in a binary PLY file, including two faces
_BYTES_PER_VERTEX = 38


def batch(
    paths: str | os.PathLike[str] | Iterable[str | os.PathLike[str]],
    out: str | os.PathLike[str],
    *,
    filter_name: str = FILTER,
    scheduler: str | None = None,
    workers: int | None = None,
    time_limit: float = TIME_LIMIT,
    resume: bool = True,
    ending: str | None = None,
    pictures: bool = True,
    force: bool = False,
    progress: Progress | None = None,
    each: Callable[[Outcome], None] | None = None,
    **settings: Any,
) -> BatchSummary:
    """Smooth many meshes, in processes of this machine or on a Dask cluster.

    Each output is written whole or not at all, with a record of its input, settings and version beside it
    (``NAME.specsmooth.json``); a mesh whose output and record are there is skipped. A mesh that fails, crashes its
    process or takes too long is reported in the summary; the others are unaffected. Settings and inputs are checked
    before anything is done; a later exception, such as KeyboardInterrupt, leaves a summary of the meshes done so far.

    Parameters
    ----------
    paths : path or iterable of paths
        Files, folders, patterns, manifests; see :func:`meshlab_specsmooth.batching.inputs.sources`.
    out : path
        The output folder, which is created if necessary. Besides the outputs and their records it contains
        ``summary.json``, ``summary.csv`` and contact sheets.
    filter_name : str
        A filter of this package that moves vertices.
    scheduler : str, optional
        Address of a Dask scheduler (extra ``cluster``), whose workers have this package and see the same files.
    workers : int, optional
        Maximum number of processes on this machine; fewer run if there is not enough memory.
    time_limit : float
        Seconds after which the process of a mesh is killed; the mesh then has the status ``"crashed"``.
    resume : bool
        Skip meshes that are done; else smooth them again.
    ending : str, optional
        Format of the outputs, such as ``".ply"``; that of each input by default.
    pictures : bool
        Contact sheets with a picture of each mesh before and after, where the extra ``report`` is installed.
    force : bool
        Write a mesh also if the format rounds its coordinates by more than a tenth of a mean edge; else it fails.
    progress : callable, optional
        Called with the fraction done (of the bytes of the inputs), from 0 to 1.
    each : callable, optional
        Called with the outcome of each mesh as it comes.
    settings
        Keyword arguments of the filter, the same for all meshes.

    Returns
    -------
    BatchSummary

    Raises
    ------
    InvalidParameter
        A setting is invalid, or two meshes would have the same output file.
    FileError
        The output folder cannot be created or written, a manifest cannot be read, or a folder has no mesh.
    MissingExtra, ClusterError

    Examples
    --------
    >>> import tempfile, pymeshlab
    >>> from pathlib import Path
    >>> import meshlab_specsmooth as mss
    >>> ms = pymeshlab.MeshSet()
    >>> ms.create_sphere()
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     ms.save_current_mesh(folder + "/ball.ply")
    ...     mss.batch(folder, folder + "/smooth", modes=50, pictures=False).counts
    {'done': 1}
    """
    start = time.perf_counter()
    filter_name = check_choice(
        "filter_name", filter_name, [name for name in FILTERS if name.startswith("apply_coord_")]
    )
    if ending is not None and not (isinstance(ending, str) and ending.startswith(".") and ending[1:].isalnum()):
        raise InvalidParameter(f"ending is {show(ending)}; it must be that of a format, such as '.ply'")
    if scheduler is not None and not isinstance(scheduler, str):
        raise InvalidParameter(f"scheduler is {show(scheduler)}; it must be an address, such as 'tcp://host:8786'")
    resume, pictures = check_flag("resume", resume), check_flag("pictures", pictures)
    force = check_flag("force", force)
    progress, each = begin(progress, "smoothing"), None if each is None else check_function("each", each)
    workers = None if workers is None else check_count("workers", workers, 1, MAX_WORKERS)
    time_limit = local.check_time_limit(time_limit)
    out = check_path("out", out)
    checked = resolve_for_any_mesh(descriptors.load(filter_name), settings)
    given = {name: encode_argument(value) for name, value in checked.items()}
    found = sources(paths, out, ending)
    folder = Path(out).absolute()
    for place in sorted({str(folder), *(os.path.dirname(source.output) for source in found)}):  # noqa: PTH120
        ensure_folder(Path(place))
    if scheduler is None:
        # the warning of a process would not be seen
        backend.is_compiled(max((source.size for source in found), default=0) // _BYTES_PER_VERTEX)
    jobs = [
        (
            Job(source.path, source.output, filter_name, given, resume, force),
            local.bytes_needed(source.path, source.size),
        )
        for source in found
    ]
    coming = (
        local.outcomes(jobs, workers, time_limit)
        if scheduler is None
        else cluster.outcomes(jobs, scheduler, time_limit)
    )
    known: dict[str, Outcome] = {}

    def summary(pictured: Sequence[str]) -> BatchSummary:
        every = tuple(known.get(job.source) or failure(job, NOT_RUN, "the run was interrupted") for job, _ in jobs)
        return BatchSummary(every, time.perf_counter() - start, tuple(pictured))

    shares = {source.path: source.size + 1 for source in found}
    total, done = sum(shares.values()), 0
    try:
        with contextlib.closing(coming):
            for outcome in coming:
                known[outcome.input] = outcome
                done += shares[outcome.input]
                if each is not None:
                    each(outcome)
                if progress is not None:
                    progress(done / total)
    finally:
        whole = summary([])
        whole.write(folder)
    if pictures:
        there = [(outcome.input, outcome.output) for outcome in whole.outcomes if outcome.is_there]
        whole = summary(contact_sheet.draw_apart(folder, there))
        whole.write(folder)
    return whole

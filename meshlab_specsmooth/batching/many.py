"""``batch``: many meshes smoothed, here or on a cluster."""

from __future__ import annotations

import contextlib
import os
import time
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any

from meshlab_specsmooth.batching import cluster, local
from meshlab_specsmooth.batching.inputs import sources
from meshlab_specsmooth.batching.summary import BatchSummary
from meshlab_specsmooth.batching.work import NOT_RUN, Job, Outcome, failure, portable
from meshlab_specsmooth.errors import InvalidParameter
from meshlab_specsmooth.meshlab import descriptors
from meshlab_specsmooth.meshlab.filters import FILTERS
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
from meshlab_specsmooth.report import contact_sheet
from meshlab_specsmooth.runtime import backend
from meshlab_specsmooth.runtime.bars import begin
from meshlab_specsmooth.runtime.folders import ensure_folder
from meshlab_specsmooth.runtime.progress import Progress

#: What ``specsmooth smooth`` runs.
FILTER = "apply_coord_spectral_smoothing"

#: Seconds for a mesh: ten million vertices take a hundredth of it.
TIME_LIMIT = 3600.0

# Of a binary PLY file, two faces included
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
    (``NAME.specsmooth.json``); what is recorded and there is not done again. A mesh that fails, or takes its process
    down, is a line in the summary. Settings and inputs are checked before anything is done; what is raised later
    (KeyboardInterrupt above all) leaves the summary of what there is.

    Parameters
    ----------
    paths : path or iterable of paths
        Files, folders, patterns, manifests; see :func:`meshlab_specsmooth.batching.inputs.sources`.
    out : path
        The output folder, made if need be. Besides the outputs and their records it gets ``summary.json``,
        ``summary.csv`` and contact sheets.
    filter_name : str
        One of our filters that move vertices.
    scheduler : str, optional
        Address of a Dask scheduler (extra ``cluster``), whose workers have this package and see the same files.
    workers : int, optional
        How many processes of this machine at most; fewer run where the memory would not suffice.
    time_limit : float
        Seconds that a process may take for a mesh; then it is killed, and the mesh has crashed.
    resume : bool
        Skip what is done; else do it again.
    ending : str, optional
        Format of the outputs, as ``".ply"``; that of each input by default.
    pictures : bool
        Contact sheets with a picture of each mesh before and after, where the extra ``report`` is installed.
    force : bool
        Write also where a format rounds coordinates by more than a tenth of a mean edge; else such a mesh fails.
    progress : callable, optional
        Called with the fraction done (of the inputs' bytes), rising to 1.
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
        A setting is wrong, or two meshes would become the same file.
    FileError
        The output folder cannot be made or written, a manifest cannot be read, a folder has no mesh.
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
        raise InvalidParameter(f"ending is {show(ending)}; it must be that of a format, as '.ply'")
    if scheduler is not None and not isinstance(scheduler, str):
        raise InvalidParameter(f"scheduler is {show(scheduler)}; it must be an address, as 'tcp://host:8786'")
    resume, pictures = check_flag("resume", resume), check_flag("pictures", pictures)
    force = check_flag("force", force)
    progress, each = begin(progress, "smoothing"), None if each is None else check_function("each", each)
    workers = None if workers is None else check_count("workers", workers, 1, MAX_WORKERS)
    time_limit = local.check_time_limit(time_limit)
    out = check_path("out", out)
    checked = resolve_for_any_mesh(descriptors.load(filter_name), settings)
    given = {name: portable(value) for name, value in checked.items()}
    found = sources(paths, out, ending)
    folder = Path(out).absolute()
    for place in sorted({str(folder), *(os.path.dirname(source.output) for source in found)}):  # noqa: PTH120
        ensure_folder(Path(place))
    if scheduler is None:
        # the processes' own words go nowhere
        backend.is_compiled(max((source.size for source in found), default=0) // _BYTES_PER_VERTEX)
    jobs = [(Job(source.path, source.output, filter_name, given, resume, force), source.size) for source in found]
    coming = (
        local.outcomes(jobs, workers, time_limit)
        if scheduler is None
        else cluster.outcomes(jobs, scheduler, time_limit)
    )
    known: dict[str, Outcome] = {}

    def summary(pictured: Sequence[str]) -> BatchSummary:
        every = tuple(known.get(job.source) or failure(job, NOT_RUN, "the run was broken off") for job, _ in jobs)
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

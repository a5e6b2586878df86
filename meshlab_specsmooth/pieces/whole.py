"""Smooth a mesh file that is larger than memory, in pieces."""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
import re
import shutil
import time
from collections.abc import Callable, Generator, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from meshlab_specsmooth.batching import cluster, local
from meshlab_specsmooth.batching.record import DONE, SKIPPED, Outcome
from meshlab_specsmooth.choices import Boundary, LaplacianKind
from meshlab_specsmooth.describe import Described, Rows, count_of, format_length
from meshlab_specsmooth.errors import FileError, FilterFailed, InvalidParameter
from meshlab_specsmooth.noise.model import IMPULSE, Noise
from meshlab_specsmooth.operators.assemble import BYTES_PER_VERTEX
from meshlab_specsmooth.operators.boundary import BLENDING_RINGS
from meshlab_specsmooth.parameters import MAX_WORKERS, check_count, check_number, check_path, resolve_extent, show
from meshlab_specsmooth.pieces.cut import Survey, cut, find_reach, survey
from meshlab_specsmooth.pieces.margin import TOLERANCE, find_margin
from meshlab_specsmooth.pieces.partition import split_space
from meshlab_specsmooth.pieces.piece import (
    TOO_NARROW,
    PieceJob,
    PieceResult,
    Plan,
    pack_tree,
    read_result,
    unpack_tree,
    write_plan,
)
from meshlab_specsmooth.pieces.ply import PlyFile, open_ply
from meshlab_specsmooth.pieces.serve import serve_pieces
from meshlab_specsmooth.pieces.weld import Parts, Tiles, open_parts, weld
from meshlab_specsmooth.runtime import atomic, memory
from meshlab_specsmooth.runtime.bars import begin
from meshlab_specsmooth.runtime.folders import ensure_folder
from meshlab_specsmooth.runtime.progress import Progress, announce, finish, subrange
from meshlab_specsmooth.runtime.warned import unwarned
from meshlab_specsmooth.smoothing.api import smooth
from meshlab_specsmooth.smoothing.automatic import scale_modes
from meshlab_specsmooth.smoothing.result import SmoothingResult, join_warnings
from meshlab_specsmooth.smoothing.settings import Region, Smoothing
from meshlab_specsmooth.spectral.low_pass import CutoffResponse
from meshlab_specsmooth.spectral.response import Response, name_of

#: Default time limit per piece in seconds.
TIME_LIMIT = 3600.0

# Of a piece beside the operators: its faces, indices and results. Measured by scripts/benchmark_pieces.py
_BYTES_PER_VERTEX = BYTES_PER_VERTEX + 700
# Of this process and of each worker before the first piece, with one block of faces
_BASE, _BASE_OF_WORKER = 350 * 2**20, 400 * 2**20
_MIN_PIECE, _MAX_PIECE = 20_000, 4_000_000
# A margin that is too narrow for long edges is widened so often, by this factor
_WIDENINGS, _WIDER = 5, 2.0
# Tolerance of the least squares of a piece, over the difference to the whole: the largest error of a vertex is up to
# fifty times the relative one
_SHARE_OF_SOLVER = 0.01
# Fractions of the time
_WELDED, _SURVEYED, _CUT, _SMOOTHED = 0.2, 0.1, 0.25, 0.9

_UNITS = {"": 1, "K": 2**10, "M": 2**20, "G": 2**30, "T": 2**40}


@dataclass(frozen=True, repr=False)
class PiecesResult(Described):
    """What was done to a file in pieces.

    Attributes
    ----------
    output : str
    vertices, faces : int
    pieces : int
    rings : int
        Of the margin of each piece.
    setting : dict
        The one setting of all pieces.
    noise : Noise or None
        Of samples from all over the mesh; None if the weight was given.
    displacement : float
        Root mean square, in mesh units.
    volume_change : float or None
        Relative, of the whole; None if it has no volume.
    mean_edge : float
    seconds : float
    warning : str or None
    """

    output: str
    vertices: int
    faces: int
    pieces: int
    rings: int
    setting: dict[str, Any]
    noise: Noise | None
    displacement: float
    volume_change: float | None
    mean_edge: float
    seconds: float
    warning: str | None = None

    @property
    def summary(self) -> str:
        """Summary of the result in one sentence."""
        if self.displacement == 0:
            return f"{self.vertices} vertices left as they are: {self.warning}"
        noise = "" if self.noise is None else f"; {self.noise.summary}"
        return (
            f"{self.vertices} vertices in {count_of(self.pieces, 'piece')} with {self.rings} rings of margin, "
            f"barycenter weight {self.setting['barycenter_weight']:.3g}{noise}"
        )

    def rows(self) -> Rows:
        """Return names and values to display below the summary."""
        rows = [("moved", f"{format_length(self.displacement, self.mean_edge)} (RMS)")]
        if self.volume_change is not None:
            rows.append(("volume", f"{100 * self.volume_change:+.3f} %"))
        rows += [("mean edge", f"{self.mean_edge:.4g}"), ("time", f"{self.seconds:.1f} s")]
        return rows if self.warning is None else [*rows, ("warning", self.warning)]


def smooth_pieces(
    source: str | os.PathLike[str],
    out: str | os.PathLike[str],
    *,
    memory_limit: int | str | None = None,
    difference: float = TOLERANCE,
    scheduler: str | None = None,
    workers: int = 1,
    time_limit: float = TIME_LIMIT,
    resume: bool = True,
    boundary: Boundary = "auto",
    max_displacement: float | str | None = None,
    laplacian: LaplacianKind = "uniform",
    weld: bool = True,
    progress: Progress | None = None,
    **setting: Any,
) -> PiecesResult:
    """Smooth a mesh file of any size as :func:`meshlab_specsmooth.smooth` does, within a given amount of memory.

    The file is looked at once. The noise is measured and the setting chosen on samples from all over it. Space is
    cut into boxes with as many vertices each; a piece is the surface in a box with a margin of some rings, for
    which its own vertices become what they would in the whole, up to ``difference``. Pieces are smoothed one by
    one, in processes of this machine or on a Dask cluster, and put together. Properties of vertices and faces that
    have no meaning here are copied to the byte, and normals are computed anew. The output is written whole or not
    at all. Finished pieces are kept in the folder ``OUT.pieces`` until the whole is done; the same call goes on
    where an earlier one ended.

    Parameters
    ----------
    source : path
        A binary PLY file of triangles, a binary STL file, or a folder of binary PLY files (tiles) whose vertices
        coincide where they touch.
    out : path
        A file in the format of the source; for tiles a folder.
    memory_limit : int or str, optional
        Bytes that all processes of this machine may take together, or such as ``"4G"``; by default half of what is
        free. On a cluster, what one worker may take.
    difference : float
        Largest difference to smoothing the whole, relative to the root mean square displacement; the margin follows.
    scheduler : str, optional
        Address of a Dask scheduler (extra ``cluster``), whose workers have this package and see the same files.
    workers : int
        Processes on this machine; the pieces become smaller with more of them.
    time_limit : float
        Seconds after which the process of a piece is killed.
    resume : bool
        Keep what an earlier call for the same file and setting has done.
    boundary, max_displacement, laplacian, weld
        As for :func:`meshlab_specsmooth.smooth`; a percentage is of the diagonal of the whole.
    progress : callable, optional
    **setting
        Fields of :class:`meshlab_specsmooth.Smoothing`: one setting for all pieces. ``modes`` are those of the whole.
        A weight for each vertex and a response of your own are not supported.

    Returns
    -------
    PiecesResult

    Raises
    ------
    InvalidParameter
    FileError
        The source is no such file, or the output cannot be written; what is finished is kept.
    FilterFailed
        A piece failed; what is finished is kept.

    Examples
    --------
    >>> import tempfile
    >>> import meshlab_specsmooth as mss
    >>> ms = mss.MeshSet()
    >>> ms.create_sphere(subdiv=5)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     ms.save_current_mesh(folder + "/ball.ply")
    ...     result = mss.smooth_pieces(folder + "/ball.ply", folder + "/smooth.ply", barycenter_weight=1.0)
    >>> result.vertices, result.pieces
    (10242, 1)
    """
    began = time.perf_counter()
    asked = Smoothing.of(**setting)
    if isinstance(asked.barycenter_weight, np.ndarray) or isinstance(asked.low_pass, Response) or asked.spacing:
        raise InvalidParameter(
            "pieces have one weight and a response by name, and no spacing; smooth the whole instead"
        )
    region = Region(boundary=boundary, max_displacement=max_displacement)
    if boundary == "curve":  # its mean edge is that of all curves
        raise InvalidParameter(
            "boundary is 'curve'; pieces have 'auto', 'fixed' or 'free' (mss.smooth_boundary smooths it)"
        )
    limit = check_memory(memory_limit)
    difference = check_number("difference", difference, 1e-8, 0.5)
    workers = check_count("workers", workers, 1, MAX_WORKERS)
    time_limit = local.check_time_limit(time_limit)
    progress = begin(progress, "looking at the file")
    place = check_path("source", source)
    opened = open_parts(place) or open_ply(place)
    parts = None if isinstance(opened, PlyFile) else opened
    names = [opened.path] if isinstance(opened, PlyFile) else opened.paths
    target = _check_target(check_path("out", out), parts, names)
    given = {"setting": repr(asked), "region": repr(region), "laplacian": laplacian, "weld": weld}
    folder = _open_folder(target, names, {**given, "difference": difference}, resume)
    report = subrange(progress, 0.0, 0.0 if parts is None else _WELDED) or _ignore
    file, ids = (opened, None) if isinstance(opened, PlyFile) else _weld(opened, folder, report)
    progress = progress if parts is None else subrange(progress, _WELDED, 1 - _WELDED)
    seen, plan, chosen = _prepare(file, folder, asked, region, laplacian, weld, difference, limit, workers, progress)
    results: list[PieceResult] = []
    if plan is not None:
        results = _smooth_all(file, folder, plan, seen, scheduler, workers, time_limit, limit, progress)
    announce(progress, "writing")
    moved = target if parts is None else folder / "moved.ply"
    _write_whole(file, moved, results, subrange(progress, _SMOOTHED, 1 - _SMOOTHED))
    if parts is not None and ids is not None:
        parts.write(target, open_ply(moved), ids)
    summary = _summarize(file, target, seen, plan, chosen, results, began)
    del results, ids  # they read from the folder
    shutil.rmtree(folder)
    finish(progress)
    return summary


def _ignore(fraction: float) -> None:
    """Report nothing."""


def _check_target(out: str, parts: Parts | None, names: Sequence[Path]) -> Path:
    """The output, which has the format of the source; a folder for tiles."""
    if isinstance(parts, Tiles):
        target = Path(out)
        if target.resolve() == names[0].parent.resolve():
            raise InvalidParameter(f"{out} is both source and output; give another output")
        ensure_folder(target)
        return target
    target = atomic.check_place(out)
    ending = names[0].suffix.lower()
    if target.suffix.lower() != ending:
        raise InvalidParameter(f"out is {show(out)}; pieces are written in the format of the source, {ending}")
    if target.resolve() == names[0].resolve():
        raise InvalidParameter(f"{out} is both source and output; give another output")
    return target


def _weld(parts: Parts, folder: Path, report: Callable[[float], None]) -> tuple[PlyFile, npt.NDArray[np.int64]]:
    """The parts as one file, unless an earlier call has written it."""
    done = folder / "welded"
    if done.exists():
        return open_ply(folder / "welded.ply"), np.load(folder / "ids.npy", mmap_mode="r")
    found = weld(parts, folder, report)
    atomic.write_text(done, "")
    return found


def check_memory(value: int | str | None) -> int:
    """Return an amount of memory in bytes.

    Examples
    --------
    >>> from meshlab_specsmooth.pieces.whole import check_memory
    >>> check_memory("2G") == check_memory(2**31), check_memory("512MB") == 2**29
    (True, True)
    """
    if value is None:
        return memory.available() // 2
    match = (
        re.fullmatch(r"(\d+(?:\.\d+)?)\s*([KMGT]?)i?B?", value.strip(), re.IGNORECASE)
        if isinstance(value, str)
        else None
    )
    amount = int(float(match[1]) * _UNITS[match[2].upper()]) if match else value
    if isinstance(amount, str):
        raise InvalidParameter(f"memory_limit is {show(value)}; it must be a number of bytes, or such as '4G'")
    return check_count("memory_limit", amount, 2**29, 2**60, "at least half a gigabyte, as a number of bytes or '4G'")


def _open_folder(target: Path, names: Sequence[Path], asked: dict[str, Any], resume: bool) -> Path:
    """The folder for what is being done, emptied unless an earlier call for the same began it."""
    folder = target.with_name(target.name + ".pieces")
    files = [(str(name), name.stat().st_size, name.stat().st_mtime_ns) for name in names]
    identity = json.dumps({**asked, "files": files}, sort_keys=True)
    digest, mark = hashlib.sha256(identity.encode()).hexdigest(), folder / "identity"
    if folder.exists():
        if not mark.exists():
            raise FileError(f"{folder}: exists and is not from an earlier call; move it away")
        if not resume or mark.read_text(encoding="utf-8") != digest:
            shutil.rmtree(folder)
    ensure_folder(folder)
    atomic.write_text(mark, digest)
    return folder


def _prepare(
    file: PlyFile,
    folder: Path,
    asked: Smoothing,
    region: Region,
    laplacian: LaplacianKind,
    weld: bool,
    difference: float,
    limit: int,
    workers: int,
    progress: Progress | None,
) -> tuple[Survey, Plan | None, SmoothingResult]:
    """Look at the file, and choose the setting, the margin and the partition; no plan where nothing is to be done."""
    report = subrange(progress, 0.0, _SURVEYED)
    seen = survey(file, folder, report or _ignore)
    chosen = _choose(file, seen, asked, laplacian, weld)
    if chosen.noise is not None and chosen.noise.is_left_alone:
        return seen, None, chosen
    weight = chosen.barycenter_weight
    # where the noise varies each vertex has a weight; the pieces have one, the mean on a scale of factors
    one_weight = float(np.exp(np.mean(np.log(np.maximum(weight, 1e-12)))))
    iterations = chosen.setting.iterations if isinstance(chosen.setting, Smoothing) else asked.iterations
    rings = iterations * find_margin(one_weight, chosen.cutoff, difference)
    if region.boundary == "free":  # a mask holds the cut, and fades out
        rings += BLENDING_RINGS
    per_worker = (limit - _BASE) // workers - _BASE_OF_WORKER
    most = int(np.clip(per_worker // _BYTES_PER_VERTEX, _MIN_PIECE, _MAX_PIECE))
    count = _count_pieces(file.vertex_count, most, rings)
    displacement = region.max_displacement
    plan = Plan(
        name_of(chosen.response),
        chosen.cutoff,
        one_weight,
        iterations,
        region.boundary,
        laplacian,
        weld,
        None if displacement is None else resolve_extent(displacement, seen.diagonal),
        min(asked.tolerance, _SHARE_OF_SOLVER * difference),
        rings,
        pack_tree(split_space(seen.points, count)),
    )
    return seen, plan, chosen


def _count_pieces(vertices: int, most: int, rings: int) -> int:
    """The number of pieces such that each has at most so many vertices with its margin, as on a flat square."""
    side = max(np.sqrt(most) - 2 * rings, np.sqrt(most) / 3)
    return 1 if vertices <= most else int(np.ceil(vertices / side**2))


def _choose(file: PlyFile, seen: Survey, asked: Smoothing, laplacian: LaplacianKind, weld: bool) -> SmoothingResult:
    """Smooth samples from all over the mesh: what was chosen for them is chosen for all."""
    patches = [(V, F) for V, F in seen.patches if len(F)]
    starts = np.cumsum([0, *(len(V) for V, _ in patches)])
    V = np.concatenate([V for V, _ in patches])
    F = np.concatenate([F + start for (_, F), start in zip(patches, starts[:-1], strict=True)])
    setting = scale_modes(asked, len(V) / file.vertex_count, len(V))
    low_pass = setting.low_pass
    if isinstance(low_pass, CutoffResponse) and low_pass.wavelength is not None:
        edges = np.linalg.norm(V[F] - np.roll(V[F], 1, axis=1), axis=2).mean()
        setting = replace(
            setting, low_pass=replace(low_pass, wavelength=low_pass.wavelength * float(edges) / seen.mean_edge)
        )
    with unwarned():
        return smooth(V, F, setting, laplacian=laplacian, weld=weld)


def _smooth_all(
    file: PlyFile,
    folder: Path,
    plan: Plan,
    seen: Survey,
    scheduler: str | None,
    workers: int,
    time_limit: float,
    limit: int,
    progress: Progress | None,
) -> list[PieceResult]:
    """Cut the file, and smooth all pieces; those whose margin is too narrow once more with a wider one."""
    tree = unpack_tree(plan.tree)
    reach = find_reach(seen, tree, plan.rings)
    write_plan(folder, plan)
    left = [number for number in range(tree.end) if not _result_of(folder, number).exists()]
    for _ in range(_WIDENINGS):
        if not left:
            break
        announce(progress, "cutting")
        report = subrange(progress, _SURVEYED, _CUT - _SURVEYED)
        counts = cut(file, tree, reach, folder, report or _ignore)
        announce(progress, f"smoothing {count_of(len(left), 'piece')}")
        jobs = [
            (PieceJob(str(file.path.absolute()), str(_result_of(folder, n)), str(folder), n), _bytes_needed(counts[n]))
            for n in left
        ]
        coming = (
            local.outcomes(jobs, workers, time_limit, serve_pieces, limit)
            if scheduler is None
            else cluster.outcomes(jobs, scheduler, time_limit, serve_pieces)
        )
        left = _collect(coming, len(jobs), subrange(progress, _CUT, _SMOOTHED - _CUT))
        reach[left] *= _WIDER
    if left:
        raise FilterFailed(
            f"the edges around piece {left[0]} are too long for a margin of {plan.rings} rings; raise the weight"
        )
    return [read_result(_result_of(folder, number)) for number in range(tree.end)]


def _result_of(folder: Path, number: int) -> Path:
    return folder / f"result-{number:06}.bin"


def _bytes_needed(faces: int) -> int:
    """Of a piece in a process of its own."""
    return _BASE_OF_WORKER + faces // 2 * _BYTES_PER_VERTEX


def _collect(coming: Generator[Outcome], count: int, progress: Progress | None) -> list[int]:
    """Wait for all pieces; returns those whose margin is too narrow, and raises where one failed for another reason."""
    narrow: list[tuple[int, str]] = []
    failed: list[tuple[int, str]] = []
    done = 0
    with contextlib.closing(coming):
        for outcome in coming:
            done += 1
            number = int(Path(outcome.output).stem.rpartition("-")[2])
            if outcome.status not in (DONE, SKIPPED):
                (narrow if outcome.reason.startswith(TOO_NARROW) else failed).append((number, outcome.reason))
            if progress is not None:
                progress(done / count)
    if failed:
        number, reason = failed[0]
        raise FilterFailed(
            f"piece {number}: {reason}; {count - len(failed)} of {count} pieces are kept for the next call"
        )
    return [number for number, _ in sorted(narrow)]


def _write_whole(file: PlyFile, target: Path, results: list[PieceResult], progress: Progress | None) -> None:
    """Write the file with new positions, and with all other bytes as they were."""

    def change(first: int, block: npt.NDArray[Any]) -> None:
        for result in results:
            low, high = np.searchsorted(result.ids, [first, first + len(block)])
            at = result.ids[low:high] - first
            for axis, column in enumerate("xyz"):
                block[column][at] = result.positions[low:high, axis]
                if result.normals is not None:
                    block["n" + column][at] = result.normals[low:high, axis]
        if progress is not None:
            progress((first + len(block)) / file.vertex_count)

    file.write_moved(target, change)


def _summarize(
    file: PlyFile,
    target: Path,
    seen: Survey,
    plan: Plan | None,
    chosen: SmoothingResult,
    results: list[PieceResult],
    began: float,
) -> PiecesResult:
    before, after = (sum(result.volumes[k] for result in results) for k in (0, 1))
    square = sum(result.square for result in results)
    varies = "the noise varies, but the pieces have one weight" if np.ndim(chosen.barycenter_weight) else None
    strays = chosen.noise is not None and (chosen.noise.kind == IMPULSE or len(chosen.outliers) > 0)
    far_off = "vertices far off are smoothed with the rest, not put back first" if strays else None
    warning = join_warnings(chosen.warning, varies, far_off)
    return PiecesResult(
        output=str(target),
        vertices=file.vertex_count,
        faces=file.face_count,
        pieces=len(results),
        rings=0 if plan is None else plan.rings,
        setting={} if plan is None else {k: v for k, v in asdict(plan).items() if k not in ("tree", "rings")},
        noise=chosen.noise,
        displacement=float(np.sqrt(square / file.vertex_count)),
        volume_change=after / before - 1 if abs(before) > 1e-9 * seen.diagonal**3 else None,
        mean_edge=seen.mean_edge,
        seconds=time.perf_counter() - began,
        warning=warning if plan is not None else (chosen.noise.summary if chosen.noise is not None else warning),
    )

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
from meshlab_specsmooth.choices import LaplacianKind
from meshlab_specsmooth.describe import count_of
from meshlab_specsmooth.errors import FileError, FilterFailed, InvalidParameter
from meshlab_specsmooth.noise.model import IMPULSE, Noise
from meshlab_specsmooth.noise.shape_change import judge_change
from meshlab_specsmooth.operators.assemble import BYTES_PER_VERTEX
from meshlab_specsmooth.operators.boundary import BLENDING_RINGS
from meshlab_specsmooth.parameters import MAX_WORKERS, check_count, check_number, check_path, resolve_extent, show
from meshlab_specsmooth.pieces.choose import Choice
from meshlab_specsmooth.pieces.cut import Survey, cut, find_reach, survey
from meshlab_specsmooth.pieces.margin import find_margin
from meshlab_specsmooth.pieces.partition import split_space
from meshlab_specsmooth.pieces.piece import (
    TOO_NARROW,
    PieceJob,
    PieceResult,
    Sums,
    measure_boundary,
    read_result,
)
from meshlab_specsmooth.pieces.plan import Plan, pack_noise, pack_tree, unpack_tree, write_plan
from meshlab_specsmooth.pieces.ply import PlyFile, open_ply, stack
from meshlab_specsmooth.pieces.result import PiecesResult
from meshlab_specsmooth.pieces.serve import serve_pieces
from meshlab_specsmooth.pieces.weld import Parts, Tiles, open_parts, weld
from meshlab_specsmooth.runtime import atomic, memory
from meshlab_specsmooth.runtime.bars import begin
from meshlab_specsmooth.runtime.folders import ensure_folder
from meshlab_specsmooth.runtime.progress import Progress, announce, finish, monotone, subrange
from meshlab_specsmooth.smoothing.result import join_warnings
from meshlab_specsmooth.smoothing.settings import Region

#: Default time limit per piece in seconds.
TIME_LIMIT = 3600.0

# Of a piece beside the operators: its faces, indices and results. Measured by scripts/benchmark_pieces.py
# for the edge-aware filter its faces have neighbors and weights
_BYTES_PER_VERTEX = {"isotropic": BYTES_PER_VERTEX + 700, "edge_aware": 2000}
# What the clipping of impulses spreads over its iterations
_RINGS_OF_CLIPPING = 30
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

# Of a plan, what a result shows
_SHOWN = (
    "bands",
    "levels",
    "response",
    "cutoff",
    "iterations",
    "boundary",
    "laplacian",
    "weld",
    "max_displacement",
    "tolerance",
)

_UNITS = {"": 1, "K": 2**10, "M": 2**20, "G": 2**30, "T": 2**40}


@dataclass(frozen=True, eq=False)
class Request:
    """What is asked for.

    Attributes
    ----------
    choose : callable
        Makes the choice for all pieces, from a survey and the number of vertices.
    setting : str
        By which the request is recognized again.
    region : Region
    laplacian, weld
    by_region : bool
        Whether the noise is treated by region.
    difference : float
        To smoothing the whole, relative to the root mean square displacement.
    tolerance : float
        Of the least squares, at most.
    """

    choose: Callable[[Survey, int], Choice]
    setting: str
    region: Region
    laplacian: LaplacianKind
    weld: bool
    by_region: bool
    difference: float
    tolerance: float = 1.0

    @property
    def identity(self) -> dict[str, Any]:
        """What makes this request differ from others for the same file."""
        names = ("setting", "laplacian", "weld", "by_region", "difference", "tolerance")
        function = getattr(self.choose, "__qualname__", "")
        return {**{name: getattr(self, name) for name in names}, "region": repr(self.region), "choose": function}


@dataclass(frozen=True)
class Machines:
    """Where pieces are smoothed: processes of this machine, or a Dask cluster; ``limit`` is in bytes."""

    limit: int
    scheduler: str | None
    workers: int
    time_limit: float

    @staticmethod
    def of(memory_limit: int | str | None, scheduler: str | None, workers: int, time_limit: float) -> Machines:
        """By the parameters of the public functions."""
        return Machines(
            check_memory(memory_limit),
            scheduler,
            check_count("workers", workers, 1, MAX_WORKERS),
            local.check_time_limit(time_limit),
        )

    def outcomes(self, jobs: Sequence[tuple[PieceJob, int]]) -> Generator[Outcome]:
        """Smooth pieces."""
        if self.scheduler is None:
            return local.outcomes(jobs, self.workers, self.time_limit, serve_pieces, self.limit)
        return cluster.outcomes(jobs, self.scheduler, self.time_limit, serve_pieces)


def smooth_whole(
    source: str | os.PathLike[str],
    out: str | os.PathLike[str],
    request: Request,
    machines: Machines,
    resume: bool,
    progress: Progress | None,
) -> PiecesResult:
    """Smooth a file in pieces; parameters as for :func:`meshlab_specsmooth.smooth_pieces`."""
    began = time.perf_counter()
    request = replace(request, difference=check_number("difference", request.difference, 1e-8, 0.5))
    # pieces that are cut again come late
    progress = monotone(begin(progress, "looking at the file"))
    place = check_path("source", source)
    opened = open_parts(place) or open_ply(place)
    parts = None if isinstance(opened, PlyFile) else opened
    names = [opened.path] if isinstance(opened, PlyFile) else opened.paths
    target = _check_target(check_path("out", out), parts, names)
    folder = _open_folder(target, names, request.identity, resume)
    report = subrange(progress, 0.0, 0.0 if parts is None else _WELDED) or _ignore
    file, ids = (opened, None) if isinstance(opened, PlyFile) else _weld(opened, folder, report)
    progress = progress if parts is None else subrange(progress, _WELDED, 1 - _WELDED)
    seen = survey(file, folder, subrange(progress, 0.0, _SURVEYED) or _ignore, request.by_region)
    choice = request.choose(seen, file.vertex_count)
    plan: Plan | None = None
    results: list[PieceResult] = []
    if choice.moves:
        plan = _make_plan(file, seen, choice, request, machines)
        results = _smooth_all(file, folder, plan, seen, machines, progress)
    change = _judge(results, plan, choice, seen)
    announce(progress, "writing")
    moved = target if parts is None else folder / "moved.ply"
    _write_whole(file, moved, results, change.step, plan, subrange(progress, _SMOOTHED, 1 - _SMOOTHED))
    if parts is not None and ids is not None:
        parts.write(target, open_ply(moved), ids)
    summary = _summarize(file, target, seen, plan, choice, results, change, began)
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


def _make_plan(file: PlyFile, seen: Survey, choice: Choice, request: Request, machines: Machines) -> Plan:
    """The margin and the partition for what was chosen."""
    region = request.region
    margin = find_margin(
        choice.lowest_weight,
        choice.cutoff,
        request.difference,
        choice.edge_aware_iterations,
        region.boundary == "curve",
    )
    rings = choice.iterations * margin
    if choice.filter == "isotropic" and region.boundary == "free":  # a mask holds the cut, and fades out
        rings += BLENDING_RINGS
    if choice.noise is not None and choice.noise.kind == IMPULSE:
        rings += _RINGS_OF_CLIPPING
    per_worker = (machines.limit - _BASE) // machines.workers - _BASE_OF_WORKER
    most = int(np.clip(per_worker // _BYTES_PER_VERTEX[choice.filter], _MIN_PIECE, _MAX_PIECE))
    count = _count_pieces(file.vertex_count, most, rings)
    displacement = region.max_displacement
    return Plan(
        filter=choice.filter,
        bands=choice.bands,
        levels=choice.levels,
        noise=pack_noise(choice.noise or Noise.zero(seen.mean_edge)),
        mean_edge=seen.mean_edge,
        curve_edge=None,
        stray_offset=choice.stray_offset if choice.is_automatic else None,
        response=choice.response,
        cutoff=choice.cutoff,
        iterations=choice.iterations,
        boundary=region.boundary,
        laplacian=request.laplacian,
        weld=request.weld,
        max_displacement=None if displacement is None else resolve_extent(displacement, seen.diagonal),
        tolerance=min(request.tolerance, _SHARE_OF_SOLVER * request.difference),
        rings=rings,
        center=seen.center.tolist(),
        tree=pack_tree(split_space(seen.points, count)),
    )


def _count_pieces(vertices: int, most: int, rings: int) -> int:
    """The number of pieces such that each has at most so many vertices with its margin, as on a flat square."""
    side = max(np.sqrt(most) - 2 * rings, np.sqrt(most) / 3)
    return 1 if vertices <= most else int(np.ceil(vertices / side**2))


def _smooth_all(
    file: PlyFile, folder: Path, plan: Plan, seen: Survey, machines: Machines, progress: Progress | None
) -> list[PieceResult]:
    """Cut the file, and smooth all pieces; those whose margin is too narrow once more with a wider one."""
    tree = unpack_tree(plan.tree)
    reach = find_reach(seen, tree, plan.rings)
    left = [number for number in range(tree.end) if not _result_of(folder, number).exists()]
    for attempt in range(_WIDENINGS):
        if not left:
            break
        announce(progress, "cutting")
        report = subrange(progress, _SURVEYED, _CUT - _SURVEYED)
        counts = cut(file, tree, reach, folder, report or _ignore)
        if attempt == 0:
            if plan.boundary == "curve":
                plan = replace(plan, curve_edge=_measure_curves(file, folder, plan, tree.end))
            write_plan(folder, plan)
        source = str(file.path.absolute())
        pieces = [PieceJob(source, str(_result_of(folder, number)), str(folder), number) for number in left]
        jobs = [(piece, _bytes_needed(counts[piece.number], plan)) for piece in pieces]
        left = _collect(machines.outcomes(jobs), len(jobs), subrange(progress, _CUT, _SMOOTHED - _CUT))
        reach[left] *= _WIDER
    if left:
        raise FilterFailed(
            f"the edges around piece {left[0]} are too long for a margin of {plan.rings} rings; raise the weight"
        )
    return [read_result(_result_of(folder, number)) for number in range(tree.end)]


def _measure_curves(file: PlyFile, folder: Path, plan: Plan, count: int) -> float | None:
    """The mean edge of the boundary of the whole; None if it is closed."""
    found = [measure_boundary(folder, number, file, plan) for number in range(count)]
    length, edges = (sum(column) for column in zip(*found, strict=True))
    return length / edges if edges else None


def _result_of(folder: Path, number: int) -> Path:
    return folder / f"result-{number:06}.bin"


def _bytes_needed(faces: int, plan: Plan) -> int:
    """Of a piece in a process of its own."""
    return _BASE_OF_WORKER + faces // 2 * _BYTES_PER_VERTEX[plan.filter]


def _collect(coming: Generator[Outcome], count: int, progress: Progress | None) -> list[int]:
    """Wait for all pieces; returns those whose margin is too narrow, and raises where one failed for another reason."""
    narrow: list[tuple[int, str]] = []
    failed: list[tuple[int, str]] = []
    done = 0
    announce(progress, f"0 of {count_of(count, 'piece')}")
    with contextlib.closing(coming):
        for outcome in coming:
            done += 1
            number = int(Path(outcome.output).stem.rpartition("-")[2])
            if outcome.status not in (DONE, SKIPPED):
                (narrow if outcome.reason.startswith(TOO_NARROW) else failed).append((number, outcome.reason))
            announce(progress, f"{done} of {count_of(count, 'piece')}")
            if progress is not None:
                progress(done / count)
    if failed:
        number, reason = failed[0]
        raise FilterFailed(
            f"piece {number}: {reason}; {count - len(failed)} of {count} pieces are kept for the next call"
        )
    return [number for number, _ in sorted(narrow)]


@dataclass(frozen=True)
class _Change:
    """What all pieces did to the shape.

    Attributes
    ----------
    volume : float or None
        Relative.
    step : float
        How far all vertices move along their normals to hold it.
    note : str or None
    """

    volume: float | None = None
    step: float = 0.0
    note: str | None = None


def _judge(results: Sequence[PieceResult], plan: Plan | None, choice: Choice, seen: Survey) -> _Change:
    """Hold the shape of the whole against the noise, and its volume where that is to be held."""
    if plan is None:
        return _Change()
    sums = Sums.unpack(np.sum([result.sums.pack() for result in results], axis=0))
    closed = np.array([sums.boundary == 0])
    noise = choice.noise or Noise.zero(seen.mean_edge)
    noise = replace(noise, level=max(noise.level, choice.level), local=None)
    change = judge_change(sums.before, sums.after, closed, noise)
    volume, offset = float(change.volume[0]), float(change.offset[0])
    step, note = 0.0, None
    # of an edge-aware filter the volume is held, of the isotropic one if it would change by more than noise explains
    if plan.filter == "edge_aware" or (choice.is_automatic and change.excessive[0]):
        step = offset if abs(offset) <= noise.level else 0.0
    if choice.is_automatic and change.excessive[0]:
        held = replace(sums.after, volume=sums.after.volume + step * sums.after.area)
        if judge_change(sums.before, held, closed, noise).excessive[0]:
            raise FilterFailed(
                f"smoothing would change the shape by more than noise explains ({change.describe()}); nothing is "
                "written. Give a setting (barycenter_weight)"
            )
        note = f"the volume was held, which smoothing would change ({change.describe()})"
    elif not choice.is_automatic and change.is_large:
        note = f"this setting changes the shape: {change.describe()}"
    if np.isfinite(volume) and step:
        volume += step * float(sums.after.area[0]) / float(sums.before.volume[0])
    return _Change(volume if np.isfinite(volume) else None, step, note)


def _write_whole(
    file: PlyFile,
    target: Path,
    results: Sequence[PieceResult],
    step: float,
    plan: Plan | None,
    progress: Progress | None,
) -> None:
    """Write the file with new positions, all moved a step along their normals, and all other bytes as they were."""
    limit = None if plan is None else plan.max_displacement

    def change(first: int, block: npt.NDArray[Any]) -> None:
        for result in results:
            low, high = np.searchsorted(result.ids, [first, first + len(block)])
            at = result.ids[low:high] - first
            X, normals = result.positions[low:high], result.normals[low:high]
            if step:
                given = stack(block[at])
                motion = X - given
                motion = np.where(motion.any(axis=1, keepdims=True), motion + step * normals, 0.0)
                if limit is not None:
                    motion *= np.minimum(1, limit / np.maximum(np.linalg.norm(motion, axis=1, keepdims=True), limit))
                X = given + motion
            for axis, column in enumerate("xyz"):
                block[column][at] = X[:, axis]
                if file.has_normals:
                    block["n" + column][at] = normals[:, axis]
        if progress is not None:
            progress((first + len(block)) / file.vertex_count)

    file.write_moved(target, change)


def _summarize(
    file: PlyFile,
    target: Path,
    seen: Survey,
    plan: Plan | None,
    choice: Choice,
    results: Sequence[PieceResult],
    change: _Change,
    began: float,
) -> PiecesResult:
    square = sum(result.sums.square for result in results)
    warning = join_warnings(choice.warning, change.note)
    if plan is None and choice.noise is not None:
        warning = choice.noise.summary
    setting = {} if plan is None else asdict(plan)
    return PiecesResult(
        output=str(target),
        vertices=file.vertex_count,
        faces=file.face_count,
        filter=choice.filter,
        pieces=len(results),
        rings=0 if plan is None else plan.rings,
        setting={name: setting[name] for name in _SHOWN if name in setting},
        noise=choice.noise,
        displacement=float(np.sqrt(square / file.vertex_count)),
        volume_change=change.volume,
        mean_edge=seen.mean_edge,
        seconds=time.perf_counter() - began,
        warning=warning,
    )

#!/usr/bin/env python3
"""Smooth meshes of rising size in pieces: time and memory, beside the whole where it fits, and a cluster with a loss.

python3 scripts/benchmark_pieces.py                    2, 8, 18 and 50 million triangles; ten minutes, 6 GB of disk
python3 scripts/benchmark_pieces.py --sizes 1 2        in millions of triangles
python3 scripts/benchmark_pieces.py --cluster          also on two Dask workers, one of which is killed
python3 scripts/benchmark_pieces.py --difference       4 million vertices in 1, 5, 16 and 40 pieces, beside the whole
python3 scripts/benchmark_pieces.py --denoise          the edge-aware filter, on folded sheets
python3 scripts/benchmark_pieces.py --out docs         writes pieces.png there, which docs/pieces.md shows

The meshes are corrugated sheets with noise, binary PLY, written in blocks. Memory is that of all processes together, by
their proportional set size, which is looked at four times a second.
"""

import argparse
import contextlib
import json
import os
import signal
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path

import bootstrap

bootstrap.enter("test")

import numpy as np  # noqa: E402
import psutil  # noqa: E402

import meshlab_specsmooth as mss  # noqa: E402
from meshlab_specsmooth.pieces.ply import open_ply, stack  # noqa: E402
from meshlab_specsmooth.pieces.whole import check_memory  # noqa: E402
from meshlab_specsmooth.spectral.response import response  # noqa: E402

HEADER = """ply
format binary_little_endian 1.0
element vertex {n}
property float x
property float y
property float z
element face {m}
property list uchar int vertex_indices
end_header
"""
VERTEX = np.dtype([("x", "<f4"), ("y", "<f4"), ("z", "<f4")])
FACE = np.dtype([("count", "u1"), ("corners", "<i4", 3)])
ROWS = 500
# The whole is smoothed up to this number of millions of triangles
MAX_WHOLE = 20


def write_sheet(path: Path, side: int, noise: float = 0.25, is_folded: bool = False) -> None:
    """Write a corrugated or folded sheet of side x side vertices with noise."""
    rng = np.random.default_rng(0)
    with path.open("wb") as file:
        file.write(HEADER.format(n=side * side, m=2 * (side - 1) ** 2).encode())
        for first in range(0, side, ROWS):
            y, x = np.mgrid[first : min(side, first + ROWS), 0:side].astype(float)
            z = 30 * np.sin(x / 90) * np.cos(y / 120) + 4 * np.sin((x + 2 * y) / 25)
            if is_folded:
                z = 0.8 * np.abs((x + 0.3 * y) % 50 - 25)
            X = np.stack([x, y, z], axis=-1).reshape(-1, 3)
            X += noise * rng.standard_normal(X.shape)
            records = np.empty(len(X), VERTEX)
            records["x"], records["y"], records["z"] = X.T
            records.tofile(file)
        for first in range(0, side - 1, ROWS):
            at = (np.arange(first, min(side - 1, first + ROWS))[:, None] * side + np.arange(side - 1)).ravel()
            records = np.empty((len(at), 2), FACE)
            records["count"] = 3
            records["corners"][:, 0] = np.c_[at, at + 1, at + side + 1]
            records["corners"][:, 1] = np.c_[at, at + side + 1, at + side]
            records.tofile(file)


def measure(command: "list[str]", during=None) -> "tuple[float, float, str]":
    """Seconds, GiB of all processes at their peak, and what was printed."""
    began = time.perf_counter()
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    peak, ended = 0.0, threading.Event()

    def watch() -> None:
        nonlocal peak
        while not ended.wait(0.25):
            total = 0
            try:
                family = [psutil.Process(process.pid), *psutil.Process(process.pid).children(recursive=True)]
            except psutil.Error:
                continue
            for each in family:
                with contextlib.suppress(psutil.Error, ProcessLookupError):  # it has ended meanwhile
                    total += each.memory_full_info().pss
            peak = max(peak, total / 2**30)

    watcher = threading.Thread(target=watch)
    watcher.start()
    if during is not None:
        during(process)
    printed, problem = process.communicate()
    ended.set()
    watcher.join()
    if process.returncode:
        sys.exit(f"{' '.join(command)}\n{problem}")
    return time.perf_counter() - began, peak, printed


def specsmooth(*arguments: object) -> "list[str]":
    return [sys.executable, "-m", "meshlab_specsmooth", *map(str, arguments)]


def run_cluster(source: Path, out: Path, memory: str) -> "tuple[float, str]":
    """Smooth on two workers, one of which is killed when the first piece is done."""
    from distributed import Client, LocalCluster

    with (
        LocalCluster(n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None) as cluster,
        Client(cluster) as client,
    ):

        def kill_one(process: "subprocess.Popen[str]") -> None:
            pids = list(client.run(os.getpid).values())
            folder = out.with_name(out.name + ".pieces")
            while process.poll() is None and not list(folder.glob("result-*.bin")):
                time.sleep(0.2)
            os.kill(pids[0], signal.SIGKILL)
            print(f"  worker {pids[0]} was killed after the first piece", flush=True)

        command = specsmooth(
            "smooth", source, out, "--pieces", "--memory", memory, "--scheduler", cluster.scheduler_address
        )
        seconds, _, printed = measure(command, kill_one)
    return seconds, printed


def compare(a: Path, b: Path) -> float:
    """The largest difference of two results, relative to the RMS displacement is left to the caller; in mesh units."""
    largest = 0.0
    for (_, one), (_, other) in zip(open_ply(a).vertices(), open_ply(b).vertices(), strict=True):
        largest = max(largest, float(np.abs(stack(one) - stack(other)).max()))
    return largest


def measure_difference(side: int = 2000, is_folded: bool = False) -> None:
    """Print a table for one mesh in one piece and in many, beside the whole with the same setting.

    A folded one is denoised, and its pieces are compared with one piece.
    """
    with tempfile.TemporaryDirectory() as temporary:
        source, out = Path(temporary) / "sheet.ply", Path(temporary) / "pieces.ply"
        write_sheet(source, side, is_folded=is_folded)
        file = open_ply(source)
        V, F = stack(file.positions()), np.concatenate([corners for _, corners in file.faces()])
        print("| pieces | limit | rings | seconds | GiB | largest difference, of the RMS displacement |")
        print("|---|---|---|---|---|---|")
        code = "import sys, json, meshlab_specsmooth as mss; "
        code += f"r = mss.{'denoise' if is_folded else 'smooth'}_pieces(*sys.argv[1:3], memory_limit=sys.argv[3]); "
        code += "print(r.summary, file=sys.stderr); weight = r.setting['bands'][0]['barycenter_weight']; "
        code += "print(json.dumps([r.pieces, r.rings, r.setting['cutoff'], weight]))"
        expected = None
        for limit in ("14G", "4G", "2G") if is_folded else ("12G", "2G", "1300M", "1G"):
            command = [sys.executable, "-c", code, str(source), str(out), limit]
            seconds, peak, printed = measure(command)
            count, rings, cutoff, weight = json.loads(printed)
            moved = stack(open_ply(out).positions())
            if expected is None and is_folded:
                expected = moved
            elif expected is None:
                heat = response("heat", cutoff)
                expected = mss.smooth(V, F, response=heat, barycenter_weight=weight, tolerance=1e-7).vertices
            rms = np.sqrt(np.square(expected - V).sum(axis=1).mean())
            error = np.linalg.norm(moved - expected, axis=1).max() / rms
            print(f"| {count} | {limit} | {rings} | {seconds:.0f} | {peak:.2f} | {error:.1e} |", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sizes", type=float, nargs="+", default=[2, 8, 18, 50], help="millions of triangles")
    parser.add_argument("--memory", default="2G")
    parser.add_argument("--cluster", action="store_true")
    parser.add_argument("--difference", action="store_true", help="only the difference to the whole")
    parser.add_argument("--denoise", action="store_true", help="the edge-aware filter, on folded sheets")
    parser.add_argument("--out", type=Path, default=bootstrap.ROOT / "build")
    given = parser.parse_args()
    given.out.mkdir(parents=True, exist_ok=True)
    if given.difference:
        measure_difference(1200 if given.denoise else 2000, given.denoise)
        return
    rows, name = [], "denoise" if given.denoise else "smooth"
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        source, pieces, whole = folder / "sheet.ply", folder / "pieces.ply", folder / "whole.ply"
        for size in given.sizes:
            side = round((size * 1e6 / 2) ** 0.5) + 1
            write_sheet(source, side, is_folded=given.denoise)
            seconds, peak, printed = measure(specsmooth(name, source, pieces, "--pieces", "--memory", given.memory))
            row = {"triangles": 2 * (side - 1) ** 2, "seconds": seconds, "memory": peak}
            print(f"{size:g} million triangles in pieces: {seconds:.1f} s, {peak:.2f} GiB", flush=True)
            print("  " + printed.strip().replace("\n", "\n  "), flush=True)
            if size <= MAX_WHOLE:
                row["whole_seconds"], row["whole_memory"], _ = measure(specsmooth(name, source, whole))
                row["difference"] = compare(pieces, whole)
                print(
                    f"  the whole: {row['whole_seconds']:.1f} s, {row['whole_memory']:.2f} GiB; difference at most "
                    f"{row['difference']:.2g} (each chooses its weight)",
                    flush=True,
                )
            rows.append(row)
        if given.cluster:
            seconds, printed = run_cluster(source, pieces, given.memory)
            print(
                f"on two workers, one of which is killed: {seconds:.1f} s\n  " + printed.strip().replace("\n", "\n  ")
            )
    (given.out / "pieces.json").write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")
    draw(rows, given.out / "pieces.png", given.memory)


def draw(rows: "list[dict[str, float]]", path: Path, limit: str) -> None:
    """Time and memory over size, on logarithmic scales."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9, 3.6), layout="constrained")
    times, memories = figure.subplots(1, 2)
    x = [row["triangles"] for row in rows]
    fits = [row for row in rows if "whole_seconds" in row]
    for axes, name, label in ((times, "seconds", "seconds"), (memories, "memory", "GiB of all processes")):
        axes.loglog(x, [row[name] for row in rows], "o-", label="in pieces")
        axes.loglog([r["triangles"] for r in fits], [r[f"whole_{name}"] for r in fits], "s--", label="the whole")
        axes.set(xlabel="triangles", ylabel=label)
        axes.set_xticks(x, [f"{n / 1e6:g} M" for n in x])
        axes.minorticks_off()
        axes.grid(alpha=0.3)
    times.loglog(x, [rows[0]["seconds"] * n / x[0] for n in x], ":", color="0.5", label="linear")
    memories.set_ylim(0.5, 16)
    memories.set_yticks([0.5, 1, 2, 4, 8, 16], ["0.5", "1", "2", "4", "8", "16"])
    memories.axhline(check_memory(limit) / 2**30, color="0.5", linestyle=":", label=f"limit {limit}")
    for axes in (times, memories):
        axes.legend()
    figure.savefig(path, dpi=110)


if __name__ == "__main__":
    main()

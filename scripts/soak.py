#!/usr/bin/env python3
"""Many meshes through ``specsmooth batch`` while things die, and the figures.

Meshes are made in code, some of them damaged. They are smoothed by processes of this machine; on a Dask cluster of
two workers, one of which is killed in the middle; and by a run that is killed (kill -9) at a random moment, and a
second one that goes on with it. All must give the same outputs, bit for bit, and the right summary.

python3 scripts/soak.py                 200 meshes of 1000 to 200 000 vertices
python3 scripts/soak.py --meshes 40 --largest 20000
"""

import argparse
import hashlib
import json
import os
import struct
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import bootstrap

bootstrap.enter("test")

import numpy as np  # noqa: E402

from meshlab_specsmooth.meshlab import mesh_files, meshset  # noqa: E402

SPECSMOOTH = [sys.executable, "-m", "meshlab_specsmooth", "batch"]
DASK = [sys.executable, "-m", "dask"]
RECORD = ".specsmooth.json"


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--meshes", metavar="N", type=int, default=200, help="how many (default: 200)")
    parser.add_argument("--largest", metavar="N", type=int, default=200_000, help="vertices (default: 200000)")
    parser.add_argument("--seed", metavar="N", type=int, default=1, help="of meshes and moments (default: 1)")
    given = parser.parse_args()
    rng = np.random.default_rng(given.seed)
    wrong: list[str] = []
    with tempfile.TemporaryDirectory(prefix="soak-") as place:
        folder = Path(place)
        sound, damaged, vertices = make(folder / "in", given.meshes, given.largest, rng)
        print(f"{sound + damaged} meshes, {damaged} of them damaged; {vertices} vertices in the others", flush=True)

        here, seconds = run(folder, "local"), last_seconds(folder, "local")
        print(f"on this machine: {describe(here)}, {seconds:.0f} s", flush=True)
        expect(wrong, "the summary of the local run", here, {"done": sound, "failed": damaged})

        at = int(rng.integers(1, sound // 2 + 1))
        there = on_a_cluster(folder, at)
        print(f"on two Dask workers, one killed when {at} were done: {describe(there)}", flush=True)
        all_done = there.get("done", 0) + there.get("skipped", 0)  # recorded by the worker that was killed
        expect(wrong, "the summary of the cluster", (all_done, there.get("failed")), (sound, damaged))

        at = int(rng.integers(1, sound))
        finished = killed(folder, at)
        again = run(folder, "killed")
        kept = sum(stamp == (folder / name).stat().st_mtime_ns for name, stamp in finished.items())
        print(f"kill -9 when {len(finished)} were done: then {describe(again)}; {len(finished) - kept} of these lost")
        expect(wrong, "what was finished", kept, len(finished))
        expect(wrong, "what was skipped", again.get("skipped", 0) >= len(finished), True)
        expect(wrong, "what is done in the end", again.get("skipped", 0) + again.get("done", 0), sound)

        first = digests(folder / "local")
        expect(wrong, "the number of outputs", len(first), sound)
        for other in ("cluster", "killed"):
            same = sum(first[name] == digest for name, digest in digests(folder / other).items() if name in first)
            print(f"outputs of the {other} run equal to the local ones, bit for bit: {same} of {len(first)}")
            expect(wrong, f"the outputs of the {other} run", digests(folder / other) == first, True)
        left = [str(path) for path in folder.rglob(".specsmooth-*")]
        expect(wrong, "what is left of the dead", left, [])
    for line in wrong:
        print("WRONG:", line)
    print("nothing was lost" if not wrong else f"{len(wrong)} things are wrong")
    return 1 if wrong else 0


def expect(wrong: list[str], what: str, found: object, expected: object) -> None:
    if found != expected:
        wrong.append(f"{what}: {found}, expected {expected}")


def make(folder: Path, count: int, largest: int, rng: np.random.Generator) -> tuple[int, int, int]:
    """Sound meshes and a twentieth of damaged ones; how many of each, and the vertices of the sound."""
    folder.mkdir()
    damaged = max(1, count // 20)
    total = 0
    for number in range(count - damaged):
        n = int(1000 * (largest / 1000) ** rng.random())
        V, F = surface(n, int(rng.integers(3)), rng)
        total += len(V)
        ending = ("ply", "ply", "obj", "stl", "off")[number % 5]
        mesh_files.write(meshset.new(V, F), folder / f"scan{number:04}.{ending}")
    whole = (folder / "scan0000.ply").read_bytes()
    header = "ply\nformat binary_little_endian 1.0\nelement vertex {}\n" + "".join(
        f"property float {x}\n" for x in "xyz"
    )
    header += "element face 1\nproperty list uchar int vertex_indices\nend_header\n"
    nan = struct.pack("<12f", 0, 0, 1, np.nan, 0, 0, 1, 0, 0, 0, 1, 0) + b"\0\0"
    damages = [
        ("cut.ply", whole[: len(whole) // 2]),
        ("empty.obj", b""),
        ("garbage.ply", rng.bytes(10_000)),
        ("promising.ply", header.format(4_000_000_000).encode() + bytes(100)),
        ("astray.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n"),
        ("nan.stl", bytes(80) + struct.pack("<I", 1) + nan),
        ("points.off", b"OFF\n3 0 0\n0 0 0\n1 0 0\n0 1 0\n"),
        ("zeros.stl", bytes(1000)),
        ("disguised.stl", whole),
        ("one.obj", b"v 0 0 0\nf 1 1 1\n"),
    ]
    for number in range(damaged):
        name, data = damages[number % len(damages)]
        (folder / f"damaged{number:04}-{name}").write_bytes(data)
    return count - damaged, damaged, total


def surface(n: int, kind: int, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """A noisy torus, closed, or two of very different size, or an open sheet, of about n vertices."""
    if kind == 1:
        (V, F), (W, G) = surface(n // 2, 0, rng), surface(n // 2, 0, rng)
        return np.concatenate([V, 1e-3 * W + 9]), np.concatenate([F, G + len(V)])
    nx, ny = int(np.sqrt(1.6 * n)), int(np.sqrt(n / 1.6))
    i, j = (x.ravel() for x in np.meshgrid(np.arange(nx), np.arange(ny), indexing="ij"))
    s, t = 2 * np.pi * i / nx, 2 * np.pi * j / ny
    ring = 3 + np.cos(t)
    V = np.stack([ring * np.cos(s), ring * np.sin(s), np.sin(t)], axis=1)
    if kind == 2:
        V = np.stack([i, j, np.sin(3 * s) + np.cos(2 * t)], axis=1).astype(float)
    a, b, c, d = (((i + x) % nx) * ny + (j + y) % ny for x, y in ((0, 0), (1, 0), (1, 1), (0, 1)))
    inside = (kind != 2) | ((i < nx - 1) & (j < ny - 1))
    F = np.concatenate([np.stack([a, b, c], axis=1)[inside], np.stack([a, c, d], axis=1)[inside]])
    edge = np.linalg.norm(V[F[:, 0]] - V[F[:, 1]], axis=1).mean()
    return V + 0.2 * edge * rng.standard_normal(V.shape), F


def command(folder: Path, out: str) -> list[str]:
    return [*SPECSMOOTH, str(folder / "in"), "--out", str(folder / out), "--no-pictures"]


def run(folder: Path, out: str, *more: str) -> dict[str, int]:
    """How many meshes have each status."""
    subprocess.run([*command(folder, out), *more], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, check=False)
    counts: dict[str, int] = json.loads((folder / out / "summary.json").read_text())["counts"]
    return counts


def last_seconds(folder: Path, out: str) -> float:
    return float(json.loads((folder / out / "summary.json").read_text())["seconds"])


def describe(counts: dict[str, int]) -> str:
    return ", ".join(f"{count} {status}" for status, count in counts.items())


def records(out: Path) -> list[Path]:
    return list(out.glob(f"*{RECORD}"))


def on_a_cluster(folder: Path, at: int) -> dict[str, int]:
    """A run on two workers, one of which is killed when so many meshes are done."""
    file = folder / "scheduler.json"
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL, "cwd": folder}
    here = ["--host", "127.0.0.1", "--scheduler-file", str(file), "--no-dashboard"]
    processes = [subprocess.Popen([*DASK, "scheduler", *here, "--port", "0"], **quiet)]
    try:
        until(lambda: file.exists() and file.stat().st_size > 0)  # it is made empty, and written in one go
        for _ in range(2):
            worker = [*DASK, "worker", *here, "--nthreads", "1", "--no-nanny", "--local-directory", str(folder)]
            processes.append(
                subprocess.Popen(
                    worker, **quiet, env={**os.environ, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
                )
            )
        address = json.loads(file.read_text())["address"]
        with subprocess.Popen([*command(folder, "cluster"), "--scheduler", address], **quiet) as batch:
            until(lambda: len(records(folder / "cluster")) >= at or batch.poll() is not None)
            processes[1].kill()
        counts: dict[str, int] = json.loads((folder / "cluster" / "summary.json").read_text())["counts"]
        return counts
    finally:
        for process in reversed(processes):
            process.kill()
            process.wait()


def killed(folder: Path, at: int) -> dict[str, int]:
    """Kill a run when so many meshes are done; the records there are then, and when they were written."""
    out = folder / "killed"
    with subprocess.Popen(command(folder, "killed"), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as batch:
        until(lambda: len(records(out)) >= at)
        batch.kill()
    time.sleep(2.0)  # its workers see that they are alone
    return {str(path.relative_to(folder)): path.stat().st_mtime_ns for path in records(out)}


def until(condition) -> None:  # type: ignore[no-untyped-def]
    while not condition():
        time.sleep(0.01)


def digests(out: Path) -> dict[str, str]:
    """Of the meshes in a folder."""
    endings = {".ply", ".obj", ".stl", ".off"}
    meshes = sorted(path for path in out.iterdir() if path.suffix in endings)
    return {path.name: hashlib.sha256(path.read_bytes()).hexdigest() for path in meshes}


if __name__ == "__main__":
    sys.exit(main())

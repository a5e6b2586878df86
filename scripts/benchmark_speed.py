#!/usr/bin/env python3
"""Speed, as ratios in one run: against MeshLab's filters, eigsh with a direct solve, memory bandwidth.

python3 scripts/benchmark_speed.py                    everything; a quarter of an hour on two cores
python3 scripts/benchmark_speed.py --only bridge      one measure (see --help)
python3 scripts/benchmark_speed.py --only front       error against seconds, of other libraries' filters too
python3 scripts/benchmark_speed.py --small --runs 1   a test run of a minute; its figures mean nothing

Every measure runs in a process of its own, after a warm-up; what is compared takes turns, and medians are shown. The
meshes are irregular tori (a random diagonal in each quad) with noise of 0.2 edges. Writes benchmark/speed.txt,
speed.png and front.png.
"""

import argparse
import json
import resource
import statistics
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import bootstrap

PEERS = {"peers", "peers_unheld", "front"}  # compared with other libraries
ALONE = {sys.argv[i + 1] for i, word in enumerate(sys.argv[:-1]) if word in ("--only", "--measure")}
bootstrap.enter("demo" if ALONE and not ALONE & PEERS else "peers")
if "--without-fast" in sys.argv:
    sys.modules["numba"] = None  # as if the extra were not installed

import benchmark_peers  # noqa: E402
import numpy as np  # noqa: E402
import pymeshlab  # noqa: E402
from scipy.sparse import csr_array, diags_array, eye_array  # noqa: E402
from scipy.sparse.linalg import eigsh, splu  # noqa: E402

import meshlab_specsmooth as mss  # noqa: E402
from meshlab_specsmooth.comparison.noise import gaussian  # noqa: E402
from meshlab_specsmooth.geometry.surface import Surface  # noqa: E402
from meshlab_specsmooth.meshlab.filters import apply  # noqa: E402
from meshlab_specsmooth.operators.barycenters import barycenters  # noqa: E402
from meshlab_specsmooth.runtime import blocks  # noqa: E402
from meshlab_specsmooth.spectral import eigenbasis  # noqa: E402

Seconds = dict[str, float]
OURS, EDGE_AWARE = "apply_coord_spectral_smoothing", "apply_coord_edge_aware_smoothing"
PAPER = {"modes": 200, "barycenter_weight": 1.0}  # its setting
WEIGHTS = (0.5, 0.35, 0.25, 0.18, 0.12, 0.09, 0.06, 0.045, 0.03, 0.022, 0.015, 0.01, 0.007)


def torus(vertices: int) -> Surface:
    """A noisy irregular torus with about this number of vertices."""
    clean = benchmark_peers.torus(vertices)
    return Surface(gaussian(clean, 0.2, seed=1), clean.faces)


def shuffled(surface: Surface) -> Surface:
    """The same with its vertices in random order."""
    at = np.random.default_rng(2).permutation(len(surface.vertices))
    return Surface(surface.vertices[at], np.argsort(at)[surface.faces])


def timed(work: Callable[[], object]) -> float:
    start = time.perf_counter()
    work()
    return time.perf_counter() - start


def hold_memory(n: int) -> None:
    """Have the system hold a kibibyte of free memory per vertex, so that a filter's memory only has to be cleared.

    A virtual machine may return free memory to its host within seconds. Getting it back took 3.6 ms per megabyte, where
    clearing takes 0.16 ms: times would depend on what ran before.
    """
    np.empty(128 * n).fill(1.0)


def in_turn(n: int, runs: int, **works: Callable[[], object]) -> Seconds:
    """Median seconds of each function over a number of runs; in each run all take turns."""
    return calls_in_turn(n, runs, **{name: lambda work=work: work for name, work in works.items()})


def filter_call(surface: Surface, name: str) -> Callable[[], object]:
    """A filter with its defaults on a MeshSet that holds the mesh; timed without making the MeshSet."""
    kept = []

    def prepare() -> Callable[[], object]:
        ms = pymeshlab.MeshSet()
        ms.add_mesh(pymeshlab.Mesh(surface.vertices, surface.faces))
        kept[:] = [ms]  # the last one goes only now, and not while the clock runs
        return lambda: apply(ms, name)

    return prepare


def calls_in_turn(n: int, runs: int, **makers: Callable[[], Callable[[], object]]) -> Seconds:
    """The same for calls that are prepared first; the preparation is not timed."""
    seconds = {name: [] for name in makers}
    for _ in range(runs):
        for name, make in makers.items():
            work = make()
            hold_memory(n)
            seconds[name].append(timed(work))
    return {name: statistics.median(of) for name, of in seconds.items()}


def warm_up() -> None:
    """Load what is loaded once: compiled code, threads."""
    small = torus(2_000)
    mss.smooth(small.vertices, small.faces, modes=20)
    filter_call(small, OURS)()()
    filter_call(small, EDGE_AWARE)()()


# --- measures: each runs in a process of its own, with a number of vertices ---


def bridge(n: int, runs: int) -> Seconds:
    warm_up()
    surface = torus(n)
    return calls_in_turn(
        n,
        runs,
        ours=filter_call(surface, OURS),
        taubin=filter_call(surface, "apply_coord_taubin_smoothing"),
        laplacian=filter_call(surface, "apply_coord_laplacian_smoothing"),
        arrays=lambda: lambda: mss.smooth(surface.vertices, surface.faces),
    )


def disorder(n: int, runs: int) -> Seconds:
    warm_up()
    surface = torus(n)
    return calls_in_turn(n, runs, natural=filter_call(surface, OURS), random=filter_call(shuffled(surface), OURS))


def edges(n: int, runs: int) -> Seconds:
    warm_up()
    surface = torus(n)
    return calls_in_turn(
        n, runs, ours=filter_call(surface, EDGE_AWARE), two_step=filter_call(surface, "apply_coord_two_steps_smoothing")
    )


def growth(n: int, runs: int) -> Seconds:
    warm_up()
    surface = torus(n)
    return in_turn(n, runs, ours=lambda: mss.smooth(surface.vertices, surface.faces))


def paper(n: int, runs: int) -> Seconds:
    warm_up()
    surface = torus(n)
    kept = {}
    seconds = in_turn(
        n,
        runs,
        ours=lambda: kept.update(ours=mss.smooth(surface.vertices, surface.faces, **PAPER, method="chebyshev")),
        direct=lambda: kept.update(direct=solve_directly(surface, 200)),
    )
    apart = np.sqrt(((kept["ours"].vertices - kept["direct"]) ** 2).sum(axis=1).mean())
    return seconds | {"apart": apart / kept["ours"].displacement}


def paper_on_scan(n: int, runs: int) -> Seconds:
    """The paper's setting on the bunny of 34 834 vertices in pymeshlab's wheel, its boundary free."""
    warm_up()
    ms = pymeshlab.MeshSet(verbose=False)
    ms.load_new_mesh(str(Path(pymeshlab.__file__).parent / "tests" / "sample_meshes" / "bunny.obj"))
    if n < 30_000:  # a test run
        ms.meshing_decimation_quadric_edge_collapse(targetfacenum=2 * n)
    mesh = ms.current_mesh()
    surface = Surface(np.array(mesh.vertex_matrix()), np.array(mesh.face_matrix()))
    V, F = surface.vertices, surface.faces
    return in_turn(
        n,
        runs,
        ours=lambda: mss.smooth(V, F, **PAPER, boundary="free", method="chebyshev"),
        direct=lambda: solve_directly(surface, 200),
    )


def solve_directly(surface: Surface, modes: int) -> np.ndarray:
    """The paper in the straightforward way: shift-invert eigsh, and the normal equations by sparse LU."""
    V, F, n = surface.vertices, surface.faces, len(surface.vertices)
    sides = np.concatenate([F[:, [0, 1]], F[:, [1, 2]], F[:, [2, 0]]])
    A = csr_array((np.ones(len(sides)), sides.T), shape=(n, n))
    A = ((A + A.T) > 0).astype(float)
    d = A.sum(axis=1)
    L = (eye_array(n) - diags_array(1 / d) @ A).tocsr()
    S = (eye_array(n) - diags_array(d**-0.5) @ A @ diags_array(d**-0.5)).tocsc()
    _, U = eigsh(S + 1e-3 * eye_array(n), k=modes, sigma=0)
    delta, root = L @ V, np.sqrt(d)[:, None]
    filtered = (U @ (U.T @ (delta * root))) / root
    C = barycenters(F, n)
    # a symmetric ordering and no pivoting, as suits a positive definite matrix
    lu = splu(
        (L.T @ L + C.T @ C).tocsc(), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True}
    )
    return lu.solve(L.T @ filtered + C.T @ (C @ V))


def sweep(n: int, runs: int) -> Seconds:
    """One step of the recurrence, and a = b + 3 c over arrays far larger than any cache, by as many threads."""
    ops = mss.assemble(*vars(torus(n)).values())
    L, X = ops.L, ops.positions
    both = [X.copy(), X.copy()]
    a, b, c = np.ones((3, 2 * 10**7))

    def triad(first: int, last: int) -> None:
        one_triad(slice(first * blocks.ROWS, min(last * blocks.ROWS, len(a))), a, b, c)

    one_triad = compiled_triad()

    def steps() -> None:
        for _ in range(20):  # as in a polynomial; the small coefficient of X keeps the numbers bounded
            L.step(X, *both, coefficient=1e-9)
            both.reverse()

    steps()
    blocks.parallel_for(triad, len(a))
    seconds = in_turn(n, max(runs, 5), steps=steps, triad=lambda: blocks.parallel_for(triad, len(a)))
    # neighbors' rows, X and before are read, before is written; so are the indices, where there are no weights to read
    size = len(L.graph.indices) * 4 + L.size * (4 * 24 + 4)
    if L.kernels.name == "scipy":
        size += len(L.graph.indices) * 8
    step = seconds["steps"] / 20
    return {"sweep_rate": size / step / 1e9, "triad_rate": 24 * len(a) / seconds["triad"] / 1e9, "step": step}


def compiled_triad() -> Callable[[slice, np.ndarray, np.ndarray, np.ndarray], None]:
    import numba

    @numba.njit(nogil=True)
    def loop(low, high, a, b, c):
        for i in range(low, high):
            a[i] = b[i] + 3.0 * c[i]

    return lambda at, a, b, c: loop(at.start, at.stop, a, b, c)


def basis(n: int, runs: int) -> Seconds:
    S = mss.assemble(*vars(torus(n)).values()).L.graph.symmetric_laplacian()
    shifted = (S + 1e-3 * eye_array(S.shape[0])).tocsc()
    found = eigenbasis.lowest(S, 200)
    off = S @ found.vectors - found.vectors * found.eigenvalues
    seconds = in_turn(n, runs, ours=lambda: eigenbasis.lowest(S, 200), eigsh=lambda: eigsh(shifted, k=200, sigma=0))
    return seconds | {"residual": float(np.linalg.norm(off, axis=0).max())}


def peers(n: int, runs: int, held: bool = True) -> Seconds:
    """Ours, arrays to arrays, beside filters of other libraries: seconds, theta in degrees and E_v in edges."""
    warm_up()
    clean, given = benchmark_peers.torus(n), torus(n)
    V, F = given.vertices, given.faces
    works = {
        "ours": lambda: mss.smooth(V, F).vertices,
        "given_005": lambda: mss.smooth(V, F, barycenter_weight=0.05).vertices,
        "given_05": lambda: mss.smooth(V, F, barycenter_weight=0.5).vertices,
        "denoise": lambda: mss.denoise(V, F).vertices,
    }
    for name, peer in benchmark_peers.defaults().items():
        works[name] = lambda peer=peer: peer(V, F)
    kept = {}
    found = in_turn(n if held else 0, runs, **{k: lambda k=k, f=f: kept.update({k: f()}) for k, f in works.items()})
    for name, X in kept.items():
        found[f"{name} theta"], found[f"{name} Ev"] = benchmark_peers.errors(X, clean)
    return found


def peers_unheld(n: int, runs: int) -> Seconds:
    """The same without memory held ready by the system."""
    return peers(n, runs, held=False)


def weights(n: int, runs: int) -> Seconds:
    """Theta of the automatic weight, and the lowest over a grid of given ones."""
    del runs
    clean, given = benchmark_peers.torus(n), torus(n)
    ops = mss.assemble(given.vertices, given.faces)
    automatic = mss.smooth(ops)
    grid = {w: benchmark_peers.errors(mss.smooth(ops, barycenter_weight=w).vertices, clean) for w in WEIGHTS}
    best = min(grid, key=lambda w: grid[w])
    theta, error = benchmark_peers.errors(automatic.vertices, clean)
    return {
        "automatic": theta,
        "Ev": error,
        "weight": automatic.barycenter_weight,
        "best": grid[best][0],
        "best Ev": min(each[1] for each in grid.values()),
        "best weight": best,
    }


def front(n: int, runs: int) -> Seconds:
    """Seconds, theta and E_v of every filter at several strengths, flat: "filter | strength | what"."""
    warm_up()
    clean, given = benchmark_peers.torus(n), torus(n)
    V, F = given.vertices, given.faces
    works = {("specsmooth, automatic", ""): lambda V, F: mss.smooth(V, F).vertices}
    for w in WEIGHTS:
        works["specsmooth, weight given", f"{w:g}"] = lambda V, F, w=w: mss.smooth(V, F, barycenter_weight=w).vertices
    works |= benchmark_peers.strengths()
    found = {}
    for (name, strength), work in works.items():
        seconds = []
        for _ in range(runs):
            hold_memory(n)
            start = time.perf_counter()
            X = work(V, F)
            seconds.append(time.perf_counter() - start)
        values = (statistics.median(seconds), *benchmark_peers.errors(X, clean))
        for what, value in zip(("seconds", "theta", "Ev"), values, strict=True):
            found[f"{name} | {strength} | {what}"] = value
    return found


def slider(n: int, runs: int) -> Seconds:
    """Further calls on the same operators, each with another cut-off, response and weight."""
    surface = torus(n)
    # in a fresh process: what is loaded once is part of a user's first call
    first_ever = timed(lambda: mss.smooth(surface.vertices, surface.faces, **PAPER))
    ops, workspace = mss.assemble(surface.vertices, surface.faces), mss.Workspace()
    settings = [
        {"modes": modes, "barycenter_weight": weight, "response": response}
        for modes in (150, 200, 300)
        for weight in (1.0, 0.7)
        for response in ("ideal", "butterworth")
    ]
    kept = {"start": mss.smooth(ops, **PAPER, workspace=workspace)}

    def move(given: dict[str, object]) -> None:
        kept.update(
            start=mss.smooth(ops, **kept, **given, workspace=workspace)
        )  # from the last answer, as a slider does

    further = [timed(lambda given=given: move(given)) for _ in range(runs) for given in settings]
    first = in_turn(n, runs, first=lambda: mss.smooth(surface.vertices, surface.faces, **PAPER))["first"]
    return {"first_ever": first_ever, "first": first, "next": statistics.median(further)}


def memory(n: int, runs: int) -> Seconds:
    """Peak memory of the process during a call, beyond that before it, in bytes per vertex."""
    del runs
    warm_up()
    surface = torus(n)
    held = int(Path("/proc/self/statm").read_text(encoding="utf-8").split()[1]) * resource.getpagesize()
    Path("/proc/self/clear_refs").write_text("5", encoding="utf-8")  # the peak counts from now
    seconds = timed(lambda: mss.smooth(surface.vertices, surface.faces))
    peak = next(line for line in Path("/proc/self/status").read_text(encoding="utf-8").splitlines() if "VmHWM" in line)
    return {"bytes": (int(peak.split()[1]) * 1024 - held) / n, "seconds": seconds}


MEASURES = {
    f.__name__: f
    for f in (
        bridge,
        peers,
        peers_unheld,
        weights,
        front,
        disorder,
        edges,
        growth,
        paper,
        paper_on_scan,
        sweep,
        basis,
        slider,
        memory,
    )
}

# --- the table ---


class Run:
    """Measures by name, made once."""

    def __init__(self, runs: int, small: bool, only: "list[str] | None") -> None:
        self.runs, self.small, self.only = runs, small, only
        self.made: dict[tuple[str, int, bool], Seconds] = {}

    def of(self, name: str, n: int, fast: bool = True, runs: "int | None" = None) -> Seconds:
        if self.small:
            n = max(3_000, n // 1000)
        if (name, n, fast) not in self.made:
            print(f"  measuring: {name}, {n} vertices{'' if fast else ', without the extra fast'} ...", flush=True)
            command = [sys.executable, __file__, "--measure", name, "--vertices", str(n)]
            command += ["--runs", str(runs or self.runs)] + ([] if fast else ["--without-fast"])
            done = subprocess.run(command, stdout=subprocess.PIPE, text=True, check=True)
            self.made[name, n, fast] = json.loads(done.stdout.splitlines()[-1])
        return self.made[name, n, fast]

    def wants(self, name: str) -> bool:
        return self.only is None or name in self.only


def rows(run: Run) -> "list[tuple[str, str, str, bool]]":
    """What, figure, wanted, reached."""
    table = []

    def row(what: str, figure: float, wanted: float, parts: str, at_least: bool) -> None:
        sign, reached = ("at least", figure >= wanted) if at_least else ("at most", figure <= wanted)
        table.append((f"{what} ({parts})", f"{figure:.3g}", f"{sign} {wanted:g}", reached))

    million, four = 10**6, 4 * 10**6
    if run.wants("bridge"):
        with_, without = run.of("bridge", million), run.of("bridge", million, fast=False)
        for name, s, wanted in (("with", with_, 0.65), ("without", without, 1.5)):
            parts = f"{s['ours']:.2f} s / {s['taubin']:.2f} s"
            row(f"1M vertices, MeshSet, {name} the extra: ours / Taubin", s["ours"] / s["taubin"], wanted, parts, False)
        alone = run.of("growth", million)["ours"]  # in a process that holds no MeshSet, as users of arrays have it
        parts = f"{alone:.2f} s / {with_['taubin']:.2f} s; {with_['arrays']:.2f} s in the process that ran Taubin"
        row("1M vertices, arrays: ours / Taubin", alone / with_["taubin"], 0.35, parts, False)
    for name in ("peers", "peers_unheld"):
        if not run.wants(name):
            continue
        s, how = run.of(name, million), "" if name == "peers" else ", memory not held"
        for peer, title, wanted in (
            ("windowed_sinc", "PyVista's windowed sinc", 1.0),
            ("relax", "MeshLib's relax, 5", 1.2),
            ("relax_keep_volume", "MeshLib's relaxKeepVolume, 5", 1.2),
        ):
            if peer not in s:
                print(f"  {title} is not installed")
                continue
            parts = (
                f"{s['ours']:.2f} s / {s[peer]:.2f} s; theta {s['ours theta']:.2f} / {s[f'{peer} theta']:.2f}, "
                f"Ev {s['ours Ev']:.4f} / {s[f'{peer} Ev']:.4f}"
            )
            row(f"1M vertices, arrays{how}: ours / {title}", s["ours"] / s[peer], wanted, parts, False)
        if "windowed_sinc" in s:
            parts = f"{s['denoise']:.2f} s / {s['windowed_sinc']:.2f} s; theta {s['denoise theta']:.2f}"
            what = f"1M vertices, arrays{how}: denoise / PyVista's windowed sinc"
            row(what, s["denoise"] / s["windowed_sinc"], 6, parts, False)
        parts = f"{s['given_005']:.2f} s / {s['given_05']:.2f} s"
        row(f"1M vertices{how}: weight 0.05 / weight 0.5", s["given_005"] / s["given_05"], 1.8, parts, False)
    if run.wants("weights"):
        s = run.of("weights", million)
        parts = (
            f"{s['automatic']:.3f} at {s['weight']:.3g} / {s['best']:.3f} at {s['best weight']:g}; "
            f"Ev {s['Ev']:.4f} / {s['best Ev']:.4f}"
        )
        row("1M vertices: theta, automatic / best weight of a grid", s["automatic"] / s["best"], 1.05, parts, False)
    if run.wants("disorder"):
        s = run.of("disorder", million)
        parts = f"{s['random']:.2f} s / {s['natural']:.2f} s"
        row("1M vertices, MeshSet: random order / natural order", s["random"] / s["natural"], 1.4, parts, False)
    if run.wants("edges"):
        for n, wanted in ((37_500, 4), (million, 1)):
            s = run.of("edges", n)
            parts = f"{s['ours']:.2f} s / {s['two_step']:.2f} s"
            what = f"{n} vertices, MeshSet: edge-aware / MeshLab's two-step"
            row(what, s["ours"] / s["two_step"], wanted, parts, False)
    if run.wants("paper"):
        for n, wanted in ((37_500, 100), (134_000, 200)):
            s = run.of("paper", n)
            parts = f"{s['direct']:.1f} s / {s['ours']:.3f} s; {100 * s['apart']:.2f} % of the displacement apart"
            row(f"{n} vertices, modes=200: eigsh + direct solve / ours", s["direct"] / s["ours"], wanted, parts, True)
    if run.wants("paper_on_scan"):
        s = run.of("paper_on_scan", 35_000)
        parts = f"{s['direct']:.1f} s / {s['ours']:.3f} s"
        row("bunny, modes=200: eigsh + direct solve / ours", s["direct"] / s["ours"], 120, parts, True)
    if run.wants("growth"):
        one, other = run.of("growth", million)["ours"], run.of("growth", four)["ours"]
        row("arrays: 4M vertices / 1M vertices", other / one, 4.4, f"{other:.2f} s / {one:.2f} s", False)
    if run.wants("sweep"):
        s = run.of("sweep", million)
        parts = f"{s['sweep_rate']:.1f} GB/s / {s['triad_rate']:.1f} GB/s; {1e3 * s['step']:.1f} ms"
        row("a sweep over 1M vertices: bytes a second / triad", s["sweep_rate"] / s["triad_rate"], 0.5, parts, True)
    if run.wants("basis"):
        s = run.of("basis", 37_500)
        parts = f"{s['eigsh']:.1f} s / {s['ours']:.2f} s; residuals below {s['residual']:.0e}"
        row("200 eigenpairs of 37500 vertices: eigsh / ours", s["eigsh"] / s["ours"], 4, parts, True)
    if run.wants("slider"):
        s = run.of("slider", 35_000)
        for name, first in (("first in a process", s["first_ever"]), ("first, all loaded", s["first"])):
            parts = f"{1e3 * first:.0f} ms / {1e3 * s['next']:.0f} ms"
            row(f"35000 vertices, assembled: {name} / next call", first / s["next"], 20, parts, True)
    if run.wants("memory"):
        s = run.of("memory", four)
        row(
            "4M vertices, arrays: peak bytes a vertex beyond the input", s["bytes"], 600, f"{s['seconds']:.1f} s", False
        )
    return table


def plot(run: Run, place: Path) -> None:
    """Seconds over vertices, both logarithmic."""
    import matplotlib as mpl

    mpl.use("Agg")
    from matplotlib import pyplot

    sizes = [3_000, 10_000, 30_000, 100_000, 300_000, 1_000_000]
    lines: dict[str, list[float]] = {}
    for n in sizes:
        with_, without = run.of("bridge", n), run.of("bridge", n, fast=False)
        values = {
            "MeshLab Taubin": with_["taubin"],
            "MeshLab Laplacian": with_["laplacian"],
            "ours on a MeshSet": with_["ours"],
            "ours on a MeshSet, without the extra": without["ours"],
            "ours on arrays": with_["arrays"],
        }
        for name, seconds in values.items():
            lines.setdefault(name, []).append(seconds)
    figure, axes = pyplot.subplots(figsize=(8, 5.5), dpi=120)
    styles = {"MeshLab Taubin": "C3o-", "MeshLab Laplacian": "C1o-", "ours on arrays": "C0s:"}
    for name, seconds in lines.items():
        style = styles.get(name, "C0s--" if "without" in name else "C0s-")
        axes.loglog(sizes, seconds, style, label=name, markersize=4)
    if run.wants("paper"):
        solved = [(n, run.of("paper", n)["direct"]) for n in (3_000, 10_000, 37_500, 134_000)]
        axes.loglog(*zip(*solved, strict=True), "k^-", label="eigsh and a direct solve, 200 modes", markersize=4)
    axes.set(xlabel="vertices", ylabel="seconds", title="Smoothing an irregular torus, default settings")
    axes.grid(visible=True, which="both", alpha=0.25)
    axes.legend(fontsize=8)
    figure.tight_layout()
    figure.savefig(place)


def plot_front(found: Seconds, place: Path) -> None:
    """Theta and E_v over seconds, all logarithmic, the strengths of a filter joined."""
    import matplotlib as mpl

    mpl.use("Agg")
    from matplotlib import pyplot

    points: dict[str, dict[str, dict[str, float]]] = {}
    for key, value in found.items():
        name, strength, what = key.split(" | ")
        points.setdefault(name, {}).setdefault(strength, {})[what] = value
    figure, both = pyplot.subplots(1, 2, figsize=(13, 5.5), dpi=120)
    for axes, what, label in zip(
        both, ("theta", "Ev"), ("angle between normals (degrees)", "E_v (edges)"), strict=True
    ):
        for name, strengths in points.items():
            ours = name.startswith("specsmooth")
            style = "*" if "automatic" in name else "o-"
            axes.loglog(
                [each["seconds"] for each in strengths.values()],
                [each[what] for each in strengths.values()],
                style,
                color="black" if ours else None,
                label=name,
                markersize=14 if "automatic" in name else 4,
                zorder=3 if ours else 2,
            )
            for strength, each in strengths.items():
                axes.annotate(
                    strength, (each["seconds"], each[what]), fontsize=6, xytext=(3, 3), textcoords="offset points"
                )
        axes.set(xlabel="seconds", ylabel=label)
        axes.grid(visible=True, which="both", alpha=0.25)
    both[0].legend(fontsize=8)
    figure.suptitle(
        "Error against time: an irregular torus of a million vertices, noise of 0.2 edges; labels are strengths"
    )
    figure.tight_layout()
    figure.savefig(place)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=int, default=3, help="the median of so many is shown (default: 3)")
    parser.add_argument("--only", action="append", choices=MEASURES, help="this measure, without the plot; repeatable")
    parser.add_argument("--small", action="store_true", help="meshes a thousand times smaller")
    parser.add_argument("--out", metavar="DIR", default="benchmark", help="folder (default: benchmark)")
    parser.add_argument("--measure", choices=MEASURES, help=argparse.SUPPRESS)
    parser.add_argument("--vertices", type=int, help=argparse.SUPPRESS)
    parser.add_argument("--without-fast", action="store_true", help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.measure:
        print(json.dumps(MEASURES[given.measure](given.vertices, given.runs)))
        return
    run = Run(given.runs, given.small, given.only)
    lines = [
        f"{what:115} {figure:>8}  {wanted:14} {'' if reached else 'MISSED'}"
        for what, figure, wanted, reached in rows(run)
    ]
    text = f"medians of {given.runs}, {blocks.threads()} processors\n\n" + "\n".join(line.rstrip() for line in lines)
    print(text)
    out = Path(given.out)
    out.mkdir(parents=True, exist_ok=True)
    (out / "speed.txt").write_text(text + "\n", encoding="utf-8")
    if run.wants("front"):
        plot_front(run.of("front", 10**6), out / "front.png")
        print(f"\nplot: {out / 'front.png'}")
    if given.only is None:
        plot(run, out / "speed.png")
        print(f"\nplot: {out / 'speed.png'}")


if __name__ == "__main__":
    main()

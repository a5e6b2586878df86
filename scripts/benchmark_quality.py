#!/usr/bin/env python3
"""Quality: filters on noisy meshes with a known truth, MeshLab's tuned on it, this package's without a parameter.

python3 scripts/benchmark_quality.py                          pairs made in code (see scripts/pairs.py)
python3 scripts/benchmark_quality.py --pairs DIR --json FILE  pairs NAME_noisy.obj, NAME_truth.obj (.ply, .off)
python3 scripts/benchmark_quality.py --peers                  also filters of other packages, which it installs first
python3 scripts/benchmark_quality.py --small                  a test run of a minute; its figures mean nothing

Writes quality.md, quality.json and one picture for each pair into a folder (--out). Columns: theta, mean angle between
the normals of faces and the true ones, in degrees; Ev, distance of the vertices to the true surface, and RMS, distance
to their true positions, both in mean edges; volume, its change in per cent, for closed meshes; flips, percentage of
flipped faces; s, seconds from arrays to arrays. A tuned filter has a row for its least theta and one for its least Ev,
each the best of a grid, which is listed below the tables.
"""

import argparse
import hashlib
import importlib.util
import json
import math
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path

import bootstrap

bootstrap.enter("demo")

import benchmark_filters  # noqa: E402
import numpy as np  # noqa: E402
import pairs  # noqa: E402
from benchmark_filters import Setting, TunedFilter  # noqa: E402

import meshlab_specsmooth as mss  # noqa: E402
from meshlab_specsmooth.arrays import Floats  # noqa: E402
from meshlab_specsmooth.comparison import metrics  # noqa: E402
from meshlab_specsmooth.geometry.surface import Surface, mean_edge_length  # noqa: E402
from meshlab_specsmooth.meshlab import mesh_files, meshset  # noqa: E402
from meshlab_specsmooth.reports.pictures import Panel, front, picture  # noqa: E402
from meshlab_specsmooth.runtime import atomic  # noqa: E402

# A result whose vertices are further from the truth than this on average, in mean edges, has diverged
_MAX_ERROR = 10.0


@dataclass(frozen=True)
class Pair:
    """A noisy surface and its truth, with the same faces."""

    name: str
    noisy: Surface
    truth: Surface

    @property
    def key(self) -> str:
        """A hash of the arrays."""
        arrays = (self.noisy.vertices, self.truth.vertices, self.truth.faces)
        return hashlib.sha256(b"".join(np.ascontiguousarray(a).tobytes() for a in arrays)).hexdigest()[:16]


# The columns: the key of the error, the heading, the format
COLUMNS = (
    ("normal_error", "theta", "6.2f"),
    ("surface_error", "Ev", "6.3f"),
    ("vertex_error", "RMS", "6.3f"),
    ("volume", "volume", "+7.3f"),
    ("flips", "flips", "6.2f"),
    ("seconds", "s", "6.2f"),
)
# What filters are tuned for
TARGETS = {"theta": "normal_error", "Ev": "surface_error"}


@dataclass(frozen=True)
class Row:
    """A measured result: ``best_for`` is "default", or the target for which the setting is the best of the grid."""

    method: str
    group: str
    best_for: str
    setting: Setting
    values: "dict[str, float]" = field(default_factory=dict)
    failure: str = ""


# --- pairs ---


def pairs_of(folder: Path, only: "Sequence[str] | None") -> "Iterator[Pair]":
    for noisy in sorted(folder.glob("*_noisy.*")):
        name, truth = noisy.stem.removesuffix("_noisy"), noisy.with_name(noisy.name.replace("_noisy", "_truth"))
        if noisy.suffix.lower() in {".obj", ".ply", ".off"} and truth.is_file() and (not only or name in only):
            both = [Surface(*meshset.get_arrays(mesh_files.read(file))) for file in (noisy, truth)]
            if not np.array_equal(both[0].faces, both[1].faces):
                sys.exit(f"{noisy} and {truth} do not have the same faces")
            yield Pair(name, *both)


def made_pairs(vertices: int, only: "Sequence[str] | None") -> "Iterator[Pair]":
    for name in only or pairs.PAIRS:
        yield Pair(name, *pairs.make(name, vertices))


def warm_up() -> None:
    """Make a first call, so that one-time loading and compilation are not timed."""
    noisy, _ = pairs.make("torus_gaussian_0.3", 1500)
    mss.smooth(noisy.vertices, noisy.faces, modes=20)


# --- measuring ---

NOISY = TunedFilter("noisy", "noisy", lambda vertices, faces: vertices)


def run_or_reason(pair: Pair, method: TunedFilter, setting: Setting) -> "tuple[Floats | None, float, str]":
    """Return the vertices, or None after a failure; the seconds; and the reason of the failure."""
    start = time.perf_counter()
    try:
        vertices = method.run(pair.noisy.vertices, pair.noisy.faces, **setting)
    except Exception as error:  # a foreign filter may raise anything
        reason = f"fails: {' '.join(str(error).split())[:80] or type(error).__name__}"
        return None, time.perf_counter() - start, reason
    seconds = time.perf_counter() - start
    if not np.isfinite(vertices).all() or mean_distance(vertices, pair) > _MAX_ERROR:
        return None, seconds, "diverges"
    return vertices, seconds, ""


def mean_distance(vertices: Floats, pair: Pair) -> float:
    """Mean of the largest coordinate differences in mean edges; unlike a square, it does not overflow."""
    with np.errstate(over="ignore"):
        return float(np.abs(vertices - pair.truth.vertices).max(axis=1).mean()) / mean_edge_length(pair.truth)


def measure(pair: Pair, method: TunedFilter, best_for: str, setting: Setting) -> Row:
    vertices, seconds, failure = run_or_reason(pair, method, setting)
    values = {"seconds": seconds}
    if vertices is not None:
        result = Surface(vertices, pair.truth.faces)
        values |= metrics.measure_errors(result, pair.truth)
        values["surface_error"] = metrics.surface_error(result, pair.truth)
    return Row(method.name, method.group, best_for, setting, values, failure)


def measure_method(pair: Pair, method: TunedFilter) -> "list[Row]":
    """Rows for the default, and for the settings of the grid that are the best for each target."""
    rows = [] if method.default is None else [measure(pair, method, "default", method.default)]
    candidates = [measure(pair, method, "", setting) for setting in method.settings()]
    # the default is a setting as well, and may be the best of all
    finished = [row for row in candidates + rows if not row.failure]
    if method.grid and finished:
        for target, key in TARGETS.items():
            rows.append(replace(min(finished, key=lambda row: row.values[key]), best_for=target))
    return rows


class Reference:
    """Rows of tuned filters, kept in a file under a hash of the arrays, the filter and its grid."""

    def __init__(self, path: "Path | None") -> None:
        self.path = path
        self.kept = json.loads(path.read_text(encoding="utf-8")) if path and path.is_file() else {}

    def rows(self, pair: Pair, method: TunedFilter) -> "list[Row]":
        if method.group == "ours":
            return measure_method(pair, method)
        facts = json.dumps([method.name, method.default, method.grid])
        key = f"{pair.name} {pair.key} {method.name} {hashlib.sha256(facts.encode()).hexdigest()[:16]}"
        if key not in self.kept:
            self.kept[key] = [asdict(row) for row in measure_method(pair, method)]
            if self.path:
                atomic.write_text(self.path, json.dumps(self.kept, indent=1))
        return [Row(**row) for row in self.kept[key]]


# --- tables ---


def best(rows: "Sequence[Row]", groups: "Sequence[str]", key: str) -> "Row | None":
    finished = [row for row in rows if row.group in groups and not row.failure]
    return min(finished, key=lambda row: row.values[key], default=None)


def table(pair: Pair, rows: "Sequence[Row]") -> "list[str]":
    """Return a Markdown table whose columns are aligned as text."""
    headings = [f"{title:>{_width(form)}}" for _, title, form in COLUMNS]
    rules = [f"{'-' * _width(form)}:" for _, _, form in COLUMNS]
    lines = [
        f"### {pair.name}: {len(pair.truth.vertices)} vertices",
        "",
        f"| {'':30} | {'best for':8} | {' | '.join(headings)} | setting",
        f"|-{'-' * 30}-|-{'-' * 8}-|-{'|-'.join(rules)}|---",
    ]
    for row in rows:
        setting = ", ".join(f"{name}={value:.4g}" for name, value in row.setting.items())
        cells = [f"{row.values[key]:{form}}" if key in row.values else " " * _width(form) for key, _, form in COLUMNS]
        cells = [f"{row.method:30}", f"{row.best_for:8}", *cells, row.failure or setting]
        lines.append(f"| {' | '.join(cells)}".rstrip())
    return [*lines, ""]


def _width(form: str) -> int:
    return int(form.strip("+").split(".")[0])


def summary(results: "dict[str, list[Row]]", against: str, groups: "Sequence[str]") -> "list[str]":
    """Compare each of this package's filters with the best of some groups on each pair."""
    names = dict.fromkeys(row.method for rows in results.values() for row in rows if row.group == "ours")
    lines = []
    for name in names:
        for title, key in TARGETS.items():
            ratios = {
                pair: row.values[key] / other.values[key]
                for pair, rows in results.items()
                for row in rows
                if row.method == name and not row.failure and (other := best(rows, groups, key))
            }
            if ratios:
                mean = math.exp(sum(map(math.log, ratios.values())) / len(ratios))
                worst = max(ratios, key=lambda pair: ratios[pair])
                fine = sum(ratio <= 1 for ratio in ratios.values())
                lines.append(
                    f"| {name:30} | {against:8} | {title:5} | {mean:14.3f} | {fine:3d} of {len(ratios):<3d} | "
                    f"{ratios[worst]:6.3f} | {worst}"
                )
    return lines


def by_group(results: "dict[str, list[Row]]", against: str, groups: "Sequence[str]") -> "list[str]":
    """The same geometric means for each kind of pairs made in code."""
    kinds: dict[str, dict[str, list[Row]]] = {}
    for name, rows in results.items():
        if name in pairs.PAIRS:
            kinds.setdefault(pairs.group_of(name), {})[name] = rows
    lines = []
    for kind, members in kinds.items():
        for name in dict.fromkeys(row.method for rows in members.values() for row in rows if row.group == "ours"):
            means = []
            for key in TARGETS.values():
                logs = [
                    math.log(row.values[key] / other.values[key])
                    for rows in members.values()
                    for row in rows
                    if row.method == name and not row.failure and (other := best(rows, groups, key))
                ]
                means.append(f"{math.exp(sum(logs) / len(logs)):6.3f}" if logs else "      ")
            lines.append(f"| {kind:16} | {len(members):5d} | {name:30} | {against:8} | {' | '.join(means)}")
    return lines


def report(results: "dict[str, list[Row]]", found: "dict[str, Pair]", methods: "Sequence[TunedFilter]") -> str:
    lines = [line for name, rows in results.items() for line in table(found[name], rows)]
    lines += [
        "### Ours / best of the tuned",
        "",
        f"| {'':30} | {'against':8} | {'':5} | geometric mean | no worse   |  worst | on",
        f"|-{'-' * 30}-|-{'-' * 8}-|-{'-' * 5}-|---------------:|------------|-------:|---",
    ]
    tuned = list(dict.fromkeys(c.group for c in methods if c.group != "ours"))
    for group in tuned:
        lines += summary(results, group, [group])
    lines += summary(results, "all", tuned)
    lines += [
        "",
        "### The same by what pairs stand for",
        "",
        f"| {'kind':16} | pairs | {'':30} | {'against':8} | {' | '.join(f'{name:>6}' for name in TARGETS)}",
        f"|-{'-' * 16}-|------:|-{'-' * 30}-|-{'-' * 8}-|{'|'.join('-------:' for _ in TARGETS)}",
    ]
    for group in tuned:
        lines += by_group(results, group, [group])
    lines += ["", "### Grids", ""]
    for method in methods:
        if method.grid:
            grid = "; ".join(f"{name}: {', '.join(map(str, values))}" for name, values in method.grid.items())
            lines.append(f"- {method.name}: {grid}")
    return "\n".join(lines)


def draw(pair: Pair, rows: "Sequence[Row]", methods: "Sequence[TunedFilter]", place: Path) -> None:
    """Draw the noisy mesh, the truth, and the best results of MeshLab and of this package by theta."""
    panels = [Panel(f"{pair.name}\nnoisy", pair.noisy), Panel("truth", pair.truth)]
    for group in ("MeshLab", "ours"):
        row = best(rows, [group], "normal_error")
        if row is not None:
            method = next(m for m in methods if m.name == row.method)
            vertices = method.run(pair.noisy.vertices, pair.noisy.faces, **row.setting)
            tuned = ", tuned" if row.best_for != "default" else ""
            errors = f"{row.values['normal_error']:.2f} degrees, {row.values['surface_error']:.3f} edges"
            title = f"{row.method}{tuned}\n{errors}"
            panels.append(Panel(title, Surface(vertices, pair.truth.faces)))
    picture(place, panels, [front(pair.truth)])


def install(packages: "dict[str, str]") -> None:
    """Install packages whose modules are missing; the filters of one that cannot be installed have rows that fail.

    They go into a folder of their own, which is searched last, so that their dependencies do not replace the package's.
    """
    folder = bootstrap.ENVIRONMENT / "peers"
    sys.path.append(str(folder))
    for module, package in packages.items():
        if importlib.util.find_spec(module) is None:
            print(f"installing {package} ...", flush=True)
            pip = [sys.executable, "-m", "pip", "--disable-pip-version-check", "install", "--quiet"]
            subprocess.run([*pip, "--upgrade", "--target", str(folder), package], check=False)


def arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--pairs", metavar="DIR", type=Path, help="folder of pairs (default: pairs made in code)")
    parser.add_argument("--only", metavar="PAIR", action="append", help="this pair alone; repeatable")
    parser.add_argument("--methods", metavar="WORD", action="append", help="those with this in their names; repeatable")
    parser.add_argument(
        "--peers", action="store_true", help=f"with those of {', '.join(benchmark_filters.PEER_PACKAGES)} too"
    )
    parser.add_argument("--json", metavar="FILE", type=Path, help="all rows (default: quality.json in the folder)")
    parser.add_argument("--out", metavar="DIR", type=Path, default=Path("benchmark"), help="(default: benchmark)")
    parser.add_argument("--reference", metavar="FILE", type=Path, help="keep what was tuned in it, and take it from it")
    parser.add_argument("--vertices", metavar="N", type=int, default=6000, help="of pairs made in code (default: 6000)")
    parser.add_argument(
        "--small", action="store_true", help="two values of each parameter, on two made pairs of 600 vertices"
    )
    parser.add_argument("--no-pictures", action="store_true", help="tables only")
    given = parser.parse_args()
    if given.small and not given.pairs:
        given.vertices, given.only = 600, given.only or ["block_gaussian_0.3", "relief_quantized_0.5"]
    return given


def main() -> None:
    given = arguments()
    if given.peers:
        install(benchmark_filters.PEER_PACKAGES)
    wanted = [
        *benchmark_filters.MESHLAB,
        *benchmark_filters.PAPER,
        *(benchmark_filters.PEERS if given.peers else ()),
        *benchmark_filters.OURS,
    ]
    wanted = [c for c in wanted if not given.methods or any(word in c.name for word in given.methods)]
    if given.small:
        wanted = [benchmark_filters.coarse(c) for c in wanted]
    given.out.mkdir(parents=True, exist_ok=True)
    warm_up()
    reference = Reference(given.reference)
    results, found = {}, {}
    for pair in pairs_of(given.pairs, given.only) if given.pairs else made_pairs(given.vertices, given.only):
        rows = measure_method(pair, NOISY)
        for method in wanted:
            rows += reference.rows(pair, method)
        results[pair.name], found[pair.name] = rows, pair
        print("\n".join(table(pair, rows)), flush=True)
        if not given.no_pictures:
            draw(pair, rows, wanted, given.out / f"{pair.name}.png")
    if not results:
        sys.exit("no pairs")
    text = report(results, found, wanted)
    print(text[text.index("### Ours") :])
    atomic.write_text(given.out / "quality.md", text + "\n")
    data = {name: [asdict(row) for row in rows] for name, rows in results.items()}
    atomic.write_text(given.json or given.out / "quality.json", json.dumps(data, indent=1))


if __name__ == "__main__":
    main()
